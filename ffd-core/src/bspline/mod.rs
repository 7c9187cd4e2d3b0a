//! B-splines: the functions that blend control points.

mod axis;
mod basis;
mod degree;
mod insertion;

pub use axis::{Axis, Knots};
pub(crate) use basis::{CellBasis, Real};
pub use degree::{Degree, MAX_ORDER};
pub(crate) use insertion::Insertion;
