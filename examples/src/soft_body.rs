//! The object as it is held: its elastic body, its deformed surface, its tree.

use std::sync::Arc;

use fem_tet::{
    Contact, ContactSet, ElasticBody, FemError, io::ObjectFile, largest_safe_fraction,
    surface_triangles, total_volume,
};
use spheretree::{Mesh, MeshError, SphereTree};

use crate::{scene::Object, touch::Surface};

/// Share of its rest volume that every element keeps, whatever the fingers do.
/// Linear elasticity means little beyond, and keep shape needs positive volumes.
pub const LEAST_VOLUME_RATIO: f64 = 0.1;

/// A deformable object.
#[derive(Debug, Clone)]
pub struct SoftBody {
    name: String,
    /// Shared, so that a copy of the object costs no factorisation.
    body: Arc<ElasticBody>,
    display: Vec<[u32; 3]>,
    triangles: Vec<[u32; 3]>,
    contacts: Option<ContactSet>,
    displacements: Vec<[f64; 3]>,
    positions: Vec<[f64; 3]>,
    tree: SphereTree,
}

/// Why an object cannot be squeezed.
#[derive(Debug, thiserror::Error)]
pub enum SoftBodyError {
    /// Its elasticity.
    #[error(transparent)]
    Fem(#[from] FemError),
    /// Its surface.
    #[error(transparent)]
    Surface(#[from] MeshError),
}

impl SoftBody {
    /// Factors the stiffness of an object and builds the tree over its surface.
    ///
    /// # Errors
    ///
    /// [`SoftBodyError`] if the mesh falls apart or is a mechanism.
    pub fn new(object: Object) -> Result<Self, SoftBodyError> {
        let ObjectFile { mesh, display } = object.file;
        let triangles = surface_triangles(mesh.tets());
        let positions = mesh.positions().to_vec();
        let tree = SphereTree::build(Mesh::new(&positions, &triangles)?);
        Ok(Self {
            name: object.name,
            body: Arc::new(ElasticBody::new(mesh, object.material)?),
            display,
            triangles,
            contacts: None,
            displacements: vec![[0.0; 3]; positions.len()],
            positions,
            tree,
        })
    }

    /// Name of the object.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The elastic body: rest shape and material.
    #[must_use]
    pub fn body(&self) -> &ElasticBody {
        &self.body
    }

    /// Deformed positions, `#V × 3`, in the object's frame.
    #[must_use]
    pub fn positions(&self) -> &[[f64; 3]] {
        &self.positions
    }

    /// Displacements from the rest shape, `#V × 3`.
    #[must_use]
    pub fn displacements(&self) -> &[[f64; 3]] {
        &self.displacements
    }

    /// Triangles to draw.
    #[must_use]
    pub fn display(&self) -> &[[u32; 3]] {
        &self.display
    }

    /// Triangles of the surface that fingers touch.
    #[must_use]
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The surface as it stands.
    #[must_use]
    pub fn surface(&self) -> Surface<'_> {
        Surface {
            tree: &self.tree,
            positions: &self.positions,
        }
    }

    /// The object as it stands, deformed, ready to be saved.
    ///
    /// # Errors
    ///
    /// [`fem_tet::MeshError`] if an element is flat, which [`Self::displace`]
    /// prevents.
    pub fn to_file(&self) -> Result<ObjectFile, fem_tet::MeshError> {
        Ok(ObjectFile {
            mesh: fem_tet::TetMesh::new(self.positions.clone(), self.body.mesh().tets().to_vec())?,
            display: self.display.clone(),
        })
    }

    /// Condenses the body to these contacts.
    ///
    /// # Errors
    ///
    /// [`FemError`] if the contacts do not hold the body; the body then keeps its
    /// former contacts.
    pub fn hold(&mut self, contacts: Vec<Contact>) -> Result<(), FemError> {
        self.contacts = Some(ContactSet::new(&self.body, contacts)?);
        Ok(())
    }

    /// Displaces the contacts, and with them everything. Returns the fraction of
    /// the displacements that was carried out: less than 1 if an element would
    /// have lost more than it may ([`LEAST_VOLUME_RATIO`]).
    ///
    /// # Panics
    ///
    /// If no contacts are held or their number differs.
    pub fn displace(&mut self, contact_displacements: &[[f64; 3]]) -> f64 {
        let contacts = self.contacts.as_ref().expect("contacts are held");
        contacts.displacements_into(contact_displacements, &mut self.displacements);
        let rest = self.body.mesh();
        let fraction = largest_safe_fraction(
            rest.positions(),
            &self.displacements,
            rest.tets(),
            LEAST_VOLUME_RATIO,
        );
        for u in self.displacements.as_flattened_mut() {
            *u *= fraction;
        }
        for ((x, rest), u) in self
            .positions
            .iter_mut()
            .zip(rest.positions())
            .zip(&self.displacements)
        {
            *x = [rest[0] + u[0], rest[1] + u[1], rest[2] + u[2]];
        }
        fraction
    }

    /// Brings the tree up to date with the deformed surface.
    ///
    /// # Panics
    ///
    /// Never: positions stay finite.
    pub fn refit(&mut self) {
        self.tree
            .refit(&self.positions)
            .expect("deformed positions are finite");
    }

    /// Lets go: the body springs back to its rest shape.
    pub fn relax(&mut self) {
        self.contacts = None;
        self.displacements.fill([0.0; 3]);
        self.positions.copy_from_slice(self.body.mesh().positions());
        self.refit();
    }

    /// Keep shape ([Ma98] section 6.1.2): the deformed shape becomes the rest shape,
    /// free of stress, and the tree is rebuilt.
    ///
    /// # Errors
    ///
    /// [`SoftBodyError`] if the new shape cannot be factored; nothing is changed then.
    pub fn keep_shape(&mut self) -> Result<(), SoftBodyError> {
        self.body = Arc::new(self.body.keep_shape(&self.displacements)?);
        self.relax();
        self.tree
            .rebuild(Mesh::new(&self.positions, &self.triangles)?);
        Ok(())
    }

    /// Volume as it stands, cubic metres.
    #[must_use]
    pub fn volume_m3(&self) -> f64 {
        total_volume(&self.positions, self.body.mesh().tets())
    }

    /// Largest displacement from the rest shape, metres.
    #[must_use]
    pub fn largest_displacement_m(&self) -> f64 {
        self.displacements
            .iter()
            .map(|u| u.iter().map(|c| c * c).sum::<f64>())
            .fold(0.0, f64::max)
            .sqrt()
    }
}
