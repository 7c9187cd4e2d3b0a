//! The operations of [`batch`](super), on vectors whose lanes are cells.
//!
//! The last axis is done slice by slice: one slice of the cross product, and its part in
//! the slices of the result, so that everything stays in the first cache.

use fearless_simd::{Level, Simd, SimdBase, SimdFloat, dispatch};

use super::GROUP;
use crate::bspline::{BezierTables, MAX_ORDER, Real, ToBezier};
use crate::injectivity::product::binomial;

/// The constants of the products.
#[derive(Debug)]
pub(super) struct Tables<const D: usize> {
    degree: [usize; D],
    /// `columns[axis]`: column m holds the weights of control value m in the scaled Bézier
    /// values; for splines and for derivatives.
    columns: [[Columns; 2]; D],
    /// One over the binomial coefficients of the result.
    unscale: [[f32; 3 * MAX_ORDER]; D],
}

type Columns = [[f32; MAX_ORDER]; MAX_ORDER];

/// Results in the lanes of a group: first the largest 1-norm of each column, then least and
/// largest coefficient and least corner, or the largest value and the least of each
/// coefficient along the way.
pub(super) type Raw = [[f32; GROUP]; 8];

impl<const D: usize> Tables<D> {
    pub(super) fn new(degree: [usize; D], tables: [&BezierTables; D]) -> Self {
        Self {
            degree,
            columns: std::array::from_fn(|axis| {
                let n = degree[axis];
                let slope = columns(&tables[axis].slope, n - 1);
                [columns(&tables[axis].full, n), slope]
            }),
            unscale: degree.map(|n| unscale(D * n - 1)),
        }
    }

    /// For a group of cells, with control vectors of one place or of D + 1.
    pub(super) fn run(&self, level: Level, control: &[f32], size: usize, out: &mut Raw) {
        if D == 3 && self.degree == [3; D] {
            dispatch!(level, s => run::<_, Cubic, D>(s, self, control, size, out));
        } else {
            dispatch!(level, s => run::<_, Mixed, D>(s, self, control, size, out));
        }
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
pub(super) fn single(value: f64) -> f32 {
    value as f32
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
    out: &mut Raw,
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
        way: Vec::new(),
    };
    let is_way = control.len() > size;
    let mut lane = 0;
    while lane < GROUP {
        let result = if is_way {
            along::<S, S::f32s, G, D>(simd, tables, control, size, lane, &mut work)
        } else {
            at_once::<S, S::f32s, G, D>(simd, tables, control, lane, &mut work)
        };
        for (row, result) in out.iter_mut().zip(result) {
            result.store_slice(&mut row[lane..lane + S::f32s::LEN]);
        }
        lane += S::f32s::LEN;
    }
}

/// The cells in the lanes of one vector, at one place.
#[inline(always)]
fn at_once<S, V, G, const D: usize>(
    simd: S,
    tables: &Tables<D>,
    control: &[f32],
    lane: usize,
    work: &mut Work<V>,
) -> [V; 8]
where
    S: Simd,
    V: SimdFloat<S, Element = f32> + Real<f32>,
    G: Degrees,
{
    let mut result = [V::splat(simd, 0.0); 8];
    let [mut min, mut max] = [f32::INFINITY, f32::NEG_INFINITY].map(|x| V::splat(simd, x));
    let mut low_corner = min;
    let norms = one::<S, V, G, D>(simd, tables, control, lane, work, |_, corner, value| {
        min = min.min(value);
        max = max.max(value);
        if corner {
            low_corner = low_corner.min(value);
        }
    });
    result[..3].copy_from_slice(&norms);
    result[3..6].copy_from_slice(&[min, max, low_corner]);
    result
}

/// The cells in the lanes of one vector, along the way: the coefficients at all places are
/// kept, and those along the way computed from them as in [`super::step`].
#[inline(always)]
fn along<S, V, G, const D: usize>(
    simd: S,
    tables: &Tables<D>,
    control: &[f32],
    size: usize,
    lane: usize,
    work: &mut Work<V>,
) -> [V; 8]
where
    S: Simd,
    V: SimdFloat<S, Element = f32> + Real<f32>,
    G: Degrees,
{
    let zero = V::splat(simd, 0.0);
    let degree = G::get(tables.degree);
    let count: usize = degree.iter().map(|n| D * n).product();
    let mut result = [zero; 8];
    let mut way = std::mem::take(&mut work.way);
    way.resize((D + 1) * count, zero);
    for (node, values) in control.chunks_exact(size).zip(way.chunks_exact_mut(count)) {
        let mut largest = result[3];
        let norms = one::<S, V, G, D>(simd, tables, node, lane, work, |index, _, value| {
            values[index] = value;
            largest = largest.max(value.abs());
        });
        for a in 0..D {
            result[a] = result[a].max(norms[a]);
        }
        result[3] = largest;
    }
    let mut least = [V::splat(simd, f32::INFINITY); 4];
    let slab = |k: usize| &way[k * count..(k + 1) * count];
    if D == 2 {
        for ((&a, &b), &c) in slab(0).iter().zip(slab(1)).zip(slab(2)) {
            least[0] = least[0].min(a);
            least[1] = least[1].min(b * 2.0 - (a + c) * 0.5);
            least[2] = least[2].min(c);
        }
    } else {
        let ends = slab(0).iter().zip(slab(D));
        for ((&a, &d), (&p, &q)) in ends.zip(slab(1).iter().zip(slab(2))) {
            least[0] = least[0].min(a);
            least[1] = least[1].min((p * 18.0 - q * 9.0 + (d * 2.0 - a * 5.0)) * (1.0 / 6.0));
            least[2] = least[2].min((q * 18.0 - p * 9.0 + (a * 2.0 - d * 5.0)) * (1.0 / 6.0));
            least[3] = least[3].min(d);
        }
    }
    result[4..].copy_from_slice(&least);
    work.way = way;
    result
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
    /// The coefficients at all places on the way.
    way: Vec<V>,
}

/// The coefficients of the cells in the lanes of one vector at one place: each with its index
/// and whether it is that of a corner. Returns the largest 1-norm of each column.
#[inline(always)]
fn one<S, V, G, const D: usize>(
    simd: S,
    tables: &Tables<D>,
    group: &[f32],
    lane: usize,
    work: &mut Work<V>,
    each: impl FnMut(usize, bool, V),
) -> [V; 3]
where
    S: Simd,
    V: SimdFloat<S, Element = f32> + Real<f32>,
    G: Degrees,
{
    let degree = G::get(tables.degree);
    let zero = V::splat(simd, 0.0);
    let mut norms = [zero; 3];
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
            norms[a] = norms[a].max(norm);
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
        plane::<S, V, D>(degree, tables, work, zero, each);
    } else {
        space::<S, V, D>(degree, tables, work, zero, each);
    }
    norms
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
    mut each: impl FnMut(usize, bool, V),
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
            let corner = is_end(i, 2 * n0) && is_end(j, 2 * n1);
            each(j * 2 * n0 + i, corner, value);
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
    mut each: impl FnMut(usize, bool, V),
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
        ..
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
                let corner = is_end(i, 3 * n0) && is_end(j, 3 * n1) && is_end(k, 3 * n2);
                each((k * 3 * n1 + j) * 3 * n0 + i, corner, value);
                done[j * 3 * n0 + i] = zero;
            }
        }
    }
}
