//! An elastic body: assembled, supported isostatically and factored.

use nalgebra_sparse::CscMatrix;

use crate::{
    FemError, Material, TetMesh,
    assembly::{neighbours, stiffness_matrix},
    factor::SparseCholesky,
    rigid::RigidModes,
};

/// Smallest Cholesky pivot, relative to the diagonal, of a body that is no
/// mechanism. Parts joined by an edge or a vertex leave pivots of rounding size
/// (1e-12 and below); cubes of 27 to 3 375 nodes gave 5e-3 and more up to ν = 0.49,
/// a rod thirty times as long as thick 2e-4.
const MECHANISM_PIVOT: f64 = 1e-9;

/// A free-floating elastic body, ready to be held by contacts.
///
/// Its stiffness matrix `K` is singular: rigid motions cost no force. Six
/// unknowns that stop them are held at zero and the rest is factored; the support
/// reactions vanish for every self-equilibrated load, so the factor serves any
/// set of contacts exactly (see [`ContactSet`](crate::ContactSet)).
#[derive(Debug)]
pub struct ElasticBody {
    mesh: TetMesh,
    material: Material,
    modes: RigidModes,
    supports: [usize; 6],
    /// Position of every unknown in the factored system; `None` for the supports.
    reduced: Vec<Option<usize>>,
    factor: SparseCholesky,
}

impl ElasticBody {
    /// Assembles and factors a body.
    ///
    /// The cost is one sparse Cholesky factorisation, on one thread, with
    /// bitwise repeatable results.
    ///
    /// # Errors
    ///
    /// * [`FemError::Disconnected`] if the mesh falls into parts.
    /// * [`FemError::Mechanism`] if parts hang together by an edge or a vertex.
    /// * [`FemError::Factorisation`] if the factor is unusable.
    pub fn new(mesh: TetMesh, material: Material) -> Result<Self, FemError> {
        check_connected(&mesh)?;
        let modes = RigidModes::new(mesh.positions());
        let supports = modes.isostatic_supports(mesh.positions());
        let stiffness = stiffness_matrix(&mesh, &material);

        let kept: Vec<usize> = (0..stiffness.ncols())
            .filter(|unknown| !supports.contains(unknown))
            .collect();
        let mut reduced = vec![None; stiffness.ncols()];
        for (row, &unknown) in kept.iter().enumerate() {
            reduced[unknown] = Some(row);
        }
        let factor = SparseCholesky::factor(&restrict(&stiffness, &reduced, kept.len()))?;
        let (row, pivot_ratio) = factor.smallest_pivot();
        if pivot_ratio < MECHANISM_PIVOT {
            let vertex = kept[row] / 3;
            return Err(FemError::Mechanism {
                vertex,
                pivot_ratio,
            });
        }
        Ok(Self {
            mesh,
            material,
            modes,
            supports,
            reduced,
            factor,
        })
    }

    /// The rest shape.
    #[must_use]
    pub fn mesh(&self) -> &TetMesh {
        &self.mesh
    }

    /// The material.
    #[must_use]
    pub fn material(&self) -> Material {
        self.material
    }

    /// A body whose rest shape is this one's deformed shape ("keep shape",
    /// \[Ma98\] section 6.1.2): same elements and material, free of stress.
    ///
    /// | argument | shape | unit |
    /// |---|---|---|
    /// | `displacements` | `#V × 3` | m |
    ///
    /// # Errors
    ///
    /// [`FemError::Mesh`] naming the tetrahedron if the deformed shape has an
    /// inverted or flat one, and those of [`ElasticBody::new`]. This body is
    /// unchanged in any case.
    ///
    /// # Panics
    ///
    /// If `displacements` is not `#V` long.
    pub fn keep_shape(&self, displacements: &[[f64; 3]]) -> Result<Self, FemError> {
        let rest = self.mesh.positions();
        assert_eq!(
            displacements.len(),
            rest.len(),
            "one displacement per vertex"
        );
        let deformed = rest
            .iter()
            .zip(displacements)
            .map(|(x, u)| [x[0] + u[0], x[1] + u[1], x[2] + u[2]])
            .collect();
        Self::new(
            TetMesh::new(deformed, self.mesh.tets().to_vec())?,
            self.material,
        )
    }

    pub(crate) fn modes(&self) -> &RigidModes {
        &self.modes
    }

    /// `B E`, where `B` is the inverse of `K` without the supports, padded with zero
    /// rows and columns, and the columns of `E` hold the weights of the contacts:
    /// `3#V × 3#C`, column after column.
    pub(crate) fn compliance_columns(&self, contacts: &[&[(u32, f64)]]) -> Vec<f64> {
        let unknowns = self.reduced.len();
        let factored = unknowns - self.supports.len();
        let columns = 3 * contacts.len();
        let mut rhs = vec![0.0; factored * columns];
        for (c, weights) in contacts.iter().enumerate() {
            for &(node, weight) in *weights {
                for i in 0..3 {
                    // The column of a support is zero.
                    if let Some(row) = self.reduced[3 * node as usize + i] {
                        rhs[(3 * c + i) * factored + row] = weight;
                    }
                }
            }
        }
        self.factor.solve_in_place(&mut rhs, columns);
        let mut out = vec![0.0; unknowns * columns];
        for (full, solved) in out
            .chunks_exact_mut(unknowns)
            .zip(rhs.chunks_exact(factored))
        {
            for (value, row) in full.iter_mut().zip(&self.reduced) {
                *value = row.map_or(0.0, |row| solved[row]);
            }
        }
        out
    }
}

/// Rows and columns of `a` that have a reduced index.
fn restrict(a: &CscMatrix<f64>, reduced: &[Option<usize>], size: usize) -> CscMatrix<f64> {
    let mut offsets = Vec::with_capacity(size + 1);
    let mut rows = Vec::with_capacity(a.nnz());
    let mut values = Vec::with_capacity(a.nnz());
    offsets.push(0);
    for (j, column) in a.col_iter().enumerate() {
        if reduced[j].is_none() {
            continue;
        }
        for (&i, &v) in column.row_indices().iter().zip(column.values()) {
            if let Some(row) = reduced[i] {
                rows.push(row);
                values.push(v);
            }
        }
        offsets.push(rows.len());
    }
    CscMatrix::try_from_csc_data(size, size, offsets, rows, values)
        .expect("a sub-matrix keeps the order of its rows")
}

fn check_connected(mesh: &TetMesh) -> Result<(), FemError> {
    let count = mesh.positions().len();
    let neighbours = neighbours(count, mesh.tets());
    let mut part = vec![usize::MAX; count];
    let mut parts = 0;
    let mut stack = Vec::new();
    for start in 0..count {
        if part[start] != usize::MAX {
            continue;
        }
        part[start] = parts;
        stack.push(start);
        while let Some(v) = stack.pop() {
            for &w in &neighbours[v] {
                if part[w as usize] == usize::MAX {
                    part[w as usize] = parts;
                    stack.push(w as usize);
                }
            }
        }
        parts += 1;
    }
    match part.iter().position(|&p| p == 1) {
        Some(vertex) => Err(FemError::Disconnected { parts, vertex }),
        None => Ok(()),
    }
}
