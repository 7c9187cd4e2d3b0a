//! Direct manipulation that cannot fold: a pull is split into steps that are injective.
//!
//! \[GD01\], section 8 and appendix (`InjectSubdiv`): a pull that fails the test is cut
//! into halves, which are applied one after the other; the second begins where the first
//! has left the points. Since every step is a lattice of its own, what a sequence of them
//! can do goes far beyond what one lattice can.

use super::{Constraint, DirectError, DirectManipulation, Fit, Merged, PullOptions};
use crate::{
    Border, Budget, CheckOptions, ConicHull, Grid, Lattice, Method, Sequence, StepOptions, Verdict,
};

/// A step is at least 2^-52 of a pull: fractions are exact numbers.
const DEEPEST: u32 = 52;

/// What [`StepPolicy::Greedy`] takes of the largest safe step, so that it ends away from
/// the fold.
const SAFE_PART: f64 = 0.9;

/// The relative width to which the largest safe step is found out: well below what is left
/// of it.
const STEP_WIDTH: f64 = 1e-2;

/// How a pull is split into steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub enum StepPolicy {
    /// As \[GD01\]: steps that fail the conic-hull test of each cell are halved. Where a
    /// step of the shortest length fails, the whole pull is refused.
    Paper,
    /// All that is left is tried, and halved until it passes the exact test, again and
    /// again. Where a step of the shortest length fails, what was achieved is returned.
    #[default]
    Exact,
    /// Nine tenths of the [largest safe step](Lattice::largest_safe_step) are taken, or, so
    /// that the last step is not a small one, as many equal parts of what is left as come
    /// closest to that. Not always the fewest steps, as a step that passes through a fold
    /// can end without one, but all poses on the straight way to a step are regular as well.
    Greedy,
}

/// How to pull without folding.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InjectiveOptions<'a> {
    /// How the pull is split.
    pub policy: StepPolicy,
    /// The border of all steps, in place of that of the grid. With the
    /// [identity](Border::Identity), the default, each step is one-to-one on all of
    /// space, and so are all of them together. With a [free](Border::Free) border they are
    /// regular: see [`InjectivePull::scope`]. Grids with clamped knots need that one.
    pub border: Border,
    /// How often the pull may be halved: a step is at least 2^-depth of it. The recursion
    /// depth of \[GD01\], counted from 0. At most 52.
    pub depth: u32,
    /// How well constraints are met, and which control points do not move.
    pub pull: PullOptions<'a>,
    /// The work that the test of one step may do. A step that is undecided counts as one
    /// that folds.
    pub budget: Budget,
}

impl Default for InjectiveOptions<'_> {
    /// The exact test, an identity border, steps from a thousandth of the pull on.
    fn default() -> Self {
        Self {
            policy: StepPolicy::default(),
            border: Border::Identity,
            depth: 10,
            pull: PullOptions::default(),
            budget: Budget::default(),
        }
    }
}

/// A pull in steps none of which folds.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct InjectivePull<const D: usize> {
    /// The steps, in the order in which they are to be applied. None if nothing was to
    /// move, or nothing could.
    pub sequence: Sequence<D>,
    /// For each step, what was proven of it.
    pub verdicts: Vec<Verdict<D>>,
    /// For each step, how much of the displacements is achieved after it, up to 1.
    pub fractions: Vec<f64>,
    /// How much is achieved after all: 1 unless the pull stopped early.
    pub achieved: f64,
    /// Why it stopped early.
    pub stopped: Option<Stopped<D>>,
    /// Where the points of the constraints are after all steps.
    pub points: Vec<[f64; D]>,
    /// For each constraint, what its point still lacks of its displacement.
    pub residuals: Vec<[f64; D]>,
    /// Constraints on the same point as an earlier one, in ascending order.
    pub merged: Vec<Merged>,
}

/// Why a pull ended before its points were where they should be.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Stopped<const D: usize> {
    /// The next step of the shortest length allowed was not proven regular.
    Folds {
        /// What was found of it.
        verdict: Box<Verdict<D>>,
    },
    /// It was, but not all poses on the straight way to it, which [`StepPolicy::Greedy`]
    /// asks for.
    FoldsOnTheWay {
        /// Where on that way, from 0 to 1: [`SafeStep::t`](crate::SafeStep::t).
        t: [f64; 2],
    },
    /// From where the points are now, no lattice moves them on: points that were apart
    /// have met, or one has left the lattice.
    Constraints(DirectError),
}

impl<const D: usize> std::fmt::Display for Stopped<D> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Folds { verdict } => {
                write!(f, "the shortest step is {}", verdict.outcome.name())
            }
            Self::FoldsOnTheWay { t } => {
                write!(
                    f,
                    "the shortest step may fold on its way, from t = {} on",
                    t[0]
                )
            }
            Self::Constraints(error) => write!(f, "no further step exists: {error}"),
        }
    }
}

/// What is proven of the steps of a pull together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Scope {
    /// They are one-to-one on all of space.
    Space,
    /// Each is one-to-one on its domain. Together they are where each takes its domain into
    /// that of the next: a point that leaves the domain stays where it is from then on, and
    /// another may come to lie on it.
    EachStep,
    /// Each is regular on its domain: one-to-one near every point.
    Local,
}

impl<const D: usize> InjectivePull<D> {
    /// What is proven of all steps together.
    #[must_use]
    pub fn scope(&self) -> Scope {
        let borders = self.sequence.lattices().iter().map(|l| l.grid().border());
        if borders.into_iter().all(|b| b == Border::Identity) {
            Scope::Space
        } else if self.verdicts.iter().all(Verdict::is_injective) {
            Scope::EachStep
        } else {
            Scope::Local
        }
    }

    /// The length of the longest residual.
    #[must_use]
    pub fn largest_residual(&self) -> f64 {
        self.residuals.iter().map(length).fold(0.0, f64::max)
    }
}

impl<const D: usize> Grid<D> {
    /// Pulls points to where they should be, in steps none of which folds.
    ///
    /// The lattices returned are on this grid (with the border of the options), each from
    /// rest; the points of the constraints are where they are before the first. With
    /// [`Fit::Exact`] each step makes up for the rounding errors of those before it.
    ///
    /// A pull that succeeds only in part is no error: [`InjectivePull::stopped`] says why.
    ///
    /// # Errors
    ///
    /// If there is no lattice that does what is asked, whether it folds or not: those of
    /// [`DirectManipulation::with_weights`], [`DirectManipulation::solve_into`] and
    /// [`Grid::with_border`].
    ///
    /// # Example
    ///
    /// Farther than a single lattice could without a fold:
    ///
    /// ```
    /// use ffd_core::{Constraint, Degree, Frame, Grid, InjectiveOptions, Scope};
    ///
    /// let grid = Grid::new([Degree::CUBIC; 2], [6, 6], Frame::unit())?;
    /// let constraint = Constraint::new([2.0, 3.0], [2.5, 0.0]);
    /// let pull = grid.injective_pull(&[constraint], &InjectiveOptions::default())?;
    /// assert!(pull.achieved == 1.0 && pull.stopped.is_none());
    /// assert!(pull.sequence.lattices().len() > 1 && pull.scope() == Scope::Space);
    ///
    /// let [x, y] = pull.sequence.deform_point([2.0, 3.0]);
    /// assert!((x - 4.5).abs() < 1e-9 && (y - 3.0).abs() < 1e-9);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn injective_pull(
        &self,
        constraints: &[Constraint<D>],
        options: &InjectiveOptions<'_>,
    ) -> Result<InjectivePull<D>, DirectError> {
        let grid = self.clone().with_border(options.border)?;
        let mut stepper = Stepper::new(grid, constraints, options)?;
        // Refused at once: what not even a lattice that folds could do.
        stepper.solve(1.0)?;
        let shortest = 0.5_f64.powi(options.depth.min(DEEPEST).cast_signed());
        let stopped = match options.policy {
            StepPolicy::Paper | StepPolicy::Exact => stepper.halve(shortest),
            StepPolicy::Greedy => stepper.stride(shortest),
        };
        if stopped.is_some() && options.policy == StepPolicy::Paper {
            stepper = Stepper::new(stepper.grid, constraints, options)?;
        }
        Ok(stepper.finish(stopped))
    }
}

/// A pull on its way.
struct Stepper<'a, const D: usize> {
    grid: Grid<D>,
    constraints: &'a [Constraint<D>],
    weights: Vec<f64>,
    options: &'a InjectiveOptions<'a>,
    check: CheckOptions,
    /// Where the points are now, and how to move them from there.
    points: Vec<[f64; D]>,
    manipulation: DirectManipulation<D>,
    merged: Vec<Merged>,
    displacements: Vec<[f64; D]>,
    /// The step that is tried.
    step: Lattice<D>,
    changes: Vec<[f64; D]>,
    steps: Vec<Lattice<D>>,
    verdicts: Vec<Verdict<D>>,
    fractions: Vec<f64>,
    achieved: f64,
}

impl<'a, const D: usize> Stepper<'a, D> {
    fn new(
        grid: Grid<D>,
        constraints: &'a [Constraint<D>],
        options: &'a InjectiveOptions<'a>,
    ) -> Result<Self, DirectError> {
        let points: Vec<_> = constraints.iter().map(|c| c.point).collect();
        let weights: Vec<_> = constraints.iter().map(|c| c.weight).collect();
        let manipulation =
            DirectManipulation::with_weights(&grid, &points, &weights, &options.pull)?;
        let method = match options.policy {
            StepPolicy::Paper => Method::Conic(ConicHull::default()),
            StepPolicy::Exact | StepPolicy::Greedy => Method::Exact,
        };
        let step = Lattice::at_rest(grid.clone())?;
        Ok(Self {
            merged: manipulation.merged().to_vec(),
            displacements: vec![[0.0; D]; points.len()],
            changes: step.displacements().to_vec(),
            grid,
            constraints,
            weights,
            options,
            check: CheckOptions {
                method,
                budget: options.budget,
                ..CheckOptions::default()
            },
            points,
            manipulation,
            step,
            steps: Vec::new(),
            verdicts: Vec::new(),
            fractions: Vec::new(),
            achieved: 0.0,
        })
    }

    /// Makes [`Self::step`] what takes the points from where they are to the given fraction
    /// of their ways.
    fn solve(&mut self, fraction: f64) -> Result<(), DirectError> {
        let part = fraction - self.achieved;
        let all = self.constraints.iter().zip(&self.points);
        for ((constraint, point), displacement) in all.zip(&mut self.displacements) {
            for c in 0..D {
                displacement[c] = if self.options.pull.fit == Fit::Exact && self.achieved > 0.0 {
                    // What earlier steps lack is made up for. A constraint that is not met
                    // exactly is not made stiffer by that.
                    constraint.point[c] + fraction * constraint.displacement[c] - point[c]
                } else {
                    part * constraint.displacement[c]
                };
            }
        }
        self.manipulation
            .solve_into(&self.displacements, &mut self.changes)?;
        self.step.set_displacements(&self.changes)?;
        Ok(())
    }

    /// Takes [`Self::step`], after which the given fraction is achieved.
    fn accept(&mut self, fraction: f64, verdict: Verdict<D>) {
        for point in &mut self.points {
            *point = self.step.deform_point(*point);
        }
        self.steps.push(self.step.clone());
        self.verdicts.push(verdict);
        self.fractions.push(fraction);
        self.achieved = fraction;
    }

    /// Prepares to move the points from where they are now.
    fn move_on(&mut self) -> Result<(), DirectError> {
        self.manipulation = DirectManipulation::with_weights(
            &self.grid,
            &self.points,
            &self.weights,
            &self.options.pull,
        )?;
        Ok(())
    }

    /// Solves for a fraction and tests the step.
    fn attempt(&mut self, fraction: f64) -> Result<Verdict<D>, Stopped<D>> {
        self.solve(fraction).map_err(Stopped::Constraints)?;
        Ok(self.step.check(&self.check))
    }

    /// `InjectSubdiv` of \[GD01\], with a stack in place of the recursion: the ends of the
    /// parts that are still to be done, the next one last. The exact policy forgets them
    /// after each step and tries all that is left: fewer steps, for a few tests more.
    fn halve(&mut self, shortest: f64) -> Option<Stopped<D>> {
        let mut ends = vec![1.0];
        while let Some(&end) = ends.last() {
            let verdict = match self.attempt(end) {
                Ok(verdict) => verdict,
                Err(stopped) => return Some(stopped),
            };
            if verdict.is_regular() {
                self.take(end, verdict);
                if end >= 1.0 {
                    return None;
                }
                match self.options.policy {
                    StepPolicy::Paper => ends.truncate(ends.len() - 1),
                    _ => ends.truncate(1),
                }
                if let Err(error) = self.move_on() {
                    return Some(Stopped::Constraints(error));
                }
            } else if end - self.achieved < 2.0 * shortest {
                let verdict = Box::new(verdict);
                return Some(Stopped::Folds { verdict });
            } else {
                ends.push(f64::midpoint(self.achieved, end));
            }
        }
        None
    }

    /// Nine tenths of the largest safe step again and again, in equal parts.
    fn stride(&mut self, shortest: f64) -> Option<Stopped<D>> {
        let rest = Lattice::at_rest(self.grid.clone()).ok()?;
        let options = StepOptions {
            width: STEP_WIDTH,
            budget: self.options.budget,
        };
        loop {
            if let Err(error) = self.solve(1.0) {
                return Some(Stopped::Constraints(error));
            }
            let way = |step: &Lattice<D>| {
                let safe = rest.largest_safe_step(step, &options);
                safe.expect("both are on the same grid").t
            };
            let [safe, _] = way(&self.step);
            let left = 1.0 - self.achieved;
            let mut part = if safe >= 1.0 {
                left
            } else {
                left / (1.0 / (SAFE_PART * safe)).ceil()
            };
            // The step is certified as it is stored, rounded.
            loop {
                if part.is_nan() || part < shortest.min(left) {
                    part = shortest.min(left);
                }
                let end = if part >= left {
                    1.0
                } else {
                    self.achieved + part
                };
                let verdict = match self.attempt(end) {
                    Ok(verdict) => verdict,
                    Err(stopped) => return Some(stopped),
                };
                let stopped = if verdict.is_regular() {
                    // So is the way to it, rounded or raised to the shortest as it may be.
                    let t = way(&self.step);
                    if t[0] >= 1.0 {
                        self.take(end, verdict);
                        break;
                    }
                    Stopped::FoldsOnTheWay { t }
                } else {
                    let verdict = Box::new(verdict);
                    Stopped::Folds { verdict }
                };
                if part <= shortest {
                    return Some(stopped);
                }
                part *= 0.5;
            }
            if self.achieved >= 1.0 {
                return None;
            }
            if let Err(error) = self.move_on() {
                return Some(Stopped::Constraints(error));
            }
        }
    }

    /// [`Self::accept`], but for a step that moves nothing.
    fn take(&mut self, end: f64, verdict: Verdict<D>) {
        if self.changes.as_flattened().iter().all(|&x| x == 0.0) {
            self.achieved = end;
        } else {
            self.accept(end, verdict);
        }
    }

    fn finish(self, stopped: Option<Stopped<D>>) -> InjectivePull<D> {
        let all = self.constraints.iter().zip(&self.points);
        let residual = |(constraint, point): (&Constraint<D>, &[f64; D])| {
            std::array::from_fn(|c| constraint.point[c] + constraint.displacement[c] - point[c])
        };
        InjectivePull {
            residuals: all.map(residual).collect(),
            sequence: Sequence::new(self.steps),
            verdicts: self.verdicts,
            fractions: self.fractions,
            achieved: self.achieved,
            stopped,
            points: self.points,
            merged: self.merged,
        }
    }
}

fn length<const D: usize>(v: &[f64; D]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}
