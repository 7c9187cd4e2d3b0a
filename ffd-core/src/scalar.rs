//! The two precisions in which many points are evaluated.

use fearless_simd::Level;

use crate::kernel;

/// `f32` or `f64`: the precision of a bound mesh.
///
/// Sealed: no other type can implement it.
pub trait Scalar: Copy + PartialEq + std::fmt::Debug + Send + Sync + 'static + Kernel {
    /// The nearest value.
    fn from_f64(value: f64) -> Self;
    /// The same value.
    fn to_f64(self) -> f64;
}

/// The compiled kernels for a precision. Not generic, so that they are compiled once,
/// here, and not in every crate that calls them with a vector type of its own.
pub trait Kernel: Sized {
    /// Images of up to [`kernel::CHUNK`] points of one cell.
    #[doc(hidden)]
    fn values(level: Level, cell: &kernel::Cell<'_, Self>, out: &mut [[Self; kernel::CHUNK]]);
    /// Images, followed by the rows of the Jacobians.
    #[doc(hidden)]
    fn jacobians(level: Level, cell: &kernel::Cell<'_, Self>, out: &mut [[Self; kernel::CHUNK]]);
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "rounding to the nearest value is what is asked for"
)]
impl Scalar for f32 {
    #[inline]
    fn from_f64(value: f64) -> Self {
        value as Self
    }

    #[inline]
    fn to_f64(self) -> f64 {
        f64::from(self)
    }
}

impl Scalar for f64 {
    #[inline]
    fn from_f64(value: f64) -> Self {
        value
    }

    #[inline]
    fn to_f64(self) -> f64 {
        self
    }
}
