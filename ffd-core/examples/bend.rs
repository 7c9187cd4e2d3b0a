//! Bends a bar upwards and prints where points of its axis go.
//!
//! Run with `cargo run -p ffd-core --example bend -- 0.25`, where the number is
//! the strength of the bend. Expect the ends to rise and the middle hardly;
//! `det J` below 1 says that space is squeezed there, below 0 that it is turned
//! inside out.

use ffd_core::{Degree, Frame, Lattice};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let argument = std::env::args().nth(1);
    let strength: f64 = argument.as_deref().unwrap_or("0.25").parse()?;

    // A bar of 4 × 1 × 1 around the x axis, with cells half a unit long.
    let frame = Frame::new(
        [-2.0, -0.5, -0.5],
        [[0.5, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 0.5]],
    )?;
    let (degree, cells) = ([Degree::CUBIC; 3], [8, 2, 2]);

    // Cross-sections at x rise by s x² / 2 and lean by the slope s x.
    let rest = Lattice::at_rest(degree, cells, frame)?;
    let displacements = (0..rest.control_point_count())
        .map(|i| {
            let [x, y, _] = rest.rest_position(i);
            [-strength * x * y, 0.5 * strength * x * x, 0.0]
        })
        .collect();
    let lattice = Lattice::new(degree, cells, frame, displacements)?;

    println!("{:^24}    {:^24}    det J", "point", "image");
    for i in 0..=8 {
        let point = [0.5 * f64::from(i) - 2.0, 0.25, 0.0];
        let image = lattice.deform_point(point).ok_or("outside the lattice")?;
        let j = lattice.jacobian_at(point).ok_or("outside the lattice")?;
        println!(
            "{}    {}    {:.4}",
            show(point),
            show(image),
            determinant(j)
        );
    }
    Ok(())
}

fn show([x, y, z]: [f64; 3]) -> String {
    format!("({x:6.3}, {y:6.3}, {z:6.3})")
}

fn determinant([a, b, c]: [[f64; 3]; 3]) -> f64 {
    a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
}
