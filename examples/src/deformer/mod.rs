//! How an object gives way to fingertips: as an elastic solid, or with the space around it.

mod elastic;
mod free_form;

use fem_tet::{Contact, FemError, TetMesh};
use ffd_core::{DirectError, FfdError};

pub use elastic::Elastic;
pub use free_form::FreeForm;

/// Which deformer an object gets.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, clap::ValueEnum, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum DeformerKind {
    /// Finite elements: the object resists as a rubber ball does.
    #[default]
    Fem,
    /// Free-form deformation, directly manipulated: a lattice around the object bends,
    /// and the object with it, just enough to follow the fingertips.
    Ffd,
}

/// A rest shape and what deforms it.
#[derive(Debug, Clone)]
pub enum Deformer {
    /// Finite elements.
    Elastic(Elastic),
    /// Free-form deformation.
    FreeForm(Box<FreeForm>),
}

/// Why a shape cannot be deformed.
#[derive(Debug, thiserror::Error)]
pub enum DeformerError {
    /// Its elasticity.
    #[error(transparent)]
    Fem(#[from] FemError),
    /// Its mesh.
    #[error(transparent)]
    Mesh(#[from] fem_tet::MeshError),
    /// The lattice around it.
    #[error(transparent)]
    Lattice(#[from] FfdError),
}

/// Why fingertips do not determine how the object deforms.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum HoldError {
    /// They leave a motion free.
    #[error(transparent)]
    Free(#[from] FemError),
    /// They nearly do.
    #[error(
        "the contacts hardly hold the body: it would move {amplification:.0} times as far as they do"
    )]
    Wobbly {
        /// See [`fem_tet::ContactSet::amplification`].
        amplification: f64,
    },
    /// They contradict each other, or are out of the lattice's reach.
    #[error(transparent)]
    Constraints(#[from] DirectError),
}

impl Deformer {
    /// Which one it is.
    #[must_use]
    pub fn kind(&self) -> DeformerKind {
        match self {
            Self::Elastic(_) => DeformerKind::Fem,
            Self::FreeForm(_) => DeformerKind::Ffd,
        }
    }

    /// The rest shape.
    #[must_use]
    pub fn rest(&self) -> &TetMesh {
        match self {
            Self::Elastic(elastic) => elastic.rest(),
            Self::FreeForm(free_form) => free_form.rest(),
        }
    }

    /// Prepares for displacements of these contacts.
    ///
    /// # Errors
    ///
    /// [`HoldError`] if they do not determine the deformation; none are held then.
    pub fn hold(&mut self, contacts: Vec<Contact>) -> Result<(), HoldError> {
        match self {
            Self::Elastic(elastic) => elastic.hold(contacts),
            Self::FreeForm(free_form) => free_form.hold(&contacts),
        }
    }

    /// Lets go of all contacts.
    pub fn let_go(&mut self) {
        match self {
            Self::Elastic(elastic) => elastic.let_go(),
            Self::FreeForm(free_form) => free_form.let_go(),
        }
    }

    /// Displaces the held contacts from the rest shape, and writes the displacement of
    /// every node to `out`.
    ///
    /// # Panics
    ///
    /// If no contacts are held or their number differs.
    pub fn displace_into(&mut self, contact_displacements: &[[f64; 3]], out: &mut [[f64; 3]]) {
        match self {
            Self::Elastic(elastic) => elastic.displace_into(contact_displacements, out),
            Self::FreeForm(free_form) => free_form.displace_into(contact_displacements, out),
        }
    }

    /// The same way to deform another rest shape: this one, displaced.
    ///
    /// # Errors
    ///
    /// [`DeformerError`] if the new shape cannot be deformed.
    pub fn keep_shape(&self, displacements: &[[f64; 3]]) -> Result<Self, DeformerError> {
        Ok(match self {
            Self::Elastic(elastic) => Self::Elastic(elastic.keep_shape(displacements)?),
            Self::FreeForm(free_form) => {
                Self::FreeForm(Box::new(free_form.keep_shape(displacements)?))
            }
        })
    }
}
