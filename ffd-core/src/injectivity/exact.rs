//! The determinant of one cell in exact arithmetic.
//!
//! All stored numbers are binary fractions, and the knots are integers: after
//! multiplication by a power of two and by small numbers everything is an integer. The
//! coefficients here are those of `det(A + D)`, with the sign of `det A`, times a positive
//! number that is not kept: signs are all that is asked.

use dashu_int::{IBig, Sign};

use super::piece::Shape;
use crate::bspline::{Axis, MAX_ORDER};
use crate::{Knots, Lattice};

/// A multiple of all differences of knots that a degree can meet, 1 to 5.
const MULTIPLE: i64 = 60;

/// Bernstein coefficients over a box, first axis fastest, times an unknown positive number.
#[derive(Debug, Clone)]
pub(super) struct ExactPiece {
    counts: [usize; 3],
    coefficients: Vec<IBig>,
}

/// What the signs of coefficients say.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Signs {
    /// Whether there is a coefficient with that sign.
    pub(super) any_positive: bool,
    pub(super) any_negative: bool,
    /// A corner where the value has that sign.
    pub(super) positive_corner: Option<usize>,
    pub(super) negative_corner: Option<usize>,
    pub(super) zero_corner: Option<usize>,
}

impl ExactPiece {
    /// The determinant over a cell of the domain.
    pub(super) fn of_cell<const D: usize>(lattice: &Lattice<D>, cell: [usize; D]) -> Self {
        let lowest = lowest_of_cell(lattice, cell);
        let columns = Integers::new(lattice, cell, lowest).columns(lattice, cell);
        Self::of_product(determinant(columns.each_ref()), lattice)
    }

    /// The determinant over a cell while displacements go in a straight line to those of
    /// another lattice on the same grid: its Bernstein coefficients along the way, D + 1
    /// polynomials, all times the same number.
    ///
    /// A determinant whose columns are linear in t is a polynomial of degree D. Its
    /// coefficient k is the mean of the determinants with k columns from the end of the way
    /// and the others from its beginning.
    pub(super) fn of_path<const D: usize>(
        from: &Lattice<D>,
        to: &Lattice<D>,
        cell: [usize; D],
    ) -> Vec<Self> {
        let lowest = lowest_of_cell(from, cell).min(lowest_of_cell(to, cell));
        let [first, last] =
            [from, to].map(|lattice| Integers::new(lattice, cell, lowest).columns(lattice, cell));
        let mut sums: Vec<Option<Form>> = (0..=D).map(|_| None).collect();
        for choice in 0..1_usize << D {
            let columns = std::array::from_fn(|a| {
                let ends = [&first[a], &last[a]];
                ends[choice >> a & 1]
            });
            let term = determinant(columns);
            match &mut sums[choice.count_ones() as usize] {
                sum @ None => *sum = Some(term),
                Some(sum) => sum.add(&term),
            }
        }
        // Means of 1, D, D and 1 determinants, all times D.
        let sums = sums.into_iter().enumerate().map(|(k, sum)| {
            let mut sum = sum.expect("a choice of columns for each number");
            if k == 0 || k == D {
                sum.values.iter_mut().for_each(|value| *value *= D);
            }
            Self::of_product(sum, from)
        });
        sums.collect()
    }

    /// From a product of scaled columns to Bernstein coefficients.
    fn of_product<const D: usize>(mut product: Form, lattice: &Lattice<D>) -> Self {
        let degree = lattice.grid().degree().map(crate::Degree::get);
        let mirrored = frame_is_mirrored(lattice);
        // From products to Bernstein coefficients: divided by binomial coefficients, and
        // multiplied by their least common multiple, to stay among the integers.
        let unscale = degree.map(|n| over_binomials(D * n - 1));
        let counts = product.counts;
        for (index, value) in product.values.iter_mut().enumerate() {
            let (i, rest) = (index % counts[0], index / counts[0]);
            let (j, k) = (rest % counts[1], rest / counts[1]);
            let mut factor = IBig::from(unscale[0][i]) * unscale[1][j];
            if D == 3 {
                factor *= unscale[D - 1][k];
            }
            *value *= if mirrored { -factor } else { factor };
        }
        Self {
            counts,
            coefficients: product.values,
        }
    }

    pub(super) fn coefficients(&self) -> &[IBig] {
        &self.coefficients
    }

    pub(super) fn coefficients_mut(&mut self) -> &mut [IBig] {
        &mut self.coefficients
    }

    /// The part of a cell with the given lower corner, after as many halvings along each
    /// axis.
    pub(super) fn part<const D: usize>(&self, low: [f64; D], level: [i32; D]) -> Self {
        let mut piece = self.clone();
        for axis in 0..D {
            // The bits of the position say which half is taken each time.
            let mut position = low[axis];
            for _ in 0..level[axis] {
                position *= 2.0;
                let [low_half, high_half] = piece.split(axis);
                piece = if position >= 1.0 { high_half } else { low_half };
                position -= position.floor();
            }
        }
        piece
    }

    /// Cuts the box in the middle of an axis, into the lower and the upper half.
    pub(super) fn split(&self, axis: usize) -> [Self; 2] {
        let stride: usize = self.counts[..axis].iter().product();
        let count = self.counts[axis];
        let mut low = self.clone();
        let mut high = self.clone();
        for slab in (0..self.coefficients.len()).step_by(stride * count) {
            for offset in slab..slab + stride {
                let at = |i: usize| offset + i * stride;
                // Sums in place of means: step s is 2ˢ times too large, and in the end
                // everything is made 2^(count − 1) times too large.
                low.coefficients[at(0)] <<= count - 1;
                for step in 1..count {
                    for i in 0..count - step {
                        let next = high.coefficients[at(i + 1)].clone();
                        high.coefficients[at(i)] += next;
                    }
                    low.coefficients[at(step)] =
                        high.coefficients[at(0)].clone() << (count - 1 - step);
                }
                for i in 0..count {
                    high.coefficients[at(i)] <<= i;
                }
            }
        }
        [low, high]
    }

    pub(super) fn signs(&self, shape: &Shape) -> Signs {
        let mut signs = Signs {
            any_positive: false,
            any_negative: false,
            positive_corner: None,
            negative_corner: None,
            zero_corner: None,
        };
        for value in &self.coefficients {
            if !value.is_zero() {
                match value.sign() {
                    Sign::Positive => signs.any_positive = true,
                    Sign::Negative => signs.any_negative = true,
                }
            }
        }
        let dimension = if self.counts[2] == 1 { 2 } else { 3 };
        for corner in 0..1 << dimension {
            let value = &self.coefficients[shape.corner(corner)];
            let which = if value.is_zero() {
                &mut signs.zero_corner
            } else if value.sign() == Sign::Positive {
                &mut signs.positive_corner
            } else {
                &mut signs.negative_corner
            };
            which.get_or_insert(corner);
        }
        signs
    }
}

/// Whether the axes of the frame are left-handed: the sign of `det A`, which is not zero.
fn frame_is_mirrored<const D: usize>(lattice: &Lattice<D>) -> bool {
    let axes = lattice.grid().frame().axes();
    let lowest = lowest_exponent(axes.as_flattened());
    let a = axes.map(|axis| axis.map(|x| integer(x, lowest)));
    let minor = |r: usize, p: usize, q: usize| {
        &a[r][p] * &a[(r + 1) % D][q] - &a[r][q] * &a[(r + 1) % D][p]
    };
    let determinant = if D == 2 {
        minor(0, 0, 1)
    } else {
        &a[0][0] * minor(1, 1, D - 1)
            + &a[0][1] * minor(1, D - 1, 0)
            + &a[0][D - 1] * minor(1, 0, 1)
    };
    determinant.sign() == Sign::Negative
}

/// The determinant of columns given component by component.
fn determinant<const D: usize>(columns: [&[Form; D]; D]) -> Form {
    let [first, second] = [columns[0], columns[1]];
    if D == 2 {
        let mut sum = first[0].times(&second[1]);
        sum.subtract(&first[1].times(&second[0]));
        return sum;
    }
    let third = columns[D - 1];
    let mut sum: Option<Form> = None;
    for c in 0..3 {
        let (p, q) = ((c + 1) % 3, (c + 2) % 3);
        let mut cross = first[p].times(&second[q]);
        cross.subtract(&first[q].times(&second[p]));
        let term = cross.times(&third[c]);
        match &mut sum {
            None => sum = Some(term),
            Some(sum) => sum.add(&term),
        }
    }
    sum.expect("three components")
}

/// Displacements of the control points that act on a cell, first axis fastest.
fn displacements_of_cell<const D: usize>(lattice: &Lattice<D>, cell: [usize; D]) -> Vec<[f64; D]> {
    let block = lattice.block(cell);
    let order = lattice.grid().order();
    let numbers = 0..order.iter().product();
    let each = numbers.map(|number: usize| {
        let mut rest = number;
        block.displacement(order.map(|n| {
            let index = rest % n;
            rest /= n;
            index
        }))
    });
    each.collect()
}

/// The power of two of which all numbers of a cell are multiples.
fn lowest_of_cell<const D: usize>(lattice: &Lattice<D>, cell: [usize; D]) -> i32 {
    let axes = lattice.grid().frame().axes();
    let displacements = displacements_of_cell(lattice, cell);
    lowest_exponent(axes.as_flattened()).min(lowest_exponent(displacements.as_flattened()))
}

/// The numbers of a cell as integers, all multiplied by the same power of two.
struct Integers<const D: usize> {
    /// Axes of the frame.
    axes: [[IBig; D]; D],
    /// Displacements of the control points that act on the cell, first axis fastest.
    displacements: Vec<[IBig; D]>,
}

impl<const D: usize> Integers<D> {
    /// Divided by two to the power `lowest`.
    fn new(lattice: &Lattice<D>, cell: [usize; D], lowest: i32) -> Self {
        let displacements = displacements_of_cell(lattice, cell);
        let axes = lattice.grid().frame().axes();
        Self {
            axes: axes.map(|axis| axis.map(|x| integer(x, lowest))),
            displacements: displacements
                .iter()
                .map(|d| d.map(|x| integer(x, lowest)))
                .collect(),
        }
    }

    /// `columns[a][c]`: component c of the column for axis a, in scaled Bernstein form.
    fn columns(&self, lattice: &Lattice<D>, cell: [usize; D]) -> [[Form; D]; D] {
        let grid = lattice.grid();
        let order = grid.order();
        let stride = |axis: usize| -> usize { order[..axis].iter().product() };
        std::array::from_fn(|a| {
            let slopes = Slopes::new(&grid.axes()[a], grid.kind_of_cell(a, cell[a]));
            let mut counts = [1; 3];
            counts[..D].copy_from_slice(&order);
            counts[a] -= 1;
            std::array::from_fn(|c| {
                let values = (0..counts.iter().product())
                    .map(|number: usize| {
                        let indices = [
                            number % counts[0],
                            number / counts[0] % counts[1],
                            number / counts[0] / counts[1],
                        ];
                        let at: usize = (0..D).map(|axis| indices[axis] * stride(axis)).sum();
                        let difference =
                            &self.displacements[at + stride(a)][c] - &self.displacements[at][c];
                        &self.axes[a][c] * slopes.unit + difference * slopes.factors[indices[a]]
                    })
                    .collect();
                let mut form = Form { counts, values };
                for axis in 0..D {
                    let own = &grid.axes()[axis];
                    let degree = own.degree().get() - usize::from(axis == a);
                    let kind = grid.kind_of_cell(axis, cell[axis]);
                    form.convert(axis, &bezier(own, kind, degree));
                }
                form
            })
        })
    }
}

/// `n / (κᵢ₊ₙ₊₁ − κᵢ₊₁)` in a cell, times `unit`.
struct Slopes {
    unit: i64,
    factors: [i64; MAX_ORDER],
}

impl Slopes {
    fn new(axis: &Axis, kind: usize) -> Self {
        let n = axis.degree().get();
        if axis.knots() == Knots::Uniform {
            return Self {
                unit: 1,
                factors: [1; MAX_ORDER],
            };
        }
        let mut factors = [0; MAX_ORDER];
        for (i, factor) in factors[..n].iter_mut().enumerate() {
            let i = i.cast_signed();
            let difference = knot(axis, kind, i + 1) - knot(axis, kind, i + 1 - n.cast_signed());
            *factor = n as i64 * (MULTIPLE / difference);
        }
        Self {
            unit: MULTIPLE,
            factors,
        }
    }
}

#[expect(clippy::cast_possible_truncation, reason = "a small integer")]
fn knot(axis: &Axis, kind: usize, i: isize) -> i64 {
    axis.knot(axis.cell_of_kind(kind), i) as i64
}

/// The conversion to Bézier form of a spline of the given degree on the knots of an axis:
/// row i holds the weights of Bézier value i, times a common number.
///
/// The recursion for polar forms over the knots, in integers: each step is made
/// [`MULTIPLE`] times too large.
fn bezier(axis: &Axis, kind: usize, degree: usize) -> Vec<[i64; MAX_ORDER]> {
    let knot = |i: isize| knot(axis, kind, i);
    let mut rows: Vec<[i64; MAX_ORDER]> = (0..=degree)
        .map(|i| {
            let mut weights = [0; MAX_ORDER];
            weights[0] = 1;
            for p in 1..=degree {
                // n − i zeros and i ones.
                let argument = i64::from(p > degree - i);
                let mut carried = 0;
                for r in 0..p {
                    let (low, high) = (
                        knot((r + 1).cast_signed() - p.cast_signed()),
                        knot(r.cast_signed() + 1),
                    );
                    let quotient = weights[r] * (MULTIPLE / (high - low));
                    weights[r] = carried + (high - argument) * quotient;
                    carried = (argument - low) * quotient;
                }
                weights[p] = carried;
            }
            weights
        })
        .collect();
    let common = rows.iter().flatten().fold(0, |a, &b| gcd(a, b));
    for weight in rows.iter_mut().flatten() {
        *weight /= common;
    }
    rows
}

fn gcd(a: i64, b: i64) -> i64 {
    if b == 0 { a } else { gcd(b, a % b) }
}

fn binomial(n: usize, k: usize) -> i64 {
    (0..k).fold(1, |product, i| product * (n - i) as i64 / (i + 1) as i64)
}

/// The least common multiple of the binomial coefficients over each of them.
fn over_binomials(n: usize) -> Vec<i64> {
    let all: Vec<i64> = (0..=n).map(|k| binomial(n, k)).collect();
    let multiple = all.iter().fold(1, |m, &b| m / gcd(m, b) * b);
    all.iter().map(|b| multiple / b).collect()
}

/// Coefficients of a polynomial in two or three variables, first axis fastest.
struct Form {
    counts: [usize; 3],
    values: Vec<IBig>,
}

impl Form {
    /// Replaces the control values along an axis by scaled Bézier values.
    fn convert(&mut self, axis: usize, rows: &[[i64; MAX_ORDER]]) {
        let stride: usize = self.counts[..axis].iter().product();
        let count = self.counts[axis];
        let mut line = vec![IBig::ZERO; count];
        for slab in (0..self.values.len()).step_by(stride * count) {
            for offset in slab..slab + stride {
                for (i, value) in line.iter_mut().enumerate() {
                    *value = IBig::ZERO;
                    for m in 0..count {
                        *value += &self.values[offset + m * stride] * rows[i][m];
                    }
                    *value *= binomial(count - 1, i);
                }
                for (i, value) in line.iter_mut().enumerate() {
                    std::mem::swap(&mut self.values[offset + i * stride], value);
                }
            }
        }
    }

    fn times(&self, other: &Self) -> Self {
        let counts: [usize; 3] = std::array::from_fn(|a| self.counts[a] + other.counts[a] - 1);
        let mut values = vec![IBig::ZERO; counts.iter().product()];
        let split = |index: usize, counts: [usize; 3]| {
            let rest = index / counts[0];
            [index % counts[0], rest % counts[1], rest / counts[1]]
        };
        for (p, a) in self.values.iter().enumerate() {
            let [i1, j1, k1] = split(p, self.counts);
            for (q, b) in other.values.iter().enumerate() {
                let [i2, j2, k2] = split(q, other.counts);
                let at = (i1 + i2) + counts[0] * ((j1 + j2) + counts[1] * (k1 + k2));
                values[at] += a * b;
            }
        }
        Self { counts, values }
    }

    fn add(&mut self, other: &Self) {
        for (a, b) in self.values.iter_mut().zip(&other.values) {
            *a += b;
        }
    }

    fn subtract(&mut self, other: &Self) {
        for (a, b) in self.values.iter_mut().zip(&other.values) {
            *a -= b;
        }
    }
}

/// Mantissa and exponent: `value = mantissa · 2^exponent`.
pub(super) fn decompose(value: f64) -> (i64, i32) {
    let bits = value.to_bits();
    let exponent = i32::try_from(bits >> 52 & 0x7FF).expect("eleven bits");
    let fraction = (bits & ((1 << 52) - 1)).cast_signed();
    let (mantissa, exponent) = if exponent == 0 {
        (fraction, -1074)
    } else {
        (fraction | 1 << 52, exponent - 1075)
    };
    (
        if value.is_sign_negative() {
            -mantissa
        } else {
            mantissa
        },
        exponent,
    )
}

/// The lowest power of two that is needed to write numbers as multiples of it.
fn lowest_exponent(values: &[f64]) -> i32 {
    let each = values.iter().filter(|&&v| v != 0.0).map(|&v| {
        let (mantissa, exponent) = decompose(v);
        exponent + mantissa.trailing_zeros().cast_signed()
    });
    each.min().unwrap_or(i32::MAX)
}

/// `value / 2^lowest`, an integer.
fn integer(value: f64, lowest: i32) -> IBig {
    if value == 0.0 {
        return IBig::ZERO;
    }
    let (mantissa, exponent) = decompose(value);
    let shift = exponent - lowest;
    if shift >= 0 {
        IBig::from(mantissa) << usize::try_from(shift).expect("not negative")
    } else {
        // Only zeros are shifted out.
        IBig::from(mantissa >> shift.unsigned_abs())
    }
}
