//! Hexahedral blocks to conforming tetrahedra.

use std::collections::BTreeMap;

use fem_tet::{MeshError, TetMesh};

/// The corners of a hexahedron's six faces, counter-clockwise seen from outside;
/// corner `c` lies at the offsets given by the bits of `c` (x, y, z).
const FACES: [[usize; 4]; 6] = [
    [0, 4, 6, 2],
    [1, 3, 7, 5],
    [0, 1, 5, 4],
    [2, 6, 7, 3],
    [0, 2, 3, 1],
    [4, 5, 7, 6],
];

/// A hexahedral mesh under construction. Vertices are named by an integer key, so
/// that neighbouring blocks share theirs without comparing coordinates.
#[derive(Default)]
pub(super) struct HexMesh {
    ids: BTreeMap<[u32; 4], u32>,
    positions: Vec<[f64; 3]>,
    hexes: Vec<[u32; 8]>,
}

impl HexMesh {
    /// The vertex of this key, made on first use.
    pub(super) fn vertex(&mut self, key: [u32; 4], position: impl FnOnce() -> [f64; 3]) -> u32 {
        *self.ids.entry(key).or_insert_with(|| {
            self.positions.push(position());
            u32::try_from(self.positions.len() - 1).expect("resolutions are bounded")
        })
    }

    /// A hexahedron; corner `c` lies at the offsets given by the bits of `c`.
    pub(super) fn push(&mut self, corners: [u32; 8]) {
        self.hexes.push(corners);
    }

    /// Gives every hexahedron a vertex in its middle and cuts it into twelve
    /// tetrahedra, two on each face. The diagonal of a face starts at its smallest
    /// vertex, so that both neighbours cut it alike. The result has no preferred
    /// direction, unlike the cut into five or six.
    pub(super) fn into_tets(self) -> Result<TetMesh, MeshError> {
        let Self {
            mut positions,
            hexes,
            ..
        } = self;
        let mut tets = Vec::with_capacity(12 * hexes.len());
        for corners in &hexes {
            let mut middle = [0.0; 3];
            for &c in corners {
                for (m, x) in middle.iter_mut().zip(positions[c as usize]) {
                    *m += x / 8.0;
                }
            }
            positions.push(middle);
            let centre = u32::try_from(positions.len() - 1).expect("resolutions are bounded");
            for face in FACES {
                let quad = face.map(|c| corners[c]);
                let first = (0..4).min_by_key(|&i| quad[i]).unwrap_or(0);
                let at = |i: usize| quad[(first + i) % 4];
                // Seen from the centre a face winds clockwise: swap two corners.
                tets.push([at(0), at(2), at(1), centre]);
                tets.push([at(0), at(3), at(2), centre]);
            }
        }
        TetMesh::new(positions, tets)
    }
}
