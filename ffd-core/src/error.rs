//! What can go wrong.

/// Why a lattice, or a part of one, was rejected.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FfdError {
    /// The degree is zero or too high.
    #[error("degree {degree} is not supported: it must be between 1 and {max}")]
    Degree {
        /// The degree asked for.
        degree: usize,
        /// The highest one there is.
        max: usize,
    },
    /// The origin of a frame is infinite or NaN.
    #[error("component {component} of the frame's origin is {value}")]
    NonFiniteOrigin {
        /// Which coordinate.
        component: usize,
        /// Its value.
        value: f64,
    },
    /// An axis of a frame is zero, NaN, or too short or too long to compute with.
    #[error("axis {axis} of the frame has length {length}, which is not between 1e-150 and 1e150")]
    AxisLength {
        /// Which axis.
        axis: usize,
        /// Its length; NaN if a component is.
        length: f64,
    },
    /// The axes of a frame lie in a plane or a line, or nearly so.
    #[error(
        "the axes of the frame are linearly dependent: scaled to length 1 they span a volume of {volume}"
    )]
    SingularFrame {
        /// Volume (area in 2-D) spanned by the axes after scaling each to
        /// length 1; 1 if they are perpendicular.
        volume: f64,
    },
    /// A lattice has no cells along an axis.
    #[error("the lattice has no cells along axis {axis}")]
    NoCells {
        /// Which axis.
        axis: usize,
    },
    /// There would be more control points than fit into memory.
    #[error("a lattice of {cells:?} cells has more control points than fit into memory")]
    TooManyControlPoints {
        /// The cells per axis asked for.
        cells: Vec<usize>,
    },
    /// The list of displacements has the wrong length.
    #[error("the lattice has {expected} control points, but {found} displacements were given")]
    DisplacementCount {
        /// Number of control points.
        expected: usize,
        /// Length of the list.
        found: usize,
    },
    /// A displacement is infinite or NaN.
    #[error(
        "component {component} of the displacement of control point {control_point} is {value}"
    )]
    NonFiniteDisplacement {
        /// Linear index of the control point.
        control_point: usize,
        /// Which coordinate.
        component: usize,
        /// Its value.
        value: f64,
    },
    /// An identity border was asked for around clamped knots.
    #[error("axis {axis} has clamped knots: an identity border needs uniform ones")]
    ClampedBorder {
        /// Which axis.
        axis: usize,
    },
    /// A point is infinite or NaN.
    #[error("component {component} of point {index} is {value}")]
    NonFinitePoint {
        /// Index of the point.
        index: usize,
        /// Which coordinate.
        component: usize,
        /// Its value.
        value: f64,
    },
    /// A point lies outside the lattice, and that was not allowed.
    #[error("point {index}, {point:?}, lies outside the lattice")]
    PointOutside {
        /// Index of the point.
        index: usize,
        /// Where it is.
        point: Vec<f64>,
    },
    /// Something was made for a grid and used with a lattice on another one.
    #[error("the lattice is not on the grid that this was made for")]
    GridMismatch,
    /// Two lattices that have to be on the same grid are not.
    #[error("the lattices are on different grids: their {what} differ")]
    DifferentGrids {
        /// What differs: degrees, numbers of cells, knots, frames or borders.
        what: &'static str,
    },
    /// A list has the wrong length.
    #[error("{what}: {expected} entries are needed, {found} were given")]
    LengthMismatch {
        /// Which list.
        what: &'static str,
        /// The length it should have.
        expected: usize,
        /// Its length.
        found: usize,
    },
}
