//! B-splines: the functions that blend control points.

mod axis;
mod basis;
mod bezier;
mod degree;
mod insertion;

pub use axis::{Axis, Knots};
pub(crate) use basis::{CellBasis, Real};
pub(crate) use bezier::{BezierTables, ToBezier};
pub use degree::{Degree, MAX_ORDER};
pub(crate) use insertion::Insertion;
