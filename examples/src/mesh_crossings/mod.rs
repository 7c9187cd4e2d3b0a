//! Where a triangle mesh crosses itself, decided exactly.
//!
//! Two triangles cross if they have a point in common that is not on a corner or an edge
//! which both have by the indices of their vertices. Touching counts. Coordinates are taken
//! as the exact numbers that they are, so there is no tolerance: a mesh without crossings is
//! embedded.
//!
//! # Limits
//!
//! Signs of determinants are exact unless products of three differences of coordinates
//! leave the range of numbers: lengths between 1e-60 and 1e60 are safe.
//!
//! # Example
//!
//! ```
//! use examples::mesh_crossings::Crossings;
//!
//! let positions = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0.2, 0.2, -1.], [0.2, 0.2, 1.]];
//! // They share a corner, but the second goes through the first as well.
//! let crossings = Crossings::of(&positions, &[[0, 1, 2], [0, 3, 4]]);
//! assert_eq!(crossings.pairs, [[0, 1]]);
//! ```

mod boxes;
#[cfg(test)]
mod tests;
mod triangles;

use boxes::{Box3, Tree};
use triangles::{Triangle, cross};

/// How a mesh crosses itself.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Crossings {
    /// Triangles that meet where they should not: indices, the smaller one first, in
    /// ascending order.
    pub pairs: Vec<[usize; 2]>,
    /// Triangles without area, ascending. They are in no pair.
    pub flat: Vec<usize>,
}

impl Crossings {
    /// Finds all crossings of a mesh. Costs `O(n log n)` for a mesh of n triangles of
    /// similar sizes, and the number of pairs whose boxes meet.
    ///
    /// # Panics
    ///
    /// If a triangle refers to a vertex that does not exist.
    #[must_use]
    pub fn of(positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> Self {
        let mesh: Vec<_> = triangles
            .iter()
            .map(|&vertices| Triangle {
                vertices,
                corners: vertices.map(|vertex| positions[vertex as usize]),
            })
            .collect();
        let has_area: Vec<_> = mesh.iter().map(Triangle::has_area).collect();
        let boxes: Vec<_> = mesh.iter().map(|t| Box3::around(&t.corners)).collect();
        let mut pairs = Vec::new();
        Tree::new(&boxes).pairs(&mut |i, j| {
            if has_area[i] && has_area[j] && cross(&mesh[i], &mesh[j]) {
                pairs.push([i, j]);
            }
        });
        pairs.sort_unstable();
        let flat = (0..mesh.len()).filter(|&i| !has_area[i]).collect();
        Self { pairs, flat }
    }

    /// Whether no triangles cross, and all have an area.
    #[must_use]
    pub fn is_embedded(&self) -> bool {
        self.pairs.is_empty() && self.flat.is_empty()
    }
}
