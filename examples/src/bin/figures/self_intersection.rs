//! Figures 3 and 4: two ways to make direct manipulation fold, and their determinants.

use examples::{
    ink::rgb,
    raster::{Camera, Finish, Image, Mesh, Paint, Scene},
};
use ffd_core::{Constraint, Degree, Frame, Grid, Lattice, PullOptions, Verdict};
use serde_json::json;

use crate::{
    Error, Figure, Settings,
    free_form::{judge, verdict_json, verdict_lines},
    look::{AMBER, INK, Panel, mix, sheet, short},
    plane::{Drawing, circle, image_of},
};

const CELLS: usize = 6;
/// Where nothing changes, where area grows and where it shrinks; and the ground plane, the
/// colours of the paper.
const STILL: [f32; 3] = rgb(0xF4_F4_F0);
const GROWN: [f32; 3] = rgb(0x1B_4F_B5);
const SHRUNK: [f32; 3] = rgb(0x1F_8A_3B);
const GROUND: [f32; 3] = rgb(0x18_18_1C);
/// Determinants from here on have the darkest blue.
const MOST: f64 = 4.0;
/// Height of a determinant of 1, in cells.
const HEIGHT: f64 = 0.42;
const FLAT: [f64; 2] = [-1.4, CELLS as f64 + 1.4];

/// A pull that folds.
struct Fold {
    name: &'static str,
    circle: Vec<[f64; 2]>,
    constraints: Vec<Constraint<2>>,
    lattice: Lattice<2>,
    verdict: Verdict<2>,
}

fn folds() -> Result<[Fold; 2], Error> {
    let fold = |name, constraints: Vec<Constraint<2>>| -> Result<Fold, Error> {
        let grid = Grid::new([Degree::CUBIC; 2], [CELLS; 2], Frame::unit())?;
        let mut lattice = Lattice::at_rest(grid)?;
        lattice.pull(&constraints, &PullOptions::default())?;
        let verdict = judge(&lattice);
        Ok(Fold {
            name,
            circle: circle([3.0, 3.0], 1.4),
            constraints,
            lattice,
            verdict,
        })
    };
    let far = vec![Constraint::new([1.6, 3.0], [3.3, 0.0])];
    // Nearly at one place on the circle, and to go in opposite directions.
    let angle = 0.1_f64;
    let (sin, cos) = angle.sin_cos();
    let near = [-1.0, 1.0].map(|side| {
        Constraint::new(
            [3.0 + 1.4 * side * sin, 3.0 + 1.4 * cos],
            [0.5 * side, 0.3 * side],
        )
    });
    Ok([
        fold("(a) Over-extension", far)?,
        fold("(b) Over-constraint", near.to_vec())?,
    ])
}

/// Figure 3: what the constraints do to a circle and to the lattice.
pub(crate) fn folded_circles(settings: &Settings) -> Result<Figure, Error> {
    let folds = folds()?;
    let mut panels = Vec::new();
    for fold in &folds {
        let rest = Lattice::at_rest(fold.lattice.grid().clone())?;
        let mut before = Drawing::new([FLAT[0]; 2], [FLAT[1]; 2], settings.panel);
        before.cells(&rest, 0.5);
        before.blob(&fold.circle);
        before.constraints(&fold.constraints);
        let mut after = Drawing::new([FLAT[0]; 2], [FLAT[1]; 2], settings.panel);
        after.cells(&fold.lattice, 0.8);
        after.blob(&image_of(&fold.circle, &fold.lattice));
        after.targets(&fold.constraints);
        let farthest = fold.lattice.displacements().iter();
        let farthest = farthest.map(|d| d[0].hypot(d[1])).fold(0.0, f64::max);
        let what = match fold.constraints.len() {
            1 => "A vector that leaves what its point can move".to_owned(),
            _ => "Two near points are wrenched apart".to_owned(),
        };
        panels.push(Panel {
            heading: fold.name.to_owned(),
            image: before.image,
            lines: vec![
                what,
                format!("Control points move by {farthest:.2} cells at most"),
            ],
        });
        panels.push(Panel {
            heading: String::new(),
            image: after.image,
            lines: verdict_lines(&fold.verdict),
        });
    }
    Ok(Figure {
        name: "figure-3",
        title: "Figure 3: self-intersection under direct manipulation",
        picture: Some(sheet("Figure 3  Pulls that fold", 4, &panels)),
        table: None,
        numbers: json!({
            "over_extension": verdict_json(&folds[0].verdict),
            "over_constraint": verdict_json(&folds[1].verdict),
        }),
    })
}

/// Figure 4: the determinants of both, as height fields and from above.
pub(crate) fn determinants(settings: &Settings) -> Result<Figure, Error> {
    let folds = folds()?;
    let mut fields = Vec::new();
    let mut maps = Vec::new();
    let mut numbers = serde_json::Map::new();
    for fold in &folds {
        let field = Field::new(&fold.lattice, settings.field);
        fields.push(Panel {
            heading: fold.name.to_owned(),
            image: field.picture(settings),
            lines: vec![format!(
                "det J from {} to {} at {} points",
                short(field.least()),
                short(field.largest()),
                field.values.len()
            )],
        });
        let mut map = Drawing::new([0.0; 2], [CELLS as f64; 2], settings.panel);
        map.colour(|p| colour(fold.lattice.evaluate(p).map_or(1.0, |e| e.determinant)));
        map.outlines(fold.lattice.grid(), &fold.verdict.irregular_cells, AMBER);
        maps.push(Panel {
            heading: "From above".to_owned(),
            image: map.image,
            lines: verdict_lines(&fold.verdict)
                .into_iter()
                .chain(["outlined: cells proven to fold".to_owned()])
                .collect(),
        });
        numbers.insert(
            fold.name[4..].to_lowercase().replace('-', "_"),
            json!({
                "samples": field.values.len(),
                "sampled_det": [field.least(), field.largest()],
                "min_det": fold.verdict.min_det,
            }),
        );
    }
    fields.extend(maps);
    Ok(Figure {
        name: "figure-4",
        title: "Figure 4: the determinants of figure 3",
        picture: Some(sheet(
            "Figure 4  Blue: growing, green: shrinking, black: det J < 0",
            2,
            &fields,
        )),
        table: None,
        numbers: numbers.into(),
    })
}

/// The colour of a determinant.
fn colour(det: f64) -> [f32; 3] {
    if det <= 0.0 {
        GROUND
    } else if det < 1.0 {
        mix(SHRUNK, STILL, det)
    } else {
        mix(STILL, GROWN, (det - 1.0) / (MOST - 1.0))
    }
}

/// Determinants at the points of a square net.
struct Field {
    /// Pieces along a side.
    pieces: usize,
    values: Vec<f64>,
}

impl Field {
    fn new(lattice: &Lattice<2>, pieces: usize) -> Self {
        let place = |i: usize| (CELLS * i) as f64 / pieces as f64;
        let all = (0..(pieces + 1) * (pieces + 1)).map(|i| {
            let at = [i % (pieces + 1), i / (pieces + 1)].map(place);
            lattice.evaluate(at).map_or(1.0, |e| e.determinant)
        });
        Self {
            pieces,
            values: all.collect(),
        }
    }

    fn least(&self) -> f64 {
        self.values.iter().copied().fold(f64::INFINITY, f64::min)
    }

    fn largest(&self) -> f64 {
        self.values
            .iter()
            .copied()
            .fold(f64::NEG_INFINITY, f64::max)
    }

    /// The values as heights above a black plane at 0, which hides what is below.
    fn picture(&self, settings: &Settings) -> Image {
        let side = self.pieces + 1;
        let size = CELLS as f64;
        let place = |i: usize| size * i as f64 / self.pieces as f64;
        let positions: Vec<_> = (0..side * side)
            .map(|i| [place(i % side), HEIGHT * self.values[i], -place(i / side)])
            .collect();
        let colours: Vec<_> = self.values.iter().map(|&det| colour(det)).collect();
        let index = |i: usize, j: usize| u32::try_from(i + side * j).expect("a small net");
        let mut triangles = Vec::new();
        for j in 0..self.pieces {
            for i in 0..self.pieces {
                let [a, b, c, d] = [
                    index(i, j),
                    index(i + 1, j),
                    index(i + 1, j + 1),
                    index(i, j + 1),
                ];
                triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
        let mut scene = Scene::new();
        scene.add_mesh(&Mesh {
            positions: &positions,
            triangles: &triangles,
            paint: Paint::PerVertex(&colours),
            wireframe: false,
            finish: Finish::Satin,
        });
        // The borders of cells, drawn on the surface.
        for line in 0..=CELLS {
            let step = self.pieces / CELLS;
            for along in 0..self.pieces {
                for ends in [
                    [index(line * step, along), index(line * step, along + 1)],
                    [index(along, line * step), index(along + 1, line * step)],
                ] {
                    let ends = ends.map(|i| positions[i as usize]);
                    if ends.iter().all(|p| p[1] >= 0.0) {
                        scene.add_round_cone(ends, [0.012; 2], INK, Finish::Satin);
                    }
                }
            }
        }
        let (low, high) = (-0.25, size + 0.25);
        scene.add_mesh(&Mesh {
            positions: &[
                [low, 0., -low],
                [high, 0., -low],
                [high, 0., -high],
                [low, 0., -high],
            ],
            triangles: &[[0, 1, 2], [0, 2, 3]],
            paint: Paint::Uniform(GROUND),
            wireframe: false,
            finish: Finish::Satin,
        });
        let middle = size / 2.0;
        let camera = Camera::look_at(
            [middle - 3.2, 8.2, -middle + 9.2],
            [middle, 0.25, -middle],
            [0.0, 1.0, 0.0],
            0.62,
        );
        scene.render(
            &camera,
            settings.panel,
            settings.panel * 4 / 5,
            settings.samples,
        )
    }
}
