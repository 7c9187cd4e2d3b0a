//! Sphere tree against parry3d's bounding-volume hierarchy: a whole hand, twenty
//! shapes, at a ball.
//!
//! The peer runs in its idiom: the boxes that meet the shape's box
//! (`Bvh::intersect_aabb`), then a test of each triangle. That test is the same
//! double-precision one on both sides, so that the trees are compared; before
//! anything is timed, both must find equally many shapes and triangles. A traversal
//! written for cylinders would serve the peer better than boxes do. parry's own shape
//! tests (GJK, in single precision) are not measured.

use std::hint::black_box;

use benches::{Hand, Surface};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec3;
use parry3d::{
    bounding_volume::Aabb,
    math::Vector,
    shape::{TriMesh, TriMeshFlags},
};
use spheretree::{Cylinder, Probe, Sphere, SphereTree};

/// Squares along an edge of the ball's cube: 300, 4 800 and 50 700 triangles.
const FINENESS: [u32; 3] = [5, 20, 65];
/// How far the hand presses in, and how far it stays away, metres.
const SCENES: [(&str, f64); 2] = [("hit", -2e-3), ("near", 2e-3)];

/// The hand in front of a surface, once for each library.
struct Scene {
    surface: Surface,
    tree: SphereTree,
    peer: TriMesh,
    hand: Hand,
    cylinder_boxes: Vec<Aabb>,
    tip_boxes: Vec<Aabb>,
    touched: Vec<u32>,
}

impl Scene {
    fn new(surface: &Surface, clearance_m: f64) -> Self {
        let hand = Hand::around(surface, clearance_m);
        Self {
            tree: SphereTree::build(surface.mesh()),
            peer: peer_mesh(surface),
            cylinder_boxes: hand.cylinders.iter().map(cylinder_box).collect(),
            tip_boxes: hand.tips.iter().map(tip_box).collect(),
            touched: Vec::new(),
            hand,
            surface: surface.clone(),
        }
    }

    /// How many of the twenty shapes touch the surface.
    fn any(&self) -> usize {
        let Self { tree, hand, .. } = self;
        let positions = &self.surface.positions;
        let segments = hand.cylinders.iter().filter(|c| tree.any(positions, *c));
        let tips = hand.tips.iter().filter(|t| tree.any(positions, *t));
        segments.count() + tips.count()
    }

    fn peer_any(&self) -> usize {
        let hand = &self.hand;
        let segments = self.cylinder_boxes.iter().zip(&hand.cylinders);
        let tips = self.tip_boxes.iter().zip(&hand.tips);
        segments
            .filter(|(aabb, c)| self.peer_hits(aabb, *c).next().is_some())
            .count()
            + tips
                .filter(|(aabb, t)| self.peer_hits(aabb, *t).next().is_some())
                .count()
    }

    /// How many triangles the twenty shapes touch, counted for each.
    fn collect(&mut self) -> usize {
        let Self {
            tree,
            hand,
            touched,
            surface,
            ..
        } = self;
        let mut count = 0;
        for cylinder in &hand.cylinders {
            tree.collect(&surface.positions, cylinder, touched);
            count += touched.len();
        }
        for tip in &hand.tips {
            tree.collect(&surface.positions, tip, touched);
            count += touched.len();
        }
        count
    }

    fn peer_collect(&mut self) -> usize {
        let mut touched = std::mem::take(&mut self.touched);
        let mut count = 0;
        for (aabb, cylinder) in self.cylinder_boxes.iter().zip(&self.hand.cylinders) {
            touched.clear();
            touched.extend(self.peer_hits(aabb, cylinder));
            touched.sort_unstable();
            count += touched.len();
        }
        for (aabb, tip) in self.tip_boxes.iter().zip(&self.hand.tips) {
            touched.clear();
            touched.extend(self.peer_hits(aabb, tip));
            touched.sort_unstable();
            count += touched.len();
        }
        self.touched = touched;
        count
    }

    /// Triangles whose box meets the shape's, and which then pass the exact test.
    fn peer_hits<'a>(
        &'a self,
        aabb: &'a Aabb,
        shape: &'a impl Probe,
    ) -> impl Iterator<Item = u32> + 'a {
        self.peer
            .bvh()
            .intersect_aabb(aabb)
            .filter(|&t| shape.intersects_triangle(self.surface.corners(t)))
    }
}

fn single([x, y, z]: [f64; 3]) -> Vector {
    #[expect(
        clippy::cast_possible_truncation,
        reason = "the peer computes in single precision"
    )]
    Vector::new(x as f32, y as f32, z as f32)
}

fn peer_mesh(surface: &Surface) -> TriMesh {
    let vertices = surface.positions.iter().copied().map(single).collect();
    TriMesh::with_flags(
        vertices,
        surface.triangles.clone(),
        TriMeshFlags::DEFORMABLE,
    )
    .expect("the surface has triangles")
}

/// A box a micrometre larger, against the rounding to single precision.
fn loose_box(low: DVec3, high: DVec3) -> Aabb {
    Aabb::new(
        single((low - 1e-6).to_array()),
        single((high + 1e-6).to_array()),
    )
}

fn tip_box(tip: &Sphere) -> Aabb {
    let center = DVec3::from(tip.center());
    loose_box(center - tip.radius(), center + tip.radius())
}

/// The tight box of a flat-capped cylinder.
fn cylinder_box(cylinder: &Cylinder) -> Aabb {
    let (start, end) = (DVec3::from(cylinder.start()), DVec3::from(cylinder.end()));
    let axis = (end - start).normalize();
    let across = cylinder.radius() * (DVec3::ONE - axis * axis).map(f64::sqrt);
    loose_box(start.min(end) - across, start.max(end) + across)
}

fn build_and_refit(c: &mut Criterion) {
    let surfaces = FINENESS.map(Surface::ball);
    let mut group = c.benchmark_group("build");
    for surface in &surfaces {
        let count = surface.triangles.len();
        group.throughput(Throughput::Elements(count as u64));
        group.bench_function(BenchmarkId::new("spheretree", count), |b| {
            b.iter(|| SphereTree::build(black_box(surface).mesh()));
        });
        group.bench_function(BenchmarkId::new("parry3d", count), |b| {
            b.iter(|| peer_mesh(black_box(surface)));
        });
    }
    group.finish();

    // Back and forth between two shapes, so that nobody finds nothing to do.
    let mut group = c.benchmark_group("refit");
    for surface in &surfaces {
        let count = surface.triangles.len();
        group.throughput(Throughput::Elements(count as u64));
        let squeezed = |&[x, y, z]: &[f64; 3]| [1.05 * x, 0.95 * y, z];
        let mut shape = surface.positions.clone();
        let mut other: Vec<_> = shape.iter().map(squeezed).collect();
        let mut tree = SphereTree::build(surface.mesh());
        group.bench_function(BenchmarkId::new("spheretree", count), |b| {
            b.iter(|| {
                std::mem::swap(&mut shape, &mut other);
                tree.refit(black_box(&shape))
            });
        });
        let mut peer = peer_mesh(surface);
        let mut shape: Vec<Vector> = shape.into_iter().map(single).collect();
        let mut other: Vec<Vector> = other.into_iter().map(single).collect();
        group.bench_function(BenchmarkId::new("parry3d", count), |b| {
            b.iter(|| {
                std::mem::swap(&mut shape, &mut other);
                peer.set_vertices(black_box(&shape));
            });
        });
    }
    group.finish();
}

fn whole_hand(c: &mut Criterion) {
    for (name, clearance_m) in SCENES {
        let mut scenes = FINENESS.map(|n| Scene::new(&Surface::ball(n), clearance_m));
        for scene in &mut scenes {
            let shapes = scene.any();
            assert_eq!(shapes == 0, name == "near", "{shapes} shapes touch");
            assert_eq!(scene.peer_any(), shapes);
            assert_eq!(scene.peer_collect(), scene.collect());
        }
        let mut group = c.benchmark_group(format!("any/{name}"));
        for scene in &scenes {
            let count = scene.surface.triangles.len();
            group.bench_function(BenchmarkId::new("spheretree", count), |b| {
                b.iter(|| black_box(scene).any());
            });
            group.bench_function(BenchmarkId::new("parry3d", count), |b| {
                b.iter(|| black_box(scene).peer_any());
            });
        }
        group.finish();
        let mut group = c.benchmark_group(format!("collect/{name}"));
        for scene in &mut scenes {
            let count = scene.surface.triangles.len();
            group.bench_function(BenchmarkId::new("spheretree", count), |b| {
                b.iter(|| black_box(&mut *scene).collect());
            });
            group.bench_function(BenchmarkId::new("parry3d", count), |b| {
                b.iter(|| black_box(&mut *scene).peer_collect());
            });
        }
        group.finish();
    }
}

criterion_group!(touch, build_and_refit, whole_hand);
criterion_main!(touch);
