//! Directions and normals of surfaces follow the deformation.

use crate::matrix::{cofactors, multiply};

/// The image `J v` of a tangent or any other direction, not normalised.
///
/// # Example
///
/// ```
/// use ffd_core::transform_tangent;
///
/// let shear = [[1.0, 0.5], [0.0, 1.0]];
/// assert_eq!(transform_tangent(&shear, [0.0, 2.0]), [1.0, 2.0]);
/// ```
#[must_use]
pub fn transform_tangent<const D: usize>(jacobian: &[[f64; D]; D], tangent: [f64; D]) -> [f64; D] {
    multiply(jacobian, tangent)
}

/// The unit normal of the deformed surface where a surface with the given normal was.
///
/// It is perpendicular to the images of all tangents: `J⁻ᵀ n`, scaled to length 1 (zero
/// if J maps the tangents to a line). Computed with cofactors, `det J · J⁻ᵀ`, so that a
/// singular Jacobian does no harm and a surface that is turned inside out keeps the
/// normals that the winding of its triangles gives it.
///
/// # Example
///
/// ```
/// use ffd_core::transform_normal;
///
/// // Twice as wide: the normal of the diagonal becomes steeper.
/// let stretch = [[2.0, 0.0], [0.0, 1.0]];
/// let [x, y] = transform_normal(&stretch, [1.0, 1.0]);
/// assert!((y / x - 2.0).abs() < 1e-15 && (x * x + y * y - 1.0).abs() < 1e-15);
/// ```
#[must_use]
pub fn transform_normal<const D: usize>(jacobian: &[[f64; D]; D], normal: [f64; D]) -> [f64; D] {
    // Only directions count: scaled, so that no product overflows or vanishes.
    let largest = |v: &[f64]| v.iter().fold(0.0_f64, |m, c| m.max(c.abs()));
    let unit = largest(jacobian.as_flattened());
    let jacobian = jacobian.map(|row| row.map(|x| x / unit));
    let longest = largest(&normal);
    let image = multiply(&cofactors(&jacobian), normal.map(|x| x / longest));
    let longest = largest(&image);
    if longest > 0.0 {
        let scaled = image.map(|c| c / longest);
        let length = scaled.iter().map(|c| c * c).sum::<f64>().sqrt();
        scaled.map(|c| c / length)
    } else {
        [0.0; D]
    }
}
