//! The variants of the conic-hull test of \[GD01\] (section 7): one set of cones for the
//! lattice, cells cut into parts, and cones off the axes.
//!
//! # Cones around any axes
//!
//! Let cₐ be unit vectors, one for each column of the Jacobian, and let all vectors of
//! column a lie within the angle θₐ < 90° of cₐ. If vectors vₐ, one from each cone, are
//! linearly dependent, there is a unit vector n perpendicular to all of them. The angle
//! between n and cₐ is then at least 90° − θₐ, so `|cₐ · n| ≤ sin θₐ`: with C the matrix whose
//! rows are the cₐ,
//!
//! ```text
//! n = C⁻¹ s    with |sₐ| ≤ sin θₐ.
//! ```
//!
//! The length of C⁻¹ s is a convex function of s, so over that box it is largest at a vertex,
//! `sₐ = ± sin θₐ`. Where it is less than one at all vertices (four in space and two in the
//! plane, for a change of all signs changes nothing), no such n exists: the determinant of
//! vectors from the cones is never zero. The cones are connected, so it has the sign that it
//! has at their axes, that of det C. The test passes if that is positive. (The converse
//! holds as well: where `C⁻¹ s` reaches length one in the box, scaled down it is an n that
//! is perpendicular to a vector in each cone.)
//!
//! For C = I the condition is `Σ sin² θₐ < 1`, that of [`cones`].
//!
//! Off the axes of the lattice, cₐ points along the mean of the vectors: rotations then cost
//! nothing. Other axes may fit better.
//!
//! # Parts of cells
//!
//! The Bézier vectors of a part of a cell are weighted means of those of a larger part, and
//! of the control vectors of the cell: with cones around the axes of the lattice they pass
//! wherever those do. They approach the derivatives in the part quadratically with its size,
//! so that only the spread of the derivatives is left. A cell that fails is converted to
//! Bézier form and, where it fails again, cut into halves along all axes, and so on as often
//! as is allowed ([`octree`](super::octree)).
//!
//! # What it proves
//!
//! | cones | proven where they pass |
//! |---|---|
//! | for each cell or part, around the axes | J is a P-matrix everywhere; for degrees from 2 on one-to-one by the theorem of Gale and Nikaido |
//! | for each cell or part, off the axes | `det J > 0` |
//! | one set for the lattice, around any axes | one-to-one: see below |
//!
//! With one set of cones for the whole domain, let p and q be two of its points. The mean of
//! J along the segment between them has its columns in the same cones, which are convex, so
//! it is not singular, and `F(q) − F(p)` is that matrix times `q − p`. This needs no
//! continuous J: it holds for degree 1 as well (where a segment runs along a crease, as the
//! limit of segments beside it).
//!
//! One set of cones for parts of cells holds the Bézier vectors of all parts of all cells.
//!
//! # Rounding
//!
//! With any number p, the sine of the angle between v and c is at most `|v − p c| / |v|` for a
//! unit vector c. What rounding may have done to v is added above and subtracted below.
//! The inverse of C is a computed matrix R; with `E = I − R C` and ρ ≥ ‖E‖,
//! `|C⁻¹ s| ≤ |R s| / (1 − ρ)`.

use fearless_simd::{Level, Simd, dispatch};

use super::columns::Columns;
use super::cones;
use super::octree::{Octree, Step};
use super::partials::{Partials, Plain, UNIT};
use super::piece::Shape;
use super::{Budget, ConicHull};
use crate::matrix::{cofactors, determinant};

/// Below this, a sum of a few numbers is less than one in spite of roundings.
const ALMOST_ONE: f64 = 1.0 - 1e-14;

/// Halvings of a cell along an axis, at most: positions stay exact numbers.
const DEEPEST: u32 = 50;

/// A part of a cell that does not pass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Failure<const D: usize> {
    pub(super) cell: [usize; D],
    /// From and to along each axis, within 0 and 1.
    pub(super) part: [[f64; 2]; D],
}

/// Tests a lattice: what fails first, if anything does. `known` says of the cells by number
/// whether they pass with cones of their own around the axes.
pub(super) fn test<const D: usize>(
    partials: &Partials<D>,
    hull: ConicHull,
    budget: &Budget,
    known: impl Fn(usize) -> bool,
) -> Option<Failure<D>> {
    let mut boxes = Boxes::new(hull, budget);
    if hull.one_for_all {
        if !hull.off_axis && pass_as_one(partials) {
            return None;
        }
        return boxes.failure_as_one(partials);
    }
    for number in 0..partials.cell_count() {
        if hull.off_axis || !known(number) {
            let cell = partials.cell(number);
            if let Some(part) = boxes.failing_part(partials, cell) {
                return Some(Failure { cell, part });
            }
        }
    }
    None
}

/// Whether one set of cones around the axes is enough for the whole lattice. Nothing but
/// displacements need be known if `M` is diagonal and knots are uniform.
pub(super) fn pass_as_one<const D: usize>(partials: &Partials<D>) -> bool {
    if !partials.is_sound() {
        return false;
    }
    let level = Level::new();
    let unit = partials.error(0.0);
    let sines: [f64; D] = std::array::from_fn(|a| {
        let stride = partials.stride[a];
        // Between the last control point of a line along the axis and the next line there
        // is no vector.
        let line = stride * partials.counts[a];
        if let Some(plain) = partials.plain(a) {
            dispatch!(level, s => sine_of_differences(s, plain, a, unit, [stride, line]))
        } else {
            let vectors = &partials.vectors[a];
            dispatch!(level, s => sine_of_vectors(s, vectors, a, unit, [stride, line]))
        }
    });
    Axes::Lattice.separate(sines)
}

/// The largest sin² θ of all vectors of column a, which are differences of control points.
#[inline(always)]
fn sine_of_differences<S: Simd, const D: usize>(
    _: S,
    plain: Plain<'_, D>,
    a: usize,
    unit: f64,
    [stride, line]: [usize; 2],
) -> f64 {
    let Plain {
        from,
        to,
        scale,
        rest,
    } = plain;
    let (b, c) = ((a + 1) % D, (a + 2) % D);
    let lines = from.chunks(line).zip(to.chunks(line));
    lines.fold(0.0, |most: f64, (from, to)| {
        let count = line - stride;
        let (from, to) = (&from[..count], &to[..count]);
        most.max(largest(count, |i| {
            let component = |k: usize| rest[k] + (to[i][k] - from[i][k]) * scale[k];
            cones::sine::<D>(component(a), component(b), component(c), unit)
        }))
    })
}

/// The same, of vectors that are stored.
#[inline(always)]
fn sine_of_vectors<S: Simd, const D: usize>(
    _: S,
    vectors: &[Vec<f64>; D],
    a: usize,
    unit: f64,
    [stride, line]: [usize; 2],
) -> f64 {
    let component = |offset: usize| &vectors[(a + offset) % D][..];
    let [x, y, z] = [0, 1, 2].map(component);
    (0..x.len()).step_by(line).fold(0.0, |most: f64, start| {
        let count = line - stride;
        let [x, y, z] = [x, y, z].map(|list| &list[start..start + count]);
        most.max(largest(count, |i| cones::sine::<D>(x[i], y[i], z[i], unit)))
    })
}

/// The whole of a cell.
const fn whole<const D: usize>() -> [[f64; 2]; D] {
    [[0.0, 1.0]; D]
}

/// Cells and parts of them, one after the other.
struct Boxes<const D: usize> {
    hull: ConicHull,
    /// Parts that may still be looked at.
    left: usize,
    /// Control vectors of a cell.
    columns: Columns<D>,
    parts: Octree<Columns<D>, D>,
    shapes: Option<[Shape; D]>,
}

impl<const D: usize> Boxes<D> {
    fn new(hull: ConicHull, budget: &Budget) -> Self {
        Self {
            hull,
            left: budget.boxes,
            columns: Columns::new(),
            parts: Octree::new(),
            shapes: None,
        }
    }

    /// The first part of a cell that fails and is not to be cut.
    fn failing_part(&mut self, partials: &Partials<D>, cell: [usize; D]) -> Option<[[f64; 2]; D]> {
        let hull = self.hull;
        let passes = |columns: &Columns<D>| {
            let axes = Axes::new(hull, columns);
            axes.separate(axes.sines(columns))
        };
        self.columns.set_control(partials, cell);
        if passes(&self.columns) {
            return None;
        }
        let mut failed = Some(whole());
        if hull.subdivisions > 0 {
            self.visit(partials, cell, |columns, part, depth| {
                failed = (!passes(columns)).then_some(part);
                match failed {
                    None => Step::Leaf,
                    Some(_) if depth < hull.subdivisions => Step::Cut(0.0),
                    Some(_) => Step::Stop,
                }
            });
        }
        failed
    }

    /// The cell that fails most, if one set of cones for all fails. Control vectors must be
    /// there.
    fn failure_as_one(&mut self, partials: &Partials<D>) -> Option<Failure<D>> {
        let axes = if self.hull.off_axis {
            let mut all = Columns::new();
            all.set_all(partials);
            let axes = Axes::new(self.hull, &all);
            if axes.separate(axes.sines(&all)) {
                return None;
            }
            axes
        } else {
            Axes::Lattice
        };
        let cells = || (0..partials.cell_count()).map(|number| partials.cell(number));
        let depth = self.hull.subdivisions;
        if depth > 0 {
            let mut widest = [0.0_f64; D];
            let ended = cells().all(|cell| {
                self.columns.set_control(partials, cell);
                self.visit(partials, cell, |columns, _, at| {
                    if at < depth {
                        return Step::Cut(0.0);
                    }
                    for (widest, sine) in widest.iter_mut().zip(axes.sines(columns)) {
                        *widest = widest.max(sine);
                    }
                    Step::Leaf
                })
            });
            if ended && axes.separate(widest) {
                return None;
            }
        }
        let mut worst = (0.0, [0; D]);
        for cell in cells() {
            self.columns.set_control(partials, cell);
            let sines = axes.sines(&self.columns);
            let sum = sines.iter().sum();
            if sum > worst.0 {
                worst = (sum, cell);
            }
        }
        Some(Failure {
            cell: worst.1,
            part: whole(),
        })
    }

    /// Visits the parts of a cell whose control vectors were set, in Bézier form, as long as
    /// the budget lasts; returns whether the visit came to its end.
    fn visit(
        &mut self,
        partials: &Partials<D>,
        cell: [usize; D],
        mut judge: impl FnMut(&Columns<D>, [[f64; 2]; D], u32) -> Step,
    ) -> bool {
        let spare = self.parts.free().unwrap_or_else(Columns::new);
        let mut whole = std::mem::replace(&mut self.columns, spare);
        whole.convert(partials, cell);
        let shapes = self.shapes.get_or_insert_with(|| whole.shapes());
        let left = &mut self.left;
        self.parts.visit(
            whole,
            |axis, high, low| high.split(shapes, axis, low),
            |columns, part, depth| match judge(columns, part, depth) {
                Step::Cut(_) if *left < 1 << D || depth == DEEPEST => Step::Stop,
                Step::Cut(key) => {
                    *left -= 1 << D;
                    Step::Cut(key)
                }
                step => step,
            },
        )
    }
}

/// What cones lie around.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Axes<const D: usize> {
    /// The axes of the lattice.
    Lattice,
    /// The rows of C, of length one up to rounding.
    Around([[f64; D]; D]),
}

impl<const D: usize> Axes<D> {
    fn new(hull: ConicHull, columns: &Columns<D>) -> Self {
        if !hull.off_axis {
            return Self::Lattice;
        }
        // Not numbers where a mean is zero: then nothing passes.
        Self::Around(std::array::from_fn(|a| {
            let sums: [f64; D] = std::array::from_fn(|c| columns.vectors[a][c].iter().sum());
            let length = sums.iter().map(|s| s * s).sum::<f64>().sqrt();
            sums.map(|s| s / length)
        }))
    }

    /// An upper bound of sin² θ for the cone of each column; 2 if that does not lie within
    /// 90°.
    fn sines(&self, columns: &Columns<D>) -> [f64; D] {
        std::array::from_fn(|a| {
            let (vectors, error) = (&columns.vectors[a], columns.errors[a]);
            match self {
                Self::Lattice => {
                    let at = |offset: usize| &vectors[(a + offset) % D][..];
                    let [x, y, z] = [at(0), at(1), at(2)];
                    dispatch!(columns.level, s => sine_along::<_, D>(s, x, y, z, error))
                }
                Self::Around(rows) => {
                    let axis = rows[a];
                    dispatch!(columns.level, s => sine_around(s, vectors, axis, error))
                }
            }
        })
    }

    /// Whether no vectors from cones with these sin² θ are linearly dependent.
    fn separate(&self, sines: [f64; D]) -> bool {
        match self {
            Self::Lattice => sines.iter().sum::<f64>() < ALMOST_ONE,
            Self::Around(rows) => separate(rows, sines),
        }
    }
}

/// The largest sin² of an angle between a vector and the first axis, with x the components
/// along that, y and z the others (z is not used in the plane), which err by at most `error`.
#[inline(always)]
fn sine_along<S: Simd, const D: usize>(_: S, x: &[f64], y: &[f64], z: &[f64], error: f64) -> f64 {
    largest(x.len(), |i| {
        cones::sine_within::<D>(x[i], y[i], z[i], error)
    })
}

/// The same for any axis of length one, up to rounding. A scalar product is rounded three
/// times, as is an entry of `v − p c`, relative to the 1-norm of v.
#[inline(always)]
fn sine_around<S: Simd, const D: usize>(
    _: S,
    vectors: &[Vec<f64>; D],
    axis: [f64; D],
    error: f64,
) -> f64 {
    let count = vectors[0].len();
    let vectors: [&[f64]; D] = std::array::from_fn(|c| &vectors[c][..count]);
    largest(count, |i| {
        let (mut along, mut size) = (0.0, 0.0);
        for c in 0..D {
            along += vectors[c][i] * axis[c];
            size += vectors[c][i].abs();
        }
        let slack = error + 8.0 * UNIT * size;
        let (mut across, mut length) = (0.0, 0.0);
        for c in 0..D {
            let beside = (vectors[c][i] - along * axis[c]).abs() + slack;
            across += beside * beside;
            let inside = vectors[c][i].abs() - error;
            length += if inside > 0.0 { inside * inside } else { 0.0 };
        }
        let sine = across / length * (1.0 + 1e-14);
        // Also where it is not a number.
        let sound = (along > (D + 1) as f64 * slack) & (sine <= 1.0);
        if sound { sine } else { 2.0 }
    })
}

/// The largest of the values of a function, none of them below 0.
#[inline(always)]
fn largest(count: usize, value: impl Fn(usize) -> f64) -> f64 {
    let mut lanes = [0.0; 8];
    let larger = |a: f64, b: f64| if a > b { a } else { b };
    let mut start = 0;
    while start + 8 <= count {
        for l in 0..8 {
            lanes[l] = larger(value(start + l), lanes[l]);
        }
        start += 8;
    }
    for i in start..count {
        lanes[0] = larger(value(i), lanes[0]);
    }
    lanes.iter().fold(0.0, |a, &b| larger(a, b))
}

/// See the [module](self): cones around the rows of C.
fn separate<const D: usize>(rows: &[[f64; D]; D], sines: [f64; D]) -> bool {
    let (inverse, determinant) = inverse(rows);
    // Its entries are at most 1: a dozen roundings.
    if !(determinant > 1e-12 && sines.iter().all(|&s| s < 1.0)) {
        return false;
    }
    // ‖I − R C‖, by the root of the sum of squares.
    let mut distance = 0.0;
    for r in 0..D {
        for c in 0..D {
            let (mut entry, mut size) = (-crate::frame::unit_entry(r, c), 1.0);
            for k in 0..D {
                entry += inverse[r][k] * rows[k][c];
                size += (inverse[r][k] * rows[k][c]).abs();
            }
            distance += (entry.abs() + 8.0 * UNIT * size).powi(2);
        }
    }
    let distance = 1.001 * distance.sqrt();
    // C has rows of length one up to rounding only.
    let sines = sines.map(|s| s.sqrt() * (1.0 + 1e-14));
    let mut longest = 0.0_f64;
    for signs in 0..1 << (D - 1) {
        let mut length = 0.0;
        for row in &inverse {
            let (mut sum, mut size) = (0.0, 0.0);
            for k in 0..D {
                let negative = k > 0 && signs >> (k - 1) & 1 == 1;
                let term = row[k] * sines[k];
                sum += if negative { -term } else { term };
                size += term.abs();
            }
            length += (sum.abs() + 8.0 * UNIT * size).powi(2);
        }
        longest = longest.max(length);
    }
    distance < 0.5 && longest < ALMOST_ONE * (1.0 - distance).powi(2)
}

/// An approximate inverse, and the determinant.
fn inverse<const D: usize>(m: &[[f64; D]; D]) -> ([[f64; D]; D], f64) {
    let (cofactors, determinant) = (cofactors(m), determinant(m));
    let inverse = std::array::from_fn(|r| std::array::from_fn(|c| cofactors[c][r] / determinant));
    (inverse, determinant)
}

#[cfg(test)]
mod tests;
