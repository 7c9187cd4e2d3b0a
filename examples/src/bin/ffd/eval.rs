//! `ffd eval`: images, Jacobians and determinants of points.

use std::path::Path;

use examples::command::read;
use ffd_core::Sequence;
use serde::{Serialize, Serializer};

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
    let mut table = Table::<D>::default();
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
        table.points.push(Row(there.position));
        table.jacobians.push(Rows(there.jacobian));
        table.det.push(there.determinant);
    }
    let mut notes = Vec::new();
    if outside > 0 {
        let of = points.len();
        notes.push(format!(
            "{outside} of {of} points lie outside: they stay where they are"
        ));
    }
    Ok(Answer::new(&table, notes)?)
}

/// What is printed, one entry for each point.
#[derive(Default, Serialize)]
struct Table<const D: usize> {
    points: Vec<Row<D>>,
    /// Row by row.
    jacobians: Vec<Rows<D>>,
    det: Vec<f64>,
}

/// A list of numbers. (serde does not know arrays of a generic length.)
struct Row<const D: usize>([f64; D]);

impl<const D: usize> Serialize for Row<D> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.0[..].serialize(serializer)
    }
}

/// A matrix as one list of numbers.
struct Rows<const D: usize>([[f64; D]; D]);

impl<const D: usize> Serialize for Rows<D> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.0.as_flattened().serialize(serializer)
    }
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
