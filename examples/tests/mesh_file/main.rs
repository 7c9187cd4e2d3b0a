//! Mesh files: what goes in comes out, and nothing else does any harm.

#![expect(
    clippy::cast_possible_truncation,
    clippy::float_cmp,
    reason = "single precision is meant where it is used, and equal means equal"
)]

mod laws;
mod named;

use examples::mesh_file::{MeshFile, MeshFileError, MeshFormat, Place, Problem, VertexNormal};

const FORMATS: [MeshFormat; 3] = [MeshFormat::Obj, MeshFormat::Ply, MeshFormat::Stl];

fn parse(bytes: &[u8], format: MeshFormat) -> MeshFile {
    MeshFile::parse(bytes, format).unwrap_or_else(|error| panic!("{format}: {error}"))
}

fn obj(text: &str) -> MeshFile {
    parse(text.as_bytes(), MeshFormat::Obj)
}

/// The file as text, in its own format.
fn text(mesh: &MeshFile) -> String {
    let bytes = mesh.encode(mesh.format()).expect("finite");
    String::from_utf8(bytes).expect("text")
}

fn faces(mesh: &MeshFile) -> Vec<Vec<u32>> {
    mesh.faces().map(<[u32]>::to_vec).collect()
}

fn bits(positions: &[[f64; 3]]) -> Vec<[u64; 3]> {
    positions.iter().map(|p| p.map(f64::to_bits)).collect()
}

/// What is wrong with a file.
fn message(bytes: impl AsRef<[u8]>, format: MeshFormat) -> String {
    MeshFile::parse(bytes.as_ref(), format)
        .expect_err("refused")
        .to_string()
}
