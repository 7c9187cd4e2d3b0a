//! Displaced control points: anything, and what is certainly one-to-one or a mirror image.

use super::grids::{GridOptions, Shape, int, push_matrix, read_matrix};
use super::numbers::{Layout, Made, Reader};
use crate::injectivity::displacement_bound;
use crate::{Border, Grid, Lattice};
use proptest::strategy::Strategy;

/// Displacements are multiples of this part of the largest.
pub(super) const STEPS: i32 = 64;

/// The numbers of a grid and of a displacement for each control point.
pub(super) fn grid_and_field<const D: usize>(
    options: &GridOptions,
    between: impl FnOnce(&mut Layout),
) -> Result<Layout, String> {
    options.check()?;
    let mut layout = Layout::default();
    options.push::<D>(&mut layout);
    between(&mut layout);
    layout.push_field([options.most_control_points(); D], STEPS);
    Ok(layout)
}

/// The numbers of a field at the control points of a grid, from −1 to 1. The field has
/// room for the largest grid of the options: when cells are taken away, the others keep
/// their displacements.
pub(super) fn read_field<const D: usize>(
    options: &GridOptions,
    grid: &Grid<D>,
    reader: Reader,
) -> Vec<[f64; D]> {
    let numbers = reader.rest();
    let per_axis = options.most_control_points();
    (0..grid.control_point_count())
        .map(|i| {
            let indices = grid.control_point_indices(i);
            let point = indices.iter().rev().fold(0, |sum, i| sum * per_axis + i);
            std::array::from_fn(|c| f64::from(numbers[D * point + c]) / f64::from(STEPS))
        })
        .collect()
}

/// Where control points rest in lattice coordinates.
pub(super) fn rest<const D: usize>(grid: &Grid<D>, control_point: usize) -> [f64; D] {
    let indices = grid.control_point_indices(control_point);
    std::array::from_fn(|axis| grid.axes()[axis].rest_coordinate(indices[axis]))
}

/// The lattice with the given displacements in lattice coordinates. Nothing is rounded
/// where numbers and the components of axes are short.
pub(super) fn in_cells<const D: usize>(
    grid: Grid<D>,
    displacement: impl Fn(usize) -> [f64; D],
) -> Option<Lattice<D>> {
    let axes = grid.frame().axes();
    let displacements = (0..grid.control_point_count())
        .map(|i| {
            let d = displacement(i);
            std::array::from_fn(|c| (0..D).map(|axis| d[axis] * axes[axis][c]).sum())
        })
        .collect();
    Lattice::new(grid, displacements).ok()
}

/// Lattices of which nothing is known: each control point moves by up to `amplitude` cells
/// along each axis, to either side, in steps of 1/64 of that. Since a cell is the unit, the
/// frame does not matter for whether they fold.
///
/// They shrink to small grids, see [`grids`](super::grids), on which few control points
/// move, by round numbers.
///
/// # Example
///
/// ```
/// use ffd_core::strategies::{GridOptions, lattices};
/// use proptest::{prelude::*, test_runner::{TestError, TestRunner}};
///
/// // It is not true that no control point of any lattice moves.
/// let strategy = lattices::<2>(GridOptions::default(), 0.5);
/// let false_claim = TestRunner::deterministic().run(&strategy, |lattice| {
///     prop_assert!(lattice.displacements().iter().all(|&d| d == [0.0; 2]));
///     Ok(())
/// });
/// let Err(TestError::Fail(_, smallest)) = false_claim else { panic!() };
/// assert_eq!(smallest.grid().cells(), [1, 1]);
/// let moved = |d: &&[f64; 2]| **d != [0.0; 2];
/// assert_eq!(smallest.displacements().iter().filter(moved).count(), 1);
/// ```
pub fn lattices<const D: usize>(
    options: GridOptions,
    amplitude: f64,
) -> impl Strategy<Value = Lattice<D>> + Clone + Send + Sync {
    let layout = match amplitude.is_finite() {
        true => grid_and_field::<D>(&options, |_| ()),
        false => Err(format!("an amplitude of {amplitude} cells")),
    };
    Made::new("lattice", layout, move |mut reader| {
        let grid = Shape::read(&options, &mut reader).grid()?;
        let field = read_field(&options, &grid, reader);
        in_cells(grid, |i| field[i].map(|x| amplitude * x))
    })
}

/// Lattices that are one-to-one on their domain and have `det J > 0` there, by an argument
/// that needs no search: no control point moves by more than 15/16 of the bound of Choi and
/// Lee; with a free border an affine map of positive determinant may follow.
///
/// They shrink to the identity; see [`lattices`].
pub fn injective<const D: usize>(
    options: GridOptions,
) -> impl Strategy<Value = Lattice<D>> + Clone + Send + Sync {
    let layout = grid_and_field::<D>(&options, |layout| {
        // Whether there is an affine map, and which axes it turns round.
        layout.push(0..=1);
        layout.push(0..=(1 << (D - 1)) - 1);
        push_matrix::<D>(layout);
    });
    Made::new("injective lattice", layout, move |mut reader| {
        let grid = Shape::read(&options, &mut reader).grid()?;
        let is_affine = reader.next() == 1 && grid.border() == Border::Free;
        // An even number of axes.
        let mut turned = reader.next() << 1;
        turned |= int((turned.count_ones() % 2) as usize);
        let matrix = matrix(turned, &mut reader);
        let small = small(&options, &grid, reader);
        if is_affine {
            followed_by(grid, &small, matrix)
        } else {
            in_cells(grid, |i| small[i])
        }
    })
}

/// Mirror images: lattices with `det J < 0` on the closed domain, and one-to-one there.
/// Small displacements as of [`injective`] ones are followed by an affine map of negative
/// determinant. Their border is free, whatever the options say.
///
/// They shrink to the plain reflection of the first axis; see [`lattices`].
pub fn reversed<const D: usize>(
    options: GridOptions,
) -> impl Strategy<Value = Lattice<D>> + Clone + Send + Sync {
    let options = options.with_free_border();
    let layout = grid_and_field::<D>(&options, |layout| {
        layout.push(0..=(1 << (D - 1)) - 1);
        push_matrix::<D>(layout);
    });
    Made::new("reversed lattice", layout, move |mut reader| {
        let grid = Shape::read(&options, &mut reader).grid()?;
        // An odd number of axes.
        let mut turned = reader.next() << 1;
        turned |= int((turned.count_ones() % 2) as usize) ^ 1;
        let matrix = matrix(turned, &mut reader);
        let small = small(&options, &grid, reader);
        followed_by(grid, &small, matrix)
    })
}

/// Displacements below the bound of Choi and Lee, in cells.
fn small<const D: usize>(options: &GridOptions, grid: &Grid<D>, reader: Reader) -> Vec<[f64; D]> {
    // The rest leaves room for rounding.
    let most = 15.0 / 16.0 * displacement_bound(grid);
    let mut field = read_field(options, grid, reader);
    for x in field.as_flattened_mut() {
        *x *= most;
    }
    field
}

/// A matrix whose determinant has the sign of −1 to the number of binary digits of
/// `turned` that are one.
fn matrix<const D: usize>(turned: i32, reader: &mut Reader) -> [[f64; D]; D] {
    let (lengths, skewed) = read_matrix::<D>(reader);
    std::array::from_fn(|r| {
        let length = if turned >> r & 1 == 1 {
            -lengths[r]
        } else {
            lengths[r]
        };
        skewed[r].map(|x| length * x)
    })
}

/// The map of small displacements, in lattice coordinates, followed by a linear one:
/// control points may be moved by it instead, since splines reproduce linear functions.
fn followed_by<const D: usize>(
    grid: Grid<D>,
    small: &[[f64; D]],
    matrix: [[f64; D]; D],
) -> Option<Lattice<D>> {
    let rests: Vec<[f64; D]> = (0..small.len()).map(|i| rest(&grid, i)).collect();
    in_cells(grid, |i| {
        std::array::from_fn(|r| {
            let image: f64 = (0..D)
                .map(|c| matrix[r][c] * (rests[i][c] + small[i][c]))
                .sum();
            image - rests[i][r]
        })
    })
}
