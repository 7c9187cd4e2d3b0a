//! Rigid motions of a free body.

use glam::DVec3;
use nalgebra::{DMatrix, SMatrix, SVector};

/// Basis of the six infinitesimal rigid motions: three translations and three
/// rotations about the centroid, the rotations divided by the root-mean-square
/// distance from it, so that all six are of one size.
#[derive(Debug, Clone)]
pub(crate) struct RigidModes {
    centroid: DVec3,
    inverse_radius: f64,
}

impl RigidModes {
    pub(crate) fn new(positions: &[[f64; 3]]) -> Self {
        let count = positions.len() as f64;
        let points = || positions.iter().map(|&p| DVec3::from_array(p));
        let centroid = points().sum::<DVec3>() / count;
        let mean_square = points().map(|p| p.distance_squared(centroid)).sum::<f64>() / count;
        Self {
            centroid,
            inverse_radius: mean_square.sqrt().recip(),
        }
    }

    /// The three rows of `R` that belong to a vertex at `position`: component `i`
    /// of its displacement under each of the six motions.
    pub(crate) fn rows(&self, position: [f64; 3]) -> SMatrix<f64, 3, 6> {
        let r = (DVec3::from_array(position) - self.centroid) * self.inverse_radius;
        // Columns 3 to 5: e_x × r, e_y × r, e_z × r.
        SMatrix::<f64, 3, 6>::from_row_slice(&[
            1.0, 0.0, 0.0, 0.0, r.z, -r.y, //
            0.0, 1.0, 0.0, -r.z, 0.0, r.x, //
            0.0, 0.0, 1.0, r.y, -r.x, 0.0,
        ])
    }

    /// Six unknowns that, held at zero, stop every rigid motion, chosen by
    /// pivoted Gram–Schmidt on the rows of `R` so that the 6 × 6 matrix they
    /// pick is well conditioned.
    pub(crate) fn isostatic_supports(&self, positions: &[[f64; 3]]) -> [usize; 6] {
        let mut rows: Vec<SVector<f64, 6>> = positions
            .iter()
            .flat_map(|&p| {
                let m = self.rows(p);
                [0, 1, 2].map(|i| m.row(i).transpose())
            })
            .collect();
        std::array::from_fn(|_| {
            let (pivot, row) = rows.iter().enumerate().fold(
                (0, SVector::zeros()),
                |best: (usize, SVector<f64, 6>), (i, row)| {
                    if row.norm_squared() > best.1.norm_squared() {
                        (i, *row)
                    } else {
                        best
                    }
                },
            );
            let direction = row.normalize();
            for row in &mut rows {
                *row -= direction * direction.dot(row);
            }
            pivot
        })
    }

    /// `R_C`, the rows of `R` at the given points, `3 #C × 6`. `R` is affine, so
    /// its rows at a weighted mean of vertices are those of the mean point.
    pub(crate) fn rows_at(&self, points: &[[f64; 3]]) -> DMatrix<f64> {
        let mut r = DMatrix::zeros(3 * points.len(), 6);
        for (c, &p) in points.iter().enumerate() {
            r.fixed_view_mut::<3, 6>(3 * c, 0).copy_from(&self.rows(p));
        }
        r
    }
}
