//! Patches of the boundary of the domain, and their images.
//!
//! The faces of the cells on a side are the leaves of a tree; below them patches are halved
//! when asked. A patch in one cell knows the Bézier points of its image
//! ([`positions`](super::positions)), all patches know ranges of these along fixed
//! directions, and ranges of the derivatives, grown by what rounding may have done. Where
//! numbers are not finite, ranges do not exclude anything.

use super::boxes::{Axes, Boxes, for_differences, is_contraction, left_inverse};
use super::partials::UNIT;
use super::positions::{Positions, halve};

/// Fixed directions: axes and diagonals between two of them.
const DIRECTIONS: usize = 9;

/// Patches are not cut along an axis where they are smaller than this, in cells.
const SMALLEST: f64 = 1.0 / (1 << 20) as f64;

/// Part of a side of the domain.
#[derive(Debug, Clone)]
pub(super) struct Patch<const D: usize> {
    /// Where it is, in lattice coordinates, exactly; flat along one axis.
    part: [[f64; 2]; D],
    /// The range of its image along each direction.
    pub(super) slabs: [[f64; 2]; DIRECTIONS],
    /// `hull[a][c]`: the range of component c of the derivative along axis a, unless the
    /// patch is flat there.
    hull: [[[f64; 2]; D]; D],
    /// Its Bézier points, if it lies in one cell, and by how much they may be wrong.
    pub(super) points: Option<usize>,
    error: f64,
    children: Option<[usize; 2]>,
}

impl<const D: usize> Patch<D> {
    /// The largest extent in the domain.
    pub(super) fn extent(&self) -> f64 {
        self.part.iter().fold(0.0, |m, [a, b]| m.max(b - a))
    }

    /// The largest extent of the image along an axis.
    pub(super) fn image_size(&self) -> f64 {
        self.slabs[..D].iter().fold(0.0, |m, [a, b]| m.max(b - a))
    }

    pub(super) fn touches(&self, other: &Self) -> bool {
        let mut pairs = self.part.iter().zip(&other.part);
        pairs.all(|(a, b)| a[0] <= b[1] && b[0] <= a[1])
    }

    /// The largest gap along an axis of the domain.
    pub(super) fn gap(&self, other: &Self) -> f64 {
        let pairs = self.part.iter().zip(&other.part);
        pairs.fold(0.0, |m, (a, b)| m.max(a[0] - b[1]).max(b[0] - a[1]))
    }

    pub(super) fn middle_of_image(&self) -> [f64; D] {
        std::array::from_fn(|c| 0.5 * (self.slabs[c][0] + self.slabs[c][1]))
    }

    /// Whether a point is in the range of the image along all directions, or near it.
    pub(super) fn is_near(&self, point: [f64; D], distance: f64) -> bool {
        let along = project(point);
        let mut pairs = self.slabs.iter().zip(along);
        pairs.all(|(&[low, high], x)| low - distance <= x && x <= high + distance)
    }

    /// The middle, and a place inside the domain, half the size of the patch away.
    pub(super) fn middle_and_inside(&self, cells: [usize; D]) -> [[f64; D]; 2] {
        let middle = self.part.map(|[a, b]| 0.5 * (a + b));
        let mut inside = middle;
        for a in 0..D {
            let [low, high] = self.part[a];
            let depth = 0.5 * self.extent();
            if low >= high {
                inside[a] += if low > 0.0 { -depth } else { depth };
                inside[a] = inside[a].clamp(0.0, cells[a] as f64);
            }
        }
        [middle, inside]
    }
}

/// A point along the fixed directions.
fn project<const D: usize>(p: [f64; D]) -> [f64; DIRECTIONS] {
    let (x, y) = (p[0], p[1]);
    let mut along = [0.0; DIRECTIONS];
    along[0] = x;
    along[1] = y;
    if D == 2 {
        along[2] = x + y;
        along[3] = x - y;
    } else {
        let z = p[D - 1];
        along[2] = z;
        let sums = [x + y, x - y, x + z, x - z, y + z, y - z];
        along[3..].copy_from_slice(&sums);
    }
    along
}

/// Whether two ranges have nothing in common along some direction.
pub(super) fn apart(a: &[[f64; 2]; DIRECTIONS], b: &[[f64; 2]; DIRECTIONS]) -> bool {
    let mut any = false;
    for i in 0..DIRECTIONS {
        any |= (a[i][0] > b[i][1]) | (b[i][0] > a[i][1]);
    }
    any
}

/// The patches of all sides.
pub(super) struct Faces<'a, const D: usize> {
    pub(super) positions: Positions<'a, D>,
    pub(super) patches: Vec<Patch<D>>,
    points: Vec<[f64; D]>,
    boxes: Boxes<D>,
}

impl<'a, const D: usize> Faces<'a, D> {
    pub(super) fn new(positions: Positions<'a, D>) -> Self {
        Self {
            positions,
            patches: Vec::new(),
            points: Vec::new(),
            boxes: Boxes::default(),
        }
    }

    /// Adds the tree of a side.
    pub(super) fn side(&mut self, normal: usize, upper: bool) -> usize {
        let cells = self.positions.cells;
        let low = [0; D];
        let mut high = cells;
        high[normal] = 0;
        let at = if upper { cells[normal] } else { 0 };
        self.tree(normal, at, low, high)
    }

    /// Adds the tree of cells from `low` to before `high` (which are equal along the
    /// normal) of the side at the coordinate `at`.
    fn tree(&mut self, normal: usize, at: usize, low: [usize; D], high: [usize; D]) -> usize {
        let longest = (0..D)
            .max_by_key(|&a| high[a] - low[a])
            .expect("there are axes");
        let part = std::array::from_fn(|a| {
            if a == normal {
                [at as f64; 2]
            } else {
                [low[a] as f64, high[a] as f64]
            }
        });
        if high[longest] - low[longest] == 1 {
            let points = self.points.len();
            let (cell, inside) = within_cell(&self.positions, &part);
            self.positions.bezier(cell, &inside, &mut self.points);
            let error = self.positions.error;
            return self.add_leaf(part, points, error);
        }
        let middle = low[longest] + (high[longest] - low[longest]) / 2;
        let (mut end, mut begin) = (high, low);
        end[longest] = middle;
        begin[longest] = middle;
        let children = [
            self.tree(normal, at, low, end),
            self.tree(normal, at, begin, high),
        ];
        let [a, b] = children.map(|i| &self.patches[i]);
        let union = |a: [f64; 2], b: [f64; 2]| [a[0].min(b[0]), a[1].max(b[1])];
        let patch = Patch {
            part,
            slabs: std::array::from_fn(|d| union(a.slabs[d], b.slabs[d])),
            hull: std::array::from_fn(|axis| {
                std::array::from_fn(|c| union(a.hull[axis][c], b.hull[axis][c]))
            }),
            points: None,
            error: 0.0,
            children: Some(children),
        };
        self.patches.push(patch);
        self.patches.len() - 1
    }

    /// Adds a patch in one cell whose Bézier points are at the end of the list.
    fn add_leaf(&mut self, part: [[f64; 2]; D], at: usize, error: f64) -> usize {
        let points = &self.points[at..];
        let empty = [f64::INFINITY, f64::NEG_INFINITY];
        let mut slabs = [empty; DIRECTIONS];
        for &point in points {
            for (slab, x) in slabs.iter_mut().zip(project(point)) {
                // Points are finite.
                slab[0] = if x < slab[0] { x } else { slab[0] };
                slab[1] = if x > slab[1] { x } else { slab[1] };
            }
        }
        // Sums of two components, rounded.
        let grown = 2.0 * error + 8.0 * UNIT * self.positions.largest;
        for slab in &mut slabs {
            *slab = [slab[0] - grown, slab[1] + grown];
        }
        let counts = self.positions.counts(&part);
        let mut hull = [[empty; D]; D];
        let mut stride = 1;
        for a in 0..D {
            let n = counts[a] - 1;
            if n == 0 {
                continue;
            }
            let scale = n as f64 / (part[a][1] - part[a][0]);
            for_differences(points, stride, counts[a], |from, to| {
                for c in 0..D {
                    let x = (to[c] - from[c]) * scale;
                    let range = &mut hull[a][c];
                    *range = [range[0].min(x), range[1].max(x)];
                }
            });
            let grown = scale * (2.1 * error + 8.0 * UNIT * self.positions.largest);
            for range in &mut hull[a] {
                *range = [range[0] - grown, range[1] + grown];
            }
            stride *= counts[a];
        }
        self.patches.push(Patch {
            part,
            slabs,
            hull,
            points: Some(at),
            error,
            children: None,
        });
        self.patches.len() - 1
    }

    /// Whether a patch is large enough to be cut.
    pub(super) fn can_be_cut(&self, of: usize) -> bool {
        self.patches[of].extent() >= SMALLEST
    }

    /// The halves of a patch that can be cut.
    pub(super) fn cut(&mut self, of: usize) -> [usize; 2] {
        if let Some(children) = self.patches[of].children {
            return children;
        }
        let patch = &self.patches[of];
        let at = patch
            .points
            .expect("a patch without children is in one cell");
        let part = patch.part;
        let counts = self.positions.counts(&part);
        let count: usize = counts.iter().product();
        // Along the axis on which the image is longest.
        let length = |a: usize| -> f64 {
            let h = part[a][1] - part[a][0];
            let of_range = |r: &[f64; 2]| r[0].abs().max(r[1].abs());
            if h >= SMALLEST {
                h * patch.hull[a].iter().map(of_range).fold(0.0, f64::max)
            } else {
                -1.0
            }
        };
        let axis = (0..D)
            .max_by(|&a, &b| length(a).total_cmp(&length(b)))
            .expect("there are axes");
        let error = patch.error
            + 1.01 * UNIT * counts[axis] as f64 * (self.positions.largest + patch.error);
        let mut children = [0; 2];
        let mut low = self.points[at..at + count].to_vec();
        let mut high = low.clone();
        halve(counts, axis, &mut low, &mut high);
        let middle = 0.5 * (part[axis][0] + part[axis][1]);
        for (half, points) in [low, high].into_iter().enumerate() {
            let at = self.points.len();
            self.points.extend(points);
            let mut part = part;
            part[axis][1 - half] = middle;
            children[half] = self.add_leaf(part, at, error);
        }
        self.patches[of].children = Some(children);
        children
    }

    pub(super) fn touch(&self, i: usize, j: usize) -> bool {
        self.patches[i].touches(&self.patches[j])
    }

    /// Whether the ranges of the derivatives over a patch say that the map is one-to-one
    /// there.
    pub(super) fn passes_by_hull(&self, i: usize) -> bool {
        let patch = &self.patches[i];
        let axes = Axes::of(&patch.part);
        let mut middle = [[0.0; D]; D];
        let mut radius = [[0.0; D]; D];
        for (k, &a) in axes.list().iter().enumerate() {
            for c in 0..D {
                let [low, high] = patch.hull[a][c];
                middle[k][c] = 0.5 * (low + high);
                // Rounded.
                radius[k][c] = 0.5 * (high - low) + 4.0 * UNIT * low.abs().max(high.abs());
            }
        }
        let Some(after) = left_inverse(&middle, axes.count) else {
            return false;
        };
        let mut deviation = [[0.0; D]; D];
        for r in 0..axes.count {
            for k in 0..axes.count {
                let (mut sum, mut size, mut spread) = (0.0, 0.0, 0.0);
                for c in 0..D {
                    let term = after[r][c] * middle[k][c];
                    sum += term;
                    size += term.abs();
                    spread += after[r][c].abs() * radius[k][c];
                }
                let unit = if r == k { 1.0 } else { 0.0 };
                deviation[r][k] = (sum - unit).abs() + spread + 16.0 * UNIT * (size + spread);
            }
        }
        is_contraction(&deviation, axes.count)
    }

    /// Whether the map is one-to-one on the smallest box of the domain that contains two
    /// patches.
    pub(super) fn one_to_one_around(&mut self, i: usize, j: usize) -> bool {
        let (a, b) = (&self.patches[i].part, &self.patches[j].part);
        let around =
            std::array::from_fn(|axis| [a[axis][0].min(b[axis][0]), a[axis][1].max(b[axis][1])]);
        self.boxes.is_one_to_one(&mut self.positions, &around)
    }

    /// Whether a normal of one of two patches, or the line between their middles, is a
    /// direction along which their Bézier points are apart. Not for patches of many cells.
    pub(super) fn apart_by_points(&self, i: usize, j: usize) -> bool {
        let (a, b) = (&self.patches[i], &self.patches[j]);
        let (Some(at_a), Some(at_b)) = (a.points, b.points) else {
            return false;
        };
        let len = |patch: &Patch<D>| self.positions.counts(&patch.part).iter().product::<usize>();
        let (of_a, of_b) = (
            &self.points[at_a..at_a + len(a)],
            &self.points[at_b..at_b + len(b)],
        );
        let (from, to) = (a.middle_of_image(), b.middle_of_image());
        let between = std::array::from_fn(|c| to[c] - from[c]);
        let margin =
            a.error + b.error + 2.0 * UNIT * (D + 1) as f64 * (self.positions.largest + 1.0);
        [between, normal(a), normal(b)].iter().any(|direction| {
            let size: f64 = direction.iter().map(|x| x.abs()).sum();
            let [low_a, high_a] = range_along(of_a, direction);
            let [low_b, high_b] = range_along(of_b, direction);
            let margin = 1.01 * size * margin;
            // Of a very short direction, products may underflow.
            size > 1e-200 && (low_a - high_b > margin || low_b - high_a > margin)
        })
    }
}

/// A normal of a patch, approximately.
fn normal<const D: usize>(patch: &Patch<D>) -> [f64; D] {
    let axes = Axes::of(&patch.part);
    let middle = |k: usize| -> [f64; D] {
        let hull = &patch.hull[axes.list()[k]];
        std::array::from_fn(|c| 0.5 * (hull[c][0] + hull[c][1]))
    };
    let v = middle(0);
    if D == 2 {
        return std::array::from_fn(|c| if c == 0 { -v[1] } else { v[0] });
    }
    let w = middle(axes.count - 1);
    std::array::from_fn(|c| {
        let (p, q) = ((c + 1) % D, (c + 2) % D);
        v[p] * w[q] - v[q] * w[p]
    })
}

fn range_along<const D: usize>(points: &[[f64; D]], direction: &[f64; D]) -> [f64; 2] {
    let mut range = [f64::INFINITY, f64::NEG_INFINITY];
    for point in points {
        let mut x = point[0] * direction[0];
        for c in 1..D {
            x += point[c] * direction[c];
        }
        range[0] = if x < range[0] { x } else { range[0] };
        range[1] = if x > range[1] { x } else { range[1] };
    }
    range
}

/// The cell that a box lies in, and where in that cell.
fn within_cell<const D: usize>(
    positions: &Positions<'_, D>,
    part: &[[f64; 2]; D],
) -> ([usize; D], [[f64; 2]; D]) {
    let (cell, _) = positions.locate(part.map(|[low, _]| low));
    let inside = std::array::from_fn(|a| part[a].map(|u| u - cell[a] as f64));
    (cell, inside)
}
