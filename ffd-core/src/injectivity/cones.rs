//! The conic-hull test of \[GD01\] (section 7 and appendix) for all cells at once.
//!
//! Around each axis a of the lattice lies a cone that holds all control vectors of column
//! a of the Jacobian, with half the opening θₐ. If the determinant of three vectors, one
//! from each cone, is zero, then a unit vector n is perpendicular to all of them, so
//! |nₐ| ≤ sin θₐ for each component, and `1 = Σ nₐ² ≤ Σ sin² θₐ`. The test of the paper,
//! with its arcs and sines, therefore comes down to
//!
//! ```text
//! Σₐ sin² θₐ < 1,    sin² θ = (b² + c²) / (a² + b² + c²)  for the vector (a, b, c), a > 0.
//! ```
//!
//! Where this holds, principal minors are positive too, and the Jacobian is a P-matrix.
//!
//! What rounding may have done to a vector is added to b and c and taken from a; the sum
//! itself must stay below one by more than its roundings.

use fearless_simd::{Level, Simd, dispatch};

use super::partials::{Partials, Plain};

/// Below this, a sum of sines is less than one in spite of roundings: a dozen in each.
const ALMOST_ONE: f64 = 1.0 - 1e-14;

/// The test of all cells. Buffers are kept for the next time.
#[derive(Debug, Clone)]
pub(super) struct Cones<const D: usize> {
    level: Level,
    /// `sin² θ` of each control vector for each axis; then the largest in each window.
    sines: [Vec<f64>; D],
    spare: Vec<f64>,
    /// The same for a few cells.
    small: [Vec<f64>; D],
    spare_small: Vec<f64>,
}

impl<const D: usize> Cones<D> {
    pub(super) fn new(partials: &Partials<D>) -> Self {
        let total = partials.counts.iter().product();
        Self {
            level: Level::new(),
            sines: std::array::from_fn(|_| vec![0.0; total]),
            spare: vec![0.0; total],
            small: std::array::from_fn(|_| Vec::new()),
            spare_small: Vec::new(),
        }
    }

    /// Calls `decided` with the number of each cell and whether it passes.
    pub(super) fn test(&mut self, partials: &Partials<D>, mut decided: impl FnMut(usize, bool)) {
        if !partials.is_sound() {
            for number in 0..partials.cell_count() {
                decided(number, false);
            }
            return;
        }
        let level = self.level;
        let unit = partials.error(0.0);
        for a in 0..D {
            let (out, spare) = (&mut self.sines[a], &mut self.spare);
            if let Some(plain) = partials.plain(a) {
                dispatch!(level, s => sines_of_differences(s, plain, a, unit, out));
            } else {
                let vectors = &partials.vectors[a];
                dispatch!(level, s => sines(s, vectors, a, unit, out));
            }
            let window = partials.window(a);
            for axis in 0..D {
                let stride = partials.stride[axis];
                dispatch!(level, s => sliding_maximum(s, out, stride, window[axis], spare));
            }
        }
        let mut number = 0;
        let cells = partials.cells;
        let planes = if D == 3 { cells[D - 1] } else { 1 };
        for row in 0..cells[1] * planes {
            let (j, k) = (row % cells[1], row / cells[1]);
            let plane = if D == 3 {
                k * partials.stride[D - 1]
            } else {
                0
            };
            let at = j * partials.stride[1] + plane;
            for i in at..at + cells[0] {
                let sum: f64 = self.sines.iter().map(|sines| sines[i]).sum();
                decided(number, sum < ALMOST_ONE);
                number += 1;
            }
        }
    }

    /// The same for the cells on which a control point of the domain acts.
    pub(super) fn test_around(
        &mut self,
        partials: &Partials<D>,
        control_point: [usize; D],
        mut decided: impl FnMut(usize, bool),
    ) {
        let cells: [[usize; 2]; D] =
            std::array::from_fn(|axis| partials.around(axis, control_point));
        // All control points that act on these cells, as a lattice of their own.
        let counts: [usize; D] =
            std::array::from_fn(|axis| cells[axis][1] - cells[axis][0] + partials.degree[axis]);
        let mut stride = [1; D];
        for axis in 1..D {
            stride[axis] = stride[axis - 1] * counts[axis - 1];
        }
        let total = counts.iter().product::<usize>();
        let start = partials.index(cells.map(|[from, _]| from));
        let unit = partials.error(0.0);
        for a in 0..D {
            self.small[a].resize(total, 0.0);
            self.spare_small.resize(total, 0.0);
            for (row, out) in self.small[a].chunks_exact_mut(counts[0]).enumerate() {
                let (j, k) = (row % counts[1], row / counts[1]);
                let plane = if D == 3 {
                    k * partials.stride[D - 1]
                } else {
                    0
                };
                let at = start + j * partials.stride[1] + plane;
                let component = |c: usize| &partials.vectors[a][(a + c) % D][at..at + counts[0]];
                let (x, y, z) = (component(0), component(1), component(2));
                for (i, out) in out.iter_mut().enumerate() {
                    *out = sine::<D>(x[i], y[i], z[i], unit);
                }
            }
            let window = partials.window(a);
            for axis in 0..D {
                let (values, spare) = (&mut self.small[a], &mut self.spare_small);
                let level = self.level;
                let (stride, window) = (stride[axis], window[axis]);
                dispatch!(level, s => sliding_maximum(s, values, stride, window, spare));
            }
        }
        let sound = partials.is_sound();
        partials.for_cells_around(control_point, |cell| {
            let at = partials.cell(cell);
            let local = (0..D).map(|axis| (at[axis] - cells[axis][0]) * stride[axis]);
            let local: usize = local.sum();
            let sum: f64 = self.small.iter().map(|sines| sines[local]).sum();
            decided(cell, sound && sum < ALMOST_ONE);
        });
    }
}

/// An upper bound of `sin² θ` for the vector with the component `x` along the axis of the
/// cone; 2 if it may not point along that axis. In 2-D, z is not used. Components err by at
/// most `unit` for a vector of length 0, and in proportion to its 1-norm plus one.
#[inline(always)]
pub(super) fn sine<const D: usize>(x: f64, y: f64, z: f64, unit: f64) -> f64 {
    let norm = x.abs() + y.abs() + if D == 2 { 0.0 } else { z.abs() };
    sine_within::<D>(x, y, z, unit * (1.0 + norm))
}

/// The same, for components that err by at most `error`.
#[inline(always)]
pub(super) fn sine_within<const D: usize>(x: f64, y: f64, z: f64, error: f64) -> f64 {
    let along = x - error;
    let (b, c) = (y.abs() + error, z.abs() + error);
    let across = b * b + if D == 2 { 0.0 } else { c * c };
    let sine = across / (across + along * along);
    // Also where it is not a number.
    let sound = (along > 0.0) & (sine <= 1.0);
    if sound { sine } else { 2.0 }
}

#[inline(always)]
fn sines<S: Simd, const D: usize>(
    _: S,
    vectors: &[Vec<f64>; D],
    a: usize,
    unit: f64,
    out: &mut [f64],
) {
    let count = out.len();
    let (x, y, z) = (
        &vectors[a][..count],
        &vectors[(a + 1) % D][..count],
        &vectors[(a + 2) % D][..count],
    );
    for i in 0..count {
        out[i] = sine::<D>(x[i], y[i], z[i], unit);
    }
}

/// The same, for vectors that are not stored.
#[inline(always)]
fn sines_of_differences<S: Simd, const D: usize>(
    _: S,
    plain: Plain<'_, D>,
    a: usize,
    unit: f64,
    out: &mut [f64],
) {
    let Plain {
        from,
        to,
        scale,
        rest,
    } = plain;
    let (b, c) = ((a + 1) % D, (a + 2) % D);
    for ((out, from), to) in out.iter_mut().zip(from).zip(to) {
        let component = |i: usize| rest[i] + (to[i] - from[i]) * scale[i];
        *out = sine::<D>(component(a), component(b), component(c), unit);
    }
}

/// Replaces each entry by the largest of `window` entries, from this one on at steps of
/// `stride`. Entries near the end of the list, and of lines along the axis, are left
/// without meaning.
#[inline(always)]
pub(super) fn sliding_maximum<S: Simd>(
    _: S,
    values: &mut Vec<f64>,
    stride: usize,
    window: usize,
    spare: &mut Vec<f64>,
) {
    // Doubling the reach: 1, 2, 4 entries and the rest.
    let mut reach = 1;
    while reach < window {
        let step = reach.min(window - reach);
        let ahead = (step * stride).min(values.len());
        let pairs = values.iter().zip(&values[ahead..]);
        // Not in place, which compilers do not turn into vector instructions.
        for (out, (&this, &next)) in spare.iter_mut().zip(pairs) {
            *out = if this > next { this } else { next };
        }
        std::mem::swap(values, spare);
        reach += step;
    }
}
