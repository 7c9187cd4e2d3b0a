//! The φ-test of \[GD01\] (section 7): all determinants of control vectors are positive.
//!
//! By equation (6) of the paper the determinant in a cell is a weighted mean of
//!
//! ```text
//! φ = det [ P⁽ᵘ⁾  P⁽ᵛ⁾  P⁽ʷ⁾ ]                                                  (7)
//! ```
//!
//! over all ways to take one control vector from each column; the weights are products of
//! basis functions and not negative. Where all φ are positive, so is the determinant. The
//! converse does not hold.
//!
//! Both optimisations of the paper are made: the vectors are computed once for the whole
//! lattice ([`Partials`]), and cell by cell those that act there are taken out. The cross
//! product of two vectors is computed once for all third ones. A cell of a cubic lattice
//! still has 48³ = 110 592 determinants; the conic-hull test stands for all of them at about a
//! thousandth of the cost ([`cones`](super::cones)), and rejects more.
//!
//! Equation (7) of the paper is for unit cells, where a control vector is the difference of
//! two control points; elsewhere vectors are those of the derivative, so that the
//! determinants are multiples of those of the paper by positive numbers.
//!
//! # What it proves
//!
//! `det J > 0` at every point of the lattice; not that distant points have different
//! images, nor is J a P-matrix.
//!
//! # Rounding
//!
//! A determinant counts as positive if it is larger than
//! [`Columns::determinant_error`], which bounds its error: see there.

use fearless_simd::{Level, Simd, dispatch};

use super::columns::Columns;
use super::partials::Partials;

/// Third vectors that are multiplied together.
const LANES: usize = 8;

/// The first cell in which some φ may not be positive.
pub(super) fn failing_cell<const D: usize>(partials: &Partials<D>) -> Option<[usize; D]> {
    let mut columns = Columns::new();
    (0..partials.cell_count())
        .map(|number| partials.cell(number))
        .find(|&cell| {
            columns.set_control(partials, cell);
            !all_positive(&mut columns)
        })
}

/// Whether all determinants of vectors, one from each column, are positive. The last
/// column is padded.
fn all_positive<const D: usize>(columns: &mut Columns<D>) -> bool {
    let error = columns.determinant_error();
    if error == f64::INFINITY {
        return false;
    }
    // Whole vectors of third ones: the first is repeated.
    for component in &mut columns.vectors[D - 1] {
        let padded = component.len().next_multiple_of(LANES);
        let first = component[0];
        component.resize(padded, first);
    }
    let level: Level = columns.level;
    dispatch!(level, s => least(s, columns, error)) > error
}

/// The least determinant, or one that is not above `bound`.
#[inline(always)]
fn least<S: Simd, const D: usize>(_: S, columns: &Columns<D>, bound: f64) -> f64 {
    let vectors = &columns.vectors;
    let count = |a: usize| vectors[a][0].len();
    let (second, last) = (count(1), count(D - 1));
    let mut least = f64::INFINITY;
    for i in 0..count(0) {
        let u = columns.vector(0, i);
        let mut lanes = [f64::INFINITY; LANES];
        if D == 2 {
            let [x, y] = [0, 1].map(|c| vectors[1][c].as_chunks::<LANES>().0);
            for (x, y) in x.iter().zip(y) {
                for l in 0..LANES {
                    let phi = u[0] * y[l] - u[1] * x[l];
                    lanes[l] = if phi < lanes[l] { phi } else { lanes[l] };
                }
            }
        } else {
            let [x, y, z] = [0, 1, D - 1].map(|c| {
                let chunks = vectors[D - 1][c].as_chunks::<LANES>().0;
                &chunks[..last / LANES]
            });
            for j in 0..second {
                let v = columns.vector(1, j);
                let normal: [f64; 3] = std::array::from_fn(|c| {
                    let (p, q) = ((c + 1) % D, (c + 2) % D);
                    u[p] * v[q] - u[q] * v[p]
                });
                for chunk in 0..last / LANES {
                    for l in 0..LANES {
                        let phi = normal[0] * x[chunk][l]
                            + normal[1] * y[chunk][l]
                            + normal[2] * z[chunk][l];
                        lanes[l] = if phi < lanes[l] { phi } else { lanes[l] };
                    }
                }
            }
        }
        for lane in lanes {
            least = if lane < least { lane } else { least };
        }
        if least <= bound {
            break;
        }
    }
    least
}

#[cfg(test)]
mod tests {
    use super::super::samples::{lattices, linear, noise, passing_cells};
    use super::*;
    use crate::{Degree, Frame, Grid};
    use proptest::prelude::*;

    /// The least of all determinants, one by one.
    fn least_phi<const D: usize>(columns: &Columns<D>) -> f64 {
        let counts: [usize; D] = std::array::from_fn(|a| columns.vectors[a][0].len());
        (0..counts.iter().product())
            .map(|number: usize| {
                let mut rest = number;
                let m: [[f64; D]; D] = std::array::from_fn(|a| {
                    let index = rest % counts[a];
                    rest /= counts[a];
                    columns.vector(a, index)
                });
                if D == 2 {
                    m[0][0] * m[1][1] - m[0][1] * m[1][0]
                } else {
                    (0..3)
                        .map(|c| {
                            let (p, q) = ((c + 1) % 3, (c + 2) % 3);
                            m[0][c] * (m[1][p] * m[D - 1][q] - m[1][q] * m[D - 1][p])
                        })
                        .sum()
                }
            })
            .fold(f64::INFINITY, f64::min)
    }

    fn agrees_with_enumeration<const D: usize>(
        lattice: &crate::Lattice<D>,
    ) -> Result<(), TestCaseError> {
        let partials = Partials::new(lattice);
        let mut columns = Columns::new();
        let cones = passing_cells(&partials);
        for number in 0..partials.cell_count() {
            columns.set_control(&partials, partials.cell(number));
            let error = columns.determinant_error();
            let least = least_phi(&columns);
            // The enumeration is rounded by as much again at most.
            prop_assume!((least - error).abs() > error);
            prop_assert_eq!(all_positive(&mut columns), least > error);
            if cones[number] && least.abs() > 1e-6 {
                prop_assert!(least > 0.0, "{} though cones pass", least);
            }
        }
        Ok(())
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        /// The test is that all determinants are positive; cones imply it.
        #[test]
        fn every_determinant_counts_in_the_plane(lattice in lattices::<2>(5, 2, 0.8)) {
            agrees_with_enumeration(&lattice)?;
        }

        /// The same in space.
        #[test]
        fn every_determinant_counts_in_space(lattice in lattices::<3>(2, 2, 0.6)) {
            agrees_with_enumeration(&lattice)?;
        }
    }

    #[test]
    fn a_rotation_by_more_than_cones_allow() {
        // A quarter turn: the vectors lie across their axes, and all φ are 1.
        let m = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]];
        let partials = Partials::new(&linear(3, 1, m));
        assert_eq!(failing_cell(&partials), None);
        assert_eq!(passing_cells(&partials), [false]);
    }

    #[test]
    fn a_mirror_image_fails() {
        let partials = Partials::new(&linear(2, 2, [[-1.0, 0.0], [0.0, 1.0]]));
        assert_eq!(failing_cell(&partials), Some([0; 2]));
    }

    #[test]
    fn what_overflows_fails() {
        let grid = Grid::new([Degree::CUBIC; 3], [1; 3], Frame::unit()).unwrap();
        let partials = Partials::new(&noise(grid, 1e300, 1));
        assert_eq!(failing_cell(&partials), Some([0; 3]));
    }
}
