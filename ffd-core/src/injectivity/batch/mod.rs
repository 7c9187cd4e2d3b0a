//! The Bernstein form of the determinant for many cells at once, in single precision.
//!
//! The lanes of vectors are cells of the same kind. The operations are those of
//! [`product`](super::product); of the coefficients only the least and the largest are
//! kept. Single precision is twice as fast, and its rounding errors, about a thousandth,
//! leave few cells in doubt: those are for double precision.

mod kernel;

use std::collections::BTreeMap;

use fearless_simd::Level;

use super::partials::Partials;
use super::product::Rounding;
use super::step::{self, Along};
use kernel::{Raw, Tables, single};

/// Cells in a group: the lanes of the widest vector.
pub(super) const GROUP: usize = 16;

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

/// Bounds of the determinant in a cell and on a part of the way to another lattice, which has
/// D + 1 Bernstein coefficients along the way, each a polynomial in space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct WayBounds {
    /// The least coefficient of each.
    pub(super) least: Along,
    /// By how much they may be wrong; infinite if they mean nothing.
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

impl<'a, const D: usize> Kind<'a, D> {
    /// For cells of the kind of the given one.
    pub(super) fn new(level: Level, partials: &'a Partials<D>, cell: usize) -> Self {
        let degree = partials.degree;
        let window = |a| partials.window(a).iter().product::<usize>();
        Self {
            level,
            partials,
            // Control vectors are rounded, and so are weights.
            rounding: Rounding::new(&degree, UNIT, 2.5, 1e36),
            tables: Tables::new(degree, partials.tables(partials.cell(cell))),
            size: (0..D).map(|a| window(a) * D * GROUP).sum(),
        }
    }

    /// Bounds of the determinant in up to [`CHUNK`] cells.
    pub(super) fn bounds(&self, cells: &[usize]) -> [CellBounds; CHUNK] {
        let raw = self.run(&[self.partials], cells);
        std::array::from_fn(|i| {
            let (raw, lane) = (&raw[i / GROUP], i % GROUP);
            CellBounds {
                min: f64::from(raw[3][lane]),
                max: f64::from(raw[4][lane]),
                low_corner: f64::from(raw[5][lane]),
                error: self.rounding.bound(self.partials, norms(raw, lane)),
            }
        })
    }

    /// Bounds in up to [`CHUNK`] cells on the part of the way that control vectors at D + 1
    /// places divide evenly. Entries of those vectors err by the given amounts, one for each
    /// cell and column.
    ///
    /// Rounding is that of [`error_of_way`](step::error_of_way) in single precision.
    pub(super) fn bounds_along(
        &self,
        nodes: &[&Partials<D>],
        cells: &[usize],
        errors: &[[f64; D]],
    ) -> [WayBounds; CHUNK] {
        let raw = self.run(nodes, cells);
        std::array::from_fn(|i| {
            let (raw, lane) = (&raw[i / GROUP], i % GROUP);
            let Some(&errors) = errors.get(i) else {
                return WayBounds {
                    least: [0.0; 4],
                    error: f64::INFINITY,
                };
            };
            let error = self.rounding.bound_with(norms(raw, lane), errors);
            let largest = f64::from(raw[3][lane]);
            WayBounds {
                least: std::array::from_fn(|k| f64::from(raw[4 + k][lane])),
                error: step::error_of_way(error, largest, UNIT),
            }
        })
    }

    /// At one place, or at D + 1 places of a way.
    fn run(&self, nodes: &[&Partials<D>], cells: &[usize]) -> [Raw; CHUNK / GROUP] {
        let mut control = Vec::with_capacity(nodes.len() * GROUP * self.size);
        let mut raw = [[[0.0; GROUP]; 8]; CHUNK / GROUP];
        for (group, raw) in cells.chunks(GROUP).zip(&mut raw) {
            control.clear();
            for node in nodes {
                gather(node, group, &mut control);
            }
            self.tables.run(self.level, &control, self.size, raw);
        }
        raw
    }
}

/// Lists of cells of the same kind; in a uniform grid there is one.
pub(super) fn by_kind<const D: usize>(partials: &Partials<D>, cells: &[usize]) -> Vec<Vec<usize>> {
    let mut kinds: BTreeMap<[usize; D], Vec<usize>> = BTreeMap::new();
    for &cell in cells {
        let kind = partials.kind(partials.cell(cell));
        kinds.entry(kind).or_default().push(cell);
    }
    kinds.into_values().collect()
}

/// The largest 1-norms of columns: sums of two or three numbers in single precision.
fn norms<const D: usize>(raw: &Raw, lane: usize) -> [f64; D] {
    std::array::from_fn(|a| f64::from(raw[a][lane]) * (1.0 + 4.0 * UNIT))
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

/// Appends the control vectors of a group of cells.
fn gather<const D: usize>(partials: &Partials<D>, group: &[usize], control: &mut Vec<f32>) {
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
