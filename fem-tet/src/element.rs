//! Stiffness of one linear tetrahedron.

use glam::DVec3;

use crate::Material;

/// The 4 × 4 blocks, each 3 × 3, of an element's stiffness matrix.
pub(crate) type ElementStiffness = [[[[f64; 3]; 3]; 4]; 4];

/// `Kᵉ = ∫ Bᵀ D B dV = V Bᵀ D B` (\[Ma98\] eqs. 3.15, 3.30, 3.32), newton per metre.
///
/// With constant shape-function gradients `gₐ`, block (a, b) of the product is
/// `V (λ gₐ g_bᵀ + μ g_b gₐᵀ + μ (gₐ·g_b) I)`, which needs neither `B` nor `D`.
/// `x` must have positive volume.
pub(crate) fn stiffness(x: &[DVec3; 4], material: &Material) -> ElementStiffness {
    let (lambda, mu) = material.lame();
    let (gradients, volume) = gradients(x);
    let mut k = [[[[0.0; 3]; 3]; 4]; 4];
    for a in 0..4 {
        for b in 0..4 {
            let (ga, gb) = (gradients[a].to_array(), gradients[b].to_array());
            let dot = gradients[a].dot(gradients[b]);
            for i in 0..3 {
                for j in 0..3 {
                    let identity = if i == j { dot } else { 0.0 };
                    k[a][b][i][j] =
                        volume * (lambda * ga[i] * gb[j] + mu * (gb[i] * ga[j] + identity));
                }
            }
        }
    }
    k
}

/// Gradients of the four barycentric shape functions (1/m) and the volume (m³).
fn gradients(x: &[DVec3; 4]) -> ([DVec3; 4], f64) {
    let (e1, e2, e3) = (x[1] - x[0], x[2] - x[0], x[3] - x[0]);
    let six_volume = e1.dot(e2.cross(e3));
    let g1 = e2.cross(e3) / six_volume;
    let g2 = e3.cross(e1) / six_volume;
    let g3 = e1.cross(e2) / six_volume;
    ([-(g1 + g2 + g3), g1, g2, g3], six_volume / 6.0)
}

#[cfg(test)]
mod tests {
    use nalgebra::SMatrix;

    use super::*;

    /// `V Bᵀ D B` with the thesis's matrices written out (\[Ma98\] eqs. 3.15, 3.30),
    /// an independent formulation.
    fn stiffness_by_matrices(x: &[DVec3; 4], material: &Material) -> SMatrix<f64, 12, 12> {
        let nu = material.poissons_ratio();
        let factor = material.youngs_modulus_pa() / ((1.0 + nu) * (1.0 - 2.0 * nu));
        let mut d = SMatrix::<f64, 6, 6>::zeros();
        for i in 0..3 {
            for j in 0..3 {
                d[(i, j)] = factor * if i == j { 1.0 - nu } else { nu };
            }
            d[(i + 3, i + 3)] = factor * (0.5 - nu);
        }
        // Gradients from the inverse of the 4 × 4 matrix of (1, x, y, z) rows.
        let vandermonde =
            SMatrix::<f64, 4, 4>::from_fn(|r, c| if c == 0 { 1.0 } else { x[r].to_array()[c - 1] });
        let volume = vandermonde.determinant() / 6.0;
        let inverse = vandermonde.try_inverse().expect("not flat");
        let mut b = SMatrix::<f64, 6, 12>::zeros();
        for a in 0..4 {
            let (gx, gy, gz) = (inverse[(1, a)], inverse[(2, a)], inverse[(3, a)]);
            let c = 3 * a;
            b[(0, c)] = gx;
            b[(1, c + 1)] = gy;
            b[(2, c + 2)] = gz;
            (b[(3, c)], b[(3, c + 1)]) = (gy, gx);
            (b[(4, c + 1)], b[(4, c + 2)]) = (gz, gy);
            (b[(5, c)], b[(5, c + 2)]) = (gz, gx);
        }
        b.transpose() * d * b * volume
    }

    #[test]
    fn blocks_equal_the_matrix_product() {
        let x = [
            DVec3::new(0.1, -0.2, 0.3),
            DVec3::new(1.2, 0.1, 0.2),
            DVec3::new(0.3, 1.5, -0.1),
            DVec3::new(-0.2, 0.4, 1.1),
        ];
        let material = Material::new(3.0, 0.37).expect("in range");
        let k = stiffness(&x, &material);
        let expected = stiffness_by_matrices(&x, &material);
        for r in 0..12 {
            for c in 0..12 {
                let got = k[r / 3][c / 3][r % 3][c % 3];
                // Entries are of order 1; the 4 × 4 inverse costs a few digits.
                assert!((got - expected[(r, c)]).abs() < 1e-13, "({r}, {c})");
            }
        }
    }
}
