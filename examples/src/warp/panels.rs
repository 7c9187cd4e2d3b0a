//! What a lattice does to a picture, in three panels.

use ffd_core::{Grid, Lattice, Verdict};

use super::{
    Drag,
    backward::{BackwardMap, Source},
    determinant::{DeterminantField, Range},
};
use crate::{
    ink::{Ink, length, rgb, sub},
    raster::Image,
};

/// Pixels of the longer side of a panel.
const LONGER_SIDE: usize = 460;
/// Straight pieces of a line of the lattice, per cell.
const PIECES: usize = 12;

const WHITE: [f32; 3] = [1.0; 3];
const INK: [f32; 3] = rgb(0x16_1C_33);

/// The picture with what is dragged, the warped picture with the lattice, and the
/// determinant of the Jacobian with the verdict.
#[derive(Debug, Clone)]
pub struct Panels {
    /// The source with an arrow for each drag, and a ring where a point is held.
    pub before: Image,
    /// The warped picture; each line is the border of two cells of the lattice.
    pub after: Image,
    /// The determinant at each place of the source; cells proven to fold have an outline.
    pub determinant: Image,
    pub(super) field: DeterminantField,
    pub(super) verdict: Verdict<2>,
}

impl Panels {
    /// Draws all panels. The lattice must lie over the picture, as
    /// [`lattice_at_rest`](super::lattice_at_rest) lays it; `drags` and `verdict` are only
    /// drawn.
    #[must_use]
    pub fn new(source: &Image, lattice: &Lattice<2>, drags: &[Drag], verdict: &Verdict<2>) -> Self {
        let longer = source.width.max(source.height) as f64;
        let scale = longer / LONGER_SIDE as f64;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "from 1 to the longer side of a panel"
        )]
        let size =
            [source.width, source.height].map(|n| (n as f64 / scale).round().max(1.0) as usize);
        let light = Source::new(source);

        let mut before = BackwardMap::new(|x| x, size, scale).apply(&light);
        draw_drags(&mut before, drags, scale);

        let mut after = BackwardMap::new(|x| lattice.deform_point(x), size, scale).apply(&light);
        let net = net(
            lattice.grid(),
            |x| lattice.deform_point(x),
            &after,
            scale,
            [2.4, 1.2],
        );
        net[0].paint(&mut after, INK, 0.35);
        net[1].paint(&mut after, WHITE, 0.9);
        draw_targets(&mut after, drags, scale);

        let field = DeterminantField::new(lattice, size, scale);
        let mut determinant = field.to_image();
        let [lines] = self::net(lattice.grid(), |x| x, &determinant, scale, [1.0]);
        lines.paint(&mut determinant, INK, 0.13);
        draw_cells(
            &mut determinant,
            lattice.grid(),
            &verdict.irregular_cells,
            scale,
        );
        Self {
            before,
            after,
            determinant,
            field,
            verdict: verdict.clone(),
        }
    }

    /// Between which values the determinant lies.
    #[must_use]
    pub fn range(&self) -> Range {
        self.field.range()
    }
}

/// The images of the borders of cells, in lines of several widths.
fn net<const N: usize>(
    grid: &Grid<2>,
    map: impl Fn([f64; 2]) -> [f64; 2],
    image: &Image,
    scale: f64,
    widths: [f64; N],
) -> [Ink; N] {
    let mut inks = widths.map(|_| Ink::for_image(image));
    for along in 0..2 {
        let across = 1 - along;
        let domain = grid.domain();
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "numbers of cells"
        )]
        let cells = domain.map(|[low, high]| (high - low) as usize);
        for line in 1..cells[across] {
            let points = (0..=cells[along] * PIECES).map(|piece| {
                let mut u = [0.0; 2];
                u[across] = domain[across][0] + line as f64;
                u[along] = domain[along][0] + piece as f64 / PIECES as f64;
                map(grid.frame().to_world(u)).map(|c| c / scale)
            });
            let points: Vec<_> = points.collect();
            for (ink, width) in inks.iter_mut().zip(widths) {
                ink.polyline(&points, width);
            }
        }
    }
    inks
}

/// Outlines of cells of the domain.
fn draw_cells(image: &mut Image, grid: &Grid<2>, cells: &[[usize; 2]], scale: f64) {
    let domain = grid.domain();
    for (width, colour) in [(3.6, WHITE), (1.8, INK)] {
        let mut ink = Ink::for_image(image);
        for cell in cells {
            let corners = [[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]].map(|corner| {
                let u = [0, 1].map(|axis| domain[axis][0] + (cell[axis] + corner[axis]) as f64);
                grid.frame().to_world(u).map(|c| c / scale)
            });
            ink.polyline(&corners, width);
        }
        ink.paint(image, colour, 0.9);
    }
}

fn draw_drags(image: &mut Image, drags: &[Drag], scale: f64) {
    for (halo, colour) in [(2.0, WHITE), (0.0, INK)] {
        let mut ink = Ink::for_image(image);
        for drag in drags {
            let at = drag.at.map(|c| c / scale);
            let by = drag.by.map(|c| c / scale);
            let way = length(by);
            if way == 0.0 {
                ink.ring(at, 5.5, 2.2 + 2.0 * halo);
                continue;
            }
            let ahead = by.map(|c| c / way);
            let aside = [-ahead[1], ahead[0]];
            // A short arrow has a small head.
            let head = f64::min(11.0, 0.75 * way);
            let tip = [at[0] + by[0], at[1] + by[1]];
            let neck = sub(tip, ahead.map(|c| c * head));
            let wing = |side: f64| [0, 1].map(|c| neck[c] + side * 0.48 * head * aside[c]);
            ink.disc(at, 4.0 + halo);
            ink.line([at, neck], 2.6 + 2.0 * halo);
            ink.triangle([tip, wing(1.0), wing(-1.0)], halo);
        }
        ink.paint(image, colour, 1.0);
    }
}

/// Where the points that were dragged have arrived.
fn draw_targets(image: &mut Image, drags: &[Drag], scale: f64) {
    for (radius, colour) in [(4.6, WHITE), (3.0, INK)] {
        let mut ink = Ink::for_image(image);
        for Drag { at, by } in drags {
            ink.disc([0, 1].map(|c| (at[c] + by[c]) / scale), radius);
        }
        ink.paint(image, colour, 1.0);
    }
}
