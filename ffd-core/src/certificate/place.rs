//! The map at single places, and two places with the same image.

use std::cmp::Ordering;

use dashu_int::IBig;

use super::cell::Exact;
use super::dyadic::Dyadic;
use super::form::Form;
use crate::Place;

/// A place: a cell of the domain, and the position in it, from 0 to 1 along each axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Spot<const D: usize> {
    pub(super) cell: [usize; D],
    pub(super) t: [f64; D],
}

impl<const D: usize> From<&Place<D>> for Spot<D> {
    fn from(place: &Place<D>) -> Self {
        Self {
            cell: place.cell,
            t: place.t,
        }
    }
}

type Vector<const D: usize> = [Dyadic; D];
type Matrix<const D: usize> = [[Dyadic; D]; D];

/// From and to along each axis of a cell.
type Part<const D: usize> = [[Dyadic; 2]; D];

impl<const D: usize> Spot<D> {
    /// Whether there is such a place.
    pub(super) fn is_in(&self, exact: &Exact<'_, D>) -> bool {
        (0..D).all(|a| self.cell[a] < exact.cells[a] && (0.0..=1.0).contains(&self.t[a]))
    }

    fn part(&self) -> Part<D> {
        self.t.map(|t| [Dyadic::from_f64(t), Dyadic::from_f64(t)])
    }

    /// The sign of `det J`. There must be such a place.
    pub(super) fn sign(&self, exact: &Exact<'_, D>) -> Ordering {
        let sign = determinant(&self.derivatives(exact)).sign();
        if super::condition::is_mirrored(exact) {
            sign.reverse()
        } else {
            sign
        }
    }

    /// `m[c][a]`: the derivative of component c by lattice coordinate a, times the unit.
    fn derivatives(&self, exact: &Exact<'_, D>) -> Matrix<D> {
        let all = derivatives_in(exact, self.cell, &self.part());
        std::array::from_fn(|c| std::array::from_fn(|a| all[a][c][0].clone()))
    }

    /// Lattice coordinates, counted from the beginning of the domain.
    fn coordinates(&self) -> Vector<D> {
        std::array::from_fn(|a| &Dyadic::from_count(self.cell[a]) + &Dyadic::from_f64(self.t[a]))
    }

    /// The displacement, times the unit.
    fn displacement(&self, exact: &Exact<'_, D>) -> Vector<D> {
        let numbers = exact.numbers(self.cell);
        let bezier: [Form<IBig>; D] = exact.bezier(self.cell, &numbers);
        bezier.map(|form| {
            let all = restricted(&form, numbers.exponent, &self.part());
            all.into_iter().next().expect("one for each corner")
        })
    }
}

/// `[a][c]`: Bernstein coefficients of the derivative of component c by lattice coordinate a
/// over a part of a cell, times the unit.
fn derivatives_in<const D: usize>(
    exact: &Exact<'_, D>,
    cell: [usize; D],
    part: &Part<D>,
) -> [[Vec<Dyadic>; D]; D] {
    let numbers = exact.numbers(cell);
    let columns = exact.columns::<IBig>(cell, &numbers);
    columns.map(|column| column.map(|form| restricted(&form, numbers.exponent, part)))
}

/// The coefficients of a polynomial over a part of its cell: along an axis, number k is the
/// polar form at n − k times the lower end and k times the upper.
fn restricted<const D: usize>(form: &Form<IBig>, exponent: i64, part: &Part<D>) -> Vec<Dyadic> {
    let coefficients = form.values.iter();
    let mut values: Vec<Dyadic> = coefficients
        .map(|value| Dyadic::new(value.clone(), exponent))
        .collect();
    let mut stride = 1;
    for axis in 0..D {
        let count = form.counts[axis];
        for start in (0..values.len()).filter(|i| i / stride % count == 0) {
            let line: Vec<Dyadic> = (0..count)
                .map(|i| values[start + i * stride].clone())
                .collect();
            for k in 0..count {
                let mut line = line.clone();
                for step in 0..count - 1 {
                    let t = &part[axis][usize::from(step < k)];
                    for i in 0..count - 1 - step {
                        line[i] = &line[i] + &(t * &(&line[i + 1] - &line[i]));
                    }
                }
                values[start + k * stride] = line.swap_remove(0);
            }
        }
        stride *= count;
    }
    values
}

fn cofactor<const D: usize>(m: &Matrix<D>, r: usize, c: usize) -> Dyadic {
    if D == 2 {
        let entry = &m[1 - r][1 - c];
        return if r == c { entry.clone() } else { -entry };
    }
    let next = |i: usize, step: usize| (i + step) % 3;
    &(&m[next(r, 1)][next(c, 1)] * &m[next(r, 2)][next(c, 2)])
        - &(&m[next(r, 1)][next(c, 2)] * &m[next(r, 2)][next(c, 1)])
}

fn determinant<const D: usize>(m: &Matrix<D>) -> Dyadic {
    sum((0..D).map(|c| &m[0][c] * &cofactor(m, 0, c)))
}

fn sum(terms: impl Iterator<Item = Dyadic>) -> Dyadic {
    terms.fold(Dyadic::zero(), |sum, term| &sum + &term)
}

/// Whether some place within `radius` of `other`, along each axis of its cell, has the image
/// of `point`, and `point` itself is not one of these.
///
/// With the Jacobian `J₀` at `other`, t₀, the map `t ↦ t − J₀⁻¹ (F(t) − F(p))` takes the box
/// into the points at most `|J₀⁻¹ (F(t₀) − F(p))| + |I − J₀⁻¹ J| r` from t₀, with the
/// largest absolute values over the box, from the Bernstein coefficients of J there (R.
/// Krawczyk, Computing 4, 1969). If that is less than r along every axis, the map is a
/// contraction of the box, and its fixed point has the image of `point`.
pub(super) fn overlaps<const D: usize>(
    exact: &Exact<'_, D>,
    point: &Spot<D>,
    other: &Spot<D>,
    radius: f64,
) -> bool {
    let radius = Dyadic::from_f64(radius);
    let part: Part<D> = other.t.map(|t| {
        let t = Dyadic::from_f64(t);
        [&t - &radius, &t + &radius]
    });
    let one = Dyadic::from_count(1);
    let is_in_cell =
        |[low, high]: &[Dyadic; 2]| !low.is_below(&Dyadic::zero()) && !one.is_below(high);
    let (p, q) = (point.coordinates(), other.coordinates());
    let apart: Vector<D> = std::array::from_fn(|a| &q[a] - &p[a]);
    let is_outside = apart.iter().any(|x| radius.is_below(&x.abs()));
    if radius.sign() != Ordering::Greater || !part.iter().all(is_in_cell) || !is_outside {
        return false;
    }

    // All times the unit: F(t₀) − F(p), J and J₀. That of the frame is linear.
    let unit = Dyadic::new(exact.unit.clone(), 0);
    let axes = exact.lattice.grid().frame().axes();
    let (at_p, at_q) = (point.displacement(exact), other.displacement(exact));
    let residual: Vector<D> = std::array::from_fn(|c| {
        let rest = sum((0..D).map(|a| &apart[a] * &Dyadic::from_f64(axes[a][c])));
        &(&unit * &rest) + &(&at_q[c] - &at_p[c])
    });
    let middle = other.derivatives(exact);
    let volume = determinant(&middle);
    if volume.sign() == Ordering::Equal {
        return false;
    }
    let derivatives = derivatives_in(exact, other.cell, &part);
    // `volume` times J₀⁻¹ is the adjugate: everything is compared `volume` times as large.
    let adjugate: Matrix<D> =
        std::array::from_fn(|r| std::array::from_fn(|c| cofactor(&middle, c, r)));
    (0..D).all(|r| {
        let newton = sum((0..D).map(|c| &adjugate[r][c] * &residual[c]));
        let mut reach = newton.abs();
        for (a, column) in derivatives.iter().enumerate() {
            let unit_entry = if a == r {
                volume.clone()
            } else {
                Dyadic::zero()
            };
            let mut most = Dyadic::zero();
            for k in 0..column[0].len() {
                let product = sum((0..D).map(|c| &adjugate[r][c] * &column[c][k]));
                let deviation = (&unit_entry - &product).abs();
                if most.is_below(&deviation) {
                    most = deviation;
                }
            }
            reach = &reach + &(&most * &radius);
        }
        reach.is_below(&(&volume.abs() * &radius))
    })
}
