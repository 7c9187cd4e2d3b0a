//! The payload of a PLY file: one element after the other, as text or binary.

use std::ops::Range;

use super::{
    super::error::{MeshFileError, Place, Problem},
    header::{COORDINATES, Element, Field, Header},
    value::Kind,
};

/// Where the coordinates of a vertex stand, and what they are stored as.
pub(super) type VertexPlaces = [(Range<usize>, Kind); COORDINATES.len()];

/// What a payload is read for.
pub(super) trait Visitor {
    /// A vertex. Without normals, the last three places are empty.
    fn vertex(&mut self, index: usize, places: &VertexPlaces) -> Result<(), MeshFileError>;

    /// The corners of a face, unchecked.
    fn face(&mut self, index: usize, corners: &[i64]) -> Result<(), MeshFileError>;
}

/// Goes through all elements in the order of the file.
pub(super) fn visit(
    source: &[u8],
    header: &Header,
    visitor: &mut impl Visitor,
) -> Result<(), MeshFileError> {
    let mut values = Values {
        source,
        header,
        at: header.end,
        line_end: header.end,
    };
    let mut places = [const { (0..0, Kind::F64) }; COORDINATES.len()];
    let mut corners = Vec::new();
    for element in &header.elements {
        if values.skip(element)? {
            continue;
        }
        for index in 0..element.count {
            let here = |problem| Place::item(&element.name, index).error(problem);
            values.begin().map_err(here)?;
            let mut is_face = false;
            for (done, field) in element.fields.iter().enumerate() {
                let missing = |problem| match problem {
                    Problem::TooFewValues { .. } => here(Problem::TooFewValues {
                        expected: element.fields.len(),
                        found: done,
                    }),
                    other => here(other),
                };
                match *field {
                    Field::Scalar { kind, coordinate } => {
                        let place = values.next(kind).map_err(missing)?;
                        if let Some(coordinate) = coordinate {
                            places[coordinate] = (place, kind);
                        }
                    }
                    Field::List {
                        length,
                        kind,
                        is_face: wanted,
                    } => {
                        let place = values.next(length).map_err(missing)?;
                        let count = length.whole(&source[place], header.encoding);
                        let count = count.map_err(here)?;
                        let into = wanted.then_some(&mut corners);
                        values.list(count, kind, into).map_err(here)?;
                        is_face |= wanted;
                    }
                }
            }
            values.end().map_err(here)?;
            if is_face {
                visitor.face(index, &corners)?;
            }
            if element.is_vertex() {
                visitor.vertex(index, &places)?;
            }
        }
    }
    Ok(())
}

/// Takes one value after the other.
struct Values<'a> {
    source: &'a [u8],
    header: &'a Header,
    at: usize,
    /// Where the line of the present element ends, in a text.
    line_end: usize,
}

impl Values<'_> {
    /// Passes over elements that need not be looked at, if that can be done at once.
    fn skip(&mut self, element: &Element) -> Result<bool, MeshFileError> {
        if element.fields.is_empty() {
            return Ok(true);
        }
        let Some(size) = element.skipped_size().filter(|_| !self.header.is_text()) else {
            return Ok(false);
        };
        let available = (self.source.len() - self.at) / size;
        if available < element.count {
            return Err(Place::item(&element.name, available).error(Problem::UnexpectedEnd));
        }
        self.at += size * element.count;
        Ok(true)
    }

    /// Begins an element: in a text, on the next line that is not empty.
    fn begin(&mut self) -> Result<(), Problem> {
        if !self.header.is_text() {
            return Ok(());
        }
        self.at = self.line_end;
        let rest = &self.source[self.at..];
        let blank = rest.iter().position(|byte| !byte.is_ascii_whitespace());
        self.at += blank.ok_or(Problem::UnexpectedEnd)?;
        let rest = &self.source[self.at..];
        let length = rest.iter().position(|&byte| byte == b'\n');
        self.line_end = self.at + length.unwrap_or(rest.len());
        Ok(())
    }

    /// Ends an element.
    fn end(&mut self) -> Result<(), Problem> {
        let is_done = !self.header.is_text()
            || self.source[self.at..self.line_end]
                .iter()
                .all(u8::is_ascii_whitespace);
        is_done.then_some(()).ok_or(Problem::TooManyValues)
    }

    /// Where the next value stands.
    fn next(&mut self, kind: Kind) -> Result<Range<usize>, Problem> {
        if self.header.is_text() {
            let rest = &self.source[self.at..self.line_end];
            let start = rest.iter().position(|byte| !byte.is_ascii_whitespace());
            // The caller knows how many there should be.
            let (expected, found) = (1, 0);
            let start = self.at + start.ok_or(Problem::TooFewValues { expected, found })?;
            let rest = &self.source[start..self.line_end];
            let length = rest.iter().position(u8::is_ascii_whitespace);
            self.at = start + length.unwrap_or(rest.len());
            return Ok(start..self.at);
        }
        let start = self.at;
        if self.source.len() - start < kind.size() {
            return Err(Problem::UnexpectedEnd);
        }
        self.at += kind.size();
        Ok(start..self.at)
    }

    /// Takes a list of so many values, which may be wanted.
    fn list(
        &mut self,
        length: i64,
        kind: Kind,
        mut into: Option<&mut Vec<i64>>,
    ) -> Result<(), Problem> {
        let count = usize::try_from(length).map_err(|_| Problem::ListLength { length })?;
        if let Some(values) = &mut into {
            values.clear();
        } else if !self.header.is_text() {
            let size = count.checked_mul(kind.size());
            let size = size.filter(|&size| size <= self.source.len() - self.at);
            self.at += size.ok_or(Problem::UnexpectedEnd)?;
            return Ok(());
        }
        for found in 0..count {
            let place = self.next(kind).map_err(|problem| match problem {
                Problem::TooFewValues { .. } => Problem::TooFewValues {
                    expected: count,
                    found,
                },
                other => other,
            })?;
            if let Some(values) = &mut into {
                values.push(kind.whole(&self.source[place], self.header.encoding)?);
            }
        }
        Ok(())
    }
}
