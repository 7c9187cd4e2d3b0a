//! B-splines: the functions that blend control points.

mod degree;
mod uniform;

pub use degree::{Degree, MAX_ORDER};
pub use uniform::{rest_coordinate, uniform_basis};
