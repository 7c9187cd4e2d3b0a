//! Tests that no result depends on the SIMD level.

use fearless_simd::Level;

use crate::{Border, Degree, Embedding, Frame, Grid, Knots, Lattice, Outside, Scalar};

/// Every level that this machine can run.
pub(crate) fn levels() -> Vec<Level> {
    let mut levels = vec![Level::new(), Level::baseline()];
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    {
        let best = Level::new();
        levels.extend(best.as_sse2().map(Level::Sse2));
        levels.extend(best.as_sse4_2().map(Level::Sse4_2));
        levels.extend(best.as_avx2().map(Level::Avx2));
        levels.extend(best.as_avx512().map(Level::Avx512));
    }
    levels
}

/// A lattice with displacements and points that look random, some of them outside.
fn sample<const D: usize>(grid: Grid<D>) -> (Lattice<D>, Vec<[f64; D]>) {
    let noise = |i: usize, c: usize| ((i * D + c) as f64 * 12.9898).sin() * 43758.5453 % 1.0;
    let displacements = (0..grid.control_point_count())
        .map(|i| std::array::from_fn(|c| noise(i, c)))
        .collect();
    let domain = grid.domain();
    let points = (0..500)
        .map(|i| {
            grid.frame().to_world(std::array::from_fn(|c| {
                let [low, high] = domain[c];
                low + (high - low) * (0.5 + 0.55 * noise(7 * i + 3, c))
            }))
        })
        .collect();
    (Lattice::new(grid, displacements).unwrap(), points)
}

/// Images, Jacobians and bulk images at a level, in a given precision, as bits.
fn bits<S: Scalar, const D: usize>(
    level: Level,
    lattice: &Lattice<D>,
    points: &[[f64; D]],
) -> Vec<u64> {
    let points: Vec<[S; D]> = points.iter().map(|p| p.map(S::from_f64)).collect();
    let bound = Embedding::<S, D>::new(lattice.grid(), &points, Outside::Clamp).unwrap();
    let mut images = points.clone();
    let mut jacobians = Vec::new();
    for batch in &bound.batches {
        bound.deform_batch(level, lattice, batch, &mut images);
        bound.evaluate_batch(level, lattice, batch, |_, image, jacobian| {
            jacobians.extend(image);
            jacobians.extend(jacobian.as_flattened());
        });
    }
    let mut in_place = points.clone();
    lattice.deform_checked::<S, _>(level, &mut in_place, Outside::Clamp);
    let all = images.as_flattened().iter().chain(&jacobians);
    all.chain(in_place.as_flattened())
        .map(|x| x.to_f64().to_bits())
        .collect()
}

fn check<const D: usize>(grid: Grid<D>) {
    let (lattice, points) = sample(grid);
    let first = Level::new();
    let double = bits::<f64, D>(first, &lattice, &points);
    let single = bits::<f32, D>(first, &lattice, &points);
    for level in levels() {
        assert!(
            bits::<f64, D>(level, &lattice, &points) == double,
            "{level:?}"
        );
        assert!(
            bits::<f32, D>(level, &lattice, &points) == single,
            "{level:?}"
        );
    }
}

#[test]
fn results_are_equal_to_the_last_bit_at_every_level() {
    let skewed = Frame::new(
        [3.0, -1.0, 2.0],
        [[0.5, 0.25, 0.0], [0.125, 1.0, -0.25], [0.0, 0.5, -1.5]],
    )
    .unwrap();
    let mixed = [Degree::LINEAR, Degree::CUBIC, Degree::new(5).unwrap()];
    for degree in [[Degree::CUBIC; 3], mixed] {
        let grid = Grid::new(degree, [3, 2, 4], skewed).unwrap();
        check(grid.clone());
        check(grid.clone().with_border(Border::Identity).unwrap());
        check(grid.with_knots([Knots::Clamped; 3]).unwrap());
    }
    let flat = Frame::new([3.0, -1.0], [[0.5, 0.25], [0.5, -1.0]]).unwrap();
    for degree in [[Degree::CUBIC; 2], [Degree::QUADRATIC, Degree::CUBIC]] {
        check(Grid::new(degree, [3, 4], flat).unwrap());
    }
}
