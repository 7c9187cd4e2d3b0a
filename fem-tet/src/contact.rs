//! Condensation to a set of contacts.
//!
//! With the contact unknowns `k` and all others `u`, [Ma98](crate#references)
//! (eqs. 3.41–3.43) partitions `K q = F`, no force acting but at the contacts, and
//! finds `Q_u = −K₁₁⁻¹ K₁₂ Q_k` and the forces `F_u = K₂₁ Q_u + K₂₂ Q_k` that are
//! unknown at the contacts, inverting `K₁₁` anew for every contact set. Here both
//! maps come from the one factor of the body: with `B` the inverse of `K` without
//! its six isostatic supports, `R` the rigid motions and the columns of `E` the
//! weights of the contacts (a unit vector for a contact at a node),
//!
//! ```text
//! u = B E λ + R α,    Eᵀ u = d,    Rᵀ E λ = 0
//! G = Eᵀ B E + w R_C R_Cᵀ,   R_C = Eᵀ R,   Y = G⁻¹ R_C,   S = R_Cᵀ Y
//! α = S⁻¹ Yᵀ d,   λ = G⁻¹ (d − R_C α)
//! ```
//!
//! The contact forces `λ` are in equilibrium, so the supports carry nothing and
//! `K u = E λ` holds in every row: the contacts go where they are told, nothing
//! else is loaded, and for contacts at nodes `λ = F_u`. The term `w R_C R_Cᵀ` (any
//! `w > 0`; here the mean diagonal of `Eᵀ B E`) does not change the solution, since
//! `R_Cᵀ λ = 0`, but keeps `G` positive definite when contacts lie on the supports,
//! where `B` is zero.

use nalgebra::{Cholesky, DMatrix};

use crate::{ElasticBody, FemError, FreeMotion};

/// Singular values of `R_C` below this fraction of the largest mean that the
/// contacts leave a rigid motion free. Random contacts on cubes and rods give 0.01 to
/// 0.6; exact collinearity gives rounding size, 1e-15.
const FREE_MOTION: f64 = 1e-6;

/// Cholesky pivots of `G` below this fraction of its diagonal mean that a contact
/// prescribes what others already determine. Random and neighbouring nodes of cubes
/// and rods stay above 1e-3; twice the same place gives rounding size.
const DEPENDENT_PIVOT: f64 = 1e-9;

/// A place of a body whose displacement is prescribed: a weighted mean of nodes.
///
/// One node is the thesis's contact; a point inside a surface triangle takes its
/// barycentric coordinates as weights; a fingertip that presses on an area takes
/// all nodes under it, and then acts as a pressure spread by those weights, which
/// stays regular when the mesh is refined.
#[derive(Debug, Clone, PartialEq)]
pub struct Contact {
    weights: Vec<(u32, f64)>,
}

impl Contact {
    /// A contact at a node.
    #[must_use]
    pub fn node(node: u32) -> Self {
        Self {
            weights: vec![(node, 1.0)],
        }
    }

    /// A contact at a weighted mean of nodes; the weights are divided by their sum.
    ///
    /// # Errors
    ///
    /// [`FemError::ContactWeights`] if a node is named twice, or the weights are
    /// not finite and non-negative with a positive sum.
    pub fn weighted(weights: &[(u32, f64)]) -> Result<Self, FemError> {
        let sum: f64 = weights.iter().map(|&(_, w)| w).sum();
        if !sum.is_normal() || weights.iter().any(|&(_, w)| w.is_nan() || w < 0.0) {
            return Err(FemError::ContactWeights {
                reason: "the weights must be finite, not negative, and have a positive sum",
            });
        }
        let mut weights: Vec<_> = weights.iter().map(|&(n, w)| (n, w / sum)).collect();
        weights.retain(|&(_, w)| w > 0.0);
        weights.sort_unstable_by_key(|&(node, _)| node);
        if weights.windows(2).any(|pair| pair[0].0 == pair[1].0) {
            return Err(FemError::ContactWeights {
                reason: "a node is named twice",
            });
        }
        Ok(Self { weights })
    }

    /// Nodes, ascending, and their weights, which sum to one.
    #[must_use]
    pub fn weights(&self) -> &[(u32, f64)] {
        &self.weights
    }
}

/// A body condensed to its contacts: `3#C` displacements in, the displacements of
/// all vertices and the contact forces out.
///
/// The dense map is `3#V × 3#C`: 123 kB for 341 vertices and five contacts.
#[derive(Debug, Clone)]
pub struct ContactSet {
    contacts: Vec<Contact>,
    vertex_count: usize,
    /// `−K₁₁⁻¹ K₁₂` with identity rows at contact nodes, column after column.
    displacement_map: Vec<f64>,
    /// The condensed stiffness `K₂₂ − K₂₁ K₁₁⁻¹ K₁₂`, column after column.
    force_map: Vec<f64>,
}

impl ContactSet {
    /// Condenses `body` to contacts at the given nodes.
    ///
    /// # Errors
    ///
    /// Those of [`ContactSet::new`].
    pub fn at_nodes(body: &ElasticBody, nodes: &[u32]) -> Result<Self, FemError> {
        Self::new(body, nodes.iter().copied().map(Contact::node).collect())
    }

    /// Condenses `body` to the given contacts.
    ///
    /// The cost is `3#C` solves with the factor of the body.
    ///
    /// # Errors
    ///
    /// * [`FemError::ContactOutOfRange`] for a node that does not exist.
    /// * [`FemError::UnderConstrained`] for fewer than three contacts, or contacts
    ///   on one line (to 1e-6 of their distance), with the motion that stays free.
    /// * [`FemError::DependentContact`] if a contact prescribes what others already
    ///   determine, such as twice the same node.
    pub fn new(body: &ElasticBody, contacts: Vec<Contact>) -> Result<Self, FemError> {
        let positions = body.mesh().positions();
        check_nodes(&contacts, positions.len())?;
        let points: Vec<[f64; 3]> = contacts.iter().map(|c| c.position(positions)).collect();
        let r_c = body.modes().rows_at(&points);
        check_held(&r_c, &points)?;

        let columns = 3 * contacts.len();
        let unknowns = 3 * positions.len();
        let weights: Vec<&[(u32, f64)]> = contacts.iter().map(Contact::weights).collect();
        let b = DMatrix::from_vec(unknowns, columns, body.compliance_columns(&weights));
        let mut g = DMatrix::zeros(columns, columns);
        for (c, weights) in weights.iter().enumerate() {
            for &(node, weight) in *weights {
                let mut rows = g.rows_mut(3 * c, 3);
                rows += b.rows(3 * node as usize, 3) * weight;
            }
        }
        let w = g.diagonal().sum() / columns as f64;
        g += w * &r_c * r_c.transpose();

        let g = factor_independent(g)?;
        let y = g.solve(&r_c);
        let s = Cholesky::new(r_c.transpose() * &y).ok_or(FemError::Factorisation {
            unknowns: columns,
            reason: "the rigid part of the contacts is not positive definite".to_owned(),
        })?;
        let alpha = s.solve(&y.transpose());
        let lambda = g.solve(&(DMatrix::identity(columns, columns) - &r_c * &alpha));

        let mut map = b * &lambda;
        for (v, &p) in positions.iter().enumerate() {
            let rigid = body.modes().rows(p) * &alpha;
            let mut rows = map.rows_mut(3 * v, 3);
            rows += rigid;
        }
        // Exact where rounding would leave 1 ± a few ulp.
        for (c, weights) in weights.iter().enumerate() {
            if let [(node, _)] = **weights {
                for i in 0..3 {
                    let row = 3 * node as usize + i;
                    map.row_mut(row).fill(0.0);
                    map[(row, 3 * c + i)] = 1.0;
                }
            }
        }
        let symmetric = (&lambda + lambda.transpose()) * 0.5;
        Ok(Self {
            contacts,
            vertex_count: positions.len(),
            displacement_map: map.data.into(),
            force_map: symmetric.data.into(),
        })
    }

    /// The contacts, in the order given.
    #[must_use]
    pub fn contacts(&self) -> &[Contact] {
        &self.contacts
    }

    /// How far some vertex can move when every contact moves by at most one unit: an
    /// upper bound, at most three times the truth (Frobenius norms of the 3 × 3 blocks of
    /// the displacement map, added up).
    ///
    /// Contacts spread over a body give 3 to 7. Large values mean that they hardly hold
    /// it, such as three contacts that nearly lie on one line: the body then swings far
    /// about that line at the slightest motion of a contact, which no one wants to see.
    #[must_use]
    pub fn amplification(&self) -> f64 {
        let (unknowns, columns) = (3 * self.vertex_count, 3 * self.contacts.len());
        (0..self.vertex_count)
            .map(|v| {
                (0..columns / 3)
                    .map(|c| {
                        // Frobenius norm of the 3 × 3 block of vertex and contact.
                        (0..9)
                            .map(|k| {
                                let (row, column) = (3 * v + k % 3, 3 * c + k / 3);
                                self.displacement_map[column * unknowns + row].powi(2)
                            })
                            .sum::<f64>()
                            .sqrt()
                    })
                    .sum::<f64>()
            })
            .fold(0.0, f64::max)
    }

    /// Displacements of all vertices when the contacts are displaced by
    /// `contact_displacements`: the thesis's `Q_u = −K₁₁⁻¹ K₁₂ Q_k`. Contacts at
    /// nodes get exactly what was prescribed, others to rounding.
    ///
    /// | argument | shape | unit |
    /// |---|---|---|
    /// | `contact_displacements` | `#C × 3`, in the order of [`contacts`](Self::contacts) | m |
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

    /// Forces that must act on the contacts to displace them so: `F_u`. They sum to
    /// zero, and so do their moments.
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
        assert_eq!(out.len(), self.contacts.len(), "one force per contact");
        self.multiply(&self.force_map, contact_displacements, out);
    }

    fn multiply(&self, map: &[f64], displacements: &[[f64; 3]], out: &mut [[f64; 3]]) {
        assert_eq!(
            displacements.len(),
            self.contacts.len(),
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

impl Contact {
    fn position(&self, positions: &[[f64; 3]]) -> [f64; 3] {
        let mut point = [0.0; 3];
        for &(node, weight) in &self.weights {
            for (p, x) in point.iter_mut().zip(positions[node as usize]) {
                *p += weight * x;
            }
        }
        point
    }
}

fn check_nodes(contacts: &[Contact], vertex_count: usize) -> Result<(), FemError> {
    for (contact, this @ Contact { weights }) in contacts.iter().enumerate() {
        if let Some(&(node, _)) = weights.iter().find(|&&(n, _)| n as usize >= vertex_count) {
            return Err(FemError::ContactOutOfRange {
                contact,
                node,
                vertex_count,
            });
        }
        if contacts[..contact].contains(this) {
            return Err(FemError::DependentContact { contact });
        }
    }
    Ok(())
}

/// Cholesky of a compliance matrix that refuses nearly dependent columns, which
/// rounding would let through.
fn factor_independent(g: DMatrix<f64>) -> Result<Cholesky<f64, nalgebra::Dyn>, FemError> {
    let diagonal = g.diagonal();
    let columns = g.ncols();
    let Some(factor) = Cholesky::new(g) else {
        return Err(FemError::Factorisation {
            unknowns: columns,
            reason: "the compliance of the contacts is not positive definite; two of them may \
                     be at one place"
                .to_owned(),
        });
    };
    let l = factor.l_dirty();
    match (0..columns).find(|&i| l[(i, i)].powi(2) < DEPENDENT_PIVOT * diagonal[i]) {
        Some(i) => Err(FemError::DependentContact { contact: i / 3 }),
        None => Ok(factor),
    }
}

/// Cholesky succeeding proves nothing here (rounding makes singular matrices
/// look definite), so the rank of the rigid motions at the contacts is tested.
fn check_held(r_c: &DMatrix<f64>, points: &[[f64; 3]]) -> Result<(), FemError> {
    let free = match *points {
        [] => FreeMotion::Everything,
        [_] => FreeMotion::AboutContact(0),
        [first, ..] => {
            let singular = r_c.singular_values();
            if singular.len() == 6 && singular.min() >= FREE_MOTION * singular.max() {
                return Ok(());
            }
            let distance = |p: &[f64; 3]| (0..3).map(|i| (p[i] - first[i]).powi(2)).sum::<f64>();
            let mut farthest = 1;
            for (contact, point) in points.iter().enumerate() {
                if distance(point) > distance(&points[farthest]) {
                    farthest = contact;
                }
            }
            FreeMotion::AboutLine(0, farthest)
        }
    };
    Err(FemError::UnderConstrained { free })
}
