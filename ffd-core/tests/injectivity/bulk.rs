//! Many random lattices with fixed seeds, spread over two threads.

use crate::claims::{Judge, Standing, methods, sufficient_methods};
use crate::families::{
    Random, near_the_limit, random_grid, random_lattice, random_ring, random_touching,
};
use crate::oracle::Oracle;
use ffd_core::{Border, CheckOptions, Degree, Frame, Grid, Lattice, Method, Outcome};
use std::collections::BTreeMap;

/// Parts into which the oracle may cut a cell. Lattices within 1e-5 of the limit need a
/// few hundred.
const BOXES: usize = 1_000;

/// How often each outcome was found, and how often the oracle gave up, or could decide
/// where the test did not.
#[derive(Debug, Default)]
struct Tally {
    outcomes: BTreeMap<&'static str, usize>,
    /// How often each sufficient method said yes.
    sufficient: BTreeMap<&'static str, usize>,
    rings: BTreeMap<&'static str, usize>,
    touching: BTreeMap<&'static str, usize>,
    open: usize,
    undecided_but_decidable: Vec<usize>,
    /// Number of the lattice, and what is wrong.
    wrong: Vec<(usize, String)>,
}

impl Tally {
    fn hold(&mut self, index: usize, right: bool, what: impl FnOnce() -> String) {
        if !right {
            self.wrong.push((index, what()));
        }
    }

    fn add(&mut self, other: Self) {
        for (own, other) in [
            (&mut self.outcomes, other.outcomes),
            (&mut self.sufficient, other.sufficient),
            (&mut self.rings, other.rings),
            (&mut self.touching, other.touching),
        ] {
            for (name, count) in other {
                *own.entry(name).or_default() += count;
            }
        }
        self.open += other.open;
        self.wrong.extend(other.wrong);
        self.undecided_but_decidable
            .extend(other.undecided_but_decidable);
    }
}

/// Lattice number `index` in D dimensions: of any degree up to `most_degree` along each
/// axis or of the `degree` given, with one or more cells, every other one near the limit.
fn lattice<const D: usize>(index: usize, degree: Option<usize>, most_degree: usize) -> Lattice<D> {
    let mut random = Random::new(index as u64);
    let degree = [degree; D].map(|n| n.unwrap_or_else(|| 1 + random.below(most_degree)));
    let many_cells = index / 10 % 2 == 1;
    let grid = loop {
        let grid = random_grid::<D>(&mut random, degree, if many_cells { 2 } else { 1 });
        let one = grid.cells() == [1; D];
        if one != many_cells {
            break grid;
        }
    };
    let most = [0.25, 0.5, 1.0, 2.0][random.below(4)];
    let lattice = random_lattice(&mut random, grid, most);
    if index / 5 % 2 == 1 {
        near_the_limit(&mut random, &lattice)
    } else {
        lattice
    }
}

fn check<const D: usize>(index: usize, lattice: &Lattice<D>, tally: &mut Tally) {
    let judge = Judge::new(lattice, BOXES);
    let verdict = lattice.check(&CheckOptions::default());
    *tally.outcomes.entry(verdict.outcome.name()).or_default() += 1;
    // Witnesses and signs always, bounds of det J less often.
    let checked = if index.is_multiple_of(9) {
        judge.check(&verdict)
    } else {
        judge.check_outcome(&verdict.outcome)
    };
    tally.open += usize::from(checked == Ok(Standing::Open));
    tally.hold(index, checked.is_ok(), || format!("{checked:?}"));
    if matches!(verdict.outcome, Outcome::Undecided(_)) && !judge.signs().open {
        tally.undecided_but_decidable.push(index);
    }

    // What is slow, less often.
    let mut methods = sufficient_methods();
    methods.retain(|&method| method != Method::Phi || index.is_multiple_of(7));
    if index.is_multiple_of(101) {
        methods.push(Method::Paper);
    }
    for method in methods {
        let verdict = lattice.check(&CheckOptions {
            method,
            ..CheckOptions::default()
        });
        if verdict.is_regular() {
            let word = match method {
                Method::Conic(_) => "conic",
                Method::Phi => "phi",
                Method::ChoiLee => "choi_lee",
                _ => "paper",
            };
            *tally.sufficient.entry(word).or_default() += 1;
        }
        let checked = judge.check_outcome(&verdict.outcome);
        tally.hold(index, checked.is_ok(), || {
            format!("{method:?}: {checked:?}")
        });
    }
}

/// One cubic cell in space with an identity border, 343 cells in all, near the limit.
fn bordered(index: usize) -> Lattice<3> {
    let mut random = Random::new(index as u64);
    let grid = Grid::new([Degree::CUBIC; 3], [1; 3], Frame::unit())
        .and_then(|grid| grid.with_border(Border::Identity))
        .expect("a small grid");
    let lattice = random_lattice(&mut random, grid, 1.0);
    near_the_limit(&mut random, &lattice)
}

/// Regular or not, a lattice that overlaps itself is never called injective.
fn check_ring<const D: usize>(index: usize, tally: &mut Tally) {
    let lattice = random_ring::<D>(&mut Random::new(index as u64));
    check(index, &lattice, tally);
    for method in methods().into_iter().filter(|&m| m != Method::Paper) {
        let verdict = lattice.check(&CheckOptions {
            method,
            ..CheckOptions::default()
        });
        tally.hold(index, !verdict.is_injective(), || {
            format!("a ring: {verdict:?}")
        });
        if method == Method::Exact {
            *tally.rings.entry(verdict.outcome.name()).or_default() += 1;
        }
    }
}

/// What touches zero and does not cross it is degenerate, if anything is said.
fn check_touching<const D: usize>(index: usize, tally: &mut Tally) {
    let (lattice, mirrored) = random_touching::<D>(&mut Random::new(index as u64));
    let mut options = CheckOptions::default();
    // Where halving does not meet a zero, any budget would be spent.
    options.budget.exact_boxes = 8;
    options.budget.boxes = 1_000;
    for method in methods().into_iter().filter(|&m| m != Method::Paper) {
        let verdict = lattice.check(&CheckOptions { method, ..options });
        let right = match verdict.outcome {
            Outcome::Undecided(_) => true,
            Outcome::Degenerate { zero, reversed } => {
                let zero = Oracle::new(&lattice).det_at(zero.cell, zero.t);
                zero.is_zero() && reversed == mirrored
            }
            _ => false,
        };
        tally.hold(index, right, || {
            format!("touching, {mirrored}: {verdict:?}")
        });
        if method == Method::Exact {
            *tally.touching.entry(verdict.outcome.name()).or_default() += 1;
        }
    }
}

/// One in five is cubic and in space, two in five are in the plane, two in space with
/// degrees that differ; among these, one in fifty overlaps itself, and one in fifty
/// touches zero.
fn check_number(index: usize, tally: &mut Tally) {
    match index % 5 {
        0 if index % 1000 == 500 => check(index, &bordered(index), tally),
        0 => check(index, &lattice::<3>(index, Some(3), 5), tally),
        1 | 2 if index % 100 == 11 => check_touching::<2>(index, tally),
        1 | 2 if index % 100 == 61 => check_ring::<2>(index, tally),
        1 | 2 => check(index, &lattice::<2>(index, None, 5), tally),
        3 if index % 100 == 13 => check_touching::<3>(index, tally),
        3 if index % 100 == 63 => check_ring::<3>(index, tally),
        3 => check(index, &lattice::<3>(index, None, 3), tally),
        _ => {
            // Degrees 4 and 5 in space cost most.
            let most = if index.is_multiple_of(4) { 5 } else { 3 };
            check(index, &lattice::<3>(index, None, most), tally);
        }
    }
}

fn check_many(count: usize) {
    let mut tally = Tally::default();
    std::thread::scope(|scope| {
        let threads: Vec<_> = (0..2)
            .map(|thread| {
                scope.spawn(move || {
                    let mut tally = Tally::default();
                    for index in (0..count).filter(|i| i / 20 % 2 == thread) {
                        check_number(index, &mut tally);
                    }
                    tally
                })
            })
            .collect();
        for thread in threads {
            match thread.join() {
                Ok(part) => tally.add(part),
                Err(panic) => std::panic::resume_unwind(panic),
            }
        }
    });
    println!("{tally:?}");
    assert_eq!(tally.wrong, Vec::new());
    assert_eq!(tally.undecided_but_decidable, Vec::<usize>::new());
    // An oracle that gives up shows nothing.
    assert!(tally.open * 100 <= count, "{tally:?}");
}

#[test]
fn three_hundred_lattices() {
    check_many(300);
}

/// The long form; `FFD_INJECTIVITY_LATTICES` sets another number. Run with `--release`.
#[test]
#[ignore = "takes minutes, even in release mode"]
fn hundred_thousand_lattices() {
    let count = std::env::var("FFD_INJECTIVITY_LATTICES")
        .ok()
        .map_or(100_000, |n| n.parse().expect("a number of lattices"));
    check_many(count);
}

/// The lattices are what they should be: near the limit, on both sides of it, and decided
/// by the oracle.
#[test]
fn lattices_lie_on_both_sides_of_the_limit() {
    let (mut regular, mut not, mut open) = (0, 0, 0);
    for index in (0..100).filter(|i| i / 5 % 2 == 1) {
        let mut count = |signs: crate::oracle::Signs| {
            open += usize::from(signs.open);
            regular += usize::from(signs.only_positive());
            not += usize::from(signs.negative);
        };
        match index % 5 {
            0 => count(Judge::new(&lattice::<3>(index, Some(3), 5), BOXES).signs()),
            1 | 2 => count(Judge::new(&lattice::<2>(index, None, 5), BOXES).signs()),
            _ => count(Judge::new(&lattice::<3>(index, None, 3), BOXES).signs()),
        }
    }
    assert!(
        regular >= 15 && not >= 15 && open == 0,
        "{regular} {not} {open}"
    );
}
