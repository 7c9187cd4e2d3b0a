//! The pulls of figures 7 and 8: objects, lattices and constraints.
//!
//! The paper gives no coordinates. These are pulls of the same kinds: a dent pushed farther
//! than its point can move space, two near points wrenched apart, and links of a chain
//! pulled through each other.

use examples::raster::Camera;
use ffd_core::{Border, Constraint, Degree, FfdError, Frame, Grid};

use crate::{
    shapes::{Link, Shape, chain, squashed_hemisphere},
    solid::camera,
};

/// Height of the hemisphere, whose radius is 1.
const HEIGHT: f64 = 0.6;

/// Something to pull.
#[derive(Debug, Clone)]
pub(crate) struct Case {
    /// As in the paper.
    pub(crate) name: &'static str,
    pub(crate) what: &'static str,
    /// From coarse to fine; the one in the middle is drawn.
    pub(crate) meshes: Vec<Shape>,
    pub(crate) grid: Grid<3>,
    pub(crate) constraints: Vec<Constraint<3>>,
    pub(crate) camera: Camera,
    /// Height of the pictures relative to their width.
    pub(crate) aspect: f64,
    pub(crate) wireframe: bool,
    /// Radius of arrows.
    pub(crate) arrow: f64,
}

impl Case {
    pub(crate) fn drawn(&self) -> &Shape {
        &self.meshes[self.meshes.len() / 2]
    }
}

/// The point of the hemisphere above or below a direction.
fn on_hemisphere([x, y, z]: [f64; 3]) -> [f64; 3] {
    let length = (x * x + y * y + z * z).sqrt();
    [x / length, HEIGHT * y / length, z / length]
}

fn hemispheres() -> Vec<Shape> {
    [8, 16, 32]
        .map(|rings| squashed_hemisphere(rings, HEIGHT))
        .to_vec()
}

fn hemisphere_grid() -> Result<Grid<3>, FfdError> {
    let frame = Frame::of_box([-2.0, -1.5, -2.0], [2.0, 2.0, 2.0], [8, 7, 8])?;
    Grid::new([Degree::CUBIC; 3], [8, 7, 8], frame)?.with_border(Border::Identity)
}

/// Constraints of the first kind: over-extended.
pub(crate) fn over_extension() -> Result<Case, FfdError> {
    Ok(Case {
        name: "1",
        what: "one side is pushed through the other",
        meshes: hemispheres(),
        grid: hemisphere_grid()?,
        constraints: vec![Constraint::new(
            on_hemisphere([0.85, 0.5, 0.0]),
            [-1.9, 0.15, 0.0],
        )],
        camera: camera([0.9, 2.4, 3.6], [-0.1, 0.22, 0.0], 0.46),
        aspect: 0.8,
        wireframe: true,
        arrow: 0.022,
    })
}

/// Constraints of the second kind: near to each other and contrary.
pub(crate) fn over_constraint() -> Result<Case, FfdError> {
    let wrench = [-1.0, 1.0].map(|side| {
        let by = [0.42, 0.25, 0.0].map(|c| side * c);
        Constraint::new(on_hemisphere([0.12 * side, 1.0, 0.0]), by)
    });
    Ok(Case {
        name: "2",
        what: "two near points are wrenched apart",
        meshes: hemispheres(),
        grid: hemisphere_grid()?,
        constraints: wrench.to_vec(),
        camera: camera([0.85, 2.5, 4.0], [0.15, 0.25, 0.0], 0.60),
        aspect: 0.8,
        wireframe: true,
        arrow: 0.022,
    })
}

/// Figure 8.
pub(crate) fn chain_links() -> Result<Case, FfdError> {
    let link = Link {
        straight: 0.35,
        bend: 0.3,
        rod: 0.1,
    };
    let gap = 0.15;
    let (pitch, outside) = (link.pitch(gap), link.bend + link.rod);
    let frame = Frame::of_box([-3.5, -2.0, -2.0], [3.5, 2.0, 2.0], [14, 8, 8])?;
    Ok(Case {
        name: "3",
        what: "the upright links are pulled through themselves",
        meshes: [[12, 6], [20, 8], [40, 12], [80, 24]]
            .map(|around| chain(5, link, gap, around))
            .to_vec(),
        grid: Grid::new([Degree::CUBIC; 3], [14, 8, 8], frame)?.with_border(Border::Identity)?,
        constraints: vec![
            Constraint::new([-pitch, outside, 0.0], [0.0, -1.5, 0.0]),
            Constraint::new([pitch, -outside, 0.0], [0.0, 1.5, 0.0]),
        ],
        camera: camera([0.8, 3.2, 7.0], [0.0, -0.02, 0.0], 0.37),
        aspect: 0.5,
        wireframe: false,
        arrow: 0.035,
    })
}
