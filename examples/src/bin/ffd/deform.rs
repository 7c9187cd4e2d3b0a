//! `ffd deform`: a mesh through lattices, one after another.

use examples::{mesh_file::VertexNormal, output::write_new_file};
use ffd_core::{Embedding, FfdError, Outside, Sequence, transform_normal};
use serde_json::json;

use crate::{Answer, Error, cli::Deform, files};

pub(crate) fn run(arguments: &Deform) -> Result<Answer, Error> {
    let Deform {
        mesh: path,
        lattice,
        output,
        outside,
    } = arguments;
    files::check_output(&output.path, output.force, &[path, lattice])?;
    files::check_format(&output.path)?;
    let mut mesh = files::read_mesh(path)?;
    let sequence = files::read_sequence(lattice)?;
    let outside = Outside::from(*outside);

    let deformed = deform(&sequence, outside, mesh.positions(), mesh.normals()).map_err(
        |(number, error)| {
            let place = lattice_name(number, &sequence);
            format!("{}: {place}{error}", path.display())
        },
    )?;
    let vertices = mesh.positions().len();
    mesh.set_positions(deformed.positions);
    mesh.set_normals(deformed.normals);
    let bytes = files::encode(&mesh, &output.path)?;
    write_new_file(&output.path, &bytes, output.force)?;

    let fate = match outside {
        Outside::Clamp => "move with the nearest point of its box",
        Outside::Keep | Outside::Error => "stay where they are",
    };
    let mut notes = Vec::new();
    for (number, count) in deformed.outside.iter().enumerate() {
        let place = lattice_name(number, &sequence);
        notes.push(format!(
            "{place}{count} of {vertices} points lie outside the lattice and {fate}"
        ));
    }
    notes.extend(files::encoding_notes(&mesh, &output.path));
    let summary = json!({ "vertices": vertices, "outside": deformed.outside });
    Ok(Answer::new(&summary, notes)?)
}

/// `lattice 2 of 3: `, counted from one; nothing if there is only one.
fn lattice_name(number: usize, sequence: &Sequence<3>) -> String {
    match sequence.lattices().len() {
        1 => String::new(),
        count => format!("lattice {} of {count}: ", number + 1),
    }
}

pub(crate) struct Deformed {
    pub(crate) positions: Vec<[f64; 3]>,
    pub(crate) normals: Vec<[f64; 3]>,
    /// For each lattice, how many points lay outside.
    pub(crate) outside: Vec<usize>,
}

/// Positions and normals after all lattices; an error comes with the number of the
/// lattice.
pub(crate) fn deform(
    sequence: &Sequence<3>,
    outside: Outside,
    positions: &[[f64; 3]],
    vertex_normals: &[VertexNormal],
) -> Result<Deformed, (usize, FfdError)> {
    let mut positions = positions.to_vec();
    let mut normals: Vec<_> = vertex_normals.iter().map(|n| n.normal).collect();
    let mut counts = Vec::new();
    let mut jacobians = vec![
        IDENTITY;
        if normals.is_empty() {
            0
        } else {
            positions.len()
        }
    ];
    for (number, lattice) in sequence.lattices().iter().enumerate() {
        let at_lattice = |error| (number, error);
        // All points of a mesh at once are several times faster than one by one.
        let bound =
            Embedding::<f64, 3>::new(lattice.grid(), &positions, outside).map_err(at_lattice)?;
        counts.push(bound.outside().len());
        if normals.is_empty() {
            bound.par_deform_into(lattice, &mut positions)
        } else {
            bound.par_deform_with_jacobians_into(lattice, &mut positions, &mut jacobians)
        }
        .map_err(at_lattice)?;
        for (normal, VertexNormal { vertex, .. }) in normals.iter_mut().zip(vertex_normals) {
            *normal = moved_normal(&jacobians[*vertex as usize], *normal);
        }
    }
    Ok(Deformed {
        positions,
        normals,
        outside: counts,
    })
}

pub(crate) const IDENTITY: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// The normal of the deformed surface.
fn moved_normal(jacobian: &[[f64; 3]; 3], normal: [f64; 3]) -> [f64; 3] {
    // Scaling to length 1 could change the last digit of a normal that does not turn.
    if *jacobian == IDENTITY {
        return normal;
    }
    let moved = transform_normal(jacobian, normal);
    // Where the surface is squeezed to a line there is none; any other is no worse.
    if moved.iter().all(|&c| c == 0.0) {
        normal
    } else {
        moved
    }
}
