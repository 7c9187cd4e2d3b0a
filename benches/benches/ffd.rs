//! Free-form deformation: many points, Jacobians, updates, and direct manipulation.
//!
//! The job that is compared with other tools, by `benches/peers/ffd.py`: a million
//! points in a cubic lattice of 8 × 8 × 8 cells.

use std::hint::black_box;

use benches::{hemisphere, scattered};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use ffd_core::{
    Border, Constraint, Degree, DirectManipulation, Embedding, Frame, Grid, Lattice, Outside,
    PullOptions,
};

const POINTS: usize = 1_000_000;
const CELLS: usize = 8;

fn grid(cells: usize) -> Grid<3> {
    Grid::new([Degree::CUBIC; 3], [cells; 3], Frame::unit()).expect("a small lattice")
}

/// A lattice whose control points are displaced by up to a fifth of a cell.
fn displaced(grid: Grid<3>) -> Lattice<3> {
    let displacements = scattered(grid.control_point_count(), 2)
        .map(|p| p.map(|c| 0.4 * c - 0.2))
        .collect();
    Lattice::new(grid, displacements).expect("finite displacements")
}

/// Points scattered over the box.
fn cloud() -> Vec<[f64; 3]> {
    scattered(POINTS, 1)
        .map(|p| p.map(|c| c * CELLS as f64))
        .collect()
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "single precision is wanted"
)]
fn in_single(points: &[[f64; 3]]) -> Vec<[f32; 3]> {
    points.iter().map(|p| p.map(|c| c as f32)).collect()
}

fn evaluation(c: &mut Criterion) {
    let grid = grid(CELLS);
    let lattice = displaced(grid.clone());
    let points = cloud();
    let mut by_cell = points.clone();
    let cell = |p: &[f64; 3]| p.map(f64::floor);
    by_cell.sort_by(|a, b| cell(a).partial_cmp(&cell(b)).expect("numbers"));
    let single = in_single(&points);
    let mut out = points.clone();

    let mut group = c.benchmark_group("ffd_bind");
    group
        .sample_size(10)
        .throughput(Throughput::Elements(POINTS as u64));
    group.bench_function("f64", |b| {
        b.iter(|| Embedding::new(&grid, black_box(&points), Outside::Keep));
    });
    group.finish();

    let mut group = c.benchmark_group("ffd_bound");
    group
        .sample_size(20)
        .throughput(Throughput::Elements(POINTS as u64));
    for (name, points) in [("f64 scattered", &points), ("f64 by cell", &by_cell)] {
        let bound = Embedding::new(&grid, points, Outside::Keep).expect("finite");
        group.bench_function(name, |b| {
            b.iter(|| bound.deform_into(black_box(&lattice), &mut out));
        });
    }
    let bound = Embedding::new(&grid, &single, Outside::Keep).expect("finite");
    let mut single_out = single.clone();
    group.bench_function("f32 scattered", |b| {
        b.iter(|| bound.deform_into(black_box(&lattice), &mut single_out));
    });
    let bound = Embedding::new(&grid, &points, Outside::Keep).expect("finite");
    let mut jacobians = vec![[[0.0; 3]; 3]; POINTS];
    group.bench_function("f64 with Jacobians", |b| {
        b.iter(|| bound.deform_with_jacobians_into(black_box(&lattice), &mut out, &mut jacobians));
    });
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.expect("two threads");
        group.bench_function(BenchmarkId::new("f64 threads", threads), |b| {
            pool.install(|| b.iter(|| bound.par_deform_into(black_box(&lattice), &mut out)));
        });
    }
    group.finish();

    let mut group = c.benchmark_group("ffd_any_order");
    group
        .sample_size(20)
        .throughput(Throughput::Elements(POINTS as u64));
    // The lattice moves points by up to 0.2 cells: after many rounds in place they would
    // gather somewhere, so each round begins with the points at rest.
    group.bench_function("f64 with a copy", |b| {
        b.iter(|| {
            out.copy_from_slice(&points);
            lattice.deform_points(black_box(&mut out), Outside::Keep)
        });
    });
    group.bench_function("copy alone", |b| {
        b.iter(|| black_box(&mut out).copy_from_slice(black_box(&points)));
    });
    group.bench_function("f64 one at a time", |b| {
        b.iter(|| {
            for (out, &point) in out.iter_mut().zip(&points) {
                *out = lattice.deform_point(point);
            }
        });
    });
    group.finish();

    // All in the cache: what the kernels can do.
    let mut group = c.benchmark_group("ffd_one_cell");
    let grid = self::grid(1);
    let lattice = displaced(grid.clone());
    let points: Vec<[f64; 3]> = scattered(4096, 3).collect();
    let single = in_single(&points);
    let (mut out, mut single_out) = (points.clone(), single.clone());
    let mut jacobians = vec![[[0.0; 3]; 3]; points.len()];
    group.throughput(Throughput::Elements(points.len() as u64));
    let bound = Embedding::new(&grid, &points, Outside::Keep).expect("finite");
    group.bench_function("f64", |b| {
        b.iter(|| bound.deform_into(black_box(&lattice), &mut out));
    });
    group.bench_function("f64 with Jacobians", |b| {
        b.iter(|| bound.deform_with_jacobians_into(black_box(&lattice), &mut out, &mut jacobians));
    });
    let bound = Embedding::new(&grid, &single, Outside::Keep).expect("finite");
    group.bench_function("f32", |b| {
        b.iter(|| bound.deform_into(black_box(&lattice), &mut single_out));
    });
    group.finish();
}

fn update(c: &mut Criterion) {
    let grid = grid(CELLS);
    let mut lattice = displaced(grid.clone());
    let points = cloud();
    let mut bound = Embedding::new(&grid, &points, Outside::Keep).expect("finite");
    let mut out = points.clone();
    bound.deform_into(&lattice, &mut out).expect("bound to it");
    let middle = grid.control_point([5; 3]);
    let mut group = c.benchmark_group("ffd_update");
    group
        .sample_size(20)
        .throughput(Throughput::Elements(POINTS as u64));
    group.bench_function("one control point of 1331", |b| {
        let mut step = 0.0;
        b.iter(|| {
            step = 0.1 - step;
            lattice.set_displacement(middle, [step; 3]).expect("finite");
            bound.update_into(black_box(&lattice), &[middle], &mut out)
        });
    });
    group.finish();
}

/// Set-up and solution for a few dragged points, and for many.
fn direct_manipulation(c: &mut Criterion) {
    let mut group = c.benchmark_group("ffd_direct");
    // Cubic cells per axis: 8 for the few, 16 for the many.
    for (cells, count) in [(8, 1), (8, 8), (16, 1000)] {
        let grid = grid(cells)
            .with_border(Border::Identity)
            .expect("uniform knots");
        let points: Vec<[f64; 3]> = scattered(count, 4)
            .map(|p| p.map(|c| c * cells as f64))
            .collect();
        let displacements: Vec<[f64; 3]> = scattered(count, 5).collect();
        let mut changes = vec![[0.0; 3]; grid.control_point_count()];
        let options = PullOptions::default();
        if count > 100 {
            group.sample_size(20);
        }
        group.bench_function(BenchmarkId::new("set up and solve", count), |b| {
            b.iter(|| {
                let mut drag = DirectManipulation::new(&grid, black_box(&points), &options)
                    .expect("points inside");
                drag.solve_into(&displacements, &mut changes)
                    .expect("points apart")
            });
        });
        let mut drag = DirectManipulation::new(&grid, &points, &options).expect("points inside");
        group.bench_function(BenchmarkId::new("solve", count), |b| {
            b.iter(|| drag.solve_into(black_box(&displacements), &mut changes));
        });
    }
    group.finish();

    // A point of a squashed hemisphere is pulled, from scratch: the lattice for the
    // constraint, then all vertices, bound before or not.
    let vertices = hemisphere();
    let frame = Frame::of_box([-1.1, -1.1, -0.1], [1.1, 1.1, 0.6], [8; 3]).expect("a box");
    let grid = Grid::new([Degree::CUBIC; 3], [8; 3], frame).expect("a small lattice");
    let grid = grid.with_border(Border::Identity).expect("uniform knots");
    let bound = Embedding::new(&grid, &vertices, Outside::Keep).expect("finite");
    let pull = [Constraint::new([0.0, 0.0, 0.5], [0.0, 0.1, 0.3])];
    let mut lattice = Lattice::at_rest(grid).expect("a small lattice");
    let rest = lattice.displacements().to_vec();
    let mut out = vertices.clone();
    let mut group = c.benchmark_group("ffd_pull");
    group.throughput(Throughput::Elements(vertices.len() as u64));
    group.bench_function("2113 vertices", |b| {
        b.iter(|| {
            lattice.set_displacements(&rest).expect("zeros");
            lattice
                .pull(black_box(&pull), &PullOptions::default())
                .expect("one constraint");
            out.copy_from_slice(&vertices);
            lattice.deform_points(&mut out, Outside::Keep)
        });
    });
    group.bench_function("2113 vertices, bound", |b| {
        b.iter(|| {
            lattice.set_displacements(&rest).expect("zeros");
            lattice
                .pull(black_box(&pull), &PullOptions::default())
                .expect("one constraint");
            bound.deform_into(&lattice, &mut out)
        });
    });
    group.finish();
}

criterion_group!(ffd, evaluation, update, direct_manipulation);
criterion_main!(ffd);
