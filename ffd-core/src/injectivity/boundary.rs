//! Is the map one-to-one on the boundary of the domain?
//!
//! If it is, and `det J > 0` on the closed domain, it is one-to-one on all of it (Meisters
//! and Olech, 1963). The reason, which also covers degree 1: F is a local homeomorphism
//! that keeps orientation, so a point z that is not in F(∂U) has as many preimages as the
//! degree of F at z says. F(∂U) is a topological sphere and parts space in two (Jordan,
//! Brouwer); outside the degree is 0, inside it is 1. A z in F(∂U) cannot have a preimage
//! inside U as well, whose neighbourhood would be mapped to points outside. (For degree 1,
//! where J jumps between cells: the derivative along an axis jumps only across knots of that
//! same axis. So the matrices in the convex hull of the values of J around a point are those
//! with each column between its two values; the determinant is affine in each column and
//! positive if it is in all cells around: F is a local homeomorphism by Clarke's theorem.)
//!
//! # Method
//!
//! The faces of the cells on the boundary are the leaves of a tree for each side of the
//! domain; below, faces are halved, as often as needed. Pairs of patches are examined,
//! beginning with all pairs of sides and each side with itself. A pair is done if
//!
//! * the images are apart: the Bézier points of one are beyond those of the other along a
//!   fixed direction, a normal of one patch, or the line between their middles; or
//! * F is one-to-one on the smallest box of the domain that contains both patches. That box
//!   is convex, and F(y) − F(x) is the mean of J along the segment times y − x. Let the
//!   columns of J for the axes along which the box extends lie in the convex hull of Bézier
//!   vectors v, and Δ be the largest entries of |C v − e| over all of these, for a fixed
//!   matrix C. If the spectral radius of Δ is less than one, no mean of J maps a vector of
//!   the box to zero: from J̄ w = 0 follows w = (I − C J̄) w, and |w| ≤ Δ |w|. Two patches of
//!   the same side lie in a box that is flat along its normal, so that only the columns for
//!   the other axes matter.
//!
//! Otherwise one of them is cut. As `det J > 0`, small boxes pass the second test where J is
//! continuous; patches that are apart pass the first. So only touching or overlapping
//! patches that are distant in the domain remain. For these, two places with the same image
//! are looked for ([`overlap`]).
//!
//! Where the determinant is not known to be positive, nothing follows.

use std::collections::VecDeque;

use super::overlap::{self, Overlap};
use super::patches::{Faces, apart};
use super::positions::Positions;
use crate::Lattice;

/// Pairs of patches larger than this are examined level by level, so that overlaps are
/// found before too much is cut; smaller ones one after the other.
const BREADTH_FIRST: f64 = 0.25;

/// Searches for two places with the same image, at most.
const ATTEMPTS: usize = 400;

/// Pairs examined after it has turned out that the boundary cannot be proven to be
/// one-to-one, in the hope for an overlap; and how small the patches are by then.
const LAST_PAIRS: usize = 4_000;
const LAST_SIZE: f64 = 1.0 / 16.0;

/// What the boundary says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Boundary<const D: usize> {
    /// The map is one-to-one on it.
    OneToOne,
    /// Two places have the same image.
    Overlap(Overlap<D>),
    /// Nothing was proven.
    Unknown,
}

/// Tests the boundary of the domain of a lattice with a free border, on which `det J > 0`
/// was proven. Returns the number of pairs of patches examined, at most `budget`, as well.
pub(super) fn test<const D: usize>(lattice: &Lattice<D>, budget: usize) -> (Boundary<D>, usize) {
    let Some(positions) = Positions::new(lattice) else {
        return (Boundary::Unknown, 0);
    };
    let mut faces = Faces::new(positions);
    let mut roots = Vec::new();
    for axis in 0..D {
        for upper in [false, true] {
            roots.push(faces.side(axis, upper));
        }
    }
    let mut search = Pairs {
        faces,
        queue: VecDeque::new(),
        stack: Vec::new(),
        attempts: 0,
    };
    for (i, &a) in roots.iter().enumerate() {
        for &b in &roots[i..] {
            search.queue.push_back((a, b));
        }
    }
    search.run(budget)
}

/// Pairs to be examined.
struct Pairs<'a, const D: usize> {
    faces: Faces<'a, D>,
    queue: VecDeque<(usize, usize)>,
    stack: Vec<(usize, usize)>,
    attempts: usize,
}

impl<const D: usize> Pairs<'_, D> {
    fn run(&mut self, budget: usize) -> (Boundary<D>, usize) {
        let (mut examined, mut allowed) = (0, budget);
        let mut hopeless = false;
        while let Some((i, j)) = self.queue.pop_front().or_else(|| self.stack.pop()) {
            if examined >= allowed {
                return (Boundary::Unknown, examined);
            }
            examined += 1;
            let Some(next) = self.examine(i, j) else {
                continue;
            };
            match next {
                Next::Overlap(overlap) => return (Boundary::Overlap(overlap), examined),
                Next::Cut(of) => {
                    if !self.faces.can_be_cut(of) {
                        if !hopeless {
                            allowed = allowed.min(examined + LAST_PAIRS);
                        }
                        hopeless = true;
                        continue;
                    }
                    let small = self.size(i, j) < LAST_SIZE || self.faces.touch(i, j);
                    if !(hopeless && small) {
                        self.cut(i, j, of);
                    }
                }
            }
        }
        let found = if hopeless {
            Boundary::Unknown
        } else {
            Boundary::OneToOne
        };
        (found, examined)
    }

    fn size(&self, i: usize, j: usize) -> f64 {
        let patches = &self.faces.patches;
        patches[i].extent().max(patches[j].extent())
    }

    /// What is to be done with a pair; `None` if it is done.
    fn examine(&mut self, i: usize, j: usize) -> Option<Next<D>> {
        let patches = &self.faces.patches;
        let (a, b) = (&patches[i], &patches[j]);
        if i == j {
            return (!self.faces.passes_by_hull(i)).then_some(Next::Cut(i));
        }
        if apart(&a.slabs, &b.slabs) {
            return None;
        }
        let larger = |of_a: f64, of_b: f64| if of_a >= of_b { i } else { j };
        if a.touches(b) {
            let of = larger(a.extent(), b.extent());
            if self.faces.one_to_one_around(i, j) {
                return None;
            }
            return Some(Next::Cut(of));
        }
        if self.faces.apart_by_points(i, j) {
            return None;
        }
        let near = a.gap(b) <= a.extent().max(b.extent());
        let of = larger(a.image_size(), b.image_size());
        if near && self.faces.one_to_one_around(i, j) {
            return None;
        }
        Some(match self.find_overlap(i, j) {
            Some(overlap) => Next::Overlap(overlap),
            None => Next::Cut(of),
        })
    }

    /// Looks for a place near one patch with the same image as one near the other.
    fn find_overlap(&mut self, i: usize, j: usize) -> Option<Overlap<D>> {
        let Faces {
            positions, patches, ..
        } = &mut self.faces;
        for (from, to) in [(i, j), (j, i)] {
            let (a, b) = (&patches[from], &patches[to]);
            let single = a.points.is_some() && b.points.is_some();
            let near = single && b.is_near(a.middle_of_image(), a.image_size());
            if !near || self.attempts >= ATTEMPTS {
                continue;
            }
            self.attempts += 1;
            let [_, start] = b.middle_and_inside(positions.cells);
            for point in a.middle_and_inside(positions.cells) {
                let found = overlap::prove(positions, point, start);
                if found.is_some() {
                    return found;
                }
            }
        }
        None
    }

    /// Replaces a pair by those of the halves of one of its patches.
    fn cut(&mut self, i: usize, j: usize, of: usize) {
        let children = self.faces.cut(of);
        let [low, high] = children;
        if i == j {
            self.push(low, low);
            self.push(high, high);
            self.push(low, high);
            return;
        }
        let other = if of == i { j } else { i };
        self.push(low, other);
        self.push(high, other);
    }

    fn push(&mut self, i: usize, j: usize) {
        if self.size(i, j) > BREADTH_FIRST {
            self.queue.push_back((i, j));
        } else {
            self.stack.push((i, j));
        }
    }
}

enum Next<const D: usize> {
    /// Cut the patch named.
    Cut(usize),
    Overlap(Overlap<D>),
}

#[cfg(test)]
mod tests {
    use super::super::samples::{check_overlap, clamped, grid, in_frame, mapped, noisy, wound};
    use super::*;
    use crate::*;
    use proptest::prelude::*;

    /// What the boundary says, if the map is regular.
    fn found<const D: usize>(lattice: &Lattice<D>) -> Option<Boundary<D>> {
        let local = CheckOptions {
            global: false,
            ..CheckOptions::default()
        };
        let regular = lattice.check(&local).is_regular();
        regular.then(|| super::test(lattice, 100_000).0)
    }

    fn is_one_to_one<const D: usize>(lattice: &Lattice<D>) -> bool {
        found(lattice) == Some(Boundary::OneToOne)
    }

    fn overlaps<const D: usize>(lattice: &Lattice<D>) -> bool {
        matches!(found(lattice), Some(Boundary::Overlap(_)))
    }

    #[test]
    fn maps_at_rest_are_one_to_one() {
        assert!(is_one_to_one(
            &Lattice::at_rest(grid([3; 2], [5, 1])).unwrap()
        ));
        assert!(is_one_to_one(
            &Lattice::at_rest(grid([1, 2, 5], [1, 3, 2])).unwrap()
        ));
    }

    /// Up to a whole turn a strip does not meet itself, and with a pitch of more than its
    /// width never.
    #[test]
    fn bent_strips_are_one_to_one() {
        for degrees in [90.0, 200.0, 300.0, 345.0, 359.9] {
            let turns = degrees / 360.0;
            let flat = mapped(grid([3; 2], [24, 2]), wound(24.0, 2.0, turns, 0.0));
            assert!(is_one_to_one(&flat), "{degrees}");
            let solid = mapped(grid([3, 2, 2], [12, 1, 1]), wound(12.0, 1.0, turns, 0.0));
            assert!(is_one_to_one(&solid), "{degrees}");
        }
        let spiral = mapped(grid([3; 2], [36, 2]), wound(36.0, 2.0, 1.8, 3.0));
        assert!(is_one_to_one(&spiral));
        let linear = mapped(grid([1; 2], [24, 2]), wound(24.0, 2.0, 0.8, 0.0));
        assert!(is_one_to_one(&linear));
    }

    #[test]
    fn strips_wound_over_themselves_overlap() {
        for (turns, pitch) in [(1.1, 0.0), (1.6, 0.5), (1.8, 1.5), (2.5, 0.0)] {
            let flat = mapped(grid([3; 2], [36, 2]), wound(36.0, 2.0, turns, pitch));
            assert!(overlaps(&flat), "{turns} {pitch}");
            let mixed = mapped(
                clamped([4, 1, 2], [24, 2, 2]),
                wound(24.0, 2.0, turns, pitch),
            );
            assert!(overlaps(&mixed), "{turns} {pitch}");
        }
    }

    /// A ring that is closed exactly, end to end, with equal control points: neither is
    /// proven.
    #[test]
    fn ends_that_touch_are_nothing_proven() {
        let map = wound(16.0, 2.0, 1.0, 0.0);
        let exact = |u: [f64; 2]| {
            let around = if u[0] >= 16.0 { 0.0 } else { u[0] };
            map([around, u[1]]).map(|x| (x * 1024.0).round() / 1024.0)
        };
        let ring = mapped(clamped([3, 2], [16, 2]), exact);
        let first = ring.deform_point([0.0, 1.0]);
        let last = ring.deform_point([16.0, 1.0]);
        assert!(first.iter().zip(last).all(|(a, b)| (a - b).abs() < 1e-13));
        assert_eq!(found(&ring), Some(Boundary::Unknown));
        // The whole test agrees.
        let verdict = ring.check(&CheckOptions::default());
        assert_eq!(verdict.outcome, Outcome::LocallyInjective);

        let map = wound(16.0, 2.0, 1.0, 0.0);
        let exact = |u: [f64; 3]| {
            let around = if u[0] >= 16.0 { 0.0 } else { u[0] };
            map([around, u[1], u[2]]).map(|x| (x * 1024.0).round() / 1024.0)
        };
        let tube = mapped(clamped([2; 3], [16, 1, 2]), exact);
        assert_eq!(found(&tube), Some(Boundary::Unknown));
    }

    #[test]
    fn a_frame_changes_nothing() {
        let skewed = Frame::new([3.0, 4.0], [[1.0, 0.25], [-0.5, 2.0]]).unwrap();
        let tiny = 2_f64.powi(-40);
        let scaled = Frame::new([0.0; 2], [[tiny, 0.0], [0.0, 1.0 / tiny]]).unwrap();
        let small = Frame::new([1e-9; 2], [[tiny, 0.0], [0.0, tiny]]).unwrap();
        for (turns, pitch) in [(0.6, 0.0), (1.3, 0.2), (1.5, 3.0)] {
            let strip = mapped(grid([3, 2], [24, 2]), wound(24.0, 2.0, turns, pitch));
            let name = strip.check(&CheckOptions::default()).outcome.name();
            for frame in [skewed, scaled, small] {
                let other = in_frame(&strip, frame).check(&CheckOptions::default());
                assert_eq!(other.outcome.name(), name, "{turns} {pitch}");
            }
        }
    }

    #[test]
    fn without_a_budget_nothing_is_proven() {
        let strip = mapped(grid([3; 2], [24, 2]), wound(24.0, 2.0, 0.7, 0.0));
        assert_eq!(super::test(&strip, 5), (Boundary::Unknown, 5));
    }

    /// Images of points around the domain of a plane lattice, evenly spaced on each side.
    fn outline(lattice: &Lattice<2>, per_side: usize) -> Vec<[f64; 2]> {
        let [w, h] = lattice.grid().cells().map(|n| n as f64);
        let side = |from: [f64; 2], to: [f64; 2]| {
            (0..per_side).map(move |i| {
                let s = i as f64 / per_side as f64;
                [
                    from[0] + s * (to[0] - from[0]),
                    from[1] + s * (to[1] - from[1]),
                ]
            })
        };
        let around = side([0.0, 0.0], [w, 0.0])
            .chain(side([w, 0.0], [w, h]))
            .chain(side([w, h], [0.0, h]))
            .chain(side([0.0, h], [0.0, 0.0]));
        around
            .map(|x| lattice.evaluate(x).unwrap().position)
            .collect()
    }

    /// Whether a closed polygon crosses itself.
    fn crosses(polygon: &[[f64; 2]]) -> bool {
        let n = polygon.len();
        let cross = |a: [f64; 2], b: [f64; 2], c: [f64; 2]| {
            (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        };
        (0..n).any(|i| {
            let (a, b) = (polygon[i], polygon[(i + 1) % n]);
            (i + 2..n).any(|j| {
                let (c, d) = (polygon[j], polygon[(j + 1) % n]);
                let near = (0..2)
                    .all(|k| a[k].min(b[k]) <= c[k].max(d[k]) && c[k].min(d[k]) <= a[k].max(b[k]));
                near && (j + 1) % n != i
                    && cross(a, b, c) * cross(a, b, d) < 0.0
                    && cross(c, d, a) * cross(c, d, b) < 0.0
            })
        })
    }

    /// A strip wound by a random number of turns, with noise.
    fn random_strip(seed: u64) -> Lattice<2> {
        let parameters = noisy(grid([1, 1], [3, 3]), 1.0, seed);
        let [a, b] = parameters.displacements()[0];
        let [_, d] = parameters.displacements()[1];
        let number = usize::try_from(seed).unwrap();
        let degree = [1 + number % 5, 1 + number / 5 % 4];
        let make = if b > 0.0 { grid::<2> } else { clamped::<2> };
        let map = wound(16.0, 2.0, 1.0 + 0.8 * a, 2.5 * (1.0 + b));
        let mut strip = mapped(make(degree, [16, 2]), map);
        let noise = noisy(strip.grid().clone(), 0.3 * d.abs(), seed + 1);
        strip.add_displacements(noise.displacements()).unwrap();
        strip
    }

    /// Compares with the images of many points of the boundary; returns how many lattices
    /// were regular, proven to be one-to-one, proven to overlap, and how many of those in
    /// doubt have an outline that crosses itself.
    fn compare(seeds: std::ops::Range<u64>) -> [usize; 4] {
        let mut counts = [0; 4];
        for seed in seeds {
            let strip = random_strip(seed);
            let verdict = strip.check(&CheckOptions::default());
            match verdict.outcome {
                Outcome::Injective(_) => {
                    counts[1] += 1;
                    // A coarse outline may cross itself where the map comes near itself.
                    let crossing = [100, 1000].iter().all(|&n| crosses(&outline(&strip, n)));
                    assert!(!crossing, "{seed}: {verdict:?}");
                }
                Outcome::NotInjective(Evidence::Overlap { .. }) => {
                    counts[2] += 1;
                    check_overlap(&strip, &verdict);
                }
                Outcome::LocallyInjective => {
                    counts[3] += usize::from(crosses(&outline(&strip, 1000)))
                }
                _ => continue,
            }
            counts[0] += 1;
        }
        counts
    }

    #[test]
    fn outlines_agree() {
        let [regular, one_to_one, overlaps, missed] = compare(0..150);
        assert!(
            regular > 90 && one_to_one > 30 && overlaps > 20,
            "{regular} {one_to_one} {overlaps}"
        );
        assert!(missed <= 2, "{missed}");
    }

    #[test]
    #[ignore = "takes long"]
    fn many_outlines_agree() {
        println!("{:?}", compare(1000..6000));
    }

    /// However large or small the numbers are: no panic, and no claim that is wrong.
    #[test]
    fn extreme_numbers_prove_nothing_wrong() {
        for scale in [1e-320, 1e-300, 1e-20, 1e12, 1e120, 1e300] {
            for seed in 0..5 {
                let lattice = noisy(grid([2, 3], [3, 2]), scale, seed);
                let said = super::test(&lattice, 3000).0;
                // Tiny displacements are the identity; huge ones fold, and then what is said
                // of the boundary of a regular map means nothing.
                if scale < 1.0 {
                    assert_eq!(said, Boundary::OneToOne);
                }
                let solid = noisy(grid([1, 2, 3], [1, 2, 1]), scale, seed);
                let said = super::test(&solid, 3000).0;
                if scale < 1.0 {
                    assert_eq!(said, Boundary::OneToOne);
                }
                let verdict = lattice.check(&CheckOptions::default());
                assert_eq!(verdict.is_injective(), scale < 1.0, "{scale}: {verdict:?}");
            }
        }
    }

    /// Where the map is stretched by 2⁴⁰ along one axis, patches are cut along that one
    /// again and again.
    #[test]
    fn stretched_maps_end_too() {
        let stretch = 2_f64.powi(40);
        for (turns, pitch, expected) in [(0.7, 0.0, true), (1.3, 0.1, false)] {
            let strip = wound(16.0, 1.0, turns, pitch);
            let map = move |u: [f64; 3]| {
                let [x, y, z] = strip(u);
                [x, y, stretch * z]
            };
            let lattice = mapped(grid([3, 2, 2], [16, 1, 2]), map);
            let said = super::test(&lattice, 20_000).0;
            assert!(said != Boundary::OneToOne || expected);
            assert!(!matches!(said, Boundary::Overlap(_)) || !expected);
            let map = move |u: [f64; 2]| [u[0] + 0.3 * u[1].sin() * stretch, stretch * u[1]];
            let lattice = mapped(grid([3, 2], [4, 3]), map);
            let said = super::test(&lattice, 20_000).0;
            assert!(!matches!(said, Boundary::Overlap(_)));
        }
    }

    /// If a map is said to be one-to-one, the way back from an image leads to where it came
    /// from.
    fn check<const D: usize>(lattice: &Lattice<D>, at: [f64; D]) -> Result<(), TestCaseError> {
        let verdict = lattice.check(&CheckOptions::default());
        if verdict.is_injective() {
            let cells = lattice.grid().cells();
            let inverse = Inverse::new(lattice);
            for number in 0..1 << D {
                let x: [f64; D] = std::array::from_fn(|a| {
                    let at = if number >> a & 1 == 1 {
                        1.0 - at[a]
                    } else {
                        at[a]
                    };
                    at * cells[a] as f64
                });
                let there = lattice.evaluate(x).unwrap();
                let back = inverse.point(there.position);
                let Ok(Some(y)) = back.as_ref().map(Preimage::point) else {
                    return Err(TestCaseError::fail(format!("{back:?}")));
                };
                // Sizes are below 100, and J is far from singular in nearly all cases.
                let far = (0..D).any(|a| (x[a] - y[a]).abs() > 1e-6);
                prop_assert!(!far || there.determinant < 1e-3, "{x:?} {y:?} {verdict:?}");
            }
        }
        Ok(())
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        #[test]
        fn claims_agree_with_the_inverse(
            degree in proptest::array::uniform3(1_usize..=4),
            clamp in any::<bool>(),
            turns in 0.2..1.8_f64,
            pitch in 0.0..4.0_f64,
            noise in 0.0..0.4_f64,
            at in proptest::array::uniform3(0.0..1.0_f64),
            seed in any::<u64>(),
        ) {
            let make = if clamp { clamped::<3> } else { grid::<3> };
            let strip = mapped(make(degree, [12, 2, 1]), wound(12.0, 2.0, turns, pitch));
            let noise_on = |lattice: &Lattice<3>| {
                let noise = noisy(lattice.grid().clone(), noise, seed);
                let mut sum = lattice.clone();
                sum.add_displacements(noise.displacements()).unwrap();
                sum
            };
            check(&strip, at)?;
            check(&noise_on(&strip), at)?;
            let [n0, n1, _] = degree;
            let flat = mapped(grid([n0, n1], [16, 2]), wound(16.0, 2.0, turns, pitch));
            check(&flat, [at[0], at[1]])?;
        }
    }

    #[test]
    #[ignore = "prints times"]
    fn times() {
        let options = CheckOptions::default();
        let time = |name: &str, l: &Lattice<3>| {
            let start = std::time::Instant::now();
            let v = l.check(&CheckOptions {
                global: false,
                ..options
            });
            let local = start.elapsed();
            let start = std::time::Instant::now();
            let w = l.check(&options);
            let both = start.elapsed();
            let start = std::time::Instant::now();
            let b = super::test(l, 1_000_000);
            let boundary = start.elapsed();
            println!(
                "{name}: local {local:?} {} boxes {}, global {both:?} {} {:?} boxes {}; boundary {boundary:?} {} {}",
                v.outcome.name(),
                v.effort.boxes,
                w.outcome.name(),
                w.theorem().map(|t| t.name()),
                w.effort.boxes,
                match b.0 {
                    super::Boundary::OneToOne => "one",
                    super::Boundary::Overlap(_) => "overlap",
                    _ => "unknown",
                },
                b.1
            );
        };
        for size in [0.2, 0.3, 0.4, 0.5, 0.6] {
            time(
                &format!("noise {size}"),
                &noisy(grid([3; 3], [10; 3]), size, 7),
            );
        }
        for turns in [0.25, 0.56, 0.9, 1.5] {
            for pitch in [0.0, 3.0] {
                let g = grid([3; 3], [24, 2, 2]);
                time(
                    &format!("wound {turns} {pitch}"),
                    &mapped(g, wound(24.0, 2.0, turns, pitch)),
                );
            }
        }
        let l = mapped(grid([3; 3], [24, 4, 4]), wound(24.0, 4.0, 0.56, 0.0));
        time("wide", &l);
        for gap in [1e-1, 1e-2, 1e-3, 1e-4, 1e-5] {
            let spiral = wound(24.0, 2.0, 1.8, 2.0 + gap);
            time(
                &format!("near {gap}"),
                &mapped(grid([3; 3], [24, 2, 2]), spiral),
            );
        }
        for cells in [[20, 20, 20], [40, 40, 1]] {
            time(&format!("{cells:?}"), &noisy(grid([3; 3], cells), 0.4, 5));
        }
        let n = noisy(grid([3; 3], [24, 4, 4]), 0.3, 3);
        let d = l
            .displacements()
            .iter()
            .zip(n.displacements())
            .map(|(a, b)| [a[0] + b[0], a[1] + b[1], a[2] + b[2]])
            .collect();
        time("wide noisy", &Lattice::new(l.grid().clone(), d).unwrap());
    }
}
