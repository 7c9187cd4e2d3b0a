//! PLY: text or binary, in which only `x y z` and `nx ny nz` of the vertices change.
//!
//! Everything else stays to the byte: other elements and properties, comments, the
//! encoding, and the type of the coordinates. `ply_rs_bw` reads the header and writes new
//! files. It is not given the payload: it would keep a map of names for every vertex, and
//! write comments elsewhere and numbers otherwise than they were.

mod header;
mod payload;
mod value;
mod write;

pub(super) use write::write;

use super::{
    error::{MeshFileError, Place, finite},
    geometry::{Geometry, VertexNormal, checked_index, same, unit},
    splice::Splice,
};
use header::{COORDINATES, Header};
use payload::{VertexPlaces, Visitor, visit};

/// A PLY file as it was read.
#[derive(Debug, Clone)]
pub(super) struct PlyFile {
    source: Vec<u8>,
    header: Header,
    /// Whether there are faces of fewer than three corners.
    has_short_faces: bool,
}

impl PlyFile {
    pub(super) fn parse(bytes: &[u8]) -> Result<(Self, Geometry), MeshFileError> {
        let header = Header::parse(bytes)?;
        let vertices = header.elements.iter().find(|e| e.is_vertex());
        let vertex_count = vertices.map_or(0, |e| e.count);
        if vertex_count == 0 {
            return Err(MeshFileError::NoVertices);
        }
        let mut decoder = Decoder {
            source: bytes,
            header: &header,
            vertex_count,
            geometry: Geometry::default(),
            has_short_faces: false,
        };
        decoder.geometry.positions.reserve_exact(vertex_count);
        visit(bytes, &header, &mut decoder)?;
        let (geometry, has_short_faces) = (decoder.geometry, decoder.has_short_faces);
        let file = Self {
            source: bytes.to_vec(),
            header,
            has_short_faces,
        };
        Ok((file, geometry))
    }

    pub(super) fn extras(&self) -> impl Iterator<Item = String> {
        let short = self.has_short_faces.then(|| "lines and points".to_owned());
        self.header.extras.iter().cloned().chain(short)
    }

    /// Whether positions are stored in single precision.
    pub(super) fn is_single(&self) -> bool {
        self.header.elements.iter().any(header::Element::is_single)
    }

    /// The file with other positions and normals.
    pub(super) fn encode(&self, geometry: &Geometry) -> Result<Vec<u8>, MeshFileError> {
        let mut encoder = Encoder {
            file: self,
            geometry,
            normal_count: 0,
            out: Splice::new(&self.source),
        };
        visit(&self.source, &self.header, &mut encoder)?;
        Ok(encoder.out.finish())
    }
}

/// Reads the coordinates of a vertex, or those of its normal.
fn vector(
    source: &[u8],
    header: &Header,
    places: &VertexPlaces,
    first: usize,
    index: usize,
) -> Result<[f64; 3], MeshFileError> {
    let mut vector = [0.0; 3];
    for (out, (place, kind)) in vector.iter_mut().zip(&places[first..]) {
        *out = kind
            .real(&source[place.clone()], header.encoding)
            .map_err(|problem| Place::item("vertex", index).error(problem))?;
    }
    Ok(vector)
}

struct Decoder<'a> {
    source: &'a [u8],
    header: &'a Header,
    vertex_count: usize,
    geometry: Geometry,
    has_short_faces: bool,
}

impl Visitor for Decoder<'_> {
    fn vertex(&mut self, index: usize, places: &VertexPlaces) -> Result<(), MeshFileError> {
        let here = |problem| Place::item("vertex", index).error(problem);
        let position = vector(self.source, self.header, places, 0, index)?;
        for value in position {
            finite(value).map_err(here)?;
        }
        self.geometry.positions.push(position);
        if self.header.has_normals {
            let normal = vector(self.source, self.header, places, 3, index)?;
            // A normal without direction cannot be deformed; it stays as it is.
            if let Some(normal) = unit(&normal) {
                let vertex = checked_index(as_index(index), self.vertex_count, "vertex");
                let vertex = vertex.map_err(here)?;
                self.geometry.normals.push(VertexNormal { vertex, normal });
            }
        }
        Ok(())
    }

    fn face(&mut self, index: usize, corners: &[i64]) -> Result<(), MeshFileError> {
        for &corner in corners {
            checked_index(corner, self.vertex_count, "vertex")
                .map_err(|problem| Place::item("face", index).error(problem))?;
        }
        if corners.len() < 3 {
            self.has_short_faces = true;
        } else {
            let corners = corners
                .iter()
                .map(|&c| u32::try_from(c).unwrap_or_default());
            self.geometry.faces.push(corners);
        }
        Ok(())
    }
}

/// A count of things in memory, as a signed number.
fn as_index(count: usize) -> i64 {
    i64::try_from(count).unwrap_or(i64::MAX)
}

struct Encoder<'a> {
    file: &'a PlyFile,
    geometry: &'a Geometry,
    /// How many normals are written.
    normal_count: usize,
    out: Splice<'a>,
}

impl Visitor for Encoder<'_> {
    fn vertex(&mut self, index: usize, places: &VertexPlaces) -> Result<(), MeshFileError> {
        let PlyFile { source, header, .. } = self.file;
        let here = |problem| Place::item("vertex", index).error(problem);
        let mut new = [None; COORDINATES.len()];
        for (new, &value) in new.iter_mut().zip(&self.geometry.positions[index]) {
            *new = Some(value);
        }
        let normal = self.geometry.normals.get(self.normal_count);
        if let Some(normal) = normal.filter(|n| n.vertex as usize == index) {
            self.normal_count += 1;
            let old = unit(&vector(source, header, places, 3, index)?);
            if old.is_none_or(|old| !same(&old, &normal.normal)) {
                for (new, value) in new[3..].iter_mut().zip(normal.normal) {
                    *new = Some(value);
                }
            }
        }
        // In the order of the file, which need not be ours.
        let mut changes: Vec<_> = places.iter().zip(new).collect();
        changes.sort_unstable_by_key(|((place, _), _)| place.start);
        for ((place, kind), new) in changes {
            let Some(new) = new else { continue };
            let old = kind.real(&source[place.clone()], header.encoding);
            let new = kind.rounded(new).map_err(here)?;
            if old.map_err(here)?.to_bits() != new.to_bits() {
                kind.replace(&mut self.out, place.clone(), new, header.encoding);
            }
        }
        Ok(())
    }

    fn face(&mut self, _index: usize, _corners: &[i64]) -> Result<(), MeshFileError> {
        Ok(())
    }
}
