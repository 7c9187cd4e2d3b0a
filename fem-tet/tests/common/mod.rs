//! Meshes that the tests make.

use fem_tet::{ElasticBody, Material, TetMesh};

/// A box of `cells` unit cells scaled by `spacing`, each cut into six
/// tetrahedra round its diagonal (Kuhn).
pub(crate) fn kuhn_box(cells: [u32; 3], spacing: f64) -> TetMesh {
    let [nx, ny, nz] = cells.map(|c| c + 1);
    let id = |i: u32, j: u32, k: u32| i + nx * (j + ny * k);
    let mut positions = Vec::new();
    for k in 0..nz {
        for j in 0..ny {
            for i in 0..nx {
                positions.push([i, j, k].map(|c| f64::from(c) * spacing));
            }
        }
    }
    let mut tets = Vec::new();
    for k in 0..cells[2] {
        for j in 0..cells[1] {
            for i in 0..cells[0] {
                // Even permutations keep the orientation, odd ones swap two corners.
                for (axes, odd) in [
                    ([0, 1, 2], false),
                    ([1, 2, 0], false),
                    ([2, 0, 1], false),
                    ([1, 0, 2], true),
                    ([0, 2, 1], true),
                    ([2, 1, 0], true),
                ] {
                    let mut corner = [i, j, k];
                    let mut tet = [id(i, j, k); 4];
                    for (slot, axis) in axes.into_iter().enumerate() {
                        corner[axis] += 1;
                        tet[slot + 1] = id(corner[0], corner[1], corner[2]);
                    }
                    if odd {
                        tet.swap(1, 2);
                    }
                    tets.push(tet);
                }
            }
        }
    }
    TetMesh::new(positions, tets).expect("a sound mesh")
}

/// A block of foam of 27 vertices, 1 cm between them.
#[allow(
    dead_code,
    reason = "each test binary uses its own part of this module"
)]
pub(crate) fn foam() -> ElasticBody {
    let material = Material::new(20e3, 0.3).expect("in range");
    ElasticBody::new(kuhn_box([2, 2, 2], 0.01), material).expect("a sound body")
}
