//! Closest points on one triangle, and its normal.
//!
//! The closest point is the best of four candidates: one on each edge, and the
//! foot of the perpendicular if it lies inside. Region tests as in [Eri05]
//! need fewer operations, but on a sliver triangle rounding can send them to
//! the wrong region, far from the answer. Here every candidate is a point of
//! the triangle whatever rounding does, so that an error stays of the order of
//! rounding.

use glam::DVec3;

/// Which part of a triangle a closest point lies on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Feature {
    /// A corner; its barycentric coordinate is exactly 1.
    Vertex,
    /// The inside of an edge; the opposite barycentric coordinate is exactly 0.
    Edge,
    /// The inside of the triangle.
    Face,
}

/// The point of a triangle that is nearest to a given one.
#[derive(Clone, Copy)]
pub(crate) struct Nearest {
    pub(crate) barycentric: [f64; 3],
    pub(crate) distance_squared: f64,
    pub(crate) feature: Feature,
}

/// Finds the point of the triangle nearest to `point`.
///
/// The distance is off by at most a few roundings of the largest length
/// involved, that is of the distance from `point` to the farthest corner.
pub(crate) fn closest_on_triangle(point: DVec3, corners: [DVec3; 3]) -> Nearest {
    let mut best = closest_on_edge(point, corners, 0, 1);
    for (i, j) in [(1, 2), (2, 0)] {
        let candidate = closest_on_edge(point, corners, i, j);
        if candidate.distance_squared < best.distance_squared {
            best = candidate;
        }
    }
    match foot_on_face(point, corners) {
        Some(foot) if foot.distance_squared < best.distance_squared => foot,
        _ => best,
    }
}

/// The point of the edge between corners `i` and `j` nearest to `point`.
fn closest_on_edge(point: DVec3, corners: [DVec3; 3], i: usize, j: usize) -> Nearest {
    // Always from the lexicographically smaller end, so that two triangles
    // that share an edge compute the same bits and tie exactly.
    let (i, j) = if corners[j].to_array() < corners[i].to_array() {
        (j, i)
    } else {
        (i, j)
    };
    let (start, end) = (corners[i], corners[j]);
    let edge = end - start;
    let along = (point - start).dot(edge);
    let length_squared = edge.length_squared();

    let mut barycentric = [0.0; 3];
    let (offset, feature) = if along <= 0.0 {
        barycentric[i] = 1.0;
        (start - point, Feature::Vertex)
    } else if along >= length_squared {
        barycentric[j] = 1.0;
        (end - point, Feature::Vertex)
    } else {
        let t = along / length_squared;
        barycentric[i] = 1.0 - t;
        barycentric[j] = t;
        (start - point + t * edge, Feature::Edge)
    };
    Nearest {
        barycentric,
        distance_squared: offset.length_squared(),
        feature,
    }
}

/// The foot of the perpendicular from `point`, if it is inside the triangle.
fn foot_on_face(point: DVec3, [a, b, c]: [DVec3; 3]) -> Option<Nearest> {
    let normal = (b - a).cross(c - a);
    let [pa, pb, pc] = [a - point, b - point, c - point];
    // Each weight is twice the signed area of the part opposite to a corner,
    // times |normal|. Crossing with an edge, rather than with another vector
    // to `point`, keeps the weights accurate when `point` is far away.
    let weights = DVec3::new(
        normal.dot(pb.cross(c - b)),
        normal.dot(pc.cross(a - c)),
        normal.dot(pa.cross(b - a)),
    );
    if weights.min_element() <= 0.0 {
        return None;
    }
    let weights = weights / weights.element_sum();
    let offset = weights.x * pa + weights.y * pb + weights.z * pc;
    Some(Nearest {
        barycentric: weights.to_array(),
        distance_squared: offset.length_squared(),
        feature: Feature::Face,
    })
}

/// The unit normal by the right-hand rule, or `None` for a triangle whose area
/// is zero or lost in rounding.
pub(crate) fn unit_normal([a, b, c]: [DVec3; 3]) -> Option<DVec3> {
    let (u, v) = (b - a, c - a);
    let normal = u.cross(v);
    // Each component is a difference of two products with three roundings
    // apiece, two from the edges: an error of at most 4 ε |u| |v| in all. A
    // shorter normal could point anywhere.
    let noise = 4.0 * f64::EPSILON * u.length() * v.length();
    let length = normal.length();
    (length > noise).then(|| normal / length)
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNERS: [DVec3; 3] = [
        DVec3::ZERO,
        DVec3::new(4.0, 0.0, 0.0),
        DVec3::new(0.0, 4.0, 0.0),
    ];

    /// One point per region of the plane, with the answer known by hand.
    #[test]
    fn every_region_is_found() {
        let cases = [
            ([1.0, 1.0, 3.0], Feature::Face, [0.5, 0.25, 0.25], 9.0),
            ([2.0, -3.0, 4.0], Feature::Edge, [0.5, 0.5, 0.0], 25.0),
            ([-3.0, 1.0, 4.0], Feature::Edge, [0.75, 0.0, 0.25], 25.0),
            ([4.0, 4.0, 1.0], Feature::Edge, [0.0, 0.5, 0.5], 9.0),
            ([-1.0, -2.0, 2.0], Feature::Vertex, [1.0, 0.0, 0.0], 9.0),
            ([6.0, 1.0, 2.0], Feature::Vertex, [0.0, 1.0, 0.0], 9.0),
            ([1.0, 6.0, 2.0], Feature::Vertex, [0.0, 0.0, 1.0], 9.0),
        ];
        for (point, feature, barycentric, distance_squared) in cases {
            let nearest = closest_on_triangle(point.into(), CORNERS);
            assert_eq!(nearest.feature, feature, "{point:?}");
            assert_eq!(
                nearest.barycentric.map(f64::to_bits),
                barycentric.map(f64::to_bits)
            );
            assert_eq!(
                nearest.distance_squared.to_bits(),
                f64::to_bits(distance_squared)
            );
        }
    }

    /// A triangle of repeated corners is a point, one of collinear corners a
    /// segment; neither has a normal.
    #[test]
    fn degenerate_triangles_are_points_and_segments() {
        let point = DVec3::new(1.0, 2.0, 2.0);
        let nearest = closest_on_triangle(point, [DVec3::ZERO; 3]);
        assert_eq!(nearest.distance_squared.to_bits(), 9.0_f64.to_bits());
        assert!(unit_normal([DVec3::ZERO; 3]).is_none());

        // Seven tenths are not a binary fraction: the cross product is noise.
        let direction = DVec3::new(0.7, 0.1, 0.3);
        let segment = [DVec3::ZERO, 3.0 * direction, 7.0 * direction];
        assert!(unit_normal(segment).is_none());
        let nearest = closest_on_triangle(-direction, segment);
        assert_eq!(
            nearest.barycentric.map(f64::to_bits),
            [1.0_f64, 0.0, 0.0].map(f64::to_bits)
        );
    }
}
