//! Condensation to a set of contact nodes.
//!
//! With the contact unknowns `k` and all others `u`, [Ma98] (eqs. 3.41–3.43)
//! partitions `K q = F`, `F_u = 0`, and finds
//! `Q_u = −K₁₁⁻¹ K₁₂ Q_k` and `F_k = K₂₁ Q_u + K₂₂ Q_k`, inverting `K₁₁` anew for
//! every contact set. Here both maps come from the one factor of the body: with
//! `B` the inverse of `K` without its six isostatic supports, `R` the rigid
//! motions and `E` selecting the contact unknowns,
//!
//! ```text
//! u = B E λ + R α,    Eᵀ u = d,    Rᵀ E λ = 0
//! G = B_CC + w R_C R_Cᵀ,   Y = G⁻¹ R_C,   S = R_Cᵀ Y
//! α = S⁻¹ Yᵀ d,   λ = G⁻¹ (d − R_C α)
//! ```
//!
//! The contact forces `λ` are in equilibrium, so the supports carry nothing and
//! `K u = E λ` holds in every row: `u_k = d` and `λ = F_k` exactly. The term
//! `w R_C R_Cᵀ` (any `w > 0`; here the mean diagonal of `B_CC`) does not change
//! the solution, since `R_Cᵀ λ = 0`, but keeps `G` positive definite when contacts
//! lie on the supports, where `B_CC` is singular.

use nalgebra::{Cholesky, DMatrix};

use crate::{ElasticBody, FemError, FreeMotion};

/// Singular values of `R_C` below this fraction of the largest mean that the
/// contacts leave a rigid motion free. Well-placed contacts give 0.05 to 1; exact
/// collinearity gives rounding size, 1e-15.
const FREE_MOTION: f64 = 1e-6;

/// A body condensed to its contact nodes: `3#C` displacements in, the
/// displacements of all vertices and the contact forces out.
///
/// The dense map is `3#V × 3#C`: 120 kB for 341 vertices and 15 unknowns.
#[derive(Debug, Clone)]
pub struct ContactSet {
    nodes: Vec<u32>,
    vertex_count: usize,
    /// `−K₁₁⁻¹ K₁₂` with identity rows at the contacts, column after column.
    displacement_map: Vec<f64>,
    /// The condensed stiffness `K₂₂ − K₂₁ K₁₁⁻¹ K₁₂`, column after column.
    force_map: Vec<f64>,
}

impl ContactSet {
    /// Condenses `body` to the given nodes, which may lie anywhere in it.
    ///
    /// # Errors
    ///
    /// * [`FemError::ContactOutOfRange`], [`FemError::RepeatedContact`] for a node
    ///   that does not exist or is named twice.
    /// * [`FemError::UnderConstrained`] for fewer than three nodes, or nodes on one
    ///   line (to 1e-6 of their distance), with the motion that stays free.
    pub fn new(body: &ElasticBody, nodes: &[u32]) -> Result<Self, FemError> {
        let positions = body.mesh().positions();
        check_nodes(nodes, positions.len())?;
        let r_c = body
            .modes()
            .rows_at(nodes.iter().map(|&n| positions[n as usize]));
        check_held(&r_c, nodes, positions)?;

        let columns = 3 * nodes.len();
        let unknowns = 3 * positions.len();
        let b = DMatrix::from_vec(unknowns, columns, body.compliance_columns(nodes));
        let contact_rows: Vec<usize> = nodes
            .iter()
            .flat_map(|&n| [0, 1, 2].map(|i| 3 * n as usize + i))
            .collect();
        let mut g = b.select_rows(&contact_rows);
        let w = g.diagonal().sum() / columns as f64;
        g += w * &r_c * r_c.transpose();

        let unusable = |what: &str| FemError::Factorisation {
            unknowns: columns,
            reason: format!("{what} of the contacts is not positive definite"),
        };
        let g = Cholesky::new(g).ok_or_else(|| unusable("the compliance"))?;
        let y = g.solve(&r_c);
        let s = Cholesky::new(r_c.transpose() * &y).ok_or_else(|| unusable("the rigid part"))?;
        let alpha = s.solve(&y.transpose());
        let lambda = g.solve(&(DMatrix::identity(columns, columns) - &r_c * &alpha));

        let mut map = b * &lambda;
        for (v, &p) in positions.iter().enumerate() {
            let rigid = body.modes().rows(p) * &alpha;
            let mut rows = map.rows_mut(3 * v, 3);
            rows += rigid;
        }
        // Exact where rounding would leave 1 ± a few ulp.
        for (c, &row) in contact_rows.iter().enumerate() {
            map.row_mut(row).fill(0.0);
            map[(row, c)] = 1.0;
        }
        let symmetric = (&lambda + lambda.transpose()) * 0.5;
        Ok(Self {
            nodes: nodes.to_vec(),
            vertex_count: positions.len(),
            displacement_map: map.data.into(),
            force_map: symmetric.data.into(),
        })
    }

    /// The contact nodes, in the order given.
    #[must_use]
    pub fn nodes(&self) -> &[u32] {
        &self.nodes
    }

    /// Displacements of all vertices when the contact nodes are displaced by
    /// `contact_displacements`: the thesis's `Q_u = −K₁₁⁻¹ K₁₂ Q_k`. Contact nodes
    /// get exactly what was prescribed.
    ///
    /// | argument | shape | unit |
    /// |---|---|---|
    /// | `contact_displacements` | `#C × 3`, in the order of [`nodes`](Self::nodes) | m |
    /// | `out` | `#V × 3`, overwritten | m |
    ///
    /// No allocation; `9 #V #C` multiply-adds.
    ///
    /// # Panics
    ///
    /// If a slice has another length.
    pub fn displacements_into(&self, contact_displacements: &[[f64; 3]], out: &mut [[f64; 3]]) {
        assert_eq!(out.len(), self.vertex_count, "one displacement per vertex");
        self.multiply(&self.displacement_map, contact_displacements, out);
    }

    /// Forces that must act on the contact nodes to displace them so: `F_k`. They
    /// sum to zero, and so do their moments.
    ///
    /// | argument | shape | unit |
    /// |---|---|---|
    /// | `contact_displacements` | `#C × 3` | m |
    /// | `out` | `#C × 3`, overwritten | N |
    ///
    /// # Panics
    ///
    /// If a slice has another length.
    pub fn forces_into(&self, contact_displacements: &[[f64; 3]], out: &mut [[f64; 3]]) {
        assert_eq!(out.len(), self.nodes.len(), "one force per contact");
        self.multiply(&self.force_map, contact_displacements, out);
    }

    fn multiply(&self, map: &[f64], displacements: &[[f64; 3]], out: &mut [[f64; 3]]) {
        assert_eq!(
            displacements.len(),
            self.nodes.len(),
            "one displacement per contact"
        );
        out.fill([0.0; 3]);
        let out = out.as_flattened_mut();
        let columns = map.chunks_exact(out.len());
        for (column, &d) in columns.zip(displacements.as_flattened()) {
            for (o, &m) in out.iter_mut().zip(column) {
                *o += m * d;
            }
        }
    }
}

fn check_nodes(nodes: &[u32], vertex_count: usize) -> Result<(), FemError> {
    for (contact, &node) in nodes.iter().enumerate() {
        if node as usize >= vertex_count {
            return Err(FemError::ContactOutOfRange {
                contact,
                node,
                vertex_count,
            });
        }
        if let Some(first) = nodes[..contact].iter().position(|&n| n == node) {
            return Err(FemError::RepeatedContact {
                first,
                second: contact,
                node,
            });
        }
    }
    Ok(())
}

/// Cholesky succeeding proves nothing here (rounding makes singular matrices
/// look definite), so the rank of the rigid motions at the contacts is tested.
fn check_held(r_c: &DMatrix<f64>, nodes: &[u32], positions: &[[f64; 3]]) -> Result<(), FemError> {
    let free = match *nodes {
        [] => FreeMotion::Everything,
        [a] => FreeMotion::AboutNode(a),
        [a, ..] => {
            let singular = r_c.singular_values();
            let (largest, smallest) = (singular.max(), singular.min());
            if singular.len() == 6 && smallest >= FREE_MOTION * largest {
                return Ok(());
            }
            let distance = |n: u32| {
                let (p, q) = (positions[a as usize], positions[n as usize]);
                (0..3).map(|i| (p[i] - q[i]).powi(2)).sum::<f64>()
            };
            let farthest = nodes
                .iter()
                .copied()
                .max_by(|&m, &n| distance(m).total_cmp(&distance(n)));
            FreeMotion::AboutLine(a, farthest.expect("not empty"))
        }
    };
    Err(FemError::UnderConstrained { free })
}
