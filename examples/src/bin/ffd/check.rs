//! `ffd check`: whether lattices fold.

use std::{io, path::Path, time::Instant};

use clap::ValueEnum as _;
use examples::{
    command::{print_error, print_line},
    output::write_new_file,
};
use ffd_core::{
    CheckOptions, ConicHull, Evidence, Lattice, Method, Outcome, Place, Sequence, Undecided,
};
use serde::Serialize;
use serde_json::{Value, json};

use crate::{
    Answer, Error,
    cli::{Check, MethodChoice},
    files::{self, AnySequence},
};

pub(crate) fn run(arguments: &Check) -> Result<Answer, Error> {
    let options = CheckOptions {
        method: arguments.method.into(),
        enclose: arguments.enclose,
        all_cells: arguments.all_cells,
        ..CheckOptions::default()
    };
    for (name, given) in [
        ("--enclose", arguments.enclose.is_some()),
        ("--all-cells", arguments.all_cells),
    ] {
        if given && options.method != Method::Exact {
            return Err(format!("{name}: only the exact method can tell").into());
        }
    }
    let output = arguments.certificate.as_deref();
    if let Some(output) = output {
        let [lattice] = arguments.lattices.as_slice() else {
            return Err("--certificate: only one lattice file can be certified at a time".into());
        };
        files::check_output(output, arguments.force, &[lattice])?;
    }
    let mut notes = Vec::new();
    let mut complete = true;
    for path in &arguments.lattices {
        let somebody_reads = match files::read_any_sequence(path) {
            Ok(AnySequence::Plane(sequence)) => {
                notes.extend(certify(&sequence, arguments, &options)?);
                check(&sequence, path, arguments.method, &options)?
            }
            Ok(AnySequence::Space(sequence)) => {
                notes.extend(certify(&sequence, arguments, &options)?);
                check(&sequence, path, arguments.method, &options)?
            }
            Err(error) => {
                print_error(&error);
                complete = false;
                true
            }
        };
        if !somebody_reads {
            break;
        }
    }
    Ok(Answer::printed(complete).with_notes(notes))
}

/// Writes the certificates of all lattices, if that is asked for. Returns why that cannot be
/// done, and where they claim less than the verdicts.
fn certify<const D: usize>(
    sequence: &Sequence<D>,
    arguments: &Check,
    options: &CheckOptions,
) -> Result<Vec<String>, Error> {
    let Some(output) = arguments.certificate.as_deref() else {
        return Ok(Vec::new());
    };
    let mut notes = Vec::new();
    let mut certificates = Vec::new();
    for (index, lattice) in sequence.lattices().iter().enumerate() {
        let certified = lattice.certify(options);
        let verdict = certified.verdict.outcome.name();
        match certified.certificate {
            Ok(certificate) => {
                let claim = certificate.claim().name();
                if claim != verdict {
                    notes.push(format!(
                        "lattice {index} is {verdict}, but certified {claim}"
                    ));
                }
                certificates.push(certificate);
            }
            Err(error) => {
                return Ok(vec![format!(
                    "no certificate is written, as lattice {index} has none: {error}"
                )]);
            }
        }
    }
    let bytes = match certificates.as_slice() {
        [certificate] => serde_json::to_vec(certificate)?,
        all => serde_json::to_vec(&json!({ "certificates": all }))?,
    };
    write_new_file(output, &bytes, arguments.force)?;
    Ok(notes)
}

/// Judges the lattices of a file, one by one. Returns whether anybody still reads.
fn check<const D: usize>(
    sequence: &Sequence<D>,
    path: &Path,
    method: MethodChoice,
    options: &CheckOptions,
) -> io::Result<bool> {
    let file = path.display().to_string();
    let method = method.to_possible_value();
    let method = method.as_ref().map_or("", |value| value.get_name());
    for (index, lattice) in sequence.lattices().iter().enumerate() {
        let start = Instant::now();
        let verdict = lattice.check(options);
        let micros = start.elapsed().as_secs_f64() * 1e6;
        let line = Line {
            file: &file,
            verdict: verdict.outcome.name(),
            theorem: verdict.theorem().map(|theorem| theorem.name()),
            min_det: verdict.min_det,
            witness: witness(&verdict.outcome),
            conic: passes_conic_test(lattice),
            // Nanoseconds are all that the clock tells.
            micros: (micros * 1e3).round() / 1e3,
            index,
            method,
            evidence: evidence(&verdict.outcome),
            irregular_cells: options.all_cells.then(|| cells(&verdict.irregular_cells)),
            doubtful_cells: options.all_cells.then(|| cells(&verdict.doubtful_cells)),
        };
        if !print_line(&line)? {
            return Ok(false);
        }
    }
    Ok(true)
}

/// What is said of a lattice. Numbers that are not finite are written as null.
#[derive(Serialize)]
struct Line<'a> {
    file: &'a str,
    verdict: &'static str,
    theorem: Option<&'static str>,
    min_det: [f64; 2],
    witness: Option<Vec<Vec<f64>>>,
    conic: bool,
    micros: f64,
    index: usize,
    method: &'a str,
    evidence: Option<Value>,
    #[serde(skip_serializing_if = "Option::is_none")]
    irregular_cells: Option<Vec<Vec<usize>>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    doubtful_cells: Option<Vec<Vec<usize>>>,
}

fn passes_conic_test<const D: usize>(lattice: &Lattice<D>) -> bool {
    let conic = CheckOptions {
        method: Method::Conic(ConicHull::default()),
        global: false,
        ..CheckOptions::default()
    };
    lattice.check(&conic).is_regular()
}

/// World points that show why a map is not a diffeomorphism.
fn witness<const D: usize>(outcome: &Outcome<D>) -> Option<Vec<Vec<f64>>> {
    let places = match outcome {
        Outcome::NotInjective(Evidence::BothSigns { positive, negative }) => {
            vec![positive, negative]
        }
        Outcome::NotInjective(Evidence::Overlap { point, other, .. }) => vec![point, other],
        Outcome::Degenerate { zero, .. } => vec![zero],
        _ => return None,
    };
    Some(places.iter().map(|place| place.world.to_vec()).collect())
}

/// The same as exactly as it is known, and what is in doubt where nothing was proven.
fn evidence<const D: usize>(outcome: &Outcome<D>) -> Option<Value> {
    let place = |place: &Place<D>| json!({ "cell": place.cell[..], "t": place.t[..] });
    Some(match outcome {
        Outcome::NotInjective(Evidence::BothSigns { positive, negative }) => json!({
            "kind": "both_signs",
            "positive": place(positive),
            "negative": place(negative),
        }),
        Outcome::NotInjective(Evidence::Overlap {
            point,
            other,
            radius,
        }) => json!({
            "kind": "overlap",
            "point": place(point),
            "other": place(other),
            "radius": radius,
        }),
        Outcome::Degenerate { zero, reversed } => json!({
            "kind": "zero",
            "zero": place(zero),
            "reversed": reversed,
        }),
        Outcome::Undecided(Undecided {
            cell, part, det, ..
        }) => json!({
            "kind": "doubt",
            "cell": cell[..],
            "part": part[..],
            "det": det,
        }),
        _ => return None,
    })
}

fn cells<const D: usize>(cells: &[[usize; D]]) -> Vec<Vec<usize>> {
    cells.iter().map(|cell| cell.to_vec()).collect()
}
