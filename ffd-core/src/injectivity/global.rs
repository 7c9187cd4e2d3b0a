//! Theorems that make a map with `det J > 0` globally one-to-one, from the matrices `C J`
//! for a fixed matrix C.
//!
//! In lattice coordinates (see [`partials`](super::partials)) the domain is a box. On it a
//! map is one-to-one if, everywhere,
//!
//! * `C J` is a *P-matrix*: all its principal minors are positive (Gale and Nikaido, 1965,
//!   for maps with a derivative everywhere, so for degrees of at least 2); or
//! * `C J` has a *positive definite* symmetric part: then
//!   `(y − x)ᵀ C (F(y) − F(x)) = ∫ (y − x)ᵀ C J (y − x) > 0`, where J jumps as well. A
//!   contraction, ‖C J − I‖ < 1, is a special case: `vᵀ C J v ≥ |v|² − ‖C J − I‖ |v|²`.
//!
//! C is the identity first, then about the inverse of the mean of J, so that maps are
//! recognised that are turned, sheared or stretched as a whole. Any stored C will do: it is
//! taken as exact.
//!
//! Columns of `C J` are brought into Bézier form in each cell. Principal minors of one row
//! are positive if their Bézier values are; those of two rows, in 3-D, if the coefficients of
//! the product are; that of all rows is det C · det J, and det J > 0 is known before. For the
//! symmetric part, columns are raised to the same degree along all axes; then the matrix at
//! a point is a mean of matrices of Bézier values, and it is positive definite if these are.
//!
//! # Rounding
//!
//! Let N be the largest 1-norm of the control vectors of a column that act on a cell, and R
//! the largest row sum of |C|. An entry of a product `C v` is wrong by at most R times the
//! error of v, and by D + 1 roundings of R N; the conversion to Bézier form adds less than
//! 33 roundings along each axis (see [`product`](super::product)); raising the degree
//! another 4. Together that is at most `R (error(N) + 128 u (N + 1))`. A minor
//! `a d − b c` of values below A, B, C and D with errors e is wrong by at most
//! `(A + e)(D + e) − A D + (B + e)(C + e) − B C`, and by as many roundings as terms meet in
//! a coefficient.

use fearless_simd::{Level, Simd, dispatch};

use super::partials::{Partials, UNIT};
use super::product::binomial;
use super::verdict::Theorem;
use crate::bspline::{BezierTables, MAX_ORDER, ToBezier};
use crate::frame::unit_entry;
use crate::matrix::{Matrix, cofactors, determinant};

/// Looks for a theorem of this file. `det J > 0` is known.
pub(super) fn find<const D: usize>(partials: &Partials<D>) -> Option<Theorem<D>> {
    if !partials.is_sound() {
        return None;
    }
    let unit = std::array::from_fn(|r| std::array::from_fn(|c| unit_entry(r, c)));
    let smooth = partials.degree.iter().all(|&n| n >= 2);
    let inverse = inverse_of_mean(partials);
    for after in std::iter::once(unit).chain(inverse) {
        let mut matrices = Matrices::new(partials, after);
        if smooth && has_positive_determinant(&after) && matrices.all_cells(Matrices::is_p_matrix) {
            return Some(Theorem::PMatrix { after });
        }
        if matrices.all_cells(Matrices::is_monotone) {
            return Some(Theorem::Monotone { after });
        }
    }
    None
}

/// The inverse of the mean of all control vectors, approximately; `None` if there is none.
fn inverse_of_mean<const D: usize>(partials: &Partials<D>) -> Option<Matrix<D>> {
    let mut mean = [[0.0; D]; D];
    for a in 0..D {
        let line = partials.stride[a] * partials.counts[a];
        let used = line - partials.stride[a];
        for c in 0..D {
            let values = &partials.vectors[a][c];
            let lines = values.chunks_exact(line);
            let count = (lines.len() * used) as f64;
            let sum: f64 = lines.map(|line| line[..used].iter().sum::<f64>()).sum();
            mean[c][a] = sum / count;
        }
    }
    let (cofactors, determinant) = (cofactors(&mean), determinant(&mean));
    let inverse: Matrix<D> =
        std::array::from_fn(|r| std::array::from_fn(|c| cofactors[c][r] / determinant));
    let finite = inverse.iter().flatten().all(|x| x.abs() < 1e50);
    finite.then_some(inverse)
}

/// Whether the determinant of a matrix is positive, in spite of rounding.
fn has_positive_determinant<const D: usize>(m: &Matrix<D>) -> bool {
    // Hadamard: no product of D entries, one from each row, is larger than this; there are
    // at most six, each with at most five roundings.
    let size: f64 = m
        .iter()
        .map(|row| row.iter().fold(0.0_f64, |m, x| m.max(x.abs())))
        .product();
    size > 1e-200 && determinant(m) > 64.0 * UNIT * size
}

/// The matrices `C J` of a lattice, in one cell after the other.
struct Matrices<'a, const D: usize> {
    level: Level,
    partials: &'a Partials<D>,
    /// The largest row sum of |C|.
    row_sum: f64,
    /// `vectors[a][r]`: component r of C times the control vectors for axis a.
    vectors: [[Vec<f64>; D]; D],
    /// `entries[a][r]`: Bézier values of the entry in row r and column a in a cell, first
    /// axis fastest.
    entries: [[Vec<f64>; D]; D],
    /// By how much those of each column may be wrong.
    errors: [f64; D],
    scratch: [Vec<f64>; 3],
    binomials: Binomials,
}

impl<'a, const D: usize> Matrices<'a, D> {
    fn new(partials: &'a Partials<D>, after: Matrix<D>) -> Self {
        let vectors = std::array::from_fn(|a| {
            std::array::from_fn(|r| {
                let mut sums: Vec<f64> = partials.vectors[a][0]
                    .iter()
                    .map(|x| x * after[r][0])
                    .collect();
                for c in 1..D {
                    for (sum, x) in sums.iter_mut().zip(&partials.vectors[a][c]) {
                        *sum += x * after[r][c];
                    }
                }
                sums
            })
        });
        let sums = after.map(|row| row.iter().map(|x| x.abs()).sum::<f64>());
        Self {
            level: Level::new(),
            partials,
            row_sum: 1.01 * sums.iter().fold(0.0_f64, |m, &x| m.max(x)),
            vectors,
            entries: std::array::from_fn(|_| std::array::from_fn(|_| Vec::new())),
            errors: [0.0; D],
            scratch: std::array::from_fn(|_| Vec::new()),
            binomials: std::array::from_fn(|n| {
                std::array::from_fn(|k| if k <= n { binomial(n, k) } else { 0.0 })
            }),
        }
    }

    /// Whether a test holds in all cells.
    fn all_cells(&mut self, test: impl Fn(&mut Self) -> bool) -> bool {
        (0..self.partials.cell_count()).all(|number| {
            self.enter(self.partials.cell(number));
            test(self)
        })
    }

    /// Brings the columns into Bézier form in a cell.
    fn enter(&mut self, cell: [usize; D]) {
        let level = self.level;
        dispatch!(level, s => self.enter_with(s, cell));
    }

    #[inline(always)]
    fn enter_with<S: Simd>(&mut self, _: S, cell: [usize; D]) {
        let partials = self.partials;
        let norms = partials.norms(cell);
        let start = partials.index(cell);
        let tables = partials.tables(cell);
        let [half, other, ..] = &mut self.scratch;
        for a in 0..D {
            let error = partials.error(norms[a]) + 128.0 * UNIT * (norms[a] + 1.0);
            // Larger numbers could overflow, and a comparison with what is not a number
            // could go wrong.
            self.errors[a] = if norms[a] <= 1e100 {
                self.row_sum * error
            } else {
                f64::INFINITY
            };
            let window = partials.window(a);
            for r in 0..D {
                convert(
                    &self.vectors[a][r][start..],
                    partials.stride,
                    window,
                    |axis| table(tables[axis], axis == a),
                    [half, other],
                    &mut self.entries[a][r],
                );
            }
        }
    }

    /// The smallest value and the largest absolute one of an entry, with errors.
    fn range(&self, r: usize, a: usize) -> (f64, f64) {
        let values = &self.entries[a][r];
        let mut least = f64::INFINITY;
        let mut largest = 0.0_f64;
        for &x in values {
            // In case it is not a number, nothing is positive.
            least = if least.is_nan() || x >= least {
                least
            } else {
                x
            };
            largest = if largest.is_nan() || x.abs() <= largest {
                largest
            } else {
                x.abs()
            };
        }
        (least - self.errors[a], largest + self.errors[a])
    }

    /// Whether all principal minors but the largest are positive in the cell.
    fn is_p_matrix(&mut self) -> bool {
        let diagonal: [f64; D] = std::array::from_fn(|a| self.range(a, a).0);
        // Also where they are not numbers.
        if !diagonal.iter().all(|&least| least > 0.0) {
            return false;
        }
        if D == 2 {
            return true;
        }
        (0..D).all(|i| {
            let j = (i + 1) % D;
            let across = self.range(i, j).1 * self.range(j, i).1;
            diagonal[i] * diagonal[j] * (1.0 - 8.0 * UNIT) > across || self.is_minor_positive(i, j)
        })
    }

    /// Whether the coefficients of a minor of two rows are positive.
    fn is_minor_positive(&mut self, i: usize, j: usize) -> bool {
        let [first, second] = [self.partials.window(i), self.partials.window(j)];
        let mut counts = [1; 3];
        let mut pairs = 1;
        for axis in 0..D {
            counts[axis] = first[axis] + second[axis] - 1;
            pairs *= first[axis].min(second[axis]);
        }
        let size = |r, a| self.range(r, a).1;
        let [e, f] = [self.errors[i], self.errors[j]];
        let products = size(i, i) * size(j, j) + size(i, j) * size(j, i);
        // With errors in all four; ranges hold them already.
        let crossed = (size(i, i) + size(j, i)) * f + (size(j, j) + size(i, j)) * e;
        let error = 1.01 * crossed + (2 * pairs + 32) as f64 * UNIT * products;

        let level = self.level;
        let Self {
            entries,
            scratch,
            binomials,
            ..
        } = self;
        let [out, a, b] = scratch;
        out.clear();
        out.resize(counts.iter().product(), 0.0);
        for (row, sign) in [(i, 1.0), (j, -1.0)] {
            // Column i has the row `row`, column j the other one.
            scaled(&entries[i][row], first, sign, binomials, a);
            scaled(&entries[j][i + j - row], second, 1.0, binomials, b);
            dispatch!(level, s => add_product(s, (&*a, first), (&*b, second), out, counts));
        }
        let mut numbered = out.iter().enumerate();
        numbered.all(|(p, &x)| x > error * weight(binomials, indices(p, counts), counts))
    }

    /// Whether the symmetric part is positive definite in the cell.
    fn is_monotone(&mut self) -> bool {
        let order = self.partials.degree.map(|n| n + 1);
        let error = self.errors.iter().fold(0.0_f64, |m, &e| m.max(e));
        (0..order.iter().product()).all(|number| {
            let at = indices(number, order);
            let mut m = [[0.0; D]; D];
            for a in 0..D {
                let window = self.partials.window(a);
                let stride: usize = window[..a].iter().product();
                let index: usize = (0..D)
                    .rev()
                    .fold(0, |index, axis| index * window[axis] + at[axis]);
                // Along its own axis the column has one value less: a mean of two.
                let n = self.partials.degree[a];
                let share = at[a] as f64 / n as f64;
                for r in 0..D {
                    let values = &self.entries[a][r];
                    let below = if at[a] > 0 {
                        values[index - stride]
                    } else {
                        0.0
                    };
                    let above = if at[a] < n { values[index] } else { 0.0 };
                    m[r][a] = share * below + (1.0 - share) * above;
                }
            }
            is_positive_definite(&m, error)
        })
    }
}

/// Whether the symmetric part of a matrix whose entries may be wrong by `error` is positive
/// definite. That moves eigenvalues by D times as much at most.
fn is_positive_definite<const D: usize>(m: &Matrix<D>, error: f64) -> bool {
    let size = m.iter().flatten().fold(0.0_f64, |s, x| s.max(x.abs()));
    let shift = 1.01 * D as f64 * (error + 4.0 * UNIT * size);
    let s: Matrix<D> = std::array::from_fn(|r| {
        std::array::from_fn(|c| 0.5 * (m[r][c] + m[c][r]) - shift * unit_entry(r, c))
    });
    // Leading principal minors: at most six products of three entries below 1.1 `size`
    // (else the shift is no small correction and the first minor is not positive), with at
    // most five roundings each.
    let bound = size + shift;
    let square = s[0][0] * s[1][1] - s[0][1] * s[0][1];
    let all = if D == 2 { square } else { determinant(&s) };
    s[0][0] > 0.0
        && square > 8.0 * UNIT * bound * bound
        && (D == 2 || all > 64.0 * UNIT * bound * bound * bound)
        && bound > 1e-90
        && bound < 1e90
}

fn table(tables: &BezierTables, slope: bool) -> &ToBezier {
    if slope { &tables.slope } else { &tables.full }
}

/// The index along each axis; 0 for a third axis that is not there.
fn indices<const N: usize>(number: usize, counts: [usize; N]) -> [usize; 3] {
    let mut rest = number;
    let mut at = [0; 3];
    for (index, count) in at.iter_mut().zip(counts) {
        *index = rest % count;
        rest /= count;
    }
    at
}

/// `binomial(n, k)` for the degrees of columns and of products of two.
type Binomials = [[f64; 2 * MAX_ORDER]; 2 * MAX_ORDER];

/// The product of the binomial coefficients of a Bernstein coefficient along each axis.
#[inline(always)]
fn weight<const N: usize>(binomials: &Binomials, at: [usize; 3], counts: [usize; N]) -> f64 {
    let mut weight = 1.0;
    for (count, index) in counts.into_iter().zip(at) {
        weight *= binomials[count - 1][index];
    }
    weight
}

/// Bernstein coefficients times their binomial coefficients.
fn scaled<const D: usize>(
    values: &[f64],
    counts: [usize; D],
    sign: f64,
    binomials: &Binomials,
    out: &mut Vec<f64>,
) {
    out.clear();
    let numbered = values.iter().enumerate();
    out.extend(numbered.map(|(p, x)| sign * x * weight(binomials, indices(p, counts), counts)));
}

/// Adds the product of two polynomials in scaled Bernstein form.
#[inline(always)]
fn add_product<S: Simd, const D: usize>(
    _: S,
    (a, first): (&[f64], [usize; D]),
    (b, second): (&[f64], [usize; D]),
    out: &mut [f64],
    counts: [usize; 3],
) {
    for (p, &x) in a.iter().enumerate() {
        let [i1, j1, k1] = indices(p, first);
        for (q, row) in b.chunks_exact(second[0]).enumerate() {
            let (j2, k2) = (q % second[1], q / second[1]);
            let at = i1 + counts[0] * ((j1 + j2) + counts[1] * (k1 + k2));
            for (sum, y) in out[at..at + row.len()].iter_mut().zip(row) {
                *sum += x * y;
            }
        }
    }
}

/// Control values of a window to Bézier values, one axis after the other.
#[inline(always)]
fn convert<'t, const D: usize>(
    values: &[f64],
    stride: [usize; D],
    window: [usize; D],
    table: impl Fn(usize) -> &'t ToBezier,
    [half, other]: [&mut Vec<f64>; 2],
    out: &mut Vec<f64>,
) {
    let planes = if D == 3 { window[D - 1] } else { 1 };
    let [n0, n1] = [window[0], window[1]];
    // Along the first axis all values of a row at once.
    let rows = table(0);
    let columns: ToBezier = std::array::from_fn(|m| std::array::from_fn(|i| rows[i][m]));
    half.clear();
    for k in 0..planes {
        for j in 0..n1 {
            let plane = if D == 3 { k * stride[D - 1] } else { 0 };
            let row = &values[j * stride[1] + plane..][..n0];
            let mut sums = [0.0; MAX_ORDER];
            for (x, column) in row.iter().zip(&columns) {
                for (sum, weight) in sums.iter_mut().zip(column) {
                    *sum += weight * x;
                }
            }
            half.extend_from_slice(&sums[..n0]);
        }
    }
    let target = if D == 3 { &mut *other } else { &mut *out };
    target.clear();
    for slab in half.chunks_exact(n0 * n1) {
        mix(slab, n0, &table(1)[..n1], target);
    }
    if D == 3 {
        out.clear();
        mix(other, n0 * n1, &table(D - 1)[..planes], out);
    }
}

/// Appends, for each list of weights, the weighted sum of rows of the given length.
#[inline(always)]
fn mix(rows: &[f64], len: usize, weights: &[[f64; MAX_ORDER]], out: &mut Vec<f64>) {
    for weights in weights {
        let at = out.len();
        out.resize(at + len, 0.0);
        let out = &mut out[at..];
        for (row, weight) in rows.chunks_exact(len).zip(weights) {
            for (sum, x) in out.iter_mut().zip(row) {
                *sum += weight * x;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::samples::{clamped, grid, in_frame, mapped, noisy, wound};
    use super::*;
    use crate::*;
    use proptest::prelude::*;

    fn found<const D: usize>(lattice: &Lattice<D>) -> Option<Theorem<D>> {
        find(&Partials::new(lattice))
    }

    fn turned<const D: usize>(angle: f64) -> impl Fn([f64; D]) -> [f64; D] {
        let (s, c) = angle.sin_cos();
        move |u| {
            let mut image = u;
            image[0] = c * u[0] - s * u[1] + 7.0;
            image[1] = s * u[0] + c * u[1];
            image
        }
    }

    /// A turned map is one-to-one, whatever the angle; beyond a right angle only C shows it.
    #[test]
    fn affine_maps_are_recognised() {
        for degrees in [0_i32, 30, 60, 89, 90, 135, 180, 270] {
            let angle = f64::from(degrees).to_radians();
            let flat = found(&mapped(grid([2, 3], [3, 2]), turned(angle)));
            let solid = found(&mapped(clamped([3, 2, 4], [2, 1, 2]), turned(angle)));
            let (Some(Theorem::PMatrix { after }), Some(Theorem::PMatrix { after: in_space })) =
                (flat, solid)
            else {
                panic!("{degrees}: {flat:?} {solid:?}");
            };
            let unit: [[f64; 2]; 2] = [[1.0, 0.0], [0.0, 1.0]];
            assert_eq!(after == unit, degrees < 90, "{degrees}");
            assert_eq!(in_space[0][1].abs() > 1e-3, degrees >= 90 && degrees != 180);
            // Degree 1: not for P-matrices.
            let linear = found(&mapped(grid([1, 1], [3, 2]), turned(angle)));
            assert!(
                matches!(linear, Some(Theorem::Monotone { .. })),
                "{degrees}"
            );
        }
        // A shear that is far from monotone.
        let sheared = |u: [f64; 3]| [u[0] + 9.0 * u[1], u[1] - 9.0 * u[2], u[2]];
        let theorem = found(&mapped(grid([3; 3], [2; 3]), sheared));
        assert!(matches!(theorem, Some(Theorem::PMatrix { .. })));
    }

    /// No linear map makes the Jacobians of a strip that is bent by 200° positive definite,
    /// or P-matrices: a direction is mapped to vectors more than 180° apart.
    #[test]
    fn strips_bent_too_far_are_not() {
        let strip = |turns| mapped(clamped([3, 3], [16, 2]), wound(16.0, 2.0, turns, 0.0));
        assert!(found(&strip(100.0 / 360.0)).is_some());
        assert!(found(&strip(200.0 / 360.0)).is_none());
    }

    #[test]
    fn a_frame_changes_nothing() {
        let skewed = Frame::new([3.0, 4.0], [[1.0, 0.25], [-0.5, 2.0]]).unwrap();
        let tiny = 2_f64.powi(-40);
        let scaled = Frame::new([0.0; 2], [[tiny, 0.0], [0.0, 1.0 / tiny]]).unwrap();
        for seed in 0..20 {
            let lattice = noisy(grid([3, 2], [3, 4]), 0.45, seed);
            let name = found(&lattice).map(|t| t.name());
            for frame in [skewed, scaled] {
                assert_eq!(found(&in_frame(&lattice, frame)).map(|t| t.name()), name);
            }
        }
    }

    /// Whether `C J` is what a theorem says at a point, given J in lattice coordinates.
    fn holds<const D: usize>(theorem: &Theorem<D>, jacobian: &Matrix<D>) -> bool {
        let product = |c: &Matrix<D>| -> Matrix<D> {
            std::array::from_fn(|r| {
                std::array::from_fn(|a| (0..D).map(|k| c[r][k] * jacobian[k][a]).sum())
            })
        };
        match theorem {
            Theorem::PMatrix { after } => {
                let m = product(after);
                let minors = (0..D).all(|i| {
                    let j = (i + 1) % D;
                    m[i][i] > 0.0 && m[i][i] * m[j][j] - m[i][j] * m[j][i] > 0.0
                });
                minors && determinant(&m) > 0.0
            }
            Theorem::Monotone { after } => {
                let m = product(after);
                let s: Matrix<D> =
                    std::array::from_fn(|r| std::array::from_fn(|c| 0.5 * (m[r][c] + m[c][r])));
                let square = s[0][0] * s[1][1] - s[0][1] * s[0][1];
                s[0][0] > 0.0 && square > 0.0 && determinant(&s) > 0.0
            }
            _ => false,
        }
    }

    fn check<const D: usize>(lattice: &Lattice<D>) -> Result<(), TestCaseError> {
        // Only where det J > 0 may theorems be asked for.
        let options = CheckOptions {
            global: false,
            ..CheckOptions::default()
        };
        if !lattice.check(&options).is_regular() {
            return Ok(());
        }
        let Some(theorem) = found(lattice) else {
            return Ok(());
        };
        let cells = lattice.grid().cells();
        for number in 0..7_usize.pow(u32::try_from(D).unwrap()) {
            let mut rest = number;
            let world = std::array::from_fn(|a| {
                let digit = rest % 7;
                rest /= 7;
                cells[a] as f64 * digit as f64 / 6.0
            });
            let there = lattice.evaluate(world).unwrap();
            prop_assert!(holds(&theorem, &there.jacobian), "{theorem:?} at {world:?}");
        }
        Ok(())
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]

        /// What a theorem says of all points is true at points of a fine grid.
        #[test]
        fn theorems_hold_at_sample_points(
            degree in proptest::array::uniform3(1_usize..=4),
            cells in proptest::array::uniform3(1_usize..=3),
            clamp in any::<bool>(),
            size in 0.1..1.2_f64,
            seed in any::<u64>(),
        ) {
            let make = if clamp { clamped::<3> } else { grid::<3> };
            check(&noisy(make(degree, cells), size, seed))?;
            let [n0, n1, _] = degree;
            let [c0, c1, _] = cells;
            check(&noisy(grid([n0, n1], [c0, c1]), size, seed))?;
        }
    }

    #[test]
    fn matrices_at_the_limit_are_not_definite() {
        let on_the_edge: Matrix<2> = [[1.0, 2.0], [0.0, 1.0]];
        assert!(!is_positive_definite(&on_the_edge, 0.0));
        assert!(is_positive_definite(&[[1.0, 2.0 - 1e-12], [0.0, 1.0]], 0.0));
        assert!(!is_positive_definite(
            &[[1.0, 2.0 - 1e-12], [0.0, 1.0]],
            1e-12
        ));
        let nan: Matrix<3> = [[1.0, 0.0, f64::NAN], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        assert!(!is_positive_definite(&nan, 0.0));
        assert!(has_positive_determinant(&[[0.0, -1.0], [1.0, 0.0]]));
        assert!(!has_positive_determinant(&[[0.0, 1.0], [1.0, 0.0]]));
        assert!(!has_positive_determinant(&[[1.0, 1.0], [1.0, 1.0]]));
    }
}
