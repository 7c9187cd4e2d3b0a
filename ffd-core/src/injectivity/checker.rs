//! The test of a lattice, and of one that changes.

use super::boundary::{self, Boundary};
use super::global;
use super::search::{Search, Sign, State};
use super::verdict::{Evidence, Map, Outcome, Theorem, Verdict};
use super::{CheckOptions, Method, sufficient};
use crate::{Border, FfdError, Lattice};

/// The test of a lattice that changes: only what was touched is tested again.
///
/// # Example
///
/// ```
/// use ffd_core::{CheckOptions, Checker, Degree, Frame, Grid, Lattice, Outcome};
///
/// let grid = Grid::new([Degree::CUBIC; 2], [4, 4], Frame::unit())?;
/// let mut lattice = Lattice::at_rest(grid)?;
/// let mut checker = Checker::new(&lattice, &CheckOptions::default());
/// assert!(checker.verdict().is_injective());
///
/// lattice.set_displacement(24, [2.5, 0.0])?;
/// let verdict = checker.update(&lattice, &[24])?;
/// assert!(matches!(verdict.outcome, Outcome::NotInjective(_)));
/// # Ok::<(), ffd_core::FfdError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Checker<const D: usize> {
    grid: crate::Grid<D>,
    options: CheckOptions,
    pub(super) search: Search<D>,
    pub(super) verdict: Verdict<D>,
}

impl<const D: usize> Checker<D> {
    /// Tests a lattice for the first time.
    #[must_use]
    pub fn new(lattice: &Lattice<D>, options: &CheckOptions) -> Self {
        Self::with_threads(lattice, options, false)
    }

    /// [`Checker::new`], with many cells at a time on the threads of the current rayon
    /// pool, now and in updates. The verdicts are the same.
    #[cfg(feature = "rayon")]
    #[must_use]
    pub fn par_new(lattice: &Lattice<D>, options: &CheckOptions) -> Self {
        Self::with_threads(lattice, options, true)
    }

    fn with_threads(lattice: &Lattice<D>, options: &CheckOptions, parallel: bool) -> Self {
        let mut search = Search::new(lattice, parallel);
        if sufficient::uses_cones(options.method) {
            search.test_cones();
        }
        let verdict = judge(lattice, options, &mut search);
        Self {
            grid: lattice.grid().clone(),
            options: *options,
            search,
            verdict,
        }
    }

    /// The last verdict.
    #[must_use]
    pub fn verdict(&self) -> &Verdict<D> {
        &self.verdict
    }

    /// Tests the lattice again after the control points in `moved` (linear indices) were
    /// displaced, and no others since the last test. The outcome is the one that
    /// [`Lattice::check`] would give, as far as the budget lasts; the places named may be
    /// others.
    ///
    /// # Errors
    ///
    /// [`FfdError::GridMismatch`] for a lattice on another grid.
    ///
    /// # Panics
    ///
    /// If a control point does not exist.
    pub fn update(
        &mut self,
        lattice: &Lattice<D>,
        moved: &[usize],
    ) -> Result<&Verdict<D>, FfdError> {
        if *lattice.grid() != self.grid {
            return Err(FfdError::GridMismatch);
        }
        self.search.touch(lattice, moved);
        self.verdict = judge(lattice, &self.options, &mut self.search);
        Ok(&self.verdict)
    }
}

/// The verdict, from what is known of all cells after the conic-hull test.
fn judge<const D: usize>(
    lattice: &Lattice<D>,
    options: &CheckOptions,
    search: &mut Search<D>,
) -> Verdict<D> {
    search.begin();
    if options.method != Method::Exact {
        return sufficient::judge(lattice, options, search);
    }
    let all_cones = search.states.iter().all(|s| matches!(s, State::Cones));
    let sign = if all_cones {
        Sign::Positive
    } else {
        search.decide(lattice, &options.budget, options.all_cells)
    };
    let outcome = match sign {
        Sign::Positive => globally(lattice, options, search, all_cones),
        Sign::Negative => Outcome::Reversed,
        Sign::Both { positive, negative } => {
            Outcome::NotInjective(Evidence::BothSigns { positive, negative })
        }
        Sign::Zero { zero, reversed } => Outcome::Degenerate { zero, reversed },
        Sign::Undecided(undecided) => Outcome::Undecided(undecided),
    };
    let regular = matches!(sign, Sign::Positive);
    let min_det = match (options.enclose, sign) {
        (
            _,
            Sign::Zero {
                reversed: false, ..
            },
        ) => [0.0, 0.0],
        (None, _) => search.seen(regular),
        (Some(width), _) => {
            let [low, high] = search.enclose(width, &options.budget);
            // What is known from before may be better where the budget was spent.
            let [least, most] = search.seen(regular);
            [low.max(least), high.min(most)]
        }
    };
    let cells = |wanted: fn(&State<D>) -> bool| {
        let states = search.states.iter().enumerate();
        let found = states.filter(|(_, state)| wanted(state));
        found.map(|(cell, _)| search.partials.cell(cell)).collect()
    };
    let irregular_cells = if matches!(sign, Sign::Negative) {
        Vec::new()
    } else {
        cells(|s| matches!(s, State::Folded(_) | State::Zero(_) | State::Negative))
    };
    let doubtful_cells = cells(|s| matches!(s, State::Doubtful(_)));
    Verdict {
        map: Map::BSpline,
        method: options.method,
        outcome,
        min_det,
        irregular_cells,
        doubtful_cells,
        effort: search.effort,
    }
}

/// Whether a regular map is globally injective: by the first theorem that says so, the
/// cheapest ones tried first, or not at all.
pub(super) fn globally<const D: usize>(
    lattice: &Lattice<D>,
    options: &CheckOptions,
    search: &mut Search<D>,
    all_cones: bool,
) -> Outcome<D> {
    if lattice.grid().border() == Border::Identity {
        return Outcome::Injective(Theorem::IdentityBorder);
    }
    let smooth = search.partials.degree.iter().all(|&n| n >= 2);
    if all_cones && smooth {
        let after =
            std::array::from_fn(|r| std::array::from_fn(|c| crate::frame::unit_entry(r, c)));
        return Outcome::Injective(Theorem::PMatrix { after });
    }
    if !options.global {
        return Outcome::LocallyInjective;
    }
    search.partials.prepare();
    if let Some(theorem) = global::find(&search.partials) {
        return Outcome::Injective(theorem);
    }
    if !search.partials.is_sound() {
        return Outcome::LocallyInjective;
    }
    let budget = options.budget.boxes;
    let budget = budget.saturating_add(search.partials.cell_count());
    let (found, pairs) = boundary::test(lattice, budget);
    search.effort.boxes += pairs;
    match found {
        Boundary::OneToOne => Outcome::Injective(Theorem::InjectiveBoundary),
        Boundary::Overlap(overlap) => {
            let place = |(cell, t)| search.place(lattice, search.partials.number(cell), t);
            Outcome::NotInjective(Evidence::Overlap {
                point: place(overlap.point),
                other: place(overlap.other),
                radius: overlap.radius,
            })
        }
        Boundary::Unknown => Outcome::LocallyInjective,
    }
}
