//! Mesh files whose vertices move: OBJ, PLY and STL.
//!
//! A [`MeshFile`] is a file and what was found in it. Its positions and normals can be
//! replaced; written in its own format, it is the same file to the byte except for the
//! numbers that changed, and a number that did not change keeps its digits. Written in
//! another format, only the geometry is left, and [`notes`](MeshFile::notes) says so.
//!
//! | format | read | written from itself | from another format |
//! |---|---|---|---|
//! | OBJ | polygons, relative indices, joined lines | as it was | `v`, `vn`, `f` |
//! | PLY | text, binary of both byte orders | as it was | binary, little-endian, `double` |
//! | STL | text, binary | as it was | binary, always single precision |
//!
//! Files are not trusted: whatever the bytes, reading ends in a value or a
//! [`MeshFileError`] that says where the file is wrong, needs time `O(n log n)` in its
//! length and memory of a small multiple of it. Material libraries are never opened; this
//! module does no I/O.
//!
//! # Example
//!
//! ```
//! use examples::mesh_file::{MeshFile, MeshFormat};
//!
//! let text = b"# a triangle\nv 0 0 0\nv 1.50 0 0 # here\nv 0 1 0\nf 1 2 3\n";
//! let mut mesh = MeshFile::parse(text, MeshFormat::Obj)?;
//! let mut positions = mesh.positions().to_vec();
//! positions[1][2] = 0.25;
//! mesh.set_positions(positions);
//! assert_eq!(
//!     mesh.encode(MeshFormat::Obj)?,
//!     b"# a triangle\nv 0 0 0\nv 1.50 0 0.25 # here\nv 0 1 0\nf 1 2 3\n"
//! );
//! # Ok::<(), examples::mesh_file::MeshFileError>(())
//! ```

mod error;
mod geometry;
mod obj;
mod ply;
mod splice;
mod stl;

use std::{fmt, path::Path};

use geometry::Geometry;

pub use error::{MeshFileError, Place, Problem};
pub use geometry::VertexNormal;

/// How many things that are lost are named to the user.
const MOST_LOSSES: usize = 12;

/// A format that can be read and written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum MeshFormat {
    /// Wavefront OBJ.
    Obj,
    /// Polygon file format, also called Stanford triangle format.
    Ply,
    /// Stereolithography.
    Stl,
}

impl MeshFormat {
    /// The format that the name of a file promises, in upper or lower case.
    ///
    /// # Errors
    ///
    /// [`MeshFileError::UnknownFormat`] if it promises none of these.
    pub fn from_path(path: &Path) -> Result<Self, MeshFileError> {
        let extension = path.extension().unwrap_or_default().to_string_lossy();
        match extension.to_ascii_lowercase().as_str() {
            "obj" => Ok(Self::Obj),
            "ply" => Ok(Self::Ply),
            "stl" => Ok(Self::Stl),
            _ => Err(MeshFileError::UnknownFormat {
                extension: extension.into_owned(),
            }),
        }
    }
}

impl fmt::Display for MeshFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Obj => "OBJ",
            Self::Ply => "PLY",
            Self::Stl => "STL",
        })
    }
}

/// A mesh with the file it came from.
#[derive(Debug, Clone)]
pub struct MeshFile {
    file: File,
    geometry: Geometry,
}

#[derive(Debug, Clone)]
enum File {
    Obj(obj::ObjFile),
    Ply(ply::PlyFile),
    Stl(stl::StlFile),
}

impl MeshFile {
    /// Reads a file.
    ///
    /// # Errors
    ///
    /// What is wrong with it, and where: the line of a text, the vertex, face or triangle
    /// of a PLY or binary STL.
    pub fn parse(bytes: &[u8], format: MeshFormat) -> Result<Self, MeshFileError> {
        let (file, geometry) = match format {
            MeshFormat::Obj => {
                let (file, geometry) = obj::ObjFile::parse(bytes)?;
                (File::Obj(file), geometry)
            }
            MeshFormat::Ply => {
                let (file, geometry) = ply::PlyFile::parse(bytes)?;
                (File::Ply(file), geometry)
            }
            MeshFormat::Stl => {
                let (file, geometry) = stl::StlFile::parse(bytes)?;
                (File::Stl(file), geometry)
            }
        };
        Ok(Self { file, geometry })
    }

    /// The format of the file.
    #[must_use]
    pub fn format(&self) -> MeshFormat {
        match self.file {
            File::Obj(_) => MeshFormat::Obj,
            File::Ply(_) => MeshFormat::Ply,
            File::Stl(_) => MeshFormat::Stl,
        }
    }

    /// The positions of the vertices, in the order of the file. There is at least one.
    ///
    /// An STL has no vertices, only triangles: corners that agree to the bit are one here,
    /// in order of appearance.
    #[must_use]
    pub fn positions(&self) -> &[[f64; 3]] {
        &self.geometry.positions
    }

    /// The polygons, in the order of the file: three or more indices of vertices.
    pub fn faces(&self) -> impl ExactSizeIterator<Item = &[u32]> + Clone {
        self.geometry.faces.iter()
    }

    /// The polygons cut into triangles, each from its first corner.
    pub fn triangles(&self) -> impl Iterator<Item = [u32; 3]> {
        self.geometry.faces.fans()
    }

    /// The normals that the file gives to vertices: one entry for each vertex and `vn` that
    /// meet in a corner of an OBJ, at most one for each vertex of a PLY, none in an STL.
    ///
    /// Normals without direction, such as zeros, are left out and stay as they are.
    #[must_use]
    pub fn normals(&self) -> &[VertexNormal] {
        &self.geometry.normals
    }

    /// Replaces the positions.
    ///
    /// # Panics
    ///
    /// If there are not as many as [`positions`](Self::positions) has.
    pub fn set_positions(&mut self, positions: Vec<[f64; 3]>) {
        assert_eq!(
            positions.len(),
            self.geometry.positions.len(),
            "as many positions as vertices"
        );
        self.geometry.positions = positions;
    }

    /// Replaces the normals, in the order of [`normals`](Self::normals).
    ///
    /// They are written as they are, so they should have unit length. Where vertices of an
    /// OBJ that share a `vn` do not agree on it any more, it becomes several.
    ///
    /// # Panics
    ///
    /// If there are not as many as [`normals`](Self::normals) has.
    pub fn set_normals(&mut self, normals: Vec<[f64; 3]>) {
        let old = &mut self.geometry.normals;
        assert_eq!(normals.len(), old.len(), "as many normals as before");
        for (old, new) in old.iter_mut().zip(normals) {
            old.normal = new;
        }
    }

    /// Writes the mesh: in the format of the file, everything that is in it; in another
    /// one, positions, faces, and normals if each vertex has one.
    ///
    /// # Errors
    ///
    /// [`Problem::NotFinite`] with the vertex, or the line of the `vn`, if a number that was
    /// set is not finite or too large for single precision where the format has that;
    /// [`Problem::TooMany`] if the format cannot count the vertices or triangles;
    /// [`MeshFileError::NoFaces`] if an STL would be empty.
    pub fn encode(&self, format: MeshFormat) -> Result<Vec<u8>, MeshFileError> {
        match (format, &self.file) {
            (MeshFormat::Obj, File::Obj(file)) => file.encode(&self.geometry),
            (MeshFormat::Ply, File::Ply(file)) => file.encode(&self.geometry),
            (MeshFormat::Stl, File::Stl(file)) => file.encode(&self.geometry),
            (MeshFormat::Obj, _) => obj::write(&self.geometry),
            (MeshFormat::Ply, _) => ply::write(&self.geometry),
            (MeshFormat::Stl, _) => stl::write(&self.geometry),
        }
    }

    /// What [`encode`](Self::encode) does not keep in this format, one sentence each.
    #[must_use]
    pub fn notes(&self, format: MeshFormat) -> Vec<String> {
        let mut notes = Vec::new();
        let single = match (format, &self.file) {
            (MeshFormat::Ply, File::Ply(file)) => file.is_single(),
            _ => format == MeshFormat::Stl,
        };
        if single {
            notes.push(format!(
                "positions are rounded to single precision in this {format} file"
            ));
        }
        if format == self.format() {
            return notes;
        }
        if format == MeshFormat::Stl && self.faces().any(|face| face.len() > 3) {
            notes.push("polygons are cut into triangles".to_owned());
        }
        let mut lost: Vec<String> = match &self.file {
            File::Obj(file) => file.extras().collect(),
            File::Ply(file) => file.extras().collect(),
            File::Stl(file) => file.extras().collect(),
        };
        if !self.normals().is_empty()
            && (format == MeshFormat::Stl || self.geometry.vertex_normals().is_none())
        {
            lost.push("normals of vertices".to_owned());
        }
        if format == MeshFormat::Stl && self.geometry.has_loose_vertices() {
            lost.push("vertices of no face".to_owned());
        }
        // A hostile header could name millions.
        let more = lost.len().saturating_sub(MOST_LOSSES);
        if more > 0 {
            lost.truncate(MOST_LOSSES);
            lost.push(format!("{more} more"));
        }
        if !lost.is_empty() {
            notes.push(format!("not written to {format}: {}", lost.join("; ")));
        }
        notes
    }
}
