//! Pictures of objects in space.

use examples::raster::{Camera, Finish, Image, Mesh, Paint, Scene};
use ffd_core::Constraint;

use crate::{
    look::{AMBER, BLUE, RED},
    shapes::Shape,
};

/// Adds an object; some of its triangles are marked.
pub(crate) fn add_shape(scene: &mut Scene, shape: &Shape, marked: &[bool], wireframe: bool) {
    for (mark, colour) in [(false, BLUE), (true, AMBER)] {
        let of_colour = shape.triangles.iter().enumerate();
        let of_colour = of_colour.filter(|(i, _)| marked.get(*i).copied().unwrap_or(false) == mark);
        let triangles: Vec<_> = of_colour.map(|(_, &t)| t).collect();
        scene.add_mesh(&Mesh {
            positions: &shape.positions,
            triangles: &triangles,
            paint: Paint::Uniform(colour),
            wireframe,
            finish: Finish::Satin,
        });
    }
}

/// Adds an arrow.
pub(crate) fn add_arrow(
    scene: &mut Scene,
    from: [f64; 3],
    by: [f64; 3],
    radius: f64,
    colour: [f32; 3],
) {
    let long = by.iter().map(|x| x * x).sum::<f64>().sqrt();
    let at = |way: f64| [0, 1, 2].map(|c| from[c] + by[c] * way / long);
    scene.add_round_cone([from; 2], [1.9 * radius; 2], colour, Finish::Satin);
    if long > 0.0 {
        let neck = (long - 6.0 * radius).max(0.4 * long);
        scene.add_round_cone([from, at(neck)], [radius; 2], colour, Finish::Satin);
        scene.add_round_cone(
            [at(neck), at(long)],
            [2.3 * radius, 0.2 * radius],
            colour,
            Finish::Satin,
        );
    }
}

/// Adds constraints, red as in the paper.
pub(crate) fn add_constraints(scene: &mut Scene, constraints: &[Constraint<3>], radius: f64) {
    for constraint in constraints {
        add_arrow(
            scene,
            constraint.point,
            constraint.displacement,
            radius,
            RED,
        );
    }
}

/// Where points have arrived.
pub(crate) fn add_targets(scene: &mut Scene, constraints: &[Constraint<3>], radius: f64) {
    for Constraint {
        point,
        displacement,
        ..
    } in constraints
    {
        let at = [0, 1, 2].map(|c| point[c] + displacement[c]);
        scene.add_round_cone([at; 2], [1.9 * radius; 2], RED, Finish::Satin);
    }
}

/// One picture shining through another of the same size.
pub(crate) fn blend(below: &Image, above: &Image, opacity: f64) -> Image {
    let mut mixed = above.clone();
    for (pixel, below) in mixed.rgb.iter_mut().zip(&below.rgb) {
        for (c, below) in pixel.iter_mut().zip(below) {
            let value = opacity * f64::from(*c) + (1.0 - opacity) * f64::from(*below);
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "between two bytes"
            )]
            let byte = value.round() as u8;
            *c = byte;
        }
    }
    mixed
}

/// A camera with y up.
pub(crate) fn camera(eye: [f64; 3], target: [f64; 3], angle_rad: f64) -> Camera {
    Camera::look_at(eye, target, [0.0, 1.0, 0.0], angle_rad)
}
