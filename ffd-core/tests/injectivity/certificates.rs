//! Certificates prove their verdicts, and nothing else.

use crate::families::{
    Random, near_the_limit, random_grid, random_lattice, random_ring, random_touching,
};
use crate::oracle::{Oracle, exact};
use dashu_ratio::RBig;
use ffd_core::{
    Border, Certificate, CertificateError, Certified, CheckOptions, Claim, ConicHull, Degree,
    Frame, Grid, Knots, Lattice, Method, Outcome, Proven, Theorem, Uncertified,
};
use std::collections::BTreeMap;

/// Certifies a lattice and checks the certificate: what was proven, `None` if there is no
/// certificate.
fn survives<const D: usize>(lattice: &Lattice<D>, options: &CheckOptions) -> Option<Proven> {
    let certified = lattice.certify(options);
    let verdict = &certified.verdict;
    let undecided = matches!(verdict.outcome, Outcome::Undecided(_));
    let certificate = match &certified.certificate {
        Ok(certificate) => certificate,
        Err(Uncertified::Undecided) => {
            assert!(undecided, "{verdict:?}");
            return None;
        }
        Err(error) => {
            assert!(!undecided, "{verdict:?}");
            println!("{error}: {}", verdict.outcome.name());
            return None;
        }
    };
    let proven = certificate
        .verify(lattice)
        .unwrap_or_else(|error| panic!("{error}: {certificate:?} for {verdict:?}"));
    assert_eq!(proven.claim, certificate.claim());
    if let Some(min_det) = proven.min_det {
        assert!(
            0.0 <= min_det && min_det <= verdict.min_det[1],
            "{proven:?}"
        );
    }
    match verdict.outcome {
        Outcome::Injective(Theorem::InjectiveBoundary) => {
            assert_eq!(proven.claim, Claim::LocallyInjective);
        }
        Outcome::Injective(theorem) => {
            if proven.claim == Claim::Injective {
                let name = match theorem.name() {
                    "displacement_bound" => "dominant_rows",
                    name => name,
                };
                let found = proven.theorem.unwrap();
                let kin = name == "common_cones" && ["p_matrix", "monotone"].contains(&found);
                assert!(found == name || kin, "{found} {name}");
            } else {
                assert_eq!(proven.claim, Claim::LocallyInjective);
                println!("no theorem in place of {theorem:?}");
            }
        }
        _ => assert_eq!(proven.claim.name(), verdict.outcome.name()),
    }
    #[cfg(feature = "serde")]
    {
        let text = serde_json::to_string(certificate).unwrap();
        let again: Certificate<D> = serde_json::from_str(&text).unwrap();
        assert_eq!(&again, certificate);
    }
    Some(proven)
}

/// Counts what was proven of many lattices.
#[derive(Default)]
struct Tally(BTreeMap<(&'static str, &'static str), usize>);

impl Tally {
    fn add(&mut self, proven: Option<Proven>) {
        let key = proven.map_or(("none", ""), |p| (p.claim.name(), p.theorem.unwrap_or("")));
        *self.0.entry(key).or_default() += 1;
    }

    fn count(&self, claim: &str, theorem: &str) -> usize {
        let found = self
            .0
            .iter()
            .find(|((c, t), _)| (*c, *t) == (claim, theorem));
        found.map_or(0, |(_, &count)| count)
    }
}

fn random_degrees<const D: usize>(random: &mut Random) -> [usize; D] {
    let most = if D == 2 { 5 } else { 3 };
    [0; D].map(|_| 1 + random.below(most))
}

fn random_lattices<const D: usize>(seed: u64, count: usize) -> Tally {
    let mut random = Random::new(seed);
    let mut tally = Tally::default();
    for number in 0..count {
        let degree = random_degrees(&mut random);
        let grid = random_grid::<D>(&mut random, degree, 2);
        let most = [0.1, 0.4, 0.8, 1.5][random.below(4)];
        let mut lattice = random_lattice(&mut random, grid, most);
        if number % 3 == 0 {
            lattice = near_the_limit(&mut random, &lattice);
        }
        tally.add(survives(&lattice, &CheckOptions::default()));
    }
    println!("{:?}", tally.0);
    tally
}

#[test]
fn random_lattices_in_the_plane() {
    let tally = random_lattices::<2>(1, 120);
    assert!(tally.count("injective", "p_matrix") > 10);
    assert!(tally.count("not_injective", "") > 10);
    assert!(tally.count("injective", "identity_border") > 2);
    assert!(tally.count("none", "") < 3);
}

#[test]
fn random_lattices_in_space() {
    let tally = random_lattices::<3>(2, 30);
    assert!(tally.count("injective", "p_matrix") > 0);
    assert!(tally.count("injective", "monotone") > 2);
    assert!(tally.count("not_injective", "") > 3);
    assert!(tally.count("none", "") < 3);
}

#[test]
fn rings_that_overlap() {
    let mut random = Random::new(3);
    let mut tally = Tally::default();
    for _ in 0..6 {
        tally.add(survives(
            &random_ring::<2>(&mut random),
            &CheckOptions::default(),
        ));
    }
    for _ in 0..3 {
        tally.add(survives(
            &random_ring::<3>(&mut random),
            &CheckOptions::default(),
        ));
    }
    println!("{:?}", tally.0);
    assert!(tally.count("not_injective", "") > 5);
}

#[test]
fn determinants_that_touch_zero() {
    let mut random = Random::new(4);
    let mut tally = Tally::default();
    for _ in 0..12 {
        tally.add(survives(
            &random_touching::<2>(&mut random).0,
            &CheckOptions::default(),
        ));
    }
    for _ in 0..2 {
        tally.add(survives(
            &random_touching::<3>(&mut random).0,
            &CheckOptions::default(),
        ));
    }
    println!("{:?}", tally.0);
    assert!(tally.count("degenerate", "") > 4);
}

fn certificate<const D: usize>(lattice: &Lattice<D>, options: &CheckOptions) -> Certificate<D> {
    lattice.certify(options).certificate.expect("certified")
}

fn grid<const D: usize>(degree: [usize; D], cells: [usize; D]) -> Grid<D> {
    let degree = degree.map(|n| Degree::new(n).unwrap());
    Grid::new(degree, cells, Frame::unit()).unwrap()
}

/// A lattice with control points off by up to `most` cells, in a skewed frame that is mirrored.
fn skewed<const D: usize>(degree: [usize; D], most: f64, seed: u64) -> Lattice<D> {
    let mut axes = [[0.0; D]; D];
    for (a, axis) in axes.iter_mut().enumerate() {
        axis[(a + 1) % D] = 1.25;
        axis[a] = 0.5;
    }
    axes.swap(0, 1);
    let degree = degree.map(|n| Degree::new(n).unwrap());
    let frame = Frame::new([0.5; D], axes).unwrap();
    let grid = Grid::new(degree, [2; D], frame).unwrap();
    random_lattice(&mut Random::new(seed), grid, most)
}

/// All control points mirrored along the first axis.
fn reversed<const D: usize>(grid: Grid<D>) -> Lattice<D> {
    let displacements = (0..grid.control_point_count())
        .map(|i| {
            let x = grid.rest_position(i)[0];
            std::array::from_fn(|c| if c == 0 { -2.0 * x } else { 0.0 })
        })
        .collect();
    Lattice::new(grid, displacements).unwrap()
}

/// A lattice that is found to be degenerate.
fn touching() -> Lattice<2> {
    let mut random = Random::new(4);
    loop {
        let (lattice, _) = random_touching::<2>(&mut random);
        let verdict = lattice.check(&CheckOptions::default());
        if matches!(verdict.outcome, Outcome::Degenerate { .. }) {
            return lattice;
        }
    }
}

/// Lattices, and how they are tested.
type Samples<const D: usize> = Vec<(Lattice<D>, CheckOptions)>;

/// One lattice for every claim and theorem, with the options under which it gets it.
fn samples() -> (Samples<2>, Samples<3>) {
    let plain = CheckOptions::default();
    let method = |method| CheckOptions { method, ..plain };
    let cones = method(Method::Conic(ConicHull {
        one_for_all: true,
        off_axis: true,
        ..ConicHull::default()
    }));
    let mut random = Random::new(77);
    let mut noise = |grid: Grid<2>, most| random_lattice(&mut random, grid, most);
    let clamped = grid([3, 2], [3, 1])
        .with_knots([Knots::Clamped; 2])
        .unwrap();
    let border = grid([2, 2], [2, 2]).with_border(Border::Identity).unwrap();
    let flat = vec![
        (noise(clamped.clone(), 0.2), plain),
        (noise(grid([1, 2], [3, 2]), 0.2), plain),
        (noise(border, 0.2), plain),
        (noise(clamped, 0.1), cones),
        (noise(grid([3, 3], [2, 2]), 0.3), method(Method::ChoiLee)),
        (noise(grid([3, 3], [2, 2]), 2.0), plain),
        (reversed(grid([2, 3], [2, 2])), plain),
        (touching(), plain),
        (random_ring::<2>(&mut Random::new(3)), plain),
        (skewed([3, 3], 0.3, 5), plain),
    ];
    let solid = vec![
        (skewed([3, 2, 1], 0.2, 1), plain),
        (skewed([2, 2, 2], 0.25, 2), plain),
        (skewed([1, 1, 1], 0.1, 3), method(Method::ChoiLee)),
        (reversed(grid([1, 2, 2], [1, 2, 1])), plain),
        (skewed([2, 2, 2], 2.0, 4), plain),
    ];
    (flat, solid)
}

#[test]
fn every_claim_has_a_certificate() {
    let (flat, solid) = samples();
    let mut tally = Tally::default();
    for (lattice, options) in &flat {
        tally.add(survives(lattice, options));
    }
    for (lattice, options) in &solid {
        tally.add(survives(lattice, options));
    }
    println!("{:?}", tally.0);
    for theorem in [
        "identity_border",
        "p_matrix",
        "monotone",
        "dominant_rows",
        "common_cones",
    ] {
        assert!(tally.count("injective", theorem) > 0, "{theorem}");
    }
    for claim in ["not_injective", "reversed", "degenerate"] {
        assert!(tally.count(claim, "") > 0, "{claim}");
    }
}

#[test]
fn a_certificate_belongs_to_its_lattice() {
    let (flat, _) = samples();
    let all: Vec<_> = flat
        .iter()
        .map(|(l, options)| certificate(l, options))
        .collect();
    for (i, certificate) in all.iter().enumerate() {
        for (j, (lattice, _)) in flat.iter().enumerate() {
            let found = certificate.verify(lattice);
            if i == j {
                assert!(found.is_ok());
            } else if lattice.grid().degree() != flat[i].0.grid().degree() {
                assert!(matches!(found, Err(CertificateError::Shape { .. })));
            }
        }
    }
    // A lattice that folds, and the certificate of one on the same grid that does not.
    let (good, options) = &flat[9];
    let folded = skewed([3, 3], 2.0, 6);
    assert!(matches!(
        certificate(good, options).verify(&folded),
        Err(CertificateError::Cell { .. })
    ));
}

/// The bound of the determinant is true, and as good as was asked for.
#[test]
fn bounds_of_the_determinant() {
    for seed in 0..6 {
        let lattice = skewed([3, 2], 0.3, seed);
        let enclose = CheckOptions {
            enclose: Some(1e-4),
            ..CheckOptions::default()
        };
        let verdict = lattice.check(&enclose);
        if !verdict.is_regular() {
            continue;
        }
        let [loose, tight] = [CheckOptions::default(), enclose].map(|options| {
            certificate(&lattice, &options)
                .verify(&lattice)
                .unwrap()
                .min_det
        });
        let [low, high] = verdict.min_det;
        assert!(loose <= tight && tight <= Some(high) && tight >= Some(low - 1e-4));
    }
}

#[cfg(feature = "serde")]
mod mutations {
    use super::*;
    use serde_json::{Value, json};

    fn to_value<const D: usize>(certificate: &Certificate<D>) -> Value {
        serde_json::to_value(certificate).unwrap()
    }

    /// What is left of a certificate after a change: not read, rejected, or proven.
    fn after<const D: usize>(
        lattice: &Lattice<D>,
        certificate: &Certificate<D>,
        change: impl FnOnce(&mut Value),
    ) -> Option<Proven> {
        let mut value = to_value(certificate);
        let before = value.clone();
        change(&mut value);
        assert_ne!(before, value, "nothing was changed");
        let certificate: Certificate<D> = serde_json::from_value(value).ok()?;
        certificate.verify(lattice).ok()
    }

    fn set(key: &'static str, to: Value) -> impl FnOnce(&mut Value) {
        move |value| *value.pointer_mut(key).unwrap() = to
    }

    /// Changes that no certificate survives.
    fn never_valid<const D: usize>(lattice: &Lattice<D>, options: &CheckOptions) {
        let certificate = certificate(lattice, options);
        let value = to_value(&certificate);
        let rejected = |what: &str, change: &dyn Fn(&mut Value)| {
            let found = after(lattice, &certificate, |value| change(value));
            assert_eq!(found, None, "{what} of {value}");
        };
        for claim in [
            "injective",
            "locally_injective",
            "not_injective",
            "degenerate",
            "reversed",
        ] {
            if value["claim"] != claim {
                rejected("claim", &|v| v["claim"] = json!(claim));
            }
        }
        for (key, value) in value.as_object().unwrap() {
            rejected(key, &|v| drop(v.as_object_mut().unwrap().remove(key)));
            if value.is_string() || value.is_array() {
                rejected(key, &|v| v[key] = json!(7));
            }
        }
        rejected("a field more", &|v| v["more"] = json!(1));
        rejected("cells", &|v| {
            v["cells"][0] = json!(v["cells"][0].as_u64().unwrap() + 1)
        });
        rejected("degree", &|v| v["degree"][1] = json!(5));
        rejected("dimension", &|v| {
            v["degree"].as_array_mut().unwrap().push(json!(3))
        });
        // Trees: dropped, truncated, more of them.
        for key in ["/cuts", "/theorem/cuts", "/theorem/cuts/0"] {
            let Some(cuts) = value.pointer(key).and_then(Value::as_str) else {
                continue;
            };
            let leaf = cuts.find('.').unwrap();
            let without = format!("{}{}", &cuts[..leaf], &cuts[leaf + 1..]);
            for other in [
                without,
                cuts[..cuts.len() - 1].to_owned(),
                format!("{cuts}."),
                format!(".{cuts}"),
                String::new(),
                cuts.replace('.', "q"),
                format!("18446744073709551615{cuts}"),
                format!("{}{cuts}", "x".repeat(100_000)),
            ] {
                rejected("cuts", &|v| *v.pointer_mut(key).unwrap() = json!(other));
            }
        }
        if let Some(bound) = value["min_det"].as_f64() {
            // Above what is attained somewhere.
            let [_, high] = lattice.check(&CheckOptions::default()).min_det;
            for other in [high.max(bound).next_up() + 1e-9, -1.0, -1e-300, 1e300] {
                rejected("min_det", &|v| v["min_det"] = json!(other));
            }
            rejected("min_det", &|v| v["min_det"] = Value::Null);
        }
        if let Some(matrix) = value.pointer("/theorem/after") {
            let zero = vec![vec![0; D]; D];
            rejected("C", &|v| v["theorem"]["after"] = json!(zero));
            let mut negative = matrix.clone();
            for row in negative.as_array_mut().unwrap() {
                for x in row.as_array_mut().unwrap() {
                    *x = json!(-x.as_f64().unwrap());
                }
            }
            rejected("C", &|v| v["theorem"]["after"] = negative.clone());
            rejected("C", &|v| v["theorem"]["after"][0][0] = json!("NaN"));
            rejected("C", &|v| {
                drop(v["theorem"]["after"][0].as_array_mut().unwrap().pop())
            });
        }
        if value.pointer("/theorem/sines").is_some() {
            rejected("a cone", &|v| v["theorem"]["sines"][0] = json!(1e-9));
            rejected("a cone", &|v| v["theorem"]["sines"][0] = json!(1.0));
            rejected("a cone", &|v| v["theorem"]["sines"][0] = json!(-0.5));
            rejected("a cone", &|v| v["theorem"]["axes"][0][0] = json!(-1.0));
        }
        for place in ["positive", "negative", "zero", "point", "other"] {
            if value["evidence"][place].is_null() {
                continue;
            }
            for (key, other) in [("t", json!(1.5)), ("t", json!(-1e-9)), ("cell", json!(99))] {
                rejected(place, &|v| v["evidence"][place][key][0] = other.clone());
            }
        }
        if value["evidence"]["kind"] == "both_signs" {
            rejected("signs", &|v| {
                let positive = v["evidence"]["positive"].take();
                v["evidence"]["positive"] = v["evidence"]["negative"].take();
                v["evidence"]["negative"] = positive;
            });
        }
        if value["evidence"]["kind"] == "overlap" {
            for radius in [0.0, -1e-9, 1e-30, 0.9] {
                rejected("radius", &|v| v["evidence"]["radius"] = json!(radius));
            }
            rejected("point", &|v| {
                v["evidence"]["point"] = v["evidence"]["other"].clone()
            });
            rejected("other", &|v| {
                let t = v["evidence"]["other"]["t"][0].as_f64().unwrap();
                v["evidence"]["other"]["t"][0] = json!(if t < 0.5 { t + 0.25 } else { t - 0.25 });
            });
        }
        if value["evidence"]["kind"] == "zero" {
            rejected("zero", &|v| {
                let t = v["evidence"]["zero"]["t"][0].as_f64().unwrap();
                v["evidence"]["zero"]["t"][0] = json!(if t < 0.5 { t + 0.3 } else { t - 0.3 });
                let t = v["evidence"]["zero"]["t"][1].as_f64().unwrap();
                v["evidence"]["zero"]["t"][1] = json!(if t < 0.5 { t + 0.21 } else { t - 0.21 });
            });
            rejected("reversed", &|v| {
                let reversed = v["evidence"]["reversed"].as_bool().unwrap();
                v["evidence"]["reversed"] = json!(!reversed);
            });
        }
    }

    #[test]
    fn are_rejected() {
        let (flat, solid) = samples();
        for (lattice, options) in &flat {
            never_valid(lattice, options);
        }
        for (lattice, options) in &solid {
            never_valid(lattice, options);
        }
    }

    #[test]
    fn theorems_do_not_apply_elsewhere() {
        let (flat, _) = samples();
        for (lattice, options) in &flat[..5] {
            let certificate = certificate(lattice, options);
            let after = |to: Value| after(lattice, &certificate, set("/theorem", to));
            let name = to_value(&certificate)["theorem"]["name"].clone();
            if name != "identity_border" {
                assert_eq!(after(json!({"name": "identity_border"})), None);
            }
            assert_eq!(after(json!({"name": "injective_boundary"})), None);
            let none = json!({"name": "p_matrix", "after": [[1, 0], [0, 1]], "cuts": []});
            assert_eq!(after(none), None);
        }
        // J jumps along an axis of degree 1.
        let (creased, options) = &flat[1];
        let creased_certificate = certificate(creased, options);
        let cuts = to_value(&creased_certificate)["theorem"]["cuts"].clone();
        let p_matrix = json!({"name": "p_matrix", "after": [[1, 0], [0, 1]], "cuts": [cuts, cuts]});
        assert_eq!(
            after(creased, &creased_certificate, set("/theorem", p_matrix)),
            None
        );
    }

    /// Bytes of a certificate for another lattice on the grid of a folded one, changed at
    /// random: never a proof that it does not fold.
    #[test]
    fn no_bytes_prove_what_is_false() {
        let mut random = Random::new(9);
        let good = [skewed([2, 3], 0.2, 1), skewed([2, 3], 0.3, 2)];
        let folded = skewed([2, 3], 1.5, 3);
        assert!(!folded.check(&CheckOptions::default()).is_regular());
        let mut read = 0;
        for lattice in &good {
            let text = serde_json::to_string(&certificate(lattice, &CheckOptions::default()));
            let text = text.unwrap().into_bytes();
            for _ in 0..3000 {
                let mut bytes = text.clone();
                for _ in 0..1 + random.below(3) {
                    let at = random.below(bytes.len());
                    match random.below(3) {
                        0 => drop(bytes.remove(at)),
                        1 => bytes[at] = b" .xyz0123456789-e,\"[]{}"[random.below(23)],
                        _ => bytes.insert(at, b".xyz0123456789"[random.below(14)]),
                    }
                }
                let Ok(certificate) = serde_json::from_slice::<Certificate<2>>(&bytes) else {
                    continue;
                };
                read += 1;
                if let Ok(proven) = certificate.verify(&folded) {
                    panic!("{proven:?} by {}", String::from_utf8_lossy(&bytes));
                }
                // And for the lattice itself a bound that is changed must be true.
                if let Ok(proven) = certificate.verify(lattice) {
                    let high = lattice.check(&CheckOptions::default()).min_det[1];
                    assert!(proven.min_det <= Some(high), "{proven:?}");
                }
            }
        }
        assert!(read > 200, "{read}");
    }
}

/// The bound a certificate is checked for, against values of the oracle at the same places.
#[test]
fn bounds_hold_at_points_of_the_oracle() {
    let mut random = Random::new(12);
    for seed in 0..4 {
        let lattice = skewed([3, 1 + seed as usize % 3, 2], 0.2, seed);
        let certified: Certified<3> = lattice.certify(&CheckOptions::default());
        let Some(bound) = certified
            .certificate
            .ok()
            .and_then(|c| c.verify(&lattice).unwrap().min_det)
        else {
            continue;
        };
        let oracle = Oracle::new(&lattice);
        for cell in oracle.all_cells() {
            let t = [0; 3].map(|_| random.below(1025) as f64 / 1024.0);
            let value: RBig = oracle.det_at(cell, t);
            assert!(value >= exact(bound));
        }
    }
}

#[test]
fn what_is_undecided_has_no_certificate() {
    let lattice = skewed([3, 3], 0.3, 5);
    let huge: Vec<[f64; 2]> = lattice
        .displacements()
        .iter()
        .map(|d| d.map(|x| x * 1e300))
        .collect();
    let lattice = Lattice::new(lattice.grid().clone(), huge).unwrap();
    let mut options = CheckOptions::default();
    options.budget.exact_boxes = 0;
    let certified = lattice.certify(&options);
    assert_eq!(certified.verdict.outcome.name(), "undecided");
    assert_eq!(certified.certificate, Err(Uncertified::Undecided));
}
