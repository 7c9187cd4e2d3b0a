//! OBJ from the geometry alone.

use std::fmt::Write as _;

use super::super::{
    error::{MeshFileError, Place, finite},
    geometry::Geometry,
    splice::Shortest,
};

/// Writes `v`, `vn` if there is one normal for each vertex, and `f`.
pub(in super::super) fn write(geometry: &Geometry) -> Result<Vec<u8>, MeshFileError> {
    let mut out = String::new();
    let mut line = |keyword: &str, vector: &[f64; 3], vertex: usize| {
        for &value in vector {
            finite(value).map_err(|problem| Place::item("vertex", vertex).error(problem))?;
        }
        let [x, y, z] = vector.map(Shortest);
        writeln!(out, "{keyword} {x} {y} {z}").expect("memory takes everything");
        Ok(())
    };
    for (vertex, position) in geometry.positions.iter().enumerate() {
        line("v", position, vertex)?;
    }
    let normals = geometry.vertex_normals();
    for (vertex, normal) in normals.iter().flatten().enumerate() {
        line("vn", normal, vertex)?;
    }
    for face in geometry.faces.iter() {
        out.push('f');
        for vertex in face {
            let number = u64::from(*vertex) + 1;
            write!(out, " {number}").expect("memory takes everything");
            if normals.is_some() {
                write!(out, "//{number}").expect("memory takes everything");
            }
        }
        out.push('\n');
    }
    Ok(out.into_bytes())
}
