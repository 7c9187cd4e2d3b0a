//! Is the map one-to-one on a small box of the domain?
//!
//! It is if all means of its Jacobians along segments in the box are regular; see
//! [`boundary`](super::boundary), *Method*, for the criterion `|C J − I| ≤ Δ`, entry by
//! entry, with the spectral radius of Δ below one. The derivatives are differences of the
//! Bézier points of the parts of the box in each cell.
//!
//! # Rounding
//!
//! An entry of C times a Bézier point is wrong by at most the row sum of |C| times the
//! error of the point and D + 1 roundings of the largest point. A derivative is the
//! difference of two, times the degree over the size of the part, an exact number but for
//! one rounding.

use super::partials::UNIT;
use super::positions::Positions;
use crate::matrix::{Matrix, cofactors, determinant};

/// The most cells in a box on which the map is tested for being one-to-one.
const MOST_CELLS: usize = 16;

/// Calls `found` with all neighbours along an axis of the given stride and count.
#[inline(always)]
pub(super) fn for_differences<const D: usize>(
    points: &[[f64; D]],
    stride: usize,
    count: usize,
    mut found: impl FnMut(&[f64; D], &[f64; D]),
) {
    for slab in points.chunks_exact(stride * count) {
        for at in 0..stride * (count - 1) {
            found(&slab[at], &slab[at + stride]);
        }
    }
}

/// The axes along which a box is not flat.
#[derive(Debug, Clone, Copy)]
pub(super) struct Axes<const D: usize> {
    list: [usize; D],
    pub(super) count: usize,
}

impl<const D: usize> Axes<D> {
    pub(super) fn of(part: &[[f64; 2]; D]) -> Self {
        let mut axes = Self {
            list: [0; D],
            count: 0,
        };
        for a in 0..D {
            if part[a][0] < part[a][1] {
                axes.list[axes.count] = a;
                axes.count += 1;
            }
        }
        axes
    }

    pub(super) fn list(&self) -> &[usize] {
        &self.list[..self.count]
    }
}

/// A left inverse of the matrix with the given columns, the first `count` of the list;
/// approximate, and its first `count` rows. `None` if there is none.
pub(super) fn left_inverse<const D: usize>(
    columns: &[[f64; D]; D],
    count: usize,
) -> Option<Matrix<D>> {
    let dot = |a: &[f64; D], b: &[f64; D]| (0..D).map(|c| a[c] * b[c]).sum::<f64>();
    let mut inverse = [[0.0; D]; D];
    if count == D {
        // The transpose has the columns as rows.
        let scale = 1.0 / determinant(columns);
        let cofactors = cofactors(columns);
        for r in 0..D {
            inverse[r] = cofactors[r].map(|x| x * scale);
        }
    } else if count == 1 {
        let scale = 1.0 / dot(&columns[0], &columns[0]);
        inverse[0] = columns[0].map(|x| x * scale);
    } else {
        let [v, w] = [&columns[0], &columns[1]];
        let (vv, vw, ww) = (dot(v, v), dot(v, w), dot(w, w));
        let scale = 1.0 / (vv * ww - vw * vw);
        for c in 0..D {
            inverse[0][c] = (ww * v[c] - vw * w[c]) * scale;
            inverse[1][c] = (vv * w[c] - vw * v[c]) * scale;
        }
    }
    let finite = inverse.iter().flatten().all(|x| x.abs() < 1e100);
    finite.then_some(inverse)
}

/// Whether a matrix of the given size with entries that are not negative has a spectral
/// radius below one: then, and only then, are the leading principal minors of `I − Δ`
/// positive. Entries are at most 4: a minor then has six products of numbers up to 5, with
/// five roundings each, and is wrong by less than 1e-12.
pub(super) fn is_contraction<const D: usize>(deviation: &[[f64; D]; D], size: usize) -> bool {
    let at = |r: usize, c: usize| {
        let unit = if r == c { 1.0 } else { 0.0 };
        unit - deviation[r][c]
    };
    for row in &deviation[..size] {
        for &x in &row[..size] {
            if x.is_nan() || x > 4.0 {
                return false;
            }
        }
    }
    if size == 0 || at(0, 0) <= 1e-12 {
        return size == 0;
    }
    if size == 1 {
        return true;
    }
    if at(0, 0) * at(1, 1) - at(0, 1) * at(1, 0) <= 1e-12 {
        return false;
    }
    if size == 2 {
        return true;
    }
    let minor = |p: usize, q: usize| at(1, p) * at(2, q) - at(1, q) * at(2, p);
    at(0, 0) * minor(1, 2) + at(0, 1) * minor(2, 0) + at(0, 2) * minor(0, 1) > 1e-12
}

/// Tests boxes of the domain; buffers are kept for the next one.
#[derive(Debug, Default)]
pub(super) struct Boxes<const D: usize> {
    points: Vec<[f64; D]>,
    /// The parts of a box in each cell: size along each axis, and where their points begin.
    parts: Vec<([f64; D], usize)>,
}

impl<const D: usize> Boxes<D> {
    /// Whether the map is proven to be one-to-one on a box of the domain, given in lattice
    /// coordinates. See the [module](self).
    pub(super) fn is_one_to_one(
        &mut self,
        positions: &mut Positions<'_, D>,
        around: &[[f64; 2]; D],
    ) -> bool {
        let axes = Axes::of(around);
        if !self.collect(positions, around) {
            return false;
        }
        let counts = positions.counts(around);
        let Some(after) = left_inverse(&self.mean_columns(&axes, counts), axes.count) else {
            return false;
        };
        let deviation = self.deviation(positions, &axes, counts, &after);
        deviation.is_some_and(|d| is_contraction(&d, axes.count))
    }

    /// Bézier points of all parts of a box, unless it meets too many cells.
    fn collect(&mut self, positions: &mut Positions<'_, D>, around: &[[f64; 2]; D]) -> bool {
        let (first, _) = positions.locate(around.map(|[low, _]| low));
        let (last, in_last) = positions.locate(around.map(|[_, high]| high));
        let count: [usize; D] = std::array::from_fn(|a| {
            // A box that ends at a knot does not meet the next cell.
            let ends_before = in_last[a] <= 0.0 && last[a] > first[a];
            last[a] - first[a] + usize::from(!ends_before)
        });
        if count.iter().product::<usize>() > MOST_CELLS {
            return false;
        }
        self.points.clear();
        self.parts.clear();
        for number in 0..count.iter().product() {
            let mut rest: usize = number;
            let cell: [usize; D] = std::array::from_fn(|a| {
                let index = first[a] + rest % count[a];
                rest /= count[a];
                index
            });
            let part: [[f64; 2]; D] =
                std::array::from_fn(|a| around[a].map(|u| (u - cell[a] as f64).clamp(0.0, 1.0)));
            self.parts
                .push((part.map(|[a, b]| b - a), self.points.len()));
            positions.bezier(cell, &part, &mut self.points);
        }
        true
    }

    /// The means of the derivatives along the axes.
    fn mean_columns(&self, axes: &Axes<D>, counts: [usize; D]) -> [[f64; D]; D] {
        let len: usize = counts.iter().product();
        let mut columns = [[0.0; D]; D];
        for (size, at) in &self.parts {
            let points = &self.points[*at..at + len];
            for (k, &a) in axes.list().iter().enumerate() {
                let stride: usize = counts[..a].iter().product();
                let lines = len / counts[a];
                let scale = 1.0 / (size[a] * (lines * self.parts.len()) as f64);
                for slab in points.chunks_exact(stride * counts[a]) {
                    for (first, last) in slab.iter().zip(&slab[stride * (counts[a] - 1)..]) {
                        for c in 0..D {
                            columns[k][c] += scale * (last[c] - first[c]);
                        }
                    }
                }
            }
        }
        columns
    }

    /// Bounds of `|C J − I|` over the box, entry by entry; `None` as soon as they are too
    /// large.
    fn deviation(
        &mut self,
        positions: &Positions<'_, D>,
        axes: &Axes<D>,
        counts: [usize; D],
        after: &Matrix<D>,
    ) -> Option<[[f64; D]; D]> {
        let len: usize = counts.iter().product();
        let mut deviation = [[0.0_f64; D]; D];
        for (size, at) in &self.parts {
            let points = &mut self.points[*at..at + len];
            for point in points.iter_mut() {
                *point = crate::matrix::multiply(after, *point);
            }
            for (k, &a) in axes.list().iter().enumerate() {
                let stride: usize = counts[..a].iter().product();
                let scale = (counts[a] - 1) as f64 / size[a];
                let mut range = [[f64::INFINITY, f64::NEG_INFINITY]; D];
                for_differences(points, stride, counts[a], |from, to| {
                    for r in 0..D {
                        let x = to[r] - from[r];
                        let [low, high] = range[r];
                        range[r] = [
                            if x < low { x } else { low },
                            if x > high { x } else { high },
                        ];
                    }
                });
                for r in 0..axes.count {
                    let unit = if r == k { 1.0 } else { 0.0 };
                    let row: f64 = after[r].iter().map(|x| x.abs()).sum();
                    let rounding = UNIT * (D + 2) as f64 * positions.largest;
                    let error = 2.02 * row * (positions.error + rounding) * scale;
                    let [low, high] = range[r];
                    let x = (scale * low - unit).abs().max((scale * high - unit).abs());
                    // `max` would lose a NaN.
                    let x = if x.is_nan() { f64::INFINITY } else { x };
                    deviation[r][k] = deviation[r][k].max(x + error + 16.0 * UNIT * (x + 1.0));
                }
            }
            if !is_contraction(&deviation, axes.count) {
                return None;
            }
        }
        Some(deviation)
    }

    /// Bounds of `|C J − I|` over a part of one cell.
    pub(super) fn deviation_in_cell(
        &mut self,
        positions: &mut Positions<'_, D>,
        cell: [usize; D],
        part: &[[f64; 2]; D],
        after: &Matrix<D>,
    ) -> Option<[[f64; D]; D]> {
        self.points.clear();
        self.parts.clear();
        self.parts.push((part.map(|[a, b]| b - a), 0));
        positions.bezier(cell, part, &mut self.points);
        let counts = positions.counts(part);
        self.deviation(positions, &Axes::of(part), counts, after)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn contractions_are_told_from_others() {
        assert!(is_contraction(&[[0.9, 0.0], [3.0, 0.9]], 2));
        assert!(!is_contraction(&[[0.5, 0.5], [0.5, 0.5]], 2));
        assert!(is_contraction(&[[0.3; 3]; 3], 3));
        assert!(!is_contraction(&[[0.34; 3]; 3], 3));
        assert!(!is_contraction(&[[f64::NAN; 2]; 2], 1));
        assert!(!is_contraction(&[[1.5, 0.0], [0.0, 1.5]], 2));
    }
}
