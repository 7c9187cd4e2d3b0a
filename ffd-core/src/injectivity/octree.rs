//! Boxes cut into halves along all axes, again and again: \[GD01\]'s octree, and in the
//! plane a quadtree.
//!
//! When a box is cut, all boxes of half the size in it are looked at before any of them is
//! cut: what settles the whole matter may be in any of them. Otherwise the order is depth
//! first, so that few are kept.

/// What to do with a box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Step {
    /// It is settled.
    Leaf,
    /// Look at the boxes of half the size in it; of several boxes cut from the same one, at
    /// those in the one with the least number first.
    Cut(f64),
    /// End the visit.
    Stop,
}

/// A box.
#[derive(Debug, Clone)]
struct Node<B, const D: usize> {
    content: B,
    low: [f64; D],
    depth: u32,
    /// See [`Step::Cut`].
    key: f64,
}

/// The boxes of a visit. Their memory is kept for later visits.
#[derive(Debug, Clone)]
pub(super) struct Octree<B, const D: usize> {
    open: Vec<Node<B, D>>,
    free: Vec<B>,
}

impl<B: Clone, const D: usize> Octree<B, D> {
    pub(super) fn new() -> Self {
        Self {
            open: Vec::new(),
            free: Vec::new(),
        }
    }

    /// A box that is no longer used, with any content.
    pub(super) fn free(&mut self) -> Option<B> {
        self.free.pop()
    }

    /// Visits a box, and the boxes in it as far as `judge` wants them cut: it is called with
    /// the content of a box, its part of the whole (from and to along each axis) and its
    /// depth. Returns whether the visit was not stopped.
    ///
    /// `halve` cuts a box along an axis: its first box becomes the upper half, and its second,
    /// of any content, the lower half.
    pub(super) fn visit(
        &mut self,
        whole: B,
        halve: impl Fn(usize, &mut B, &mut B),
        mut judge: impl FnMut(&B, [[f64; 2]; D], u32) -> Step,
    ) -> bool {
        let whole = Node {
            content: whole,
            low: [0.0; D],
            depth: 0,
            key: 0.0,
        };
        let mut ended = self.look(whole, &mut judge);
        let mut parts: Vec<Node<B, D>> = Vec::with_capacity(1 << D);
        while ended && let Some(node) = self.open.pop() {
            let half = 0.5_f64.powi(node.depth.cast_signed() + 1);
            parts.push(node);
            for axis in 0..D {
                for i in 0..parts.len() {
                    let high = &mut parts[i];
                    let mut low = Node {
                        content: self.free().unwrap_or_else(|| high.content.clone()),
                        ..*high
                    };
                    halve(axis, &mut high.content, &mut low.content);
                    high.low[axis] += half;
                    parts.push(low);
                }
            }
            let first = self.open.len();
            for mut part in parts.drain(..) {
                part.depth += 1;
                if ended {
                    ended = self.look(part, &mut judge);
                } else {
                    self.free.push(part.content);
                }
            }
            // The last is the first to be cut.
            self.open[first..].sort_by(|a, b| b.key.total_cmp(&a.key));
        }
        let open = self.open.drain(..).map(|node| node.content);
        self.free.extend(open);
        ended
    }

    /// Looks at a box; returns whether the visit goes on.
    fn look(
        &mut self,
        mut node: Node<B, D>,
        judge: &mut impl FnMut(&B, [[f64; 2]; D], u32) -> Step,
    ) -> bool {
        let size = 0.5_f64.powi(node.depth.cast_signed());
        let part = node.low.map(|low| [low, low + size]);
        let step = judge(&node.content, part, node.depth);
        if let Step::Cut(key) = step {
            node.key = key;
            self.open.push(node);
        } else {
            self.free.push(node.content);
        }
        step != Step::Stop
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The parts are those of the boxes, and together they are the whole.
    #[test]
    fn leaves_cover_the_whole_once() {
        let halve = |axis: usize, high: &mut [[f64; 2]; 3], low: &mut [[f64; 2]; 3]| {
            *low = *high;
            let middle = 0.5 * (high[axis][0] + high[axis][1]);
            low[axis][1] = middle;
            high[axis][0] = middle;
        };
        let (mut volume, mut count) = (0.0, 0);
        let mut tree = Octree::new();
        let ended = tree.visit([[0.0, 1.0]; 3], halve, |content, part, depth| {
            assert!(*content == part);
            if depth < 2 && part[0][0] < 0.5 {
                return Step::Cut(0.0);
            }
            volume += part.iter().map(|[from, to]| to - from).product::<f64>();
            count += 1;
            Step::Leaf
        });
        assert!(ended);
        assert_eq!(count, 8 * 4 + 4);
        assert!((volume - 1.0).abs() < 1e-15);
    }

    /// Of several parts, the one with the least number is cut first.
    #[test]
    fn parts_are_cut_in_order() {
        let mut tree = Octree::<_, 2>::new();
        let mut parts = Vec::new();
        let goal = [0.7, 0.3];
        tree.visit(
            (),
            |_, (), ()| (),
            |(), part, depth| {
                parts.push(part);
                let distance: f64 = (0..2)
                    .map(|a| (0.5 * (part[a][0] + part[a][1]) - goal[a]).abs())
                    .sum();
                if depth == 3 {
                    Step::Stop
                } else {
                    Step::Cut(distance)
                }
            },
        );
        // One box, and four in each of three.
        assert_eq!(parts.len(), 1 + 4 + 4 + 1);
        let last = parts[9];
        assert!((0..2).all(|a| last[a][0] >= goal[a] - 0.25 && last[a][1] <= goal[a] + 0.25));
    }

    /// All parts of a box are looked at before one of them is cut, and memory is kept.
    #[test]
    fn parts_come_before_parts_of_parts() {
        let mut tree = Octree::<_, 2>::new();
        for _ in 0..2 {
            let mut depths = Vec::new();
            let ended = tree.visit(
                (),
                |_, (), ()| (),
                |(), _, depth| {
                    depths.push(depth);
                    if depth == 2 {
                        Step::Stop
                    } else {
                        Step::Cut(0.0)
                    }
                },
            );
            assert!(!ended);
            assert_eq!(depths, [0, 1, 1, 1, 1, 2]);
            assert!(tree.open.is_empty());
        }
        assert!(tree.free().is_some());
    }
}
