//! Spheres: nodes of the tree and models of fingertips.

use glam::DVec3;

use super::{Probe, SLACK};
use crate::ShapeError;
use crate::mesh::{MAX_COORDINATE, in_range};
use crate::triangle::closest_on_triangle;

/// A closed ball. Radius zero, a single point, is allowed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sphere {
    center: DVec3,
    radius: f64,
}

impl Sphere {
    /// A sphere around `center`.
    ///
    /// # Errors
    ///
    /// * [`ShapeError::PointOutOfRange`] if `center` is not finite or exceeds
    ///   [`MAX_COORDINATE`].
    /// * [`ShapeError::RadiusOutOfRange`] if `radius` is NaN, negative, or
    ///   exceeds [`MAX_COORDINATE`].
    ///
    /// # Example
    ///
    /// ```
    /// use spheretree::{Probe, Sphere};
    ///
    /// let tip = Sphere::new([0.0, 0.0, 2.0], 1.5)?;
    /// assert!(tip.overlaps_sphere(&Sphere::new([0.0, 0.0, 0.0], 0.5)?)); // they touch
    /// assert!(!tip.overlaps_sphere(&Sphere::new([0.0, 0.0, 0.0], 0.4)?));
    /// # Ok::<(), spheretree::ShapeError>(())
    /// ```
    pub fn new(center: [f64; 3], radius: f64) -> Result<Self, ShapeError> {
        check_point(center)?;
        check_radius(radius)?;
        Ok(Self::from_parts(center.into(), radius))
    }

    /// A sphere known to be in range.
    pub(crate) fn from_parts(center: DVec3, radius: f64) -> Self {
        Self { center, radius }
    }

    /// The centre.
    pub fn center(&self) -> [f64; 3] {
        self.center.to_array()
    }

    /// The radius.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    pub(crate) fn center_vec(&self) -> DVec3 {
        self.center
    }

    /// A lower bound of the distance that [`closest_on_triangle`] can compute
    /// from `point` to a triangle whose corners this sphere covers.
    pub(crate) fn distance_bound(&self, point: DVec3) -> f64 {
        let to_center = self.center.distance(point);
        (to_center - self.radius - SLACK * (to_center + self.radius)).max(0.0)
    }
}

impl Probe for Sphere {
    /// Compares the distance of the centres with the sum of the radii.
    fn overlaps_sphere(&self, sphere: &Sphere) -> bool {
        let reach = (self.radius + sphere.radius) * (1.0 + SLACK);
        self.center.distance_squared(sphere.center) <= reach * reach
    }

    /// Compares the distance of the nearest point of the triangle with the
    /// radius.
    fn intersects_triangle(&self, corners: [[f64; 3]; 3]) -> bool {
        let nearest = closest_on_triangle(self.center, corners.map(DVec3::from));
        nearest.distance_squared <= self.radius * self.radius
    }
}

pub(super) fn check_point(point: [f64; 3]) -> Result<(), ShapeError> {
    if in_range(point) {
        Ok(())
    } else {
        Err(ShapeError::PointOutOfRange { point })
    }
}

pub(super) fn check_radius(radius: f64) -> Result<(), ShapeError> {
    if (0.0..=MAX_COORDINATE).contains(&radius) {
        Ok(())
    } else {
        Err(ShapeError::RadiusOutOfRange { radius })
    }
}
