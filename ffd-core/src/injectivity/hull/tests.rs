//! Tests of the cones.

use super::super::samples::{lattices, linear, noise, passing_cells};
use super::*;
use crate::{Degree, Frame, Grid, Lattice};
use proptest::prelude::*;
use std::f64::consts::FRAC_PI_2;

const PER_CELL: ConicHull = ConicHull {
    one_for_all: false,
    subdivisions: 0,
    off_axis: false,
};

fn passes<const D: usize>(lattice: &Lattice<D>, hull: ConicHull) -> bool {
    test(&Partials::new(lattice), hull, &Budget::default(), |_| false).is_none()
}

/// The appendix of the paper, word by word, for one cell: arcs and sines. Also how close
/// it comes to the other answer.
fn appendix(columns: &Columns<3>) -> (bool, f64) {
    let mut theta = [0.0_f64; 3];
    for a in 0..3 {
        let mut m = 0.0_f64;
        for i in 0..columns.vectors[a][0].len() {
            let v = columns.vector(a, i);
            let (a, b, c) = (v[a], v[(a + 1) % 3], v[(a + 2) % 3]);
            if a <= 0.0 {
                return (false, a.abs());
            }
            m = m.max((b * b + c * c) / (a * a));
        }
        theta[a] = m.sqrt().atan();
    }
    let [u, v, w] = theta;
    if u + v >= FRAC_PI_2 {
        return (false, (u + v - FRAC_PI_2).abs());
    }
    let squared = u.sin().powi(2) + v.sin().powi(2);
    let cross = squared.min(1.0).sqrt().asin();
    // The arc sine is steep near a right angle.
    let margin = (cross + w - FRAC_PI_2).abs().min(1.0 - squared);
    (cross + w < FRAC_PI_2, margin)
}

/// The determinant of rows.
fn determinant<const D: usize>(rows: &[[f64; D]; D]) -> f64 {
    inverse(rows).1
}

fn unit<const D: usize>(v: [f64; D]) -> [f64; D] {
    let length = dot(v, v).sqrt();
    v.map(|x| x / length)
}

fn dot<const D: usize>(a: [f64; D], b: [f64; D]) -> f64 {
    (0..D).map(|c| a[c] * b[c]).sum()
}

/// For cones that do not pass, a vector n that is perpendicular to a vector of each.
fn common_normal<const D: usize>(rows: &[[f64; D]; D], sines: [f64; D]) -> [f64; D] {
    let (inverse, _) = inverse(rows);
    let vertices = (0..1 << (D - 1)).map(|signs: usize| -> [f64; D] {
        std::array::from_fn(|r| {
            (0..D)
                .map(|k| {
                    let negative = k > 0 && signs >> (k - 1) & 1 == 1;
                    let s = sines[k].sqrt();
                    inverse[r][k] * if negative { -s } else { s }
                })
                .sum()
        })
    });
    vertices
        .max_by(|&a, &b| dot(a, a).total_cmp(&dot(b, b)))
        .unwrap()
}

/// The criterion is necessary and sufficient: vectors from cones that pass are
/// independent and positive; in cones that do not pass there are dependent ones.
fn criterion_is_exact<const D: usize>(
    rows: [[f64; D]; D],
    sines: [f64; D],
    inside: &[[f64; D]; D],
) -> Result<(), TestCaseError> {
    prop_assume!(determinant(&rows) > 0.01);
    let normal = common_normal(&rows, sines);
    let length = dot(normal, normal).sqrt();
    prop_assume!((length - 1.0).abs() > 1e-6);
    let passes = separate(&rows, sines);
    prop_assert_eq!(passes, length < 1.0);
    let vectors: [[f64; D]; D] = std::array::from_fn(|a| {
        let c = rows[a];
        if passes {
            // Across the axis, by as much as the cone allows.
            let t = dot(inside[a], c);
            let across: [f64; D] = std::array::from_fn(|k| inside[a][k] - t * c[k]);
            let across = unit(across);
            let (sine, cosine) = (sines[a].sqrt(), (1.0 - sines[a]).sqrt());
            std::array::from_fn(|k| cosine * c[k] + sine * across[k])
        } else {
            let n = unit(normal);
            let t = dot(n, c);
            std::array::from_fn(|k| c[k] - t * n[k])
        }
    });
    for a in 0..D {
        let cosine = dot(unit(vectors[a]), rows[a]);
        prop_assert!(1.0 - cosine * cosine <= sines[a] + 1e-9);
    }
    let determinant = determinant(&vectors);
    if passes {
        prop_assert!(determinant > -1e-12, "{}", determinant);
    } else {
        prop_assert!(determinant.abs() < 1e-9, "{}", determinant);
    }
    Ok(())
}

fn directions<const D: usize>() -> impl Strategy<Value = [[f64; D]; D]> {
    proptest::collection::vec(-1.0..1.0_f64, D * D).prop_filter_map("zero", |v| {
        let rows: [[f64; D]; D] = std::array::from_fn(|r| std::array::from_fn(|c| v[r * D + c]));
        rows.iter()
            .all(|&r| dot(r, r) > 1e-3)
            .then(|| rows.map(unit))
    })
}

proptest! {
    /// With cones around any axes, in space.
    #[test]
    fn the_criterion_is_exact_in_space(
        mut rows in directions::<3>(),
        sines in [0.0..0.9_f64, 0.0..0.9, 0.0..0.9],
        scale in 0.0..1.0_f64,
        inside in directions::<3>(),
    ) {
        if determinant(&rows) < 0.0 {
            rows.swap(0, 1);
        }
        criterion_is_exact(rows, sines.map(|s| s * scale), &inside)?;
    }

    /// In the plane.
    #[test]
    fn the_criterion_is_exact_in_the_plane(
        mut rows in directions::<2>(),
        sines in [0.0..0.99_f64, 0.0..0.99],
        inside in directions::<2>(),
    ) {
        if determinant(&rows) < 0.0 {
            rows.swap(0, 1);
        }
        criterion_is_exact(rows, sines, &inside)?;
    }

    /// Around the axes of the lattice it is the sum of the squared sines.
    #[test]
    fn around_the_axes_it_is_a_sum(sines in [0.0..0.9_f64, 0.0..0.9, 0.0..0.9]) {
        let sum: f64 = sines.iter().sum();
        prop_assume!((sum - 1.0).abs() > 1e-12);
        let axes = std::array::from_fn(|r| {
            std::array::from_fn(|c| crate::frame::unit_entry(r, c))
        });
        prop_assert_eq!(separate(&axes, sines), sum < 1.0);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    /// The closed form decides as the arcs and sines of the appendix do.
    #[test]
    fn the_appendix_is_a_sum_of_squares(lattice in lattices::<3>(3, 2, 0.6)) {
        let partials = Partials::new(&lattice);
        let mut columns = Columns::new();
        let cones = passing_cells(&partials);
        for number in 0..partials.cell_count() {
            columns.set_control(&partials, partials.cell(number));
            let (expected, margin) = appendix(&columns);
            if margin > 1e-9 {
                prop_assert_eq!(cones[number], expected);
                let axes = Axes::Lattice;
                prop_assert_eq!(axes.separate(axes.sines(&columns)), expected);
            }
        }
    }

    /// One set of cones is that of all vectors, however they are found.
    #[test]
    fn one_set_holds_all_vectors(lattice in lattices::<3>(3, 3, 0.5)) {
        let partials = Partials::new(&lattice);
        let mut all = Columns::new();
        all.set_all(&partials);
        let sum: f64 = Axes::Lattice.sines(&all).iter().sum();
        prop_assume!((sum - 1.0).abs() > 1e-9);
        prop_assert_eq!(pass_as_one(&partials), sum < 1.0);
        let axis_aligned = noise(
            Grid::new(lattice.grid().degree(), lattice.grid().cells(), Frame::unit()).unwrap(),
            0.15,
            1,
        );
        let partials = Partials::without_vectors(&axis_aligned);
        prop_assert!((0..3).all(|axis| partials.plain(axis).is_some()));
        let differences = pass_as_one(&partials);
        let partials = Partials::new(&axis_aligned);
        all.set_all(&partials);
        let sum: f64 = Axes::Lattice.sines(&all).iter().sum();
        prop_assert_eq!(differences, sum < 1.0);
    }

    /// What passes with one set of cones passes with one for each cell; what passes,
    /// passes with more subdivisions (around the axes: elsewhere the cones are others).
    #[test]
    fn finer_tests_accept_more(lattice in lattices::<2>(4, 3, 1.2), one_for_all: bool) {
        let hull = |one_for_all, subdivisions| ConicHull {
            one_for_all,
            subdivisions,
            off_axis: false,
        };
        for subdivisions in 0..3 {
            let pass = passes(&lattice, hull(one_for_all, subdivisions));
            if pass {
                prop_assert!(passes(&lattice, hull(false, subdivisions)));
                prop_assert!(passes(&lattice, hull(one_for_all, subdivisions + 1)));
            }
        }
    }
}

#[test]
fn rotations_cost_nothing_off_the_axes() {
    for degrees in [50.0, 120.0, 180.0] {
        let (sin, cos) = f64::sin_cos(f64::to_radians(degrees));
        let lattice = linear(3, 2, [[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]]);
        for one_for_all in [false, true] {
            let around_axes = ConicHull {
                one_for_all,
                ..PER_CELL
            };
            let around_mean = ConicHull {
                off_axis: true,
                ..around_axes
            };
            assert!(!passes(&lattice, around_axes));
            assert!(passes(&lattice, around_mean));
        }
    }
    let mirrored = linear(2, 1, [[0.0, 1.0], [1.0, 0.0]]);
    let around_mean = ConicHull {
        off_axis: true,
        ..PER_CELL
    };
    assert!(!passes(&mirrored, around_mean));
}

/// A shear by 50 degrees or more: one column leans, and the axes are not at right angles.
#[test]
fn shears_are_for_skewed_cones() {
    let around_mean = ConicHull {
        off_axis: true,
        ..PER_CELL
    };
    assert!(passes(&linear(2, 2, [[1.0, 5.0], [0.0, 1.0]]), around_mean));
    let all = [[1.0, 2.0, 0.0], [-1.0, 1.0, 1.0], [0.0, 0.5, 1.0]];
    assert!(passes(&linear(2, 2, all), around_mean));
    assert!(!passes(&linear(2, 2, all), PER_CELL));
}

/// Random lattices of one cell, as in the measurements of the design: more subdivisions
/// accept more, cones off the axes more than those around them.
#[test]
fn subdivision_helps() {
    let grid = || Grid::new([Degree::CUBIC; 3], [1; 3], Frame::unit()).unwrap();
    let accepted = |hull: ConicHull, amplitude: f64| {
        (0..8)
            .filter(|&seed| passes(&noise(grid(), amplitude, seed), hull))
            .count()
    };
    let cut = |subdivisions| ConicHull {
        subdivisions,
        ..PER_CELL
    };
    assert_eq!(accepted(PER_CELL, 0.2), 8);
    assert_eq!(accepted(PER_CELL, 0.6), 0);
    assert_eq!(accepted(cut(1), 0.6), 8);
    assert!(accepted(cut(1), 1.0) < 8);
}

#[test]
fn a_failure_names_the_part() {
    // One corner of one cell of a clamped lattice is folded.
    let grid = Grid::bezier([Degree::QUADRATIC; 2], Frame::unit()).unwrap();
    let mut lattice = Lattice::at_rest(grid).unwrap();
    lattice.set_displacement(8, [-1.0, 0.0]).unwrap();
    let hull = ConicHull {
        subdivisions: 3,
        ..PER_CELL
    };
    let partials = Partials::new(&lattice);
    let failure = test(&partials, hull, &Budget::default(), |_| false).unwrap();
    assert_eq!(failure.cell, [0, 0]);
    let [[left, right], [bottom, top]] = failure.part;
    assert!((right - left - 0.125).abs() < 1e-15 && (top - bottom - 0.125).abs() < 1e-15);
    // The slope along x is 1 − 2 x y².
    assert!(2.0 * right * top * top >= 1.0, "{:?}", failure.part);
    let little = Budget {
        boxes: 3,
        ..Budget::default()
    };
    let failure = test(&partials, hull, &little, |_| false).unwrap();
    assert_eq!(failure.part, [[0.0, 1.0]; 2]);
}

/// However many halvings are allowed, a fold is no reason to go on for ever.
#[test]
fn the_budget_ends_all() {
    let lattice = linear(2, 2, [[0.0, 0.0], [0.0, 1.0]]);
    for off_axis in [false, true] {
        for one_for_all in [false, true] {
            let hull = ConicHull {
                one_for_all,
                subdivisions: u32::MAX,
                off_axis,
            };
            assert!(!passes(&lattice, hull));
        }
    }
}
