//! Proofs of verdicts that can be kept, sent and checked again.

mod build;
mod cell;
mod condition;
mod cuts;
mod dyadic;
mod form;
#[cfg(feature = "serde")]
mod json;
mod place;
mod verify;
mod wide;

pub use cuts::CutsError;
pub use verify::CertificateError;

pub(crate) use cuts::{Writer, character};

use place::Spot;

use crate::{CheckOptions, Lattice, Verdict};

/// The proof of a verdict on a lattice, for [`Certificate::verify`] or any other program.
///
/// The claims are those of the [verdicts](crate#does-it-fold), but for a proof by
/// [`DisplacementBound`](crate::Theorem::DisplacementBound), which becomes one by the dominant
/// diagonal that the bound entails.
///
/// With feature `serde` it is written as one JSON object, which the guide describes field by
/// field: about a character for each cell that had to be cut, and for each cut.
///
/// # Example
///
/// ```
/// use ffd_core::{CheckOptions, Claim, Degree, Frame, Grid, Lattice};
///
/// let grid = Grid::new([Degree::CUBIC; 2], [3, 3], Frame::unit())?;
/// let mut lattice = Lattice::at_rest(grid)?;
/// lattice.set_displacement(14, [0.3, 0.1])?;
/// let certificate = lattice.certify(&CheckOptions::default()).certificate.unwrap();
/// assert_eq!(certificate.claim(), Claim::Injective);
/// let proven = certificate.verify(&lattice).unwrap();
/// assert_eq!(proven.theorem, Some("p_matrix"));
/// assert!(proven.min_det > Some(0.5));
///
/// // It proves nothing for another lattice.
/// lattice.set_displacement(14, [3.0, 0.0])?;
/// assert!(certificate.verify(&lattice).is_err());
/// # Ok::<(), ffd_core::FfdError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Certificate<const D: usize> {
    /// The degree along each axis, and the cells of the domain: what the proof was made for.
    degree: [usize; D],
    cells: [usize; D],
    proof: Proof<D>,
}

#[derive(Debug, Clone, PartialEq)]
enum Proof<const D: usize> {
    /// `det J > 0`, and at least `min_det`, which is not negative, in the boxes of the cuts.
    Regular {
        cuts: String,
        min_det: f64,
        theorem: Option<Global<D>>,
    },
    /// `det J < 0` in the boxes of the cuts.
    Reversed { cuts: String },
    /// `det J` is zero there, and in the boxes of the cuts nowhere of the other sign.
    Degenerate {
        cuts: String,
        zero: Spot<D>,
        reversed: bool,
    },
    BothSigns {
        positive: Spot<D>,
        negative: Spot<D>,
    },
    Overlap {
        point: Spot<D>,
        other: Spot<D>,
        radius: f64,
    },
}

/// Why a regular map is one-to-one. Matrices are in lattice coordinates.
#[derive(Debug, Clone, PartialEq)]
enum Global<const D: usize> {
    IdentityBorder,
    /// All principal minors of `C J` are positive: those of one row, then, in space, those of
    /// rows 0 and 1, 1 and 2, 2 and 0, each in the boxes of its own cuts. That of all
    /// rows is `det C · det J`.
    PMatrix {
        after: [[f64; D]; D],
        cuts: Vec<String>,
    },
    /// The symmetric part of `C J` is positive definite.
    Monotone {
        after: [[f64; D]; D],
        cuts: String,
    },
    /// `C J` has a dominant diagonal, row by row: so have means of it, which are not singular.
    DominantRows {
        after: [[f64; D]; D],
        cuts: String,
    },
    /// The columns of `J` lie in cones around the rows of `axes`, `sines` wide.
    CommonCones {
        axes: [[f64; D]; D],
        sines: [f64; D],
        cuts: String,
    },
}

impl<const D: usize> Global<D> {
    fn name(&self) -> &'static str {
        match self {
            Self::IdentityBorder => "identity_border",
            Self::PMatrix { .. } => "p_matrix",
            Self::Monotone { .. } => "monotone",
            Self::DominantRows { .. } => "dominant_rows",
            Self::CommonCones { .. } => "common_cones",
        }
    }
}

/// What a certificate claims: the words of [`Outcome`](crate::Outcome).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Claim {
    /// Regular, and one-to-one on the domain by a theorem.
    Injective,
    /// Regular: `det J > 0` on the closed domain.
    LocallyInjective,
    /// Not one-to-one.
    NotInjective,
    /// `det J` is zero at a place, and nowhere of one of the signs.
    Degenerate,
    /// `det J < 0` on the closed domain.
    Reversed,
}

impl Claim {
    /// The word for it, as in [`Outcome::name`](crate::Outcome::name).
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Injective => "injective",
            Self::LocallyInjective => "locally_injective",
            Self::NotInjective => "not_injective",
            Self::Degenerate => "degenerate",
            Self::Reversed => "reversed",
        }
    }
}

/// What [`Certificate::verify`] found proven.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Proven {
    /// The claim.
    pub claim: Claim,
    /// The name of the theorem that makes a regular map one-to-one: `identity_border`,
    /// `p_matrix`, `monotone`, `dominant_rows` or `common_cones`.
    pub theorem: Option<&'static str>,
    /// A lower bound of `det J` on the closed domain, for regular maps; where it is zero,
    /// `det J > 0` all the same.
    pub min_det: Option<f64>,
}

impl<const D: usize> Certificate<D> {
    /// What is claimed; nothing is checked.
    #[must_use]
    pub fn claim(&self) -> Claim {
        match &self.proof {
            Proof::Regular {
                theorem: Some(_), ..
            } => Claim::Injective,
            Proof::Regular { theorem: None, .. } => Claim::LocallyInjective,
            Proof::Reversed { .. } => Claim::Reversed,
            Proof::Degenerate { .. } => Claim::Degenerate,
            Proof::BothSigns { .. } | Proof::Overlap { .. } => Claim::NotInjective,
        }
    }
}

/// A verdict with its proof.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Certified<const D: usize> {
    /// The verdict, that of [`Lattice::check`].
    pub verdict: Verdict<D>,
    /// The certificate, or why there is none. It claims as much as the verdict says, or
    /// [`Claim::LocallyInjective`] where that is [`Injective`](crate::Outcome::Injective) by a
    /// theorem for which there are no certificates:
    /// [`InjectiveBoundary`](crate::Theorem::InjectiveBoundary).
    pub certificate: Result<Certificate<D>, Uncertified<D>>,
}

/// Why a verdict comes without a certificate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Uncertified<const D: usize> {
    /// Nothing was proven.
    #[error("the verdict is undecided: there is nothing to certify")]
    Undecided,
    /// The budget was spent on a cell: the verdict rests on better bounds than Bernstein
    /// coefficients, which would need more and smaller boxes.
    #[error("cell {cell:?} would have to be cut into too many boxes for a certificate")]
    Budget {
        /// Counted from the first of the domain.
        cell: [usize; D],
    },
}

impl<const D: usize> Lattice<D> {
    /// [`Lattice::check`], with a proof of the verdict that can be checked without trust in
    /// that test.
    ///
    /// The proof takes another search, with a budget of its own, as large as that of the test.
    #[must_use]
    pub fn certify(&self, options: &CheckOptions) -> Certified<D> {
        build::certify(self, options)
    }
}
