//! Where does a fingertip press on the surface?

use glam::DVec3;

use crate::closest::Found;
use crate::triangle::unit_normal;
use crate::{Sphere, SphereTree};

/// Where a sphere touches the surface, or nearly does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// Id of the triangle, the lowest where several are nearest.
    pub triangle: u32,
    /// Weights of the contact point for the three corners: none negative,
    /// sum 1.
    pub barycentric: [f64; 3],
    /// The surface point nearest to the centre of the sphere.
    pub point: [f64; 3],
    /// Unit normal of the triangle by the right-hand rule: outward, if
    /// triangles are counter-clockwise seen from outside.
    ///
    /// A triangle whose area is zero, or lost in rounding, has no normal. The
    /// direction from the contact point to the centre of the sphere takes its
    /// place, or +z if those coincide.
    pub normal: [f64; 3],
    /// Radius minus distance: positive where the sphere reaches through the
    /// surface, negative for a gap within the margin.
    ///
    /// The distance is unsigned, so the depth never exceeds the radius: once
    /// the centre has passed through the surface, it decreases again.
    pub depth: f64,
}

impl SphereTree {
    /// Finds the contact of a sphere with the surface: the surface point
    /// nearest to its centre, if it is within `radius + margin`.
    ///
    /// A margin announces contacts before they happen; 0 asks for touching or
    /// deeper. `positions` are those the tree was last built or refitted with.
    /// No allocation.
    ///
    /// The answer is `None` for an empty tree, if nothing is within reach, and
    /// if `margin` is NaN.
    ///
    /// # Panics
    ///
    /// If the number of positions differs from the number of vertices the tree
    /// was built over.
    ///
    /// # Example
    ///
    /// ```
    /// use spheretree::{Mesh, Sphere, SphereTree};
    ///
    /// let positions = [[0., 0., 0.], [4., 0., 0.], [0., 4., 0.]];
    /// let tree = SphereTree::build(Mesh::new(&positions, &[[0, 1, 2]])?);
    /// let tip = Sphere::new([1.0, 1.0, 0.75], 1.0)?;
    /// let contact = tree.sphere_contact(&positions, &tip, 0.0).expect("they touch");
    /// assert_eq!(contact.point, [1.0, 1.0, 0.0]);
    /// assert_eq!(contact.depth, 0.25);
    ///
    /// let above = Sphere::new([1.0, 1.0, 1.25], 1.0)?;
    /// assert!(tree.sphere_contact(&positions, &above, 0.0).is_none());
    /// let near = tree.sphere_contact(&positions, &above, 0.5).expect("within the margin");
    /// assert_eq!(near.depth, -0.25);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn sphere_contact(
        &self,
        positions: &[[f64; 3]],
        sphere: &Sphere,
        margin: f64,
    ) -> Option<Contact> {
        let reach = sphere.radius() + margin;
        let Found { closest, slot } = self.find_closest(positions, sphere.center(), reach)?;
        let corners = self.corners(positions, slot).map(DVec3::from);
        let to_center = sphere.center_vec() - DVec3::from(closest.point);
        let normal = unit_normal(corners)
            .or_else(|| to_center.try_normalize())
            .unwrap_or(DVec3::Z);
        Some(Contact {
            triangle: closest.triangle,
            barycentric: closest.barycentric,
            point: closest.point,
            normal: normal.to_array(),
            depth: sphere.radius() - closest.distance,
        })
    }
}
