//! The Bernstein form of the determinant of one cell.
//!
//! The columns of the Jacobian are converted to Bézier form, and multiplied as
//! polynomials: first the cross product of two columns, then the scalar product with the
//! third. With values multiplied by their binomial coefficients, products of Bernstein
//! polynomials are plain convolutions; all weights are positive, so the result is as
//! accurate as the size of its terms allows.
//!
//! In 3-D with degree n along an axis, the determinant has degree 3n − 1 there; in 2-D,
//! 2n − 1.
//!
//! # Rounding
//!
//! Let N be the largest 1-norm of the control vectors of a column, e a bound of the error
//! of an entry of its Bézier vectors, and P = Π (N + D e) over the columns. A coefficient of
//! the determinant is a weighted mean of determinants of Bézier vectors; for each, the sum
//! of the absolute terms is at most Π N. So errors of the vectors change it by at most
//! P − Π N, and t roundings one after another by t u P more: see [`Rounding`].
//!
//! The lanes of vectors are the coefficients of a row, along the first axis.

use fearless_simd::{Level, Simd, SimdBase, dispatch, f64x4};

use super::partials::{Partials, UNIT};
use crate::bspline::{BezierTables, MAX_ORDER, ToBezier};

/// Lanes of a row: enough for the highest order.
pub(super) const ROW: usize = 8;

/// Binomial coefficients.
pub(super) fn binomial(n: usize, k: usize) -> f64 {
    (0..k).fold(1.0, |product, i| product * (n - i) as f64 / (i + 1) as f64)
}

/// How much rounding adds up in the conversion to Bézier form and in the products, for
/// given degrees and a given precision.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Rounding {
    /// Relative to the largest entry of the control vectors: the error of a Bézier vector.
    conversion: f64,
    /// Relative to the sum of absolute terms: that of the products.
    products: f64,
    /// Control vectors must not have a larger 1-norm, so that nothing overflows.
    largest: f64,
}

impl Rounding {
    /// With weights that have a relative error of `weight` units, and the unit roundoff
    /// of the precision.
    ///
    /// The conversion adds at most six products along each axis. One coefficient of the
    /// product of two or three columns is the sum of as many products as pairs of
    /// coefficients meet in it; and it is divided by three binomial coefficients.
    ///
    /// Sums of products are at most Π N times the largest binomial coefficients of the
    /// result; they must stay below `limit`, so that nothing overflows.
    pub(super) fn new(degree: &[usize], unit: f64, weight: f64, limit: f64) -> Self {
        let axes = degree.len() as f64;
        let dimension = degree.len();
        let scale: f64 = degree
            .iter()
            .map(|n| binomial(dimension * n - 1, (dimension * n - 1) / 2))
            .product();
        // Along each axis as many pairs as the shorter factor has coefficients.
        let terms = match *degree {
            [a, b] => 2 * a * b,
            [a, b, c] => 2 * a * b * (c + 1) + 3 * (a + 1) * (b + 1) * c,
            _ => unreachable!("two or three axes"),
        };
        Self {
            conversion: axes * (weight + 7.0) * unit,
            products: (terms as f64 + 8.0) * unit,
            largest: (limit / scale).powf(1.0 / axes),
        }
    }

    /// For `f64` and the products of this file.
    pub(super) fn double(degree: &[usize]) -> Self {
        // Weights come from a recursion of at most five steps with at most five
        // roundings each, and are multiplied by a binomial coefficient.
        Self::new(degree, UNIT, 26.0, 1e300)
    }

    /// A bound of the error of all coefficients, for control vectors with the given
    /// 1-norms, one for each column.
    pub(super) fn bound<const D: usize>(&self, partials: &Partials<D>, norms: [f64; D]) -> f64 {
        self.bound_with(norms, norms.map(|norm| partials.error(norm)))
    }

    /// The same, for entries of control vectors that err by the given amounts.
    pub(super) fn bound_with<const D: usize>(&self, norms: [f64; D], errors: [f64; D]) -> f64 {
        if !norms.iter().all(|&norm| norm <= self.largest) {
            return f64::INFINITY;
        }
        let (mut exact, mut disturbed) = (1.0, 1.0);
        for (norm, error) in norms.into_iter().zip(errors) {
            let error = error + self.conversion * (norm + 1.0);
            exact *= norm;
            disturbed *= norm + D as f64 * error;
        }
        // The difference itself is rounded.
        1.01 * (disturbed - exact) + (self.products + 16.0 * UNIT) * disturbed
    }
}

/// Where coefficients are multiplied. Reused for many cells.
#[derive(Debug, Clone)]
pub(super) struct Products<const D: usize> {
    pub(super) level: Level,
    degree: [usize; D],
    pub(super) rounding: Rounding,
    /// `columns[a][c]`: scaled Bézier values of component c of column a, in rows.
    columns: [[Vec<f64>; D]; D],
    /// The same on the way.
    half: Vec<f64>,
    /// The cross product of the first two columns, component by component.
    cross: [Vec<f64>; D],
    /// Transposed and scaled conversions of each axis, for splines and derivatives, and
    /// the cell kind that they belong to.
    tables: [Option<([usize; D], [Columns; 2])>; D],
    /// One over the binomial coefficients of the result along each axis.
    unscale: [[f64; 3 * MAX_ORDER]; D],
}

/// Column m holds the weight of control value m in each scaled Bézier value.
type Columns = [[f64; ROW]; MAX_ORDER];

impl<const D: usize> Products<D> {
    pub(super) fn new(degree: [usize; D]) -> Self {
        let rows: usize = degree[1..].iter().map(|n| n + 1).product();
        let result = Self::result_degree(degree);
        let cross_rows: usize = if D == 3 {
            2 * degree[1] * (2 * degree[D - 1] + 1)
        } else {
            0
        };
        Self {
            level: Level::new(),
            degree,
            rounding: Rounding::double(&degree),
            columns: std::array::from_fn(|_| std::array::from_fn(|_| vec![0.0; rows * ROW])),
            half: vec![0.0; rows * ROW],
            cross: std::array::from_fn(|_| vec![0.0; cross_rows * 2 * ROW]),
            tables: [None; D],
            unscale: result.map(|n| {
                let mut row = [0.0; 3 * MAX_ORDER];
                for (i, entry) in row[..=n].iter_mut().enumerate() {
                    *entry = 1.0 / binomial(n, i);
                }
                row
            }),
        }
    }

    /// The degree of the determinant along each axis.
    pub(super) fn result_degree(degree: [usize; D]) -> [usize; D] {
        degree.map(|n| D * n - 1)
    }

    /// Writes the Bernstein coefficients of the determinant in a cell to `out`, first axis
    /// fastest, and returns a bound of their error.
    pub(super) fn determinant(
        &mut self,
        partials: &Partials<D>,
        cell: [usize; D],
        out: &mut Vec<f64>,
    ) -> f64 {
        let norms = partials.norms(cell);
        let error = self.rounding.bound(partials, norms);
        let count = self.degree.iter().map(|n| D * n).product();
        out.clear();
        out.resize(count, 0.0);
        self.set_tables(partials, cell);
        let level = self.level;
        match self.degree[0] {
            1 => dispatch!(level, s => run::<_, D, 1, 1>(s, self, partials, cell, out)),
            2 => dispatch!(level, s => run::<_, D, 2, 1>(s, self, partials, cell, out)),
            3 => dispatch!(level, s => run::<_, D, 3, 1>(s, self, partials, cell, out)),
            4 => dispatch!(level, s => run::<_, D, 4, 2>(s, self, partials, cell, out)),
            _ => dispatch!(level, s => run::<_, D, 5, 2>(s, self, partials, cell, out)),
        }
        error
    }

    fn set_tables(&mut self, partials: &Partials<D>, cell: [usize; D]) {
        let kind = partials.kind(cell);
        for axis in 0..D {
            let mut key = [0; D];
            key[0] = kind[axis];
            if self.tables[axis].is_some_and(|(k, _)| k == key) {
                continue;
            }
            let n = self.degree[axis];
            let BezierTables { full, slope } = partials.tables(cell)[axis];
            self.tables[axis] = Some((key, [columns(full, n), columns(slope, n - 1)]));
        }
    }
}

/// Transposes a conversion and multiplies it by binomial coefficients.
fn columns(rows: &ToBezier, degree: usize) -> Columns {
    let mut columns = [[0.0; ROW]; MAX_ORDER];
    for i in 0..=degree {
        for m in 0..=degree {
            columns[m][i] = binomial(degree, i) * rows[i][m];
        }
    }
    columns
}

/// Converts the columns and multiplies them. `N` is the degree along the first axis and
/// `R` the number of vectors that hold a row of `N + 1` values.
#[inline(always)]
fn run<S: Simd, const D: usize, const N: usize, const R: usize>(
    simd: S,
    products: &mut Products<D>,
    partials: &Partials<D>,
    cell: [usize; D],
    out: &mut [f64],
) {
    for a in 0..D {
        for c in 0..D {
            convert::<S, D, R>(simd, products, partials, cell, a, c);
        }
    }
    if D == 2 {
        multiply_plane::<S, D, N, R>(simd, products, out);
    } else {
        cross::<S, D, N, R>(simd, products);
        multiply_space::<S, D, N, R>(simd, products, out);
    }
}

/// Component c of column a: along the first axis, then the others.
#[inline(always)]
fn convert<S: Simd, const D: usize, const R: usize>(
    simd: S,
    products: &mut Products<D>,
    partials: &Partials<D>,
    cell: [usize; D],
    a: usize,
    c: usize,
) {
    let window = partials.window(a);
    let planes = if D == 3 { window[D - 1] } else { 1 };
    let table = |axis: usize| -> &Columns {
        let (_, [full, slope]) = products.tables[axis].as_ref().expect("set before");
        if axis == a { slope } else { full }
    };
    let values = &partials.vectors[a][c];
    let start = partials.index(cell);
    let zero = f64x4::splat(simd, 0.0);
    let column = &mut products.columns[a][c];
    let first = table(0);
    for k in 0..planes {
        for j in 0..window[1] {
            let plane = if D == 3 {
                k * partials.stride[D - 1]
            } else {
                0
            };
            let at = start + j * partials.stride[1] + plane;
            let row = &values[at..at + window[0]];
            let mut sum = [zero; R];
            for (m, &value) in row.iter().enumerate() {
                for r in 0..R {
                    sum[r] += f64x4::from_slice(simd, &first[m][4 * r..4 * r + 4]) * value;
                }
            }
            store(&sum, &mut column[(k * window[1] + j) * ROW..]);
        }
    }
    // Along the second axis, in each plane.
    let second = table(1);
    for k in 0..planes {
        for i in 0..window[1] {
            let mut sum = [zero; R];
            for j in 0..window[1] {
                let row = &column[(k * window[1] + j) * ROW..][..ROW];
                for r in 0..R {
                    sum[r] += f64x4::from_slice(simd, &row[4 * r..4 * r + 4]) * second[j][i];
                }
            }
            store(&sum, &mut products.half[(k * window[1] + i) * ROW..]);
        }
    }
    if D == 2 {
        column.copy_from_slice(&products.half);
        return;
    }
    let third = table(D - 1);
    for i in 0..planes {
        for j in 0..window[1] {
            let mut sum = [zero; R];
            for k in 0..planes {
                let row = &products.half[(k * window[1] + j) * ROW..][..ROW];
                for r in 0..R {
                    sum[r] += f64x4::from_slice(simd, &row[4 * r..4 * r + 4]) * third[k][i];
                }
            }
            store(&sum, &mut column[(i * window[1] + j) * ROW..]);
        }
    }
}

#[inline(always)]
fn store<S: Simd, const R: usize>(row: &[f64x4<S>; R], out: &mut [f64]) {
    for r in 0..R {
        row[r].store_slice(&mut out[4 * r..4 * r + 4]);
    }
}

/// Adds row i of the accumulators, shifted by i, to a row of coefficients.
#[inline(always)]
fn fold<S: Simd, const L: usize, const R: usize>(
    sums: &[[f64x4<S>; R]; L],
    out: &mut [f64; 2 * ROW + 4],
) {
    *out = [0.0; 2 * ROW + 4];
    for i in 0..L {
        for r in 0..R {
            let mut lanes = [0.0; 4];
            sums[i][r].store_slice(&mut lanes);
            for q in 0..4 {
                out[i + 4 * r + q] += lanes[q];
            }
        }
    }
}

/// Adds the product of a row of numbers with a row in vectors.
#[inline(always)]
fn add_product<S: Simd, const L: usize, const R: usize>(
    simd: S,
    sums: &mut [[f64x4<S>; R]; L],
    a: &[f64; L],
    b: &[f64],
) {
    for r in 0..R {
        let row = f64x4::from_slice(simd, &b[4 * r..4 * r + 4]);
        for i in 0..L {
            sums[i][r] += row * a[i];
        }
    }
}

/// Subtracts it.
#[inline(always)]
fn subtract_product<S: Simd, const L: usize, const R: usize>(
    simd: S,
    sums: &mut [[f64x4<S>; R]; L],
    a: &[f64; L],
    b: &[f64],
) {
    for r in 0..R {
        let row = f64x4::from_slice(simd, &b[4 * r..4 * r + 4]);
        for i in 0..L {
            sums[i][r] -= row * a[i];
        }
    }
}

#[inline(always)]
fn head<const L: usize>(row: &[f64]) -> &[f64; L] {
    row[..L].try_into().expect("a row is longer")
}

/// The indices of the first factor, of `a` values, that meet the second, of `b` values, in
/// coefficient `k` of the product.
#[inline(always)]
fn partners(k: usize, a: usize, b: usize) -> std::ops::Range<usize> {
    (k + 1).saturating_sub(b)..(k + 1).min(a)
}

/// In the plane: X × Y.
#[inline(always)]
fn multiply_plane<S: Simd, const D: usize, const N: usize, const R: usize>(
    simd: S,
    products: &Products<D>,
    out: &mut [f64],
) {
    let n = products.degree[1];
    let ([x, y], unscale) = (
        [&products.columns[0], &products.columns[1]],
        &products.unscale,
    );
    let zero = f64x4::splat(simd, 0.0);
    for (j, out) in out.chunks_exact_mut(2 * N).enumerate() {
        let mut sums = [[zero; R]; N];
        // X has n + 1 rows, Y has n.
        for j1 in partners(j, n + 1, n) {
            let (at, with) = (j1 * ROW, (j - j1) * ROW);
            add_product(simd, &mut sums, head(&x[0][at..]), &y[1][with..with + ROW]);
            subtract_product(simd, &mut sums, head(&x[1][at..]), &y[0][with..with + ROW]);
        }
        let mut row = [0.0; 2 * ROW + 4];
        fold(&sums, &mut row);
        for (i, out) in out.iter_mut().enumerate() {
            *out = row[i] * (unscale[1][j] * unscale[0][i]);
        }
    }
}

/// The cross product of the first two columns in space.
#[inline(always)]
fn cross<S: Simd, const D: usize, const N: usize, const R: usize>(
    simd: S,
    products: &mut Products<D>,
) {
    let [n1, n2] = [products.degree[1], products.degree[D - 1]];
    let (x, y) = (&products.columns[0], &products.columns[1]);
    let zero = f64x4::splat(simd, 0.0);
    for k in 0..=2 * n2 {
        for j in 0..2 * n1 {
            for c in 0..D {
                let (p, q) = ((c + 1) % D, (c + 2) % D);
                let mut sums = [[zero; R]; N];
                for k1 in partners(k, n2 + 1, n2 + 1) {
                    for j1 in partners(j, n1 + 1, n1) {
                        let at = (k1 * (n1 + 1) + j1) * ROW;
                        let with = ((k - k1) * n1 + (j - j1)) * ROW;
                        add_product(simd, &mut sums, head(&x[p][at..]), &y[q][with..with + ROW]);
                        subtract_product(
                            simd,
                            &mut sums,
                            head(&x[q][at..]),
                            &y[p][with..with + ROW],
                        );
                    }
                }
                let mut row = [0.0; 2 * ROW + 4];
                fold(&sums, &mut row);
                let at = (k * 2 * n1 + j) * 2 * ROW;
                products.cross[c][at..at + 2 * ROW].copy_from_slice(&row[..2 * ROW]);
            }
        }
    }
}

/// The scalar product of the cross product with the third column.
#[inline(always)]
fn multiply_space<S: Simd, const D: usize, const N: usize, const R: usize>(
    simd: S,
    products: &Products<D>,
    out: &mut [f64],
) {
    match N {
        1 => scalar_product::<S, D, 2, R>(simd, products, out),
        2 => scalar_product::<S, D, 4, R>(simd, products, out),
        3 => scalar_product::<S, D, 6, R>(simd, products, out),
        4 => scalar_product::<S, D, 8, R>(simd, products, out),
        _ => scalar_product::<S, D, 10, R>(simd, products, out),
    }
}

/// With rows of `L` values of the cross product.
#[inline(always)]
fn scalar_product<S: Simd, const D: usize, const L: usize, const R: usize>(
    simd: S,
    products: &Products<D>,
    out: &mut [f64],
) {
    let [n1, n2] = [products.degree[1], products.degree[D - 1]];
    let (z, cross, unscale) = (&products.columns[D - 1], &products.cross, &products.unscale);
    let zero = f64x4::splat(simd, 0.0);
    for (number, out) in out.chunks_exact_mut(L / 2 * 3).enumerate() {
        let (j, k) = (number % (3 * n1), number / (3 * n1));
        let mut sums = [[zero; R]; L];
        for k1 in partners(k, 2 * n2 + 1, n2) {
            for j1 in partners(j, 2 * n1, n1 + 1) {
                let at = (k1 * 2 * n1 + j1) * 2 * ROW;
                let with = ((k - k1) * (n1 + 1) + (j - j1)) * ROW;
                for c in 0..D {
                    add_product(
                        simd,
                        &mut sums,
                        head(&cross[c][at..]),
                        &z[c][with..with + ROW],
                    );
                }
            }
        }
        let mut row = [0.0; 2 * ROW + 4];
        fold(&sums, &mut row);
        let scale = unscale[D - 1][k] * unscale[1][j];
        for (i, out) in out.iter_mut().enumerate() {
            *out = row[i] * (scale * unscale[0][i]);
        }
    }
}
