//! Lattices whose determinant touches zero.
//!
//! In lattice coordinates the maps are `u ↦ (u₁, …, f(u), …)` with f in place of coordinate
//! a, so that `det J = ∂f/∂uₐ`, and f is a polynomial:
//!
//! | degree along a | f | `det J` is zero |
//! |---|---|---|
//! | any | 0 | everywhere |
//! | 1 | linear in each cell | in a layer of cells |
//! | 2 | ± k (uₐ − c)² | on a face |
//! | from 3 on | k (uₐ − c)³ + 3 k Σ uₐ (uᵢ − cᵢ)², over some other axes i of degree ≥ 2 | on a plane or a line, or at a point |
//!
//! The control points of a polynomial are values of its polar form (blossom) at knots:
//! quotients of integers by binomial coefficients of the degree. With k = 45/64 these
//! cancel, and with c a multiple of 1/4 nothing is rounded: the zeros are exact.

use super::field::{in_cells, rest};
use super::grids::{GridOptions, Shape, int};
use super::numbers::{Layout, Made, Reader};
use crate::{Grid, Knots, Lattice};
use proptest::strategy::Strategy;

/// Divisible by all binomial coefficients of degrees up to 5, but for powers of two.
const FACTOR: f64 = 45.0;

/// Lattices with `det J ≥ 0` on the closed domain and exactly zero somewhere: everywhere, in
/// a layer of cells, on a plane, on a line, or at a single point, whose coordinates are
/// multiples of 1/4. They may be sheared on top of it. Nothing in them was rounded.
///
/// Their border is free, whatever the options say. Along a clamped axis of degree 3 or 5
/// control points rest at thirds or fifths, which floating point does not have; where all
/// axes are such, one gets uniform knots, unless the options allow clamped ones only.
///
/// They shrink to one cell that is pressed flat along its first axis.
pub fn degenerate<const D: usize>(
    options: GridOptions,
) -> impl Strategy<Value = Lattice<D>> + Clone + Send + Sync {
    let options = options.with_free_border();
    let layout = options.check().map(|()| {
        let mut layout = Layout::default();
        options.push::<D>(&mut layout);
        // The kind; the axis a; which axes i; the zero in quarters of cells; shears.
        layout.push(0..=3);
        layout.push(0..=int(D - 1));
        layout.push(0..=(1 << D) - 1);
        for _ in 0..D {
            layout.push(0..=4 * int(options.cells[1]));
        }
        for _ in 0..D {
            layout.push(-8..=8);
        }
        layout
    });
    Made::new("degenerate lattice", layout, move |mut reader| {
        let mut shape = Shape::<D>::read(&options, &mut reader);
        let is_collapsed = reader.next() == 0;
        // The first axis, from the one drawn on, whose control points are not rounded.
        let first = reader.next_index();
        let exact = (first..first + D).map(|axis| axis % D).find(|&axis| {
            shape.knots[axis] == Knots::Uniform || ![3, 5].contains(&shape.degrees[axis])
        });
        let axis = match (exact, options.knots) {
            (Some(axis), _) => axis,
            (None, Some(Knots::Clamped)) => return None,
            (None, _) => {
                shape.knots[first] = Knots::Uniform;
                first
            }
        };
        let function = Function::read(&shape, axis, &mut reader);
        let shears: [f64; D] = std::array::from_fn(|_| f64::from(reader.next()) / 8.0);
        let grid = shape.grid()?;
        let control = |i: usize| {
            if is_collapsed {
                0.0
            } else {
                function.control_point(&grid, i)
            }
        };
        let controls: Vec<f64> = (0..grid.control_point_count()).map(control).collect();
        let rests: Vec<f64> = (0..controls.len()).map(|i| rest(&grid, i)[axis]).collect();
        in_cells(grid, |i| {
            std::array::from_fn(|c| match c == axis {
                true => controls[i] - rests[i],
                false => shears[c] * controls[i],
            })
        })
    })
}

/// The function f.
struct Function<const D: usize> {
    /// The axis a.
    axis: usize,
    /// Whether each axis is one of the axes i.
    others: [bool; D],
    /// Where `det J` is zero.
    zero: [f64; D],
}

impl<const D: usize> Function<D> {
    fn read(shape: &Shape<D>, axis: usize, reader: &mut Reader) -> Self {
        let others = reader.next();
        let quarters: [f64; D] = std::array::from_fn(|i| {
            let quarters = reader.next_index().min(4 * shape.cells[i]);
            quarters as f64 / 4.0
        });
        Self {
            axis,
            others: std::array::from_fn(|i| {
                i != axis && others >> i & 1 == 1 && shape.degrees[i] >= 2
            }),
            zero: quarters,
        }
    }

    /// Where f has its control point: a number without rounding.
    fn control_point(&self, grid: &Grid<D>, index: usize) -> f64 {
        let indices = grid.control_point_indices(index);
        let a = self.axis;
        let c = self.zero[a];
        let along = Polar::new(grid, a, indices[a]);
        match grid.degree()[a].get() {
            1 => {
                // All control points beyond a cell are moved back by one.
                let last = grid.cells()[a] as f64 - 1.0;
                let position = indices[a] as f64;
                position - f64::from(u8::from(position > c.floor().min(last)))
            }
            2 => {
                // det J is not negative on one side of the zero only: it is moved to an end.
                let cells = grid.cells()[a] as f64;
                let [c, sign] = if c == 0.0 { [0.0, 1.0] } else { [cells, -1.0] };
                sign * (along.times_factor(2) - 2.0 * c * along.times_factor(1) + c * c * FACTOR)
                    / 64.0
            }
            _ => {
                let cube = along.times_factor(3) - 3.0 * c * along.times_factor(2)
                    + 3.0 * c * c * along.times_factor(1)
                    - c * c * c * FACTOR;
                let rest = along.times_factor(1) / FACTOR;
                let squares: f64 = (0..D)
                    .filter(|&b| self.others[b])
                    .map(|b| {
                        let across = Polar::new(grid, b, indices[b]);
                        let d = self.zero[b];
                        across.times_factor(2) - 2.0 * d * across.times_factor(1) + d * d * FACTOR
                    })
                    .sum();
                (cube + 3.0 * rest * squares) / 64.0
            }
        }
    }
}

/// The knots inside the support of a basis function: the control point of a polynomial is
/// its polar form there.
struct Polar {
    knots: Vec<f64>,
}

impl Polar {
    fn new<const D: usize>(grid: &Grid<D>, axis: usize, index: usize) -> Self {
        let n = grid.degree()[axis].get();
        let cells = grid.cells()[axis] as f64;
        let knots = (0..n).map(|k| {
            let knot = (index + k + 1) as f64 - n as f64;
            match grid.knots()[axis] {
                Knots::Uniform => knot,
                Knots::Clamped => knot.clamp(0.0, cells),
            }
        });
        Self {
            knots: knots.collect(),
        }
    }

    /// The control point of uᵏ, times [`FACTOR`]: the mean product of k of the knots.
    fn times_factor(&self, k: usize) -> f64 {
        // Elementary symmetric polynomials, of the knots and of as many ones.
        let mut sums = [[0.0; 4]; 2];
        for sum in &mut sums {
            sum[0] = 1.0;
        }
        for &knot in &self.knots {
            for order in (1..=3).rev() {
                sums[0][order] += knot * sums[0][order - 1];
                sums[1][order] += sums[1][order - 1];
            }
        }
        FACTOR * sums[0][k] / sums[1][k]
    }
}
