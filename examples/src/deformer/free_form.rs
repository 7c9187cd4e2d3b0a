//! A lattice around the object that follows the fingertips.
//!
//! Each contact is a constraint of directly manipulated free-form deformation (Gain and
//! Dodgson, section 4): the point of the object under the fingertip goes where the
//! fingertip holds it, and of all lattices that do so the one is taken whose control
//! points move least. Its border is the identity, so the object stays in one piece even
//! where it leaves the lattice.

use std::sync::Arc;

use fem_tet::{Contact, MeshError, TetMesh};
use ffd_core::{
    Border, Degree, DirectManipulation, Embedding, FfdError, Fit, Frame, Grid, Lattice, Outside,
    PullOptions,
};
use glam::DVec3;

use super::{DeformerError, HoldError};

/// Width of a cell, metres: a touch bends the object within two cells around it, as the
/// pads of two fingers would.
const CELL_M: f64 = 0.018;
/// Cells along a side, so that flat objects bend and large ones stay quick.
const CELLS: std::ops::RangeInclusive<f64> = 2.0..=24.0;
/// Room between the object and the lattice, as a share of the object's size.
const MARGIN: f64 = 0.05;

/// A lattice around a rest shape.
#[derive(Debug, Clone)]
pub struct FreeForm {
    rest: Arc<TetMesh>,
    bound: Arc<Embedding<f64, 3>>,
    lattice: Lattice<3>,
    manipulation: Option<DirectManipulation<3>>,
    /// Displacements of the control points, to solve into.
    displacements: Vec<[f64; 3]>,
}

impl FreeForm {
    /// Lays a lattice around a shape.
    ///
    /// # Errors
    ///
    /// [`FfdError`] if the shape is too small or too large to compute with.
    pub fn new(mesh: TetMesh) -> Result<Self, FfdError> {
        let lattice = Lattice::at_rest(grid_around(mesh.positions())?)?;
        let bound = Embedding::new(lattice.grid(), mesh.positions(), Outside::Error)?;
        Ok(Self {
            rest: Arc::new(mesh),
            bound: Arc::new(bound),
            displacements: lattice.displacements().to_vec(),
            lattice,
            manipulation: None,
        })
    }

    pub(super) fn rest(&self) -> &TetMesh {
        &self.rest
    }

    pub(super) fn hold(&mut self, contacts: &[Contact]) -> Result<(), HoldError> {
        self.manipulation = None;
        let positions = self.rest.positions();
        let points: Vec<[f64; 3]> = contacts
            .iter()
            .map(|contact| {
                let weighted = contact.weights().iter();
                weighted
                    .map(|&(v, w)| DVec3::from_array(positions[v as usize]) * w)
                    .sum::<DVec3>()
                    .to_array()
            })
            .collect();
        let grid = self.lattice.grid();
        // Fingertips that contradict each other, as where two touch one point, share.
        let options = PullOptions {
            fit: Fit::LeastSquares,
            ..PullOptions::default()
        };
        self.manipulation = Some(DirectManipulation::new(grid, &points, &options)?);
        Ok(())
    }

    pub(super) fn let_go(&mut self) {
        self.manipulation = None;
    }

    pub(super) fn displace_into(
        &mut self,
        contact_displacements: &[[f64; 3]],
        out: &mut [[f64; 3]],
    ) {
        let manipulation = self.manipulation.as_mut().expect("contacts are held");
        manipulation
            .solve_into(contact_displacements, &mut self.displacements)
            .expect("displacements of fingertips are finite");
        self.lattice
            .set_displacements(&self.displacements)
            .expect("finite");
        self.bound
            .deform_into(&self.lattice, out)
            .expect("bound to this grid");
        for (u, rest) in out.iter_mut().zip(self.rest.positions()) {
            for c in 0..3 {
                u[c] -= rest[c];
            }
        }
    }

    pub(super) fn keep_shape(&self, displacements: &[[f64; 3]]) -> Result<Self, DeformerError> {
        let positions = self.rest.positions().iter().zip(displacements);
        let positions =
            positions.map(|(&x, &u)| (DVec3::from_array(x) + DVec3::from_array(u)).to_array());
        let mesh: Result<TetMesh, MeshError> =
            TetMesh::new(positions.collect(), self.rest.tets().to_vec());
        Ok(Self::new(mesh?)?)
    }
}

/// A cubic grid around points, with cells of about the same width along each side.
fn grid_around(positions: &[[f64; 3]]) -> Result<Grid<3>, FfdError> {
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for &x in positions {
        low = low.min(x.into());
        high = high.max(x.into());
    }
    let margin = MARGIN * (high - low).max_element();
    let (low, high) = (low - margin, high + margin);
    let (least, most) = CELLS.into_inner();
    let cells = ((high - low) / CELL_M)
        .round()
        .clamp(DVec3::splat(least), DVec3::splat(most));
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "between 2 and 24"
    )]
    let cells = cells.to_array().map(|n| n as usize);
    let frame = Frame::of_box(low.to_array(), high.to_array(), cells)?;
    Grid::new([Degree::CUBIC; 3], cells, frame)?.with_border(Border::Identity)
}
