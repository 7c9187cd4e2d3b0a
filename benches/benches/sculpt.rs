//! Sculpting without folds, on one thread: pulls in steps, and a frame of the loop in which
//! a lattice is certified.

use std::{f64::consts::FRAC_PI_2, hint::black_box};

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use examples::{
    deformer::FreeForm,
    scene::{Object, ObjectKind, Resolution},
    soft_body::LEAST_VOLUME_RATIO,
};
use fem_tet::{Contact, TetMesh};
use ffd_core::{
    Border, Constraint, Degree, Frame, Grid, InjectiveOptions, InjectivePull, Outside, StepPolicy,
};

const POLICIES: [StepPolicy; 3] = [StepPolicy::Paper, StepPolicy::Exact, StepPolicy::Greedy];

fn cubic(low: [f64; 3], high: [f64; 3], cells: [usize; 3]) -> Grid<3> {
    let frame = Frame::of_box(low, high, cells).expect("a box");
    let grid = Grid::new([Degree::CUBIC; 3], cells, frame);
    grid.and_then(|grid| grid.with_border(Border::Identity))
        .expect("a small grid")
}

fn pull(grid: &Grid<3>, constraints: &[Constraint<3>], policy: StepPolicy) -> InjectivePull<3> {
    let options = InjectiveOptions {
        policy,
        ..InjectiveOptions::default()
    };
    let pull = grid
        .injective_pull(constraints, &options)
        .expect("in reach");
    assert!(pull.stopped.is_none(), "{:?}", pull.stopped);
    pull
}

/// A point of a hemisphere of radius 1 squashed to a height of 0.6.
fn on_hemisphere(direction: [f64; 3]) -> [f64; 3] {
    let length = direction.iter().map(|c| c * c).sum::<f64>().sqrt();
    let [x, y, z] = direction.map(|c| c / length);
    [x, 0.6 * y, z]
}

/// \[GD01\], Fig. 6 and 7: a squashed hemisphere of 2 113 vertices, pulled beyond its own
/// size (1M), and at two close points in opposite directions (2M). Steps are found and
/// applied to all vertices.
fn hemisphere(c: &mut Criterion) {
    let grid = cubic([-2.0, -1.5, -2.0], [2.0, 2.0, 2.0], [8, 7, 8]);
    let mut vertices = vec![on_hemisphere([0.0, 1.0, 0.0])];
    for ring in 1..=32_u32 {
        for k in 0..4 * ring {
            let (polar, around) = (
                FRAC_PI_2 * f64::from(ring) / 32.0,
                FRAC_PI_2 * f64::from(k) / f64::from(ring),
            );
            let radius = polar.sin();
            vertices.push(on_hemisphere([
                radius * around.cos(),
                polar.cos(),
                radius * around.sin(),
            ]));
        }
    }
    assert_eq!(vertices.len(), 2113);
    let over_extended = vec![Constraint::new(
        on_hemisphere([0.85, 0.5, 0.0]),
        [-1.9, 0.15, 0.0],
    )];
    let over_constrained = [-1.0, 1.0].map(|side| {
        Constraint::new(
            on_hemisphere([0.12 * side, 1.0, 0.0]),
            [0.42 * side, 0.25 * side, 0.0],
        )
    });
    let mut group = c.benchmark_group("injective pull, 2113 vertices");
    for (name, constraints) in [("1M", over_extended), ("2M", over_constrained.to_vec())] {
        for policy in POLICIES {
            let steps = pull(&grid, &constraints, policy).fractions.len();
            let id = BenchmarkId::new(name, format!("{policy:?}, {steps} steps"));
            group.bench_function(id, |b| {
                b.iter_batched_ref(
                    || vertices.clone(),
                    |vertices| {
                        let pull = pull(&grid, black_box(&constraints), policy);
                        for lattice in pull.sequence.lattices() {
                            lattice
                                .deform_points::<f64, _>(vertices, Outside::Keep)
                                .expect("finite");
                        }
                    },
                    criterion::BatchSize::SmallInput,
                );
            });
        }
    }
    group.finish();
}

/// Steps alone: one point dragged by three of 8 × 8 × 8 cells, two points a fifth of a cell
/// apart pulled apart by half a cell each.
fn drags(c: &mut Criterion) {
    let grid = cubic([0.0; 3], [8.0; 3], [8; 3]);
    let one = vec![Constraint::new([2.5, 4.5, 4.5], [3.0, 0.0, 0.0])];
    let pair = [-1.0, 1.0]
        .map(|side| Constraint::new([4.0 + 0.1 * side, 4.0, 4.0], [0.5 * side, 0.0, 0.0]));
    let mut group = c.benchmark_group("steps, 8x8x8 cells");
    for (name, constraints) in [("one point, 3 cells", one), ("two points", pair.to_vec())] {
        for policy in POLICIES {
            let steps = pull(&grid, &constraints, policy).fractions.len();
            let id = BenchmarkId::new(name, format!("{policy:?}, {steps} steps"));
            group.bench_function(id, |b| {
                b.iter(|| pull(&grid, black_box(&constraints), policy));
            });
        }
    }
    group.finish();
}

/// A frame in which five fingertips squeeze a cube of 2 197 nodes in 8 × 8 × 8 cells, from
/// displacements of the fingertips to displacements of the nodes: solved, proven not to
/// fold with bounds of the least determinant, applied, and no tetrahedron left too flat.
fn certified_frame(c: &mut Criterion) {
    let resolution = Resolution::new(12).expect("in range");
    let cube = Object::build(ObjectKind::Cube, resolution).expect("sound");
    // As large as eight cells of the deformer.
    let mesh = cube.file.mesh;
    let longest = mesh
        .positions()
        .iter()
        .map(|x| x[0].abs())
        .fold(0.0, f64::max);
    let scale = 0.066 / longest;
    let positions: Vec<[f64; 3]> = mesh
        .positions()
        .iter()
        .map(|x| x.map(|c| scale * c))
        .collect();
    let nearest = |target: [f64; 3]| {
        let distance = |x: &[f64; 3]| (0..3).map(|c| (x[c] - target[c]).powi(2)).sum::<f64>();
        let all = 0..positions.len();
        let node = all.min_by(|&a, &b| distance(&positions[a]).total_cmp(&distance(&positions[b])));
        u32::try_from(node.expect("nodes")).expect("few nodes")
    };
    let side = 0.066;
    let tips = [
        [side, 0.0, 0.0],
        [-side, 0.03, 0.02],
        [-side, 0.01, -0.02],
        [-side, -0.01, 0.02],
        [-side, -0.03, -0.02],
    ];
    let contacts: Vec<Contact> = tips
        .iter()
        .map(|&tip| Contact::weighted(&[(nearest(tip), 1.0)]).expect("one node"))
        .collect();
    let inward = |depth: f64| tips.map(|tip| [-depth * tip[0].signum(), 0.1 * depth, 0.0]);
    let mesh = TetMesh::new(positions.clone(), mesh.tets().to_vec()).expect("sound");
    let mut deformer = FreeForm::new(mesh).expect("a lattice");
    assert_eq!(deformer.grid().cells(), [8; 3]);
    deformer.hold(&contacts).expect("free of contradictions");
    let mut out = vec![[0.0; 3]; positions.len()];
    let mut group = c.benchmark_group("certified frame, 8x8x8 cells, 5 fingers, 2197 nodes");
    for (name, depth) in [("a little, 4 mm", 0.004), ("much, 12 mm", 0.012)] {
        group.bench_function(name, |b| {
            b.iter(|| {
                deformer.displace_into(black_box(&inward(depth)), LEAST_VOLUME_RATIO, &mut out)
            });
        });
    }
    // Deeper in every frame, until the lattice would fold; there it stops.
    let beyond = deformer.displace_into(&inward(0.06), LEAST_VOLUME_RATIO, &mut out);
    println!("squeezed by 60 mm: {beyond:?}");
    group.bench_function("beyond the fold", |b| {
        b.iter(|| deformer.displace_into(black_box(&inward(0.06)), LEAST_VOLUME_RATIO, &mut out));
    });
    group.finish();
}

criterion_group!(sculpt, hemisphere, drags, certified_frame);
criterion_main!(sculpt);
