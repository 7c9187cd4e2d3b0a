//! The objects that are deformed: a squashed hemisphere and a chain.

use std::{collections::HashMap, f64::consts::TAU};

/// A triangle mesh, counter-clockwise as seen from outside, y up.
#[derive(Debug, Clone, Default)]
pub(crate) struct Shape {
    pub(crate) positions: Vec<[f64; 3]>,
    pub(crate) triangles: Vec<[u32; 3]>,
}

impl Shape {
    /// Each triangle cut into four at the middles of its edges: the same surface.
    pub(crate) fn refined(&self) -> Self {
        let mut fine = Self {
            positions: self.positions.clone(),
            triangles: Vec::with_capacity(4 * self.triangles.len()),
        };
        let mut middles = HashMap::new();
        for &[a, b, c] in &self.triangles {
            let [ab, bc, ca] = [[a, b], [b, c], [c, a]].map(|[from, to]| {
                *middles
                    .entry((from.min(to), from.max(to)))
                    .or_insert_with(|| {
                        let [p, q] = [from, to].map(|v| self.positions[v as usize]);
                        fine.add([0, 1, 2].map(|k| f64::midpoint(p[k], q[k])))
                    })
            });
            let parts = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]];
            fine.triangles.extend(parts);
        }
        fine
    }

    fn add(&mut self, position: [f64; 3]) -> u32 {
        let index = u32::try_from(self.positions.len()).expect("far fewer vertices");
        self.positions.push(position);
        index
    }
}

/// Half a sphere of radius 1 squashed to a height, open below: half of an octahedron, with
/// edges cut into `rings` parts and blown up. It has `2 r² + 2 r + 1` vertices: 145, 545 and
/// 2113 for 8, 16 and 32 rings.
pub(crate) fn squashed_hemisphere(rings: u32, height: f64) -> Shape {
    const CORNERS: [[f64; 2]; 4] = [[1.0, 0.0], [0.0, -1.0], [-1.0, 0.0], [0.0, 1.0]];
    let mut shape = Shape::default();
    shape.add([0.0, height, 0.0]);
    for ring in 1..=rings {
        for k in 0..4 * ring {
            let corner = (k / ring) as usize;
            let part = f64::from(k % ring) / f64::from(ring);
            let [from, to] = [CORNERS[corner], CORNERS[(corner + 1) % 4]];
            let out = f64::from(ring) / f64::from(rings);
            let [x, z] = [0, 1].map(|c| out * ((1.0 - part) * from[c] + part * to[c]));
            let y = 1.0 - out;
            let length = (x * x + y * y + z * z).sqrt();
            shape.add([x / length, height * y / length, z / length]);
        }
    }
    // The vertex of a ring after `k` steps round the axis.
    let vertex = |ring: u32, k: u32| match ring {
        0 => 0,
        _ => 1 + 2 * ring * (ring - 1) + k % (4 * ring),
    };
    for ring in 1..=rings {
        for side in 0..4 {
            for k in 0..ring {
                let (outer, inner) = (side * ring + k, side * (ring - 1) + k);
                let tip = vertex(ring - 1, inner);
                shape
                    .triangles
                    .push([vertex(ring, outer), vertex(ring, outer + 1), tip]);
                if k + 1 < ring {
                    let next = vertex(ring - 1, inner + 1);
                    shape.triangles.push([tip, vertex(ring, outer + 1), next]);
                }
            }
        }
    }
    shape
}

/// Sizes of a link: an endless round rod, bent to two half circles and two straight pieces.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Link {
    /// Half the length of the straight pieces.
    pub(crate) straight: f64,
    /// Radius of the bends, to the middle of the rod.
    pub(crate) bend: f64,
    /// Radius of the rod.
    pub(crate) rod: f64,
}

impl Link {
    /// The distance between the middles of two links with that much room between the rods.
    pub(crate) fn pitch(&self, gap: f64) -> f64 {
        2.0 * (self.straight + self.bend - self.rod) - gap
    }
}

/// Links along x with their middle at 0, by turns upright and lying, each through the next
/// without touching it.
pub(crate) fn chain(count: u32, link: Link, gap: f64, around: [u32; 2]) -> Shape {
    let mut shape = Shape::default();
    for number in 0..count {
        let middle = link.pitch(gap) * (f64::from(number) - 0.5 * f64::from(count - 1));
        add_link(&mut shape, middle, number % 2 == 0, link, around);
    }
    shape
}

/// `around`: vertices along the link and around the rod.
fn add_link(shape: &mut Shape, middle: f64, lying: bool, link: Link, around: [u32; 2]) {
    let Link {
        straight,
        bend,
        rod,
    } = link;
    let [steps, sides] = around;
    let bend_length = 0.5 * TAU * bend;
    let half = 2.0 * straight + bend_length;
    let first = u32::try_from(shape.positions.len()).expect("far fewer vertices");
    for step in 0..steps {
        // A point of the middle line and the direction away from the link's axis, in the
        // link's plane. The second half is the first turned by half a turn.
        let way = 2.0 * half * f64::from(step) / f64::from(steps);
        let (turn, way) = if way < half {
            (1.0, way)
        } else {
            (-1.0, way - half)
        };
        let (point, out) = if way < bend_length {
            let (sin, cos) = (way / bend - 0.25 * TAU).sin_cos();
            ([straight + bend * cos, bend * sin], [cos, sin])
        } else {
            ([straight - (way - bend_length), bend], [0.0, 1.0])
        };
        for side in 0..sides {
            let (sin, cos) = (TAU * f64::from(side) / f64::from(sides)).sin_cos();
            let along = middle + turn * (point[0] + rod * cos * out[0]);
            let across = turn * (point[1] + rod * cos * out[1]);
            let off = rod * sin;
            shape.add(if lying {
                [along, off, -across]
            } else {
                [along, across, off]
            });
        }
    }
    let vertex = |step: u32, side: u32| first + step % steps * sides + side % sides;
    for step in 0..steps {
        for side in 0..sides {
            let [a, b, c, d] =
                [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[i, j]| vertex(step + i, side + j));
            shape.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use examples::mesh_crossings::Crossings;

    /// Edges and how often each is used, in each direction.
    fn edges(shape: &Shape) -> HashMap<(u32, u32), [u32; 2]> {
        let mut edges = HashMap::new();
        for t in &shape.triangles {
            for i in 0..3 {
                let (from, to) = (t[i], t[(i + 1) % 3]);
                let uses = edges.entry((from.min(to), from.max(to))).or_insert([0, 0]);
                uses[usize::from(from > to)] += 1;
            }
        }
        edges
    }

    fn volume(shape: &Shape) -> f64 {
        let corners = |t: &[u32; 3]| t.map(|v| glam::DVec3::from(shape.positions[v as usize]));
        let volumes = shape.triangles.iter().map(|t| {
            let [a, b, c] = corners(t);
            a.dot(b.cross(c)) / 6.0
        });
        volumes.sum()
    }

    #[test]
    fn hemispheres_have_the_numbers_of_vertices_of_the_paper() {
        let mut shape = squashed_hemisphere(8, 0.6);
        for (rings, count) in [(8_u32, 145), (16, 545), (32, 2113)] {
            let round = squashed_hemisphere(rings, 0.6);
            assert_eq!(round.positions.len(), count);
            assert_eq!(round.triangles.len(), 4 * (rings * rings) as usize);
            assert_eq!(shape.positions.len(), count);
            assert_eq!(shape.triangles.len(), round.triangles.len());
            let border = edges(&round)
                .values()
                .filter(|&&uses| uses != [1, 1])
                .count();
            assert_eq!(border, 4 * rings as usize);
            assert!(Crossings::of(&round.positions, &round.triangles).is_embedded());
            shape = shape.refined();
        }
        let half = volume(&squashed_hemisphere(64, 0.5));
        assert!((half / (TAU / 6.0) - 1.0).abs() < 1e-3, "{half}");
    }

    #[test]
    fn links_are_closed_and_apart() {
        let link = Link {
            straight: 0.35,
            bend: 0.3,
            rod: 0.1,
        };
        let shape = chain(3, link, 0.1, [40, 20]);
        assert!(edges(&shape).values().all(|&uses| uses == [1, 1]));
        assert!(Crossings::of(&shape.positions, &shape.triangles).is_embedded());
        let length = 4.0 * link.straight + TAU * link.bend;
        let expected = 3.0 * length * 0.5 * TAU * link.rod * link.rod;
        let found = volume(&shape);
        assert!((found / expected - 1.0).abs() < 0.03, "{found} {expected}");

        let touching = chain(2, link, -0.01, [40, 20]);
        assert!(!Crossings::of(&touching.positions, &touching.triangles).is_embedded());
        let fine = shape.refined();
        assert_eq!(fine.triangles.len(), 4 * shape.triangles.len());
        assert!((volume(&fine) - found).abs() < 1e-12);
        assert!(Crossings::of(&fine.positions, &fine.triangles).is_embedded());
    }
}
