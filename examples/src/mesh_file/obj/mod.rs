//! OBJ: a text in which only the values of `v` and `vn` change.
//!
//! Everything else stays to the byte: comments, materials, groups, texture coordinates,
//! what follows the three coordinates, curves, and statements unknown here. Only when
//! vertices that share a normal no longer agree on it does the file get further `vn`
//! statements, right behind the shared one, and faces other indices of normals.
//!
//! Polygons need three corners; shorter "faces", lines and points keep their place in
//! the file and are no faces here.

mod numbering;
mod text;
mod write;

use std::{collections::BTreeSet, ops::Range};

pub(super) use write::write;

use super::{
    error::{MeshFileError, Place, Problem, finite},
    geometry::{Geometry, VertexNormal, checked_index, same, unit},
    splice::{Shortest, Splice},
};
use numbering::Numbering;
use text::{Corner, Statement, Words, resolve, statements};

/// An OBJ file as it was read.
#[derive(Debug, Clone)]
pub(super) struct ObjFile {
    source: Vec<u8>,
    /// For each normal of the geometry: which `vn` it comes from, and its vertex. Sorted.
    pairs: Vec<(u32, u32)>,
    /// How many `vn` there are.
    normal_count: usize,
    /// What the file has besides geometry.
    extras: BTreeSet<&'static str>,
}

/// An index to something that may be defined further down.
#[derive(Default)]
struct Furthest {
    index: i64,
    written: i64,
    line: usize,
}

impl Furthest {
    fn see(&mut self, index: i64, written: i64, line: usize) {
        if self.line == 0 || index > self.index {
            *self = Self {
                index,
                written,
                line,
            };
        }
    }

    fn check(&self, count: usize, of: &'static str) -> Result<(), MeshFileError> {
        if self.line == 0 || checked_index(self.index, count, of).is_ok() {
            return Ok(());
        }
        Err(Place::Line(self.line).error(Problem::IndexOutOfRange {
            of,
            index: self.written,
            count,
        }))
    }
}

/// Resolves an index that must be one, though perhaps of something not yet defined.
fn index(written: i64, defined: usize, of: &'static str) -> Result<u32, Problem> {
    u32::try_from(resolve(written, defined)).map_err(|_| Problem::IndexOutOfRange {
        of,
        index: written,
        count: defined,
    })
}

impl ObjFile {
    pub(super) fn parse(bytes: &[u8]) -> Result<(Self, Geometry), MeshFileError> {
        let mut geometry = Geometry::default();
        let mut normals: Vec<Option<[f64; 3]>> = Vec::new();
        // (normal, vertex) of every corner that has a normal.
        let mut pairs: Vec<(u32, u32)> = Vec::new();
        let mut furthest = [const {
            Furthest {
                index: 0,
                written: 0,
                line: 0,
            }
        }; 2];
        let mut extras = BTreeSet::new();
        let mut face = Vec::new();

        for statement in statements(bytes) {
            let line = statement.line;
            let here = |problem| Place::Line(line).error(problem);
            let mut words = Words::of(bytes, &statement);
            let Some(keyword) = words.next() else {
                continue;
            };
            match &bytes[keyword] {
                b"v" => {
                    let vector = words.vector().map_err(here)?;
                    for (_, value) in &vector {
                        finite(*value).map_err(here)?;
                    }
                    geometry.positions.push(vector.map(|(_, value)| value));
                    if words.next().is_some() {
                        extras.insert("colours or weights of vertices");
                    }
                }
                b"vn" => {
                    let vector = words.vector().map_err(here)?;
                    normals.push(unit(&vector.map(|(_, value)| value)));
                }
                b"f" | b"fo" => {
                    face.clear();
                    for word in words {
                        let corner = Corner::parse(bytes, word).map_err(here)?;
                        let vertex = index(corner.vertex, geometry.positions.len(), "vertex")
                            .map_err(here)?;
                        furthest[0].see(vertex.into(), corner.vertex, line);
                        if let Some((written, _)) = corner.normal {
                            let normal = index(written, normals.len(), "normal").map_err(here)?;
                            furthest[1].see(normal.into(), written, line);
                            pairs.push((normal, vertex));
                        }
                        face.push(vertex);
                    }
                    if face.len() < 3 {
                        extras.insert("lines and points");
                    } else {
                        geometry.faces.push(face.iter().copied());
                    }
                }
                other => {
                    extras.insert(extra(other));
                }
            }
        }
        if geometry.positions.is_empty() {
            return Err(MeshFileError::NoVertices);
        }
        furthest[0].check(geometry.positions.len(), "vertex")?;
        furthest[1].check(normals.len(), "normal")?;

        pairs.sort_unstable();
        pairs.dedup();
        // A normal without direction cannot be deformed; it stays as it is.
        pairs.retain(|&(normal, _)| normals[normal as usize].is_some());
        geometry.normals = pairs
            .iter()
            .map(|&(normal, vertex)| VertexNormal {
                vertex,
                normal: normals[normal as usize].unwrap_or_default(),
            })
            .collect();
        let file = Self {
            source: bytes.to_vec(),
            pairs,
            normal_count: normals.len(),
            extras,
        };
        Ok((file, geometry))
    }

    pub(super) fn extras(&self) -> impl Iterator<Item = String> {
        self.extras.iter().map(|&extra| extra.to_owned())
    }

    /// The text with other positions and normals.
    pub(super) fn encode(&self, geometry: &Geometry) -> Result<Vec<u8>, MeshFileError> {
        let numbering = Numbering::new(&self.pairs, self.normal_count, &geometry.normals);
        let mut out = Splice::new(&self.source);
        // How many `v` and `vn` there were so far.
        let (mut vertex_count, mut normal_count) = (0, 0);
        for statement in statements(&self.source) {
            let mut words = Words::of(&self.source, &statement);
            let Some(keyword) = words.next() else {
                continue;
            };
            match &self.source[keyword] {
                b"v" => {
                    let position = &geometry.positions[vertex_count];
                    for &value in position {
                        finite(value).map_err(|problem| {
                            Place::item("vertex", vertex_count).error(problem)
                        })?;
                    }
                    replace_changed(&again(words.vector()), position, &mut out);
                    vertex_count += 1;
                }
                b"vn" => {
                    let old = again(words.vector());
                    let values = numbering.values(normal_count);
                    self.write_normals(&statement, &old, values, &mut out)?;
                    normal_count += 1;
                }
                b"f" | b"fo" if numbering.is_new() => {
                    for word in words {
                        let corner = again(Corner::parse(&self.source, word));
                        let Some((written, place)) = corner.normal else {
                            continue;
                        };
                        let vertex = again(index(corner.vertex, vertex_count, "vertex"));
                        let normal = again(index(written, normal_count, "normal"));
                        let new = numbering.written(normal, vertex, written < 0, normal_count);
                        if new != written {
                            out.replace(place, new);
                        }
                    }
                }
                _ => {}
            }
        }
        Ok(out.finish())
    }

    /// Writes the values that a `vn` has now: the first in its place, others behind it.
    fn write_normals(
        &self,
        statement: &Statement,
        old: &[(Range<usize>, f64); 3],
        values: &[[f64; 3]],
        out: &mut Splice,
    ) -> Result<(), MeshFileError> {
        let here = |problem| Place::Line(statement.line).error(problem);
        for &value in values.iter().flatten() {
            finite(value).map_err(here)?;
        }
        let Some((first, others)) = values.split_first() else {
            return Ok(());
        };
        let was = unit(&[old[0].1, old[1].1, old[2].1]);
        if was.is_none_or(|was| !same(&was, first)) {
            replace_changed(old, first, out);
        }
        let text = &self.source[statement.bytes.clone()];
        let terminator = match text {
            [.., b'\r', b'\n'] => "\r\n",
            [.., b'\n'] => "\n",
            [.., b'\r'] => "\r",
            _ => "",
        };
        let end = statement.bytes.end;
        for [x, y, z] in others {
            // The last line of a file may lack its end.
            let before = if terminator.is_empty() { "\n" } else { "" };
            let [x, y, z] = [x, y, z].map(|&c| Shortest(c));
            out.replace(end..end, format_args!("{before}vn {x} {y} {z}{terminator}"));
        }
        Ok(())
    }
}

/// Writes the numbers that differ from those that are there.
fn replace_changed(old: &[(Range<usize>, f64); 3], new: &[f64; 3], out: &mut Splice) {
    for ((word, old), &new) in old.iter().zip(new) {
        if old.to_bits() != new.to_bits() {
            out.replace(word.clone(), Shortest(new));
        }
    }
}

/// What was read once can be read again.
fn again<T>(result: Result<T, Problem>) -> T {
    result.expect("the text was checked when it was read")
}

/// What a statement that is no geometry stands for.
fn extra(keyword: &[u8]) -> &'static str {
    match keyword {
        b"vt" => "texture coordinates",
        b"mtllib" | b"usemtl" | b"maplib" | b"usemap" => "materials",
        b"o" | b"g" => "objects and groups",
        b"s" => "smoothing groups",
        b"l" | b"p" => "lines and points",
        b"vp" | b"cstype" | b"deg" | b"curv" | b"curv2" | b"surf" | b"bmat" | b"step" => {
            "curves and surfaces"
        }
        _ => "statements unknown here",
    }
}
