//! Newton's method: in the whole domain, and on the polynomial of one cell.

use crate::Evaluation;
use crate::grid::Location;
use crate::matrix::{multiply, solve};

use super::Inverse;
use super::search::Outcome;

/// The residual promised, in units of ε · size.
const TOLERANCE: f64 = 16.0;

/// A residual, in units of ε · size, that is not worth another step.
const GOOD: f64 = 1.0;

/// Steps of the method in the domain, and on a cell.
const STEPS: usize = 30;
const STEPS_IN_A_CELL: usize = 12;

/// How often a step is halved.
const HALVINGS: usize = 8;

/// A point of the domain and what is known there.
#[derive(Debug, Clone, Copy)]
pub(super) struct Trial<const D: usize> {
    pub(super) y: [f64; D],
    location: Location<D>,
    there: Evaluation<D>,
    /// The distance from the image to the point that is sought, in units of ε · size.
    pub(super) residual: f64,
}

impl<const D: usize> Trial<D> {
    pub(super) fn found(&self) -> Outcome<D> {
        Outcome::Found {
            y: self.y,
            residual: self.residual,
        }
    }
}

impl<const D: usize> Inverse<'_, D> {
    /// Damped Newton steps from a point, which is moved into the domain first, to where
    /// the residual no longer decreases. `None` if no point of the domain was met,
    /// which takes a frame in which numbers are farther apart than cells.
    pub(super) fn newton(&self, q: [f64; D], start: [f64; D]) -> Option<Trial<D>> {
        let mut here = self.trial(q, start)?;
        for _ in 0..STEPS {
            let step = self.newton_step(q, &here);
            let Some(better) = self.damped(&here, |factor| {
                self.trial(q, std::array::from_fn(|c| here.y[c] - factor * step[c]))
            }) else {
                break;
            };
            let stalled = better.residual > 0.98 * here.residual;
            here = better;
            if here.residual <= GOOD || stalled && !self.accepted(&here) {
                break;
            }
        }
        if here.residual > TOLERANCE && self.accepted(&here) {
            here = self.best_neighbour(q, here);
        }
        Some(here)
    }

    /// The same on the polynomial of one cell, from a place within and never leaving it.
    pub(super) fn newton_in_cell(&self, q: [f64; D], start: Location<D>) -> Trial<D> {
        let inverse = self.lattice.grid().frame().inverse();
        let mut here = self.trial_at(q, self.world(&start), start);
        for _ in 0..STEPS_IN_A_CELL {
            let step = multiply(&inverse, self.newton_step(q, &here));
            let Some(better) = self.damped(&here, |factor| {
                let mut location = here.location;
                for (t, step) in location.t.iter_mut().zip(step) {
                    *t = (*t - factor * step).clamp(0.0, 1.0);
                }
                if location.t.iter().any(|t| t.is_nan()) {
                    return None;
                }
                Some(self.trial_at(q, self.world(&location), location))
            }) else {
                break;
            };
            let stalled = better.residual > 0.7 * here.residual;
            here = better;
            if here.residual <= GOOD || stalled {
                break;
            }
        }
        here
    }

    /// The world point at a place.
    pub(super) fn world(&self, location: &Location<D>) -> [f64; D] {
        let grid = self.lattice.grid();
        grid.frame().to_world(std::array::from_fn(|axis| {
            location.t[axis] + (location.cell[axis] as f64 - grid.layers(axis) as f64)
        }))
    }

    /// `J⁻¹ (F(y) − q)`; not finite where J is singular.
    fn newton_step(&self, q: [f64; D], here: &Trial<D>) -> [f64; D] {
        let difference = std::array::from_fn(|c| here.there.position[c] - q[c]);
        solve(&here.there.jacobian, difference)
    }

    /// The first trial, with halved steps, that is better than the last one. If that is
    /// good enough, only the full step is tried.
    fn damped(&self, here: &Trial<D>, trial: impl Fn(f64) -> Option<Trial<D>>) -> Option<Trial<D>> {
        let mut factor = 1.0;
        for _ in 0..=HALVINGS {
            let next = trial(factor)?;
            if next.residual < here.residual {
                return Some(next);
            }
            if here.residual <= TOLERANCE {
                return None;
            }
            factor *= 0.5;
        }
        None
    }

    /// Looks at the numbers next to each coordinate, as long as that helps: where F
    /// stretches space, rounding y moves its image by more than the tolerance.
    fn best_neighbour(&self, q: [f64; D], mut best: Trial<D>) -> Trial<D> {
        for _ in 0..HALVINGS {
            let middle = best.y;
            let before = best.residual;
            for code in 0..3_usize.pow(u32::try_from(D).unwrap_or(3)) {
                let mut digits = code;
                let y = middle.map(|c| {
                    let digit = digits % 3;
                    digits /= 3;
                    [c, c.next_up(), c.next_down()][digit]
                });
                let trial = self.lattice.grid().locate(y);
                if let Some(location) = trial {
                    let trial = self.trial_at(q, y, location);
                    if trial.residual < best.residual {
                        best = trial;
                    }
                }
            }
            if best.residual <= TOLERANCE || best.residual >= before {
                break;
            }
        }
        best
    }

    /// Evaluates at the point of the domain that is nearest to `y`.
    fn trial(&self, q: [f64; D], y: [f64; D]) -> Option<Trial<D>> {
        let (y, location) = self.in_domain(y)?;
        Some(self.trial_at(q, y, location))
    }

    fn trial_at(&self, q: [f64; D], y: [f64; D], location: Location<D>) -> Trial<D> {
        let there = self.lattice.evaluate_at(y, &location);
        // Scaled before it is squared, so that nothing overflows or underflows.
        let unit = f64::EPSILON * self.size;
        let mut square = 0.0;
        for (image, q) in there.position.iter().zip(q) {
            let error = (image - q) / unit;
            square += error * error;
        }
        Trial {
            y,
            location,
            there,
            residual: square.sqrt(),
        }
    }

    /// Whether a point is a preimage up to rounding: within the tolerance, or within
    /// what the image can jump from one number to the next.
    pub(super) fn accepted(&self, trial: &Trial<D>) -> bool {
        trial.residual <= TOLERANCE || trial.residual <= self.jump(trial)
    }

    /// By how much the image of a point can be off because its own coordinates, and the
    /// place that follows from them, are rounded; in units of ε · size.
    fn jump(&self, trial: &Trial<D>) -> f64 {
        let axes = self.lattice.grid().frame().axes();
        let unit = f64::EPSILON * self.size;
        let mut square = 0.0;
        for (r, row) in trial.there.jacobian.iter().enumerate() {
            let places = row.iter().zip(self.rounding.world);
            let mut jump: f64 = places
                .map(|(x, place)| x.abs() * (2.0 * place / unit))
                .sum();
            for (axis, rounding) in axes.iter().zip(self.rounding.lattice) {
                // Along this axis the displacement grows by J a − a.
                let image: f64 = row.iter().zip(axis).map(|(x, a)| x * a).sum();
                jump += (image - axis[r]).abs() * (rounding / unit);
            }
            square += jump * jump;
        }
        square.sqrt()
    }

    /// A point of the domain next to `y`, and where it is. On the border, rounding may
    /// place a point outside: it is then moved inside, by as little as it takes.
    fn in_domain(&self, y: [f64; D]) -> Option<([f64; D], Location<D>)> {
        let grid = self.lattice.grid();
        if let Some(location) = grid.locate(y) {
            return Some((y, location));
        }
        let u = grid.frame().to_lattice(y);
        if u.iter().any(|u| u.is_nan()) {
            return None;
        }
        let domain = grid.domain();
        let mut inset = 0.0;
        for _ in 0..HALVINGS {
            let y = grid.frame().to_world(std::array::from_fn(|axis| {
                let [low, high] = domain[axis];
                let inset = (inset * self.rounding.round_trip[axis]).min(0.5 * (high - low));
                u[axis].clamp(low + inset, high - inset)
            }));
            if let Some(location) = grid.locate(y) {
                return Some((y, location));
            }
            inset = if inset > 0.0 { 2.0 * inset } else { 1.0 / 16.0 };
        }
        None
    }
}
