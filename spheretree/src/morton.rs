//! Morton keys: the octree cell of a point, as one sortable integer.
//!
//! A key interleaves 21 bits per axis, x lowest. Its three highest bits name
//! the octant of the bounding cube, the next three the octant of that octant,
//! and so on, so that the contents of any octree cell are contiguous once the
//! keys are sorted.

use glam::DVec3;

/// Bits per axis; three axes fill 63 of the 64 bits of a key.
pub(crate) const BITS: u32 = 21;

/// The cube in which points are numbered.
///
/// Centred on the bounding box of the points, with its longest side as edge
/// ([Ma98], equations 4.1 and 4.2).
pub(crate) struct Cube {
    corner: DVec3,
    edge: f64,
}

impl Cube {
    /// The bounding cube of some points; any cube if there are none.
    pub(crate) fn around(points: impl Iterator<Item = DVec3>) -> Self {
        let (lo, hi) = points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lo, hi), point| {
            (lo.min(point), hi.max(point))
        });
        let edge = (hi - lo).max_element();
        Self {
            corner: 0.5 * (lo + hi) - DVec3::splat(0.5 * edge),
            edge,
        }
    }

    /// The key of the cell that holds `point`.
    ///
    /// Rounding may put a point next to a cell border into the neighbouring
    /// cell. That is harmless: cells only group, spheres are measured.
    pub(crate) fn key(&self, point: DVec3) -> u64 {
        if self.edge <= 0.0 {
            return 0;
        }
        // Dividing first keeps the quotient in [0, 1] even if the edge is
        // subnormal, where its reciprocal would overflow.
        let cell = (point - self.corner) / self.edge * f64::from(1_u32 << BITS);
        spread(cell_index(cell.x))
            | spread(cell_index(cell.y)) << 1
            | spread(cell_index(cell.z)) << 2
    }
}

/// Truncates to a cell number; points on the far faces join the last cell.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "saturating is wanted: rounding may leave the cube by an ulp"
)]
fn cell_index(x: f64) -> u64 {
    (x as u64).min((1 << BITS) - 1)
}

/// Moves bit i of a 21-bit number to bit 3 i.
fn spread(x: u64) -> u64 {
    let x = (x | x << 32) & 0x001f_0000_0000_ffff;
    let x = (x | x << 16) & 0x001f_0000_ff00_00ff;
    let x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
    let x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
    (x | x << 2) & 0x1249_2492_4924_9249
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Spreading agrees with moving the bits one at a time.
    #[test]
    fn spread_moves_every_bit() {
        for bit in 0..BITS {
            assert_eq!(spread(1 << bit), 1 << (3 * bit));
        }
        assert_eq!(spread((1 << BITS) - 1).count_ones(), BITS);
    }

    /// The first octant split puts opposite corners of a cube into the first
    /// and the last of its eight cells, and the far corner stays inside.
    #[test]
    fn keys_follow_the_octants() {
        let corners = [DVec3::splat(-3.0), DVec3::splat(5.0)];
        let cube = Cube::around(corners.into_iter());
        assert_eq!(cube.key(corners[0]), 0);
        assert_eq!(cube.key(corners[1]), (1 << (3 * BITS)) - 1);
        let top = |p: [f64; 3]| cube.key(p.into()) >> (3 * (BITS - 1));
        assert_eq!(top([2.0, 0.0, 0.0]), 1);
        assert_eq!(top([0.0, 2.0, 0.0]), 2);
        assert_eq!(top([0.0, 0.0, 2.0]), 4);
    }

    /// A cube without extent numbers everything zero.
    #[test]
    fn a_single_point_has_key_zero() {
        let point = DVec3::new(1.0, 2.0, 3.0);
        assert_eq!(Cube::around([point; 3].into_iter()).key(point), 0);
    }
}
