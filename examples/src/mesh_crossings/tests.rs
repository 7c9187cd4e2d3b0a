use super::Crossings;
use dashu_ratio::RBig;
use proptest::{collection::vec, prelude::*};

fn rational(x: f64) -> RBig {
    RBig::try_from(x).expect("finite")
}

/// Whether triangles a and b have a common point off the vertices they share, by
/// enumerating vertices of a polytope: the pairs of barycentric coordinates (λ, μ) of common
/// points are `Σ λᵢ aᵢ = Σ μⱼ bⱼ, Σ λ = Σ μ = 1, λ, μ ≥ 0`. A linear function of λ, here the
/// weight off the shared vertices, is largest at a vertex of it: a solution that uses
/// linearly independent columns only.
fn cross_slowly(positions: &[[f64; 3]], a: [u32; 3], b: [u32; 3]) -> bool {
    let own = a.map(|vertex| !b.contains(&vertex));
    if !own.contains(&true) {
        return true;
    }
    let column = |vertex: u32, sign: f64, sums: [f64; 2]| {
        let p = positions[vertex as usize];
        [sign * p[0], sign * p[1], sign * p[2], sums[0], sums[1]].map(rational)
    };
    let mut columns = a.map(|v| column(v, 1.0, [1.0, 0.0])).to_vec();
    columns.extend(b.map(|v| column(v, -1.0, [0.0, 1.0])));
    let right = [0.0, 0.0, 0.0, 1.0, 1.0].map(rational);
    (1_u32..64).any(|set| {
        let chosen: Vec<_> = (0..6).filter(|i| set >> i & 1 == 1).collect();
        let system = chosen.iter().map(|&i| columns[i].clone()).collect();
        solve(system, right.clone()).is_some_and(|weights| {
            weights.iter().all(|w| *w >= RBig::ZERO)
                && chosen
                    .iter()
                    .zip(&weights)
                    .any(|(&i, w)| i < 3 && own[i] && *w > RBig::ZERO)
        })
    })
}

/// The only x with `Σ xᵢ columnᵢ = right`; `None` if there is no or more than one.
fn solve(mut columns: Vec<[RBig; 5]>, mut right: [RBig; 5]) -> Option<Vec<RBig>> {
    let count = columns.len();
    let mut pivots = Vec::new();
    for k in 0..count {
        let row = (0..5).find(|r| !pivots.contains(r) && !columns[k][*r].is_zero())?;
        pivots.push(row);
        let scale = columns[k][row].clone();
        for column in &mut columns {
            column[row] = &column[row] / &scale;
        }
        right[row] = &right[row] / &scale;
        for r in (0..5).filter(|&r| r != row) {
            let factor = columns[k][r].clone();
            if !factor.is_zero() {
                for column in &mut columns {
                    column[r] = &column[r] - &factor * &column[row];
                }
                right[r] = &right[r] - &factor * &right[row];
            }
        }
    }
    let consistent = (0..5).all(|r| pivots.contains(&r) || right[r].is_zero());
    consistent.then(|| pivots.iter().map(|&r| right[r].clone()).collect())
}

fn has_area(positions: &[[f64; 3]], t: [u32; 3]) -> bool {
    let [a, b, c] = t.map(|v| positions[v as usize].map(rational));
    let d = |p: &[RBig; 3], i: usize| &p[i] - &a[i];
    (0..3).any(|i| {
        let j = (i + 1) % 3;
        !(d(&b, i) * d(&c, j) - d(&b, j) * d(&c, i)).is_zero()
    })
}

/// Every pair of a mesh, slowly.
fn slowly(positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> Crossings {
    let mut found = Crossings::default();
    for (i, &a) in triangles.iter().enumerate() {
        if !has_area(positions, a) {
            found.flat.push(i);
            continue;
        }
        for (j, &b) in triangles.iter().enumerate().skip(i + 1) {
            if has_area(positions, b) && cross_slowly(positions, a, b) {
                found.pairs.push([i, j]);
            }
        }
    }
    found
}

/// Points of a small net, where nothing is in general position; a quarter of them moved by
/// less than rounding errors would be.
fn awkward_points() -> impl Strategy<Value = Vec<[f64; 3]>> {
    let coordinate = (0_i8..4, 0_u8..8).prop_map(|(n, nudge)| {
        // Not 0, whose neighbours are outside the range in which predicates are exact.
        let x = f64::from(n + 1) * 0.1;
        match nudge {
            0 => x.next_up(),
            1 => x.next_down(),
            _ => x,
        }
    });
    vec(proptest::array::uniform3(coordinate), 7)
}

fn meshes(count: usize) -> impl Strategy<Value = Vec<[u32; 3]>> {
    let triangle = proptest::sample::subsequence((0_u32..7).collect::<Vec<_>>(), 3).prop_shuffle();
    vec(triangle.prop_map(|t| [t[0], t[1], t[2]]), count)
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// The answer is that of exact rational arithmetic, whatever the triangles share.
    #[test]
    fn crossings_are_exact(positions in awkward_points(), triangles in meshes(5)) {
        prop_assert_eq!(Crossings::of(&positions, &triangles), slowly(&positions, &triangles));
    }

    /// The tree of boxes loses no pair, and names none twice.
    #[test]
    fn all_pairs_are_found(centres in vec(proptest::array::uniform3(0.0..1.0_f64), 60)) {
        let positions: Vec<_> = centres
            .iter()
            .flat_map(|p| [0.0, 0.1, 0.2].map(|d| [p[0] + d, p[1] + d * d * 7.0, p[2] - d]))
            .collect();
        let triangles: Vec<_> = (0..60_u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let all = Crossings::of(&positions, &triangles);
        let mut one_by_one = Vec::new();
        for i in 0..60 {
            for j in i + 1..60 {
                if !Crossings::of(&positions, &[triangles[i], triangles[j]]).pairs.is_empty() {
                    one_by_one.push([i, j]);
                }
            }
        }
        prop_assert_eq!(all.pairs, one_by_one);
    }
}

/// Crossings of two triangles over five points, the first of which both may share.
fn pair(positions: &[[f64; 3]], a: [u32; 3], b: [u32; 3]) -> bool {
    !Crossings::of(positions, &[a, b]).pairs.is_empty()
}

#[test]
fn touching_counts_except_where_triangles_are_joined() {
    let p = [
        [0., 0., 0.],
        [2., 0., 0.],
        [0., 2., 0.],
        [2., 2., 0.],
        [1., 1., 1.],
        [0.5, 0.5, 0.],
        [0., 0., 0.],
        [-1., 0., 1.],
    ];
    // Joined along an edge: flat, upright, and folded flat onto itself.
    assert!(!pair(&p, [0, 1, 2], [2, 1, 3]));
    assert!(!pair(&p, [0, 1, 2], [2, 1, 4]));
    assert!(pair(&p, [0, 1, 2], [2, 1, 5]));
    // Joined at a corner, touching nowhere else, and along a segment.
    assert!(!pair(&p, [0, 1, 2], [0, 7, 4]));
    assert!(pair(&p, [0, 1, 2], [0, 5, 4]));
    // Another vertex at the same place is no joint.
    assert!(pair(&p, [0, 1, 2], [6, 7, 4]));
    assert!(pair(&p, [0, 1, 2], [1, 0, 2]), "twice the same");
    let flat = Crossings::of(&p, &[[0, 5, 3], [0, 1, 2]]);
    assert_eq!((flat.pairs.len(), flat.flat), (0, vec![0]));
}
