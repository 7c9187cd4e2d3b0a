//! What every format has in common: positions, polygons and normals.

use super::error::{MeshFileError, Place, Problem};

/// The normal that a file gives to a vertex.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VertexNormal {
    /// Index of the vertex.
    pub vertex: u32,
    /// The normal, of unit length.
    pub normal: [f64; 3],
}

/// Polygons, one after the other.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct Polygons {
    corners: Vec<u32>,
    /// Where in `corners` each polygon ends.
    ends: Vec<usize>,
}

impl Polygons {
    pub(super) fn push(&mut self, polygon: impl IntoIterator<Item = u32>) {
        self.corners.extend(polygon);
        self.ends.push(self.corners.len());
    }

    pub(super) fn len(&self) -> usize {
        self.ends.len()
    }

    pub(super) fn get(&self, index: usize) -> &[u32] {
        let start = index.checked_sub(1).map_or(0, |i| self.ends[i]);
        &self.corners[start..self.ends[index]]
    }

    pub(super) fn iter(&self) -> impl ExactSizeIterator<Item = &[u32]> + Clone {
        (0..self.len()).map(|index| self.get(index))
    }

    /// The polygons cut into triangles, from their first corner.
    pub(super) fn fans(&self) -> impl Iterator<Item = [u32; 3]> {
        self.iter()
            .flat_map(|polygon| polygon[1..].windows(2).map(|w| [polygon[0], w[0], w[1]]))
    }

    /// How many triangles [`fans`](Self::fans) makes.
    pub(super) fn fan_count(&self) -> usize {
        self.corners.len() - 2 * self.len()
    }
}

/// A mesh without what a particular format adds to it.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Geometry {
    pub(super) positions: Vec<[f64; 3]>,
    /// Polygons of three corners at least, all of which exist.
    pub(super) faces: Polygons,
    /// In an order that the format knows.
    pub(super) normals: Vec<VertexNormal>,
}

impl Geometry {
    /// One normal for every vertex, if the file has that: each corner of a face has a
    /// normal, and no vertex has two. Vertices of no face may have zeros.
    pub(super) fn vertex_normals(&self) -> Option<Vec<[f64; 3]>> {
        if self.normals.is_empty() {
            return None;
        }
        let mut normals = vec![None; self.positions.len()];
        for &VertexNormal { vertex, normal } in &self.normals {
            let known = normals[vertex as usize].get_or_insert(normal);
            if !same(known, &normal) {
                return None;
            }
        }
        let complete = self
            .faces
            .iter()
            .flatten()
            .all(|&vertex| normals[vertex as usize].is_some());
        complete.then(|| normals.into_iter().map(Option::unwrap_or_default).collect())
    }

    /// Whether there are vertices that belong to no face.
    pub(super) fn has_loose_vertices(&self) -> bool {
        let mut is_used = vec![false; self.positions.len()];
        for &vertex in self.faces.iter().flatten() {
            is_used[vertex as usize] = true;
        }
        is_used.contains(&false)
    }

    /// The corners of a triangle in single precision, and its normal.
    pub(super) fn facet(&self, corners: [u32; 3]) -> Result<Facet, MeshFileError> {
        let mut facet = Facet::default();
        for (vertex, out) in corners.into_iter().zip(&mut facet.corners) {
            *out = single(&self.positions[vertex as usize], vertex as usize)?;
        }
        // In double precision: three rounded corners still say exactly where they are.
        let [a, b, c] = facet.corners.map(|corner| corner.map(f64::from));
        let [u, v] = [b, c].map(|p| [0, 1, 2].map(|i| p[i] - a[i]));
        let area = [(1, 2), (2, 0), (0, 1)].map(|(i, j)| u[i] * v[j] - u[j] * v[i]);
        if let Some(normal) = unit(&area) {
            // A component of a unit vector fits any type.
            facet.normal = normal.map(|c| super::error::to_f32(c).unwrap_or_default());
        }
        Ok(facet)
    }
}

/// A triangle of a soup of triangles.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Facet {
    /// Zero if the corners lie on a line.
    pub(super) normal: [f32; 3],
    pub(super) corners: [[f32; 3]; 3],
}

/// A position in single precision.
pub(super) fn single(position: &[f64; 3], vertex: usize) -> Result<[f32; 3], MeshFileError> {
    let mut rounded = [0.0; 3];
    for (out, &value) in rounded.iter_mut().zip(position) {
        *out = super::error::to_f32(value)
            .map_err(|problem| Place::item("vertex", vertex).error(problem))?;
    }
    Ok(rounded)
}

/// The vector scaled to unit length, unless it has no direction.
pub(super) fn unit(vector: &[f64; 3]) -> Option<[f64; 3]> {
    let largest = vector.iter().fold(0.0, |m: f64, c| m.max(c.abs()));
    if largest == 0.0 || !vector.iter().all(|c| c.is_finite()) {
        return None;
    }
    // The square of a very large or small component is not what it should be.
    let scaled = vector.map(|c| c / largest);
    let length = scaled.iter().map(|c| c * c).sum::<f64>().sqrt();
    Some(scaled.map(|c| c / length))
}

/// Whether two vectors are the same to the bit.
pub(super) fn same(a: &[f64; 3], b: &[f64; 3]) -> bool {
    a.map(f64::to_bits) == b.map(f64::to_bits)
}

/// Checks an index that counts from zero.
pub(super) fn checked_index(index: i64, count: usize, of: &'static str) -> Result<u32, Problem> {
    u32::try_from(index)
        .ok()
        .filter(|&i| (i as usize) < count)
        .ok_or(Problem::IndexOutOfRange { of, index, count })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polygons_are_cut_from_their_first_corner() {
        let mut polygons = Polygons::default();
        polygons.push([0, 1, 2]);
        polygons.push([5, 4, 3, 2, 1]);
        let fans: Vec<_> = polygons.fans().collect();
        assert_eq!(fans, [[0, 1, 2], [5, 4, 3], [5, 3, 2], [5, 2, 1]]);
        assert_eq!(fans.len(), polygons.fan_count());
    }

    #[test]
    fn directions_survive_any_magnitude() {
        assert_eq!(unit(&[0.0, -1e300, 0.0]), Some([0.0, -1.0, 0.0]));
        assert_eq!(unit(&[0.0, 0.0, 5e-324]), Some([0.0, 0.0, 1.0]));
        assert_eq!(unit(&[0.0; 3]), None);
        assert_eq!(unit(&[1.0, f64::NAN, 0.0]), None);
        assert_eq!(unit(&[f64::INFINITY, 0.0, 0.0]), None);
    }
}
