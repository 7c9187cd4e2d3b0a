//! Holds what a verdict says against the oracle.

use crate::oracle::{Bernstein, Oracle, Signs, det_above, determinant, exact};
use dashu_int::IBig;
use dashu_ratio::RBig;
use ffd_core::{
    Border, ConicHull, Degree, Evidence, Knots, Lattice, Method, Outcome, Place, Theorem, Verdict,
};
use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;
use std::rc::Rc;

/// Whether the oracle could confirm all that was claimed. What it can refute is an error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Standing {
    Confirmed,
    /// The oracle gave up before.
    Open,
}

type Det<const D: usize> = Rc<(Bernstein<IBig, D>, IBig)>;

/// What is known about one lattice, found out when it is needed.
pub(crate) struct Judge<'a, const D: usize> {
    lattice: &'a Lattice<D>,
    pub(crate) oracle: Oracle<'a, D>,
    boxes: usize,
    /// The determinant over a cell, and what stands for 1 there.
    dets: RefCell<BTreeMap<[usize; D], Det<D>>>,
    /// Of each cell, and of all.
    cell_signs: RefCell<BTreeMap<[usize; D], Signs>>,
    signs: Cell<Option<Signs>>,
}

/// All methods that can be asked for.
pub(crate) fn methods() -> Vec<Method> {
    let mut methods = vec![Method::Exact, Method::Paper];
    methods.extend(sufficient_methods());
    methods
}

/// Those that prove regularity or nothing.
pub(crate) fn sufficient_methods() -> Vec<Method> {
    let mut methods = vec![Method::Phi, Method::ChoiLee];
    for one_for_all in [false, true] {
        for off_axis in [false, true] {
            for subdivisions in 0..=2 {
                methods.push(Method::Conic(ConicHull {
                    one_for_all,
                    subdivisions,
                    off_axis,
                }));
            }
        }
    }
    methods
}

impl<'a, const D: usize> Judge<'a, D> {
    /// With the number of parts into which the oracle may cut a cell.
    pub(crate) fn new(lattice: &'a Lattice<D>, boxes: usize) -> Self {
        Self {
            lattice,
            oracle: Oracle::new(lattice),
            boxes,
            dets: RefCell::default(),
            cell_signs: RefCell::default(),
            signs: Cell::new(None),
        }
    }

    fn det(&self, cell: [usize; D]) -> Det<D> {
        let mut known = self.dets.borrow_mut();
        let det = || Rc::new(self.oracle.det(cell));
        known.entry(cell).or_insert_with(det).clone()
    }

    /// The signs of det J in a cell.
    pub(crate) fn cell_signs(&self, cell: [usize; D]) -> Signs {
        let mut known = self.cell_signs.borrow_mut();
        *known
            .entry(cell)
            .or_insert_with(|| self.det(cell).0.signs(self.boxes))
    }

    /// The signs of det J on the domain; not all of them, perhaps, if it has both.
    pub(crate) fn signs(&self) -> Signs {
        if let Some(signs) = self.signs.get() {
            return signs;
        }
        let mut signs = Signs::default();
        for cell in self.oracle.all_cells() {
            signs = signs.with(self.cell_signs(cell));
            if signs.both() {
                break;
            }
        }
        self.signs.set(Some(signs));
        signs
    }

    /// Every claim of a verdict.
    pub(crate) fn check(&self, verdict: &Verdict<D>) -> Result<Standing, String> {
        let standings = [
            self.check_outcome(&verdict.outcome)?,
            self.check_enclosure(verdict)?,
            self.check_irregular_cells(verdict)?,
        ];
        Ok(if standings.contains(&Standing::Open) {
            Standing::Open
        } else {
            Standing::Confirmed
        })
    }

    /// Claims that `found` has no signs but those `allowed`.
    fn only(found: Signs, allowed: Signs, claim: &str) -> Result<Standing, String> {
        let refuted = (found.positive && !allowed.positive)
            || (found.negative && !allowed.negative)
            || (found.zero && !allowed.zero);
        match (refuted, found.open) {
            (true, _) => Err(format!("{claim}, but det J has the signs {found:?}")),
            (false, true) => Ok(Standing::Open),
            (false, false) => Ok(Standing::Confirmed),
        }
    }

    /// What a verdict says of the whole map.
    pub(crate) fn check_outcome(&self, outcome: &Outcome<D>) -> Result<Standing, String> {
        let name = outcome.name();
        let none = Signs::default();
        match outcome {
            Outcome::Injective(theorem) => {
                self.check_theorem(theorem)?;
                let positive = Signs {
                    positive: true,
                    ..none
                };
                Self::only(self.signs(), positive, name)
            }
            Outcome::LocallyInjective => {
                let positive = Signs {
                    positive: true,
                    ..none
                };
                Self::only(self.signs(), positive, name)
            }
            Outcome::Reversed => {
                let negative = Signs {
                    negative: true,
                    ..none
                };
                Self::only(self.signs(), negative, name)
            }
            Outcome::NotInjective(Evidence::BothSigns { positive, negative }) => {
                let (above, below) = (self.det_at(positive)?, self.det_at(negative)?);
                if above <= RBig::ZERO || below >= RBig::ZERO {
                    let [above, below] = [above, below].map(|x| x.to_f64().value());
                    return Err(format!(
                        "{name} by det J = {above} at {positive:?} and {below} at {negative:?}"
                    ));
                }
                self.signs.set(Some(Signs {
                    positive: true,
                    negative: true,
                    ..none
                }));
                Ok(Standing::Confirmed)
            }
            Outcome::NotInjective(Evidence::Overlap {
                point,
                other,
                radius,
            }) => {
                self.check_place(point)?;
                self.check_place(other)?;
                self.oracle
                    .prove_overlap(point, other, *radius)
                    .map_err(|e| format!("{outcome:?}: {e}"))?;
                Ok(Standing::Confirmed)
            }
            Outcome::Degenerate { zero, reversed } => {
                let value = self.det_at(zero)?;
                if !value.is_zero() {
                    let value = value.to_f64().value();
                    return Err(format!("{name} by det J = {value} at {zero:?}"));
                }
                let allowed = Signs {
                    positive: !reversed,
                    negative: *reversed,
                    zero: true,
                    ..none
                };
                Self::only(self.signs(), allowed, name)
            }
            Outcome::Undecided(doubt) => {
                let inside = (0..D).all(|i| {
                    let [low, high] = doubt.part[i];
                    doubt.cell[i] < self.oracle.cells[i] && 0.0 <= low && low <= high && high <= 1.0
                });
                if !inside {
                    return Err(format!("no part of a cell: {doubt:?}"));
                }
                // Bounds hold at every corner and in the middle, for example.
                for t in [
                    doubt.part.map(|[low, _]| low),
                    doubt.part.map(|[_, high]| high),
                    doubt.part.map(|[low, high]| f64::midpoint(low, high)),
                ] {
                    let value = self.oracle.det_at(doubt.cell, t);
                    let [low, high] = doubt.det;
                    let outside = (low.is_finite() && exact(low) > value)
                        || (high.is_finite() && exact(high) < value)
                        || low.is_nan()
                        || high.is_nan()
                        || low > high;
                    if outside {
                        let value = value.to_f64().value();
                        return Err(format!("det J = {value} at {t:?} within {doubt:?}"));
                    }
                }
                Ok(Standing::Confirmed)
            }
            _ => Err(format!("{outcome:?} is not known to the tests")),
        }
    }

    /// What a theorem presupposes, where that can be seen.
    fn check_theorem(&self, theorem: &Theorem<D>) -> Result<(), String> {
        let grid = self.lattice.grid();
        let holds = match theorem {
            Theorem::IdentityBorder => grid.border() == Border::Identity,
            Theorem::DisplacementBound => {
                // The constants of Choi and Lee for cubic lattices, rounded down; along a
                // clamped axis of degree n slopes of the basis add up to 2 n at the ends.
                let clamped = (0..D).filter(|&a| grid.knots()[a] == Knots::Clamped);
                let ends: f64 = clamped.map(|a| 2.0 * grid.degree()[a].get() as f64).sum();
                let uniform_cubic = ends == 0.0 && grid.degree() == [Degree::CUBIC; D];
                let constant = match (uniform_cubic, D) {
                    (false, _) => ends,
                    (true, 2) => 2.046,
                    (true, _) => 2.479,
                };
                let inverse = grid.frame().inverse();
                self.lattice.displacements().iter().all(|d| {
                    (0..D).all(|i| {
                        let along: f64 = (0..D).map(|c| inverse[i][c] * d[c]).sum();
                        along.abs() * constant < 1.0
                    })
                })
            }
            Theorem::PMatrix { after } => self.some_jacobians(after).iter().all(is_p_matrix),
            Theorem::Monotone { after } => self.some_jacobians(after).iter().all(|m| {
                let symmetric: [[RBig; D]; D] =
                    std::array::from_fn(|r| std::array::from_fn(|c| &m[r][c] + &m[c][r]));
                // For symmetric matrices that is to be positive definite.
                is_p_matrix(&symmetric)
            }),
            _ => true,
        };
        if holds {
            Ok(())
        } else {
            Err(format!("what {theorem:?} presupposes does not hold"))
        }
    }

    /// C J in lattice coordinates at two opposite corners and in the middle of the cells
    /// at both ends of the domain.
    fn some_jacobians(&self, after: &[[f64; D]; D]) -> Vec<[[RBig; D]; D]> {
        let mut products = Vec::new();
        for cell in [[0; D], self.oracle.cells.map(|n| n - 1)] {
            for t in [0.0, 0.5, 1.0] {
                let j = self.oracle.lattice_jacobian(cell, [t; D]);
                products.push(std::array::from_fn(|r| {
                    std::array::from_fn(|c| {
                        (0..D).fold(RBig::ZERO, |sum, k| sum + exact(after[r][k]) * &j[k][c])
                    })
                }));
            }
        }
        products
    }

    /// det J at a place of the domain, whose world position is right up to rounding.
    fn det_at(&self, place: &Place<D>) -> Result<RBig, String> {
        self.check_place(place)?;
        Ok(self.oracle.det_at(place.cell, place.t))
    }

    fn check_place(&self, place: &Place<D>) -> Result<(), String> {
        let inside = (0..D)
            .all(|i| place.cell[i] < self.oracle.cells[i] && (0.0..=1.0).contains(&place.t[i]));
        if !inside {
            return Err(format!("{place:?} is not in the domain"));
        }
        let frame = self.lattice.grid().frame();
        let expected = self.oracle.position(place.cell, place.t);
        for c in 0..D {
            // The lattice coordinate, the product with each axis, and their sums are
            // rounded, each by ε/2 of at most the sum of all absolute terms.
            let size = (0..D).fold(frame.origin()[c].abs(), |sum, i| {
                sum + (self.oracle.cells[i] + self.oracle.layers[i]) as f64
                    * frame.axes()[i][c].abs()
            });
            let error = (exact(place.world[c]) - &expected[c]).to_f64().value();
            if error.abs() > 4.0 * f64::EPSILON * size + f64::from_bits(8) {
                return Err(format!("{place:?} is {error} from there"));
            }
        }
        Ok(())
    }

    /// The interval of a verdict contains the minimum of det J.
    fn check_enclosure(&self, verdict: &Verdict<D>) -> Result<Standing, String> {
        let [low, high] = verdict.min_det;
        if low.is_nan() || high.is_nan() || low > high {
            return Err(format!("no interval: {:?}", verdict.min_det));
        }
        let mut standing = Standing::Confirmed;
        if verdict.is_regular() && low < 0.0 {
            return Err(format!("{low} bounds the minimum of a regular map"));
        }
        // Zero as a lower bound of a regular map is no new claim.
        if low.is_finite() && !(verdict.is_regular() && low <= 0.0) {
            for cell in self.oracle.all_cells() {
                let signs = det_above(&self.det(cell), low).signs(self.boxes);
                if signs.negative {
                    return Err(format!("det J is below {low} in {cell:?}"));
                }
                if signs.open {
                    standing = Standing::Open;
                }
            }
        }
        if high.is_finite() {
            let mut open = false;
            // Most often a corner will do.
            let reached = [0, self.boxes].into_iter().any(|boxes| {
                open = false;
                self.oracle.all_cells().into_iter().any(|cell| {
                    let signs = det_above(&self.det(cell), high).signs(boxes);
                    open |= signs.open;
                    signs.negative || signs.zero
                })
            });
            if !reached && !open {
                return Err(format!("det J is above {high} everywhere"));
            }
            if !reached {
                standing = Standing::Open;
            }
        }
        Ok(standing)
    }

    /// Cells named are not regular.
    fn check_irregular_cells(&self, verdict: &Verdict<D>) -> Result<Standing, String> {
        let mut standing = Standing::Confirmed;
        let regular = verdict.is_regular() || matches!(verdict.outcome, Outcome::Reversed);
        if regular && !verdict.irregular_cells.is_empty() {
            return Err(format!("irregular cells in {verdict:?}"));
        }
        for &cell in &verdict.irregular_cells {
            let signs = self.cell_signs(cell);
            if signs.only_positive() {
                return Err(format!("{cell:?} is regular"));
            }
            if !signs.negative && !signs.zero {
                standing = Standing::Open;
            }
        }
        Ok(standing)
    }
}

/// Whether all principal minors are positive.
fn is_p_matrix<const D: usize>(m: &[[RBig; D]; D]) -> bool {
    let pairs = (0..D).all(|a| {
        m[a][a] > RBig::ZERO
            && (0..a).all(|b| &m[a][a] * &m[b][b] - &m[a][b] * &m[b][a] > RBig::ZERO)
    });
    pairs && determinant(m) > RBig::ZERO
}
