//! Constraints on points of a grid, prepared to be met over and over.

use super::{
    DirectError, Fit, Merged, PullOptions, duplicates::first_at_same_place, least_norm::LeastNorm,
    rows::RowBuilder,
};
use crate::Grid;

/// Exact constraints are met to this, relative to the largest displacement.
const TOLERANCE: f64 = 1e-12;

/// Rows of B with a smaller norm count as zero: to move such a point, control points
/// would have to move 1/norm times as far.
const SMALLEST_NORM: f64 = 1e-12;

/// Singular values of the system, relative to the largest, that count as zero in small
/// systems: combinations of constraints that need control points to move 1e10 times as
/// far as points are left over.
const NEGLIGIBLE: f64 = 1e-10;

/// The same for exact constraints, as small as rounding allows: if displacements vary
/// smoothly, such combinations are met without large moves.
const NEGLIGIBLE_EXACT: f64 = 1e-13;

/// Rounding errors that a contradiction leaves in the residuals of constraints which have
/// no part in it, relative to its size, are smaller than this.
const INVOLVED: f64 = 1e-6;

/// Residuals below this, relative to the farthest control point, are rounding errors: of
/// sums of up to 216 products, at worst.
const ROUNDING: f64 = 216.0 * f64::EPSILON;

/// Constraints on points at a distance δ that should go apart pull 1/δ times harder than
/// their neighbours, and are not met from about δ = 1e-4 on.
const PULLING: f64 = 1e-2;

/// Points of a grid that are dragged, with all that depends on nothing else: which
/// control points act on them, how much, and a factorisation.
///
/// # Example
///
/// ```
/// use ffd_core::{Degree, DirectManipulation, Frame, Grid, Lattice, PullOptions};
///
/// let grid = Grid::new([Degree::CUBIC; 2], [6, 6], Frame::unit())?;
/// let points = [[2.0, 3.0], [4.0, 3.0]];
/// let mut drag = DirectManipulation::new(&grid, &points, &PullOptions::default())?;
///
/// let mut changes = vec![[0.0; 2]; grid.control_point_count()];
/// let mut lattice = Lattice::at_rest(grid)?;
/// for frame in 1..=3 {
///     let up = 0.1 * f64::from(frame);
///     drag.solve_into(&[[0.0, up], [0.0, 0.0]], &mut changes)?;
///     lattice.set_displacements(&changes)?;
///     assert!((lattice.deform_point([2.0, 3.0])[1] - 3.0 - up).abs() < 1e-12);
///     assert!((lattice.deform_point([4.0, 3.0])[1] - 3.0).abs() < 1e-12);
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct DirectManipulation<const D: usize> {
    fit: Fit,
    control_point_count: usize,
    /// Where each constraint is met.
    places: Vec<Place>,
    merged: Vec<Merged>,
    /// Each row of the system is a row of B multiplied by this.
    scales: Vec<f64>,
    /// The control point of each column.
    control_points: Vec<usize>,
    system: LeastNorm<D>,
    /// The right-hand side of the system.
    targets: Vec<[f64; D]>,
    /// What the constraints lack.
    residuals: Vec<[f64; D]>,
}

/// Where a constraint is met.
#[derive(Debug, Clone, Copy)]
struct Place {
    /// The row of the system, which duplicates share; `None` if nothing acts there.
    row: Option<usize>,
    /// The first constraint at this place.
    first: usize,
    /// Part of the weight of all constraints at this place.
    share: f64,
    /// The norm of the row of B.
    norm: f64,
}

impl<const D: usize> DirectManipulation<D> {
    /// Prepares points of equal weight.
    ///
    /// `points` are world points before any deformation. Costs `O(#P n^D)` for basis
    /// functions, and a Cholesky factorisation that is dense for up to 128 points, sparse
    /// beyond. If there are more points than control points that act on them, the
    /// factorisation is of the size of the latter. Where points depend on each other it
    /// is followed by a singular value decomposition, if small, or by another one that
    /// tolerates them.
    ///
    /// Points that coincide to a few units in the last place are merged
    /// ([`Self::merged`]). A list without points is allowed, and moves nothing.
    ///
    /// # Errors
    ///
    /// * [`DirectError::NonFinitePoint`];
    /// * [`DirectError::PointOutside`] of the domain of the grid;
    /// * [`DirectError::FixedOutOfRange`];
    /// * [`DirectError::Damping`] unless positive and finite;
    /// * [`DirectError::Factorisation`], not known to happen.
    pub fn new(
        grid: &Grid<D>,
        points: &[[f64; D]],
        options: &PullOptions<'_>,
    ) -> Result<Self, DirectError> {
        Self::with_weights(grid, points, &vec![1.0; points.len()], options)
    }

    /// Prepares points with a weight each. Weights have no effect on [`Fit::Exact`].
    ///
    /// # Errors
    ///
    /// As [`Self::new`], and
    ///
    /// * [`DirectError::LengthMismatch`] if there is not one weight for each point;
    /// * [`DirectError::Weight`] unless all are positive and finite.
    pub fn with_weights(
        grid: &Grid<D>,
        points: &[[f64; D]],
        weights: &[f64],
        options: &PullOptions<'_>,
    ) -> Result<Self, DirectError> {
        check_length("weights", points.len(), weights.len())?;
        let positive = |x: f64| x > 0.0 && x.is_finite();
        let damping = match options.fit {
            Fit::Exact | Fit::LeastSquares => 0.0,
            Fit::Damped { damping } if positive(damping) => damping,
            Fit::Damped { damping } => return Err(DirectError::Damping { damping }),
        };
        let count = grid.control_point_count();
        if let Some(&control_point) = options.fixed.iter().find(|&&i| i >= count) {
            return Err(DirectError::FixedOutOfRange {
                control_point,
                count,
            });
        }
        if let Some(constraint) = weights.iter().position(|&w| !positive(w)) {
            return Err(DirectError::Weight {
                constraint,
                weight: weights[constraint],
            });
        }
        let mut locations = Vec::with_capacity(points.len());
        for (constraint, &point) in points.iter().enumerate() {
            if let Some(component) = point.iter().position(|x| !x.is_finite()) {
                return Err(DirectError::NonFinitePoint {
                    constraint,
                    component,
                    value: point[component],
                });
            }
            let outside = || DirectError::PointOutside {
                constraint,
                point: point.to_vec(),
            };
            locations.push(grid.locate(point).ok_or_else(outside)?);
        }

        let coordinates: Vec<_> = points.iter().map(|&p| grid.frame().to_lattice(p)).collect();
        let firsts = first_at_same_place(&coordinates);
        let mut builder = RowBuilder::new(grid, options.fixed, points.len());
        let mut places: Vec<Place> = Vec::with_capacity(points.len());
        let mut merged = Vec::new();
        // Only the ratios of weights matter, and with damping that of the two. Nothing
        // moves if it is as large as this limit.
        let heaviest = weights.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
        let damping = (damping / heaviest).min(1e200);
        // Of all constraints in a row.
        let mut total_weights: Vec<f64> = Vec::with_capacity(points.len());
        for (constraint, &first) in firsts.iter().enumerate() {
            let place = if first < constraint {
                merged.push(Merged {
                    constraint,
                    into: first,
                });
                places[first]
            } else {
                let norm = builder.push(&locations[constraint], SMALLEST_NORM);
                let row = (norm >= SMALLEST_NORM).then_some(total_weights.len());
                if row.is_some() {
                    total_weights.push(0.0);
                }
                Place {
                    row,
                    first,
                    share: 0.0,
                    norm,
                }
            };
            if let Some(row) = place.row {
                total_weights[row] += weights[constraint] / heaviest;
            }
            places.push(place);
        }
        for (place, weight) in places.iter_mut().zip(weights) {
            place.share = place
                .row
                .map_or(0.0, |row| weight / heaviest / total_weights[row]);
        }

        let rows = builder.finish();
        let (scales, negligible): (Vec<f64>, f64) = match options.fit {
            // Of norm one each: scaling changes nothing but rounding.
            Fit::Exact => (
                rows.norms.iter().map(|norm| 1.0 / norm).collect(),
                NEGLIGIBLE_EXACT,
            ),
            Fit::LeastSquares | Fit::Damped { .. } => {
                (total_weights.iter().map(|w| w.sqrt()).collect(), NEGLIGIBLE)
            }
        };
        let mut matrix = rows.matrix;
        matrix.scale_rows(&scales);
        let unknowns = matrix.row_count().min(matrix.column_count());
        Ok(Self {
            fit: options.fit,
            control_point_count: count,
            places,
            merged,
            targets: vec![[0.0; D]; scales.len()],
            scales,
            control_points: rows.control_points,
            system: LeastNorm::new(matrix, damping, negligible)
                .map_err(|reason| DirectError::Factorisation { unknowns, reason })?,
            residuals: vec![[0.0; D]; points.len()],
        })
    }

    /// Constraints on the same point as an earlier one, in ascending order.
    #[must_use]
    pub fn merged(&self) -> &[Merged] {
        &self.merged
    }

    /// The control points that may move, those that act on a point and are not fixed, in
    /// no particular order.
    #[must_use]
    pub fn control_points(&self) -> &[usize] {
        &self.control_points
    }

    /// For each constraint, what its point lacks of its displacement after the last
    /// [`Self::solve_into`] that succeeded. Zero before the first.
    #[must_use]
    pub fn residuals(&self) -> &[[f64; D]] {
        &self.residuals
    }

    /// Finds displacements of the control points that move the points by the given
    /// displacements. Returns the length of the longest residual.
    ///
    /// # Shapes and units
    ///
    /// | argument | shape | unit |
    /// |---|---|---|
    /// | `displacements` | `#P × D`, one for each point | world |
    /// | `changes` | one for each control point of the grid, in linear order, overwritten | world |
    ///
    /// Does not allocate unless it fails. Each step of the solution costs
    /// `O(#P n^D)` and two triangular solves; there are usually two.
    ///
    /// # Errors
    ///
    /// * [`DirectError::LengthMismatch`], [`DirectError::NonFiniteDisplacement`]:
    ///   nothing is written.
    ///
    /// After the following `changes` are all zero:
    ///
    /// * [`DirectError::Unreachable`] with [`Fit::Exact`] if a point is to move where B
    ///   has a row of norm below 1e-12: if all control points around are fixed, or next to
    ///   an identity border. Points that are to stay are met there too.
    /// * [`DirectError::Inconsistent`] with [`Fit::Exact`];
    /// * [`DirectError::Overflow`].
    pub fn solve_into(
        &mut self,
        displacements: &[[f64; D]],
        changes: &mut [[f64; D]],
    ) -> Result<f64, DirectError> {
        check_length("displacements", self.places.len(), displacements.len())?;
        check_length("changes", self.control_point_count, changes.len())?;
        for (constraint, displacement) in displacements.iter().enumerate() {
            if let Some(component) = displacement.iter().position(|x| !x.is_finite()) {
                return Err(DirectError::NonFiniteDisplacement {
                    constraint,
                    component,
                    value: displacement[component],
                });
            }
        }
        changes.fill([0.0; D]);
        let unit = unit(displacements);
        self.set_targets(displacements, unit)?;

        // In units: displacements are below 2, the longest is at least 1.
        let scales = &self.scales;
        self.system
            .solve(&self.targets, |row| 0.01 * TOLERANCE * scales[row]);
        if self.fit == Fit::Exact && !self.is_met() {
            return Err(self.contradiction(unit));
        }

        for (&control_point, x) in self.control_points.iter().zip(self.system.x()) {
            let change = x.map(|x| x * unit);
            if change.iter().any(|x| !x.is_finite()) {
                changes.fill([0.0; D]);
                return Err(DirectError::Overflow { control_point });
            }
            changes[control_point] = change;
        }
        Ok(self.set_residuals(displacements, unit))
    }

    /// Sets the right-hand side, in the given unit.
    fn set_targets(&mut self, displacements: &[[f64; D]], unit: f64) -> Result<(), DirectError> {
        self.targets.fill([0.0; D]);
        for (constraint, place) in self.places.iter().enumerate() {
            let displacement = displacements[constraint].map(|x| x / unit);
            if self.fit == Fit::Exact {
                let first = displacements[place.first].map(|x| x / unit);
                let distance = length(subtract(displacement, first));
                if distance > TOLERANCE {
                    return Err(DirectError::Inconsistent {
                        constraints: vec![place.first, constraint],
                        distance: distance * unit,
                    });
                }
                if place.row.is_none() && length(displacement) > TOLERANCE {
                    return Err(DirectError::Unreachable {
                        constraint,
                        factor: 1.0 / place.norm,
                    });
                }
            }
            if let Some(row) = place.row {
                let factor = place.share * self.scales[row];
                let target = &mut self.targets[row];
                *target = std::array::from_fn(|c| target[c] + factor * displacement[c]);
            }
        }
        Ok(())
    }

    /// Whether what is left of each constraint is below the tolerance.
    fn is_met(&self) -> bool {
        let mut residual = self.system.residual().iter().zip(&self.scales);
        residual.all(|(r, scale)| length(*r) / scale <= TOLERANCE)
    }

    /// Which constraints are not met, and why.
    fn contradiction(&mut self, unit: f64) -> DirectError {
        let residual = self.system.residual().iter().zip(&self.scales);
        let left: Vec<f64> = residual.map(|(r, scale)| length(*r) / scale).collect();
        let (worst, distance) = largest(&left);
        // If a contradiction is left, its parts are larger than what rounding leaves. Else
        // control points had to move so far that rounding alone is too large.
        let far = self
            .system
            .x()
            .iter()
            .map(|x| length(*x))
            .fold(0.0, f64::max);
        let found = if distance > ROUNDING * far {
            self.connected(worst, |row| left[row] > TOLERANCE.max(INVOLVED * distance))
        } else {
            let pulls: Vec<f64> = self
                .system
                .multipliers()
                .iter()
                .map(|y| length(*y))
                .collect();
            let (hardest, pull) = largest(&pulls);
            self.connected(hardest, |row| pulls[row] > PULLING * pull)
        };
        let involved = |place: &Place| place.row.is_some_and(|row| found[row]);
        let constraints = (0..self.places.len())
            .filter(|&i| self.places[i].first == i && involved(&self.places[i]))
            .collect();
        DirectError::Inconsistent {
            constraints,
            distance: distance * unit,
        }
    }

    /// Marks those of the involved rows that are connected with the given one: directly
    /// by a control point, or by way of others of them.
    fn connected(&self, first: usize, involved: impl Fn(usize) -> bool) -> Vec<bool> {
        let matrix = self.system.matrix();
        let transposed = matrix.transposed();
        let mut found = vec![false; matrix.row_count()];
        let mut seen = vec![false; matrix.column_count()];
        found[first] = true;
        let mut open = vec![first];
        while let Some(row) = open.pop() {
            for &column in matrix.row(row).0 {
                if std::mem::replace(&mut seen[column], true) {
                    continue;
                }
                for &other in transposed.row(column).0 {
                    if !found[other] && involved(other) {
                        found[other] = true;
                        open.push(other);
                    }
                }
            }
        }
        found
    }

    /// Returns the length of the longest.
    fn set_residuals(&mut self, displacements: &[[f64; D]], unit: f64) -> f64 {
        let mut longest = 0.0_f64;
        for ((constraint, place), &displacement) in
            self.places.iter().enumerate().zip(displacements)
        {
            let displacement = displacement.map(|x| x / unit);
            let residual = match place.row {
                None => displacement,
                Some(row) => {
                    // Displacement of the point, from the residual of the row.
                    let (target, left) = (self.targets[row], self.system.residual()[row]);
                    let scale = self.scales[row];
                    std::array::from_fn(|c| {
                        let mean = target[c] / scale;
                        (displacement[c] - mean) + left[c] / scale
                    })
                }
            };
            longest = longest.max(length(residual));
            self.residuals[constraint] = residual.map(|x| x * unit);
        }
        longest * unit
    }
}

fn check_length(what: &'static str, expected: usize, found: usize) -> Result<(), DirectError> {
    if expected == found {
        Ok(())
    } else {
        Err(DirectError::LengthMismatch {
            what,
            expected,
            found,
        })
    }
}

/// A power of two, such that the largest component divided by it is between 1 and 2:
/// nothing overflows or underflows on the way, and division does not round.
fn unit<const D: usize>(displacements: &[[f64; D]]) -> f64 {
    let components = displacements.as_flattened().iter();
    let largest = components.fold(0.0_f64, |a, x| a.max(x.abs()));
    const EXPONENT: u64 = 0x7ff0_0000_0000_0000;
    f64::from_bits(largest.to_bits() & EXPONENT).max(f64::MIN_POSITIVE)
}

fn subtract<const D: usize>(a: [f64; D], b: [f64; D]) -> [f64; D] {
    std::array::from_fn(|c| a[c] - b[c])
}

fn length<const D: usize>(a: [f64; D]) -> f64 {
    a.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// The largest number, and where it is; something that is not a number counts as larger.
fn largest(numbers: &[f64]) -> (usize, f64) {
    let mut largest = (0, 0.0);
    for (i, &number) in numbers.iter().enumerate() {
        if number.is_nan() || number > largest.1 {
            largest = (i, number);
        }
    }
    largest
}
