//! Grids of all kinds.

use super::numbers::{Layout, Made, Reader};
use crate::{Border, Degree, Frame, Grid, Knots, MAX_ORDER};
use proptest::strategy::Strategy;

/// For tests there is no need of more along an axis; numbers for the displacements of all
/// control points are drawn in advance.
const MOST_CELLS: usize = 32;

/// An identity border makes a domain many times larger, and a test of it that much slower.
/// Unless it is asked for, it is laid only where the domain then has no more cells.
const MOST_CELLS_WITH_BORDER: usize = 125;

/// Which grids a strategy may choose.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GridOptions {
    /// Fewest and most cells along each axis, from 1 to 32.
    pub cells: [usize; 2],
    /// Lowest and highest degree, from 1 to 5, chosen for each axis.
    pub degrees: [usize; 2],
    /// The knots; `None` for either kind, chosen for each axis.
    pub knots: Option<Knots>,
    /// The border; `None` for either kind. An identity border, which needs uniform knots
    /// and more cells, is then laid only where the domain has at most 125 cells.
    pub border: Option<Border>,
    /// The frames, which shrink to the unit frame.
    pub frames: Frames,
}

impl Default for GridOptions {
    /// One or two cells along each axis, and everything else there is.
    fn default() -> Self {
        Self {
            cells: [1, 2],
            degrees: [1, MAX_ORDER - 1],
            knots: None,
            border: None,
            frames: Frames::Skewed,
        }
    }
}

/// Kinds of frames, each of which includes those before. Components of axes are short
/// binary fractions, so that few products with them are rounded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub enum Frames {
    /// Lattice coordinates are world coordinates.
    Unit,
    /// Axis-aligned boxes of cells that are from a quarter to four long along each axis.
    Scaled,
    /// Such boxes skewed, and mirrored every other time.
    #[default]
    Skewed,
}

impl GridOptions {
    /// What is wrong with these options, if anything is.
    pub(super) fn check(&self) -> Result<(), String> {
        let [fewest, most] = self.cells;
        if fewest == 0 || most < fewest || most > MOST_CELLS {
            return Err(format!(
                "cells: from {fewest} to {most} is no range between 1 and {MOST_CELLS}"
            ));
        }
        let [lowest, highest] = self.degrees;
        if lowest == 0 || highest < lowest || highest >= MAX_ORDER {
            return Err(format!(
                "degrees: from {lowest} to {highest} is no range between 1 and {}",
                MAX_ORDER - 1
            ));
        }
        if self.knots == Some(Knots::Clamped) && self.border == Some(Border::Identity) {
            return Err("an identity border needs uniform knots".into());
        }
        Ok(())
    }

    /// The same with a free border, for maps that an identity border does not allow. What
    /// is wrong with the options stays wrong.
    pub(super) fn with_free_border(self) -> Self {
        match self.check() {
            Ok(()) => Self {
                border: Some(Border::Free),
                ..self
            },
            Err(_) => self,
        }
    }

    /// The most control points along an axis.
    pub(super) fn most_control_points(&self) -> usize {
        self.cells[1] + self.degrees[1]
    }

    /// Appends the numbers of which [`Shape::read`] makes a grid.
    pub(super) fn push<const D: usize>(&self, layout: &mut Layout) {
        layout.push(0..=self.frames as i32);
        layout.push(0..=i32::from(self.border.is_none()));
        for [least, most] in [[self.cells; D], [self.degrees; D]].as_flattened() {
            layout.push(0..=int(most - least));
        }
        for _ in 0..D {
            layout.push(0..=i32::from(self.knots.is_none()));
        }
        for _ in 0..D {
            layout.push(-16..=16);
        }
        layout.push(0..=1);
        push_matrix::<D>(layout);
    }
}

/// A small number.
pub(super) fn int(count: usize) -> i32 {
    i32::try_from(count).expect("a small number")
}

/// Lengths, the simplest first.
const LENGTHS: [f64; 7] = [1.0, 2.0, 0.5, 1.5, 4.0, 0.75, 0.25];

/// Appends the numbers of which [`read_matrix`] makes a matrix.
pub(super) fn push_matrix<const D: usize>(layout: &mut Layout) {
    for _ in 0..D {
        layout.push(0..=int(LENGTHS.len() - 1));
    }
    for _ in 0..D * (D - 1) {
        layout.push(-3..=3);
    }
}

/// A positive diagonal matrix times one whose diagonal dominates the rows, so that its
/// determinant is positive: two factors, the second as `[row][column]`.
pub(super) fn read_matrix<const D: usize>(reader: &mut Reader) -> ([f64; D], [[f64; D]; D]) {
    let lengths = std::array::from_fn(|_| LENGTHS[reader.next_index()]);
    let skewed = std::array::from_fn(|r| {
        std::array::from_fn(|c| {
            if r == c {
                1.0
            } else {
                // At most 3/8, and twice that is less than 1.
                f64::from(reader.next()) / 8.0
            }
        })
    });
    (lengths, skewed)
}

/// What makes up a grid; strategies may change it before it is built.
#[derive(Debug, Clone)]
pub(super) struct Shape<const D: usize> {
    pub(super) cells: [usize; D],
    pub(super) degrees: [usize; D],
    pub(super) knots: [Knots; D],
    pub(super) border: Border,
    pub(super) frame: Frame<D>,
}

impl<const D: usize> Shape<D> {
    /// A shape of the numbers that [`GridOptions::push`] has laid out.
    pub(super) fn read(options: &GridOptions, reader: &mut Reader) -> Self {
        let frames = reader.next();
        let with_border = reader.next() == 1;
        let cells = std::array::from_fn(|_| options.cells[0] + reader.next_index());
        let degrees = std::array::from_fn(|_| options.degrees[0] + reader.next_index());
        let mut knots = std::array::from_fn(|_| match (options.knots, reader.next()) {
            (Some(knots), _) => knots,
            (None, 0) => Knots::Uniform,
            (None, _) => Knots::Clamped,
        });
        let origin: [f64; D] = std::array::from_fn(|_| f64::from(reader.next()) / 4.0);
        let is_mirrored = reader.next() == 1;
        let (lengths, skewed) = read_matrix::<D>(reader);

        let domain: usize = (0..D).map(|i| cells[i] + 2 * degrees[i]).product();
        let border = match options.border {
            Some(border) => border,
            None if with_border && domain <= MOST_CELLS_WITH_BORDER => match options.knots {
                Some(Knots::Clamped) => Border::Free,
                _ => Border::Identity,
            },
            None => Border::Free,
        };
        if border == Border::Identity {
            knots = [Knots::Uniform; D];
        }
        let axis = |i: usize| match frames {
            0 | 1 => std::array::from_fn(|c| if c == i { lengths[i] } else { 0.0 }),
            _ if is_mirrored && i == 0 => skewed[i].map(|x| -x * lengths[i]),
            _ => skewed[i].map(|x| x * lengths[i]),
        };
        let frame = match frames {
            0 => Frame::unit(),
            _ => Frame::new(origin, std::array::from_fn(axis)).expect("independent axes"),
        };
        Self {
            cells,
            degrees,
            knots,
            border,
            frame,
        }
    }

    /// The grid; `None` if it does not fit into memory.
    pub(super) fn grid(&self) -> Option<Grid<D>> {
        let degree = self
            .degrees
            .map(|n| Degree::new(n).expect("between 1 and 5"));
        Grid::new(degree, self.cells, self.frame)
            .and_then(|grid| grid.with_knots(self.knots))
            .and_then(|grid| grid.with_border(self.border))
            .ok()
    }
}

/// Grids of all kinds that the options allow.
///
/// They shrink to few cells, low degrees, uniform knots, a free border and the unit frame.
///
/// # Errors
///
/// A strategy whose options are no ranges makes no values, and a test with it ends with
/// the reason. That holds for all strategies here.
///
/// # Example
///
/// ```
/// use ffd_core::strategies::{GridOptions, grids};
/// use proptest::prelude::*;
///
/// let options = GridOptions { degrees: [3, 3], ..GridOptions::default() };
/// let mut runner = proptest::test_runner::TestRunner::deterministic();
/// runner.run(&grids::<2>(options), |grid| {
///     prop_assert!(grid.control_points_per_axis().iter().all(|n| (4..=5).contains(n)));
///     Ok(())
/// })?;
/// # Ok::<(), proptest::test_runner::TestError<ffd_core::Grid<2>>>(())
/// ```
pub fn grids<const D: usize>(
    options: GridOptions,
) -> impl Strategy<Value = Grid<D>> + Clone + Send + Sync {
    let layout = options.check().map(|()| {
        let mut layout = Layout::default();
        options.push::<D>(&mut layout);
        layout
    });
    Made::new("grid", layout, move |mut reader| {
        Shape::read(&options, &mut reader).grid()
    })
}
