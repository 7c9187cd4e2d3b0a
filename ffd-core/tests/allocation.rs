//! What runs in every frame allocates nothing. A program of its own, because it counts
//! the allocations of the whole process.
#![expect(
    clippy::cast_possible_truncation,
    reason = "single precision is wanted"
)]

use allocation_counter::measure;
use ffd_core::{
    Border, Degree, DirectManipulation, Embedding, Fit, Frame, Grid, Lattice, Outside, PullOptions,
};

/// Runs something and says how often it allocated.
fn allocations(run: impl FnOnce()) -> u64 {
    measure(run).count_total
}

#[test]
fn deforming_a_bound_mesh_allocates_nothing() {
    let grid = Grid::new([Degree::CUBIC; 3], [4; 3], Frame::unit()).unwrap();
    for grid in [grid.clone(), grid.with_border(Border::Identity).unwrap()] {
        let points: Vec<[f64; 3]> = (0..20_000)
            .map(|i| [0.71, 0.37, 0.93].map(|s| 5.0 * (f64::from(i) * s).fract() - 0.5))
            .collect();
        let mut bound = Embedding::<f64, 3>::new(&grid, &points, Outside::Keep).unwrap();
        let clamped = Embedding::<f64, 3>::new(&grid, &points, Outside::Clamp).unwrap();
        let mut lattice = Lattice::at_rest(grid).unwrap();
        let displacements: Vec<[f64; 3]> = (0..lattice.displacements().len())
            .map(|i| [(i as f64).sin(), 0.0, 0.1])
            .collect();
        let (mut out, mut normals) = (points.clone(), points.clone());
        let mut jacobians = vec![[[0.0; 3]; 3]; points.len()];
        let mut single: Vec<[f32; 3]> = points.iter().map(|p| p.map(|c| c as f32)).collect();
        // The first update makes its marks.
        bound.update_into(&lattice, &[0], &mut out).unwrap();
        let count = allocations(|| {
            lattice.set_displacements(&displacements).unwrap();
            lattice.set_displacement(31, [1.0; 3]).unwrap();
            lattice.add_displacements(&displacements).unwrap();
            bound.deform_into(&lattice, &mut out).unwrap();
            clamped.deform_into(&lattice, &mut out).unwrap();
            bound.update_into(&lattice, &[31, 40], &mut out).unwrap();
            bound
                .deform_with_jacobians_into(&lattice, &mut out, &mut jacobians)
                .unwrap();
            bound
                .deform_with_normals_into(&lattice, &points, &mut out, &mut normals)
                .unwrap();
            lattice.deform_points(&mut out, Outside::Keep).unwrap();
            lattice.deform_points(&mut single, Outside::Clamp).unwrap();
            out[0] = lattice.deform_point(points[0]);
        });
        assert_eq!(count, 0);
    }
}

#[test]
fn dragging_points_allocates_nothing() {
    let grid = Grid::new([Degree::CUBIC; 3], [4; 3], Frame::unit()).unwrap();
    // Few points, many, and more than there are control points that act on them.
    for (count, fit) in [
        (5, Fit::Exact),
        (200, Fit::LeastSquares),
        (800, Fit::LeastSquares),
    ] {
        let place = |i: i32| [0.71, 0.37, 0.93].map(|s| 4.0 * (f64::from(i) * s).fract());
        let points: Vec<[f64; 3]> = (1..=count).map(place).collect();
        let options = PullOptions {
            fit,
            ..PullOptions::default()
        };
        let mut drag = DirectManipulation::new(&grid, &points, &options).unwrap();
        let mut changes = vec![[0.0; 3]; grid.control_point_count()];
        let mut lattice = Lattice::at_rest(grid.clone()).unwrap();
        let displacements = vec![[0.1, -0.2, 0.3]; points.len()];
        let allocated = allocations(|| {
            drag.solve_into(&displacements, &mut changes).unwrap();
            lattice.set_displacements(&changes).unwrap();
        });
        assert_eq!(allocated, 0, "{count} points");
    }
}

#[test]
fn allocations_are_counted() {
    assert_eq!(allocations(|| drop(std::hint::black_box(vec![1]))), 1);
}
