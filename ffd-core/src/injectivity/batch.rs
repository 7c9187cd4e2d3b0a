//! The Bernstein form of the determinant for many cells at once, in single precision.
//!
//! The lanes of vectors are cells of the same kind. The operations are those of
//! [`product`](super::product); of the coefficients only the least and the largest are
//! kept. Single precision is twice as fast, and its rounding errors, about a thousandth,
//! leave few cells in doubt: those are for double precision.
//!
//! The last axis is done slice by slice: one slice of the cross product, and its part in
//! the slices of the result, so that everything stays in the first cache.

use fearless_simd::{Level, Simd, SimdBase, SimdFloat, dispatch};

use super::partials::Partials;
use super::product::{Rounding, binomial};
use crate::bspline::{MAX_ORDER, Real, ToBezier};

/// Cells in a group: the lanes of the widest vector.
const GROUP: usize = 16;

/// Cells that are done together, so that what is gathered for them is still in the cache.
pub(super) const CHUNK: usize = 4 * GROUP;

/// A relative error that an `f32` made from an `f64` can have, and a sum of `f32`.
const UNIT: f64 = f32::EPSILON as f64 / 2.0;

/// Bounds of the determinant in a cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CellBounds {
    pub(super) min: f64,
    pub(super) max: f64,
    /// The least value at a corner.
    pub(super) low_corner: f64,
    /// By how much all three may be wrong; infinite if they mean nothing.
    pub(super) error: f64,
}

/// What cells of one kind have in common.
#[derive(Debug)]
pub(super) struct Kind<'a, const D: usize> {
    level: Level,
    partials: &'a Partials<D>,
    rounding: Rounding,
    tables: Tables<D>,
    /// Numbers in a group.
    size: usize,
}

/// The constants of the products.
#[derive(Debug)]
struct Tables<const D: usize> {
    degree: [usize; D],
    /// `columns[axis]`: column m holds the weights of control value m in the scaled Bézier
    /// values; for splines and for derivatives.
    columns: [[Columns; 2]; D],
    /// One over the binomial coefficients of the result.
    unscale: [[f32; 3 * MAX_ORDER]; D],
}

type Columns = [[f32; MAX_ORDER]; MAX_ORDER];

/// Least and largest coefficient, least corner, and the largest 1-norm of each column, in the
/// lanes of a group.
type Raw = [[f32; GROUP]; 6];

impl<'a, const D: usize> Kind<'a, D> {
    /// For cells of the kind of the given one.
    pub(super) fn new(level: Level, partials: &'a Partials<D>, cell: usize) -> Self {
        let degree = partials.degree;
        let tables = partials.tables(partials.cell(cell));
        let window = |a| partials.window(a).iter().product::<usize>();
        Self {
            level,
            partials,
            // Control vectors are rounded, and so are weights.
            rounding: Rounding::new(&degree, UNIT, 2.5, 1e36),
            tables: Tables {
                degree,
                columns: std::array::from_fn(|axis| {
                    let n = degree[axis];
                    let slope = columns(&tables[axis].slope, n - 1);
                    [columns(&tables[axis].full, n), slope]
                }),
                unscale: degree.map(|n| unscale(D * n - 1)),
            },
            size: (0..D).map(|a| window(a) * D * GROUP).sum(),
        }
    }

    /// Bounds of the determinant in up to [`CHUNK`] cells.
    pub(super) fn bounds(&self, cells: &[usize]) -> [CellBounds; CHUNK] {
        let mut control = Vec::with_capacity(cells.len().div_ceil(GROUP) * self.size);
        gather(self.partials, cells, &mut control);
        let mut raw = [[[0.0; GROUP]; 6]; CHUNK / GROUP];
        let (tables, size) = (&self.tables, self.size);
        if D == 3 && tables.degree == [3; D] {
            dispatch!(self.level, s => run::<_, Cubic, D>(s, tables, &control, size, &mut raw));
        } else {
            dispatch!(self.level, s => run::<_, Mixed, D>(s, tables, &control, size, &mut raw));
        }
        std::array::from_fn(|i| {
            let (raw, lane) = (&raw[i / GROUP], i % GROUP);
            // Sums of two or three numbers in single precision.
            let norm = |a: usize| f64::from(raw[3 + a][lane]) * (1.0 + 4.0 * UNIT);
            CellBounds {
                min: f64::from(raw[0][lane]),
                max: f64::from(raw[1][lane]),
                low_corner: f64::from(raw[2][lane]),
                error: self
                    .rounding
                    .bound(self.partials, std::array::from_fn(norm)),
            }
        })
    }
}

fn columns(rows: &ToBezier, degree: usize) -> Columns {
    let mut columns = [[0.0; MAX_ORDER]; MAX_ORDER];
    for i in 0..=degree {
        for m in 0..=degree {
            columns[m][i] = single(binomial(degree, i) * rows[i][m]);
        }
    }
    columns
}

fn unscale(degree: usize) -> [f32; 3 * MAX_ORDER] {
    let mut row = [0.0; 3 * MAX_ORDER];
    for (i, entry) in row[..=degree].iter_mut().enumerate() {
        *entry = single(1.0 / binomial(degree, i));
    }
    row
}

#[expect(clippy::cast_possible_truncation, reason = "rounding is accounted for")]
#[inline(always)]
fn single(value: f64) -> f32 {
    value as f32
}

/// What is not a number becomes infinite, which no maximum loses.
#[inline(always)]
fn single_or_infinite(value: f64) -> f32 {
    if value.abs() < 1e30 {
        single(value)
    } else {
        f32::INFINITY
    }
}

/// Copies the control vectors of cells into groups.
fn gather<const D: usize>(partials: &Partials<D>, cells: &[usize], control: &mut Vec<f32>) {
    control.clear();
    for group in cells.chunks(GROUP) {
        let mut starts = [0; GROUP];
        for (lane, start) in starts.iter_mut().enumerate() {
            // The last group is filled up with its last cell.
            let cell = group[lane.min(group.len() - 1)];
            *start = partials.index(partials.cell(cell));
        }
        let in_a_row = starts.windows(2).all(|pair| pair[1] == pair[0] + 1);
        for a in 0..D {
            let window = partials.window(a);
            let planes = if D == 3 { window[D - 1] } else { 1 };
            for c in 0..D {
                let values = &partials.vectors[a][c];
                for row in 0..planes * window[1] {
                    let (j, k) = (row % window[1], row / window[1]);
                    let plane = if D == 3 {
                        k * partials.stride[D - 1]
                    } else {
                        0
                    };
                    let offset = j * partials.stride[1] + plane;
                    for i in offset..offset + window[0] {
                        let mut lanes = [0.0; GROUP];
                        if in_a_row {
                            let from = &values[starts[0] + i..][..GROUP];
                            for (lane, &value) in lanes.iter_mut().zip(from) {
                                *lane = single_or_infinite(value);
                            }
                        } else {
                            for (lane, start) in lanes.iter_mut().zip(starts) {
                                *lane = single_or_infinite(values[start + i]);
                            }
                        }
                        control.extend_from_slice(&lanes);
                    }
                }
            }
        }
    }
}

/// Degrees, known when compiled or not.
trait Degrees {
    fn get<const D: usize>(given: [usize; D]) -> [usize; D];
}

struct Cubic;

impl Degrees for Cubic {
    #[inline(always)]
    fn get<const D: usize>(_: [usize; D]) -> [usize; D] {
        [3; D]
    }
}

struct Mixed;

impl Degrees for Mixed {
    #[inline(always)]
    fn get<const D: usize>(given: [usize; D]) -> [usize; D] {
        given
    }
}

#[inline(always)]
fn run<S: Simd, G: Degrees, const D: usize>(
    simd: S,
    tables: &Tables<D>,
    control: &[f32],
    size: usize,
    out: &mut [Raw],
) {
    let zero = S::f32s::splat(simd, 0.0);
    let degree = G::get(tables.degree);
    let columns: usize = (0..D)
        .map(|a| window(degree, a).iter().product::<usize>() * D)
        .sum();
    let mut work = Work {
        columns: vec![zero; columns],
        cross: vec![
            zero;
            if D == 3 {
                4 * degree[0] * degree[1] * D
            } else {
                0
            }
        ],
        slices: vec![zero; 3 * degree[0] * 3 * degree[1] * degree[D - 1]],
    };
    for (group, out) in control.chunks_exact(size).zip(out) {
        let mut lane = 0;
        while lane < GROUP {
            let result = one::<S, S::f32s, G, D>(simd, tables, group, lane, &mut work);
            for (row, result) in out.iter_mut().zip(result) {
                result.store_slice(&mut row[lane..lane + S::f32s::LEN]);
            }
            lane += S::f32s::LEN;
        }
    }
}

#[inline(always)]
fn window<const D: usize>(degree: [usize; D], a: usize) -> [usize; D] {
    let mut window = degree;
    for axis in 0..D {
        if axis != a {
            window[axis] += 1;
        }
    }
    window
}

/// Room for the polynomials of a few cells.
struct Work<V> {
    columns: Vec<V>,
    cross: Vec<V>,
    slices: Vec<V>,
}

/// Bounds for the cells in the lanes of one vector.
#[inline(always)]
fn one<S, V, G, const D: usize>(
    simd: S,
    tables: &Tables<D>,
    group: &[f32],
    lane: usize,
    work: &mut Work<V>,
) -> [V; 6]
where
    S: Simd,
    V: SimdFloat<S, Element = f32> + Real<f32>,
    G: Degrees,
{
    let degree = G::get(tables.degree);
    let zero = V::splat(simd, 0.0);
    let mut result = [zero; 6];
    result[0] = V::splat(simd, f32::INFINITY);
    result[1] = V::splat(simd, f32::NEG_INFINITY);
    result[2] = result[0];
    let mut start = 0;
    for a in 0..D {
        let window = window(degree, a);
        let count: usize = window.iter().product();
        for i in 0..count * D {
            let at = (start + i) * GROUP + lane;
            work.columns[start + i] = V::from_slice(simd, &group[at..at + V::LEN]);
        }
        let column = &mut work.columns[start..start + count * D];
        for i in 0..count {
            let mut norm = column[i].abs();
            for c in 1..D {
                norm += column[c * count + i].abs();
            }
            result[3 + a] = result[3 + a].max(norm);
        }
        for c in 0..D {
            for axis in 0..D {
                let table = &tables.columns[axis][usize::from(axis == a)];
                convert(
                    &mut column[c * count..(c + 1) * count],
                    window,
                    axis,
                    table,
                    zero,
                );
            }
        }
        start += count * D;
    }
    if D == 2 {
        plane::<S, V, D>(degree, tables, work, zero, &mut result);
    } else {
        space::<S, V, D>(degree, tables, work, zero, &mut result);
    }
    result
}

/// Replaces the control values along an axis by scaled Bézier values.
#[inline(always)]
fn convert<V: Real<f32>, const D: usize>(
    values: &mut [V],
    window: [usize; D],
    axis: usize,
    table: &Columns,
    zero: V,
) {
    let count = window[axis];
    let mut stride = 1;
    for before in 0..axis {
        stride *= window[before];
    }
    let mut slab = 0;
    while slab < values.len() {
        for offset in slab..slab + stride {
            let mut line = [zero; MAX_ORDER];
            for m in 0..count {
                line[m] = values[offset + m * stride];
            }
            for i in 0..count {
                let mut sum = line[0] * table[0][i];
                for m in 1..count {
                    sum = sum + line[m] * table[m][i];
                }
                values[offset + i * stride] = sum;
            }
        }
        slab += stride * count;
    }
}

/// Adds the product of two rows.
#[inline(always)]
fn add_product<V: Real<f32>>(sum: &mut [V], a: &[V], b: &[V]) {
    for i in 0..a.len() {
        for j in 0..b.len() {
            sum[i + j] = sum[i + j] + a[i] * b[j];
        }
    }
}

#[inline(always)]
fn subtract_product<V: Real<f32>>(sum: &mut [V], a: &[V], b: &[V]) {
    for i in 0..a.len() {
        for j in 0..b.len() {
            sum[i + j] = sum[i + j] - a[i] * b[j];
        }
    }
}

/// Whether an index is the first or the last.
#[inline(always)]
fn is_end(index: usize, count: usize) -> bool {
    index == 0 || index + 1 == count
}

/// The determinant in the plane.
#[inline(always)]
fn plane<S: Simd, V: SimdFloat<S, Element = f32> + Real<f32>, const D: usize>(
    degree: [usize; D],
    tables: &Tables<D>,
    work: &mut Work<V>,
    zero: V,
    result: &mut [V; 6],
) {
    let (n0, n1) = (degree[0], degree[1]);
    let count = [n0 * (n1 + 1), (n0 + 1) * n1];
    let (x, y) = work.columns.split_at(2 * count[0]);
    for j in 0..2 * n1 {
        let mut sum = [zero; 2 * MAX_ORDER];
        for j1 in 0..=n1 {
            let Some(j2) = j.checked_sub(j1).filter(|&j2| j2 < n1) else {
                continue;
            };
            let (at, with) = (j1 * n0, j2 * (n0 + 1));
            let row_x = |c: usize| &x[c * count[0] + at..][..n0];
            let row_y = |c: usize| &y[c * count[1] + with..][..n0 + 1];
            add_product(&mut sum, row_x(0), row_y(1));
            subtract_product(&mut sum, row_x(1), row_y(0));
        }
        for i in 0..2 * n0 {
            let value = sum[i] * (tables.unscale[1][j] * tables.unscale[0][i]);
            result[0] = result[0].min(value);
            result[1] = result[1].max(value);
            if is_end(i, 2 * n0) && is_end(j, 2 * n1) {
                result[2] = result[2].min(value);
            }
        }
    }
}

/// The determinant in space, slice by slice along the last axis.
#[inline(always)]
fn space<S: Simd, V: SimdFloat<S, Element = f32> + Real<f32>, const D: usize>(
    degree: [usize; D],
    tables: &Tables<D>,
    work: &mut Work<V>,
    zero: V,
    result: &mut [V; 6],
) {
    let (n0, n1, n2) = (degree[0], degree[1], degree[D - 1]);
    let count = [
        n0 * (n1 + 1) * (n2 + 1),
        (n0 + 1) * n1 * (n2 + 1),
        (n0 + 1) * (n1 + 1) * n2,
    ];
    let Work {
        columns,
        cross,
        slices,
    } = work;
    let (x, rest) = columns.split_at(3 * count[0]);
    let (y, z) = rest.split_at(3 * count[1]);
    let slice = 3 * n0 * 3 * n1;
    // Slice k of the result is the sum of products of slices k − k3 of the cross product
    // with slices k3 of the third column: n2 of them are under way.
    slices.fill(zero);
    for k in 0..3 * n2 {
        if k <= 2 * n2 {
            for j in 0..2 * n1 {
                for c in 0..3 {
                    let (p, q) = ((c + 1) % 3, (c + 2) % 3);
                    let mut sum = [zero; 2 * MAX_ORDER];
                    for k1 in 0..=n2 {
                        let Some(k2) = k.checked_sub(k1).filter(|&k2| k2 <= n2) else {
                            continue;
                        };
                        for j1 in 0..=n1 {
                            let Some(j2) = j.checked_sub(j1).filter(|&j2| j2 < n1) else {
                                continue;
                            };
                            let at = (k1 * (n1 + 1) + j1) * n0;
                            let with = (k2 * n1 + j2) * (n0 + 1);
                            let row_x = |c: usize| &x[c * count[0] + at..][..n0];
                            let row_y = |c: usize| &y[c * count[1] + with..][..n0 + 1];
                            add_product(&mut sum, row_x(p), row_y(q));
                            subtract_product(&mut sum, row_x(q), row_y(p));
                        }
                    }
                    cross[(c * 2 * n1 + j) * 2 * n0..][..2 * n0].copy_from_slice(&sum[..2 * n0]);
                }
            }
            for k3 in 0..n2 {
                let out = &mut slices[(k + k3) % n2 * slice..][..slice];
                for j in 0..3 * n1 {
                    let mut sum = [zero; 3 * MAX_ORDER];
                    let out = &mut out[j * 3 * n0..][..3 * n0];
                    sum[..3 * n0].copy_from_slice(out);
                    for j1 in 0..2 * n1 {
                        let Some(j3) = j.checked_sub(j1).filter(|&j3| j3 <= n1) else {
                            continue;
                        };
                        let with = (k3 * (n1 + 1) + j3) * (n0 + 1);
                        for c in 0..3 {
                            let row = &cross[(c * 2 * n1 + j1) * 2 * n0..][..2 * n0];
                            let column = &z[c * count[2] + with..][..n0 + 1];
                            add_product(&mut sum, row, column);
                        }
                    }
                    out.copy_from_slice(&sum[..3 * n0]);
                }
            }
        }
        // Slice k is complete.
        let done = &mut slices[k % n2 * slice..][..slice];
        for j in 0..3 * n1 {
            let scale = tables.unscale[D - 1][k] * tables.unscale[1][j];
            for i in 0..3 * n0 {
                let value = done[j * 3 * n0 + i] * (scale * tables.unscale[0][i]);
                result[0] = result[0].min(value);
                result[1] = result[1].max(value);
                if is_end(i, 3 * n0) && is_end(j, 3 * n1) && is_end(k, 3 * n2) {
                    result[2] = result[2].min(value);
                }
                done[j * 3 * n0 + i] = zero;
            }
        }
    }
}
