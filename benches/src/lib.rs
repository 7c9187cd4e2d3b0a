//! What the benchmarks share: a ball of any fineness and a hand around it.

use glam::DVec3;
use glove_io::{
    JointAngles, Pose, Sensor,
    hand::{HandModel, Segment},
};
use spheretree::{Cylinder, Mesh, Sphere, SphereTree};

/// Radius of the ball, metres.
const RADIUS_M: f64 = 0.032;
/// Its middle, below the palm of a hand at the origin, metres.
const CENTER_M: DVec3 = DVec3::new(0.0, -0.045, -0.1);

/// A surface of triangles.
#[derive(Debug, Clone)]
pub struct Surface {
    /// Vertices, `#V × 3`, metres.
    pub positions: Vec<[f64; 3]>,
    /// Triangles, `#T × 3`.
    pub triangles: Vec<[u32; 3]>,
}

impl Surface {
    /// A ball 6.4 cm across of `12 n²` triangles: a cube of `n × n` squares a side,
    /// blown up. Its six sides do not share the vertices between them, which no query
    /// notices.
    #[must_use]
    pub fn ball(n: u32) -> Self {
        let (mut positions, mut triangles) = (Vec::new(), Vec::new());
        for side in 0..6_u32 {
            let first = side * (n + 1) * (n + 1);
            let axis = (side / 2) as usize;
            let outward = if side % 2 == 0 { 1.0 } else { -1.0 };
            for j in 0..=n {
                for i in 0..=n {
                    // Equal angles make triangles of like size.
                    let [u, v] = [i, j].map(|c| {
                        let t = 2.0 * f64::from(c) / f64::from(n) - 1.0;
                        (t * std::f64::consts::FRAC_PI_4).tan()
                    });
                    let mut cube = [0.0; 3];
                    cube[axis] = outward;
                    cube[(axis + 1) % 3] = u;
                    cube[(axis + 2) % 3] = v * outward;
                    let point = CENTER_M + RADIUS_M * DVec3::from(cube).normalize();
                    positions.push(point.to_array());
                }
            }
            for j in 0..n {
                for i in 0..n {
                    let a = first + i + j * (n + 1);
                    let [b, c, d] = [a + 1, a + n + 1, a + n + 2];
                    triangles.extend([[a, b, d], [a, d, c]]);
                }
            }
        }
        Self {
            positions,
            triangles,
        }
    }

    /// The mesh that trees are built over.
    ///
    /// # Panics
    ///
    /// If positions or triangles were made invalid.
    #[must_use]
    pub fn mesh(&self) -> Mesh<'_> {
        Mesh::new(&self.positions, &self.triangles).expect("a valid surface")
    }

    /// Corners of a triangle.
    #[must_use]
    pub fn corners(&self, triangle: u32) -> [[f64; 3]; 3] {
        self.triangles[triangle as usize].map(|v| self.positions[v as usize])
    }
}

/// The twenty shapes of a hand: three cylinders and a sphere a finger.
#[derive(Debug, Clone)]
pub struct Hand {
    /// Finger segments.
    pub cylinders: Vec<Cylinder>,
    /// Fingertips.
    pub tips: Vec<Sphere>,
}

impl Hand {
    /// A hand that closes around the ball, in 200 steps, each finger by itself until
    /// `clearance_m` is left between it and the surface. Negative clearances press in.
    ///
    /// # Panics
    ///
    /// If a clearance is so negative that a radius is too.
    #[must_use]
    pub fn around(surface: &Surface, clearance_m: f64) -> Self {
        let tree = SphereTree::build(surface.mesh());
        let mut hand = Self {
            cylinders: Vec::new(),
            tips: Vec::new(),
        };
        for finger in 0..5 {
            let at = |step: u32, pad_m| Self::finger(finger, f64::from(step) / 200.0, pad_m);
            let near = |step: u32| {
                let (cylinders, tip) = at(step, clearance_m);
                let any = |c| tree.any(&surface.positions, c);
                cylinders.iter().any(any) || tree.any(&surface.positions, &tip)
            };
            let first = (0..=200).find(|&step| near(step)).unwrap_or(200);
            // A clear finger stops before it gets there, a pressing one after.
            let step = if clearance_m > 0.0 {
                first.saturating_sub(1)
            } else {
                first
            };
            let (cylinders, tip) = at(step, 0.0);
            hand.cylinders.extend(cylinders);
            hand.tips.push(tip);
        }
        hand
    }

    /// The shapes of one finger at a closure from 0 to 1, thicker by `pad_m`.
    fn finger(finger: usize, closure: f64, pad_m: f64) -> ([Cylinder; 3], Sphere) {
        use Sensor::{
            IndexDip, IndexMcp, IndexPip, LittleDip, LittleMcp, LittlePip, MiddleDip, MiddleMcp,
            MiddlePip, RingDip, RingMcp, RingPip, ThumbAbduction, ThumbIp, ThumbMcp, ThumbRoll,
        };
        let mut angles = JointAngles::default();
        angles[ThumbRoll] = -1.0;
        angles[ThumbAbduction] = -0.9 + 0.8 * closure;
        for [mcp, pip, dip] in [
            [IndexMcp, IndexPip, IndexDip],
            [MiddleMcp, MiddlePip, MiddleDip],
            [RingMcp, RingPip, RingDip],
            [LittleMcp, LittlePip, LittleDip],
        ] {
            angles[mcp] = -1.2 * closure;
            angles[pip] = -1.4 * closure;
            angles[dip] = -0.9 * closure;
        }
        angles[ThumbMcp] = -0.8 * closure;
        angles[ThumbIp] = -0.9 * closure;
        let pose = HandModel::average_right()
            .pose(&Pose::IDENTITY, &angles)
            .fingers[finger];
        let cylinder = |s: Segment| {
            Cylinder::new(s.start_m, s.end_m, s.radius_m + pad_m).expect("a finite finger")
        };
        let tip = Sphere::new(pose.tip_center_m(), pose.tip_radius_m() + pad_m);
        (
            pose.segments().map(cylinder),
            tip.expect("a finite fingertip"),
        )
    }
}

/// Points scattered over the unit cube, by a small generator of our own (xorshift,
/// G. Marsaglia), so that they are the same everywhere.
///
/// # Panics
///
/// If the seed is zero.
pub fn scattered(count: usize, seed: u64) -> impl Iterator<Item = [f64; 3]> {
    assert!(seed != 0, "zero would stay zero");
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15);
    let mut next = move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    (0..count).map(move |_| std::array::from_fn(|_| next()))
}

/// The 2 113 vertices of a squashed hemisphere, the largest object of Gain and Dodgson's
/// Figure 6: a pole and 33 rings of 64, two units across and half a unit high.
pub fn hemisphere() -> Vec<[f64; 3]> {
    let mut vertices = vec![[0.0, 0.0, 0.5]];
    for ring in 1..=33 {
        let polar = std::f64::consts::FRAC_PI_2 * f64::from(ring) / 33.0;
        for i in 0..64 {
            let around = std::f64::consts::TAU * f64::from(i) / 64.0;
            vertices.push([
                polar.sin() * around.cos(),
                polar.sin() * around.sin(),
                0.5 * polar.cos(),
            ]);
        }
    }
    vertices
}
