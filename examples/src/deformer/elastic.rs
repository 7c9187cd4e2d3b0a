//! An elastic solid.

use std::sync::Arc;

use fem_tet::{
    Contact, ContactSet, ElasticBody, FemError, Material, TetMesh, largest_safe_fraction,
};

use super::{HoldError, Step};

/// Contacts that move some vertex farther than this, for a unit of motion of each, do
/// not count as holding the body: fingertips tremble. Five fingertips on the built
/// objects give 4 to 7, fewer on their way to letting go 10 to 16, three nearly in a
/// line 20 and more.
const MOST_AMPLIFICATION: f64 = 15.0;

/// An elastic body condensed to the contacts that hold it.
#[derive(Debug, Clone)]
pub struct Elastic {
    /// Shared, so that a copy of the object costs no factorisation.
    body: Arc<ElasticBody>,
    contacts: Option<ContactSet>,
}

impl Elastic {
    /// Factors the stiffness of a shape.
    ///
    /// # Errors
    ///
    /// [`FemError`] if the mesh falls apart or is a mechanism.
    pub fn new(mesh: TetMesh, material: Material) -> Result<Self, FemError> {
        Ok(Self {
            body: Arc::new(ElasticBody::new(mesh, material)?),
            contacts: None,
        })
    }

    /// The elastic body: rest shape and material.
    #[must_use]
    pub fn body(&self) -> &ElasticBody {
        &self.body
    }

    pub(super) fn rest(&self) -> &TetMesh {
        self.body.mesh()
    }

    pub(super) fn hold(&mut self, contacts: Vec<Contact>) -> Result<(), HoldError> {
        self.contacts = None;
        let set = ContactSet::new(&self.body, contacts)?;
        let amplification = set.amplification();
        if amplification > MOST_AMPLIFICATION {
            return Err(HoldError::Wobbly { amplification });
        }
        self.contacts = Some(set);
        Ok(())
    }

    pub(super) fn let_go(&mut self) {
        self.contacts = None;
    }

    pub(super) fn displace_into(
        &self,
        contact_displacements: &[[f64; 3]],
        least_volume_ratio: f64,
        out: &mut [[f64; 3]],
    ) -> Step {
        let contacts = self.contacts.as_ref().expect("contacts are held");
        contacts.displacements_into(contact_displacements, out);
        let rest = self.rest();
        let fraction =
            largest_safe_fraction(rest.positions(), out, rest.tets(), least_volume_ratio);
        for u in out.as_flattened_mut() {
            *u *= fraction;
        }
        Step {
            fraction,
            certificate: None,
        }
    }

    pub(super) fn keep_shape(&self, displacements: &[[f64; 3]]) -> Result<Self, FemError> {
        Ok(Self {
            body: Arc::new(self.body.keep_shape(displacements)?),
            contacts: None,
        })
    }
}
