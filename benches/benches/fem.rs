//! Elasticity: what happens once per shape, once per grasp, and in every frame.
//!
//! Balls of the loop, the first a little larger than the thesis's objects of 267
//! nodes. Five fingertips press on patches of the surface, as in the loop. The peer of
//! the per-frame product is nalgebra's matrix–vector product with the same matrix.

use std::hint::black_box;

use criterion::{BatchSize, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use examples::{
    deformer::{Deformer, DeformerKind},
    scene::{Object, ObjectKind, Resolution},
    soft_body::SoftBody,
    touch::Surface,
};
use fem_tet::{Contact, ContactSet, ElasticBody};
use glam::DVec3;
use nalgebra::{DMatrix, DVector};
use spheretree::Sphere;

/// Cells across the ball; 5 is the loop's default.
const CELLS: [u32; 3] = [5, 10, 15];
const BALL_RADIUS_M: f64 = 0.032;
const TIP_RADIUS_M: f64 = 0.008;
/// Radius of a fingertip's patch, metres: the loop's.
const PATCH_RADIUS_M: f64 = 0.012;
/// Directions from which thumb and fingers press.
const FINGERS: [DVec3; 5] = [
    DVec3::new(-1.0, -0.3, 0.2),
    DVec3::new(1.0, 0.0, -0.9),
    DVec3::new(1.0, 0.0, -0.3),
    DVec3::new(1.0, 0.0, 0.3),
    DVec3::new(1.0, 0.0, 0.9),
];

fn ball(cells: u32) -> Object {
    let resolution = Resolution::new(cells).expect("in range");
    Object::build(ObjectKind::Ball, resolution).expect("a sound mesh")
}

fn elastic(body: &SoftBody) -> &ElasticBody {
    match body.deformer() {
        Deformer::Elastic(elastic) => elastic.body(),
        Deformer::FreeForm(_) => unreachable!("these bodies are elastic"),
    }
}

/// The patch under a fingertip that comes to the ball from a direction.
fn contact(body: &SoftBody, direction: DVec3) -> Contact {
    let Surface { tree, positions } = body.surface();
    let center = direction.normalize() * BALL_RADIUS_M;
    let tip = Sphere::new(center.to_array(), TIP_RADIUS_M).expect("a fingertip");
    let touched = tree.sphere_contact(positions, &tip, 0.0);
    body.patch(
        &touched.expect("the fingertip is at the surface"),
        PATCH_RADIUS_M,
    )
}

fn elasticity(c: &mut Criterion) {
    let mut group = c.benchmark_group("assemble_and_factor");
    for cells in CELLS {
        let Object { file, material, .. } = ball(cells);
        let nodes = file.mesh.positions().len();
        group.throughput(Throughput::Elements(nodes as u64));
        group.bench_function(BenchmarkId::new("fem-tet", nodes), |b| {
            b.iter_batched(
                || file.mesh.clone(),
                |mesh| ElasticBody::new(mesh, material).expect("a sound body"),
                BatchSize::LargeInput,
            );
        });
    }
    group.finish();

    let bodies =
        CELLS.map(|cells| SoftBody::new(ball(cells), DeformerKind::Fem).expect("a sound body"));
    let contacts = bodies
        .each_ref()
        .map(|body| FINGERS.map(|finger| contact(body, finger)).to_vec());

    let mut group = c.benchmark_group("condense_to_5_contacts");
    for (body, contacts) in bodies.iter().zip(&contacts) {
        let nodes = body.positions().len();
        group.throughput(Throughput::Elements(nodes as u64));
        group.bench_function(BenchmarkId::new("fem-tet", nodes), |b| {
            b.iter_batched(
                || contacts.clone(),
                |contacts| ContactSet::new(elastic(body), contacts).expect("held"),
                BatchSize::LargeInput,
            );
        });
    }
    group.finish();

    // One element is one multiply-add.
    let mut group = c.benchmark_group("displacements_into");
    for (body, contacts) in bodies.iter().zip(contacts) {
        let nodes = body.positions().len();
        let set = ContactSet::new(elastic(body), contacts).expect("held");
        let pressed = FINGERS.map(|finger| (-0.005 * finger.normalize()).to_array());
        let mut out = vec![[0.0; 3]; nodes];
        group.throughput(Throughput::Elements(9 * 5 * nodes as u64));
        group.bench_function(BenchmarkId::new("fem-tet", nodes), |b| {
            b.iter(|| set.displacements_into(black_box(&pressed), &mut out));
        });
        let map = displacement_map(&set, nodes);
        let vector = DVector::from_column_slice(pressed.as_flattened());
        let mut product = DVector::zeros(3 * nodes);
        group.bench_function(BenchmarkId::new("nalgebra", nodes), |b| {
            b.iter(|| product.gemv(1.0, &map, black_box(&vector), 0.0));
        });
        let found = DVector::from_column_slice(out.as_flattened());
        assert!((found - product).amax() < 1e-15, "the peer differs");
    }
    group.finish();
}

/// The matrix that a contact set applies: its answers to unit displacements.
fn displacement_map(set: &ContactSet, nodes: usize) -> DMatrix<f64> {
    let count = set.contacts().len();
    let mut map = DMatrix::zeros(3 * nodes, 3 * count);
    let mut out = vec![[0.0; 3]; nodes];
    for (i, mut column) in map.column_iter_mut().enumerate() {
        let mut unit = vec![[0.0; 3]; count];
        unit[i / 3][i % 3] = 1.0;
        set.displacements_into(&unit, &mut out);
        column.copy_from_slice(out.as_flattened());
    }
    map
}

criterion_group!(fem, elasticity);
criterion_main!(fem);
