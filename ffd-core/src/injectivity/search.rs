//! The exact test: is `det J` positive everywhere?
//!
//! Each cell is decided by the first of these that can:
//!
//! 1. the conic-hull test ([`cones`](super::cones)), a few nanoseconds a cell;
//! 2. how near columns are to the axes ([`dominance`](super::dominance)), as cheap;
//! 3. the signs of the Bernstein coefficients ([`product`](super::product));
//! 4. subdivision, the worst box of all cells first ([`subdivide`](super::subdivide));
//! 5. exact arithmetic for boxes where values are as small as rounding errors
//!    ([`settle`](super::settle)).
//!
//! A box is positive if all coefficients, or a better lower bound ([`lower`](super::lower)),
//! are above a bound of the rounding error; it is folded if a corner is below minus that
//! bound. Nothing else decides.

use std::collections::HashMap;

use super::batch;
use super::cones::Cones;
use super::dominance::{distances_in_cell, lower_bound};
use super::partials::Partials;
use super::piece::Shape;
use super::product::Products;
use super::queue::{Node, Queue};
use super::{Budget, Effort, Place, Undecided};
use crate::Lattice;

/// Fewer cells than that are bounded one at a time.
const FEWEST_IN_A_BATCH: usize = 5;

/// Halvings of a cell along an axis, at most: positions stay exact numbers.
pub(super) const DEEPEST: i32 = 50;

/// What is known of a cell.
///
/// Boxes keep it small: there is one for each cell, and nearly all are of the first kinds.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum State<const D: usize> {
    /// Nothing yet.
    Unknown,
    /// `det J > 0` by the conic-hull test.
    Cones,
    /// `det J > 0`, and a lower bound.
    Positive(f64),
    /// `det J < 0` throughout.
    Negative,
    /// `det J` is negative at a place, and not known to be negative throughout.
    Folded(Box<Place<D>>),
    /// `det J` is zero at a place, and nowhere negative, or nowhere positive if everything
    /// was to be proven negative when that was found. Not kept when control points move.
    Zero(Box<Place<D>>),
    /// The budget was not enough.
    Doubtful(Box<Undecided<D>>),
}

/// What is known of the parts of a cell while others are still in doubt: the state of the
/// cell changes only when none is, or when a part says that it folds.
#[derive(Debug, Clone, Copy)]
struct Progress<const D: usize> {
    /// Parts in doubt.
    open: usize,
    /// A lower bound of the others.
    bound: f64,
    /// A zero in the others.
    zero: Option<Place<D>>,
}

/// What a part of a cell turned out to be.
#[derive(Debug, Clone, Copy)]
pub(super) enum Part<const D: usize> {
    /// It has the sign that was to be proven, and is above this bound.
    Right(f64),
    /// It has no value of the other sign, and a zero.
    Zero(Place<D>),
}

/// The cells of a lattice and what is known of them.
#[derive(Debug, Clone)]
pub(super) struct Search<const D: usize> {
    pub(super) partials: Partials<D>,
    pub(super) products: Products<D>,
    pub(super) cones: Cones<D>,
    pub(super) shape: Shape,
    pub(super) states: Vec<State<D>>,
    progress: HashMap<usize, Progress<D>>,
    /// A place where `det J` is positive, if one is known, and one where it is negative.
    pub(super) positive: Option<Place<D>>,
    pub(super) negative: Option<Place<D>>,
    /// The least upper bound of the determinant at any place looked at.
    pub(super) least_seen: f64,
    pub(super) effort: Effort,
    pub(super) scratch: Vec<f64>,
    /// Whether batches are shared among threads. The result is the same.
    parallel: bool,
}

/// What all cells together are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Sign<const D: usize> {
    Positive,
    Negative,
    Both {
        positive: Place<D>,
        negative: Place<D>,
    },
    Zero {
        zero: Place<D>,
        reversed: bool,
    },
    Undecided(Undecided<D>),
}

impl<const D: usize> Search<D> {
    pub(super) fn new(lattice: &Lattice<D>, parallel: bool) -> Self {
        let partials = Partials::without_vectors(lattice);
        let degree = partials.degree;
        Self {
            products: Products::new(degree),
            cones: Cones::new(&partials),
            shape: Shape::new(&Products::result_degree(degree)),
            states: vec![State::Unknown; partials.cell_count()],
            progress: HashMap::new(),
            positive: None,
            negative: None,
            least_seen: f64::INFINITY,
            effort: Effort::default(),
            scratch: Vec::new(),
            parallel,
            partials,
        }
    }

    /// Tests all cells by cones, and returns whether all pass.
    pub(super) fn test_cones(&mut self) -> bool {
        if (0..D).any(|axis| self.partials.plain(axis).is_none()) {
            self.partials.prepare();
        }
        let Self {
            cones,
            partials,
            states,
            ..
        } = self;
        let mut all = true;
        cones.test(partials, |cell, passes| {
            states[cell] = if passes { State::Cones } else { State::Unknown };
            all &= passes;
        });
        all
    }

    /// Begins to count anew.
    pub(super) fn begin(&mut self) {
        self.effort = Effort::default();
        self.least_seen = f64::INFINITY;
    }

    /// Takes over the displacements of control points, and forgets what was known of the
    /// cells that they act on.
    pub(super) fn touch(&mut self, lattice: &Lattice<D>, moved: &[usize]) {
        self.partials.prepare();
        let mut places = Vec::with_capacity(moved.len());
        for &control_point in moved {
            let indices = lattice.grid().control_point_indices(control_point);
            let displacement = lattice.displacements()[control_point];
            places.push(self.partials.set(indices, displacement));
        }
        let Self {
            cones,
            partials,
            states,
            ..
        } = self;
        let each: usize = partials.degree.iter().map(|n| n + 1).product();
        let is_most = places.len().saturating_mul(each) > states.len();
        if is_most {
            let mut touched = vec![false; states.len()];
            for &place in &places {
                partials.for_cells_around(place, |cell| touched[cell] = true);
            }
            cones.test(partials, |cell, passes| {
                if touched[cell] {
                    states[cell] = if passes { State::Cones } else { State::Unknown };
                }
            });
        } else {
            for place in places {
                cones.test_around(partials, place, |cell, passes| {
                    states[cell] = if passes { State::Cones } else { State::Unknown };
                });
            }
        }
        // A positive value that belongs to no state may have been in a touched cell. Where
        // no other is known, cells with a fold are looked at again for one. And what zeros
        // mean depends on the sign elsewhere.
        self.positive = None;
        let known = |s: &State<D>| matches!(s, State::Cones | State::Positive(_));
        let no_sign = !self.states.iter().any(known);
        for state in &mut self.states {
            if no_sign || matches!(state, State::Zero(_)) {
                *state = State::Unknown;
            }
        }
    }

    /// An interval that contains the minimum of `det J`, as far as it is known by now.
    pub(super) fn seen(&self, regular: bool) -> [f64; 2] {
        let least = self.states.iter().map(|state| match state {
            State::Positive(bound) => *bound,
            State::Cones | State::Zero(_) => 0.0,
            State::Doubtful(undecided) => undecided.det[0],
            State::Unknown | State::Negative | State::Folded(_) => f64::NEG_INFINITY,
        });
        let least = least.fold(f64::INFINITY, f64::min);
        let low = if regular {
            least.max(0.0)
        } else if self.negative.is_some() {
            // Cells were searched for something else than their least value.
            f64::NEG_INFINITY
        } else {
            least
        };
        self.partials.divide_by_frame([low, self.least_seen])
    }

    /// Decides the sign of the determinant in all cells that are not decided yet. With
    /// `all` unset, the search may end as soon as both signs are found.
    pub(super) fn decide(&mut self, lattice: &Lattice<D>, budget: &Budget, all: bool) -> Sign<D> {
        self.partials.prepare();
        self.progress.clear();
        self.take_places_from_states(lattice);
        let open = |s: &State<D>| matches!(s, State::Unknown | State::Doubtful(_));
        let all_cells = 0..self.states.len();
        let mut cells: Vec<usize> = all_cells.filter(|&c| open(&self.states[c])).collect();
        let mut queue = Queue::default();
        if cells.len() >= FEWEST_IN_A_BATCH {
            self.sort_by_dominance(&mut cells);
            // A map that folds is likely to do so in the first of them.
            if !all && cells.len() > batch::GROUP {
                let rest = cells.split_off(batch::GROUP);
                self.bound_in_batches(lattice, &mut cells);
                for cell in std::mem::replace(&mut cells, rest) {
                    self.bound_cell(lattice, cell, &mut queue);
                    if let Some(both) = self.both_signs() {
                        return both;
                    }
                }
            }
        }
        if cells.len() >= FEWEST_IN_A_BATCH {
            self.bound_in_batches(lattice, &mut cells);
        }
        for cell in cells {
            if !all && let Some(both) = self.both_signs() {
                return both;
            }
            self.bound_cell(lattice, cell, &mut queue);
        }
        // As long as no positive value was seen, but a negative one, the map is taken for a
        // mirror image, and everything is to be proven negative.
        let reversed = self.positive.is_none() && self.negative.is_some();
        if reversed {
            queue = Queue::default();
            self.progress.clear();
            for cell in 0..self.states.len() {
                if !matches!(self.states[cell], State::Negative) {
                    if matches!(self.states[cell], State::Doubtful(_) | State::Zero(_)) {
                        self.states[cell] = State::Unknown;
                    }
                    self.open_part(cell);
                    queue.push(self.whole_cell(cell));
                }
            }
        }
        let doubtful = self.subdivide(lattice, queue, budget, all, reversed);
        self.decide_exactly(lattice, doubtful, budget, all, reversed);
        // The other way round: where the first negative value was found only now and still
        // no positive one, or where, once both are known, all cells are asked for that are
        // not regular.
        let was_wrong = if reversed {
            all && self.positive.is_some()
        } else {
            self.positive.is_none() && self.negative.is_some()
        };
        if was_wrong {
            return self.decide(lattice, budget, all);
        }
        self.sum_up(reversed)
    }

    /// Takes cells from the list that are regular because columns are near the axes, and sorts
    /// the others: those come first in which columns are farthest from them.
    fn sort_by_dominance(&mut self, cells: &mut Vec<usize>) {
        let mut sizes: Vec<(f64, usize)> = Vec::with_capacity(cells.len());
        for &cell in &*cells {
            let distances = distances_in_cell(&self.partials, self.partials.cell(cell));
            if let Some(least) = lower_bound(distances) {
                self.states[cell] = State::Positive(least);
            } else {
                sizes.push((distances.iter().sum(), cell));
            }
        }
        sizes.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        cells.clear();
        cells.extend(sizes.iter().map(|&(_, cell)| cell));
    }

    /// Decides the cells that single precision can decide, and leaves the others in the list.
    fn bound_in_batches(&mut self, lattice: &Lattice<D>, cells: &mut Vec<usize>) {
        if !self.partials.is_sound() {
            return;
        }
        self.effort.boxes += cells.len();
        let Self {
            partials, states, ..
        } = self;
        let lists = batch::by_kind(partials, cells);
        cells.clear();
        let mut least_seen = self.least_seen;
        for list in lists {
            let kind = batch::Kind::new(self.products.level, partials, list[0]);
            let bounds = bounds_of_all(&kind, &list, self.parallel);
            for (&cell, bounds) in list.iter().zip(bounds) {
                let low = bounds.min - bounds.error;
                least_seen = least_seen.min(bounds.low_corner + bounds.error);
                states[cell] = if low > 0.0 {
                    State::Positive(low)
                } else if bounds.max < -bounds.error {
                    State::Negative
                } else {
                    cells.push(cell);
                    State::Unknown
                };
            }
        }
        cells.sort_unstable();
        self.take_places_from_states(lattice);
        self.least_seen = least_seen;
    }

    /// Finds places of both signs among what is known of the cells.
    fn take_places_from_states(&mut self, lattice: &Lattice<D>) {
        let find = |wanted: fn(&State<D>) -> bool| self.states.iter().position(wanted);
        let corner = |cell: usize| self.place(lattice, cell, [0.0; D]);
        let positive = find(|s| matches!(s, State::Cones | State::Positive(_))).map(corner);
        let negative = find(|s| matches!(s, State::Negative)).map(corner);
        let folded = self.states.iter().find_map(|state| match state {
            State::Folded(place) => Some(**place),
            _ => None,
        });
        self.positive = positive.or(self.positive);
        self.negative = folded.or(negative);
    }

    /// What the states of all cells amount to.
    fn sum_up(&self, reversed: bool) -> Sign<D> {
        if let Some(both) = self.both_signs() {
            return both;
        }
        let doubt = self.states.iter().find_map(|state| match state {
            State::Doubtful(undecided) => Some(Sign::Undecided(**undecided)),
            _ => None,
        });
        let zero = self.states.iter().find_map(|state| match state {
            State::Zero(zero) => Some(Sign::Zero {
                zero: **zero,
                reversed,
            }),
            _ => None,
        });
        if let Some(other) = doubt.or(zero) {
            return other;
        }
        let proven = |state: &State<D>| match state {
            State::Cones | State::Positive(_) => !reversed,
            State::Negative => reversed,
            _ => false,
        };
        // There is no such cell; a claim must rest on the states alone, though.
        if let Some(cell) = self.states.iter().position(|state| !proven(state)) {
            return Sign::Undecided(Undecided {
                cell: self.partials.cell(cell),
                part: [[0.0, 1.0]; D],
                det: [f64::NEG_INFINITY, f64::INFINITY],
            });
        }
        if reversed {
            Sign::Negative
        } else {
            Sign::Positive
        }
    }

    pub(super) fn both_signs(&self) -> Option<Sign<D>> {
        Some(Sign::Both {
            positive: self.positive?,
            negative: self.negative?,
        })
    }

    pub(super) fn place(&self, lattice: &Lattice<D>, cell: usize, t: [f64; D]) -> Place<D> {
        let cell = self.partials.cell(cell);
        let grid = lattice.grid();
        let u = std::array::from_fn(|a| cell[a] as f64 - grid.layers(a) as f64 + t[a]);
        Place {
            cell,
            t,
            world: grid.frame().to_world(u),
        }
    }

    /// The determinant over a whole cell.
    pub(super) fn whole_cell(&mut self, cell: usize) -> Node<D> {
        let mut coefficients = Vec::new();
        let place = self.partials.cell(cell);
        let error = self
            .products
            .determinant(&self.partials, place, &mut coefficients);
        let sound = self.partials.is_sound() && error < f64::INFINITY;
        self.effort.boxes += 1;
        Node {
            key: f64::NEG_INFINITY,
            cell,
            low: [0.0; D],
            level: [0; D],
            bounds: self.shape.bounds(&coefficients),
            coefficients,
            error: if sound { error } else { f64::INFINITY },
        }
    }

    /// Bounds the determinant over a cell. What is left in doubt comes into the queue.
    fn bound_cell(&mut self, lattice: &Lattice<D>, cell: usize, queue: &mut Queue<D>) {
        let mut node = self.whole_cell(cell);
        self.states[cell] = State::Unknown;
        let (bounds, error) = (node.bounds, node.error);
        if error < f64::INFINITY {
            self.least_seen = self.least_seen.min(bounds.low_corner.0 + error);
            if bounds.high_corner.0 > error && self.positive.is_none() {
                self.positive = Some(self.corner(lattice, &node, bounds.high_corner.1));
            }
            if bounds.low_corner.0 < -error {
                let place = self.corner(lattice, &node, bounds.low_corner.1);
                self.negative = self.negative.or(Some(place));
                self.states[cell] = if bounds.max < -error {
                    State::Negative
                } else {
                    State::Folded(Box::new(place))
                };
                return;
            }
            if bounds.min > error {
                self.states[cell] = State::Positive(bounds.min - error);
                return;
            }
            node.key = bounds.min - error;
        }
        self.open_part(cell);
        queue.push(node);
    }

    pub(super) fn corner(&self, lattice: &Lattice<D>, node: &Node<D>, corner: usize) -> Place<D> {
        let part = node.part();
        let t = std::array::from_fn(|a| part[a][corner >> a & 1]);
        self.place(lattice, node.cell, t)
    }

    /// One part more of a cell is in doubt.
    pub(super) fn open_part(&mut self, cell: usize) {
        let progress = self.progress.entry(cell).or_insert(Progress {
            open: 0,
            bound: f64::INFINITY,
            zero: None,
        });
        progress.open += 1;
    }

    /// A part of a cell is decided. With the last one, the cell is.
    pub(super) fn close_part(&mut self, cell: usize, part: Part<D>, reversed: bool) {
        let Some(progress) = self.progress.get_mut(&cell) else {
            return;
        };
        progress.open -= 1;
        match part {
            Part::Right(bound) => progress.bound = progress.bound.min(bound),
            Part::Zero(place) => progress.zero = progress.zero.or(Some(place)),
        }
        let known = match self.states[cell] {
            State::Folded(_) => !reversed,
            State::Doubtful(_) => true,
            _ => false,
        };
        if progress.open > 0 || known {
            return;
        }
        self.states[cell] = match progress.zero {
            Some(place) => State::Zero(Box::new(place)),
            None if reversed => State::Negative,
            None => State::Positive(progress.bound),
        };
    }
}

/// Bounds of the determinant in cells of one kind.
fn bounds_of_all<const D: usize>(
    kind: &batch::Kind<'_, D>,
    cells: &[usize],
    parallel: bool,
) -> Vec<batch::CellBounds> {
    let some = |cells: &[usize]| kind.bounds(cells).into_iter().take(cells.len());
    #[cfg(feature = "rayon")]
    if parallel {
        use rayon::prelude::*;
        let chunks = cells.par_chunks(batch::CHUNK);
        return chunks.flat_map_iter(some).collect();
    }
    let _ = parallel;
    cells.chunks(batch::CHUNK).flat_map(some).collect()
}
