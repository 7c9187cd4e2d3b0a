//! Does a deformation fold?

mod batch;
mod boundary;
mod boxes;
mod checker;
mod choi_lee;
mod columns;
mod cones;
mod dominance;
mod exact;
mod global;
mod hull;
#[cfg(test)]
mod laws;
mod lower;
mod octree;
mod overlap;
mod paper;
mod partials;
mod patches;
mod phi;
mod piece;
mod positions;
mod product;
mod queue;
#[cfg(test)]
mod samples;
mod search;
mod settle;
mod step;
mod subdivide;
mod sufficient;
pub(crate) mod tiling;
mod verdict;

pub use verdict::{Effort, Evidence, Map, Outcome, Place, Theorem, Undecided, Verdict};

pub use checker::Checker;
pub use step::{SafeStep, StepOptions};

#[cfg(feature = "proptest")]
pub(crate) use choi_lee::displacement_bound;

use crate::Lattice;

/// How a deformation is tested.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CheckOptions {
    /// The test.
    pub method: Method,
    /// Enclose the minimum of `det J` in an interval of at most this width
    /// ([`Verdict::min_det`]); only with [`Method::Exact`]. The interval stays wider if
    /// the budget is spent before.
    pub enclose: Option<f64>,
    /// Find every cell that is not regular ([`Verdict::irregular_cells`]), where
    /// otherwise the test ends with the first; only with [`Method::Exact`].
    pub all_cells: bool,
    /// Also look for a theorem that makes a regular deformation globally injective.
    /// Without, such a deformation is [`Outcome::LocallyInjective`] unless the theorem
    /// comes with the test for free.
    pub global: bool,
    /// When to give up.
    pub budget: Budget,
}

impl Default for CheckOptions {
    fn default() -> Self {
        Self {
            method: Method::Exact,
            enclose: None,
            all_cells: false,
            global: true,
            budget: Budget::default(),
        }
    }
}

/// How much work a test may do before it is undecided.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Budget {
    /// Boxes to be bounded in floating point, beyond one for each cell; some
    /// microseconds each. Pairs of patches in the search for overlaps count as well.
    pub boxes: usize,
    /// Boxes to be computed in exact arithmetic; some milliseconds each.
    pub exact_boxes: usize,
}

impl Default for Budget {
    fn default() -> Self {
        Self {
            boxes: 100_000,
            exact_boxes: 1_000,
        }
    }
}

/// A test of injectivity.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub enum Method {
    /// The Bernstein form of `det J`, subdivided where it must be, with exact arithmetic
    /// where rounding matters. Decides everything, as long as the budget lasts, but maps
    /// whose determinant touches zero at a point that is no binary fraction of a cell.
    #[default]
    Exact,
    /// The exact test of \[GD01\], section 6, as printed: every determinant of partial
    /// differences, the product of basis functions, and cells cut into eight. About a
    /// millisecond for a cell of a cubic lattice; undecided where rounding errors matter.
    Paper,
    /// \[GD01\], section 7: all determinants of partial differences are positive. Proves that
    /// a map is regular; of no use for others.
    Phi,
    /// \[GD01\], section 7 and appendix: cones around the partial differences. Proves that a
    /// map is regular, and for some cones that it is one-to-one: see [`ConicHull`].
    Conic(ConicHull),
    /// All control points move by less than the bound of Choi and Lee, in cells: 0.403 along
    /// each axis for cubic lattices in space with uniform knots, 0.488 in the plane. Proves
    /// that a map is one-to-one. The bound is much smaller with clamped knots: 1/18 and
    /// 1/12, for the control points at the ends.
    ChoiLee,
}

/// Which cones the conic-hull test lays around the partial differences.
///
/// With one set of cones for all cells, a map that passes is one-to-one
/// ([`Theorem::CommonCones`]), whatever the degrees. With one set for each cell or part of
/// one, around the axes of the lattice, it is one-to-one for degrees from 2 on
/// ([`Theorem::PMatrix`]). With cones of each cell's own off the axes it is regular.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct ConicHull {
    /// One set of cones for the whole lattice instead of one for each cell.
    pub one_for_all: bool,
    /// How often cells that fail are cut into halves along all axes. From 1 on the
    /// differences are those of the Bézier form of the pieces, which lie closer to the
    /// map. The pieces of all cells together count against [`Budget::boxes`].
    pub subdivisions: u32,
    /// Lay the cones around the mean of the differences, not around the axes of the
    /// lattice.
    pub off_axis: bool,
}

impl<const D: usize> Lattice<D> {
    /// Tests whether the deformation folds.
    #[must_use]
    pub fn check(&self, options: &CheckOptions) -> Verdict<D> {
        Checker::new(self, options).verdict
    }

    /// [`Lattice::check`] on the threads of the current rayon pool. The verdict is the
    /// same.
    #[cfg(feature = "rayon")]
    #[must_use]
    pub fn par_check(&self, options: &CheckOptions) -> Verdict<D> {
        Checker::par_new(self, options).verdict
    }
}
