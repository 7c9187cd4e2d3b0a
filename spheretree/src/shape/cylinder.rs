//! Flat-capped cylinders: models of finger segments.
//!
//! Both tests work in the frame of the cylinder, where a point has an axial
//! coordinate `z` between the caps at 0 and `h`, and a radial vector normal to
//! the axis.
//!
//! [Ma98] tests a sphere against a cylinder by cases (equations 4.7 to 4.9):
//! between the cap planes it compares the distance `ρ` from the axis with
//! `r_c + r_s`; beyond a cap plane by `Δz ≤ r_s` it compares `ρ` with
//! `r_c + √(r_s² − Δz²)`. With `dr = max(ρ − r_c, 0)` and
//! `dz = max(−z, z − h, 0)`, the distance from the solid cylinder is
//! `√(dr² + dz²)`, and all cases become `dr² + dz² ≤ r_s²`.

use glam::{DVec2, DVec3};

use super::sphere::{check_point, check_radius};
use super::{Probe, SLACK, Sphere};
use crate::ShapeError;

/// A solid cylinder with flat caps.
///
/// Radius zero, a line segment, is allowed. So is length zero: the cylinder is
/// then a disc. Coinciding ends name no direction, so that disc is taken to
/// lie normal to the z axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cylinder {
    start: DVec3,
    end: DVec3,
    radius: f64,
    length: f64,
    /// Orthonormal; the last vector points from `start` to `end`.
    frame: [DVec3; 3],
}

/// A point in the frame of a cylinder.
#[derive(Clone, Copy, Default)]
struct Local {
    radial: DVec2,
    axial: f64,
}

impl Cylinder {
    /// A cylinder whose caps are centred on `start` and `end`.
    ///
    /// # Errors
    ///
    /// * [`ShapeError::PointOutOfRange`] if an end is not finite or exceeds
    ///   [`MAX_COORDINATE`](crate::MAX_COORDINATE).
    /// * [`ShapeError::RadiusOutOfRange`] if `radius` is NaN, negative, or
    ///   exceeds [`MAX_COORDINATE`](crate::MAX_COORDINATE).
    ///
    /// # Example
    ///
    /// ```
    /// use spheretree::{Cylinder, Probe};
    ///
    /// let segment = Cylinder::new([0.0, 0.0, 0.0], [0.0, 0.0, 4.0], 1.0)?;
    /// // Above the cap, where a capsule would reach: a flat cylinder does not.
    /// assert!(!segment.intersects_triangle([[0., 0., 4.5], [3., 0., 4.5], [0., 3., 4.5]]));
    /// // Across the middle, with all three corners outside.
    /// assert!(segment.intersects_triangle([[-3., -3., 2.], [3., -3., 2.], [0., 5., 2.]]));
    /// # Ok::<(), spheretree::ShapeError>(())
    /// ```
    pub fn new(start: [f64; 3], end: [f64; 3], radius: f64) -> Result<Self, ShapeError> {
        check_point(start)?;
        check_point(end)?;
        check_radius(radius)?;
        let (start, end) = (DVec3::from(start), DVec3::from(end));
        let axis = end - start;
        let length = axis.length();
        let frame = if length > 0.0 {
            let direction = axis / length;
            let (x, y) = direction.any_orthonormal_pair();
            [x, y, direction]
        } else {
            DVec3::AXES
        };
        Ok(Self {
            start,
            end,
            radius,
            length,
            frame,
        })
    }

    /// Centre of the first cap.
    pub fn start(&self) -> [f64; 3] {
        self.start.to_array()
    }

    /// Centre of the second cap.
    pub fn end(&self) -> [f64; 3] {
        self.end.to_array()
    }

    /// The radius.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    fn local(&self, point: DVec3) -> Local {
        let offset = point - self.start;
        let [x, y, z] = self.frame.map(|axis| offset.dot(axis));
        Local {
            radial: DVec2::new(x, y),
            axial: z,
        }
    }
}

impl Probe for Cylinder {
    /// Compares the distance of the sphere's centre from the solid cylinder
    /// with the sphere's radius.
    fn overlaps_sphere(&self, sphere: &Sphere) -> bool {
        let Local { radial, axial } = self.local(sphere.center_vec());
        let dr = (radial.length() - self.radius).max(0.0);
        let dz = (-axial).max(axial - self.length).max(0.0);
        let reach = sphere.radius() + SLACK * (sphere.radius() + self.radius + self.length);
        dr * dr + dz * dz <= reach * reach
    }

    /// Clips the triangle to the slab between the caps, and compares the
    /// distance of what is left from the axis with the radius.
    fn intersects_triangle(&self, corners: [[f64; 3]; 3]) -> bool {
        let corners = corners.map(|corner| self.local(corner.into()));
        let mut polygon = Polygon::default();
        corners.into_iter().for_each(|corner| polygon.push(corner));
        let slab = polygon.clip(0.0, 1.0).clip(self.length, -1.0);
        slab.meets_disc(self.radius)
    }
}

/// A convex polygon: what one or two half-spaces leave of a triangle.
#[derive(Default)]
struct Polygon {
    vertices: [Local; 5],
    len: usize,
}

impl Polygon {
    fn push(&mut self, vertex: Local) {
        self.vertices[self.len] = vertex;
        self.len += 1;
    }

    /// Each vertex with its successor.
    fn edges(&self) -> impl Iterator<Item = (Local, Local)> {
        let vertices = &self.vertices[..self.len];
        let successors = vertices.iter().cycle().skip(1);
        vertices.iter().copied().zip(successors.copied())
    }

    /// The part where `side · (axial − bound) ≥ 0` (Sutherland–Hodgman).
    ///
    /// A vertex on the plane may come out twice; [`Self::meets_disc`] copes.
    fn clip(&self, bound: f64, side: f64) -> Self {
        let inside = |vertex: Local| side * (vertex.axial - bound) >= 0.0;
        let mut clipped = Self::default();
        for (from, to) in self.edges() {
            if inside(from) {
                clipped.push(from);
            }
            if inside(from) != inside(to) {
                let t = (bound - from.axial) / (to.axial - from.axial);
                clipped.push(Local {
                    radial: from.radial + t * (to.radial - from.radial),
                    axial: bound,
                });
            }
        }
        clipped
    }

    /// Whether the projection along the axis meets the disc around the origin.
    fn meets_disc(&self, radius: f64) -> bool {
        // The origin is inside if a ray from it along x crosses the outline an
        // odd number of times. Repeated and collinear vertices, which upset a
        // test by signs of consecutive corners, contribute in pairs or not at
        // all.
        let mut inside = false;
        for (from, to) in self.edges() {
            let (p, q) = (from.radial, to.radial);
            if distance_from_origin_squared(p, q) <= radius * radius {
                return true;
            }
            if (p.y > 0.0) != (q.y > 0.0) && (p.perp_dot(q) > 0.0) == (q.y > p.y) {
                inside = !inside;
            }
        }
        inside
    }
}

/// Squared distance of the segment from `p` to `q` from the origin.
fn distance_from_origin_squared(p: DVec2, q: DVec2) -> f64 {
    let edge = q - p;
    let along = -p.dot(edge);
    let length_squared = edge.length_squared();
    if along <= 0.0 {
        p.length_squared()
    } else if along >= length_squared {
        q.length_squared()
    } else {
        (p + along / length_squared * edge).length_squared()
    }
}
