//! Pairs of boxes that meet, by a tree over them.

/// Boxes in a leaf.
const LEAF: usize = 4;

/// An axis-aligned box: its lowest and highest coordinates.
#[derive(Debug, Clone, Copy)]
pub(super) struct Box3 {
    low: [f64; 3],
    high: [f64; 3],
}

impl Box3 {
    pub(super) fn around(points: &[[f64; 3]]) -> Self {
        let nothing = Self {
            low: [f64::INFINITY; 3],
            high: [f64::NEG_INFINITY; 3],
        };
        points
            .iter()
            .map(|&p| Self { low: p, high: p })
            .fold(nothing, |around, point| around.join(&point))
    }

    fn join(&self, other: &Self) -> Self {
        Self {
            low: [0, 1, 2].map(|c| self.low[c].min(other.low[c])),
            high: [0, 1, 2].map(|c| self.high[c].max(other.high[c])),
        }
    }

    fn meets(&self, other: &Self) -> bool {
        (0..3).all(|c| self.low[c] <= other.high[c] && other.low[c] <= self.high[c])
    }

    fn middle(&self, axis: usize) -> f64 {
        f64::midpoint(self.low[axis], self.high[axis])
    }
}

/// A binary tree over boxes; children of a node follow it, the second at `second`.
#[derive(Debug)]
pub(super) struct Tree<'a> {
    boxes: &'a [Box3],
    order: Vec<usize>,
    nodes: Vec<Node>,
}

#[derive(Debug, Clone, Copy)]
struct Node {
    around: Box3,
    /// Members, as entries of `order`.
    first: usize,
    end: usize,
    /// The second child; a leaf has none.
    second: Option<usize>,
}

impl<'a> Tree<'a> {
    pub(super) fn new(boxes: &'a [Box3]) -> Self {
        let mut tree = Self {
            boxes,
            order: (0..boxes.len()).collect(),
            nodes: Vec::new(),
        };
        if !boxes.is_empty() {
            tree.add(0, boxes.len());
        }
        tree
    }

    fn add(&mut self, first: usize, end: usize) {
        let members = &mut self.order[first..end];
        let around = members
            .iter()
            .map(|&i| self.boxes[i])
            .reduce(|a, b| a.join(&b))
            .unwrap_or_else(|| Box3::around(&[]));
        let index = self.nodes.len();
        self.nodes.push(Node {
            around,
            first,
            end,
            second: None,
        });
        if end - first <= LEAF {
            return;
        }
        let size = |axis: usize| around.high[axis] - around.low[axis];
        let widest = (1..3).fold(
            0,
            |best, axis| if size(axis) > size(best) { axis } else { best },
        );
        let half = members.len() / 2;
        members.select_nth_unstable_by(half, |&i, &j| {
            let middle = |i: usize| self.boxes[i].middle(widest);
            middle(i).total_cmp(&middle(j)).then(i.cmp(&j))
        });
        self.add(first, first + half);
        self.nodes[index].second = Some(self.nodes.len());
        self.add(first + half, end);
    }

    /// Calls `visit` once for each pair of boxes that have a point in common.
    pub(super) fn pairs(&self, visit: &mut impl FnMut(usize, usize)) {
        if !self.nodes.is_empty() {
            self.within(0, visit);
        }
    }

    fn within(&self, node: usize, visit: &mut impl FnMut(usize, usize)) {
        let Node {
            first, end, second, ..
        } = self.nodes[node];
        if let Some(second) = second {
            self.within(node + 1, visit);
            self.within(second, visit);
            self.between(node + 1, second, visit);
        } else {
            for i in first..end {
                for j in i + 1..end {
                    self.leaf(i, j, visit);
                }
            }
        }
    }

    fn between(&self, a: usize, b: usize, visit: &mut impl FnMut(usize, usize)) {
        let (x, y) = (&self.nodes[a], &self.nodes[b]);
        if !x.around.meets(&y.around) {
            return;
        }
        // The larger one is cut.
        match (x.second, y.second) {
            (Some(second), _) if y.second.is_none() || x.end - x.first >= y.end - y.first => {
                self.between(a + 1, b, visit);
                self.between(second, b, visit);
            }
            (_, Some(second)) => {
                self.between(a, b + 1, visit);
                self.between(a, second, visit);
            }
            _ => {
                for i in x.first..x.end {
                    for j in y.first..y.end {
                        self.leaf(i, j, visit);
                    }
                }
            }
        }
    }

    fn leaf(&self, i: usize, j: usize, visit: &mut impl FnMut(usize, usize)) {
        let (i, j) = (self.order[i], self.order[j]);
        if self.boxes[i].meets(&self.boxes[j]) {
            visit(i.min(j), i.max(j));
        }
    }
}
