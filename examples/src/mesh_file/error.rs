//! What can be wrong with a mesh file, and where.

use std::fmt;

/// Longest piece of a file that a message quotes, in characters.
const QUOTED: usize = 40;

/// Why a mesh file cannot be read or written.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MeshFileError {
    /// The name of the file says nothing of its format.
    #[error("the name ends in {extension:?}; .obj, .ply and .stl are known")]
    UnknownFormat {
        /// What follows the last dot; empty if there is none.
        extension: String,
    },
    /// There is nothing to deform.
    #[error("there are no vertices in it")]
    NoVertices,
    /// An STL consists of faces, and there are none.
    #[error("there are no faces to write")]
    NoFaces,
    /// Something at a known place.
    #[error("{place}: {problem}")]
    At {
        /// Where to look.
        place: Place,
        /// What is wrong there.
        problem: Problem,
    },
}

/// A place in a mesh file.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum Place {
    /// A line of text, counted from one.
    Line(usize),
    /// The header.
    Header,
    /// One of many: `vertex 7`, `face 2`, counted from zero.
    Item {
        /// What there are many of.
        name: String,
        /// Which of them.
        index: usize,
    },
}

impl Place {
    pub(super) fn item(name: &str, index: usize) -> Self {
        Self::Item {
            name: name.to_owned(),
            index,
        }
    }

    /// An error here.
    pub(super) fn error(self, problem: Problem) -> MeshFileError {
        MeshFileError::At {
            place: self,
            problem,
        }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => write!(f, "line {line}"),
            Self::Header => f.write_str("header"),
            Self::Item { name, index } => write!(f, "{name} {index}"),
        }
    }
}

/// What is wrong at a [`Place`].
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Problem {
    /// A number was expected.
    #[error("\"{text}\" is not a number")]
    NotANumber {
        /// What is there, cut if long.
        text: String,
    },
    /// An infinite coordinate, one too large for its type, or not-a-number.
    #[error("the coordinate {value} is not finite or does not fit its type")]
    NotFinite {
        /// The coordinate.
        value: f64,
    },
    /// A whole number was expected.
    #[error("\"{text}\" is not an index")]
    NotAnIndex {
        /// What is there, cut if long.
        text: String,
    },
    /// An index to nothing.
    #[error("refers to {of} {index}, but there are {count}")]
    IndexOutOfRange {
        /// What it should refer to.
        of: &'static str,
        /// The index as the file has it.
        index: i64,
        /// How many there are.
        count: usize,
    },
    /// Values are missing.
    #[error("{found} values where {expected} are needed")]
    TooFewValues {
        /// How many belong there.
        expected: usize,
        /// How many are there.
        found: usize,
    },
    /// More values than the header declares.
    #[error("more values than were declared")]
    TooManyValues,
    /// The file ends too early.
    #[error("the file ends here")]
    UnexpectedEnd,
    /// Another statement was expected.
    #[error("expected \"{expected}\", found \"{found}\"")]
    UnexpectedStatement {
        /// What belongs there.
        expected: &'static str,
        /// What is there, cut if long.
        found: String,
    },
    /// The header declares more than the file can hold.
    #[error("{count} × {element} are declared, more than the file can hold")]
    CountTooLarge {
        /// The element declared.
        element: String,
        /// How many there should be.
        count: usize,
    },
    /// A property is missing or of a type that cannot be used.
    #[error("{element} needs a property {property} of type {needed}")]
    Property {
        /// The element.
        element: &'static str,
        /// The property.
        property: &'static str,
        /// The types that can be used.
        needed: &'static str,
    },
    /// A list has a negative length.
    #[error("a list of length {length}")]
    ListLength {
        /// The length.
        length: i64,
    },
    /// The header is not understood.
    #[error("{message}")]
    Header {
        /// Why.
        message: String,
    },
    /// The target format cannot count so many.
    #[error("{count} {of} are more than the format can hold")]
    TooMany {
        /// What there are too many of.
        of: &'static str,
        /// How many there are.
        count: usize,
    },
}

/// A piece of a file as a message may show it: on one line, and not for ever.
pub(super) fn quote(bytes: &[u8]) -> String {
    // Four bytes make a character at most.
    let start = &bytes[..bytes.len().min(4 * QUOTED)];
    let text = String::from_utf8_lossy(start);
    let mut quoted: String = text.chars().take(QUOTED).collect();
    if quoted.len() < text.len() || start.len() < bytes.len() {
        quoted.push('…');
    }
    quoted.escape_debug().to_string()
}

/// Reads a number of text.
pub(super) fn number<T: std::str::FromStr>(text: &[u8]) -> Result<T, Problem> {
    std::str::from_utf8(text)
        .ok()
        .and_then(|text| text.parse().ok())
        .ok_or_else(|| Problem::NotANumber { text: quote(text) })
}

/// Rounds to single precision, unless that is infinite.
#[expect(clippy::cast_possible_truncation, reason = "rounding is the purpose")]
pub(super) fn to_f32(value: f64) -> Result<f32, Problem> {
    let rounded = value as f32;
    if rounded.is_finite() {
        Ok(rounded)
    } else {
        Err(Problem::NotFinite { value })
    }
}

/// The value itself, if it is finite.
pub(super) fn finite(value: f64) -> Result<f64, Problem> {
    if value.is_finite() {
        Ok(value)
    } else {
        Err(Problem::NotFinite { value })
    }
}
