//! The thesis's object file: vertices, elements, display list.
//!
//! \[Ma98\] (section 3.5.1, Table 3.1) keeps a virtual object as three lists,
//! `N × 3` vertex coordinates, `M × 4` element nodes and `P × 3` display triangles,
//! and saves them as text, but does not print the syntax. Ours is
//!
//! ```text
//! # anything after a hash is a comment
//! vertices 4
//! 0 0 0
//! 0.1 0 0
//! 0 0.1 0
//! 0 0 0.1
//! elements 1
//! 0 1 2 3
//! display 1
//! 0 2 1
//! ```
//!
//! Coordinates are metres, indices start at 0, blanks separate, blank lines are
//! skipped. Numbers are written so that reading gives back the same bits.

use std::fmt::Write as _;

use crate::{MeshError, TetMesh, surface_triangles};

/// A mesh with the triangles to draw.
#[derive(Debug, Clone, PartialEq)]
pub struct ObjectFile {
    /// Vertices and tetrahedra.
    pub mesh: TetMesh,
    /// Triangles to draw, `#P × 3`, counter-clockwise seen from outside.
    pub display: Vec<[u32; 3]>,
}

/// Why an object file was refused, and the line to look at.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("line {line}: {kind}")]
pub struct ObjectFileError {
    /// Line in the file, counted from 1.
    pub line: usize,
    /// The cause.
    pub kind: ObjectFileErrorKind,
}

/// Why an object file was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ObjectFileErrorKind {
    /// A section does not begin as it must.
    #[error("expected `{keyword} COUNT`, found {found:?}")]
    ExpectedSection {
        /// The section's keyword.
        keyword: &'static str,
        /// The line as it stands.
        found: String,
    },
    /// The file ends too early.
    #[error("the file ends after {read} of {announced} {section}")]
    UnexpectedEnd {
        /// The section that is cut short; `sections` if a whole one is missing.
        section: &'static str,
        /// Lines read.
        read: usize,
        /// Lines announced.
        announced: usize,
    },
    /// A line has too few or too many values.
    #[error("a line of `{section}` has {expected} values, this one {found}")]
    ValueCount {
        /// The section.
        section: &'static str,
        /// Values needed.
        expected: usize,
        /// Values found.
        found: usize,
    },
    /// A value is not a number of the kind needed.
    #[error("value {value} is not {requirement}: {text:?}")]
    BadValue {
        /// Position in the line, counted from 1.
        value: usize,
        /// What it must be.
        requirement: &'static str,
        /// The text found.
        text: String,
    },
    /// A display triangle refers to a vertex that does not exist.
    #[error(
        "display triangle {triangle} refers to vertex {vertex}, but there are only {vertex_count}"
    )]
    DisplayOutOfRange {
        /// Index of the triangle.
        triangle: usize,
        /// The vertex index it holds.
        vertex: u32,
        /// Number of vertices.
        vertex_count: usize,
    },
    /// There is more after the last section.
    #[error("nothing may follow the display list, found {found:?}")]
    TrailingText {
        /// The line as it stands.
        found: String,
    },
    /// The lists do not make a sound mesh.
    #[error(transparent)]
    Mesh(MeshError),
}

impl ObjectFile {
    /// An object whose display list is the surface of the mesh.
    #[must_use]
    pub fn from_mesh(mesh: TetMesh) -> Self {
        let display = surface_triangles(mesh.tets());
        Self { mesh, display }
    }

    /// Reads an object file.
    ///
    /// Memory is bounded by the length of the text, whatever counts it announces.
    ///
    /// # Errors
    ///
    /// [`ObjectFileError`] with the line and the cause; a defect of the mesh, such
    /// as an inverted tetrahedron, is reported at the line of its element or vertex.
    pub fn parse(text: &str) -> Result<Self, ObjectFileError> {
        let mut lines = Lines::new(text);
        let (positions, position_lines) =
            lines.section("vertices", "a finite number", |text: &str| {
                text.parse().ok().filter(|v: &f64| v.is_finite())
            })?;
        let index = |text: &str| text.parse::<u32>().ok();
        let (tets, tet_lines) = lines.section("elements", "a vertex index", index)?;
        let (display, display_lines) = lines.section("display", "a vertex index", index)?;
        if let Some((line, found)) = lines.next() {
            let found = found.to_owned();
            return Err(ObjectFileErrorKind::TrailingText { found }.at(line));
        }

        let vertex_count = positions.len();
        for (triangle, corners) in display.iter().enumerate() {
            for &vertex in corners {
                if vertex as usize >= vertex_count {
                    return Err(ObjectFileErrorKind::DisplayOutOfRange {
                        triangle,
                        vertex,
                        vertex_count,
                    }
                    .at(display_lines[triangle]));
                }
            }
        }
        let mesh = TetMesh::new(positions, tets).map_err(|error| {
            let line = match (error.tet(), error.vertex()) {
                (Some(tet), _) => tet_lines[tet],
                (_, Some(vertex)) => position_lines[vertex],
                _ => 1,
            };
            ObjectFileErrorKind::Mesh(error).at(line)
        })?;
        Ok(Self { mesh, display })
    }

    /// Writes the object file; [`parse`](Self::parse) gives back an equal object.
    #[must_use]
    pub fn to_text(&self) -> String {
        let mut out = String::new();
        let mut section = |keyword: &str, lines: &mut dyn Iterator<Item = String>, count: usize| {
            let _infallible = writeln!(out, "{keyword} {count}");
            for line in lines {
                out.push_str(&line);
                out.push('\n');
            }
        };
        let (positions, tets) = (self.mesh.positions(), self.mesh.tets());
        section(
            "vertices",
            &mut positions.iter().map(joined),
            positions.len(),
        );
        section("elements", &mut tets.iter().map(joined), tets.len());
        section(
            "display",
            &mut self.display.iter().map(joined),
            self.display.len(),
        );
        out
    }
}

fn joined<T: std::fmt::Display, const N: usize>(values: &[T; N]) -> String {
    values.each_ref().map(T::to_string).join(" ")
}

impl ObjectFileErrorKind {
    fn at(self, line: usize) -> ObjectFileError {
        ObjectFileError { line, kind: self }
    }
}

/// The lines that hold something, without comments, with their numbers.
struct Lines<'a> {
    inner: std::iter::Enumerate<std::str::Lines<'a>>,
    last: usize,
}

impl<'a> Iterator for Lines<'a> {
    type Item = (usize, &'a str);

    fn next(&mut self) -> Option<Self::Item> {
        for (index, line) in self.inner.by_ref() {
            self.last = index + 1;
            let content = line.split('#').next().unwrap_or("").trim();
            if !content.is_empty() {
                return Some((index + 1, content));
            }
        }
        None
    }
}

impl<'a> Lines<'a> {
    fn new(text: &'a str) -> Self {
        Self {
            inner: text.lines().enumerate(),
            last: 1,
        }
    }

    /// Reads `keyword COUNT` and that many lines of `N` values.
    fn section<T: Copy + Default, const N: usize>(
        &mut self,
        keyword: &'static str,
        requirement: &'static str,
        parse: impl Fn(&str) -> Option<T>,
    ) -> Result<(Vec<[T; N]>, Vec<usize>), ObjectFileError> {
        let Some((line, header)) = self.next() else {
            return Err(ObjectFileErrorKind::UnexpectedEnd {
                section: "sections: vertices, elements, display",
                read: ["vertices", "elements", "display"]
                    .iter()
                    .position(|&k| k == keyword)
                    .unwrap_or(0),
                announced: 3,
            }
            .at(self.last));
        };
        let mut words = header.split_whitespace();
        let announced = match (words.next(), words.next().map(str::parse), words.next()) {
            (Some(word), Some(Ok(count)), None) if word == keyword => count,
            _ => {
                let found = header.to_owned();
                return Err(ObjectFileErrorKind::ExpectedSection { keyword, found }.at(line));
            }
        };
        let (mut rows, mut numbers) = (Vec::new(), Vec::new());
        while rows.len() < announced {
            let Some((line, content)) = self.next() else {
                return Err(ObjectFileErrorKind::UnexpectedEnd {
                    section: keyword,
                    read: rows.len(),
                    announced,
                }
                .at(self.last));
            };
            let found = content.split_whitespace().count();
            if found != N {
                return Err(ObjectFileErrorKind::ValueCount {
                    section: keyword,
                    expected: N,
                    found,
                }
                .at(line));
            }
            let mut row = [T::default(); N];
            for (i, text) in content.split_whitespace().enumerate() {
                row[i] = parse(text).ok_or_else(|| {
                    ObjectFileErrorKind::BadValue {
                        value: i + 1,
                        requirement,
                        text: text.to_owned(),
                    }
                    .at(line)
                })?;
            }
            rows.push(row);
            numbers.push(line);
        }
        Ok((rows, numbers))
    }
}
