//! `ffd step`: how far lattices can go before they fold.

use examples::command::Answer;
use ffd_core::{Sequence, StepOptions};
use serde_json::json;

use crate::{
    Error,
    cli::Step,
    files::{self, AnySequence},
};

pub(crate) fn run(arguments: &Step) -> Result<Answer, Error> {
    let [from, to] = [&arguments.from, &arguments.to];
    let options = StepOptions {
        width: arguments.width,
        ..StepOptions::default()
    };
    let t = match (
        files::read_any_sequence(from)?,
        files::read_any_sequence(to)?,
    ) {
        (AnySequence::Plane(from), AnySequence::Plane(to)) => step(&from, &to, &options),
        (AnySequence::Space(from), AnySequence::Space(to)) => step(&from, &to, &options),
        _ => Err("one deforms the plane, and the other space".into()),
    };
    let t = t.map_err(|error| format!("{}, {}: {error}", from.display(), to.display()))?;
    // An infinite end becomes null.
    Ok(Answer::new(&json!({ "t": t }), Vec::new())?)
}

/// The first t at which one of the lattices folds: the earliest of all, at either end.
fn step<const D: usize>(
    from: &Sequence<D>,
    to: &Sequence<D>,
    options: &StepOptions,
) -> Result<[f64; 2], Error> {
    let [from, to] = [from, to].map(Sequence::lattices);
    if from.len() != to.len() {
        let counts = [from.len(), to.len()];
        return Err(format!("sequences of {} and {} lattices", counts[0], counts[1]).into());
    }
    let mut first = [1.0, f64::INFINITY];
    for (index, (from, to)) in from.iter().zip(to).enumerate() {
        let step = from.largest_safe_step(to, options);
        let [low, high] = step.map_err(|error| format!("lattice {index}: {error}"))?.t;
        first = [first[0].min(low), first[1].min(high)];
    }
    Ok(first)
}
