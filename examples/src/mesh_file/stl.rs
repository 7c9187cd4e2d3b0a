//! STL: triangles in single precision, as text or binary.
//!
//! Corners that agree to the bit are one vertex here. Normals are not read, as they say
//! nothing that the corners do not; those of triangles that change are computed anew. The
//! rest of the file, such as its header or the names of solids, stays as it is.
//!
//! `stl_io` merges the corners and writes new files. It is not given the files
//! themselves: it ends at the first of several solids, wants a name after `solid`, takes
//! a binary file that begins with this word for text, and cannot say where an error is.

use std::{io, ops::Range};

use stl_io::{IndexedMesh, Normal, Triangle, TriangleIterator, Vertex};

use super::{
    error::{MeshFileError, Place, Problem, number, quote, to_f32},
    geometry::{Facet, Geometry, same, single},
    splice::{Shortest, Splice},
};

/// Where the triangles of a binary file begin: after 80 bytes of anything, and a count.
const HEADER: usize = 84;
/// Bytes of a triangle: its normal and corners, and two for whatever a program likes.
const TRIANGLE: usize = 50;

/// An STL file as it was read.
#[derive(Debug, Clone)]
pub(super) struct StlFile {
    source: Vec<u8>,
    is_text: bool,
    /// The positions as they are in the file.
    original: Vec<[f64; 3]>,
    extras: &'static [&'static str],
}

impl StlFile {
    pub(super) fn parse(bytes: &[u8]) -> Result<(Self, Geometry), MeshFileError> {
        // Many binary files begin with the word, too. Then their length tells, or, should
        // they be cut or have something behind them, a byte that no text has.
        let first = bytes.trim_ascii_start().get(..5);
        let is_text = first.is_some_and(|word| word.eq_ignore_ascii_case(b"solid"))
            && declared_length(bytes) != Some(bytes.len())
            && !bytes.contains(&0);
        let (triangles, extras) = if is_text {
            read_text(bytes)?
        } else {
            read_binary(bytes)?
        };
        if triangles.is_empty() {
            return Err(MeshFileError::NoVertices);
        }
        let mesh = merged(triangles);
        let mut geometry = Geometry {
            positions: mesh.vertices.iter().map(|v| v.0.map(f64::from)).collect(),
            ..Geometry::default()
        };
        for face in &mesh.faces {
            let corners = face.vertices.map(u32::try_from);
            let [Ok(a), Ok(b), Ok(c)] = corners else {
                let count = mesh.vertices.len();
                let of = "vertices";
                return Err(Place::Header.error(Problem::TooMany { of, count }));
            };
            geometry.faces.push([a, b, c]);
        }
        let file = Self {
            source: bytes.to_vec(),
            is_text,
            original: geometry.positions.clone(),
            extras,
        };
        Ok((file, geometry))
    }

    pub(super) fn extras(&self) -> impl Iterator<Item = String> {
        self.extras.iter().map(|&extra| extra.to_owned())
    }

    /// The file with other positions.
    pub(super) fn encode(&self, geometry: &Geometry) -> Result<Vec<u8>, MeshFileError> {
        let facets = geometry.faces.iter().map(|face| {
            let corners = [face[0], face[1], face[2]];
            let moved = corners.iter().any(|&vertex| {
                let vertex = vertex as usize;
                !same(&geometry.positions[vertex], &self.original[vertex])
            });
            moved.then(|| geometry.facet(corners)).transpose()
        });
        if self.is_text {
            let mut out = Splice::new(&self.source);
            let mut places = Places::default();
            let mut facets = facets;
            scan(&self.source, |statement| {
                let Some(places) = places.complete(statement) else {
                    return Ok(());
                };
                let facet = facets.next().expect("one facet for each in the file")?;
                if let Some(Facet { normal, corners }) = facet {
                    let values = [normal].into_iter().chain(corners).flatten();
                    for (place, value) in places.iter().flatten().zip(values) {
                        let old = number::<f32>(&self.source[place.clone()]);
                        if old.is_ok_and(|old| old.to_bits() == value.to_bits()) {
                            continue;
                        }
                        out.replace(place.clone(), Shortest(value));
                    }
                }
                Ok(())
            })?;
            return Ok(out.finish());
        }
        let mut out = self.source.clone();
        for (triangle, facet) in out[HEADER..].chunks_exact_mut(TRIANGLE).zip(facets) {
            if let Some(Facet { normal, corners }) = facet? {
                let values = [normal].into_iter().chain(corners).flatten();
                for (bytes, value) in triangle.chunks_exact_mut(4).zip(values) {
                    bytes.copy_from_slice(&value.to_le_bytes());
                }
            }
        }
        Ok(out)
    }
}

/// Writes a binary file of the faces, cut into triangles.
pub(super) fn write(geometry: &Geometry) -> Result<Vec<u8>, MeshFileError> {
    let count = geometry.faces.fan_count();
    if count == 0 {
        return Err(MeshFileError::NoFaces);
    }
    let of = "triangles";
    u32::try_from(count).map_err(|_| Place::Header.error(Problem::TooMany { of, count }))?;
    // Every position must fit, also of vertices that no triangle has.
    for (vertex, position) in geometry.positions.iter().enumerate() {
        single(position, vertex)?;
    }
    let triangles = geometry
        .faces
        .fans()
        .map(|corners| {
            let facet = geometry.facet(corners)?;
            Ok(Triangle {
                normal: Normal::new(facet.normal),
                vertices: facet.corners.map(Vertex::new),
            })
        })
        .collect::<Result<Vec<_>, MeshFileError>>()?;
    let mut out = Vec::with_capacity(HEADER + TRIANGLE * count);
    stl_io::write_stl(&mut out, triangles.iter()).expect("memory takes everything");
    Ok(out)
}

/// How long a binary file should be that begins like this.
fn declared_length(bytes: &[u8]) -> Option<usize> {
    let count = bytes.get(HEADER - 4..HEADER)?.try_into().ok()?;
    let count = usize::try_from(u32::from_le_bytes(count)).ok()?;
    count.checked_mul(TRIANGLE)?.checked_add(HEADER)
}

type Corners = [[f32; 3]; 3];

fn read_binary(bytes: &[u8]) -> Result<(Vec<Corners>, &'static [&'static str]), MeshFileError> {
    let available = bytes.len().saturating_sub(HEADER) / TRIANGLE;
    let Some(length) = declared_length(bytes) else {
        return Err(Place::Header.error(Problem::UnexpectedEnd));
    };
    let Some(bytes) = bytes.get(HEADER..length) else {
        return Err(Place::item("triangle", available).error(Problem::UnexpectedEnd));
    };
    let mut triangles = Vec::with_capacity(bytes.len() / TRIANGLE);
    let mut attributes = false;
    for (index, triangle) in bytes.chunks_exact(TRIANGLE).enumerate() {
        let mut corners = Corners::default();
        let values = triangle[12..48].chunks_exact(4);
        for (out, bytes) in corners.as_flattened_mut().iter_mut().zip(values) {
            *out = f32::from_le_bytes(bytes.try_into().expect("four bytes"));
            if !out.is_finite() {
                let value = f64::from(*out);
                return Err(Place::item("triangle", index).error(Problem::NotFinite { value }));
            }
        }
        triangles.push(corners);
        attributes |= triangle[48..] != [0, 0];
    }
    let extras: &[_] = if attributes {
        &["attributes of triangles"]
    } else {
        &[]
    };
    Ok((triangles, extras))
}

fn read_text(bytes: &[u8]) -> Result<(Vec<Corners>, &'static [&'static str]), MeshFileError> {
    let mut triangles = Vec::new();
    let mut named = false;
    let mut places = Places::default();
    scan(bytes, |statement| {
        named |= matches!(statement, Scanned::Solid { named: true });
        if let Some([_, corners @ ..]) = places.complete(statement) {
            let mut triangle = Corners::default();
            let places = corners.as_flattened().iter();
            for (out, place) in triangle.as_flattened_mut().iter_mut().zip(places) {
                // They were checked one by one.
                *out = number(&bytes[place.clone()]).unwrap_or_default();
            }
            triangles.push(triangle);
        }
        Ok(())
    })?;
    let extras: &[_] = if named { &["names of solids"] } else { &[] };
    Ok((triangles, extras))
}

/// A statement of a text that says something.
enum Scanned {
    Solid {
        named: bool,
    },
    /// Where the numbers stand.
    Normal([Range<usize>; 3]),
    Vertex([Range<usize>; 3]),
}

/// Where the numbers of a triangle stand: its normal, then its corners.
#[derive(Default)]
struct Places {
    places: [[Range<usize>; 3]; 4],
    known: usize,
}

impl Places {
    /// Adds what a statement says, and returns the places when all are known.
    fn complete(&mut self, statement: Scanned) -> Option<&[[Range<usize>; 3]; 4]> {
        match statement {
            Scanned::Solid { .. } => return None,
            Scanned::Normal(places) => {
                self.places[0] = places;
                self.known = 1;
            }
            Scanned::Vertex(places) => {
                self.places[self.known] = places;
                self.known += 1;
            }
        }
        (self.known == 4).then_some(&self.places)
    }
}

/// What must come next in a text.
const ORDER: [&str; 7] = [
    "facet normal",
    "outer loop",
    "vertex",
    "vertex",
    "vertex",
    "endloop",
    "endfacet",
];

/// Goes through a text, statement by statement, and checks their order and coordinates.
fn scan(
    source: &[u8],
    mut see: impl FnMut(Scanned) -> Result<(), MeshFileError>,
) -> Result<(), MeshFileError> {
    let mut in_solid = false;
    let mut next = 0;
    let mut line_count = 0;
    let mut end = 0;
    for (index, text) in source.split_inclusive(|&byte| byte == b'\n').enumerate() {
        let line = index + 1;
        line_count = line;
        let here = |problem| Place::Line(line).error(problem);
        let start = end;
        end += text.len();
        let mut words = Words {
            source,
            at: start,
            end,
        };
        let Some(first) = words.next() else {
            continue;
        };
        let is = |word: &Range<usize>, expected: &str| {
            source[word.clone()].eq_ignore_ascii_case(expected.as_bytes())
        };
        let unexpected = |expected| {
            here(Problem::UnexpectedStatement {
                expected,
                found: quote(text.trim_ascii()),
            })
        };
        if !in_solid {
            if !is(&first, "solid") {
                return Err(unexpected("solid"));
            }
            in_solid = true;
            let named = words.next().is_some();
            see(Scanned::Solid { named })?;
            continue;
        }
        if next == 0 && is(&first, "endsolid") {
            in_solid = false;
            continue;
        }
        let expected = ORDER[next];
        let mut keywords = expected.split(' ');
        let mut word = Some(first);
        for keyword in keywords.by_ref() {
            let found = word.take().or_else(|| words.next());
            if !found.is_some_and(|found| is(&found, keyword)) {
                return Err(unexpected(expected));
            }
        }
        let is_vertex = expected == "vertex";
        if is_vertex || next == 0 {
            let mut places = [const { 0..0 }; 3];
            for (found, place) in places.iter_mut().enumerate() {
                *place = words
                    .next()
                    .ok_or_else(|| here(Problem::TooFewValues { expected: 3, found }))?;
                // Normals are not read; some programs write `nan` there.
                if is_vertex {
                    let value = number::<f32>(&source[place.clone()]).map_err(here)?;
                    to_f32(value.into()).map_err(here)?;
                }
            }
            if words.next().is_some() {
                return Err(here(Problem::TooManyValues));
            }
            see(if is_vertex {
                Scanned::Vertex(places)
            } else {
                Scanned::Normal(places)
            })?;
        } else if words.next().is_some() {
            return Err(unexpected(expected));
        }
        next = (next + 1) % ORDER.len();
    }
    if in_solid {
        return Err(Place::Line(line_count).error(Problem::UnexpectedEnd));
    }
    Ok(())
}

/// The words of a line, as places in the file.
struct Words<'a> {
    source: &'a [u8],
    at: usize,
    end: usize,
}

impl Iterator for Words<'_> {
    type Item = Range<usize>;

    fn next(&mut self) -> Option<Range<usize>> {
        let rest = &self.source[self.at..self.end];
        let start = self.at + rest.iter().position(|b| !b.is_ascii_whitespace())?;
        let rest = &self.source[start..self.end];
        let length = rest.iter().position(u8::is_ascii_whitespace);
        self.at = length.map_or(self.end, |length| start + length);
        Some(start..self.at)
    }
}

/// Makes one vertex of corners that agree to the bit.
fn merged(triangles: Vec<Corners>) -> IndexedMesh {
    struct Triangles(std::vec::IntoIter<Corners>);

    impl Iterator for Triangles {
        type Item = io::Result<Triangle>;

        fn next(&mut self) -> Option<Self::Item> {
            self.0.next().map(|corners| {
                Ok(Triangle {
                    normal: Normal::default(),
                    vertices: corners.map(Vertex::new),
                })
            })
        }
    }

    impl TriangleIterator for Triangles {}

    Triangles(triangles.into_iter())
        .as_indexed_triangles()
        .expect("triangles in memory can be read")
}
