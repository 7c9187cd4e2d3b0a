//! Boxes that floating point left in doubt, in exact arithmetic.
//!
//! At a corner the determinant is a polynomial in t with integer coefficients, and its first
//! root is found also where it only touches zero. That, less the width, is how far the rest
//! of the box has to be proven positive.

use dashu_int::IBig;

use super::super::exact::{ExactPiece, decompose};
use super::super::search::DEEPEST;
use super::boxes::TimeBox;
use super::root::first_root;
use super::search::Search;

/// The determinant over a part of a cell and of the way: D + 1 coefficients along the way.
#[derive(Debug, Clone)]
struct ExactBox<const D: usize> {
    slabs: Vec<ExactPiece>,
    low: [f64; D],
    level: [i32; D],
    t: [f64; 2],
    /// How often the way was halved.
    cuts: usize,
}

impl<const D: usize> Search<'_, D> {
    /// Settles the boxes in doubt, the earliest first. Returns up to where nothing folds in
    /// them; infinite if that is beyond what matters.
    pub(super) fn settle(&mut self, allowed: usize) -> f64 {
        let mut doubtful = std::mem::take(&mut self.doubtful);
        doubtful.sort_by(|a, b| b.cmp(a));
        let mut safe = f64::INFINITY;
        let mut cached: Option<(usize, Vec<ExactPiece>)> = None;
        for part in doubtful {
            if part.safe >= self.target() {
                continue;
            }
            if self.effort.exact_boxes >= allowed {
                safe = safe.min(part.safe);
                continue;
            }
            let whole = match cached.take() {
                Some((cell, slabs)) if cell == part.cell => slabs,
                _ => {
                    self.effort.exact_boxes += 1 << D;
                    let cell = cell_of(&self.cells(), part.cell);
                    ExactPiece::of_path(self.from, self.to, cell)
                }
            };
            safe = safe.min(self.settle_box(&whole, &part, allowed));
            cached = Some((part.cell, whole));
        }
        safe
    }

    fn settle_box(&mut self, whole: &[ExactPiece], part: &TimeBox<D>, allowed: usize) -> f64 {
        let slabs = whole.iter().map(|slab| slab.part(part.low, part.level));
        let mut first = ExactBox {
            slabs: slabs.collect(),
            low: part.low,
            level: part.level,
            t: [0.0, 1.0],
            cuts: 0,
        };
        let halvings = usize::try_from(part.level.iter().sum::<i32>()).expect("not negative");
        self.effort.exact_boxes += halvings * (D + 1);
        self.find_roots(&first, part.cell);
        if part.safe >= self.target() {
            return f64::INFINITY;
        }
        first.restrict(part.safe, self.target());
        // A stack would do, but the earliest tells how far all are safe.
        let mut open = vec![first];
        while let Some(index) = earliest(&open) {
            let next = open.swap_remove(index);
            if next.t[0] >= self.target() {
                continue;
            }
            if self.effort.exact_boxes >= allowed {
                return next.t[0];
            }
            self.effort.exact_boxes += D + 1;
            if next.slabs.iter().all(is_positive) {
                continue;
            }
            self.find_roots(&next, part.cell);
            if next.t[0] >= self.target() {
                continue;
            }
            match next.halves() {
                Some(halves) => open.extend(halves),
                None => return next.t[0],
            }
        }
        f64::INFINITY
    }

    /// Looks for folds at the corners of a box.
    fn find_roots(&mut self, part: &ExactBox<D>, cell: usize) {
        for corner in 0..1_usize << D {
            let index = self.shape.corner(corner);
            let along: Vec<IBig> = part
                .slabs
                .iter()
                .map(|s| s.coefficients()[index].clone())
                .collect();
            if let Some([_, root]) = first_root(&along) {
                let [from, to] = part.t;
                let time = if part.t == [0.0, 1.0] {
                    root
                } else {
                    ((from + root * (to - from)) * (1.0 + 4.0 * f64::EPSILON)).min(to)
                };
                let place = std::array::from_fn(|a| {
                    let end = f64::from(u8::from(corner >> a & 1 == 1));
                    part.low[a] + end * 0.5_f64.powi(part.level[a])
                });
                self.record(cell, place, time);
            }
        }
    }
}

fn cell_of<const D: usize>(cells: &[usize; D], number: usize) -> [usize; D] {
    let mut rest = number;
    cells.map(|n| {
        let index = rest % n;
        rest /= n;
        index
    })
}

fn earliest<const D: usize>(open: &[ExactBox<D>]) -> Option<usize> {
    (0..open.len()).min_by(|&i, &j| open[i].t[0].total_cmp(&open[j].t[0]))
}

fn is_positive(slab: &ExactPiece) -> bool {
    slab.coefficients().iter().all(|c| *c > IBig::ZERO)
}

impl<const D: usize> ExactBox<D> {
    /// Keeps the part of the way between two places, given as fractions of all of it; the
    /// box must not have been restricted before.
    fn restrict(&mut self, from: f64, to: f64) {
        self.keep(fraction(to), false);
        // As a fraction of what is left: from / to.
        let ([m, p], [n, q]) = (fraction(from), fraction(to));
        self.keep([m * q, p * n], true);
        self.t = [from, to];
    }

    /// The part before or after the fraction `m / p`, times a positive number.
    fn keep(&mut self, [m, p]: [IBig; 2], upper: bool) {
        let rest = &p - &m;
        for step in 1..=D {
            for i in 0..=D - step {
                let k = if upper { i } else { D - 1 - i };
                let (before, after) = self.slabs.split_at_mut(k + 1);
                let (a, b) = (&mut before[k], &mut after[0]);
                let both = a.coefficients_mut().iter_mut().zip(b.coefficients_mut());
                for (a, b) in both {
                    let mean = &*a * &rest + &*b * &m;
                    *(if upper { a } else { b }) = mean;
                }
            }
            // What has no more steps to go must grow as the others do.
            let done = if upper { D + 1 - step..D + 1 } else { 0..step };
            for slab in &mut self.slabs[done] {
                for c in slab.coefficients_mut() {
                    *c *= &p;
                }
            }
        }
    }

    /// Cuts the box in half, in space or along the way; `None` if it is too small for that.
    fn halves(&self) -> Option<[Self; 2]> {
        let axis = (0..D).min_by_key(|&a| self.level[a])?;
        let begins_positive = is_positive(&self.slabs[0]);
        let depth: i32 = self.level.iter().sum();
        let is_next = self.cuts * D <= usize::try_from(depth).unwrap_or(0);
        let middle = f64::midpoint(self.t[0], self.t[1]);
        let inside = self.t[0] < middle && middle < self.t[1];
        if begins_positive && inside && (is_next || self.level[axis] >= DEEPEST) {
            // A fraction of the box: exactly where the middle, rounded, is.
            let [from, to] = self.t;
            let part = ratio(from, middle, to);
            let (mut before, mut after) = (self.clone(), self.clone());
            before.keep(part.clone(), false);
            after.keep(part, true);
            before.t[1] = middle;
            after.t[0] = middle;
            before.cuts += 1;
            after.cuts += 1;
            return Some([before, after]);
        }
        if self.level[axis] >= DEEPEST {
            return None;
        }
        let mut halves = [self.clone(), self.clone()];
        for (k, slab) in self.slabs.iter().enumerate() {
            let [low, high] = slab.split(axis);
            halves[0].slabs[k] = low;
            halves[1].slabs[k] = high;
        }
        for half in &mut halves {
            half.level[axis] += 1;
        }
        halves[1].low[axis] += 0.5_f64.powi(halves[1].level[axis]);
        Some(halves)
    }
}

/// A number that is not negative as a fraction of integers.
fn fraction(t: f64) -> [IBig; 2] {
    let (mantissa, exponent) = decompose(t);
    let shift = exponent.unsigned_abs() as usize;
    if exponent >= 0 {
        [IBig::from(mantissa) << shift, IBig::ONE]
    } else {
        let zeros = (mantissa.trailing_zeros() as usize).min(shift);
        if mantissa == 0 {
            return [IBig::ZERO, IBig::ONE];
        }
        [IBig::from(mantissa >> zeros), IBig::ONE << (shift - zeros)]
    }
}

/// `(middle − from) / (to − from)`.
fn ratio(from: f64, middle: f64, to: f64) -> [IBig; 2] {
    let [from, middle, to] = [from, middle, to].map(fraction);
    let over = |a: &[IBig; 2], b: &[IBig; 2]| &a[0] * &b[1] - &b[0] * &a[1];
    // Over the denominators of the middle and of the end, and that of `from` twice.
    [over(&middle, &from) * &to[1], over(&to, &from) * &middle[1]]
}
