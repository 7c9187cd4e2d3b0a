//! A picture in which a warp is seen well: a face with a hat in front of rings and a
//! chequerboard.

use super::Drag;
use crate::{
    ink::{Ink, rgb},
    raster::Image,
};

/// Pixels a side of the picture.
pub const PORTRAIT_SIZE: usize = 960;

const LIGHT: [f32; 3] = rgb(0xF3_F1_EA);
const SHADE: [f32; 3] = rgb(0xE1_E6_E4);
const RINGS: [f32; 3] = rgb(0x2A_8C_8C);
const INK: [f32; 3] = rgb(0x22_2B_45);
const SKIN: [f32; 3] = rgb(0xFF_CF_5C);
const CHEEKS: [f32; 3] = rgb(0xF2_7D_5B);
const LIPS: [f32; 3] = rgb(0xB4_36_4A);
const HAT: [f32; 3] = rgb(0x35_5C_9A);
const WHITE: [f32; 3] = [1.0; 3];

/// Edge of a square of the chequerboard.
const SQUARE: usize = 60;

/// The picture: 960 × 960 pixels, a face that looks straight ahead.
#[must_use]
pub fn portrait() -> Image {
    let mut image = Image::filled(PORTRAIT_SIZE, PORTRAIT_SIZE, LIGHT);
    draw(&mut image, SHADE, |ink| {
        for y in 0..PORTRAIT_SIZE / SQUARE {
            for x in (y % 2..PORTRAIT_SIZE / SQUARE).step_by(2) {
                let low = [x, y].map(|n| (n * SQUARE) as f64);
                ink.rounded(low, low.map(|c| c + SQUARE as f64), 0.0);
            }
        }
    });
    draw(&mut image, RINGS, |ink| {
        for radius in [310.0, 350.0, 390.0, 430.0] {
            ink.ring([480.0, 510.0], radius, 9.0);
        }
    });

    // Head.
    draw(&mut image, INK, |ink| _ = ink.disc([480.0, 520.0], 268.0));
    draw(&mut image, SKIN, |ink| _ = ink.disc([480.0, 520.0], 258.0));
    draw(&mut image, CHEEKS, |ink| {
        ink.disc([325.0, 592.0], 42.0).disc([635.0, 592.0], 42.0);
    });
    // Eyes, brows, nose, mouth.
    let eyes = [[385.0, 465.0], [575.0, 465.0]];
    let looks = |[x, y]: [f64; 2]| [x, y + 6.0];
    draw(&mut image, INK, |ink| {
        for eye in eyes {
            ink.disc(eye, 52.0);
        }
    });
    draw(&mut image, WHITE, |ink| {
        for eye in eyes {
            ink.disc(eye, 44.0);
        }
    });
    draw(&mut image, INK, |ink| {
        for eye in eyes {
            ink.disc(looks(eye), 23.0);
        }
        ink.polyline(&[[330.0, 384.0], [440.0, 384.0]], 17.0);
        ink.polyline(&[[520.0, 384.0], [630.0, 384.0]], 17.0);
        ink.polyline(&[[482.0, 500.0], [458.0, 578.0], [496.0, 584.0]], 11.0);
    });
    draw(&mut image, WHITE, |ink| {
        for [x, y] in eyes.map(looks) {
            ink.disc([x + 8.0, y - 9.0], 7.0);
        }
    });
    draw(&mut image, LIPS, |ink| {
        ink.polyline(&[[375.0, 660.0], [585.0, 660.0]], 20.0);
    });

    // Hat.
    draw(&mut image, INK, |ink| {
        ink.rounded([322.0, 88.0], [638.0, 320.0], 26.0);
        ink.rounded([232.0, 270.0], [728.0, 328.0], 29.0);
    });
    draw(&mut image, HAT, |ink| {
        ink.rounded([332.0, 98.0], [628.0, 310.0], 18.0);
        ink.rounded([242.0, 280.0], [718.0, 318.0], 19.0);
    });
    draw(&mut image, LIGHT, letters);
    image
}

/// What is done to the portrait unless told otherwise: it smiles, raises its brows, and
/// its hat leans over.
#[must_use]
pub fn portrait_drags() -> Vec<Drag> {
    let drag = |at, by| Drag { at, by };
    vec![
        drag([375.0, 660.0], [-24.0, -50.0]),
        drag([480.0, 660.0], [0.0, 28.0]),
        drag([585.0, 660.0], [24.0, -50.0]),
        drag([385.0, 384.0], [-8.0, -32.0]),
        drag([575.0, 384.0], [8.0, -20.0]),
        drag([350.0, 140.0], [46.0, -10.0]),
        drag([610.0, 140.0], [46.0, 12.0]),
        drag([480.0, 299.0], [0.0, 0.0]),
        drag([480.0, 545.0], [0.0, 0.0]),
        drag([303.0, 716.0], [0.0, 0.0]),
        drag([657.0, 716.0], [0.0, 0.0]),
        drag([480.0, 783.0], [0.0, 0.0]),
    ]
}

fn draw(image: &mut Image, colour: [f32; 3], shapes: impl FnOnce(&mut Ink)) {
    let mut ink = Ink::for_image(image);
    shapes(&mut ink);
    ink.paint(image, colour, 1.0);
}

/// `FFD` on the hat, in strokes.
fn letters(ink: &mut Ink) {
    let (top, middle, bottom) = (148.0, 188.0, 236.0);
    let width = 15.0;
    for left in [366.0, 450.0] {
        ink.polyline(&[[left + 50.0, top], [left, top], [left, bottom]], width);
        ink.line([[left, middle], [left + 40.0, middle]], width);
    }
    let left = 536.0;
    let bow = (0..=24).map(|i| {
        let turn = std::f64::consts::PI * (f64::from(i) / 24.0 - 0.5);
        let radius = (bottom - top) / 2.0;
        [
            left + 12.0 + radius * turn.cos(),
            f64::midpoint(top, bottom) + radius * turn.sin(),
        ]
    });
    let outline: Vec<_> = [[left, top]]
        .into_iter()
        .chain(bow)
        .chain([[left, bottom], [left, top]])
        .collect();
    ink.polyline(&outline, width);
}
