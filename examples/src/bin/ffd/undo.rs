//! `ffd undo`: a deformed mesh back through lattices.

use examples::output::write_new_file;
use ffd_core::{Evaluation, InverseError, Sequence, UndoReport, transform_tangent};
use rayon::prelude::*;
use serde_json::json;

use crate::{Answer, Error, cli::Undo, deform::IDENTITY, files};

pub(crate) fn run(arguments: &Undo) -> Result<Answer, Error> {
    let Undo {
        mesh: path,
        lattice,
        output,
    } = arguments;
    files::check_output(&output.path, output.force, &[path, lattice])?;
    files::check_format(&output.path)?;
    let mut mesh = files::read_mesh(path)?;
    let sequence = files::read_sequence(lattice)?;

    let mut positions = mesh.positions().to_vec();
    let report = undo(&sequence, &mut positions)
        .map_err(|error| format!("{}: {error}", lattice.display()))?;
    let mut stays = vec![false; positions.len()];
    for &index in report.not_in_image.iter().chain(&report.unresolved) {
        stays[index] = true;
    }
    let normals = mesh.normals().iter().map(|n| {
        let vertex = n.vertex as usize;
        // The image of a finite point that was found from its image is finite.
        match sequence.evaluate(positions[vertex]) {
            Some(there) if !stays[vertex] => normal_before(&there, n.normal),
            _ => n.normal,
        }
    });
    mesh.set_normals(normals.collect());
    let vertices = positions.len();
    mesh.set_positions(positions);
    let bytes = files::encode(&mesh, &output.path)?;
    write_new_file(&output.path, &bytes, output.force)?;

    let two = report.two_preimages.len();
    let none = report.not_in_image.len();
    let unresolved = report.unresolved.len();
    let of = |count| format!("{count} of {vertices} points");
    let mut notes = Vec::new();
    if two > 0 {
        notes.push(format!(
            "{} may also have been outside the lattice all the time; taken as deformed",
            of(two)
        ));
    }
    if none > 0 {
        notes.push(format!(
            "{} are not in the image of the deformation and stay where they are",
            of(none)
        ));
    }
    if unresolved > 0 {
        notes.push(format!(
            "{} stay where they are: the deformation folds there, and no origin was found",
            of(unresolved)
        ));
    }
    notes.extend(files::encoding_notes(&mesh, &output.path));
    let summary = json!({
        "vertices": vertices,
        "two_preimages": two,
        "not_in_image": none,
        "unresolved": unresolved,
    });
    Ok(Answer::new(&summary, notes)?)
}

/// [`Sequence::undo_points`] on all threads.
fn undo(sequence: &Sequence<3>, positions: &mut [[f64; 3]]) -> Result<UndoReport, InverseError> {
    // Several parts for each thread, as some points take longer than others; not too
    // many, as each part looks at all control points first.
    let parts = 4 * rayon::current_num_threads();
    let length = positions.len().div_ceil(parts).max(1024);
    let reports: Vec<_> = positions
        .par_chunks_mut(length)
        .map(|part| sequence.undo_points(part))
        .collect();
    let mut whole = UndoReport::default();
    for (number, report) in reports.into_iter().enumerate() {
        let mut report = report?;
        for (all, part) in [
            (&mut whole.two_preimages, &mut report.two_preimages),
            (&mut whole.not_in_image, &mut report.not_in_image),
            (&mut whole.unresolved, &mut report.unresolved),
        ] {
            all.extend(part.iter().map(|index| number * length + index));
        }
    }
    Ok(whole)
}

/// The normal that the deformation has turned into the given one.
///
/// Normals follow the cofactors of the Jacobian, `det J · J⁻ᵀ`; so the way back is
/// `Jᵀ / det J`, of which only the direction counts.
fn normal_before(there: &Evaluation<3>, normal: [f64; 3]) -> [f64; 3] {
    let j = there.jacobian;
    if j == IDENTITY {
        return normal;
    }
    let transpose = [0, 1, 2].map(|r| [0, 1, 2].map(|c| j[c][r]));
    let direction = transform_tangent(&transpose, normal);
    let length = direction.iter().map(|c| c * c).sum::<f64>().sqrt();
    let scale = length.copysign(there.determinant);
    let before = direction.map(|c| c / scale);
    // A length that is zero or not finite says nothing.
    if before.iter().all(|c| c.is_finite()) && length > 0.0 {
        before
    } else {
        normal
    }
}
