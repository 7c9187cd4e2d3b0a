//! `ffd pull`: dragging points of a mesh.

use std::path::Path;

use examples::output::write_new_files;
use ffd_core::{
    Border, Constraint, Degree, DirectError, Frame, Grid, InjectiveOptions, Lattice, Merged,
    Outside, PullOptions, Sequence, StepPolicy,
};
use serde_json::json;

use crate::{
    Answer, Error,
    cli::{PolicyChoice, Pull},
    deform, files,
};

/// How much longer the box is than the mesh, on each side.
const MARGIN: f64 = 0.05;

/// Length of the shortest side of the box, as part of the longest.
const THINNEST: f64 = 0.1;

pub(crate) fn run(arguments: &Pull) -> Result<Answer, Error> {
    let Pull {
        mesh: path,
        at,
        by,
        cells,
        injective,
        output,
        save_lattice,
    } = arguments;
    if at.len() != by.len() {
        return Err(format!(
            "--at and --by come in pairs: there are {} of the first and {} of the second",
            at.len(),
            by.len()
        )
        .into());
    }
    files::check_output(&output.path, output.force, &[path])?;
    files::check_format(&output.path)?;
    if let Some(lattice) = save_lattice {
        files::check_output(lattice, output.force, &[path])?;
        files::check_distinct(&output.path, lattice)?;
    }
    let mut mesh = files::read_mesh(path)?;

    let [min, max] = box_around(mesh.positions());
    for point in at {
        if !(0..3).all(|c| (min[c]..=max[c]).contains(&point[c])) {
            return Err(format!(
                "--at {}: this is outside the box of {}, from {} to {}",
                triple(*point),
                path.display(),
                triple(min),
                triple(max)
            )
            .into());
        }
    }
    let at_mesh = |error| format!("{}: {error}", path.display());
    let grid = Frame::of_box(min, max, *cells)
        .and_then(|frame| Grid::new([Degree::CUBIC; 3], *cells, frame))
        .and_then(|grid| grid.with_border(Border::Identity))
        .map_err(at_mesh)?;
    let pairs = at.iter().zip(by);
    let constraints: Vec<_> = pairs.map(|(&at, &by)| Constraint::new(at, by)).collect();
    let pulled = match injective {
        None => at_once(grid, &constraints),
        Some(policy) => in_steps(&grid, &constraints, *policy),
    };
    let pulled = pulled.map_err(|error| describe(&error, path))?;
    if pulled.refused {
        let stopped = pulled.stopped.unwrap_or_default();
        return Ok(Answer::checked(false)
            .with_notes(vec![format!("noninjective: {stopped}; nothing is written")]));
    }

    // Where the map turns space inside out, the mesh is likely to pass through itself.
    let determinants = mesh
        .positions()
        .iter()
        .map(|&x| pulled.sequence.evaluate(x));
    let determinants = determinants.map(|there| there.map_or(1.0, |there| there.determinant));
    let (mut least, mut folded) = (f64::INFINITY, 0);
    for det in determinants {
        least = least.min(det);
        folded += usize::from(det <= 0.0);
    }
    // One lattice as such, several as a sequence.
    let mut json_lattice = match (injective, pulled.sequence.lattices()) {
        (None, [lattice]) => serde_json::to_string(lattice)?,
        _ => serde_json::to_string(&pulled.sequence)?,
    };
    json_lattice.push('\n');
    let deformed = deform::deform(
        &pulled.sequence,
        Outside::Keep,
        mesh.positions(),
        mesh.normals(),
    )
    .map_err(|(_, error)| at_mesh(error))?;
    let vertices = deformed.positions.len();
    mesh.set_positions(deformed.positions);
    mesh.set_normals(deformed.normals);
    let bytes = files::encode(&mesh, &output.path)?;
    let mut written: Vec<(&Path, &[u8])> = vec![(&output.path, &bytes)];
    if let Some(lattice) = save_lattice {
        written.push((lattice, json_lattice.as_bytes()));
    }
    write_new_files(&written, output.force)?;

    let mut notes = Vec::new();
    for merged in pulled.merged {
        let (later, first) = (merged.constraint + 1, merged.into + 1);
        notes.push(format!(
            "--at number {later} is the same point as number {first}"
        ));
    }
    if folded > 0 {
        notes.push(format!(
            "the deformation turns space inside out at {folded} of {vertices} points; --injective \
             does not"
        ));
    }
    notes.extend(files::encoding_notes(&mesh, &output.path));
    let mut summary = json!({
        "vertices": vertices,
        "constraints": constraints.len(),
        "largest_residual": pulled.largest_residual,
        "least_det": least,
    });
    if injective.is_some() {
        summary["steps"] = json!(pulled.sequence.lattices().len());
        summary["achieved"] = json!(pulled.achieved);
    }
    let Some(stopped) = pulled.stopped else {
        return Ok(Answer::new(&summary, notes)?);
    };
    notes.push(format!(
        "the points have gone {:.1} % of their ways: {stopped}",
        100.0 * pulled.achieved
    ));
    Ok(Answer::short(&summary, notes)?)
}

/// What a pull has led to.
struct Pulled {
    sequence: Sequence<3>,
    merged: Vec<Merged>,
    largest_residual: f64,
    achieved: f64,
    /// Why not everything was achieved.
    stopped: Option<String>,
    /// Whether that is no result at all.
    refused: bool,
}

/// With one lattice, whether it folds or not.
fn at_once(grid: Grid<3>, constraints: &[Constraint<3>]) -> Result<Pulled, DirectError> {
    let mut lattice = Lattice::at_rest(grid)?;
    let pull = lattice.pull(constraints, &PullOptions::default())?;
    Ok(Pulled {
        sequence: Sequence::from(lattice),
        merged: pull.merged,
        largest_residual: pull.largest_residual,
        achieved: 1.0,
        stopped: None,
        refused: false,
    })
}

/// With lattices none of which folds.
fn in_steps(
    grid: &Grid<3>,
    constraints: &[Constraint<3>],
    policy: PolicyChoice,
) -> Result<Pulled, DirectError> {
    let options = InjectiveOptions {
        policy: policy.into(),
        ..InjectiveOptions::default()
    };
    let pull = grid.injective_pull(constraints, &options)?;
    let largest_residual = pull.largest_residual();
    Ok(Pulled {
        refused: options.policy == StepPolicy::Paper && pull.stopped.is_some(),
        sequence: pull.sequence,
        merged: pull.merged,
        largest_residual,
        achieved: pull.achieved,
        stopped: pull.stopped.map(|stopped| stopped.to_string()),
    })
}

/// The box of the lattice: that of the points with a margin, never flat.
fn box_around(points: &[[f64; 3]]) -> [[f64; 3]; 2] {
    let bounds = [0, 1, 2].map(|c| {
        let coordinates = points.iter().map(|p| p[c]);
        coordinates.fold([f64::INFINITY, f64::NEG_INFINITY], |[min, max], x| {
            [min.min(x), max.max(x)]
        })
    });
    let lengths = bounds.map(|[min, max]| max - min);
    let longest = lengths.into_iter().fold(0.0, f64::max);
    // A single point has no size.
    let longest = if longest > 0.0 { longest } else { 1.0 };
    let margins = lengths.map(|length| {
        let shortest = THINNEST * longest * (1.0 + 2.0 * MARGIN);
        f64::max(MARGIN * length, (shortest - length) / 2.0)
    });
    [
        [0, 1, 2].map(|c| bounds[c][0] - margins[c]),
        [0, 1, 2].map(|c| bounds[c][1] + margins[c]),
    ]
}

/// Coordinates as the user writes them.
fn triple([x, y, z]: [f64; 3]) -> String {
    format!("{x},{y},{z}")
}

/// What is wrong, with points counted from one as in the notes.
fn describe(error: &DirectError, mesh: &Path) -> String {
    match error {
        DirectError::Inconsistent {
            constraints,
            distance,
        } => {
            let numbers: Vec<_> = constraints.iter().map(|i| (i + 1).to_string()).collect();
            format!(
                "--at numbers {} contradict each other: at best one of them is missed by {distance:e}",
                numbers.join(", ")
            )
        }
        DirectError::Unreachable { constraint, .. } => format!(
            "--at number {}: no control point of the lattice moves it",
            constraint + 1
        ),
        error => format!("{}: {error}", mesh.display()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_has_a_margin_and_room() {
        let [min, max] = box_around(&[[0.0, 0.0, 3.0], [10.0, 20.0, 3.0]]);
        for (a, b) in min.into_iter().zip([-0.5, -1.0, 1.9]) {
            assert!((a - b).abs() < 1e-14, "{min:?}");
        }
        for (a, b) in max.into_iter().zip([10.5, 21.0, 4.1]) {
            assert!((a - b).abs() < 1e-14, "{max:?}");
        }
        let [min, max] = box_around(&[[1.0; 3]]);
        assert!((0..3).all(|c| min[c] < 1.0 && max[c] > 1.0));
    }
}
