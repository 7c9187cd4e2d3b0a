//! Figure 5: the cones around the partial differences of an injective cell.

use std::f64::consts::{FRAC_PI_2, TAU};

use examples::{
    ink::rgb,
    raster::{Finish, Image, Mesh, Paint, Scene},
};
use ffd_core::{CheckOptions, ConicHull, Degree, Frame, Grid, Lattice, Method};
use serde_json::json;

use crate::{
    Error, Figure, Settings,
    free_form::{judge, verdict_json, verdict_lines},
    look::{INK, Panel, sheet},
    solid::{blend, camera},
};

/// Of the cones along u, v and w, and of the cross product.
const COLOURS: [[f32; 3]; 4] = [
    rgb(0xC8_3C_38),
    rgb(0x3C_9A_48),
    rgb(0x2F_6F_C4),
    rgb(0x9A_6F_C8),
];
const AROUND: u32 = 96;
const OPACITY: f64 = 0.42;

/// Control points of one cell, moved a little, all in different directions.
fn cell() -> Result<Lattice<3>, Error> {
    let grid = Grid::new([Degree::CUBIC; 3], [1; 3], Frame::unit())?;
    let mut lattice = Lattice::at_rest(grid)?;
    for i in 0..lattice.grid().control_point_count() {
        let [x, y, z] = lattice.grid().rest_position(i);
        let wave = |a: f64, b: f64, c: f64, phase: f64| (a * x + b * y + c * z + phase).sin();
        let by = [
            0.29 * wave(0.4, 1.9, 1.3, 0.4),
            0.31 * wave(1.7, 0.3, 1.6, 1.1),
            0.23 * wave(1.4, 1.8, 0.2, 2.3),
        ];
        lattice.set_displacement(i, by)?;
    }
    Ok(lattice)
}

/// Differences of neighbouring control points along an axis, in cells.
fn differences(lattice: &Lattice<3>, axis: usize) -> Vec<[f64; 3]> {
    let grid = lattice.grid();
    let counts = grid.control_points_per_axis();
    let place = |i: usize| {
        let (rest, by) = (grid.rest_position(i), lattice.displacements()[i]);
        [0, 1, 2].map(|c| rest[c] + by[c])
    };
    (0..grid.control_point_count())
        .filter_map(|i| {
            let mut next = grid.control_point_indices(i);
            next[axis] += 1;
            (next[axis] < counts[axis]).then(|| {
                let [from, to] = [place(i), place(grid.control_point(next))];
                [0, 1, 2].map(|c| to[c] - from[c])
            })
        })
        .collect()
}

/// The angle between a vector and an axis.
fn deviation(v: [f64; 3], axis: usize) -> f64 {
    let off = v[(axis + 1) % 3].hypot(v[(axis + 2) % 3]);
    off.atan2(v[axis])
}

/// World coordinates of the picture, y up, in which w points up.
fn upright([u, v, w]: [f64; 3]) -> [f64; 3] {
    [u, w, -v]
}

pub(crate) fn conic_hull(settings: &Settings) -> Result<Figure, Error> {
    let lattice = cell()?;
    let vectors = [0, 1, 2].map(|axis| differences(&lattice, axis));
    let widest = |axis: usize| {
        let angles = vectors[axis].iter().map(|&v| deviation(v, axis));
        angles.fold(0.0, f64::max)
    };
    let [u, v, w] = [0, 1, 2].map(widest);
    // Equation (10).
    let cross = (u.sin().powi(2) + v.sin().powi(2)).sqrt().asin();
    let conic = lattice.check(&CheckOptions {
        method: Method::Conic(ConicHull::default()),
        ..CheckOptions::default()
    });
    let verdict = judge(&lattice);

    let left = translucent(
        settings,
        |scene, with_cones| {
            for axis in 0..3 {
                add_vectors(scene, &vectors[axis], COLOURS[axis]);
            }
            add_axes(scene);
            if with_cones {
                for (axis, angle) in [u, v, w].into_iter().enumerate() {
                    add_cone(scene, axis, angle, 0.92, COLOURS[axis]);
                }
                add_cone(scene, 2, cross, 0.62, COLOURS[3]);
            }
        },
        camera([2.3, 1.9, 3.2], [0.50, 0.45, -0.35], 0.56),
    );
    let right = translucent(
        settings,
        |scene, with_cones| {
            add_vectors(scene, &vectors[2], COLOURS[2]);
            crate::solid::add_arrow(scene, [0.0; 3], upright([0.0, 0.0, 1.55]), 0.008, INK);
            if with_cones {
                add_cone(scene, 2, w, 1.0, COLOURS[2]);
                add_cone(scene, 2, cross, 0.75, COLOURS[3]);
            }
        },
        camera([0.5, 1.6, 3.8], [0.0, 0.68, 0.0], 0.46),
    );

    let degrees = |angle: f64| angle.to_degrees();
    let squares: f64 = [u, v, w].iter().map(|angle| angle.sin().powi(2)).sum();
    let panels = [
        Panel {
            heading: "Left: cones around the differences".to_owned(),
            image: left,
            lines: vec![
                format!(
                    "u red {:.1}°, v green {:.1}°, w blue {:.1}°",
                    degrees(u),
                    degrees(v),
                    degrees(w)
                ),
                format!("Violet: where u \u{d7} v can point, {:.1}°", degrees(cross)),
            ],
        },
        Panel {
            heading: "Right: the two bounds around w".to_owned(),
            image: right,
            lines: vec![
                format!(
                    "{:.1}° + {:.1}° = {:.1}° < 90°: injective",
                    degrees(cross),
                    degrees(w),
                    degrees(cross + w)
                ),
                format!("the same as: sum of sin² = {squares:.3} < 1"),
            ],
        },
    ];
    let mut table = format!(
        "The cones pass ({}); the exact test: {}.\n",
        conic.outcome.name(),
        verdict_lines(&verdict).join(", ")
    );
    table.push_str(
        "\nThe test asks for `θ× + θw < 90°`, which is `sin² θu + sin² θv + sin² θw < 1`.\n",
    );
    let mut numbers = verdict_json(&verdict);
    numbers["angles_deg"] = json!([degrees(u), degrees(v), degrees(w)]);
    numbers["cross_product_deg"] = json!(degrees(cross));
    numbers["sum_of_squared_sines"] = json!(squares);
    numbers["conic_hull_test"] = json!(conic.outcome.name());
    numbers["passes"] = json!(cross + w < FRAC_PI_2);
    Ok(Figure {
        name: "figure-5",
        title: "Figure 5: the conic-hull hodograph of an injective cell",
        picture: Some(sheet("Figure 5  Why a cell cannot fold", 2, &panels)),
        table: Some(table),
        numbers,
    })
}

/// A scene drawn with and without cones, the one shining through the other.
fn translucent(
    settings: &Settings,
    build: impl Fn(&mut Scene, bool),
    camera: examples::raster::Camera,
) -> Image {
    let draw = |with_cones: bool| {
        let mut scene = Scene::new();
        build(&mut scene, with_cones);
        scene.render(&camera, settings.panel, settings.panel, settings.samples)
    };
    blend(&draw(false), &draw(true), OPACITY)
}

fn add_axes(scene: &mut Scene) {
    for axis in 0..3 {
        let mut tip = [0.0; 3];
        tip[axis] = 1.55;
        crate::solid::add_arrow(scene, [0.0; 3], upright(tip), 0.008, INK);
    }
}

fn add_vectors(scene: &mut Scene, vectors: &[[f64; 3]], colour: [f32; 3]) {
    for &v in vectors {
        let tip = upright(v);
        scene.add_round_cone([[0.0; 3], tip], [0.005; 2], colour, Finish::Satin);
        scene.add_round_cone([tip; 2], [0.016; 2], colour, Finish::Satin);
    }
}

/// An open cone around an axis with its apex at 0.
fn add_cone(scene: &mut Scene, axis: usize, angle: f64, length: f64, colour: [f32; 3]) {
    let rim = |i: u32| {
        let (sin, cos) = (TAU * f64::from(i) / f64::from(AROUND)).sin_cos();
        let mut p = [0.0; 3];
        p[axis] = length * angle.cos();
        p[(axis + 1) % 3] = length * angle.sin() * cos;
        p[(axis + 2) % 3] = length * angle.sin() * sin;
        upright(p)
    };
    let mut positions: Vec<_> = (0..AROUND).map(rim).collect();
    positions.push([0.0; 3]);
    let triangles: Vec<_> = (0..AROUND).map(|i| [AROUND, i, (i + 1) % AROUND]).collect();
    scene.add_mesh(&Mesh {
        positions: &positions,
        triangles: &triangles,
        paint: Paint::Uniform(colour),
        wireframe: false,
        finish: Finish::Satin,
    });
    for i in 0..AROUND {
        let ends = [rim(i), rim((i + 1) % AROUND)];
        scene.add_round_cone(ends, [0.007; 2], colour, Finish::Satin);
    }
}
