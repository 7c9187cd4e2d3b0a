//! The largest safe step: how far a lattice can go on a straight way before it folds.
//!
//! With displacements `d + t Δd` the columns of the Jacobian are linear in t, so `det J` is a
//! polynomial of degree D in t. Over a cell and a part of the way it has a Bernstein form in
//! D + 1 variables ([`boxes`]); a box in which some coefficients are not positive is safe
//! up to where the convex hull of its coefficients along t meets zero. The earliest box of
//! all is cut down or in half ([`search`]) until that is as late as a time at which a place
//! is proven to have folded. Bisection by a test of lattices would be wrong: `(1 − 2t)²` is
//! positive at all of its steps.
//!
//! Where the determinant only touches zero, no value in floating point proves that. At the
//! corners of boxes left in doubt it is a polynomial in t with integer coefficients, the
//! first root of which, a double one too, is found by Sturm's theorem ([`root`]); the rest
//! of the box is proven positive in integers ([`exactly`]).

#![allow(
    clippy::float_cmp,
    reason = "where numbers are compared for equality, the same numbers are meant"
)]

mod along;
mod boxes;
mod exactly;
mod guess;
mod root;
mod search;

pub(super) use self::along::Along;
pub(super) use self::search::error_of_way;

use self::search::Search;
use super::verdict::{Effort, Outcome, Place};
use super::{Budget, CheckOptions, Checker};
use crate::{FfdError, Lattice};

/// How much farther than the earliest fold at some points is looked at first.
const BEYOND: f64 = 1.0 / 128.0;

/// How closely the largest safe step is found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepOptions {
    /// The width of the enclosure relative to its upper end. With zero, everything is
    /// done that the budget allows.
    pub width: f64,
    /// When to give up; the enclosure is wider then. A box is one of space and way.
    pub budget: Budget,
}

impl Default for StepOptions {
    fn default() -> Self {
        Self {
            width: 1e-6,
            budget: Budget::default(),
        }
    }
}

/// How far a lattice can go before it folds: see [`Lattice::largest_safe_step`].
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct SafeStep<const D: usize> {
    /// An interval that contains the first t in [0, 1] at which `det J` is zero somewhere.
    ///
    /// Proven are: `det J > 0` on the closed domain for all t in [0, `t[0]`], unless both
    /// ends are 0; and `det J ≤ 0` at some place for some t ≤ `t[1]`.
    ///
    /// * `[1, ∞]` if nothing folds up to 1;
    /// * `[0, 0]` if `det J ≤ 0` somewhere at the beginning;
    /// * `[0, ∞]` if that is not known;
    /// * `t[1]` is infinite and `t[0] < 1` if the budget was spent before a fold was found.
    pub t: [f64; 2],
    /// Where `det J ≤ 0` for some t ≤ `t[1]`; `None` if that is infinite or 0 (at t = 0,
    /// [`Lattice::check`] tells).
    pub place: Option<Place<D>>,
    /// The work that was done, with that of the test at t = 0.
    pub effort: Effort,
}

impl<const D: usize> Lattice<D> {
    /// How far this lattice can go towards another one before it folds: displacements
    /// `d + t Δd` of control points are those of `self` at t = 0 and those of `to` at t = 1,
    /// as exact real numbers.
    ///
    /// Found is the *first* t in [0, 1] at which `det J` is zero anywhere on the closed
    /// domain, within an interval of the relative width asked for. Beyond it the lattice may
    /// be regular again: with `det J = (1 − 2t)²` the answer is 1/2.
    ///
    /// Each lattice up to `t[0]` is regular; like those of [`Lattice::check`], that claim is
    /// about exact real numbers `d + t Δd`, not about rounded ones.
    ///
    /// # Errors
    ///
    /// [`FfdError::DifferentGrids`] if the lattices are not on the same grid.
    ///
    /// # Example
    ///
    /// ```
    /// use ffd_core::{Degree, Frame, Grid, Lattice, StepOptions};
    ///
    /// // Shrinking to less than nothing: J = (1 − 1.5 t) I.
    /// let grid = Grid::new([Degree::CUBIC; 2], [2, 2], Frame::unit())?;
    /// let rest = Lattice::at_rest(grid.clone())?;
    /// let shrunk = (0..grid.control_point_count())
    ///     .map(|i| grid.rest_position(i).map(|x| -1.5 * x))
    ///     .collect();
    /// let shrunk = Lattice::new(grid, shrunk)?;
    ///
    /// let [low, high] = rest.largest_safe_step(&shrunk, &StepOptions::default())?.t;
    /// assert!(low < 2.0 / 3.0 && 2.0 / 3.0 <= high && high - low <= 1e-6);
    /// # Ok::<(), ffd_core::FfdError>(())
    /// ```
    pub fn largest_safe_step(
        &self,
        to: &Self,
        options: &StepOptions,
    ) -> Result<SafeStep<D>, FfdError> {
        if let Some(what) = self.grid().difference(to.grid()) {
            return Err(FfdError::DifferentGrids { what });
        }
        let check = CheckOptions {
            global: false,
            budget: options.budget,
            ..CheckOptions::default()
        };
        let checker = Checker::new(self, &check);
        let verdict = &checker.verdict;
        if !verdict.is_regular() {
            let known = !matches!(verdict.outcome, Outcome::Undecided(_));
            return Ok(SafeStep {
                t: [0.0, if known { 0.0 } else { f64::INFINITY }],
                place: None,
                effort: verdict.effort,
            });
        }
        let effort = verdict.effort;
        let mut search = Search::new(self, to, checker.search.partials);
        // Nor is what is not a number a width.
        search.width = options.width.clamp(0.0, 1.0).max(0.0);
        let safe = step(&mut search, &options.budget);
        let high = search.high;
        let low = if high < f64::INFINITY {
            safe.min(search.target()).min(high.next_down()).max(0.0)
        } else {
            safe.min(1.0)
        };
        Ok(SafeStep {
            t: [low, high],
            place: search.place,
            effort: Effort {
                boxes: effort.boxes + search.effort.boxes,
                exact_boxes: effort.exact_boxes + search.effort.exact_boxes,
            },
        })
    }
}

/// Up to where nothing folds; infinite if nothing does before the target of the search.
fn step<const D: usize>(search: &mut Search<'_, D>, budget: &Budget) -> f64 {
    let among = search.cells_in_doubt();
    let guess = guess::earliest(search.from, search.to, search.cells(), &among);
    let first = guess.map_or(1.0, |guess| (guess.t * (1.0 + BEYOND)).min(1.0));
    let mut safe = f64::INFINITY;
    let mut from = 0.0;
    // First what is likely to be enough: bounds are better on a short part of the way.
    for to in [first, 1.0] {
        if from < to {
            let guess = guess.filter(|_| from == 0.0);
            safe = safe.min(search.search([from, to], guess, budget.boxes));
            from = to;
        }
        if search.high < f64::INFINITY || safe < f64::INFINITY {
            break;
        }
    }
    safe.min(search.settle(budget.exact_boxes))
}
