//! Lowers a cylinder onto a sphere and prints the triangles it touches.
//!
//! Run with `cargo run -p spheretree --example touch`, or give the number of
//! subdivisions of the sphere, 0 to 7: `… --example touch -- 5`. Expect a few
//! heights without a touch, then a growing patch around the north pole.

use std::collections::HashMap;

use spheretree::{Cylinder, Mesh, Sphere, SphereTree};

/// The object is as large as an orange.
const RADIUS_M: f64 = 0.04;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let subdivisions: u32 = std::env::args().nth(1).as_deref().unwrap_or("4").parse()?;
    if subdivisions > 7 {
        return Err("more than 7 subdivisions make a sphere of over 500 000 triangles".into());
    }
    let (positions, triangles) = octahedral_sphere(subdivisions);
    let tree = SphereTree::build(Mesh::new(&positions, &triangles)?);
    println!(
        "{} triangles, tree of depth {}",
        tree.triangle_count(),
        tree.depth()
    );
    for level in 0..=tree.depth() {
        let largest = tree.level(level).map(|s| s.radius()).fold(0.0, f64::max);
        println!(
            "  level {level}: {:4} spheres, the largest of radius {:.1} mm",
            tree.level(level).count(),
            1e3 * largest
        );
    }

    println!("\nA finger segment, radius 8 mm, comes down on the north pole:");
    let mut touched = Vec::new();
    for step in 0..8 {
        let height_m = 0.0025 - 0.001 * f64::from(step);
        let y = RADIUS_M + height_m;
        let segment = Cylinder::new([0.0, y, 0.0], [0.0, y + 0.03, 0.0], 0.008)?;
        tree.collect(&positions, &segment, &mut touched);
        let shown = &touched[..touched.len().min(6)];
        let more = if touched.len() > 6 { " …" } else { "" };
        println!(
            "  {:+.1} mm: {:3} triangles {shown:?}{more}",
            1e3 * height_m,
            touched.len()
        );
    }

    let tip = Sphere::new([0.0, RADIUS_M + 0.005, 0.0], 0.008)?;
    match tree.sphere_contact(&positions, &tip, 0.0) {
        Some(contact) => println!(
            "\nIts tip, a sphere 5 mm above the pole, presses {:.1} mm deep on triangle {}.",
            1e3 * contact.depth,
            contact.triangle
        ),
        None => println!("\nIts tip does not touch."),
    }
    Ok(())
}

/// A sphere from an octahedron: each subdivision cuts every triangle in four.
fn octahedral_sphere(subdivisions: u32) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let mut positions = vec![
        [RADIUS_M, 0., 0.],
        [-RADIUS_M, 0., 0.],
        [0., RADIUS_M, 0.],
        [0., -RADIUS_M, 0.],
        [0., 0., RADIUS_M],
        [0., 0., -RADIUS_M],
    ];
    let mut triangles = Vec::new();
    for (x, y, z) in [(0, 2, 4), (4, 2, 1), (1, 2, 5), (5, 2, 0)] {
        triangles.push([z, x, y]);
        triangles.push([x, z, y + 1]);
    }
    for _ in 0..subdivisions {
        let mut middles = HashMap::new();
        let mut middle = |i: u32, j: u32| {
            *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                let (p, q) = (positions[i as usize], positions[j as usize]);
                let sum = [p[0] + q[0], p[1] + q[1], p[2] + q[2]];
                let norm = sum.iter().map(|x| x * x).sum::<f64>().sqrt();
                positions.push(sum.map(|x| RADIUS_M * x / norm));
                u32::try_from(positions.len() - 1).expect("at most 7 subdivisions")
            })
        };
        triangles = triangles
            .iter()
            .flat_map(|&[a, b, c]| {
                let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    (positions, triangles)
}
