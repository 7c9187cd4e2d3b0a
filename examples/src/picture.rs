//! The contact sheet: key moments of a session, hand and object together.

use glam::DVec3;
use glove_io::hand::{Finger, HandPose};
use rayon::prelude::*;

use crate::{
    raster::{Camera, ColorBar, ContactSheet, Finish, Image, Mesh, Paint, Panel, Scene, colormap},
    session::Snapshot,
};

const PANEL: [usize; 2] = [460, 400];
/// Samples across one pixel.
const SAMPLES: usize = 2;
const SKIN: [f32; 3] = [0.87, 0.68, 0.56];
/// A fingertip that touches the object.
const TOUCHING: [f32; 3] = [0.86, 0.36, 0.28];
/// Radius of the hand between the knuckles and the wrist, metres.
const PALM_RADIUS_M: f64 = 0.0115;
const FOREARM_RADIUS_M: f64 = 0.024;

/// Draws all snapshots with one colour scale, one panel each, on as many threads as
/// the current rayon pool has.
#[must_use]
pub fn contact_sheet(title: &str, snapshots: &[Snapshot], triangles: &[[u32; 3]]) -> Image {
    let largest = snapshots
        .iter()
        .flat_map(|s| &s.displacement_m)
        .fold(0.0, |m: f64, &d| m.max(d));
    // The ground lies where the object gets to at its lowest.
    let ground_m = snapshots
        .iter()
        .flat_map(|s| &s.positions)
        .fold(f64::INFINITY, |low, p| low.min(p[1]));
    // A millimetre at least: rounding is not a colour.
    let scale_m = largest.max(1e-3);
    let panels = snapshots
        .par_iter()
        .map(|snapshot| Panel {
            title: format!("{} (frame {})", snapshot.name, snapshot.frame),
            image: draw(snapshot, triangles, scale_m, ground_m),
        })
        .collect();
    ContactSheet {
        title: title.to_owned(),
        columns: if snapshots.len() > 3 {
            snapshots.len().div_ceil(2)
        } else {
            3
        },
        panels,
        color_bar: Some(ColorBar {
            label: "displacement from the rest shape of the moment".to_owned(),
            min: "0 mm".to_owned(),
            max: format!("{:.1} mm", scale_m * 1e3),
        }),
    }
    .compose()
}

fn draw(snapshot: &Snapshot, triangles: &[[u32; 3]], scale_m: f64, ground_m: f64) -> Image {
    let mut scene = Scene::new();
    scene.set_ground(ground_m);
    let colours: Vec<[f32; 3]> = snapshot
        .displacement_m
        .iter()
        .map(|d| colormap(d / scale_m))
        .collect();
    scene.add_mesh(&Mesh {
        positions: &snapshot.positions,
        triangles,
        paint: Paint::PerVertex(&colours),
        wireframe: true,
        finish: Finish::Satin,
    });
    add_hand(&mut scene, &snapshot.hand, snapshot.touching);

    let centre = snapshot
        .positions
        .iter()
        .map(|&p| DVec3::from_array(p))
        .sum::<DVec3>()
        / snapshot.positions.len() as f64;
    // From the side of the thumb and the fingertips, whichever way the hand points,
    // so that the palm hides nothing.
    let hand = &snapshot.hand;
    let forward = DVec3::from_array(hand.fingers[Finger::Middle.index()].points_m[0])
        - DVec3::from_array(hand.palm.position_m);
    let forward = DVec3::new(forward.x, 0.0, forward.z).normalize_or(DVec3::NEG_Z);
    let eye = centre + forward * 0.25 + DVec3::Y * 0.10 - forward.cross(DVec3::Y) * 0.31;
    let target = centre + DVec3::new(0.0, 0.025, 0.0);
    let camera = Camera::look_at(eye.to_array(), target.to_array(), [0.0, 1.0, 0.0], 0.6);
    scene.render(&camera, PANEL[0], PANEL[1], SAMPLES)
}

fn add_hand(scene: &mut Scene, hand: &HandPose, touching: [bool; 5]) {
    for (finger, touches) in hand.fingers.iter().zip(touching) {
        let tip = finger.tip_center_m();
        let [a, b, c, _] = finger.points_m;
        let [r0, r1, r2] = finger.radii_m;
        for (ends, radii, last) in [
            ([a, b], [r0, r1], false),
            ([b, c], [r1, r2], false),
            ([c, tip], [r2, r2], true),
        ] {
            let colour = if last && touches { TOUCHING } else { SKIN };
            scene.add_round_cone(ends, radii, colour, Finish::Skin);
        }
    }
    // The palm: metacarpals, what joins their ends, and the way to the wrist.
    let wrist = DVec3::from_array(hand.palm.position_m);
    let heads: Vec<[f64; 3]> = hand.fingers[1..].iter().map(|f| f.points_m[0]).collect();
    let bases = hand.metacarpal_bases_m;
    let mut bone = |a: [f64; 3], b: [f64; 3], radii: [f64; 2]| {
        scene.add_round_cone([a, b], radii, SKIN, Finish::Skin);
    };
    for (base, head) in bases.iter().zip(&heads) {
        bone(*base, *head, [PALM_RADIUS_M; 2]);
        bone(wrist.to_array(), *base, [0.018, PALM_RADIUS_M]);
    }
    for pair in heads.windows(2) {
        bone(pair[0], pair[1], [PALM_RADIUS_M * 0.9; 2]);
    }
    for i in 0..3 {
        // Flesh between neighbouring metacarpals.
        let between = |a: [f64; 3], b: [f64; 3]| {
            DVec3::from_array(a)
                .midpoint(DVec3::from_array(b))
                .to_array()
        };
        bone(
            between(bases[i], bases[i + 1]),
            between(heads[i], heads[i + 1]),
            [PALM_RADIUS_M; 2],
        );
    }
    // The ball of the thumb reaches to the index finger's metacarpal.
    let thumb = hand.fingers[0].points_m;
    bone(wrist.to_array(), thumb[0], [0.018, 0.0125]);
    let web = DVec3::from_array(bases[0]).lerp(DVec3::from_array(heads[0]), 0.45);
    let along = DVec3::from_array(thumb[0]).lerp(DVec3::from_array(thumb[1]), 0.55);
    bone(along.to_array(), web.to_array(), [0.0105, 0.0095]);
    // Forearm.
    let back = wrist - (DVec3::from_array(heads[1]) - wrist).normalize() * 0.09;
    bone(wrist.to_array(), back.to_array(), [0.021, FOREARM_RADIUS_M]);
}
