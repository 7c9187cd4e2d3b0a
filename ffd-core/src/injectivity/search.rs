//! The exact test: is `det J` positive everywhere?
//!
//! Each cell is decided by the first of these that can:
//!
//! 1. the conic-hull test ([`cones`](super::cones)), a few nanoseconds a cell;
//! 2. the signs of the Bernstein coefficients ([`product`](super::product));
//! 3. subdivision, the worst box of all cells first ([`piece`](super::piece));
//! 4. exact arithmetic for boxes where values are as small as rounding errors
//!    ([`exact`](super::exact)).
//!
//! A box is positive if all coefficients, or what is left of them after subtracting
//! squares, are above a bound of the rounding error; it is folded if a corner is below
//! minus that bound. Nothing else decides.

use std::collections::BTreeMap;

use super::batch;
use super::cones::Cones;
use super::exact::ExactPiece;
use super::partials::Partials;
use super::piece::Shape;
use super::product::Products;
use super::queue::{Node, Queue};
use super::{Budget, Effort, Place, Undecided};
use crate::Lattice;

/// Fewer cells than that are bounded one at a time.
const FEWEST_IN_A_BATCH: usize = 5;

/// Halvings of a cell along an axis, at most: positions stay exact numbers.
const DEEPEST: i32 = 50;

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
    /// `det J` is zero at a place, and nowhere negative (or nowhere positive).
    Zero(Box<Place<D>>),
    /// The budget was not enough.
    Doubtful(Box<Undecided<D>>),
}

/// The cells of a lattice and what is known of them.
#[derive(Debug, Clone)]
pub(super) struct Search<const D: usize> {
    pub(super) partials: Partials<D>,
    pub(super) products: Products<D>,
    pub(super) cones: Cones<D>,
    shape: Shape,
    pub(super) states: Vec<State<D>>,
    /// A place where `det J` is positive, if one is known, and one where it is negative.
    positive: Option<Place<D>>,
    negative: Option<Place<D>>,
    /// The least upper bound of the determinant at any place looked at.
    pub(super) least_seen: f64,
    pub(super) effort: Effort,
    scratch: Vec<f64>,
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
        for place in places {
            cones.test_around(partials, place, |cell, passes| {
                states[cell] = if passes { State::Cones } else { State::Unknown };
            });
        }
        // A positive value that belongs to no state may have been in a touched cell. Where
        // no other is known, cells with a fold are looked at again for one.
        self.positive = None;
        let known = |s: &State<D>| matches!(s, State::Cones | State::Positive(_));
        if !self.states.iter().any(known) {
            self.states.fill(State::Unknown);
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

    /// Records that a box could not be decided; of several in a cell, the one with the
    /// lowest bound.
    fn record_doubt(&mut self, node: &Node<D>) {
        let undecided = self.undecided(node);
        let state = &mut self.states[node.cell];
        if !matches!(state, State::Doubtful(old) if old.det[0] <= undecided.det[0]) {
            *state = State::Doubtful(Box::new(undecided));
        }
    }

    /// Decides the sign of the determinant in all cells that are not decided yet. With
    /// `all` unset, the search may end as soon as both signs are found.
    pub(super) fn decide(&mut self, lattice: &Lattice<D>, budget: &Budget, all: bool) -> Sign<D> {
        self.partials.prepare();
        self.take_places_from_states(lattice);
        let open = |s: &State<D>| matches!(s, State::Unknown | State::Doubtful(_));
        let all_cells = 0..self.states.len();
        let mut cells: Vec<usize> = all_cells.filter(|&c| open(&self.states[c])).collect();
        if cells.len() >= FEWEST_IN_A_BATCH {
            self.bound_in_batches(lattice, &mut cells);
        }
        let mut queue = Queue::default();
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
            for cell in 0..self.states.len() {
                if !matches!(self.states[cell], State::Negative) {
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

    /// Decides the cells that single precision can decide, and leaves the others in the list.
    fn bound_in_batches(&mut self, lattice: &Lattice<D>, cells: &mut Vec<usize>) {
        if !self.partials.is_sound() {
            return;
        }
        self.effort.boxes += cells.len();
        let Self {
            partials, states, ..
        } = self;
        // Lists of cells of the same kind; in a uniform grid there is one.
        let mut kinds: BTreeMap<[usize; D], Vec<usize>> = BTreeMap::new();
        for &cell in &*cells {
            let kind = partials.kind(partials.cell(cell));
            kinds.entry(kind).or_default().push(cell);
        }
        cells.clear();
        let (mut worst, mut least) = (None, f64::INFINITY);
        let mut least_seen = self.least_seen;
        for list in kinds.values() {
            let kind = batch::Kind::new(self.products.level, partials, list[0]);
            let bounds = bounds_of_all(&kind, list, self.parallel);
            for (&cell, bounds) in list.iter().zip(bounds) {
                let low = bounds.min - bounds.error;
                least_seen = least_seen.min(bounds.max + bounds.error);
                states[cell] = if low > 0.0 {
                    State::Positive(low)
                } else if bounds.max < -bounds.error {
                    State::Negative
                } else {
                    cells.push(cell);
                    State::Unknown
                };
                if low > 0.0 && low < least {
                    (worst, least) = (Some(cell), low);
                }
            }
        }
        cells.sort_unstable();
        self.take_places_from_states(lattice);
        // The least value is below the largest coefficients of all cells; and close to one
        // that was seen in the worst cell.
        self.least_seen = least_seen;
        if let Some(cell) = worst {
            let node = self.whole_cell(cell);
            self.least_seen = self.least_seen.min(node.bounds.low_corner.0 + node.error);
        }
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

    fn both_signs(&self) -> Option<Sign<D>> {
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
    fn whole_cell(&mut self, cell: usize) -> Node<D> {
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
        queue.push(node);
    }

    fn corner(&self, lattice: &Lattice<D>, node: &Node<D>, corner: usize) -> Place<D> {
        let part = node.part();
        let t = std::array::from_fn(|a| part[a][corner >> a & 1]);
        self.place(lattice, node.cell, t)
    }

    /// Cuts boxes until they are decided; returns those that floating point cannot decide,
    /// and those that are left when the budget is spent.
    fn subdivide(
        &mut self,
        lattice: &Lattice<D>,
        mut queue: Queue<D>,
        budget: &Budget,
        all: bool,
        reversed: bool,
    ) -> Vec<Node<D>> {
        let mut doubtful = Vec::new();
        let allowed = self.effort.boxes.saturating_add(budget.boxes);
        while let Some(node) = self.take(&mut queue) {
            if !reversed && matches!(self.states[node.cell], State::Folded(_)) {
                continue;
            }
            if self.effort.boxes + 2 > allowed || is_for_exact_arithmetic(&node) {
                doubtful.push(node);
                continue;
            }
            for child in self.cut(node) {
                self.examine(lattice, child, reversed, &mut queue);
            }
            if (reversed || !all) && self.both_signs().is_some() {
                break;
            }
        }
        doubtful
    }

    /// The next box, with its coefficients.
    fn take(&mut self, queue: &mut Queue<D>) -> Option<Node<D>> {
        let mut node = queue.pop()?;
        if node.coefficients.is_empty() {
            let cell = self.partials.cell(node.cell);
            self.products
                .determinant(&self.partials, cell, &mut node.coefficients);
        }
        Some(node)
    }

    fn cut(&mut self, node: Node<D>) -> [Node<D>; 2] {
        let axis = self.shape.most_curved_axis(&node.coefficients);
        let largest = node.bounds.max.abs().max(node.bounds.min.abs());
        let mut high = node;
        let mut low = Node {
            coefficients: vec![0.0; high.coefficients.len()],
            ..high
        };
        self.shape
            .split(axis, &mut low.coefficients, &mut high.coefficients);
        high.low[axis] += 0.5_f64.powi(high.level[axis] + 1);
        for half in [&mut low, &mut high] {
            half.level[axis] += 1;
            half.bounds = self.shape.bounds(&half.coefficients);
            half.error = self.shape.error_after_split(axis, half.error, largest);
        }
        self.effort.boxes += 2;
        [low, high]
    }

    /// Decides a box, or puts it into the queue.
    fn examine(
        &mut self,
        lattice: &Lattice<D>,
        mut node: Node<D>,
        reversed: bool,
        queue: &mut Queue<D>,
    ) {
        let (bounds, error) = (node.bounds, node.error);
        self.least_seen = self.least_seen.min(bounds.low_corner.0 + error);
        if reversed {
            if bounds.high_corner.0 > error {
                self.positive = Some(self.corner(lattice, &node, bounds.high_corner.1));
                return;
            }
        } else if bounds.low_corner.0 < -error {
            let place = self.corner(lattice, &node, bounds.low_corner.1);
            self.negative = self.negative.or(Some(place));
            self.states[node.cell] = State::Folded(Box::new(place));
            return;
        } else if self.positive.is_none() && bounds.high_corner.0 > error {
            self.positive = Some(self.corner(lattice, &node, bounds.high_corner.1));
        }
        let (min, corner) = if reversed {
            (-bounds.max, -bounds.high_corner.0)
        } else {
            (bounds.min, bounds.low_corner.0)
        };
        node.key = min - error;
        if node.key <= 0.0 && corner > error {
            let (shape, scratch) = (&self.shape, &mut self.scratch);
            let bound = shape.lower_bound(&node.coefficients, reversed, scratch);
            node.key = node.key.max(bound - error);
        }
        if node.key > 0.0 {
            self.record_right(node.cell, node.key, reversed);
        } else {
            queue.push(node);
        }
    }

    /// Part of a cell has the right sign; other parts may still change its state.
    fn record_right(&mut self, cell: usize, bound: f64, reversed: bool) {
        let state = &mut self.states[cell];
        match state {
            State::Unknown if reversed => *state = State::Negative,
            State::Folded(_) if reversed => *state = State::Negative,
            State::Unknown => *state = State::Positive(bound),
            State::Positive(least) => *least = least.min(bound),
            _ => {}
        }
    }

    /// Boxes that floating point left in doubt, depth first.
    fn decide_exactly(
        &mut self,
        lattice: &Lattice<D>,
        nodes: Vec<Node<D>>,
        budget: &Budget,
        all: bool,
        reversed: bool,
    ) {
        let mut cached: Option<(usize, ExactPiece)> = None;
        let allowed = self.effort.exact_boxes.saturating_add(budget.exact_boxes);
        for node in nodes {
            if (reversed || !all) && self.both_signs().is_some() {
                return;
            }
            if !reversed && matches!(self.states[node.cell], State::Folded(_)) {
                continue;
            }
            if self.effort.exact_boxes >= allowed {
                self.record_doubt(&node);
                continue;
            }
            let whole = match cached.take() {
                Some((cell, piece)) if cell == node.cell => piece,
                _ => ExactPiece::of_cell(lattice, self.partials.cell(node.cell)),
            };
            let found = self.search_exactly(lattice, &whole, &node, allowed, reversed);
            cached = Some((node.cell, whole));
            match found {
                Exactly::Right => self.record_right(node.cell, 0.0, reversed),
                Exactly::Zero(place) => {
                    self.least_seen = self.least_seen.min(0.0);
                    if !matches!(self.states[node.cell], State::Doubtful(_)) {
                        self.states[node.cell] = State::Zero(Box::new(place));
                    }
                }
                Exactly::Wrong(place) if reversed => self.positive = Some(place),
                Exactly::Wrong(place) => {
                    self.least_seen = self.least_seen.min(0.0);
                    self.negative = self.negative.or(Some(place));
                    self.states[node.cell] = State::Folded(Box::new(place));
                }
                Exactly::Spent => self.record_doubt(&node),
            }
        }
    }

    /// Encloses the minimum of the determinant over all cells, in lattice coordinates, in an
    /// interval of the given width; wider if the budget is spent before, or where rounding
    /// errors are as large as that.
    pub(super) fn enclose(&mut self, width: f64, budget: &Budget) -> [f64; 2] {
        self.partials.prepare();
        let mut queue = Queue::default();
        let mut high = f64::INFINITY;
        for cell in 0..self.states.len() {
            let mut node = self.whole_cell(cell);
            self.bound(&mut node, &mut high);
            queue.push(node);
        }
        let allowed = self.effort.boxes.saturating_add(budget.boxes);
        let mut low = f64::INFINITY;
        while let Some(node) = self.take(&mut queue) {
            let narrow = high - node.key <= width;
            let sorted = queue.is_sorted();
            if narrow || self.effort.boxes + 2 > allowed || is_exhausted(&node) {
                low = low.min(node.key);
                // What comes after the worst is not worse.
                if sorted {
                    break;
                }
                continue;
            }
            for mut half in self.cut(node) {
                self.bound(&mut half, &mut high);
                if half.key < high {
                    queue.push(half);
                }
            }
        }
        self.least_seen = self.least_seen.min(high);
        self.partials.divide_by_frame([low.min(high), high])
    }

    /// Sets the lower bound of a box, and lowers the upper bound of the minimum.
    fn bound(&mut self, node: &mut Node<D>, high: &mut f64) {
        if node.error == f64::INFINITY {
            return;
        }
        *high = high.min(node.bounds.low_corner.0 + node.error);
        let mut least = node.bounds.min;
        if least < node.bounds.low_corner.0 {
            let (shape, scratch) = (&self.shape, &mut self.scratch);
            least = least.max(shape.lower_bound(&node.coefficients, false, scratch));
        }
        node.key = least - node.error;
    }

    fn undecided(&self, node: &Node<D>) -> Undecided<D> {
        let bounds = node.bounds;
        let det = if node.error.is_finite() {
            [bounds.min - node.error, bounds.max + node.error]
        } else {
            [f64::NEG_INFINITY, f64::INFINITY]
        };
        Undecided {
            cell: self.partials.cell(node.cell),
            part: node.part(),
            det: self.partials.divide_by_frame(det),
        }
    }

    fn search_exactly(
        &mut self,
        lattice: &Lattice<D>,
        whole: &ExactPiece,
        node: &Node<D>,
        allowed: usize,
        reversed: bool,
    ) -> Exactly<D> {
        let mut stack = vec![(whole.part(node.low, node.level), node.low, node.level)];
        let mut zero = None;
        while let Some((piece, low, level)) = stack.pop() {
            if self.effort.exact_boxes >= allowed {
                return Exactly::Spent;
            }
            self.effort.exact_boxes += 1;
            let signs = piece.signs(&self.shape);
            let size = level.map(|l| 0.5_f64.powi(l));
            let place = |corner: usize| {
                let end = |a: usize| f64::from(u8::from(corner >> a & 1 == 1));
                let t = std::array::from_fn(|a| low[a] + size[a] * end(a));
                self.place(lattice, node.cell, t)
            };
            let (wrong, any_wrong, right) = if reversed {
                (signs.positive_corner, signs.any_positive, None)
            } else {
                (
                    signs.negative_corner,
                    signs.any_negative,
                    signs.positive_corner,
                )
            };
            if let Some(corner) = wrong {
                return Exactly::Wrong(place(corner));
            }
            // All coefficients zero or right: a zero of the polynomial is one of a corner.
            if !any_wrong && zero.is_none() {
                zero = signs.zero_corner.map(place);
            }
            if self.positive.is_none() {
                self.positive = right.map(place);
            }
            if !any_wrong {
                continue;
            }
            let axis = (0..D).min_by_key(|&a| level[a]).expect("two or three axes");
            if level[axis] >= DEEPEST {
                return Exactly::Spent;
            }
            let mut finer = level;
            finer[axis] += 1;
            let mut upper = low;
            upper[axis] += 0.5 * size[axis];
            let [low_piece, high_piece] = piece.split(axis);
            stack.push((high_piece, upper, finer));
            stack.push((low_piece, low, finer));
        }
        zero.map_or(Exactly::Right, Exactly::Zero)
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

/// Whether cutting a box cannot improve its bounds much.
fn is_exhausted<const D: usize>(node: &Node<D>) -> bool {
    node.error == f64::INFINITY
        || node.level.iter().any(|&level| level >= DEEPEST)
        || node.bounds.max - node.bounds.min <= 4.0 * node.error
}

/// Whether rounding errors are as large as the values in a box; or a corner may be zero and
/// all else positive, which is what a box looks like when the determinant touches zero at
/// its border.
fn is_for_exact_arithmetic<const D: usize>(node: &Node<D>) -> bool {
    let Node { bounds, error, .. } = node;
    let touches = |least: f64, corner: f64| least >= -error && corner.abs() <= *error;
    let largest = bounds.max.abs().max(bounds.min.abs());
    *error == f64::INFINITY
        || node.level.iter().any(|&level| level >= DEEPEST)
        || largest <= 4.0 * error
        || touches(bounds.min, bounds.low_corner.0)
        || touches(-bounds.max, bounds.high_corner.0)
}

/// What exact arithmetic says about a box.
enum Exactly<const D: usize> {
    /// The sign is the one to be proven.
    Right,
    /// There is a zero, and no value of the other sign.
    Zero(Place<D>),
    /// The sign is the other one at a place.
    Wrong(Place<D>),
    /// The budget is spent.
    Spent,
}
