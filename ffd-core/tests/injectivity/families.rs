//! Families of lattices about which something is known, and random ones.

use crate::oracle::{Oracle, exact, indices};
use dashu_ratio::RBig;
use ffd_core::{Border, Degree, Frame, Grid, Knots, Lattice};

/// Numbers that depend on nothing but the seed (`SplitMix64`).
#[derive(Debug, Clone)]
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0xd129_0a2b_7b3d_5f01))
    }

    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    pub(crate) fn below(&mut self, count: usize) -> usize {
        (self.bits() % count as u64) as usize
    }

    pub(crate) fn coin(&mut self) -> bool {
        self.below(2) == 0
    }

    /// From −`most` to `most` in steps of 1/64.
    pub(crate) fn dyadic(&mut self, most: f64) -> f64 {
        let steps = (most * 64.0) as usize;
        (self.below(2 * steps + 1) as f64 - steps as f64) / 64.0
    }
}

/// A frame: none, or a skewed one, mirrored every other time.
pub(crate) fn random_frame<const D: usize>(random: &mut Random) -> Frame<D> {
    if random.coin() {
        return Frame::unit();
    }
    loop {
        let axes = std::array::from_fn(|_| std::array::from_fn(|_| random.dyadic(2.0)));
        let origin = std::array::from_fn(|_| random.dyadic(8.0));
        if let Ok(frame) = Frame::new(origin, axes) {
            return frame;
        }
    }
}

/// A grid of any knots and border, with at most `most_cells` of its own along each axis.
pub(crate) fn random_grid<const D: usize>(
    random: &mut Random,
    degree: [usize; D],
    most_cells: usize,
) -> Grid<D> {
    let cells = degree.map(|_| 1 + random.below(most_cells));
    let degree = degree.map(|n| Degree::new(n).expect("between 1 and 5"));
    let grid = Grid::new(degree, cells, random_frame(random)).expect("a small grid");
    // A border adds 2 n cells along each axis, and takes that much more time.
    let few = degree.iter().map(|n| n.get()).sum::<usize>() <= if D == 2 { 6 } else { 4 };
    if few && random.below(4) == 0 {
        grid.with_border(Border::Identity).expect("uniform knots")
    } else {
        let knots = degree.map(|_| {
            if random.coin() {
                Knots::Clamped
            } else {
                Knots::Uniform
            }
        });
        grid.with_knots(knots).expect("a free border")
    }
}

/// The lattice on a grid with the given displacements in lattice coordinates.
pub(crate) fn in_lattice_coordinates<const D: usize>(
    grid: Grid<D>,
    displacements: &[[f64; D]],
) -> Lattice<D> {
    let axes = grid.frame().axes();
    let world = displacements
        .iter()
        .map(|d| std::array::from_fn(|c| (0..D).map(|i| d[i] * axes[i][c]).sum()))
        .collect();
    Lattice::new(grid, world).expect("one for each control point")
}

/// Displacements up to `most` cells along each axis.
pub(crate) fn random_lattice<const D: usize>(
    random: &mut Random,
    grid: Grid<D>,
    most: f64,
) -> Lattice<D> {
    let displacements: Vec<_> = (0..grid.control_point_count())
        .map(|_| std::array::from_fn(|_| random.dyadic(most)))
        .collect();
    in_lattice_coordinates(grid, &displacements)
}

/// The same lattice, its displacements scaled to a hair's breadth from where it ceases to
/// be regular, on either side.
pub(crate) fn near_the_limit<const D: usize>(
    random: &mut Random,
    lattice: &Lattice<D>,
) -> Lattice<D> {
    let limit = Oracle::new(lattice).limit_estimate(8.0);
    let off = 0.5_f64.powi(4 + random.below(14) as i32);
    let factor = limit * if random.coin() { 1.0 - off } else { 1.0 + off };
    // 24 bits, so that products with displacements stay short.
    scaled(lattice, f64::from(factor as f32))
}

pub(crate) fn scaled<const D: usize>(lattice: &Lattice<D>, factor: f64) -> Lattice<D> {
    let displacements = lattice
        .displacements()
        .iter()
        .map(|d| d.map(|x| x * factor))
        .collect();
    Lattice::new(lattice.grid().clone(), displacements).expect("finite as before")
}

/// A polynomial in D variables: exponents and coefficients.
pub(crate) type Polynomial<const D: usize> = Vec<([usize; D], RBig)>;

/// The square of Σ `normal[i]` xᵢ − `offset`, times `factor`.
pub(crate) fn square<const D: usize>(
    normal: [i64; D],
    offset: RBig,
    factor: RBig,
) -> Polynomial<D> {
    let mut linear: Polynomial<D> = (0..D)
        .map(|i| {
            let exponents = std::array::from_fn(|axis| usize::from(axis == i));
            (exponents, RBig::from(normal[i]))
        })
        .collect();
    linear.push(([0; D], -offset));
    let mut square = Vec::new();
    for (e, a) in &linear {
        for (f, b) in &linear {
            square.push((std::array::from_fn(|i| e[i] + f[i]), a * b * &factor));
        }
    }
    square
}

/// The elementary symmetric polynomial of order `k`, over their number in degree n: the
/// polar form of tᵏ.
fn polar_form(k: usize, arguments: &[i64]) -> RBig {
    let mut symmetric = vec![0_i64; k + 1];
    symmetric[0] = 1;
    for &x in arguments {
        for order in (1..=k).rev() {
            symmetric[order] += x * symmetric[order - 1];
        }
    }
    let n = arguments.len();
    let binomial = (0..k).fold(1, |b, i| b * (n - i) / (i + 1));
    RBig::from(symmetric[k]) / RBig::from(binomial)
}

/// The lattice on a grid with a free border and the unit frame whose Jacobian determinant
/// is the given polynomial, up to rounding of control points: displaced along the first
/// axis by the integral minus x₀. Also says whether nothing was rounded.
pub(crate) fn with_determinant<const D: usize>(
    grid: Grid<D>,
    determinant: &Polynomial<D>,
) -> (Lattice<D>, bool) {
    assert_eq!(grid.frame(), &Frame::unit());
    assert_eq!(grid.border(), Border::Free);
    let mut integral: Polynomial<D> = determinant
        .iter()
        .map(|(exponents, c)| {
            let mut exponents = *exponents;
            exponents[0] += 1;
            (exponents, c / RBig::from(exponents[0]))
        })
        .collect();
    let first = std::array::from_fn(|axis| usize::from(axis == 0));
    integral.push((first, RBig::from(-1)));

    let mut unrounded = true;
    let displacements = indices(grid.control_points_per_axis())
        .map(|index| {
            // The knots inside the support of the basis function.
            let knots: [Vec<i64>; D] = std::array::from_fn(|axis| {
                let n = grid.degree()[axis].get() as i64;
                let i = index[axis] as i64;
                let last = grid.cells()[axis] as i64;
                (i - n + 1..=i)
                    .map(|knot| match grid.knots()[axis] {
                        Knots::Uniform => knot,
                        Knots::Clamped => knot.clamp(0, last),
                    })
                    .collect()
            });
            let coefficient = integral
                .iter()
                .map(|(exponents, c)| {
                    (0..D).fold(c.clone(), |product, axis| {
                        product * polar_form(exponents[axis], &knots[axis])
                    })
                })
                .fold(RBig::ZERO, |sum, term| sum + term);
            let rounded = coefficient.to_f64().value();
            unrounded &= exact(rounded) == coefficient;
            std::array::from_fn(|c| if c == 0 { rounded } else { 0.0 })
        })
        .collect();
    let lattice = Lattice::new(grid, displacements).expect("one for each control point");
    (lattice, unrounded)
}

/// A strip of cells, wound to a ring.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ring {
    pub(crate) degree: usize,
    /// Cells along the strip, which is one cell wide and, in space, one thick.
    pub(crate) cells: usize,
    /// How many of them are once around.
    pub(crate) period: usize,
    /// How far the turns of a spiral are apart; with 0, F(u + period, v) = F(u, v) exactly.
    pub(crate) pitch: f64,
    /// The axis of the lattice along the strip.
    pub(crate) along: usize,
}

impl Ring {
    pub(crate) fn new(degree: usize, cells: usize, period: usize) -> Self {
        Self {
            degree,
            cells,
            period,
            pitch: 0.0,
            along: 0,
        }
    }

    /// The lattice in a frame, with control points off by `noise`, given their index
    /// along the strip (the same in every turn) and across. Regular if the period is not
    /// too short, nor the noise too large.
    pub(crate) fn lattice<const D: usize>(
        &self,
        frame: Frame<D>,
        noise: impl Fn(usize, usize) -> [f64; D],
    ) -> Lattice<D> {
        let Self {
            cells,
            period,
            along,
            ..
        } = *self;
        let across = (along + 1) % D;
        let mut count = [1; D];
        count[along] = cells;
        let degree = [Degree::new(self.degree).expect("between 1 and 5"); D];
        let grid = Grid::new(degree, count, frame).expect("a small grid");
        let displacements: Vec<[f64; D]> = (0..grid.control_point_count())
            .map(|i| {
                let mut index = grid.control_point_indices(i);
                let rest: [f64; D] =
                    std::array::from_fn(|a| grid.axes()[a].rest_coordinate(index[a]));
                let turns = index[along] as f64 / period as f64;
                // The same numbers in every turn, to the last bit.
                index[along] %= period;
                let angle = index[along] as f64 / period as f64 * std::f64::consts::TAU;
                // Inwards is the second axis: then the ring is not a mirror image.
                let left = cells as f64 / period as f64 - turns;
                let radius = 4.0 + self.pitch * left - rest[across];
                let mut place = rest;
                place[along] = radius * angle.cos();
                place[across] = radius * angle.sin();
                let off = noise(index[along], index[across]);
                // Short numbers, from which rest positions are subtracted exactly.
                std::array::from_fn(|c| ((place[c] + off[c]) * 64.0).round() / 64.0 - rest[c])
            })
            .collect();
        in_lattice_coordinates(grid, &displacements)
    }
}

/// A ring of any degree that overlaps itself, exactly, by up to four cells, with noise.
pub(crate) fn random_ring<const D: usize>(random: &mut Random) -> Lattice<D> {
    let degree = 1 + random.below(5);
    let period = [16, 12, 12, 16, 24][degree - 1];
    let mut ring = Ring::new(degree, period + random.below(5), period);
    ring.along = random.below(D);
    let frame = random_frame(random);
    let most = [0.0, 0.0625, 0.25][random.below(3)];
    let noise: Vec<[f64; D]> = (0..period * (degree + 1))
        .map(|_| std::array::from_fn(|_| random.dyadic(most)))
        .collect();
    ring.lattice(frame, |along, across| noise[along * (degree + 1) + across])
}

/// A lattice whose determinant touches zero, exactly, at a random fraction of a cell, on
/// a plane or line through it or only there; and whether it is negative elsewhere.
pub(crate) fn random_touching<const D: usize>(random: &mut Random) -> (Lattice<D>, bool) {
    loop {
        let degree = [0; D].map(|_| Degree::new(3 + random.below(3)).expect("up to 5"));
        let cells = [0; D].map(|_| 1 + random.below(2));
        let grid = Grid::new(degree, cells, Frame::unit()).expect("a small grid");
        let reversed = random.below(4) == 0;
        let denominator = [1, 2, 3, 8][random.below(4)];
        let point = cells.map(|n| random.below(n * denominator + 1) as i64);
        // Enough to cancel the denominators of the square of the offset and of all polar
        // forms.
        let factor = RBig::from(if reversed { -32400 } else { 32400 });
        let mut determinant = Vec::new();
        for _ in 0..1 + random.below(D) {
            let mut normal = [0; D].map(|_| random.below(5) as i64 - 2);
            if normal == [0; D] {
                normal[0] = 1;
            }
            let offset: i64 = (0..D).map(|i| normal[i] * point[i]).sum();
            let offset = RBig::from(offset) / RBig::from(denominator);
            determinant.extend(square(normal, offset, factor.clone()));
        }
        let (lattice, unrounded) = with_determinant(grid, &determinant);
        if unrounded {
            return (lattice, reversed);
        }
    }
}
