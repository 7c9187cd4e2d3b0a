//! The tests of injectivity, on one thread unless said otherwise.
//!
//! All but the last groups ask for the sign of `det J` only, without a global theorem. At
//! set-up, random displacements are scaled until the determinant gets as close to zero as
//! wanted; the scales go to `target/injectivity.json`, where `benches/peers/injectivity.py`
//! finds them, so that peers judge the same cells.

use std::{hint::black_box, path::PathBuf};

use benches::scattered;
use criterion::{
    BenchmarkId, Criterion, SamplingMode, Throughput, criterion_group, criterion_main,
};
use ffd_core::{
    CheckOptions, Checker, ConicHull, Degree, Frame, Grid, Lattice, Method, StepOptions,
};
use serde_json::{Map, Value, json};

/// Cells that are judged one by one.
const LONE: u64 = 20;

/// The sign only.
fn sign(method: Method) -> CheckOptions {
    CheckOptions {
        method,
        global: false,
        ..CheckOptions::default()
    }
}

fn exact() -> CheckOptions {
    sign(Method::Exact)
}

/// A cubic lattice of unit cells whose control points are displaced by up to `amplitude`
/// along each axis.
fn noise(cells: usize, amplitude: f64, seed: u64) -> Lattice<3> {
    let grid = Grid::new([Degree::CUBIC; 3], [cells; 3], Frame::unit()).expect("a small lattice");
    let displacements = scattered(grid.control_point_count(), seed)
        .map(|p| p.map(|c| amplitude * (2.0 * c - 1.0)))
        .collect();
    Lattice::new(grid, displacements).expect("finite displacements")
}

fn lone_cells(amplitude: f64) -> Vec<Lattice<3>> {
    let seeds = 1..=LONE;
    seeds.map(|seed| noise(1, amplitude, seed)).collect()
}

/// The amplitude at which a predicate of the lattice turns from true to false.
fn amplitude(cells: usize, seed: u64, holds: impl Fn(&Lattice<3>) -> bool) -> f64 {
    let (mut low, mut high) = (0.0, 4.0);
    // As far as it makes a difference to a double.
    for _ in 0..53 {
        let middle = f64::midpoint(low, high);
        if holds(&noise(cells, middle, seed)) {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

/// The amplitude from which on a lattice folds.
fn limit(cells: usize) -> f64 {
    amplitude(cells, 1, |lattice| lattice.check(&exact()).is_regular())
}

/// The amplitude at which the least determinant of a lone cell is `least`.
fn amplitude_for_least(least: f64, seed: u64) -> f64 {
    let enclose = CheckOptions {
        enclose: Some(1e-3 * least),
        ..exact()
    };
    amplitude(1, seed, |lattice| {
        let verdict = lattice.check(&enclose);
        verdict.is_regular() && verdict.min_det[1] > least
    })
}

/// Writes what peers need to know.
fn write_scales(scales: &Value) {
    let folder = std::env::var_os("CARGO_TARGET_DIR").map_or_else(
        || PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../target")),
        PathBuf::from,
    );
    let written = std::fs::write(folder.join("injectivity.json"), scales.to_string());
    if let Err(error) = written {
        eprintln!("{}: {error}", folder.display());
    }
}

fn exact_test(c: &mut Criterion) {
    let options = exact();
    let mut group = c.benchmark_group("injectivity_lone_cell");
    group.throughput(Throughput::Elements(LONE));
    // Nearly all of the first pass the conic-hull test, none of the second.
    for amplitude in [0.2, 0.5] {
        let cells = lone_cells(amplitude);
        group.bench_function(amplitude.to_string(), |b| {
            b.iter(|| {
                let verdicts = cells.iter().map(|cell| black_box(cell).check(&options));
                verdicts.filter(ffd_core::Verdict::is_regular).count()
            });
        });
    }
    group.finish();

    let mut group = c.benchmark_group("injectivity_lattice");
    group.sample_size(20);
    let lattice = noise(10, 0.2, 1);
    group.throughput(Throughput::Elements(1000));
    group.bench_function("0.2, 1000 cells", |b| {
        b.iter(|| black_box(&lattice).check(&options));
    });
    let mut limits = Map::new();
    for cells in [10_usize, 20] {
        let count = cells.pow(3);
        let limit = limit(cells);
        limits.insert(cells.to_string(), json!(limit));
        let lattice = noise(cells, 0.999 * limit, 1);
        assert!(lattice.check(&options).is_regular());
        group.throughput(Throughput::Elements(count as u64));
        group.bench_function(format!("limit, {count} cells"), |b| {
            b.iter(|| black_box(&lattice).check(&options));
        });
        let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build();
        let pool = pool.expect("two threads");
        group.bench_function(format!("limit, {count} cells, two threads"), |b| {
            pool.install(|| b.iter(|| black_box(&lattice).par_check(&options)));
        });
    }
    group.finish();

    // Of twenty cells the median counts, so each is a benchmark of its own.
    let mut group = c.benchmark_group("injectivity_min_det");
    group
        .sample_size(10)
        .warm_up_time(std::time::Duration::from_millis(100))
        .measurement_time(std::time::Duration::from_millis(200));
    let mut leasts = Map::new();
    for least in [1e-3, 1e-6, 1e-9] {
        let amplitudes: Vec<_> = (1..=LONE)
            .map(|seed| amplitude_for_least(least, seed))
            .collect();
        for (seed, &amplitude) in (1..).zip(&amplitudes) {
            let cell = noise(1, amplitude, seed);
            group.bench_function(BenchmarkId::new(format!("{least:e}"), seed), |b| {
                b.iter(|| black_box(&cell).check(&options));
            });
        }
        leasts.insert(format!("{least:e}"), json!(amplitudes));
    }
    group.finish();

    let checked: Vec<_> = scattered(10, 9)
        .map(|p| {
            let point = p.map(|c| 10.0 * c);
            let there = lattice.evaluate(point).expect("inside");
            json!([point, there.determinant])
        })
        .collect();
    write_scales(&json!({ "limit": limits, "min_det": leasts, "det": checked }));
}

fn incremental(c: &mut Criterion) {
    let mut group = c.benchmark_group("injectivity_update");
    // Cones decide nearly all cells of the first lattice, and none of the second.
    for amplitude in [0.2, 0.5] {
        let mut lattice = noise(10, amplitude, 1);
        let mut checker = Checker::new(&lattice, &exact());
        let middle = lattice.grid().control_point([6; 3]);
        group.bench_function(format!("one control point, 1000 cells, {amplitude}"), |b| {
            let mut step = 0.75 * amplitude;
            b.iter(|| {
                step = -step;
                lattice.set_displacement(middle, [step; 3]).expect("finite");
                let verdict = checker.update(black_box(&lattice), &[middle]);
                verdict.expect("the same grid").is_regular()
            });
        });
    }
    group.finish();
}

fn other_methods(c: &mut Criterion) {
    let conic = sign(Method::Conic(ConicHull::default()));
    let mut group = c.benchmark_group("injectivity_conic");
    // Small enough that each cell passes.
    for cells in [10_usize, 20] {
        let lattice = noise(cells, 0.15, 1);
        let count = cells.pow(3);
        group.throughput(Throughput::Elements(count as u64));
        group.bench_function(format!("{count} cells"), |b| {
            b.iter(|| black_box(&lattice).check(&conic));
        });
    }
    group.finish();

    let mut group = c.benchmark_group("injectivity_slow");
    group.sample_size(10).sampling_mode(SamplingMode::Flat);
    let lattice = noise(2, 0.15, 1);
    group.throughput(Throughput::Elements(8));
    group.bench_function("phi, 8 cells", |b| {
        b.iter(|| black_box(&lattice).check(&sign(Method::Phi)));
    });
    let cell = noise(1, 0.2, 1);
    group.throughput(Throughput::Elements(1));
    group.bench_function("paper, one cell", |b| {
        b.iter(|| black_box(&cell).check(&sign(Method::Paper)));
    });
    group.finish();
}

/// One cell with `det J = ε + 2 (n·x − s)²` for the unit vector n along (1, 2, 3): nearly
/// zero on a plane that is oblique to all axes and cuts the cell in the middle.
///
/// It is `F(x) = x + n g(n·x)` with `g′(s) = ε − 1 + 2 (s − s₀)²`; a control point is the
/// polar form of the polynomial at the knots around it.
fn sheet(epsilon: f64) -> Lattice<3> {
    let n = [1.0, 2.0, 3.0].map(|c: f64| c / 14.0_f64.sqrt());
    let s0 = n.iter().sum::<f64>() / 2.0;
    let grid = Grid::new([Degree::CUBIC; 3], [1; 3], Frame::unit()).expect("one cell");
    // The polar form of the monomial of the given degree, for control point i.
    let polar = |degree: usize, i: usize| {
        let [a, b, c] = [-2.0, -1.0, 0.0].map(|knot| knot + i as f64);
        [
            1.0,
            (a + b + c) / 3.0,
            (a * b + a * c + b * c) / 3.0,
            a * b * c,
        ][degree]
    };
    let power = |x: f64, k: usize| (0..k).map(|_| x).product::<f64>();
    let factorial = |k: usize| (1..=k).product::<usize>() as f64;
    let displacements = (0..64).map(|index| {
        let at = grid.control_point_indices(index);
        // (n·x − s₀)ᵈ by the multinomial theorem.
        let shifted = |d: usize| {
            let mut sum = 0.0;
            for i in 0..=d {
                for j in 0..=d - i {
                    for k in 0..=d - i - j {
                        let rest = d - i - j - k;
                        let exponents = [i, j, k];
                        let mut term = factorial(d) / factorial(rest) * power(-s0, rest);
                        for axis in 0..3 {
                            let e = exponents[axis];
                            term *= power(n[axis], e) / factorial(e) * polar(e, at[axis]);
                        }
                        sum += term;
                    }
                }
            }
            sum
        };
        let g = (epsilon - 1.0) * shifted(1) + 2.0 / 3.0 * shifted(3);
        n.map(|c| c * g)
    });
    let displacements = displacements.collect();
    Lattice::new(grid, displacements).expect("finite displacements")
}

fn oblique_sheets(c: &mut Criterion) {
    let mut group = c.benchmark_group("injectivity_sheet");
    group.sample_size(10).sampling_mode(SamplingMode::Flat);
    for epsilon in [1e-3, 1e-4, 1e-5, 1e-6] {
        let cell = sheet(epsilon);
        // In the middle of the cell and at a corner.
        let det = |x| cell.evaluate(x).expect("inside").determinant;
        let corner = 2.0 * 9.0 / 14.0;
        assert!((det([0.5; 3]) - epsilon).abs() < 1e-12);
        assert!((det([1.0; 3]) - epsilon - corner).abs() < 1e-12);
        let outcome = cell.check(&exact()).outcome.name();
        group.bench_function(format!("{epsilon:e}, {outcome}"), |b| {
            b.iter(|| black_box(&cell).check(&exact()));
        });
    }
    group.finish();
}

/// How far random displacements can go from rest before something folds, to a millionth.
fn largest_safe_steps(c: &mut Criterion) {
    let options = StepOptions::default();
    let mut group = c.benchmark_group("injectivity_step");
    group.sample_size(20);
    for cells in [4_usize, 10] {
        let to = noise(cells, 2.0, 1);
        let rest = Lattice::at_rest(to.grid().clone()).expect("memory");
        let step = || rest.largest_safe_step(black_box(&to), &options);
        let [low, high] = step().expect("the same grid").t;
        assert!(high < 1.0 && high - low <= options.width * high);
        let count = cells.pow(3);
        group.throughput(Throughput::Elements(count as u64));
        group.bench_function(format!("{count} cells"), |b| b.iter(step));
    }
    group.finish();
}

/// Making and checking the certificates of 10 × 10 × 10 cells, for the sign alone and with a
/// theorem.
fn certificates(c: &mut Criterion) {
    let mut group = c.benchmark_group("injectivity_certificate");
    group.sample_size(10).sampling_mode(SamplingMode::Flat);
    group.throughput(Throughput::Elements(1000));
    let lattice = noise(10, 0.2, 1);
    let global = CheckOptions::default();
    for (name, options) in [("sign", exact()), ("theorem", global)] {
        let certificate = lattice.certify(&options).certificate.expect("regular");
        assert!(certificate.verify(&lattice).is_ok());
        group.bench_function(format!("verify, {name}"), |b| {
            b.iter(|| black_box(&certificate).verify(&lattice));
        });
        group.bench_function(format!("certify, {name}"), |b| {
            b.iter(|| black_box(&lattice).certify(&options));
        });
    }
    group.finish();
}

criterion_group!(
    injectivity,
    exact_test,
    largest_safe_steps,
    incremental,
    other_methods,
    oblique_sheets,
    certificates
);
criterion_main!(injectivity);
