//! Whether two triangles of a mesh meet where they should not.
//!
//! Every question comes down to the sign of a determinant of coordinates as they are
//! stored, which Shewchuk's adaptive predicates give exactly.
//!
//! # References
//!
//! * J. Shewchuk, *Adaptive precision floating-point arithmetic and fast robust geometric
//!   predicates*, Discrete & Computational Geometry 18, 1997.

use robust::{Coord, Coord3D, orient2d, orient3d};

type Point = [f64; 3];

/// A triangle of a mesh: its vertices, and where they are.
#[derive(Debug, Clone, Copy)]
pub(super) struct Triangle {
    pub(super) vertices: [u32; 3],
    pub(super) corners: [Point; 3],
}

impl Triangle {
    /// The triangle as seen along an axis, one after the other.
    fn shadow(&self, axis: usize) -> [[f64; 2]; 3] {
        self.corners.map(|p| along(axis, p))
    }

    /// An axis along which it is not seen edge-on; `None` for a triangle without area.
    fn open_axis(&self) -> Option<usize> {
        (0..3).find(|&axis| {
            let [a, b, c] = self.shadow(axis);
            side_in_plane(a, b, c) != 0.0
        })
    }

    pub(super) fn has_area(&self) -> bool {
        self.open_axis().is_some()
    }

    fn edge(&self, corner: usize) -> [Point; 2] {
        [self.corners[corner], self.corners[(corner + 1) % 3]]
    }
}

/// Whether two triangles with area have a point in common that is not on what they share:
/// nothing, the corner or the edge whose vertices have the same indices in both. The
/// triangles are closed, so touching counts.
pub(super) fn cross(a: &Triangle, b: &Triangle) -> bool {
    let shared =
        |t: &Triangle, other: &Triangle| t.vertices.map(|vertex| other.vertices.contains(&vertex));
    let (in_a, in_b) = (shared(a, b), shared(b, a));
    match in_a.into_iter().filter(|&s| s).count() {
        0 => {
            // Most pairs whose boxes meet are apart because one lies on one side of the
            // other's plane.
            let apart = |of: &Triangle, other: &Triangle| {
                let sides = other.corners.map(|p| side(of.corners, p));
                sides.iter().all(|&s| s > 0.0) || sides.iter().all(|&s| s < 0.0)
            };
            !apart(a, b)
                && !apart(b, a)
                && (0..3).any(|i| meets(a.edge(i), b) || meets(b.edge(i), a))
        }
        1 => {
            // The common part is convex. If it is more than the corner, it has a segment
            // that begins there and ends where one of the triangles does: on the edge
            // opposite to the corner.
            let opposite = |t: &Triangle, shared: [bool; 3]| {
                let corner = shared.iter().position(|&s| s).unwrap_or(0);
                t.edge((corner + 1) % 3)
            };
            meets(opposite(a, in_a), b) || meets(opposite(b, in_b), a)
        }
        2 => {
            // Two planes through the edge have nothing else in common, unless they are the
            // same plane and the triangles on the same side of the edge.
            let lone = |t: &Triangle, shared: [bool; 3]| {
                t.corners[shared.iter().position(|&s| !s).unwrap_or(0)]
            };
            let (p, q) = (lone(a, in_a), lone(b, in_b));
            side(a.corners, q) == 0.0
                && a.open_axis().is_some_and(|axis| {
                    let corner = in_a.iter().position(|&s| !s).unwrap_or(0);
                    let [from, to] = a.edge((corner + 1) % 3).map(|p| along(axis, p));
                    let sides = [p, q].map(|p| side_in_plane(from, to, along(axis, p)));
                    (sides[0] > 0.0) == (sides[1] > 0.0)
                })
        }
        // The same triangle twice.
        _ => true,
    }
}

/// Whether a segment has a point in common with a triangle that has an area.
fn meets([p, q]: [Point; 2], t: &Triangle) -> bool {
    let [at_p, at_q] = [side(t.corners, p), side(t.corners, q)];
    if (at_p > 0.0 && at_q > 0.0) || (at_p < 0.0 && at_q < 0.0) {
        return false;
    }
    if at_p == 0.0 && at_q == 0.0 {
        return t.open_axis().is_some_and(|axis| {
            let ends = [p, q].map(|p| along(axis, p));
            meets_in_plane(ends, t.shadow(axis))
        });
    }
    // The line crosses the plane in one point. It is in the triangle if the line turns the
    // same way round all edges, or passes through them.
    let turns = [0, 1, 2].map(|i| {
        let [from, to] = t.edge(i);
        side([p, q, from], to)
    });
    turns.iter().all(|&s| s >= 0.0) || turns.iter().all(|&s| s <= 0.0)
}

/// The same in the plane.
fn meets_in_plane([p, q]: [[f64; 2]; 2], corners: [[f64; 2]; 3]) -> bool {
    let [a, b, c] = corners;
    let turn = side_in_plane(a, b, c);
    let edges = [[a, b], [b, c], [c, a]];
    let inside = |p| {
        edges
            .iter()
            .all(|&[from, to]| side_in_plane(from, to, p) * turn.signum() >= 0.0)
    };
    inside(p) || inside(q) || edges.iter().any(|&edge| segments_meet([p, q], edge))
}

fn segments_meet([p, q]: [[f64; 2]; 2], [a, b]: [[f64; 2]; 2]) -> bool {
    let apart = |x: f64, y: f64| (x > 0.0 && y > 0.0) || (x < 0.0 && y < 0.0);
    let on_line = [side_in_plane(p, q, a), side_in_plane(p, q, b)];
    if on_line.iter().all(|&s| s == 0.0) {
        // On one line, or p = q: then the boxes decide, with what p and q are for a, b.
        let between = |x: [f64; 2], [from, to]: [[f64; 2]; 2]| {
            side_in_plane(from, to, x) == 0.0
                && (0..2)
                    .all(|c| f64::min(from[c], to[c]) <= x[c] && x[c] <= f64::max(from[c], to[c]))
        };
        return between(a, [p, q])
            || between(b, [p, q])
            || between(p, [a, b])
            || between(q, [a, b]);
    }
    !apart(on_line[0], on_line[1]) && !apart(side_in_plane(a, b, p), side_in_plane(a, b, q))
}

/// On which side of the plane through a, b and c the point d is; exactly zero on it.
fn side([a, b, c]: [Point; 3], d: Point) -> f64 {
    let coord = |[x, y, z]: Point| Coord3D { x, y, z };
    orient3d(coord(a), coord(b), coord(c), coord(d))
}

/// On which side of the line from a to b the point c is; exactly zero on it.
fn side_in_plane(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    let coord = |[x, y]: [f64; 2]| Coord { x, y };
    orient2d(coord(a), coord(b), coord(c))
}

/// A point as seen along an axis.
fn along(axis: usize, p: Point) -> [f64; 2] {
    [p[(axis + 1) % 3], p[(axis + 2) % 3]]
}
