//! Pinches a block of foam and prints how far it bulges and how hard it resists.
//!
//! Run with `cargo run -p fem-tet --example pinch -- 0.004`; the number is how far
//! each side is pressed in, metres.

use fem_tet::{ContactSet, ElasticBody, Material, TetMesh, total_volume};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let depth: f64 = std::env::args()
        .nth(1)
        .as_deref()
        .unwrap_or("0.004")
        .parse()?;

    // A 6 cm cube of 6 cells a side, each cell with its centre and twelve tetrahedra.
    let (cells, spacing) = (6_u32, 0.01);
    let id = |i: u32, j: u32, k: u32| i + (cells + 1) * (j + (cells + 1) * k);
    let mut positions = Vec::new();
    let grid =
        |n: u32| (0..n).flat_map(move |k| (0..n).flat_map(move |j| (0..n).map(move |i| [i, j, k])));
    for p in grid(cells + 1) {
        positions.push(p.map(|c| f64::from(c) * spacing));
    }
    let mut tets = Vec::new();
    for [i, j, k] in grid(cells) {
        let centre = u32::try_from(positions.len())?;
        positions.push([i, j, k].map(|c| (f64::from(c) + 0.5) * spacing));
        for axis in 0..3 {
            for (side, order) in [(0, [0, 1, 2, 3]), (1, [0, 3, 2, 1])] {
                // The four corners of one face, seen from inside.
                let corners = order.map(|c| {
                    let mut p = [i, j, k];
                    p[axis] += side;
                    p[(axis + 1) % 3] += [0, 1, 1, 0][c];
                    p[(axis + 2) % 3] += [0, 0, 1, 1][c];
                    id(p[0], p[1], p[2])
                });
                // The diagonal through the smallest corner, so that neighbours agree.
                let first = (0..4).min_by_key(|&c| corners[c]).expect("four corners");
                let c = |n: usize| corners[(first + n) % 4];
                tets.push([c(0), c(1), c(2), centre]);
                tets.push([c(0), c(2), c(3), centre]);
            }
        }
    }
    let mesh = TetMesh::new(positions, tets)?;
    let rest_volume = total_volume(mesh.positions(), mesh.tets());
    println!(
        "{} nodes, {} tetrahedra, {:.1} cm³",
        mesh.positions().len(),
        mesh.tets().len(),
        rest_volume * 1e6
    );

    let body = ElasticBody::new(mesh, Material::new(20e3, 0.4)?)?;
    // Four fingers on one side, the thumb on the other.
    let nodes = [
        id(0, 1, 3),
        id(0, 2, 3),
        id(0, 4, 3),
        id(0, 5, 3),
        id(6, 3, 3),
    ];
    let contacts = ContactSet::at_nodes(&body, &nodes)?;
    let mut d = [[depth, 0.0, 0.0]; 5];
    d[4] = [-depth, 0.0, 0.0];
    let mut u = vec![[0.0; 3]; body.mesh().positions().len()];
    let mut forces = [[0.0; 3]; 5];
    contacts.displacements_into(&d, &mut u);
    contacts.forces_into(&d, &mut forces);

    let bulge = u.iter().map(|u| u[1].abs()).fold(0.0, f64::max);
    println!(
        "pressed {:.1} mm a side, bulges {:.2} mm",
        depth * 1e3,
        bulge * 1e3
    );
    println!("the thumb pushes with {:.2} N", forces[4][0].abs());
    Ok(())
}
