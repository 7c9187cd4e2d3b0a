//! A lattice around the object that follows the fingertips.
//!
//! Each contact is a constraint of directly manipulated free-form deformation (Gain and
//! Dodgson, section 4): the point of the object under the fingertip goes where the
//! fingertip holds it, and of all lattices that do so the one is taken whose control
//! points move least. Its border is the identity, so the object stays in one piece even
//! where it leaves the lattice.
//!
//! Each lattice that the object follows is proven not to fold. Where the fingertips ask for
//! one that does, the object goes as far towards it as it safely can, and stops there. The
//! shapes that were kept stay in a journal, so that all of it can be undone.

use std::sync::Arc;

use fem_tet::{Contact, MeshError, TetMesh, largest_safe_fraction};
use ffd_core::{
    Border, CheckOptions, Degree, DirectManipulation, Embedding, FfdError, Fit, Frame, Grid,
    InverseError, Lattice, Outside, PullOptions, Sequence, StepOptions, Verdict,
};
use glam::DVec3;

use super::{DeformerError, HoldError, Step};

/// Width of a cell, metres: a touch bends the object within two cells around it, as the
/// pads of two fingers would.
const CELL_M: f64 = 0.018;
/// Cells along a side, so that flat objects bend and large ones stay quick.
const CELLS: std::ops::RangeInclusive<f64> = 2.0..=24.0;
/// Room between the object and the lattice, as a share of the object's size.
const MARGIN: f64 = 0.05;

/// Part of the way to a lattice that folds up to the fold, where the object stops: within
/// the rounding of the stored lattice the fold itself might be passed.
const SAFE_PART: f64 = 0.999;

/// What space keeps of its volume everywhere, about: fingers that push on and on come ever
/// closer to the fold otherwise, where every further test takes exact arithmetic.
const LEAST_DETERMINANT: f64 = 1e-3;

/// Width of the interval in which the least determinant of each accepted lattice is known:
/// it is 1 where nothing moves.
const DETERMINANT_WIDTH: f64 = 1e-3;

/// A lattice around a rest shape.
#[derive(Debug, Clone)]
pub struct FreeForm {
    rest: Arc<TetMesh>,
    bound: Arc<Embedding<f64, 3>>,
    /// What the object follows: proven not to fold.
    lattice: Lattice<3>,
    manipulation: Option<DirectManipulation<3>>,
    /// The points that are held, on the rest shape.
    points: Vec<[f64; 3]>,
    /// What the fingertips ask for.
    wanted: Lattice<3>,
    displacements: Vec<[f64; 3]>,
    journal: Arc<Journal>,
}

/// How an object came to its rest shape.
#[derive(Debug, Clone, Default)]
struct Journal {
    /// Positions before anything happened.
    first: Vec<[f64; 3]>,
    /// The lattices that were kept.
    kept: Sequence<3>,
    /// How far the rest shape was moved, besides: an object keeps its centre of mass when
    /// it keeps a shape. Lattices of the journal lie where it would be otherwise.
    moved: DVec3,
}

impl FreeForm {
    /// Lays a lattice around a shape.
    ///
    /// # Errors
    ///
    /// [`FfdError`] if the shape is too small or too large to compute with.
    pub fn new(mesh: TetMesh) -> Result<Self, FfdError> {
        let journal = Journal {
            first: mesh.positions().to_vec(),
            ..Journal::default()
        };
        Self::with_journal(mesh, journal)
    }

    fn with_journal(mesh: TetMesh, journal: Journal) -> Result<Self, FfdError> {
        let lattice = Lattice::at_rest(grid_around(mesh.positions())?)?;
        let bound = Embedding::new(lattice.grid(), mesh.positions(), Outside::Error)?;
        Ok(Self {
            rest: Arc::new(mesh),
            bound: Arc::new(bound),
            displacements: lattice.displacements().to_vec(),
            wanted: lattice.clone(),
            lattice,
            manipulation: None,
            points: Vec::new(),
            journal: Arc::new(journal),
        })
    }

    /// The lattices that made the first shape what it is now, in their order, and how far
    /// it was moved besides, metres.
    ///
    /// # Errors
    ///
    /// [`FfdError`] if the object was moved out of the range of numbers.
    pub fn journal(&self) -> Result<(Sequence<3>, DVec3), FfdError> {
        let mut sequence = self.journal.kept.clone();
        let all = self.lattice.displacements().as_flattened();
        if all.iter().any(|&x| x != 0.0) {
            sequence.push(self.moved_back()?);
        }
        Ok((sequence, self.journal.moved))
    }

    /// Undoes everything that happened to an object that is now at the given positions.
    /// Returns the largest distance of a node from where it was at first, metres, or
    /// `None` if some node has no way back.
    ///
    /// # Errors
    ///
    /// [`InverseError`] if positions or the journal are not fit to compute with.
    pub fn round_trip_error_m(&self, now: &[[f64; 3]]) -> Result<Option<f64>, InverseError> {
        let Ok((sequence, moved)) = self.journal() else {
            return Ok(None);
        };
        let back = |&x: &[f64; 3]| (DVec3::from_array(x) - moved).to_array();
        let mut points: Vec<[f64; 3]> = now.iter().map(back).collect();
        let report = sequence.undo_points(&mut points)?;
        if !report.is_unique() {
            return Ok(None);
        }
        let pairs = points.iter().zip(&self.journal.first);
        let distances = pairs.map(|(&a, &b)| DVec3::from_array(a).distance(b.into()));
        Ok(Some(distances.fold(0.0, f64::max)))
    }

    /// The lattice, where the object would be without the moves of the journal. Its
    /// Jacobian is the same.
    fn moved_back(&self) -> Result<Lattice<3>, FfdError> {
        let grid = self.lattice.grid();
        let frame = grid.frame();
        let origin = DVec3::from_array(frame.origin()) - self.journal.moved;
        let frame = Frame::new(origin.to_array(), frame.axes())?;
        let grid = Grid::new(grid.degree(), grid.cells(), frame)?.with_border(grid.border())?;
        Lattice::new(grid, self.lattice.displacements().to_vec())
    }

    /// The lattice's shape.
    #[must_use]
    pub fn grid(&self) -> &Grid<3> {
        self.lattice.grid()
    }

    pub(super) fn rest(&self) -> &TetMesh {
        &self.rest
    }

    /// See [`super::Deformer::hold`].
    ///
    /// # Errors
    ///
    /// [`HoldError::Constraints`] if the lattice does not reach a contact.
    pub fn hold(&mut self, contacts: &[Contact]) -> Result<(), HoldError> {
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
        self.points = points;
        Ok(())
    }

    pub(super) fn let_go(&mut self) {
        self.manipulation = None;
        self.displacements.fill([0.0; 3]);
        self.lattice
            .set_displacements(&self.displacements)
            .expect("zeros");
    }

    /// See [`super::Deformer::displace_into`].
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
        let manipulation = self.manipulation.as_mut().expect("contacts are held");
        manipulation
            .solve_into(contact_displacements, &mut self.displacements)
            .expect("displacements of fingertips are finite");
        self.wanted
            .set_displacements(&self.displacements)
            .expect("finite");
        let mut verdict = check(&self.wanted);
        let mut step = 1.0;
        if !verdict.is_injective() {
            let safe = self
                .lattice
                .largest_safe_step(&self.wanted, &StepOptions::default())
                .expect("both are on the same grid");
            step = SAFE_PART * safe.t[0];
            self.go_back(step);
            verdict = check(&self.wanted);
        }
        self.displacements_into(&self.wanted, out);
        let fraction = largest_safe_fraction(
            self.rest.positions(),
            out,
            self.rest.tets(),
            least_volume_ratio,
        );
        if fraction < 1.0 {
            // Elements have to be left with some volume, too.
            for d in self.displacements.as_flattened_mut() {
                *d *= fraction;
            }
            self.wanted
                .set_displacements(&self.displacements)
                .expect("finite");
            verdict = check(&self.wanted);
        }
        if verdict.is_injective() && verdict.min_det[1] > LEAST_DETERMINANT {
            std::mem::swap(&mut self.lattice, &mut self.wanted);
        } else {
            // Rounding may matter right before a fold, and the way to rest need not be free
            // of folds. Then the object stays as it is.
            step = 0.0;
            verdict = check(&self.lattice);
        }
        self.displacements_into(&self.lattice, out);
        Step {
            fraction: if fraction * step < 1.0 {
                self.share_of(contact_displacements)
            } else {
                1.0
            },
            certificate: Some(super::Certified {
                verdict: verdict.outcome.name(),
                min_det: verdict.min_det,
                step,
            }),
        }
    }

    /// How far the held points have gone in the direction that was asked for.
    fn share_of(&self, asked: &[[f64; 3]]) -> f64 {
        let (mut gone, mut all) = (0.0, 0.0);
        for (&point, &asked) in self.points.iter().zip(asked) {
            let (point, asked) = (DVec3::from(point), DVec3::from(asked));
            let now = DVec3::from(self.lattice.deform_point(point.to_array()));
            gone += (now - point).dot(asked);
            all += asked.length_squared();
        }
        if all > 0.0 { gone / all } else { 1.0 }
    }

    /// Shortens the way from the lattice to the one that is wanted.
    fn go_back(&mut self, step: f64) {
        let from = self.lattice.displacements();
        for (to, from) in self.displacements.iter_mut().zip(from) {
            for c in 0..3 {
                to[c] = from[c] + step * (to[c] - from[c]);
            }
        }
        self.wanted
            .set_displacements(&self.displacements)
            .expect("between finite ones");
    }

    fn displacements_into(&self, lattice: &Lattice<3>, out: &mut [[f64; 3]]) {
        self.bound
            .deform_into(lattice, out)
            .expect("bound to this grid");
        for (u, rest) in out.iter_mut().zip(self.rest.positions()) {
            for c in 0..3 {
                u[c] -= rest[c];
            }
        }
    }

    pub(super) fn keep_shape(
        &self,
        displacements: &[[f64; 3]],
        moved: DVec3,
    ) -> Result<Self, DeformerError> {
        let positions = self.rest.positions().iter().zip(displacements);
        let positions = positions
            .map(|(&x, &u)| (DVec3::from_array(x) + DVec3::from_array(u) + moved).to_array());
        let mesh: Result<TetMesh, MeshError> =
            TetMesh::new(positions.collect(), self.rest.tets().to_vec());
        let mut journal = (*self.journal).clone();
        journal.kept.push(self.moved_back()?);
        journal.moved += moved;
        Ok(Self::with_journal(mesh?, journal)?)
    }
}

/// Whether a lattice folds, and how near it comes to that.
fn check(lattice: &Lattice<3>) -> Verdict<3> {
    lattice.check(&CheckOptions {
        enclose: Some(DETERMINANT_WIDTH),
        ..CheckOptions::default()
    })
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
