//! Direct manipulation, through the public interface.

#![expect(clippy::float_cmp, reason = "what must be equal is compared")]

#[path = "../common/mod.rs"]
mod common;
mod laws;
mod named;

use common::{at, each, frame, grid, lattice};
use ffd_core::{
    Border, Constraint, Degree, DirectError, DirectManipulation, Fit, Frame, Grid, Knots, Lattice,
    MAX_ORDER, Merged, PullOptions,
};
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;

/// The matrix of basis functions, a row for each point, a column for each control point;
/// columns of fixed ones are zero.
fn basis_matrix<const D: usize>(
    grid: &Grid<D>,
    points: &[[f64; D]],
    fixed: &[usize],
) -> DMatrix<f64> {
    #![expect(
        clippy::cast_possible_truncation,
        clippy::cast_possible_wrap,
        clippy::cast_sign_loss,
        reason = "cells are few"
    )]
    let per_axis = grid.control_points_per_axis();
    let mut matrix = DMatrix::zeros(points.len(), grid.control_point_count());
    for (row, &point) in points.iter().enumerate() {
        let u = grid.frame().to_lattice(point);
        let along: [Vec<f64>; D] = std::array::from_fn(|axis| {
            let [low, high] = grid.domain()[axis];
            let cell = u[axis].floor().clamp(low, high - 1.0);
            let mut basis = [[0.0; MAX_ORDER]];
            // With an identity border knots are uniform, and cells are all alike.
            let own = (cell as usize).min(grid.cells()[axis] - 1);
            grid.axes()[axis].basis(own, u[axis] - cell, &mut basis);
            let mut weights = vec![0.0; per_axis[axis]];
            for (j, &weight) in basis[0].iter().enumerate() {
                let i = cell as isize + j as isize;
                if weight > 0.0 && i >= 0 && (i as usize) < per_axis[axis] {
                    weights[i as usize] = weight;
                }
            }
            weights
        });
        for column in 0..grid.control_point_count() {
            let indices = grid.control_point_indices(column);
            matrix[(row, column)] = (0..D).map(|axis| along[axis][indices[axis]]).product();
        }
    }
    for &column in fixed {
        matrix.fill_column(column, 0.0);
    }
    matrix
}

/// One vector per row.
fn dense<const D: usize>(vectors: &[[f64; D]]) -> DMatrix<f64> {
    DMatrix::from_fn(vectors.len(), D, |r, c| vectors[r][c])
}

fn longest<const D: usize>(vectors: &[[f64; D]]) -> f64 {
    let length = |v: &[f64; D]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    vectors.iter().map(length).fold(0.0, f64::max)
}

/// The pseudoinverse, and the ratio of the largest to the smallest singular value that
/// is not zero. By Householder reflections alone (a complete orthogonal decomposition):
/// its errors are a few times 1e-16 times that ratio, smaller than those of nalgebra's
/// singular vectors.
fn pseudoinverse(matrix: &DMatrix<f64>) -> (DMatrix<f64>, f64) {
    let outer = matrix.clone().col_piv_qr();
    let (q, r) = (outer.q(), outer.r());
    let rank = (0..r.nrows())
        .take_while(|&i| r[(i, i)].abs() > 1e-13 * r[(0, 0)].abs())
        .count();
    let inner = r.rows(0, rank).transpose().qr();
    let reduced = q.columns(0, rank).transpose();
    let reduced = inner
        .r()
        .transpose()
        .solve_lower_triangular(&reduced)
        .unwrap();
    let mut inverse = inner.q() * reduced;
    outer.p().inv_permute_rows(&mut inverse);
    let mut values = matrix.singular_values().as_slice().to_vec();
    values.sort_by(|a, b| b.total_cmp(a));
    (inverse, values[0] / values[rank.max(1) - 1])
}

fn solve<const D: usize>(
    grid: &Grid<D>,
    points: &[[f64; D]],
    displacements: &[[f64; D]],
    options: &PullOptions<'_>,
) -> Result<Vec<[f64; D]>, DirectError> {
    let mut manipulation = DirectManipulation::new(grid, points, options)?;
    let mut changes = vec![[f64::NAN; D]; grid.control_point_count()];
    manipulation.solve_into(displacements, &mut changes)?;
    Ok(changes)
}

fn constraints<const D: usize>(
    points: &[[f64; D]],
    displacements: &[[f64; D]],
) -> Vec<Constraint<D>> {
    std::iter::zip(points, displacements)
        .map(|(&point, &displacement)| Constraint::new(point, displacement))
        .collect()
}

/// Evenly distributed numbers from 0 to 1 without a random source.
fn numbers() -> impl FnMut() -> f64 {
    let mut state = 1_u64;
    move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// Points within a part of the domain: `low` to `high` of its extent along each axis.
fn scattered<const D: usize>(grid: &Grid<D>, count: usize, low: f64, high: f64) -> Vec<[f64; D]> {
    let mut next = numbers();
    (0..count)
        .map(|_| at(grid, std::array::from_fn(|_| low + (high - low) * next())))
        .collect()
}

fn some_displacements<const D: usize>(count: usize) -> Vec<[f64; D]> {
    let mut next = numbers();
    (0..count + 1)
        .map(|_| std::array::from_fn(|_| 2.0 * next() - 1.0))
        .skip(1)
        .collect()
}

/// A grid of cubic cells without skew.
fn cubic<const D: usize>(cells: usize) -> Grid<D> {
    Grid::new([Degree::CUBIC; D], [cells; D], Frame::unit()).unwrap()
}
