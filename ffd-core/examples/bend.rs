//! Bends a bar upwards and prints where points of its axis go.
//!
//! Run with `cargo run -p ffd-core --example bend -- 0.25`, where the number is
//! the strength of the bend. Expect the ends to rise and the middle hardly;
//! `det J` below 1 says that space is squeezed there, below 0 that it is turned
//! inside out.

use ffd_core::{Degree, Frame, Grid, Lattice};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let argument = std::env::args().nth(1);
    let strength: f64 = argument.as_deref().unwrap_or("0.25").parse()?;

    // A bar of 4 × 1 × 1 around the x axis, with cells half a unit long.
    let frame = Frame::new(
        [-2.0, -0.5, -0.5],
        [[0.5, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 0.5]],
    )?;
    let grid = Grid::new([Degree::CUBIC; 3], [8, 2, 2], frame)?;

    // Cross-sections at x rise by s x² / 2 and lean by the slope s x.
    let displacements = (0..grid.control_point_count())
        .map(|i| {
            let [x, y, _] = grid.rest_position(i);
            [-strength * x * y, 0.5 * strength * x * x, 0.0]
        })
        .collect();
    let lattice = Lattice::new(grid, displacements)?;

    println!("{:^24}    {:^24}    det J", "point", "image");
    for i in 0..=8 {
        let point = [0.5 * f64::from(i) - 2.0, 0.25, 0.0];
        let at = lattice.evaluate(point).ok_or("outside the lattice")?;
        println!(
            "{}    {}    {:.4}",
            show(point),
            show(at.position),
            at.determinant
        );
    }
    Ok(())
}

fn show([x, y, z]: [f64; 3]) -> String {
    format!("({x:6.3}, {y:6.3}, {z:6.3})")
}
