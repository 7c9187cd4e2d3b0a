//! Constraints on the same point.

/// Coordinates that differ by at most this times the largest one are the same: the
/// rounding errors of two ways to compute a point.
const TOLERANCE: f64 = 4.0 * f64::EPSILON;

/// For each point, the first one of the list that is at the same place: itself, unless
/// it is a duplicate. `coordinates` are lattice coordinates.
///
/// Points are sorted along a slanted direction, in which the points of a plane or a row
/// of a lattice are still apart; only neighbours are compared. Costs `O(n log n)` if few
/// points share a place.
pub(super) fn first_at_same_place<const D: usize>(coordinates: &[[f64; D]]) -> Vec<usize> {
    let mut first: Vec<usize> = (0..coordinates.len()).collect();
    let size = coordinates
        .as_flattened()
        .iter()
        .fold(1.0_f64, |size, c| size.max(c.abs()));
    let tolerance = TOLERANCE * size;
    // Powers of the inverse of the plastic number.
    const DIRECTION: [f64; 3] = [1.0, 0.754_877_666_246_692_7, 0.569_840_290_998_053_3];
    let mut sorted: Vec<(f64, usize)> = coordinates
        .iter()
        .map(|u| (0..D).map(|c| u[c] * DIRECTION[c]).sum())
        .zip(0..)
        .collect();
    sorted.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    // The sum of the direction's entries, and as much again for rounding.
    let reach = 5.0 * tolerance;
    for (position, &(along, i)) in sorted.iter().enumerate() {
        for &(other, j) in &sorted[position + 1..] {
            if other - along > reach {
                break;
            }
            let same = |c: usize| (coordinates[i][c] - coordinates[j][c]).abs() <= tolerance;
            if (0..D).all(same) {
                let (a, b) = (root(&first, i), root(&first, j));
                first[a.max(b)] = a.min(b);
            }
        }
    }
    for i in 0..first.len() {
        // Roots are smaller: that of `first[i]` is already final.
        first[i] = first[first[i]];
    }
    first
}

fn root(first: &[usize], mut i: usize) -> usize {
    while first[i] != i {
        i = first[i];
    }
    i
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_duplicates_in_any_order_and_across_a_cell_boundary() {
        let ulp = f64::EPSILON;
        let points = [
            [1.0, 2.0, 3.0],
            [0.5, 0.5, 0.5],
            [1.0 - 0.5 * ulp, 2.0, 3.0],
            [0.5, 0.5, 0.5 + 1e-9],
            [0.5, 0.5, 0.5],
            [1.0, 2.0 + 2.0 * ulp, 3.0 - 2.0 * ulp],
        ];
        assert_eq!(first_at_same_place(&points), [0, 1, 0, 3, 1, 0]);
        let planar: Vec<[f64; 2]> = (0..100)
            .map(|i| [f64::from(i % 10), f64::from(i / 10)])
            .collect();
        assert!(first_at_same_place(&planar).into_iter().eq(0..100));
        assert!(first_at_same_place::<3>(&[]).is_empty());
    }
}
