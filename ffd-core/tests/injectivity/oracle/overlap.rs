//! Proofs that two different points have the same image.

use super::bernstein::{Bernstein, indices, linear};
use super::{Oracle, determinant, exact};
use dashu_ratio::RBig;
use ffd_core::Place;

/// The Bernstein coefficients over [`low`, `high`] of a polynomial that is given by those
/// over [0, 1]: number k is its polar form at n − k times `low` and k times `high`.
fn restricted(coefficients: &[RBig], low: &RBig, high: &RBig) -> Vec<RBig> {
    let n = coefficients.len() - 1;
    (0..=n)
        .map(|k| {
            let mut line = coefficients.to_vec();
            for step in 0..n {
                let t = if step < k { high } else { low };
                for i in 0..n - step {
                    line[i] = &line[i] + t * (&line[i + 1] - &line[i]);
                }
            }
            line[0].clone()
        })
        .collect()
}

impl<const D: usize> Oracle<'_, D> {
    /// F over a part of a cell, from `low` to `high` along each axis, in Bernstein form.
    fn image_of_box(
        &self,
        cell: [usize; D],
        low: &[RBig; D],
        high: &[RBig; D],
    ) -> [Bernstein<RBig, D>; D] {
        let count = self.degree.map(|n| n + 1);
        let unit = self
            .basis_unit
            .iter()
            .fold(super::power_of_two(self.exponent), |u, unit| {
                u / RBig::from(unit.clone())
            });
        let bezier = self.bezier(cell);
        let corner = self.position(cell, [0.0; D]);
        let frame = self.frame();
        std::array::from_fn(|c| {
            // x itself is linear, so its Bernstein coefficients are its values at k / n.
            let mut coefficients: Vec<RBig> = indices(count)
                .map(|index| {
                    let displacement = &bezier[c].coefficients[linear(index, count)];
                    (0..D).fold(
                        &corner[c] + RBig::from(displacement.clone()) * &unit,
                        |sum, i| {
                            sum + &frame[c][i] * RBig::from(index[i]) / RBig::from(self.degree[i])
                        },
                    )
                })
                .collect();
            for axis in 0..D {
                for mut index in indices(count).filter(|index| index[axis] == 0) {
                    let places: Vec<_> = (0..count[axis])
                        .map(|i| {
                            index[axis] = i;
                            linear(index, count)
                        })
                        .collect();
                    let line: Vec<_> = places.iter().map(|&i| coefficients[i].clone()).collect();
                    let part = restricted(&line, &low[axis], &high[axis]);
                    for (place, value) in places.into_iter().zip(part) {
                        coefficients[place] = value;
                    }
                }
            }
            Bernstein {
                degree: self.degree,
                coefficients,
            }
        })
    }

    /// Checks that `point` and some other point of the box `other` ± `radius` in its cell
    /// have the same image, and that `point` is not in that box.
    ///
    /// With an approximate inverse Y of the Jacobian, q ↦ q − Y (F(q) − F(p)) maps the box
    /// into itself, as its Bernstein coefficients show; so it has a fixed point (Brouwer),
    /// at which F(q) = F(p), since Y is invertible.
    pub(crate) fn prove_overlap(
        &self,
        point: &Place<D>,
        other: &Place<D>,
        radius: f64,
    ) -> Result<(), String> {
        let radius = exact(radius);
        let in_domain = |place: &Place<D>| {
            (0..D).all(|i| place.cell[i] < self.cells[i] && (0.0..=1.0).contains(&place.t[i]))
        };
        if !in_domain(point) || !in_domain(other) {
            return Err("a point is outside its cell".into());
        }
        let global = |place: &Place<D>, i: usize| RBig::from(place.cell[i]) + exact(place.t[i]);
        let apart = |i: usize| {
            let difference = global(point, i) - global(other, i);
            difference > radius || -difference > radius
        };
        if !(0..D).any(apart) {
            return Err("the point is in the box of the other".into());
        }

        // The part of the box that is in the cell.
        let low: [RBig; D] = std::array::from_fn(|i| (exact(other.t[i]) - &radius).max(RBig::ZERO));
        let high: [RBig; D] = std::array::from_fn(|i| (exact(other.t[i]) + &radius).min(RBig::ONE));
        let target = self.image(point.cell, point.t);
        let image = self.image_of_box(other.cell, &low, &high);
        let inverse = self.rounded_inverse(other)?;

        let count = self.degree.map(|n| n + 1);
        for index in indices(count) {
            for i in 0..D {
                let along = RBig::from(index[i]) / RBig::from(self.degree[i]);
                let mut next = &low[i] + (&high[i] - &low[i]) * along;
                for c in 0..D {
                    let beyond = &image[c].coefficients[linear(index, count)] - &target[c];
                    next -= &inverse[i][c] * beyond;
                }
                if next < low[i] || next > high[i] {
                    let [next, low, high] = [&next, &low[i], &high[i]].map(|x| x.to_f64_fast());
                    return Err(format!(
                        "no proof: {next} is not within {low} and {high} along axis {i}"
                    ));
                }
            }
        }
        Ok(())
    }

    /// The inverse of ∂F/∂t at a place, every entry rounded to a few more digits than
    /// needed; not singular.
    fn rounded_inverse(&self, place: &Place<D>) -> Result<[[RBig; D]; D], String> {
        let matrix = self.matrix_at(place.cell, place.t);
        let volume = determinant(&matrix);
        if volume.is_zero() {
            return Err("det J is zero where the other point is".into());
        }
        let inverse: [[RBig; D]; D] = std::array::from_fn(|r| {
            std::array::from_fn(|c| {
                // Cramer's rule for column c of the unit matrix.
                let mut replaced = matrix.clone();
                for row in 0..D {
                    replaced[row][r] = RBig::from(u8::from(row == c));
                }
                exact((determinant(&replaced) / &volume).to_f64_fast())
            })
        });
        if determinant(&inverse).is_zero() {
            return Err("the Jacobian is too nearly singular to invert in doubles".into());
        }
        Ok(inverse)
    }
}
