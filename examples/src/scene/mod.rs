//! The objects a hand can squeeze.

mod hex;
mod objects;

pub use objects::{Object, ObjectKind, Resolution};
