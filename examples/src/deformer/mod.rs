//! How an object gives way to fingertips: as an elastic solid, or with the space around it.

mod elastic;
mod free_form;

use fem_tet::{Contact, FemError, TetMesh};
use ffd_core::{DirectError, FfdError};
use glam::DVec3;

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

/// What became of the displacements asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// The share of them that was carried out.
    pub fraction: f64,
    /// What was proven, in a lattice.
    pub certificate: Option<Certified>,
}

/// What was proven of the lattice that an object follows in one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Certified {
    /// The word for the outcome: see [`ffd_core::Outcome::name`].
    pub verdict: &'static str,
    /// An interval that contains the least determinant of its Jacobian.
    pub min_det: [f64; 2],
    /// How far it went from the lattice of the frame before to the one that the fingertips
    /// asked for: less than 1 where that one folds.
    pub step: f64,
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

    /// Displaces the held contacts from the rest shape as far as they can be, and writes
    /// the displacement of every node to `out`: every element keeps the given share of its
    /// rest volume, and a lattice does not fold.
    ///
    /// # Panics
    ///
    /// If no contacts are held or their number differs.
    pub fn displace_into(
        &mut self,
        contact_displacements: &[[f64; 3]],
        least_volume_ratio: f64,
        out: &mut [[f64; 3]],
    ) -> Step {
        match self {
            Self::Elastic(elastic) => {
                elastic.displace_into(contact_displacements, least_volume_ratio, out)
            }
            Self::FreeForm(free_form) => {
                free_form.displace_into(contact_displacements, least_volume_ratio, out)
            }
        }
    }

    /// The same way to deform another rest shape: this one, displaced, and moved as a whole
    /// besides.
    ///
    /// # Errors
    ///
    /// [`DeformerError`] if the new shape cannot be deformed.
    pub fn keep_shape(
        &self,
        displacements: &[[f64; 3]],
        moved: DVec3,
    ) -> Result<Self, DeformerError> {
        Ok(match self {
            Self::Elastic(elastic) => {
                let all = displacements
                    .iter()
                    .map(|&u| (DVec3::from_array(u) + moved).to_array());
                Self::Elastic(elastic.keep_shape(&all.collect::<Vec<_>>())?)
            }
            Self::FreeForm(free_form) => {
                Self::FreeForm(Box::new(free_form.keep_shape(displacements, moved)?))
            }
        })
    }
}
