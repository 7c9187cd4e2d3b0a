//! The checker of certificates.
//!
//! It trusts nothing but the lattice type, the integers of `dashu-int` and the theorems named:
//! everything a certificate says is computed again from the lattice, in integers, by code
//! that the tests of this crate do not use.
//!
//! Certificates may come from anywhere. Work is bounded by the number of cells and by the
//! length of a certificate; nothing in it makes the checker panic.

use std::cmp::Ordering;

use dashu_int::IBig;

use super::cell::{self, Exact};
use super::condition::{Condition, Whole, after, dot};
use super::cuts::{self, CutsError};
use super::place::{Spot, overlaps};
use super::{Certificate, Global, Proof, Proven};
use crate::{Border, Lattice};

/// Why a certificate proves nothing for a lattice.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CertificateError {
    /// It is for lattices of another degree or size.
    #[error(
        "it is for degree {degree:?} and a domain of {cells:?} cells, the lattice has degree \
         {expected_degree:?} and {expected_cells:?} cells"
    )]
    Shape {
        /// The degree it is for.
        degree: Vec<usize>,
        /// The cells of the domain it is for.
        cells: Vec<usize>,
        /// The degree of the lattice.
        expected_degree: Vec<usize>,
        /// The cells of its domain.
        expected_cells: Vec<usize>,
    },
    /// The text of cuts is not one tree for each cell.
    #[error(transparent)]
    Cuts(#[from] CutsError),
    /// What is claimed of all points does not follow from the boxes of a cell.
    #[error("{what} is not proven in cell {cell:?}")]
    Cell {
        /// What was to be proven.
        what: &'static str,
        /// The cell, counted from the first of the domain.
        cell: Vec<usize>,
    },
    /// A number is out of its range, or a place outside the domain.
    #[error("{what} is out of range")]
    Range {
        /// What it is.
        what: &'static str,
    },
    /// A place is not what is said of it.
    #[error("{what} is not true")]
    Witness {
        /// What was said.
        what: &'static str,
    },
    /// A theorem does not apply.
    #[error("the theorem {theorem} does not apply: {why}")]
    Theorem {
        /// Its name.
        theorem: &'static str,
        /// What is missing.
        why: &'static str,
    },
}

impl<const D: usize> Certificate<D> {
    /// Checks all that the certificate claims of a lattice, in exact arithmetic.
    ///
    /// Work is proportional to the number of cells and boxes; without threads.
    ///
    /// # Errors
    ///
    /// Why it does not prove its claim for this lattice. That does not mean that the claim
    /// is wrong.
    pub fn verify(&self, lattice: &Lattice<D>) -> Result<Proven, CertificateError> {
        let exact = Exact::new(lattice);
        if (self.degree, self.cells) != (exact.degree, exact.cells) {
            return Err(CertificateError::Shape {
                degree: self.degree.to_vec(),
                cells: self.cells.to_vec(),
                expected_degree: exact.degree.to_vec(),
                expected_cells: exact.cells.to_vec(),
            });
        }
        let mut proven = Proven {
            claim: self.claim(),
            theorem: None,
            min_det: None,
        };
        match &self.proof {
            Proof::Regular {
                cuts,
                min_det,
                theorem,
            } => {
                if !(0.0..f64::INFINITY).contains(min_det) {
                    return Err(CertificateError::Range { what: "min_det" });
                }
                let what = if *min_det > 0.0 {
                    "det J ≥ min_det"
                } else {
                    "det J > 0"
                };
                everywhere(&exact, cuts, &Condition::Above(*min_det), what)?;
                if let Some(theorem) = theorem {
                    applies(&exact, theorem)?;
                    proven.theorem = Some(theorem.name());
                }
                proven.min_det = Some(*min_det);
            }
            Proof::Reversed { cuts } => {
                everywhere(&exact, cuts, &Condition::Negative, "det J < 0")?;
            }
            Proof::Degenerate {
                cuts,
                zero,
                reversed,
            } => {
                sign(
                    &exact,
                    zero,
                    Ordering::Equal,
                    "that det J is zero at the place",
                )?;
                let what = if *reversed {
                    "det J ≤ 0"
                } else {
                    "det J ≥ 0"
                };
                let reversed = *reversed;
                everywhere(&exact, cuts, &Condition::NotBeyondZero { reversed }, what)?;
            }
            Proof::BothSigns { positive, negative } => {
                sign(
                    &exact,
                    positive,
                    Ordering::Greater,
                    "that det J > 0 at the first place",
                )?;
                sign(
                    &exact,
                    negative,
                    Ordering::Less,
                    "that det J < 0 at the second place",
                )?;
            }
            Proof::Overlap {
                point,
                other,
                radius,
            } => {
                if !(point.is_in(&exact) && other.is_in(&exact)) {
                    return Err(CertificateError::Range { what: "a place" });
                }
                if !(*radius > 0.0 && *radius < 1.0) {
                    return Err(CertificateError::Range { what: "the radius" });
                }
                if !overlaps(&exact, point, other, *radius) {
                    let what = "that the two places have the same image";
                    return Err(CertificateError::Witness { what });
                }
            }
        }
        Ok(proven)
    }
}

/// Whether a condition holds in all boxes of the cuts.
fn everywhere<const D: usize>(
    exact: &Exact<'_, D>,
    cuts: &str,
    condition: &Condition<'_, D>,
    what: &'static str,
) -> Result<(), CertificateError> {
    cuts::read(cuts, D, exact.cell_count(), |cells, tree| {
        for number in cells {
            let cell = exact.cell(number);
            if !condition.holds(exact, cell, tree) {
                let cell = cell.to_vec();
                return Err(CertificateError::Cell { what, cell });
            }
        }
        Ok(())
    })
}

fn sign<const D: usize>(
    exact: &Exact<'_, D>,
    spot: &Spot<D>,
    expected: Ordering,
    what: &'static str,
) -> Result<(), CertificateError> {
    if !spot.is_in(exact) {
        return Err(CertificateError::Range { what: "a place" });
    }
    if spot.sign(exact) != expected {
        return Err(CertificateError::Witness { what });
    }
    Ok(())
}

/// Whether a theorem applies to a regular map.
fn applies<const D: usize>(
    exact: &Exact<'_, D>,
    global: &Global<D>,
) -> Result<(), CertificateError> {
    let theorem = global.name();
    let fails = |why: &'static str| Err(CertificateError::Theorem { theorem, why });
    let finite = |numbers: &[f64]| numbers.iter().all(|x| x.is_finite());
    match global {
        Global::IdentityBorder => {
            if exact.lattice.grid().border() != Border::Identity {
                return fails("the border is free");
            }
            Ok(())
        }
        Global::PMatrix {
            after: matrix,
            cuts,
        } => {
            if exact.degree.contains(&1) {
                return fails("J jumps where the degree is 1");
            }
            if !finite(matrix.as_flattened()) {
                return Err(CertificateError::Range { what: "C" });
            }
            let (entries, _) = cell::integers(matrix.as_flattened());
            if determinant_of(&entries) <= IBig::ZERO {
                return fails("det C is not positive");
            }
            let after = after(exact, matrix);
            let minors = minors(&after);
            if cuts.len() != minors.len() {
                return fails("there must be cuts for each minor");
            }
            let all = std::iter::zip(cuts, &minors);
            all.into_iter()
                .try_for_each(|(cuts, minor)| everywhere(exact, cuts, minor, "a minor > 0"))
        }
        Global::Monotone {
            after: matrix,
            cuts,
        } => {
            if !finite(matrix.as_flattened()) {
                return Err(CertificateError::Range { what: "C" });
            }
            let after = &after(exact, matrix);
            let what = "a positive definite symmetric part";
            everywhere(exact, cuts, &Condition::Definite { after }, what)
        }
        Global::DominantRows {
            after: matrix,
            cuts,
        } => {
            if !finite(matrix.as_flattened()) {
                return Err(CertificateError::Range { what: "C" });
            }
            let after = &after(exact, matrix);
            everywhere(
                exact,
                cuts,
                &Condition::Dominant { after },
                "a dominant diagonal",
            )
        }
        Global::CommonCones { axes, sines, cuts } => {
            if !finite(axes.as_flattened()) || !finite(sines) {
                return Err(CertificateError::Range { what: "a cone" });
            }
            let cones = Cones::new(axes, sines);
            if !cones.are_separate() {
                return fails("vectors of the cones can be linearly dependent");
            }
            let condition = Condition::Cones {
                after: &after(exact, &unit()),
                axes: &cones.axes,
                sines: &cones.sines,
            };
            everywhere(exact, cuts, &condition, "a cone")
        }
    }
}

/// The principal minors of a matrix, but for its determinant.
pub(super) fn minors<const D: usize>(after: &Whole<D>) -> Vec<Condition<'_, D>> {
    let mut minors: Vec<_> = (0..D).map(|row| Condition::Entry { after, row }).collect();
    if D == 3 {
        for rows in [[0, 1], [1, 2], [2, 0]] {
            minors.push(Condition::Minor { after, rows });
        }
    }
    minors
}

pub(super) fn unit<const D: usize>() -> [[f64; D]; D] {
    std::array::from_fn(|r| std::array::from_fn(|c| if r == c { 1.0 } else { 0.0 }))
}

fn square_matrix<const D: usize>(entries: &[IBig]) -> Whole<D> {
    std::array::from_fn(|r| std::array::from_fn(|c| entries[r * D + c].clone()))
}

fn determinant_of(entries: &[IBig]) -> IBig {
    if entries.len() == 4 {
        cell::determinant::<2>(&square_matrix(entries))
    } else {
        cell::determinant::<3>(&square_matrix(entries))
    }
}

/// Cones around the rows of `axes`, all numbers times the same power of two.
///
/// If vectors, one from each cone, are linearly dependent, a unit vector n is perpendicular to
/// them all. Then `|axes n|` is at most `sines` in each component: a vector at an angle of at
/// most θ with the axis c is perpendicular only to unit vectors with `|c · n| ≤ |c| sin θ`. The
/// length of n is a convex function of `axes n`, so it is largest where each component is
/// ± one of `sines`; if it is below 1 there, there is no such n.
pub(super) struct Cones<const D: usize> {
    pub(super) axes: Whole<D>,
    pub(super) sines: [IBig; D],
}

impl<const D: usize> Cones<D> {
    pub(super) fn new(axes: &[[f64; D]; D], sines: &[f64; D]) -> Self {
        let mut numbers = axes.as_flattened().to_vec();
        numbers.extend(sines);
        let (integers, _) = cell::integers(&numbers);
        Self {
            axes: square_matrix(&integers),
            sines: std::array::from_fn(|a| integers[D * D + a].clone()),
        }
    }

    pub(super) fn are_separate(&self) -> bool {
        let volume = cell::determinant(&self.axes);
        let adjugate = cell::adjugate(&self.axes);
        let is_short = |signs: usize| {
            let s: [IBig; D] = std::array::from_fn(|a| {
                let sine = self.sines[a].clone();
                if signs >> a & 1 == 1 { -sine } else { sine }
            });
            let n: [IBig; D] = std::array::from_fn(|r| dot(&adjugate[r], &s));
            dot(&n, &n) < &volume * &volume
        };
        volume > IBig::ZERO
            && self.sines.iter().all(|s| *s >= IBig::ZERO)
            && (0..1 << D).all(is_short)
    }
}
