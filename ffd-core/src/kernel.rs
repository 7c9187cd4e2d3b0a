//! Evaluation of many points of one cell, one in each lane of a vector.
//!
//! Vectors are as wide as the CPU at hand allows; the choice is made when the program
//! runs. Lanes never meet, products and sums are never fused, so every width gives the
//! same result to the last bit.

use fearless_simd::{Level, Simd, SimdFloat, dispatch};

use crate::blend::{Block, blend, blend_with_partials};
use crate::bspline::{CellBasis, MAX_ORDER, Real};
use crate::scalar::Kernel;

/// Points evaluated in one call; a multiple of the widest vector.
pub(crate) const CHUNK: usize = 64;

/// Points in a group: the lanes of the widest vector.
pub(crate) const fn group<T>() -> usize {
    64 / size_of::<T>()
}

/// Points of one cell, and all that determines their images. Slices without further
/// explanation hold one entry per axis.
#[derive(Debug)]
pub struct Cell<'a, T> {
    /// Basis functions that are not zero.
    pub(crate) order: &'a [usize],
    /// The basis.
    pub(crate) bases: &'a [&'a CellBasis<T>],
    /// Displacements of the control points of the cell, first axis fastest, components
    /// together.
    pub(crate) block: &'a [T],
    /// The inverse of the frame, row by row.
    pub(crate) inverse: &'a [T],
    /// The points, in groups: first their positions within the cell, one list of
    /// [`group`] numbers per axis, then in the same way their positions in the world at
    /// rest. One stream of memory instead of six.
    pub(crate) groups: &'a [T],
    /// How many points there are, at most [`CHUNK`].
    pub(crate) count: usize,
}

impl<T> Cell<'_, T> {
    /// The list of a group that begins with a point, `list` being an axis or, from the
    /// dimension on, a coordinate.
    #[inline(always)]
    fn lanes<const D: usize>(&self, point: usize, list: usize) -> &[T] {
        let group = group::<T>();
        let start = point / group * (2 * D * group) + list * group + point % group;
        &self.groups[start..]
    }
}

/// Implements the kernels of a precision; `$vector` is the vector type of a SIMD level.
macro_rules! kernels {
    ($scalar:ty, $vector:ident) => {
        impl Kernel for $scalar {
            fn values(level: Level, cell: &Cell<'_, Self>, out: &mut [[Self; CHUNK]]) {
                kernels!(@dispatch $scalar, $vector, values(level, cell, out))
            }

            fn jacobians(level: Level, cell: &Cell<'_, Self>, out: &mut [[Self; CHUNK]]) {
                kernels!(@dispatch $scalar, $vector, jacobians(level, cell, out))
            }
        }
    };
    (@dispatch $scalar:ty, $vector:ident, $kernel:ident($level:expr, $cell:expr, $out:expr)) => {
        // Each of these becomes a function of its own for each level.
        match $cell.order {
            [4, 4] => dispatch!($level, s => kernels!(@run $kernel, s, $vector, $scalar, Cubic, 2, $cell, $out)),
            [_, _] => dispatch!($level, s => kernels!(@run $kernel, s, $vector, $scalar, Mixed, 2, $cell, $out)),
            [4, 4, 4] => dispatch!($level, s => kernels!(@run $kernel, s, $vector, $scalar, Cubic, 3, $cell, $out)),
            _ => dispatch!($level, s => kernels!(@run $kernel, s, $vector, $scalar, Mixed, 3, $cell, $out)),
        }
    };
    (@run $kernel:ident, $simd:ident, $vector:ident, $scalar:ty, $order:ty, $d:literal, $cell:expr, $out:expr) => {{
        #[inline(always)]
        fn run<S: Simd>(simd: S, cell: &Cell<'_, $scalar>, out: &mut [[$scalar; CHUNK]]) {
            $kernel::<S, S::$vector, $scalar, $order, $d>(simd, cell, out);
        }
        run($simd, $cell, $out)
    }};
}

kernels!(f32, f32s);
kernels!(f64, f64s);

/// How many basis functions there are, known when compiled or not.
trait Order {
    fn order<const D: usize>(given: &[usize]) -> [usize; D];
}

/// Degree 3 along all axes: loops of four steps, which the compiler unrolls.
struct Cubic;

impl Order for Cubic {
    #[inline(always)]
    fn order<const D: usize>(_: &[usize]) -> [usize; D] {
        [4; D]
    }
}

/// Any degrees.
struct Mixed;

impl Order for Mixed {
    #[inline(always)]
    fn order<const D: usize>(given: &[usize]) -> [usize; D] {
        let mut order = [0; D];
        order.copy_from_slice(given);
        order
    }
}

#[inline(always)]
fn values<S, V, T, O, const D: usize>(simd: S, cell: &Cell<'_, T>, out: &mut [[T; CHUNK]])
where
    S: Simd,
    V: SimdFloat<S, Element = T> + Real<T>,
    T: Copy + From<u8>,
    O: Order,
{
    let order: [usize; D] = O::order(cell.order);
    let block = Gathered::new(cell, order);
    let (zero, one) = (V::splat(simd, T::from(0_u8)), V::splat(simd, T::from(1_u8)));
    let mut at = 0;
    while at < cell.count {
        let mut weights = [[zero; MAX_ORDER]; D];
        for axis in 0..D {
            let t = V::from_slice(simd, &cell.lanes::<D>(at, axis)[..V::LEN]);
            weights[axis] = cell.bases[axis].values(order[axis] - 1, t, zero, one);
        }
        let moved = blend(order, &weights, &block, zero);
        for c in 0..D {
            let rest = V::from_slice(simd, &cell.lanes::<D>(at, D + c)[..V::LEN]);
            (rest + moved[c]).store_slice(&mut out[c][at..at + V::LEN]);
        }
        at += V::LEN;
    }
}

#[inline(always)]
fn jacobians<S, V, T, O, const D: usize>(simd: S, cell: &Cell<'_, T>, out: &mut [[T; CHUNK]])
where
    S: Simd,
    V: SimdFloat<S, Element = T> + Real<T>,
    T: Copy + From<u8>,
    O: Order,
{
    let order: [usize; D] = O::order(cell.order);
    let block = Gathered::new(cell, order);
    let (zero, one) = (V::splat(simd, T::from(0_u8)), V::splat(simd, T::from(1_u8)));
    let mut at = 0;
    while at < cell.count {
        let mut weights = [[[zero; MAX_ORDER]; 2]; D];
        for axis in 0..D {
            let t = V::from_slice(simd, &cell.lanes::<D>(at, axis)[..V::LEN]);
            weights[axis] = cell.bases[axis].values_and_slopes(order[axis] - 1, t, zero, one);
        }
        let (moved, partials) = blend_with_partials(order, &weights, &block, zero);
        for c in 0..D {
            let rest = V::from_slice(simd, &cell.lanes::<D>(at, D + c)[..V::LEN]);
            (rest + moved[c]).store_slice(&mut out[c][at..at + V::LEN]);
        }
        for r in 0..D {
            for c in 0..D {
                let mut chain = partials[0][r] * cell.inverse[c];
                for a in 1..D {
                    chain += partials[a][r] * cell.inverse[D * a + c];
                }
                let unit = if r == c { one } else { zero };
                (unit + chain).store_slice(&mut out[D + D * r + c][at..at + V::LEN]);
            }
        }
        at += V::LEN;
    }
}

/// The displacements of the control points of a cell, gathered.
struct Gathered<'a, T, const D: usize> {
    displacements: &'a [[T; D]],
    order: [usize; D],
}

impl<'a, T, const D: usize> Gathered<'a, T, D> {
    #[inline(always)]
    fn new(cell: &Cell<'a, T>, order: [usize; D]) -> Self {
        let count: usize = order.iter().product();
        // One check here instead of one for each control point.
        let (displacements, _) = cell.block[..count * D].as_chunks();
        Self {
            displacements: &displacements[..count],
            order,
        }
    }
}

impl<T: Copy, const D: usize> Block<T, D> for Gathered<'_, T, D> {
    #[inline(always)]
    fn component(&self, index: [usize; D], component: usize) -> T {
        let mut at = 0;
        for axis in (0..D).rev() {
            at = at * self.order[axis] + index[axis];
        }
        self.displacements[at][component]
    }
}
