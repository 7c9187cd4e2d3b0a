//! The bound of Choi and Lee: a lattice whose control points all move by little enough, in
//! cells, is one-to-one.
//!
//! In lattice coordinates the Jacobian is `J = I + Σ dᵢ gᵢᵀ` with the gradients `gᵢ` of the
//! basis functions. Let no component of a displacement be larger than δ. For a vector v with
//! ‖v‖∞ = 1,
//!
//! ```text
//! ‖J v‖∞ ≥ 1 − ‖Σ dᵢ (gᵢ · v)‖∞ ≥ 1 − δ Σ |gᵢ · v| ≥ 1 − δ K,    K = max Σ |gᵢ(x) · v|,
//! ```
//!
//! with the maximum over all x and v. So J is nowhere singular where `δ K < 1`; and since this
//! holds for smaller displacements as well, down to none, `det J > 0`. (It is also necessary,
//! as far as only δ is known: with `dᵢ = − δ sign(gᵢ · v) v` for the v and x of the maximum, a
//! vertex of the cube, J v = (1 − δ K) v.)
//!
//! # What it proves
//!
//! The map is one-to-one on its domain, for degree 1 too: the mean of J along a segment is
//! `I + Σ dᵢ ḡᵢᵀ` with means of gradients, for which `Σ |ḡᵢ · v| ≤ K` all the same, so it is
//! not singular.
//!
//! # The constants
//!
//! The sum is a convex function of v, so its maximum is at a vertex, `v = (±1, ±1, ±1)`.
//! Uniform knots are symmetric: reversing an axis changes the sign of that entry of v, so
//! v = (1, 1, 1) is enough, with x in the whole of one cell. [`UNIFORM_1`], [`UNIFORM_2`] and
//! [`UNIFORM_3`] hold K for each combination of degrees, as rigorous upper bounds from a
//! branch and bound that the tests repeat: over a box,
//! `Σ |gᵢ · v|` is at most the largest of the sums of absolute Bernstein coefficients.
//! For cubic splines the literature has 2.0464 and 2.4795.
//!
//! Clamped knots: for the axis a alone, `Σ |∂ₐBᵢ| ≤ 2 nₐ`, since derivatives are differences
//! of splines of degree n − 1 times n over a difference of knots that is at least one; in the
//! corner of the domain it is as much. Functions of the other axes add up to one. With C the
//! clamped axes and K that of the others alone, `K + 2 Σ nₐ` over a in C is therefore an upper
//! bound, and exact where all axes are clamped. Control points near the ends are closer
//! together, which this bound pays for everywhere.
//!
//! # References
//!
//! * Y. Choi, S. Lee, *Injectivity conditions of 2D and 3D uniform cubic B-spline functions*,
//!   Graphical Models 62 (2000).

use super::partials::{Partials, UNIT};
use crate::{Grid, Knots, Lattice};

/// K for one axis, in the order of degrees.
const UNIFORM_1: [f64; 5] = [2.000001, 2.000001, 1.500001, 1.333334, 1.197917];

/// K for two axes of degrees m ≥ n: (1, 1), (2, 1), (2, 2), (3, 1) and so on.
#[rustfmt::skip]
const UNIFORM_2: [f64; 15] = [
    4.000001,
    3.000001, 2.500001,
    2.753377, 2.333334, 2.046394,
    2.574733, 2.166667, 1.917779, 1.812501,
    2.468349, 2.147917, 1.815974, 1.725001, 1.643908,
];

/// K for three axes of degrees l ≥ m ≥ n: (1, 1, 1), (2, 1, 1), (2, 2, 1), (2, 2, 2),
/// (3, 1, 1) and so on.
#[rustfmt::skip]
const UNIFORM_3: [f64; 35] = [
    6.000001,
    4.500001,
    3.625001, 3.000001,
    4.333334,
    3.441265, 2.791668,
    3.231864, 2.666668, 2.479474,
    4.226535,
    3.294968, 2.668089,
    3.100954, 2.532987, 2.371089,
    2.991603, 2.458979, 2.277060, 2.193415,
    4.155743,
    3.250001, 2.629689,
    3.002895, 2.484606, 2.278937,
    2.910318, 2.420026, 2.199066, 2.120838,
    2.839922, 2.375136, 2.130919, 2.056020, 1.993802,
];

/// K for axes with uniform knots, whose degrees are given in descending order.
fn uniform(degrees: &[usize]) -> f64 {
    match *degrees {
        [n] => UNIFORM_1[n - 1],
        [m, n] => UNIFORM_2[m * (m - 1) / 2 + n - 1],
        [l, m, n] => UNIFORM_3[(l - 1) * l * (l + 1) / 6 + m * (m - 1) / 2 + n - 1],
        _ => 0.0,
    }
}

/// An upper bound of K for lattices on a grid.
fn constant<const D: usize>(grid: &Grid<D>) -> f64 {
    let mut degrees = [0; 3];
    let mut count = 0;
    let mut sum = 0.0;
    for axis in grid.axes() {
        let n = axis.degree().get();
        match axis.knots() {
            Knots::Uniform => {
                degrees[count] = n;
                count += 1;
            }
            Knots::Clamped => sum += 2.0 * n as f64,
        }
    }
    degrees[..count].sort_unstable_by(|a, b| b.cmp(a));
    sum + uniform(&degrees[..count])
}

/// A displacement in cells along each axis, exclusive, up to which lattices on a grid are
/// one-to-one.
#[cfg(feature = "proptest")]
pub(crate) fn displacement_bound<const D: usize>(grid: &Grid<D>) -> f64 {
    // The division is rounded.
    (1.0 - 2.0 * UNIT) / constant(grid)
}

/// A cell on which a control point acts that moves too far, if there is one: counted from
/// the first of the domain.
///
/// With M, the stored inverse of the frame, the Jacobian judged is `M A + Σ M dᵢ gᵢᵀ`: the
/// same holds for δ of the `M dᵢ` if 1 is replaced by `1 − ‖M A − I‖∞`.
pub(super) fn failing_cell<const D: usize>(
    lattice: &Lattice<D>,
    partials: &Partials<D>,
) -> Option<[usize; D]> {
    let grid = lattice.grid();
    let inverse = grid.frame().inverse();
    // Not larger than 1 − ‖M A − I‖∞.
    let [identity, _] = partials.frame_determinant;
    let allowed = identity * (1.0 - 8.0 * UNIT) / constant(grid);
    let moves_too_far = |d: &[f64; D]| {
        inverse.iter().any(|row| {
            let terms = row.iter().zip(d).map(|(m, d)| m * d);
            let size: f64 = terms.clone().map(f64::abs).sum();
            let bound = terms.sum::<f64>().abs() + 4.0 * UNIT * size;
            // Also where it is not a number.
            let allowed = bound < allowed;
            !allowed
        })
    };
    let first = if partials.is_sound() {
        lattice.displacements().iter().position(moves_too_far)?
    } else {
        0
    };
    let indices = grid.control_point_indices(first);
    Some(std::array::from_fn(|axis| {
        (indices[axis] + grid.layers(axis)).min(partials.cells[axis] - 1)
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bspline::BezierTables;
    use crate::{Axis, Degree, Frame, Grid};
    use std::cmp::Ordering;
    use std::collections::BinaryHeap;

    /// The basis functions of an axis, and their derivatives, as Bernstein coefficients of
    /// the degree of the axis over a part of a cell: `[function][coefficient]`.
    #[derive(Debug, Clone)]
    struct Functions {
        values: Vec<Vec<f64>>,
        slopes: Vec<Vec<f64>>,
    }

    impl Functions {
        fn new(n: usize) -> Self {
            let axis = Axis::new(Degree::new(n).unwrap(), 1, Knots::Uniform).unwrap();
            let table = BezierTables::of_axis(&axis)[0].full;
            let values: Vec<Vec<f64>> = (0..=n)
                .map(|m| (0..=n).map(|k| table[k][m]).collect())
                .collect();
            let slope = |b: &Vec<f64>| {
                let difference = |k: usize| n as f64 * (b[k + 1] - b[k]);
                let raise = |k: usize| {
                    let t = k as f64 / n as f64;
                    let before = if k > 0 { t * difference(k - 1) } else { 0.0 };
                    let after = if k < n {
                        (1.0 - t) * difference(k)
                    } else {
                        0.0
                    };
                    before + after
                };
                (0..=n).map(raise).collect()
            };
            let slopes = values.iter().map(slope).collect();
            Self { values, slopes }
        }

        fn halves(&self) -> [Self; 2] {
            let low = |rows: &[Vec<f64>]| rows.iter().map(|row| lower_half(row)).collect();
            let high = |rows: &[Vec<f64>]| {
                let half = |row: &Vec<f64>| {
                    let reversed: Vec<f64> = row.iter().rev().copied().collect();
                    let half: Vec<f64> = lower_half(&reversed).into_iter().rev().collect();
                    half
                };
                rows.iter().map(half).collect()
            };
            [
                Self {
                    values: low(&self.values),
                    slopes: low(&self.slopes),
                },
                Self {
                    values: high(&self.values),
                    slopes: high(&self.slopes),
                },
            ]
        }

        fn order(&self) -> usize {
            self.values.len()
        }
    }

    fn lower_half(row: &[f64]) -> Vec<f64> {
        let mut row = row.to_vec();
        let mut low = vec![row[0]];
        for step in 1..row.len() {
            for i in 0..row.len() - step {
                row[i] = 0.5 * (row[i] + row[i + 1]);
            }
            low.push(row[0]);
        }
        low
    }

    /// `Σ |∇Bᵢ · (1, …, 1)|` over a box: an upper bound, and the largest value in a corner.
    fn bounds(axes: &[Functions]) -> (f64, f64) {
        let (mut most, mut corner) = (0.0_f64, 0.0_f64);
        let total: usize = axes.iter().map(Functions::order).product();
        // Coefficients one by one; values and slopes of the functions of each axis there.
        for number in 0..total {
            let mut rest = number;
            let mut is_corner = true;
            // Products of the axes so far: of values, and their sum of derivatives.
            let mut products = vec![(1.0, 0.0)];
            for axis in axes {
                let k = rest % axis.order();
                rest /= axis.order();
                is_corner &= k == 0 || k + 1 == axis.order();
                products = products
                    .iter()
                    .flat_map(|&(value, slope)| {
                        (0..axis.order()).map(move |m| {
                            let (v, s) = (axis.values[m][k], axis.slopes[m][k]);
                            (value * v, slope * v + value * s)
                        })
                    })
                    .collect();
            }
            let sum: f64 = products.iter().map(|(_, slope)| slope.abs()).sum();
            most = most.max(sum);
            if is_corner {
                corner = corner.max(sum);
            }
        }
        (most, corner)
    }

    struct Part {
        most: f64,
        axes: Vec<Functions>,
        next: usize,
    }

    impl PartialEq for Part {
        fn eq(&self, other: &Self) -> bool {
            self.cmp(other) == Ordering::Equal
        }
    }
    impl Eq for Part {}
    impl PartialOrd for Part {
        fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
            Some(self.cmp(other))
        }
    }
    impl Ord for Part {
        fn cmp(&self, other: &Self) -> Ordering {
            self.most.total_cmp(&other.most)
        }
    }

    /// Bounds of K, closer together than `width`. Rounding errors are below 1e-13: a few
    /// hundred roundings of numbers that add up to less than 10.
    fn enclose(degrees: &[usize], width: f64) -> [f64; 2] {
        let axes: Vec<Functions> = degrees.iter().map(|&n| Functions::new(n)).collect();
        let (most, mut least) = bounds(&axes);
        let mut heap = BinaryHeap::from([Part {
            most,
            axes,
            next: 0,
        }]);
        loop {
            let part = heap.pop().expect("the largest part is kept");
            if part.most - least <= width {
                return [least - 1e-13, part.most + 1e-13];
            }
            for half in part.axes[part.next].halves() {
                let mut axes = part.axes.clone();
                axes[part.next] = half;
                let (most, corner) = bounds(&axes);
                least = least.max(corner);
                heap.push(Part {
                    most,
                    next: (part.next + 1) % axes.len(),
                    axes,
                });
            }
        }
    }

    /// Whether the table holds an upper bound of K, and a close one.
    fn check(degrees: &[usize]) {
        let [low, high] = enclose(degrees, 1e-6);
        let stored = uniform(degrees);
        assert!(high <= stored, "{degrees:?}: {high} is above {stored}");
        assert!(stored <= low + 3e-6, "{degrees:?}: {low} is below {stored}");
    }

    #[test]
    fn constants_are_upper_bounds() {
        for n in 1..=5 {
            check(&[n]);
            for m in n..=if n < 3 { 5 } else { n } {
                check(&[m, n]);
            }
        }
        for degrees in [[1, 1, 1], [2, 2, 2], [3, 2, 1], [5, 2, 1]] {
            check(&degrees);
        }
    }

    /// Half a minute without optimisation.
    #[test]
    #[ignore = "for a release build: every entry of the table"]
    fn all_constants_are_upper_bounds() {
        for l in 1..=5 {
            for m in 1..=l {
                check(&[l, m]);
                for n in 1..=m {
                    check(&[l, m, n]);
                }
            }
        }
    }

    /// The figures of the paper.
    #[test]
    fn cubic_constants_are_those_known() {
        assert!((uniform(&[3, 3]) - 2.0464).abs() < 1e-4);
        assert!((uniform(&[3, 3, 3]) - 2.4795).abs() < 1e-4);
    }

    fn lattice<const D: usize>(
        degree: [usize; D],
        knots: [Knots; D],
        displacement: impl Fn(usize) -> [f64; D],
    ) -> Lattice<D> {
        let degree = degree.map(|n| Degree::new(n).unwrap());
        let frame = Frame::new(
            [0.5; D],
            std::array::from_fn(|r| std::array::from_fn(|c| if r == c { 2.0 } else { 0.0 })),
        );
        let grid = Grid::new(degree, [3; D], frame.unwrap()).unwrap();
        let grid = grid.with_knots(knots).unwrap();
        let displacements = (0..grid.control_point_count()).map(displacement).collect();
        Lattice::new(grid, displacements).unwrap()
    }

    fn passes<const D: usize>(lattice: &Lattice<D>) -> bool {
        failing_cell(lattice, &Partials::new(lattice)).is_none()
    }

    /// Cells are two units long: a component may be as large as 2/K.
    #[test]
    fn the_bound_is_in_cells() {
        let largest = 2.0 / uniform(&[3, 3, 3]);
        for (factor, expected) in [(0.999_999, true), (1.000_001, false)] {
            let d = factor * largest;
            let sign = |i: usize| if i & 1 == 0 { d } else { -d };
            let all = lattice([3; 3], [Knots::Uniform; 3], |i| {
                [sign(i), sign(i / 2), sign(i / 4)]
            });
            assert_eq!(passes(&all), expected);
        }
        let far = lattice([3; 2], [Knots::Uniform; 2], |i| {
            if i == 35 { [0.0, 1.5] } else { [0.0; 2] }
        });
        assert_eq!(failing_cell(&far, &Partials::new(&far)), Some([2, 2]));
    }

    /// In the corner of a clamped domain, control points that move by 1/K as the derivation
    /// says make the Jacobian singular: the constant is exact.
    #[test]
    fn clamped_constants_are_reached_in_a_corner() {
        let n = 3;
        let clamped = [Knots::Clamped; 2];
        assert!((constant(lattice([n; 2], clamped, |_| [0.0; 2]).grid()) - 12.0).abs() < 1e-15);
        let d = 1.0 / 12.0;
        let folded = lattice([n; 2], clamped, |i| {
            // The corner's own control point, whose gradient is −3 (1, 1), and the others.
            let sign = if i == 0 { 1.0 } else { -1.0 };
            [2.0 * sign * d; 2]
        });
        assert!(!passes(&folded));
        let corner = folded.evaluate([0.5; 2]).unwrap();
        assert!(corner.determinant.abs() < 1e-14);
        let less = lattice([n; 2], clamped, |i| {
            folded.displacements()[i].map(|x| 0.999_999 * x)
        });
        assert!(passes(&less));
    }
}
