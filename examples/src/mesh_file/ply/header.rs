//! The header of a PLY file: what is to be found in it, and where.

use ply_rs_bw::{
    parser::{ParseError, Parser, Reader},
    ply::{DefaultElement, ElementDef, Encoding, PropertyDef, PropertyType},
};

use super::{
    super::error::{MeshFileError, Place, Problem, quote},
    value::Kind,
};

/// What a program calls the corners of a face.
const INDICES: [&str; 2] = ["vertex_indices", "vertex_index"];

/// How many properties of an element are named to the user.
const SHOWN: usize = 8;

/// What one property of an element holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Field {
    /// A number; a coordinate if it has a place among [`COORDINATES`].
    Scalar {
        kind: Kind,
        coordinate: Option<usize>,
    },
    /// A list; `is_face` if these are the corners of a face.
    List {
        length: Kind,
        kind: Kind,
        is_face: bool,
    },
}

/// The properties of a vertex that change.
pub(super) const COORDINATES: [&str; 6] = ["x", "y", "z", "nx", "ny", "nz"];

/// What the payload consists of, one after the other.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) count: usize,
    pub(super) fields: Vec<Field>,
}

impl Element {
    /// Whether these are the vertices.
    pub(super) fn is_vertex(&self) -> bool {
        self.name == "vertex"
    }

    /// Whether these are vertices, some coordinate of which is in single precision.
    pub(super) fn is_single(&self) -> bool {
        self.fields.iter().any(|field| {
            let coordinate = Some(0)..Some(3);
            matches!(field, Field::Scalar { kind: Kind::F32, coordinate: c } if coordinate.contains(c))
        })
    }

    /// The fewest bytes that one can take.
    fn least_size(&self, is_text: bool) -> usize {
        let sizes = self.fields.iter().map(|field| match *field {
            // A digit, and what separates it from the next one.
            _ if is_text => 2,
            Field::Scalar { kind, .. } => kind.size(),
            Field::List { length, .. } => length.size(),
        });
        sizes.sum()
    }

    /// The bytes that each one takes, if it is always the same and nothing in it matters.
    pub(super) fn skipped_size(&self) -> Option<usize> {
        let sizes = self.fields.iter().map(|field| match *field {
            Field::Scalar {
                kind,
                coordinate: None,
            } => Some(kind.size()),
            _ => None,
        });
        sizes.sum()
    }
}

/// A header.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Header {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element>,
    /// Whether every vertex has a normal.
    pub(super) has_normals: bool,
    /// Where the payload begins.
    pub(super) end: usize,
    /// Elements and properties that are no geometry.
    pub(super) extras: Vec<String>,
}

impl Header {
    pub(super) fn parse(bytes: &[u8]) -> Result<Self, MeshFileError> {
        let unclear = |message: &str| {
            Place::Header.error(Problem::Header {
                message: message.to_owned(),
            })
        };
        // The crate would read whatever is there as one line, and text that is not UTF-8,
        // as comments may be, as the end.
        let mut end = 0;
        let mut declared = 0;
        let mut found = false;
        for (number, line) in bytes.split_inclusive(|&byte| byte == b'\n').enumerate() {
            end += line.len();
            let line = line.trim_ascii();
            if number == 0 && line != b"ply" {
                return Err(unclear("a PLY file begins with the line \"ply\""));
            }
            let first = line.split(u8::is_ascii_whitespace).next();
            declared += usize::from(matches!(first, Some(b"element" | b"property")));
            if line == b"end_header" {
                found = true;
                break;
            }
        }
        if !found {
            return Err(unclear("there is no line \"end_header\""));
        }
        let text = String::from_utf8_lossy(&bytes[..end]);
        let header = Parser::<DefaultElement>::new()
            .read_header(&mut Reader::new(text.as_bytes()))
            .map_err(|error| not_understood(&error, &text))?;

        // The crate keeps the last of two that have the same name.
        let properties = header.elements.values().map(|e| e.properties.len());
        if header.elements.len() + properties.sum::<usize>() != declared {
            return Err(unclear("two elements or properties have the same name"));
        }
        let mut this = Self {
            encoding: header.encoding,
            elements: Vec::with_capacity(header.elements.len()),
            has_normals: false,
            end,
            extras: Vec::new(),
        };
        for element in header.elements.values() {
            this.add(element)?;
        }
        this.check_counts(bytes.len() - end)?;
        Ok(this)
    }

    /// Whether the payload is text.
    pub(super) fn is_text(&self) -> bool {
        self.encoding == Encoding::Ascii
    }

    /// Adds an element with what matters in it.
    fn add(&mut self, element: &ElementDef) -> Result<(), MeshFileError> {
        let is_vertex = element.name == "vertex";
        if is_vertex {
            for property in &COORDINATES[..3] {
                if element
                    .properties
                    .get(*property)
                    .is_none_or(|p| !is_real(p))
                {
                    return Err(Place::Header.error(Problem::Property {
                        element: "vertex",
                        property,
                        needed: "float or double",
                    }));
                }
            }
            self.has_normals = COORDINATES[3..]
                .iter()
                .all(|&name| element.properties.get(name).is_some_and(is_real));
        }
        let indices = INDICES
            .into_iter()
            .find(|&name| element.name == "face" && element.properties.contains_key(name));
        let mut fields = Vec::with_capacity(element.properties.len());
        let mut others = Vec::new();
        for (name, property) in &element.properties {
            let coordinate = COORDINATES
                .iter()
                .position(|c| is_vertex && c == name)
                .filter(|&c| c < 3 || self.has_normals);
            let is_face = indices == Some(name);
            let (is_list, length, kind) = match &property.data_type {
                PropertyType::Scalar(scalar) => (false, Kind::U8, Kind::of(scalar)),
                PropertyType::List(length, scalar) => (true, Kind::of(length), Kind::of(scalar)),
            };
            if is_face && (!is_list || kind.is_real()) {
                return Err(Place::Header.error(Problem::Property {
                    element: "face",
                    property: indices.unwrap_or_default(),
                    needed: "list of whole numbers",
                }));
            }
            if length.is_real() {
                let message = format!("the length of a list {name} is no whole number");
                return Err(Place::Header.error(Problem::Header { message }));
            }
            fields.push(if is_list {
                Field::List {
                    length,
                    kind,
                    is_face,
                }
            } else {
                Field::Scalar { kind, coordinate }
            });
            if coordinate.is_none() && !is_face {
                others.push(name.as_str());
            }
        }
        let others = shown(&others);
        if !is_vertex && indices.is_none() {
            self.extras.push(format!("the element {}", element.name));
        } else if !others.is_empty() {
            self.extras.push(format!("{others} of {}", element.name));
        }
        self.elements.push(Element {
            name: element.name.clone(),
            count: element.count,
            fields,
        });
        Ok(())
    }

    /// Refuses counts that the rest of the file cannot hold, before memory is asked for.
    fn check_counts(&self, available: usize) -> Result<(), MeshFileError> {
        let is_text = self.is_text();
        // The last number of a text needs nothing behind it.
        let mut left = available + usize::from(is_text);
        for element in &self.elements {
            left = element
                .count
                .checked_mul(element.least_size(is_text))
                .and_then(|needed| left.checked_sub(needed))
                .ok_or_else(|| {
                    Place::Header.error(Problem::CountTooLarge {
                        element: element.name.clone(),
                        count: element.count,
                    })
                })?;
        }
        Ok(())
    }
}

/// What the crate says, in one line.
fn not_understood(error: &ParseError, text: &str) -> MeshFileError {
    // Its messages quote the line, and say what its grammar expects, on further lines.
    let message = error.to_string();
    let Some(number) = error.line() else {
        let message = message.lines().next().unwrap_or_default().to_owned();
        return Place::Header.error(Problem::Header { message });
    };
    let line = text.lines().nth(number.saturating_sub(1));
    let line = quote(line.unwrap_or_default().as_bytes());
    Place::Line(number).error(Problem::Header {
        message: format!("\"{line}\" cannot be understood here"),
    })
}

/// The names, or the first of very many.
fn shown(names: &[&str]) -> String {
    let (first, rest) = names.split_at(names.len().min(SHOWN));
    let mut text = first.join(", ");
    if !rest.is_empty() {
        text += &format!(" and {} more", rest.len());
    }
    text
}

/// Whether a property holds one real number.
fn is_real(property: &PropertyDef) -> bool {
    matches!(&property.data_type, PropertyType::Scalar(scalar) if Kind::of(scalar).is_real())
}
