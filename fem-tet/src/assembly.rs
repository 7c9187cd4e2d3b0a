//! Assembly of the global stiffness matrix.

use nalgebra_sparse::CscMatrix;

use crate::{Material, TetMesh, element, mesh::corners};

/// Assembles the symmetric `3#V × 3#V` stiffness matrix, newton per metre; unknown
/// `3 v + i` is component `i` of the displacement of vertex `v`.
///
/// The pattern is built per vertex first (3 × 3 blocks between vertices that
/// share a tetrahedron), then every element adds its blocks in place.
pub(crate) fn stiffness_matrix(mesh: &TetMesh, material: &Material) -> CscMatrix<f64> {
    let vertex_count = mesh.positions().len();
    let neighbours = neighbours(vertex_count, mesh.tets());
    let unknowns = 3 * vertex_count;

    let mut offsets = Vec::with_capacity(unknowns + 1);
    let mut rows = Vec::new();
    offsets.push(0);
    for list in &neighbours {
        for _component in 0..3 {
            for &w in list {
                rows.extend([3 * w as usize, 3 * w as usize + 1, 3 * w as usize + 2]);
            }
            offsets.push(rows.len());
        }
    }

    let mut values = vec![0.0; rows.len()];
    for tet in mesh.tets() {
        let k = element::stiffness(&corners(mesh.positions(), tet), material);
        for (b, &column_vertex) in tet.iter().enumerate() {
            let list = &neighbours[column_vertex as usize];
            for (a, row_vertex) in tet.iter().enumerate() {
                let slot = list
                    .binary_search(row_vertex)
                    .expect("vertices of one tetrahedron are neighbours");
                for j in 0..3 {
                    let base = offsets[3 * column_vertex as usize + j] + 3 * slot;
                    for i in 0..3 {
                        values[base + i] += k[a][b][i][j];
                    }
                }
            }
        }
    }
    CscMatrix::try_from_csc_data(unknowns, unknowns, offsets, rows, values)
        .expect("rows ascend within each column by construction")
}

/// For every vertex the ascending list of vertices it shares a tetrahedron with,
/// itself included.
pub(crate) fn neighbours(vertex_count: usize, tets: &[[u32; 4]]) -> Vec<Vec<u32>> {
    let mut lists = vec![Vec::new(); vertex_count];
    for tet in tets {
        for &v in tet {
            lists[v as usize].extend_from_slice(tet);
        }
    }
    for list in &mut lists {
        list.sort_unstable();
        list.dedup();
    }
    lists
}
