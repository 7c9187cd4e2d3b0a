//! Maps about which it is known what must be said.

use crate::claims::{Judge, methods};
use crate::common::displaced;
use crate::families::{Polynomial, Ring, scaled, square, with_determinant};
use crate::oracle::Oracle;
use dashu_ratio::RBig;
use ffd_core::{
    Border, CheckOptions, Degree, Evidence, Frame, Grid, Knots, Lattice, Method, Outcome, Verdict,
};

fn exact<const D: usize>(lattice: &Lattice<D>) -> Verdict<D> {
    lattice.check(&CheckOptions::default())
}

/// Verdicts of all methods, every claim held against the oracle.
fn verdicts<const D: usize>(lattice: &Lattice<D>, boxes: usize) -> Vec<(Method, Verdict<D>)> {
    let judge = Judge::new(lattice, boxes);
    methods()
        .into_iter()
        .map(|method| {
            let verdict = lattice.check(&CheckOptions {
                method,
                ..CheckOptions::default()
            });
            let standing = judge.check(&verdict);
            assert!(standing.is_ok(), "{method:?}: {standing:?}");
            (method, verdict)
        })
        .collect()
}

fn fraction(numerator: i64, denominator: i64) -> RBig {
    RBig::from(numerator) / RBig::from(denominator)
}

fn cubic<const D: usize>(cells: [usize; D], knots: Knots) -> Grid<D> {
    Grid::new([Degree::CUBIC; D], cells, Frame::unit())
        .and_then(|grid| grid.with_knots([knots; D]))
        .expect("a small grid")
}

#[test]
fn the_identity_is_regular_by_every_method() {
    let mixed = [Degree::LINEAR, Degree::CUBIC, Degree::QUADRATIC];
    for grid in [
        cubic::<3>([2, 1, 1], Knots::Uniform),
        Grid::new(mixed, [1, 2, 1], Frame::unit()).unwrap(),
    ] {
        for (method, verdict) in verdicts(&Lattice::at_rest(grid.clone()).unwrap(), 10) {
            assert!(verdict.is_regular(), "{method:?}: {verdict:?}");
            // Where J jumps, theorems on smooth maps may be silent.
            if method == Method::Exact && grid.degree() != mixed {
                assert!(verdict.is_injective(), "{verdict:?}");
            }
        }
    }
}

#[test]
fn an_identity_border_makes_a_regular_map_injective() {
    let grid = Grid::new([Degree::CUBIC; 2], [2, 2], Frame::unit())
        .and_then(|grid| grid.with_border(Border::Identity))
        .unwrap();
    let mut lattice = Lattice::at_rest(grid).unwrap();
    lattice.set_displacement(12, [0.75, -0.5]).unwrap();
    let verdict = exact(&lattice);
    assert!(verdict.is_injective(), "{verdict:?}");
    // Far beyond the limit.
    lattice.set_displacement(12, [8.0, 0.0]).unwrap();
    let verdict = exact(&lattice);
    assert_eq!(verdict.outcome.name(), "not_injective");
    assert!(Judge::new(&lattice, 100).check(&verdict).is_ok());
}

/// The determinant touches zero on a plane, or at a point, that halving meets.
#[test]
fn zeros_at_binary_fractions_are_degenerate() {
    let half = || fraction(1, 2);
    let plane: Polynomial<2> = square([1, 0], half(), RBig::from(12));
    // 9 (x − 1/2)² + 9 (y − 1/4)²: isolated.
    let mut point = square([1, 0], half(), RBig::from(36));
    point.extend(square([0, 1], fraction(1, 4), RBig::from(36)));
    for determinant in [plane, point] {
        for knots in [Knots::Uniform, Knots::Clamped] {
            for mirrored in [false, true] {
                let determinant = match mirrored {
                    true => negated(&determinant),
                    false => determinant.clone(),
                };
                // Clamped cubic control points rest at thirds, those of degree 4 do not.
                let grid = match knots {
                    Knots::Uniform => cubic([2, 1], knots),
                    Knots::Clamped => {
                        Grid::new([Degree::new(4).unwrap(); 2], [2, 1], Frame::unit())
                            .and_then(|grid| grid.with_knots([knots; 2]))
                            .unwrap()
                    }
                };
                let (lattice, unrounded) = with_determinant(grid, &determinant);
                assert!(unrounded);
                for (method, verdict) in verdicts(&lattice, 100) {
                    assert!(!verdict.is_regular(), "{method:?}: {verdict:?}");
                    if method == Method::Exact {
                        let Outcome::Degenerate { reversed, .. } = verdict.outcome else {
                            panic!("{knots:?}, {determinant:?}: {verdict:?}");
                        };
                        assert_eq!(reversed, mirrored);
                    }
                }
            }
        }
    }
}

/// 36 ‖x − p‖² is zero at one point of space.
#[test]
fn an_isolated_zero_in_space_is_degenerate() {
    let mut determinant = square([1, 0, 0], fraction(1, 2), RBig::from(36));
    determinant.extend(square([0, 1, 0], fraction(3, 4), RBig::from(36)));
    determinant.extend(square([0, 0, 1], fraction(3, 8), RBig::from(36)));
    let (lattice, unrounded) = with_determinant(cubic([1, 1, 1], Knots::Uniform), &determinant);
    assert!(unrounded);
    let verdict = exact(&lattice);
    let Outcome::Degenerate { zero, reversed } = verdict.outcome else {
        panic!("{verdict:?}");
    };
    assert_eq!((zero.t, reversed), ([0.5, 0.75, 0.375], false));
}

/// The same polynomial with the other sign.
fn negated<const D: usize>(polynomial: &Polynomial<D>) -> Polynomial<D> {
    polynomial.iter().map(|(e, c)| (*e, -c)).collect()
}

/// No number of halvings meets a zero at 1/3: nothing is proven, and nothing is claimed.
#[test]
fn zeros_elsewhere_are_never_accepted() {
    let thirds = square([1, 0], fraction(1, 3), RBig::from(9));
    let mut point = square([1, 0], fraction(1, 3), RBig::from(36));
    point.extend(square([0, 1], fraction(1, 3), RBig::from(36)));
    for determinant in [negated(&thirds), thirds, negated(&point), point] {
        let (lattice, unrounded) = with_determinant(cubic([1, 1], Knots::Uniform), &determinant);
        assert!(unrounded);
        for (method, verdict) in verdicts(&lattice, 100) {
            let undecided = matches!(verdict.outcome, Outcome::Undecided(_));
            assert!(undecided, "{method:?}: {verdict:?}");
        }
    }
}

/// The plane x + 2 y + 3 z = 2 is oblique to the axes: it is met at places like (1, 1/2, 0).
#[test]
fn oblique_zeros_are_never_accepted() {
    let square = square([1, 2, 3], RBig::from(2), RBig::from(72));
    for (determinant, mirrored) in [(negated(&square), true), (square, false)] {
        let grid = cubic([1, 1, 1], Knots::Uniform);
        let (lattice, unrounded) = with_determinant(grid, &determinant);
        assert!(unrounded);
        let judge = Judge::new(&lattice, 30);
        for method in methods() {
            let mut options = CheckOptions {
                method,
                ..CheckOptions::default()
            };
            // A larger one would be spent as well.
            options.budget.exact_boxes = 50;
            let verdict = lattice.check(&options);
            let standing = judge.check(&verdict);
            assert!(standing.is_ok(), "{method:?}: {standing:?}");
            let allowed = match verdict.outcome {
                Outcome::Degenerate { reversed, .. } => reversed == mirrored,
                outcome => matches!(outcome, Outcome::Undecided(_)),
            };
            assert!(allowed, "{method:?}: {verdict:?}");
        }
    }
}

/// Space is pressed flat: the determinant is zero everywhere.
#[test]
fn a_collapsed_lattice_is_degenerate() {
    for grid in [cubic([1, 2, 1], Knots::Uniform), {
        Grid::new(
            [Degree::LINEAR, Degree::QUADRATIC, Degree::CUBIC],
            [1, 1, 1],
            Frame::unit(),
        )
        .unwrap()
    }] {
        let lattice = displaced(grid, |[x, y, _]| [-x, 0.5 * y, 0.0]);
        for (method, verdict) in verdicts(&lattice, 10) {
            assert!(!verdict.is_regular(), "{method:?}: {verdict:?}");
            if method == Method::Exact {
                assert_eq!(verdict.outcome.name(), "degenerate");
                assert_eq!(verdict.min_det[0].min(0.0), verdict.min_det[0]);
            }
        }
    }
}

#[test]
fn mirror_images_are_reversed() {
    for grid in [
        cubic::<2>([2, 1], Knots::Clamped),
        cubic([1, 2], Knots::Uniform),
    ] {
        let lattice = displaced(grid, |[x, y]| [-2.0 * x, 0.25 * x - 0.125 * y]);
        for (method, verdict) in verdicts(&lattice, 10) {
            assert!(!verdict.is_regular(), "{method:?}: {verdict:?}");
            if method == Method::Exact {
                assert_eq!(verdict.outcome, Outcome::Reversed);
                assert!(verdict.irregular_cells.is_empty());
            }
        }
    }
}

/// ε + 2 (n·x − s)² with n = (1, 2, 3) / √14: small on a sheet oblique to the axes.
fn sheet(epsilon: f64, knots: Knots) -> Lattice<3> {
    let mut determinant = square([1, 2, 3], fraction(7, 2), fraction(1, 7));
    determinant.push(([0; 3], crate::oracle::exact(epsilon)));
    with_determinant(cubic([1, 1, 1], knots), &determinant).0
}

/// Rounding control points of size up to 3 moves the determinant by at most the sum of
/// absolute slopes, 6, times 3 ε/2: far less than 1e-7.
#[test]
fn oblique_sheets_are_decided_within_the_budget() {
    for epsilon in [1e-3, 1e-4, 1e-5, 1e-6, 1e-7] {
        for knots in [Knots::Uniform, Knots::Clamped] {
            let verdict = exact(&sheet(epsilon, knots));
            assert!(verdict.is_regular(), "{epsilon}: {verdict:?}");
            let lattice = sheet(-epsilon, knots);
            let verdict = exact(&lattice);
            assert_eq!(
                verdict.outcome.name(),
                "not_injective",
                "{epsilon}: {verdict:?}"
            );
            assert!(Judge::new(&lattice, 10).check(&verdict).is_ok());
        }
    }
    // The oracle agrees where it can.
    assert!(
        Oracle::new(&sheet(0.01, Knots::Uniform))
            .signs(3000)
            .only_positive()
    );
}

/// Regular, but wound around until the ends meet or overlap: no method may call it
/// injective.
fn check_ring<const D: usize>(ring: Ring) {
    let lattice = ring.lattice::<D>(Frame::unit(), |_, _| [0.0; D]);
    let judge = Judge::new(&lattice, 30);
    let signs = judge.signs();
    assert!(signs.only_positive(), "{ring:?}: {signs:?}");
    if ring.pitch == 0.0 {
        // The same point twice, exactly.
        let mut far = [0; D];
        far[ring.along] = ring.period - 1;
        let ends = [0.0, 1.0].map(|t| {
            let mut end = [0.5; D];
            end[ring.along] = t;
            end
        });
        let [a, b] = [
            judge.oracle.image([0; D], ends[0]),
            judge.oracle.image(far, ends[1]),
        ];
        assert_eq!(a, b);
    }
    for (method, verdict) in verdicts(&lattice, 30) {
        let decides = method == Method::Exact || method == Method::Paper;
        let expected = match decides {
            true => ["locally_injective", "not_injective"],
            false => ["locally_injective", "undecided"],
        };
        // A proven overlap is a right answer of any method.
        assert!(
            judge.check(&verdict).is_ok(),
            "{ring:?}, {method:?}: {verdict:?}"
        );
        if matches!(
            verdict.outcome,
            Outcome::NotInjective(Evidence::Overlap { .. })
        ) {
            continue;
        }
        let name = verdict.outcome.name();
        assert!(
            expected.contains(&name),
            "{ring:?}, {method:?}: {verdict:?}"
        );
    }
}

#[test]
fn rings_that_close_or_overlap_are_never_injective() {
    for (degree, period) in [(1, 16), (2, 12), (3, 12), (4, 16), (5, 24)] {
        for more in [0, 1, 3] {
            check_ring::<2>(Ring::new(degree, period + more, period));
        }
    }
    for (degree, more, along) in [(1, 1, 0), (2, 0, 1), (2, 1, 2), (3, 0, 0)] {
        check_ring::<3>(Ring {
            along,
            ..Ring::new(degree, 12 + more, 12)
        });
    }
    // Half over each other: turns are a half cell apart.
    check_ring::<2>(Ring {
        pitch: 0.5,
        ..Ring::new(3, 16, 12)
    });
}

/// Turns that are far enough apart do not overlap; nothing to the contrary is proven.
#[test]
fn a_spiral_whose_turns_are_apart_is_regular() {
    let spiral = Ring {
        pitch: 2.0,
        ..Ring::new(3, 18, 12)
    };
    let lattice = spiral.lattice::<2>(Frame::unit(), |_, _| [0.0; 2]);
    for (method, verdict) in verdicts(&lattice, 30) {
        let name = verdict.outcome.name();
        assert_ne!(name, "not_injective", "{method:?}: {verdict:?}");
        if method == Method::Exact {
            assert!(verdict.is_regular(), "{verdict:?}");
        }
    }
}

/// A lattice for each of the numbers that are hard on floating point.
fn hard_lattices<const D: usize>(degree: [usize; D]) -> Vec<(&'static str, Lattice<D>)> {
    let degree = degree.map(|n| Degree::new(n).expect("between 1 and 5"));
    let grid = |frame| Grid::new(degree, [1; D], frame).expect("a small grid");
    let unit = || grid(Frame::unit());
    let diagonal = |lengths: [f64; 3]| {
        let axes =
            std::array::from_fn(|i| std::array::from_fn(|c| if c == i { lengths[i] } else { 0.0 }));
        Frame::new([0.0; D], axes).expect("axes of moderate length")
    };
    // Axes that are as nearly dependent as a frame may be.
    let flat = {
        let mut axes = [[0.0; D]; D];
        for i in 0..D {
            axes[i][i] = 1.0;
        }
        axes[1][0] = 1.0;
        axes[1][1] = 1.5e-10;
        Frame::new([0.0; D], axes).expect("independent enough")
    };
    let wave = |scale: f64| move |x: [f64; D]| x.map(|c| scale * (0.3 * c * c - 0.2 * c));
    let spike = |value: f64| {
        let mut lattice = Lattice::at_rest(unit()).expect("a small grid");
        let mut displacement = [0.0; D];
        displacement[0] = value;
        lattice.set_displacement(1, displacement).expect("finite");
        lattice
    };
    let alternating = |value: f64| {
        let mut sign = 1.0;
        let displacements = (0..unit().control_point_count())
            .map(|_| {
                std::array::from_fn(|c| {
                    sign = if c == 1 { sign } else { -sign };
                    sign * value
                })
            })
            .collect();
        Lattice::new(unit(), displacements).expect("finite")
    };
    let tiny = f64::from_bits(3);
    vec![
        (
            "a large frame",
            displaced(grid(diagonal([1e12; 3])), wave(1e-12)),
        ),
        (
            "a small frame",
            displaced(grid(diagonal([1e-12; 3])), wave(1e12)),
        ),
        (
            "a long frame",
            displaced(grid(diagonal([1e12, 1e-12, 1.0])), wave(1.0)),
        ),
        (
            "the longest axes",
            displaced(grid(diagonal([1e150; 3])), |x| x.map(|c| 0.25 * c)),
        ),
        (
            "the shortest axes",
            displaced(grid(diagonal([1e-150; 3])), |x| x.map(|c| -0.25 * c)),
        ),
        (
            "both",
            displaced(grid(diagonal([1e150, 1e-150, 1.0])), |x| {
                x.map(|c| 0.25 * c)
            }),
        ),
        ("a flat frame", displaced(grid(flat), wave(1e-3))),
        (
            "a flat frame, nothing moved",
            Lattice::at_rest(grid(flat)).expect("a small grid"),
        ),
        ("negative zeros", displaced(unit(), |_| [-0.0; D])),
        (
            "subnormals",
            displaced(unit(), |x| x.map(|c| tiny * c.round())),
        ),
        ("subnormals in a short frame", {
            displaced(grid(diagonal([1e-150; 3])), |_| [tiny; D])
        }),
        ("a spike of the largest number", spike(f64::MAX)),
        ("a spike to the other side", spike(-f64::MAX)),
        ("a spike of 1e12", spike(1e12)),
        ("a spike of the smallest number", spike(tiny)),
        ("the largest numbers", alternating(f64::MAX)),
        ("large numbers", alternating(1e200)),
        ("alternating by 1e-200", alternating(1e-200)),
        (
            "nearly coincident",
            displaced(unit(), |x| x.map(|c| -c * (1.0 - 1e-14))),
        ),
        (
            "nearly on a line",
            displaced(unit(), |x| {
                std::array::from_fn(|c| if c == 0 { 0.0 } else { -x[c] * (1.0 - 1e-15) })
            }),
        ),
        ("coincident", displaced(unit(), |x| x.map(|c| -c))),
        ("far away", {
            let frame = Frame::new([1e300; D], Frame::<D>::unit().axes()).expect("finite");
            displaced(grid(frame), |_| [0.25; D])
        }),
        (
            "twice its size, a billion times",
            scaled(&displaced(unit(), |x| x), 1e9),
        ),
    ]
}

#[test]
fn hard_numbers_never_lead_to_wrong_claims() {
    fn check<const D: usize>(degree: [usize; D], wrong: &mut Vec<String>) {
        for (name, lattice) in hard_lattices(degree) {
            let judge = Judge::new(&lattice, 20);
            for method in methods() {
                for (all_cells, enclose) in [(false, None), (true, Some(1e-6))] {
                    let verdict = lattice.check(&CheckOptions {
                        method,
                        all_cells,
                        enclose,
                        ..CheckOptions::default()
                    });
                    if let Err(error) = judge.check(&verdict) {
                        wrong.push(format!("{name}, {degree:?}, {method:?}: {error}"));
                    }
                }
            }
        }
    }
    let mut wrong = Vec::new();
    check([1, 1], &mut wrong);
    check([3, 2], &mut wrong);
    check([5, 1], &mut wrong);
    check([1, 1, 1], &mut wrong);
    check([2, 1, 2], &mut wrong);
    check([3, 3, 3], &mut wrong);
    assert_eq!(wrong, Vec::<String>::new());
}
