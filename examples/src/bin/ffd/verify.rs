//! `ffd verify`: whether certificates prove what they claim.

use examples::command::{print_line, read};
use ffd_core::{Certificate, Sequence};
use serde::Deserialize;
use serde_json::json;

use crate::{
    Answer, Error,
    cli::Verify,
    files::{self, AnySequence},
};

/// Longer certificates are not read: the checker needs some thirty times as much memory.
const MOST_BYTES: usize = 64 << 20;

pub(crate) fn run(arguments: &Verify) -> Result<Answer, Error> {
    match files::read_any_sequence(&arguments.lattice)? {
        AnySequence::Plane(sequence) => verify(&sequence, arguments),
        AnySequence::Space(sequence) => verify(&sequence, arguments),
    }
}

/// As much of a file as tells whether there are several certificates in it.
#[derive(Deserialize)]
struct Outline {
    certificates: Option<serde::de::IgnoredAny>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, bound = "")]
struct Several<const D: usize> {
    certificates: Vec<Certificate<D>>,
}

fn verify<const D: usize>(sequence: &Sequence<D>, arguments: &Verify) -> Result<Answer, Error> {
    let path = &arguments.certificate;
    let bytes = read(path)?;
    if bytes.len() > MOST_BYTES {
        return Err(format!("{}: it has more than {MOST_BYTES} bytes", path.display()).into());
    }
    let outline: Outline = files::parse_json(path, &bytes)?;
    let certificates = if outline.certificates.is_some() {
        files::parse_json::<Several<D>>(path, &bytes)?.certificates
    } else {
        vec![files::parse_json::<Certificate<D>>(path, &bytes)?]
    };
    let lattices = sequence.lattices();
    if certificates.len() != lattices.len() {
        return Err(format!(
            "{}: certificates: {}, lattices: {}",
            path.display(),
            certificates.len(),
            lattices.len()
        )
        .into());
    }
    let mut all_valid = true;
    let mut somebody_reads = true;
    for (index, (certificate, lattice)) in certificates.iter().zip(lattices).enumerate() {
        let proven = certificate.verify(lattice);
        all_valid &= proven.is_ok();
        let reason = proven.as_ref().err().map(ToString::to_string);
        let proven = proven.ok();
        let line = json!({
            "valid": proven.is_some(),
            "claim": certificate.claim().name(),
            "theorem": proven.and_then(|p| p.theorem),
            "min_det": proven.and_then(|p| p.min_det),
            "reason": reason,
            "index": index,
        });
        // The exit code is about all certificates, even if nobody reads on.
        somebody_reads = somebody_reads && print_line(&line)?;
    }
    Ok(Answer::checked(all_valid))
}
