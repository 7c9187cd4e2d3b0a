//! A lattice in integers, and the polynomials of one cell.
//!
//! Stored numbers are binary fractions, and knots are integers. So, times a power of two and
//! the common denominator of the weights that lead from control points to Bézier values, all
//! coefficients of the map are integers. In a cell, with `u` the position in lattice
//! coordinates, they are those of
//!
//! ```text
//! ∂F/∂u = A + D,    det J = det(A + D) / det A,
//! ```
//!
//! with the axes of the frame as the columns of A, and D from the displacements. Columns come
//! from the Bézier form of the displacements: the derivative of a polynomial of degree n with
//! the Bézier values bₖ has the values n (bₖ₊₁ − bₖ).
//!
//! Nothing here comes from the evaluation or the tests of this crate; of a lattice, only the
//! public functions are asked.

use dashu_int::IBig;
use dashu_int::ops::BitTest;

use super::form::Form;
use super::wide::Integer;
use crate::{Border, Knots, Lattice};

/// A finite number as an integer times a power of two.
pub(super) fn decode(x: f64) -> (IBig, i64) {
    let bits = x.to_bits();
    let field = i64::try_from(bits >> 52 & 0x7FF).expect("eleven bits");
    let fraction = bits & ((1 << 52) - 1);
    let (mantissa, exponent) = if field == 0 {
        (fraction, -1074)
    } else {
        (fraction | 1 << 52, field - 1075)
    };
    if mantissa == 0 {
        return (IBig::ZERO, 0);
    }
    let zeros = mantissa.trailing_zeros();
    let odd = IBig::from(mantissa >> zeros);
    let odd = if x.is_sign_negative() { -odd } else { odd };
    (odd, exponent + i64::from(zeros))
}

/// Numbers as integers times one power of two, and its exponent.
pub(super) fn integers(values: &[f64]) -> (Vec<IBig>, i64) {
    let parts: Vec<_> = values.iter().map(|&x| decode(x)).collect();
    let used = parts.iter().filter(|(odd, _)| !odd.is_zero());
    let lowest = used.map(|&(_, exponent)| exponent).min().unwrap_or(0);
    let shifted = |(odd, exponent): (IBig, i64)| match usize::try_from(exponent - lowest) {
        Ok(shift) => odd << shift,
        // Only for a zero.
        Err(_) => IBig::ZERO,
    };
    (parts.into_iter().map(shifted).collect(), lowest)
}

/// The largest absolute value.
fn largest<'a>(values: impl Iterator<Item = &'a IBig>) -> IBig {
    let positive = |x: &IBig| if x < &IBig::ZERO { -x } else { x.clone() };
    values.map(positive).max().unwrap_or(IBig::ZERO)
}

/// The conversion of one axis to Bézier form: of each cell, `[i][m]` is the weight of
/// control value m in Bézier value i, times `unit`.
struct Weights {
    unit: u64,
    /// One for all cells if knots are uniform.
    cells: Vec<Vec<Vec<u64>>>,
}

impl Weights {
    fn of_cell(&self, cell: usize) -> &[Vec<u64>] {
        &self.cells[cell.min(self.cells.len() - 1)]
    }
}

/// The weights in a cell, with knot number i from its beginning given by `knot`, times 60ⁿ.
///
/// Bézier value i is the polar form at n − i zeros and i ones, and a control value is that
/// at n consecutive knots. One argument after the other is replaced: between
/// `f(…, κⱼ₋ₙ₊ᵣ)` and `f(…, κⱼ₊₁)`, which share the other arguments, f is affine.
fn polar_weights(n: usize, knot: impl Fn(i64) -> i64) -> Vec<Vec<u64>> {
    let row = |ones: usize| {
        // `values[j][m]`: the weight of control value m in the j-th polar value.
        let unit_row = |j: usize| (0..=n).map(|m| i64::from(j == m)).collect::<Vec<i64>>();
        let mut values: Vec<Vec<i64>> = (0..=n).map(unit_row).collect();
        for step in 1..=n {
            let argument = i64::from(step <= ones);
            values = (0..=n - step)
                .map(|j| {
                    let index = |i: usize| i64::try_from(i).expect("at most the degree");
                    let (low, high) = (knot(index(j + step) - index(n)), knot(index(j) + 1));
                    // Differences of the knots around a cell are from 1 to the degree, 5.
                    let share = 60 / (high - low);
                    let mix = |(a, b)| share * ((high - argument) * a + (argument - low) * b);
                    std::iter::zip(&values[j], &values[j + 1])
                        .map(mix)
                        .collect()
                })
                .collect();
        }
        let weights = values[0].iter();
        let weights = weights.map(|&w| u64::try_from(w).expect("a mean of control values"));
        weights.collect()
    };
    (0..=n).map(row).collect()
}

fn gcd(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { gcd(b, a % b) }
}

fn axis_weights<const D: usize>(lattice: &Lattice<D>, axis: usize) -> Weights {
    let grid = lattice.grid();
    let n = grid.degree()[axis].get();
    let mut cells: Vec<Vec<Vec<u64>>> = match grid.knots()[axis] {
        Knots::Uniform => vec![polar_weights(n, |i| i)],
        Knots::Clamped => {
            let count = i64::try_from(grid.cells()[axis]).expect("control points fit into memory");
            let at = |cell: i64| polar_weights(n, |i| (cell + i).clamp(0, count) - cell);
            (0..count).map(at).collect()
        }
    };
    let mut unit = (0..n).fold(1, |power, _| 60 * power);
    let all = cells.iter().flatten().flatten();
    let common = all.fold(unit, |common, &w| gcd(common, w));
    unit /= common;
    for weight in cells.iter_mut().flatten().flatten() {
        *weight /= common;
    }
    Weights { unit, cells }
}

/// A lattice, ready to be looked at in exact arithmetic.
pub(super) struct Exact<'a, const D: usize> {
    pub(super) lattice: &'a Lattice<D>,
    pub(super) degree: [usize; D],
    /// Cells of the domain before the first of the lattice.
    pub(super) layers: [usize; D],
    /// Cells of the domain.
    pub(super) cells: [usize; D],
    weights: [Weights; D],
    /// The product of the units of all axes.
    pub(super) unit: IBig,
}

impl<'a, const D: usize> Exact<'a, D> {
    pub(super) fn new(lattice: &'a Lattice<D>) -> Self {
        let grid = lattice.grid();
        let degree = grid.degree().map(|n| n.get());
        let layers = match grid.border() {
            Border::Free => [0; D],
            Border::Identity => degree,
        };
        let weights: [Weights; D] = std::array::from_fn(|axis| axis_weights(lattice, axis));
        let unit = weights.iter().fold(IBig::ONE, |unit, w| unit * w.unit);
        Self {
            lattice,
            degree,
            layers,
            cells: std::array::from_fn(|a| grid.cells()[a] + 2 * layers[a]),
            weights,
            unit,
        }
    }

    pub(super) fn cell_count(&self) -> usize {
        self.cells.iter().product()
    }

    pub(super) fn cell(&self, number: usize) -> [usize; D] {
        let mut rest = number;
        self.cells.map(|count| {
            let index = rest % count;
            rest /= count;
            index
        })
    }

    /// The displacement of a control point that acts on a cell; zero for one of a border.
    fn displacement(&self, cell: [usize; D], offset: [usize; D]) -> [f64; D] {
        let per_axis = self.lattice.grid().control_points_per_axis();
        let mut index = [0; D];
        for axis in 0..D {
            match (cell[axis] + offset[axis]).checked_sub(self.layers[axis]) {
                Some(i) if i < per_axis[axis] => index[axis] = i,
                _ => return [0.0; D],
            }
        }
        let axes = (0..D).rev();
        let number = axes.fold(0, |number, axis| number * per_axis[axis] + index[axis]);
        self.lattice.displacements()[number]
    }

    /// The numbers of a cell.
    pub(super) fn numbers(&self, cell: [usize; D]) -> Numbers<D> {
        let order = self.degree.map(|n| n + 1);
        let mut values = self.lattice.grid().frame().axes().as_flattened().to_vec();
        for number in 0..order.iter().product() {
            let mut rest = number;
            let offset = order.map(|count| {
                let index = rest % count;
                rest /= count;
                index
            });
            values.extend(self.displacement(cell, offset));
        }
        let (integers, exponent) = integers(&values);
        let vector = |v: &[IBig]| -> [IBig; D] { std::array::from_fn(|c| v[c].clone()) };
        let mut vectors = integers.chunks_exact(D).map(vector);
        Numbers {
            axes: std::array::from_fn(|_| vectors.next().expect("one for each axis")),
            displacements: vectors.collect(),
            exponent,
        }
    }

    /// The Bézier form of each component of the displacement in a cell, times the unit.
    pub(super) fn bezier<T: Integer>(
        &self,
        cell: [usize; D],
        numbers: &Numbers<D>,
    ) -> [Form<T>; D] {
        let mut counts = [1; 3];
        for (count, n) in counts.iter_mut().zip(self.degree) {
            *count = n + 1;
        }
        std::array::from_fn(|c| {
            let values = numbers.displacements.iter();
            let mut form = Form {
                counts,
                values: values.map(|d| T::from_big(&d[c])).collect(),
            };
            for axis in 0..D {
                form = form.mixed(axis, self.weights[axis].of_cell(cell[axis]));
            }
            form
        })
    }

    /// `columns[a][c]`: component c of the derivative along axis a of u, in Bernstein form,
    /// times the unit.
    pub(super) fn columns<T: Integer>(
        &self,
        cell: [usize; D],
        numbers: &Numbers<D>,
    ) -> [[Form<T>; D]; D] {
        let bezier: [Form<T>; D] = self.bezier(cell, numbers);
        std::array::from_fn(|a| {
            std::array::from_fn(|c| {
                let rest = T::from_big(&(&numbers.axes[a][c] * &self.unit));
                bezier[c].slope(a, &rest)
            })
        })
    }
}

/// The numbers of a cell as integers times 2^`exponent`.
pub(super) struct Numbers<const D: usize> {
    /// Axes of the frame.
    pub(super) axes: [[IBig; D]; D],
    /// Displacements of the control points that act on the cell, first axis fastest.
    displacements: Vec<[IBig; D]>,
    pub(super) exponent: i64,
}

impl<const D: usize> Numbers<D> {
    /// The size, in bits, of the largest coefficient that a column can have.
    pub(super) fn column_bits(&self, exact: &Exact<'_, D>) -> usize {
        let degree = exact.degree.iter().max().expect("two or three axes");
        let rest = largest(self.axes.as_flattened().iter());
        let moved = largest(self.displacements.as_flattened().iter());
        ((rest + moved * (2 * degree)) * &exact.unit).bit_len()
    }
}

/// The determinant of a matrix of integers.
pub(super) fn determinant<const D: usize>(m: &[[IBig; D]; D]) -> IBig {
    (0..D).fold(IBig::ZERO, |sum, c| sum + &m[0][c] * cofactor(m, 0, c))
}

/// The adjugate, `det(m) m⁻¹`.
pub(super) fn adjugate<const D: usize>(m: &[[IBig; D]; D]) -> [[IBig; D]; D] {
    std::array::from_fn(|r| std::array::from_fn(|c| cofactor(m, c, r)))
}

fn cofactor<const D: usize>(m: &[[IBig; D]; D], r: usize, c: usize) -> IBig {
    if D == 2 {
        let entry = m[1 - r][1 - c].clone();
        return if r == c { entry } else { -entry };
    }
    let next = |i: usize, step: usize| (i + step) % 3;
    &m[next(r, 1)][next(c, 1)] * &m[next(r, 2)][next(c, 2)]
        - &m[next(r, 1)][next(c, 2)] * &m[next(r, 2)][next(c, 1)]
}
