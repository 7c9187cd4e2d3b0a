//! The exact test of \[GD01\] (section 6), as it stands; slow.
//!
//! 1. The determinant in a cell is the sum (6) of all determinants φ of control vectors, one
//!    from each column, times products of basis functions.
//! 2. Along each axis the product of one basis function of each column is written in
//!    Bernstein form on the cell, of degree 3n − 1 for degree n (2n − 1 in the plane). The paper
//!    takes two steps to the same numbers: the relations of Mørken, which write the product as
//!    a spline with multiple knots, and the insertion of knots until that is in Bézier form.
//!    The Bernstein form of a polynomial on an interval is unique.
//! 3. The sum of φ times these numbers, one axis after the other, is the Bernstein form (8) of
//!    the determinant on the cell. (The paper counts a(2l − 1) + l − 3 coefficients along an
//!    axis for order l and a cells; it must be 3(l − 1) for one cell, as here.)
//! 4. Cells are cut into eight (four in the plane) by de Casteljau's algorithm, again and again,
//!    until all coefficients of a part have the same sign. The test fails as soon as a part is
//!    made in which they are all negative, and succeeds when they are all positive in all
//!    parts.
//!
//! # Departures
//!
//! * Coefficients count as positive or negative if they are so by more than a bound of their
//!   rounding errors. Where none of a part is, or where the budget is spent, the part stays in
//!   doubt, and the verdict is undecided unless another part is negative.
//! * A negative part alone is not the end of the test before a place where the determinant is
//!   positive has been seen, since everything may be negative: a mirror image.
//!
//! The paper does not say in which order boxes are cut. With no rule a search can follow the
//! seam between the signs down to the smallest boxes, with all of the negative part in others
//! that wait: of the parts of a box the one with the least coefficient is therefore cut first.
//!
//! # Rounding
//!
//! A determinant φ errs by at most [`Columns::determinant_error`]. Weights are products of
//! numbers that are not negative, with relative errors of 26 u each; they add up to one for
//! each coefficient, so the sum of T terms adds up to less than `(T + w) u P` along an axis, where
//! w u is the relative error of a weight and P a bound of all |φ|.

use super::columns::Columns;
use super::octree::{Octree, Step};
use super::partials::{Partials, UNIT};
use super::piece::Shape;
use super::product::binomial;
use super::search::{Search, Sign};
use super::{Budget, Place, Undecided};
use crate::Lattice;
use crate::bspline::BezierTables;

/// Halvings of a cell along an axis, at most: positions stay exact numbers.
const DEEPEST: u32 = 50;

/// What the test found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Found<const D: usize> {
    pub(super) sign: Sign<D>,
    /// Bounds of the least value of the determinant in lattice coordinates; the first means
    /// something only if all of it is positive.
    pub(super) least: [f64; 2],
    /// Cells and parts of them that were bounded.
    pub(super) boxes: usize,
}

/// Bernstein coefficients over a box.
#[derive(Debug, Clone, Default)]
struct Scalars {
    coefficients: Vec<f64>,
    error: f64,
}

/// Tests a lattice.
pub(super) fn test<const D: usize>(
    lattice: &Lattice<D>,
    search: &Search<D>,
    budget: &Budget,
) -> Found<D> {
    let partials = &search.partials;
    let degree = partials.degree.map(|n| D * n - 1);
    let shape = Shape::new(&degree);
    let mut weights: [Weights; D] = std::array::from_fn(|_| Weights::default());
    let mut columns = Columns::new();
    let mut sums = Sums::new(degree.map(|n| n + 1));
    let mut octree = Octree::new();

    let (mut positive, mut negative): (Option<Place<D>>, Option<Place<D>>) = (None, None);
    let mut doubt: Option<Undecided<D>> = None;
    let mut least = [f64::INFINITY; 2];
    let mut left = budget.boxes;
    let mut count = 0;
    for number in 0..partials.cell_count() {
        let cell = partials.cell(number);
        columns.set_control(partials, cell);
        for (axis, weights) in weights.iter_mut().enumerate() {
            weights.set(partials, axis, cell);
        }
        let mut whole: Scalars = octree.free().unwrap_or_default();
        whole.error = sums.determinant(&columns, &weights, &mut whole.coefficients);
        let halve = |axis: usize, high: &mut Scalars, low: &mut Scalars| {
            let size = |m: f64, c: &f64| m.max(c.abs());
            let largest = high.coefficients.iter().fold(0.0, size);
            high.error = shape.error_after_split(axis, high.error, largest);
            low.error = high.error;
            low.coefficients.resize(high.coefficients.len(), 0.0);
            shape.split(axis, &mut low.coefficients, &mut high.coefficients);
        };
        let ended = octree.visit(whole, halve, |scalars, part, depth| {
            count += 1;
            let error = scalars.error;
            let bounds = shape.bounds(&scalars.coefficients);
            let place = |corner: usize| {
                let t = std::array::from_fn(|a| part[a][corner >> a & 1]);
                search.place(lattice, number, t)
            };
            let mut step = Step::Cut(bounds.min);
            if error < f64::INFINITY {
                least[1] = least[1].min(bounds.low_corner.0 + error);
                if positive.is_none() && bounds.high_corner.0 > error {
                    positive = Some(place(bounds.high_corner.1));
                }
                if bounds.min > error {
                    least[0] = least[0].min(bounds.min - error);
                    step = Step::Leaf;
                } else if bounds.max < -error {
                    negative = negative.or_else(|| Some(place(bounds.low_corner.1)));
                    step = Step::Leaf;
                }
            }
            if positive.is_some() && negative.is_some() {
                return Step::Stop;
            }
            if step == Step::Leaf {
                return step;
            }
            let settled = bounds.max <= error && bounds.min >= -error;
            if settled || !error.is_finite() || depth == DEEPEST || left < 1 << D {
                let det = if error.is_finite() {
                    partials.divide_by_frame([bounds.min - error, bounds.max + error])
                } else {
                    [f64::NEG_INFINITY, f64::INFINITY]
                };
                doubt = doubt.or(Some(Undecided { cell, part, det }));
                return Step::Leaf;
            }
            left -= 1 << D;
            step
        });
        if !ended {
            break;
        }
    }
    let sign = match (positive, negative, doubt) {
        (Some(positive), Some(negative), _) => Sign::Both { positive, negative },
        (_, _, Some(undecided)) => Sign::Undecided(undecided),
        (None, Some(_), None) => Sign::Negative,
        _ => Sign::Positive,
    };
    Found {
        sign,
        least,
        boxes: count,
    }
}

/// The products of basis functions along an axis.
#[derive(Debug, Default)]
struct Weights {
    kind: Option<usize>,
    /// Functions of each column.
    counts: Vec<usize>,
    /// For each way to take a function of each column, first column fastest: the Bernstein
    /// coefficients of their product.
    rows: Vec<f64>,
}

impl Weights {
    fn set<const D: usize>(&mut self, partials: &Partials<D>, axis: usize, cell: [usize; D]) {
        let kind = partials.kind(cell)[axis];
        if self.kind == Some(kind) {
            return;
        }
        self.kind = Some(kind);
        self.counts = (0..D).map(|a| partials.window(a)[axis]).collect();
        self.rows.clear();
        let tables = partials.tables(cell)[axis];
        for number in 0..self.counts.iter().product() {
            let mut rest: usize = number;
            let mut product = vec![1.0];
            for (a, &count) in self.counts.iter().enumerate() {
                let own = scaled(tables, axis == a, count, rest % count);
                product = convolve(&product, &own);
                rest /= count;
            }
            let degree = product.len() - 1;
            for (k, value) in product.iter().enumerate() {
                self.rows.push(value / binomial(degree, k));
            }
        }
    }

    /// Ways to take a function of each column.
    fn terms(&self) -> usize {
        self.counts.iter().product()
    }

    /// A bound of the relative error of a weight, in units: three functions with 26 and one
    /// for the factor; two products; and a sum of at most two times so many terms; and the
    /// division.
    fn units(&self) -> f64 {
        let pairs = self.counts.iter().max().map_or(0, |n| n * n);
        (3 * 27 + 3 + 2 * pairs) as f64
    }
}

/// A basis function in Bernstein form, times binomial coefficients.
fn scaled(tables: &BezierTables, slope: bool, count: usize, function: usize) -> Vec<f64> {
    let table = if slope { &tables.slope } else { &tables.full };
    (0..count)
        .map(|i| table[i][function] * binomial(count - 1, i))
        .collect()
}

fn convolve(a: &[f64], b: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; a.len() + b.len() - 1];
    for (i, a) in a.iter().enumerate() {
        for (j, b) in b.iter().enumerate() {
            out[i + j] += a * b;
        }
    }
    out
}

/// The sum (6), one axis inside the other.
struct Sums<const D: usize> {
    /// Coefficients along each axis.
    counts: [usize; D],
    /// Along the first axes, with functions chosen along the others.
    partial: [Vec<f64>; D],
}

impl<const D: usize> Sums<D> {
    fn new(counts: [usize; D]) -> Self {
        Self {
            counts,
            partial: std::array::from_fn(|axis| vec![0.0; counts[..=axis].iter().product()]),
        }
    }

    /// Writes the Bernstein coefficients of the determinant, first axis fastest, and returns
    /// a bound of their error.
    fn determinant(
        &mut self,
        columns: &Columns<D>,
        weights: &[Weights; D],
        out: &mut Vec<f64>,
    ) -> f64 {
        self.sum(D - 1, [0; D], columns, weights);
        out.clear();
        out.extend_from_slice(&self.partial[D - 1]);
        let units: f64 = weights
            .iter()
            .map(|w| w.terms() as f64 + 2.0 + w.units())
            .sum();
        let error = columns.determinant_error() + 1.01 * units * UNIT * columns.size();
        if error < f64::INFINITY {
            error
        } else {
            f64::INFINITY
        }
    }

    /// Sums along an axis and those before; `at` are the vectors of the columns chosen along
    /// those after.
    fn sum(&mut self, axis: usize, at: [usize; D], columns: &Columns<D>, weights: &[Weights; D]) {
        let Weights { counts, rows, .. } = &weights[axis];
        let length = self.counts[axis];
        self.partial[axis].fill(0.0);
        for (number, row) in rows.chunks_exact(length).enumerate() {
            let mut rest = number;
            let at: [usize; D] = std::array::from_fn(|a| {
                let choice = rest % counts[a];
                rest /= counts[a];
                let stride: usize = columns.counts(a)[..axis].iter().product();
                at[a] + choice * stride
            });
            if axis == 0 {
                let phi = phi(columns, at);
                for (sum, weight) in self.partial[0].iter_mut().zip(row) {
                    *sum += weight * phi;
                }
                continue;
            }
            self.sum(axis - 1, at, columns, weights);
            let (before, sums) = self.partial.split_at_mut(axis);
            let inner = &before[axis - 1];
            for (sums, &weight) in sums[0].chunks_exact_mut(inner.len()).zip(row) {
                for (sum, value) in sums.iter_mut().zip(inner) {
                    *sum += weight * value;
                }
            }
        }
    }
}

/// Equation (7).
fn phi<const D: usize>(columns: &Columns<D>, at: [usize; D]) -> f64 {
    let vector = |a: usize| columns.vector(a, at[a]);
    let (u, v) = (vector(0), vector(1));
    if D == 2 {
        return u[0] * v[1] - u[1] * v[0];
    }
    let w = vector(D - 1);
    let mut sum = 0.0;
    for c in 0..D {
        let (p, q) = ((c + 1) % D, (c + 2) % D);
        sum += (u[p] * v[q] - u[q] * v[p]) * w[c];
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::super::product::Products;
    use super::super::samples::{lattices, linear};
    use super::*;
    use proptest::prelude::*;

    fn found<const D: usize>(lattice: &Lattice<D>, boxes: usize) -> Found<D> {
        let budget = Budget {
            boxes,
            exact_boxes: 0,
        };
        let mut search = Search::new(lattice, false);
        search.partials.prepare();
        test(lattice, &search, &budget)
    }

    /// The Bernstein forms of the determinant, by all φ and by products of polynomials, are
    /// the same.
    fn forms_agree<const D: usize>(lattice: &Lattice<D>) -> Result<(), TestCaseError> {
        let partials = Partials::new(lattice);
        let mut products = Products::new(partials.degree);
        let mut columns = Columns::new();
        let mut weights: [Weights; D] = std::array::from_fn(|_| Weights::default());
        let mut sums = Sums::new(partials.degree.map(|n| D * n));
        let (mut expected, mut ours) = (Vec::new(), Vec::new());
        for number in 0..partials.cell_count() {
            let cell = partials.cell(number);
            let mut tolerance = products.determinant(&partials, cell, &mut expected);
            columns.set_control(&partials, cell);
            for (axis, weights) in weights.iter_mut().enumerate() {
                weights.set(&partials, axis, cell);
            }
            tolerance += sums.determinant(&columns, &weights, &mut ours);
            prop_assert_eq!(expected.len(), ours.len());
            for (a, b) in ours.iter().zip(&expected) {
                prop_assert!((a - b).abs() <= tolerance, "{} and {}", a, b);
            }
            prop_assert!(tolerance < 1e-10);
        }
        Ok(())
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]

        /// In the plane.
        #[test]
        fn the_form_is_that_of_products_in_the_plane(lattice in lattices::<2>(5, 3, 0.8)) {
            forms_agree(&lattice)?;
        }

        /// In space.
        #[test]
        fn the_form_is_that_of_products_in_space(lattice in lattices::<3>(2, 2, 0.8)) {
            forms_agree(&lattice)?;
        }
    }

    /// For three cubic functions along an axis, 48 products of degree 8; all weights of a
    /// coefficient add up to one.
    #[test]
    fn weights_are_a_partition_of_unity() {
        let lattice = linear(3, 2, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
        let mut weights = Weights::default();
        weights.set(&Partials::new(&lattice), 1, [0, 1, 0]);
        assert_eq!(weights.counts, [4, 3, 4]);
        assert_eq!(weights.rows.len(), 48 * 9);
        for k in 0..9 {
            let sum: f64 = weights.rows.chunks(9).map(|row| row[k]).sum();
            assert!((sum - 1.0).abs() < 1e-14);
        }
    }

    #[test]
    fn a_mirror_image_is_negative_everywhere() {
        let lattice = linear(2, 2, [[-1.0, 0.5], [0.0, 2.0]]);
        let found = found(&lattice, 100);
        assert_eq!(found.sign, Sign::Negative);
        assert_eq!(found.boxes, 4);
    }

    #[test]
    fn a_flat_image_stays_in_doubt() {
        let lattice = linear(2, 1, [[0.0, 0.5], [0.0, 2.0]]);
        let found = found(&lattice, 100);
        assert!(matches!(found.sign, Sign::Undecided(_)));
        assert_eq!(found.boxes, 1);
    }

    /// A fold that only subdivision finds, once with the budget for it and once without.
    #[test]
    fn a_fold_inside_is_found_by_cutting() {
        let grid = crate::Grid::new([crate::Degree::CUBIC; 2], [1; 2], crate::Frame::unit());
        let mut lattice = Lattice::at_rest(grid.unwrap()).unwrap();
        // Control points 1 and 2 along x change places: the slope is least in the middle.
        for j in 0..4 {
            lattice.set_displacement(4 * j + 1, [0.9, 0.0]).unwrap();
            lattice.set_displacement(4 * j + 2, [-0.9, 0.0]).unwrap();
        }
        let found = |boxes| found(&lattice, boxes);
        assert!(matches!(found(0).sign, Sign::Undecided(_)));
        let Sign::Both { positive, negative } = found(1000).sign else {
            panic!("{:?}", found(1000));
        };
        assert!(lattice.evaluate(positive.world).unwrap().determinant > 0.0);
        assert!(lattice.evaluate(negative.world).unwrap().determinant < 0.0);
    }
}
