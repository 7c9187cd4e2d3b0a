//! Files: text in, text out; opening and writing them is the caller's business.

mod object_file;

pub use object_file::{ObjectFile, ObjectFileError, ObjectFileErrorKind};
