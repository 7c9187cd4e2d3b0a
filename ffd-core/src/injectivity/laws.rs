//! Tests of the parts against each other and against exact arithmetic.

use dashu_int::IBig;
use fearless_simd::Level;
use proptest::prelude::*;

use super::batch::Kind;
use super::dominance::{Dominance, distances_in_cell, lower_bound};
use super::exact::ExactPiece;
use super::partials::Partials;
use super::piece::Shape;
use super::product::Products;
use crate::{Border, Degree, Frame, Grid, Knots, Lattice};

fn grids<const D: usize>() -> impl Strategy<Value = Grid<D>> {
    let frame = Frame::new(
        std::array::from_fn(|c| c as f64),
        std::array::from_fn(|r| {
            std::array::from_fn(|c| [[0.5, 0.25, 0.0], [0.125, 1.0, -0.25], [0.0, 0.5, 1.5]][r][c])
        }),
    )
    .unwrap();
    let knots = prop_oneof![Just(Knots::Uniform), Just(Knots::Clamped)];
    let axis = (1_usize..=5, 1_usize..=4, knots);
    (proptest::collection::vec(axis, D), 0..3).prop_map(move |(axes, border)| {
        let grid = Grid::new(
            std::array::from_fn(|a| Degree::new(axes[a].0).unwrap()),
            std::array::from_fn(|a| axes[a].1),
            if border == 0 { Frame::unit() } else { frame },
        )
        .unwrap();
        if border == 1 {
            grid.with_border(Border::Identity).unwrap()
        } else {
            grid.with_knots(std::array::from_fn(|a| axes[a].2)).unwrap()
        }
    })
}

fn lattices<const D: usize>() -> impl Strategy<Value = Lattice<D>> {
    let size = prop_oneof![Just(0.01), Just(0.5), Just(30.0)];
    (grids::<D>(), size).prop_flat_map(|(grid, size)| {
        let numbers = proptest::collection::vec(-size..size, D * grid.control_point_count());
        numbers.prop_map(move |numbers: Vec<f64>| {
            let displacements = numbers
                .chunks_exact(D)
                .map(|d| std::array::from_fn(|c| d[c]))
                .collect();
            Lattice::new(grid.clone(), displacements).unwrap()
        })
    })
}

/// The nearest number, for integers beyond the range of numbers too: `value / 2^shift`.
fn shifted(value: &IBig, shift: usize) -> f64 {
    // 100 bits are kept: the rest does not change the result by more than one unit.
    let bits = shift.saturating_sub(100);
    (value.clone() >> bits).to_f64().value() / 2_f64.powi(i32::try_from(shift - bits).unwrap())
}

/// All ways to compute the Bernstein coefficients agree with exact arithmetic within the
/// bounds that they claim, and are the same at every SIMD level.
fn check_coefficients<const D: usize>(
    lattice: &Lattice<D>,
    pick: usize,
) -> Result<(), TestCaseError> {
    let partials = Partials::new(lattice);
    let number = pick % partials.cell_count();
    let cell = partials.cell(number);
    let mut products = Products::new(partials.degree);
    let mut coefficients = Vec::new();
    let error = products.determinant(&partials, cell, &mut coefficients);

    // The exact coefficients are known up to a factor: the largest one sets it.
    let exact = ExactPiece::of_cell(lattice, cell);
    let exact = exact.coefficients();
    let bits = exact
        .iter()
        .map(dashu_int::ops::BitTest::bit_len)
        .max()
        .unwrap();
    let exact: Vec<f64> = exact.iter().map(|v| shifted(v, bits)).collect();
    let largest = (0..exact.len())
        .max_by(|&a, &b| exact[a].abs().total_cmp(&exact[b].abs()))
        .unwrap();
    prop_assume!(coefficients[largest].abs() > 1e3 * error);
    let factor = coefficients[largest] / exact[largest];
    prop_assert!(factor > 0.0);
    // The factor is as wrong as the coefficient that it comes from.
    let tolerance = 2.0 * error + 1e-15 * coefficients[largest].abs();
    for (found, exact) in coefficients.iter().zip(&exact) {
        prop_assert!((found - exact * factor).abs() <= tolerance);
    }

    let shape = Shape::new(&Products::result_degree(partials.degree));
    let bounds = shape.bounds(&coefficients);
    let distances = distances_in_cell(&partials, cell);
    let of_all = Dominance::new(&partials);
    let same = of_all.of_cell(partials.index(cell)).map(f64::to_bits);
    prop_assert_eq!(same, distances.map(f64::to_bits));
    if let Some(least) = lower_bound(distances) {
        prop_assert!(least <= bounds.min + error, "{least} {bounds:?}");
    }
    for level in crate::levels::levels() {
        let again = Kind::new(level, &partials, number).bounds(&[number])[0];
        let tolerance = again.error + error;
        prop_assert!(
            (again.min - bounds.min).abs() <= tolerance,
            "{again:?} {bounds:?}"
        );
        prop_assert!((again.max - bounds.max).abs() <= tolerance);
        prop_assert!((again.low_corner - bounds.low_corner.0).abs() <= tolerance);
        let first = Kind::new(Level::new(), &partials, number).bounds(&[number])[0];
        prop_assert_eq!(again.min.to_bits(), first.min.to_bits());
        prop_assert_eq!(again.max.to_bits(), first.max.to_bits());
        let mut at_level = Products::new(partials.degree);
        at_level.level = level;
        let mut again = Vec::new();
        at_level.determinant(&partials, cell, &mut again);
        prop_assert!(again == coefficients);
    }
    Ok(())
}

/// Halves of a box, in floating point and exactly, and a bound from below.
fn check_pieces<const D: usize>(
    lattice: &Lattice<D>,
    path: &[(usize, bool)],
) -> Result<(), TestCaseError> {
    let partials = Partials::new(lattice);
    let mut products = Products::new(partials.degree);
    let shape = Shape::new(&Products::result_degree(partials.degree));
    let mut piece = Vec::new();
    products.determinant(&partials, [0; D], &mut piece);
    let mut scratch = Vec::new();
    for &(axis, upper) in path {
        let bounds = shape.bounds(&piece);
        let size = bounds.max.abs().max(bounds.min.abs());
        for negated in [false, true] {
            let least = shape.lower_bound(&piece, negated, &mut scratch);
            let sign = if negated { -1.0 } else { 1.0 };
            let coefficient = if negated { -bounds.max } else { bounds.min };
            prop_assert!(least >= coefficient, "no worse than the coefficients");
            // Values at many places: the corners of all boxes some halvings further down.
            let mut boxes = vec![piece.clone()];
            for step in 0..4 {
                boxes = boxes
                    .iter()
                    .flat_map(|b| {
                        let (mut low, mut high) = (vec![0.0; b.len()], b.clone());
                        shape.split(step % D, &mut low, &mut high);
                        [low, high]
                    })
                    .collect();
            }
            for b in boxes {
                for corner in 0..1 << D {
                    let value = sign * b[shape.corner(corner)];
                    // Four halvings of degree 14: 56 roundings.
                    prop_assert!(least <= value + 60.0 * f64::EPSILON * size);
                }
            }
        }
        let (mut low, mut high) = (vec![0.0; piece.len()], piece.clone());
        shape.split(axis % D, &mut low, &mut high);
        piece = if upper { high } else { low };
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn coefficients_are_those_of_exact_arithmetic_in_the_plane(
        lattice in lattices::<2>(),
        pick in any::<usize>(),
    ) {
        check_coefficients(&lattice, pick)?;
    }

    #[test]
    fn coefficients_are_those_of_exact_arithmetic_in_space(
        lattice in lattices::<3>(),
        pick in any::<usize>(),
    ) {
        check_coefficients(&lattice, pick)?;
    }

    #[test]
    fn lower_bounds_are_below_all_values(
        lattice in lattices::<3>(),
        path in proptest::collection::vec((0_usize..3, any::<bool>()), 1..8),
    ) {
        check_pieces(&lattice, &path)?;
    }

    #[test]
    fn lower_bounds_are_below_all_values_in_the_plane(
        lattice in lattices::<2>(),
        path in proptest::collection::vec((0_usize..2, any::<bool>()), 1..12),
    ) {
        check_pieces(&lattice, &path)?;
    }

    /// A convex bowl, wherever its bottom is: the bound is its minimum, to rounding. And a
    /// sheet, `ε + (l · y − s)²`, is bounded by ε.
    #[test]
    fn bowls_and_sheets_are_bounded_closely(
        bottom in proptest::array::uniform3(-1.0..2.0_f64),
        steep in proptest::array::uniform3(0.01..10.0_f64),
        normal in proptest::array::uniform3(-1.0..1.0_f64),
    ) {
        let shape = Shape::new(&[8, 8, 8]);
        // Bernstein coefficients of x and x² of degree 8.
        let x = |i: usize| i as f64 / 8.0;
        let square = |i: usize| (i * i.saturating_sub(1)) as f64 / 56.0;
        let mut scratch = Vec::new();
        let coefficients = |term: &dyn Fn([usize; 3]) -> f64| -> Vec<f64> {
            (0..729).map(|n| term([n % 9, n / 9 % 9, n / 81])).collect()
        };
        let bowl = coefficients(&|i| {
            (0..3).map(|a| {
                let b = bottom[a];
                steep[a] * (square(i[a]) - 2.0 * b * x(i[a]) + b * b)
            }).sum()
        });
        let least: f64 = (0..3).map(|a| {
            let distance = bottom[a] - bottom[a].clamp(0.0, 1.0);
            steep[a] * distance * distance
        }).sum();
        let bound = shape.lower_bound(&bowl, false, &mut scratch);
        // Coefficients are at most 3 · 10 · 4, and summed with some hundred roundings.
        prop_assert!((bound - least).abs() <= 120.0 * 5000.0 * f64::EPSILON, "{bound} {least}");

        let shift = 0.5 * normal.iter().sum::<f64>();
        let sheet = coefficients(&|i| {
            let linear: f64 = (0..3).map(|a| normal[a] * x(i[a])).sum::<f64>() - shift;
            let correction: f64 = (0..3)
                .map(|a| normal[a] * normal[a] * (x(i[a]) * x(i[a]) - square(i[a])))
                .sum();
            1e-6 + linear * linear - correction
        });
        let bound = shape.lower_bound(&sheet, false, &mut scratch);
        prop_assert!((bound - 1e-6).abs() <= 1e-11, "{bound}");
    }
}

/// Signs of exact pieces are those of the coefficients, and halving keeps values.
#[test]
fn exact_pieces_agree_with_themselves() {
    let grid = Grid::new([Degree::CUBIC; 2], [1, 1], Frame::unit()).unwrap();
    let displacements = (0..16)
        .map(|i| [f64::from(i % 5) * 0.25, f64::from(i % 3) * -0.5])
        .collect();
    let lattice = Lattice::new(grid, displacements).unwrap();
    let whole = ExactPiece::of_cell(&lattice, [0, 0]);
    let shape = Shape::new(&[5, 5]);
    let quarter = whole.part([0.25, 0.5], [2, 1]);
    let [low, _] = whole.split(0);
    let [_, high] = low.split(0);
    let [_, again] = high.split(1);
    assert_eq!(quarter.signs(&shape), again.signs(&shape));
    assert_eq!(quarter.coefficients(), again.coefficients());
}
