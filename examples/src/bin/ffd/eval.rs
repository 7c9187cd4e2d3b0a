//! `ffd eval`: images, Jacobians and determinants of points.

use std::path::Path;

use examples::command::read;
use ffd_core::Sequence;
use serde_json::json;

use crate::{
    Answer, Error,
    cli::Eval,
    files::{self, AnySequence},
};

pub(crate) fn run(arguments: &Eval) -> Result<Answer, Error> {
    let sequence = files::read_any_sequence(&arguments.lattice)?;
    let points: Vec<Vec<f64>> = files::parse_json(&arguments.points, &read(&arguments.points)?)?;
    match sequence {
        AnySequence::Plane(sequence) => evaluate(&sequence, &points, arguments),
        AnySequence::Space(sequence) => evaluate(&sequence, &points, arguments),
    }
}

fn evaluate<const D: usize>(
    sequence: &Sequence<D>,
    points: &[Vec<f64>],
    arguments: &Eval,
) -> Result<Answer, Error> {
    let mut images = Vec::with_capacity(points.len());
    let mut jacobians = Vec::with_capacity(points.len());
    let mut determinants = Vec::with_capacity(points.len());
    let mut outside = 0;
    for (index, point) in points.iter().enumerate() {
        let point = <[f64; D]>::try_from(point.as_slice()).map_err(|_| {
            let found = point.len();
            at_point(
                &arguments.points,
                index,
                &format!("{D} coordinates are needed, there are {found}"),
            )
        })?;
        let there = sequence.evaluate(point).filter(|there| {
            let entries = there.jacobian.as_flattened().iter();
            there.determinant.is_finite() && entries.chain(&there.position).all(|c| c.is_finite())
        });
        // JSON has no word for infinity.
        let there = there.ok_or_else(|| {
            at_point(
                &arguments.points,
                index,
                "its image or Jacobian is too large for a number",
            )
        })?;
        outside += usize::from(!is_deformed(sequence, point));
        images.push(there.position.to_vec());
        jacobians.push(there.jacobian.as_flattened().to_vec());
        determinants.push(there.determinant);
    }
    let mut notes = Vec::new();
    if outside > 0 {
        let of = points.len();
        notes.push(format!(
            "{outside} of {of} points lie outside: they stay where they are"
        ));
    }
    Ok(Answer {
        json: json!({ "points": images, "jacobians": jacobians, "det": determinants }),
        notes,
    })
}

/// Whether a point comes into the domain of any lattice.
fn is_deformed<const D: usize>(sequence: &Sequence<D>, mut point: [f64; D]) -> bool {
    sequence.lattices().iter().any(|lattice| {
        let inside = lattice.grid().contains(point);
        point = lattice.deform_point(point);
        inside
    })
}

fn at_point(path: &Path, index: usize, message: &str) -> String {
    format!("{}: point {index}: {message}", path.display())
}
