//! Pictures warped by lattices in the plane.
//!
//! * [`portrait`] draws the picture that is warped unless there is another.
//! * [`lattice_at_rest`] lays a lattice over a picture, [`Drag`]s are what moves it.
//! * [`Watch`] tests in every frame whether the lattice folds.
//! * [`Panels::new`] shows what a lattice does: the picture before and after, and the
//!   determinant of the Jacobian with the verdict. [`Panels::sheet`] puts them side by
//!   side.
//!
//! # Conventions
//!
//! World coordinates are pixels of the picture that is warped, x to the right and y down,
//! with (0, 0) at the upper left corner of the first pixel and halves at centres.
//!
//! The lattice is cubic with an identity border, and its whole domain is the picture: so
//! the edges of the picture stay where they are, and what is warped fills the same
//! rectangle.

mod backward;
mod determinant;
mod panels;
mod portrait;
mod sheet;
mod watch;

use ffd_core::{Border, Degree, FfdError, Frame, Grid, Lattice};

use crate::raster::Image;

pub use determinant::{DeterminantField, Range};
pub use panels::Panels;
pub use portrait::{PORTRAIT_SIZE, portrait, portrait_drags};
pub use watch::Watch;

/// Cells of an identity border on each side.
const BORDER: usize = 3;

/// The fewest cells across a picture, with those of the border.
pub const FEWEST_CELLS: usize = 2 * BORDER + 1;

/// A point of a picture and how far it is dragged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drag {
    /// Where it is.
    pub at: [f64; 2],
    /// How far it moves; zero holds it in place.
    pub by: [f64; 2],
}

/// A lattice at rest whose domain is the whole picture, with about square cells: as many
/// along the longer side as told, but seven along each side at least.
///
/// # Errors
///
/// Those of [`Frame::of_box`] and [`Lattice::at_rest`], for a picture without pixels and
/// too many cells.
pub fn lattice_at_rest(picture: &Image, cells: usize) -> Result<Lattice<2>, FfdError> {
    let size = [picture.width, picture.height].map(|n| n as f64);
    let longer = f64::max(size[0], size[1]);
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "at most the number of cells told"
    )]
    let across =
        size.map(|side| ((side / longer * cells as f64).round() as usize).max(FEWEST_CELLS));
    let cell = [0, 1].map(|axis| size[axis] / across[axis] as f64);
    // Lattice coordinate 0 is where the border ends and the lattice proper begins.
    let origin = cell.map(|length| length * BORDER as f64);
    let frame = Frame::new(origin, [[cell[0], 0.0], [0.0, cell[1]]])?;
    Grid::new([Degree::CUBIC; 2], across.map(|n| n - 2 * BORDER), frame)?
        .with_border(Border::Identity)
        .and_then(Lattice::at_rest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_domain_is_the_picture() {
        let picture = Image::filled(300, 160, [0.0; 3]);
        let lattice = lattice_at_rest(&picture, 15).unwrap();
        assert_eq!(lattice.grid().cells(), [9, 2]);
        let [low, high] = [0, 1].map(|end| {
            let domain = lattice.grid().domain();
            lattice.grid().frame().to_world(domain.map(|d| d[end]))
        });
        assert!(low.iter().all(|c| c.abs() < 1e-12));
        assert!((high[0] - 300.0).abs() < 1e-12 && (high[1] - 160.0).abs() < 1e-12);
        assert!(lattice_at_rest(&Image::filled(0, 9, [0.0; 3]), 15).is_err());
    }
}
