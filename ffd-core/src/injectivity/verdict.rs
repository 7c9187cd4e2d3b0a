//! What a test found.

use super::Method;

/// Which map was judged.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Map {
    /// A B-spline lattice: `F(x) = x + Σ Bᵢ(A⁻¹(x − o)) dᵢ` on its closed domain, with the
    /// stored numbers taken as exact real numbers.
    BSpline,
}

/// The answer to "does this deformation fold?", and what it rests on.
///
/// See the [crate documentation](crate#does-it-fold) for the words.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Verdict<const D: usize> {
    /// The map judged.
    pub map: Map,
    /// The test that was asked.
    pub method: Method,
    /// The answer.
    pub outcome: Outcome<D>,
    /// An interval that contains the minimum of `det J` over the closed domain, with
    /// `J = ∂F/∂x`, which is 1 where nothing moves. An end that was not found out is
    /// infinite; the lower end of a map proven regular is never below 0.
    pub min_det: [f64; 2],
    /// Cells of the domain in which `det J` was proven zero or negative somewhere (none are
    /// listed for [`Outcome::Reversed`]). Complete if
    /// [`CheckOptions::all_cells`](super::CheckOptions::all_cells) was set and
    /// `doubtful_cells` is empty; otherwise the test may have ended with the first. A cell
    /// is counted from the first of the domain: with an identity border, from `degree`
    /// cells before the lattice's own.
    pub irregular_cells: Vec<[usize; D]>,
    /// Cells that were looked at and not decided, because the budget was spent.
    pub doubtful_cells: Vec<[usize; D]>,
    /// The work done.
    pub effort: Effort,
}

impl<const D: usize> Verdict<D> {
    /// Whether `det J > 0` was proven on the whole closed domain.
    #[must_use]
    pub fn is_regular(&self) -> bool {
        matches!(
            self.outcome,
            Outcome::Injective(_) | Outcome::LocallyInjective
        )
    }

    /// Whether the deformation was proven one-to-one on its domain.
    #[must_use]
    pub fn is_injective(&self) -> bool {
        matches!(self.outcome, Outcome::Injective(_))
    }

    /// The theorem that makes a regular deformation globally injective, if one was found.
    #[must_use]
    pub fn theorem(&self) -> Option<Theorem<D>> {
        match self.outcome {
            Outcome::Injective(theorem) => Some(theorem),
            _ => None,
        }
    }
}

/// What was found.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Outcome<const D: usize> {
    /// Regular, `det J > 0` on the closed domain, and one-to-one by the theorem named.
    Injective(Theorem<D>),
    /// Regular, so one-to-one in the neighbourhood of every point; but no theorem that
    /// was tried says that distant points have different images.
    LocallyInjective,
    /// Proven not to be one-to-one.
    NotInjective(Evidence<D>),
    /// `det J` is zero at the place named, and has the same sign everywhere else: the map
    /// may still be one-to-one, but its inverse is not smooth.
    Degenerate {
        /// Where `det J` is exactly zero.
        zero: Place<D>,
        /// Whether `det J` is negative elsewhere, rather than positive.
        reversed: bool,
    },
    /// `det J < 0` on the closed domain: a mirror image.
    Reversed,
    /// None of these was proven.
    Undecided(Undecided<D>),
}

impl<const D: usize> Outcome<D> {
    /// The word for it: `injective`, `locally_injective`, `not_injective`, `degenerate`,
    /// `reversed` or `undecided`.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Injective(_) => "injective",
            Self::LocallyInjective => "locally_injective",
            Self::NotInjective(_) => "not_injective",
            Self::Degenerate { .. } => "degenerate",
            Self::Reversed => "reversed",
            Self::Undecided(_) => "undecided",
        }
    }
}

/// Why a regular map is one-to-one. Matrices are in lattice coordinates, where cells are
/// unit cubes; so no theorem depends on the frame.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Theorem<const D: usize> {
    /// Around the domain nothing moves, and the map joins the identity there: a proper
    /// local homeomorphism of the whole space, hence a homeomorphism (Hadamard,
    /// Caccioppoli); the only case in which the claim is about the whole space.
    IdentityBorder,
    /// `C J` is a P-matrix (all principal minors are positive) on the box, for the fixed
    /// matrix `C` given, row-major (D. Gale, H. Nikaido, *The Jacobian matrix and global
    /// univalence of mappings*, Mathematische Annalen 159, 1965).
    PMatrix {
        /// `C`.
        after: [[f64; D]; D],
    },
    /// The symmetric part of `C J` is positive definite on the convex box, for the fixed
    /// matrix `C` given: `(y − x)ᵀ C (F(y) − F(x)) > 0`. A contraction, `‖C J − I‖ < 1`,
    /// is a special case.
    Monotone {
        /// `C`.
        after: [[f64; D]; D],
    },
    /// The columns of `J` lie in cones, the same ones everywhere, any three vectors of
    /// which (two in the plane) span a positive volume. The mean of `J` along a segment
    /// is then no singular matrix either.
    CommonCones,
    /// No control point moves by as much as the bound of Choi and Lee (Y. Choi, S. Lee,
    /// *Injectivity conditions of 2D and 3D uniform cubic B-spline functions*, Graphical
    /// Models 62, 2000).
    DisplacementBound,
    /// The map is one-to-one on the boundary of the box (G. Meisters, C. Olech, *Locally
    /// one-to-one mappings and a classical theorem on schlicht functions*, Duke
    /// Mathematical Journal 30, 1963).
    InjectiveBoundary,
}

impl<const D: usize> Theorem<D> {
    /// The name of the theorem, in lower case with underscores.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::IdentityBorder => "identity_border",
            Self::PMatrix { .. } => "p_matrix",
            Self::Monotone { .. } => "monotone",
            Self::CommonCones => "common_cones",
            Self::DisplacementBound => "displacement_bound",
            Self::InjectiveBoundary => "injective_boundary",
        }
    }
}

/// Why a map is not one-to-one.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Evidence<const D: usize> {
    /// `det J` has both signs.
    BothSigns {
        /// Where it is positive.
        positive: Place<D>,
        /// Where it is negative.
        negative: Place<D>,
    },
    /// Two different points have the same image. One is known exactly. The other is the
    /// only one in a small box of its cell: its position in the cell differs from that
    /// of `other` by at most `radius` along each axis. The first is not in that box.
    Overlap {
        /// The one.
        point: Place<D>,
        /// The middle of the box that contains the other.
        other: Place<D>,
        /// Half the size of that box, in cells.
        radius: f64,
    },
}

/// A point of the domain, exactly.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place<const D: usize> {
    /// The cell, counted from the first of the domain: with an identity border, from
    /// `degree` cells before the lattice's own. Where the degree is 1, `J` jumps between
    /// cells: then it is that of this one.
    pub cell: [usize; D],
    /// The position in that cell, from 0 to 1 along each axis, an exact number.
    pub t: [f64; D],
    /// The same point in the world, rounded: claims are about `cell` and `t`.
    pub world: [f64; D],
}

/// Where a test gave up.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Undecided<const D: usize> {
    /// The cell, counted from the first of the domain.
    pub cell: [usize; D],
    /// The part of that cell which is in doubt: from and to along each axis, within
    /// 0 and 1.
    pub part: [[f64; 2]; D],
    /// Bounds of `det J` in that part. Infinite if there are none.
    pub det: [f64; 2],
}

/// The work that a test did.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub struct Effort {
    /// Boxes (whole cells, and parts of them) of which `det J` was bounded in floating
    /// point; and pairs of patches of the boundary that were compared.
    pub boxes: usize,
    /// Boxes of which it was computed in exact arithmetic.
    pub exact_boxes: usize,
}
