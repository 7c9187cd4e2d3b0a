//! Minimum-norm and least-squares solutions of sparse systems `A x = b`.
//!
//! What is sought minimises `|A x − b|² + μ |x|²`; with the damping μ = 0, it is the
//! smallest of all minimisers, `A⁺ b`. It is the limit of steps
//!
//! ```text
//! x ← x + M (b − A x),      M = Aᵀ (A Aᵀ)⁻¹  or  (Aᵀ A)⁻¹ Aᵀ
//! ```
//!
//! with the smaller one of the two products, factored once. One step would be enough but
//! for rounding: the products have the square of A's condition number. The residual is
//! taken with A itself, so that steps correct each other until the residual is small in
//! A's own terms.
//!
//! If rows, or columns, are linearly dependent, the product is singular. Then
//!
//! * for small systems M is the pseudoinverse, from the singular values of A;
//! * for large ones it is `Aᵀ (A Aᵀ + λ)⁻² A Aᵀ` or `Aᵀ A (Aᵀ A + λ)⁻² Aᵀ` with a small
//!   λ. Each singular value σ of A multiplies its part of the error by
//!   `1 − σ⁴ / (σ² + λ)²`, about 2λ/σ² where σ² is larger than λ. The simpler iterated
//!   Tikhonov step `Aᵀ (A Aᵀ + λ)⁻¹` would have the same limit, but enlarges the part of
//!   b that cannot be met by 1/λ, and rounding errors with it, before Aᵀ removes it;
//!   here it is removed first. As Aᵀ is applied last, no step leaves its range, in which
//!   the smallest solution lies.

use super::{
    factor::{Cholesky, filtered_inverse},
    sparse::{Gram, SparseRows},
};

/// Pivots below this, relative to the largest diagonal entry, count as zero: the row is a combination
/// of others. A factor with larger ones has four correct digits, and steps converge.
const SMALLEST_PIVOT: f64 = 1e-12;

/// The same for a damped system. Its pivots may be as small as μ, and what cannot be met
/// is enlarged by 1/μ: rounding errors of 1e-16 become 1e-6 of it.
const SMALLEST_DAMPED_PIVOT: f64 = 1e-10;

/// With pivots above this, rounding cannot make dependent rows look independent.
const SAFE_PIVOT: f64 = 1e-6;

/// λ, relative to the largest diagonal entry. Rounding errors are enlarged by
/// (1e-16 / λ)², and singular values below `√λ` = 7e-6 are lost. At least a fourth of
/// [`SMALLEST_DAMPED_PIVOT`], or steps would overshoot.
const FILTER: f64 = 5e-11;

/// Systems with at most this many multiplications per singular value decomposition,
/// rows × columns × the smaller of the two, are small: it takes a fraction of a second.
const SMALL: usize = 30_000_000;

/// Steps at most.
const STEPS: usize = 40;

/// By how much the sum of the squares of a step must be below that of the step before:
/// steps of rounding errors do not get shorter.
const SHORTER: f64 = 0.8;

/// A system, ready to be solved for many right-hand sides, `D` at a time.
#[derive(Debug, Clone)]
pub(super) struct LeastNorm<const D: usize> {
    matrix: SparseRows,
    damping: f64,
    method: Method,
    x: Vec<[f64; D]>,
    /// A vector over the columns.
    step: Vec<[f64; D]>,
    /// `b − A x`.
    residual: Vec<[f64; D]>,
    /// With rows and damping, the solution is `Aᵀ dual`.
    dual: Vec<[f64; D]>,
    /// A vector over the rows.
    work: Vec<[f64; D]>,
}

/// What makes the steps.
#[derive(Debug, Clone)]
enum Method {
    /// The factor of `A Aᵀ + μ`.
    Rows(Cholesky),
    /// That of `Aᵀ A + μ`.
    Columns(Cholesky),
    /// That of `A Aᵀ + λ`.
    FilteredRows(Cholesky),
    /// That of `Aᵀ A + λ`.
    FilteredColumns(Cholesky),
    /// The matrix `A⁺`, or `(Aᵀ A + μ)⁻¹ Aᵀ`, row after row.
    Inverse(Vec<f64>),
}

impl<const D: usize> LeastNorm<D> {
    /// Factors what is needed. Singular values below `negligible`, relative to the
    /// largest, may count as zero. The error is what the last factorisation said.
    pub(super) fn new(matrix: SparseRows, damping: f64, negligible: f64) -> Result<Self, String> {
        let method = choose::<D>(&matrix, damping, negligible)?;
        Ok(Self::with_method(matrix, damping, method))
    }

    fn with_method(matrix: SparseRows, damping: f64, method: Method) -> Self {
        let (rows, columns) = (matrix.row_count(), matrix.column_count());
        Self {
            method,
            matrix,
            damping,
            x: vec![[0.0; D]; columns],
            step: vec![[0.0; D]; columns],
            residual: vec![[0.0; D]; rows],
            dual: vec![[0.0; D]; rows],
            work: vec![[0.0; D]; rows],
        }
    }

    pub(super) fn matrix(&self) -> &SparseRows {
        &self.matrix
    }

    /// The solution found last.
    pub(super) fn x(&self) -> &[[f64; D]] {
        &self.x
    }

    /// `b − A x` of the solution found last.
    pub(super) fn residual(&self) -> &[[f64; D]] {
        &self.residual
    }

    /// Solves without allocation. Without damping, stops when the residual of each row
    /// is below `goal(row)`, otherwise when steps do not get shorter.
    pub(super) fn solve(&mut self, b: &[[f64; D]], goal: impl Fn(usize) -> f64) {
        self.x.fill([0.0; D]);
        self.dual.fill([0.0; D]);
        self.residual.copy_from_slice(b);
        let mut before = f64::INFINITY;
        for _ in 0..STEPS {
            if self.damping <= 0.0 && self.is_met(&goal) {
                break;
            }
            self.find_step();
            let squares = sum_of_squares(&self.step);
            if squares.is_nan() || squares >= SHORTER * before {
                break;
            }
            before = squares;
            add(&mut self.x, &self.step);
            self.update_residual(b);
            if self.damping > 0.0 && matches!(self.method, Method::Inverse(_)) {
                break;
            }
        }
    }

    fn is_met(&self, goal: impl Fn(usize) -> f64) -> bool {
        let met = |(row, r): (usize, &[f64; D])| r.iter().all(|c| c.abs() <= goal(row));
        self.residual.iter().enumerate().all(met)
    }

    /// How hard each equation pulls: the smallest y with `x = Aᵀ y`. Equations that
    /// nearly contradict each other pull against each other, far harder than others do.
    pub(super) fn multipliers(&mut self) -> &[[f64; D]] {
        let Self {
            matrix,
            x,
            step,
            dual,
            work,
            ..
        } = self;
        match &mut self.method {
            Method::Rows(_) | Method::FilteredRows(_) => return dual,
            Method::Columns(factor) | Method::FilteredColumns(factor) => {
                step.copy_from_slice(x);
                factor.solve(step);
                matrix.multiply(step, work);
            }
            Method::Inverse(inverse) => {
                work.fill([0.0; D]);
                for (x, row) in x.iter().zip(inverse.chunks_exact(work.len())) {
                    for (&entry, y) in row.iter().zip(&mut *work) {
                        for c in 0..D {
                            y[c] += entry * x[c];
                        }
                    }
                }
            }
        }
        work
    }

    fn update_residual(&mut self, b: &[[f64; D]]) {
        for (row, (residual, b)) in self.residual.iter_mut().zip(b).enumerate() {
            let moved = self.matrix.row_times(row, &self.x);
            *residual = std::array::from_fn(|c| b[c] - moved[c]);
        }
    }

    /// Sets `step` from `residual`, and updates `dual`.
    fn find_step(&mut self) {
        let Self {
            matrix,
            damping,
            step,
            residual,
            dual,
            work,
            ..
        } = self;
        step.fill([0.0; D]);
        match &mut self.method {
            Method::Rows(factor) => {
                subtract_scaled(work, residual, *damping, dual);
                factor.solve(work);
                add(dual, work);
                matrix.add_transposed(work, step);
            }
            Method::FilteredRows(factor) => {
                subtract_scaled(work, residual, *damping, dual);
                matrix.add_transposed(work, step);
                matrix.multiply(step, work);
                factor.solve(work);
                factor.solve(work);
                add(dual, work);
                step.fill([0.0; D]);
                matrix.add_transposed(work, step);
            }
            Method::Columns(factor) => {
                matrix.add_transposed(residual, step);
                add_scaled(step, -*damping, &self.x);
                factor.solve(step);
            }
            Method::FilteredColumns(factor) => {
                matrix.add_transposed(residual, step);
                add_scaled(step, -*damping, &self.x);
                factor.solve(step);
                factor.solve(step);
                matrix.multiply(step, work);
                step.fill([0.0; D]);
                matrix.add_transposed(work, step);
            }
            Method::Inverse(inverse) => {
                for (step, row) in step.iter_mut().zip(inverse.chunks_exact(residual.len())) {
                    for (&entry, r) in row.iter().zip(&*residual) {
                        for c in 0..D {
                            step[c] += entry * r[c];
                        }
                    }
                }
            }
        }
    }
}

fn choose<const D: usize>(
    matrix: &SparseRows,
    damping: f64,
    negligible: f64,
) -> Result<Method, String> {
    let (rows, columns) = (matrix.row_count(), matrix.column_count());
    let by_rows = rows <= columns;
    let mut gram = if by_rows {
        Gram::of(matrix)
    } else {
        Gram::of_transposed(matrix)
    };
    let order = gram.order();
    let largest = largest_diagonal(&gram);
    let smallest = if damping > 0.0 {
        SMALLEST_DAMPED_PIVOT
    } else {
        SMALLEST_PIVOT
    };

    gram.shift(damping);
    let reference = largest + damping;
    if let Ok(mut factor) = Cholesky::new(&gram, D) {
        let pivot = factor.smallest_pivot() / reference;
        if pivot >= SAFE_PIVOT
            || pivot >= smallest && is_accurate(matrix, by_rows, damping, &mut factor)
        {
            return Ok(if by_rows {
                Method::Rows(factor)
            } else {
                Method::Columns(factor)
            });
        }
    }

    let work = rows.saturating_mul(columns).saturating_mul(order);
    if work <= SMALL {
        let inverse = filtered_inverse(matrix, |sigma, largest| {
            if damping > 0.0 {
                sigma / (sigma * sigma + damping)
            } else if sigma > negligible * largest {
                1.0 / sigma
            } else {
                0.0
            }
        });
        if let Ok(inverse) = inverse {
            return Ok(Method::Inverse(inverse));
        }
    }

    gram.shift(-damping);
    filtered::<D>(gram, by_rows)
}

/// The method for large dependent systems, from one of the two products.
fn filtered<const D: usize>(mut gram: Gram, by_rows: bool) -> Result<Method, String> {
    let largest = largest_diagonal(&gram);
    let mut shift = FILTER * largest;
    gram.shift(shift);
    loop {
        match Cholesky::new(&gram, D) {
            Ok(factor) if by_rows => return Ok(Method::FilteredRows(factor)),
            Ok(factor) => return Ok(Method::FilteredColumns(factor)),
            // Rounding errors are far below: not known to happen.
            Err(reason) if shift > 1e-6 * largest => return Err(reason),
            Err(_) => {
                gram.shift(9.0 * shift);
                shift *= 10.0;
            }
        }
    }
}

fn largest_diagonal(gram: &Gram) -> f64 {
    (0..gram.order()).fold(0.0_f64, |a, j| a.max(gram.diagonal(j)))
}

/// Whether solutions of `A Aᵀ + μ` or `Aᵀ A + μ` can be refined: not if rounding has put
/// something in the place of a pivot that is zero.
fn is_accurate(matrix: &SparseRows, by_rows: bool, damping: f64, factor: &mut Cholesky) -> bool {
    // Any vector rich in all directions serves; this one needs no random source.
    let (rows, columns) = (matrix.row_count(), matrix.column_count());
    let (order, other) = if by_rows {
        (rows, columns)
    } else {
        (columns, rows)
    };
    let rhs: Vec<[f64; 1]> = (0..order).map(|j| [(1.0 + j as f64).sin()]).collect();
    let (mut x, mut residual) = (vec![[0.0]; rhs.len()], rhs.clone());
    let mut other = vec![[0.0]; other];
    for _ in 0..4 {
        factor.solve(&mut residual);
        add(&mut x, &residual);
        if by_rows {
            other.fill([0.0]);
            matrix.add_transposed(&x, &mut other);
            matrix.multiply(&other, &mut residual);
        } else {
            matrix.multiply(&x, &mut other);
            residual.fill([0.0]);
            matrix.add_transposed(&other, &mut residual);
        }
        // Small, but for rounding errors of a large x: those of a factor that is wrong are
        // of the size of the right-hand side.
        let largest = x.iter().fold(0.0_f64, |a, x| a.max(x[0].abs()));
        let goal = (1e-14 * largest).clamp(1e-8, 1e-3);
        let mut worst = 0.0_f64;
        for (j, r) in residual.iter_mut().enumerate() {
            r[0] = rhs[j][0] - r[0] - damping * x[j][0];
            worst = worst.max(r[0].abs());
        }
        if worst <= goal {
            return true;
        }
    }
    false
}

fn sum_of_squares<const D: usize>(x: &[[f64; D]]) -> f64 {
    // Several sums at a time, which a processor can add in parallel.
    let mut sums = [0.0; 8];
    let (chunks, rest) = x.as_flattened().as_chunks::<8>();
    for chunk in chunks {
        for (sum, c) in sums.iter_mut().zip(chunk) {
            *sum += c * c;
        }
    }
    for (sum, c) in sums.iter_mut().zip(rest) {
        *sum += c * c;
    }
    sums.iter().sum()
}

fn add<const D: usize>(x: &mut [[f64; D]], y: &[[f64; D]]) {
    for (x, y) in x.as_flattened_mut().iter_mut().zip(y.as_flattened()) {
        *x += y;
    }
}

/// `x += factor y`.
fn add_scaled<const D: usize>(x: &mut [[f64; D]], factor: f64, y: &[[f64; D]]) {
    for (x, y) in x.as_flattened_mut().iter_mut().zip(y.as_flattened()) {
        *x += factor * y;
    }
}

/// `out = x − factor y`.
fn subtract_scaled<const D: usize>(
    out: &mut [[f64; D]],
    x: &[[f64; D]],
    factor: f64,
    y: &[[f64; D]],
) {
    out.copy_from_slice(x);
    add_scaled(out, -factor, y);
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Rows that each hold up to six entries side by side, like those of a spline. The
    /// last `copies` are sums of two of the others.
    fn matrix(rows: usize, copies: usize, columns: usize) -> impl Strategy<Value = SparseRows> {
        let row = (0..columns - 6, proptest::array::uniform6(0.1..1.0_f64));
        let pair = (0..rows - copies, 0..rows - copies);
        (
            proptest::collection::vec(row, rows - copies),
            proptest::collection::vec(pair, copies),
        )
            .prop_map(move |(independent, pairs)| {
                let mut matrix = SparseRows::with_capacity(rows, 12 * rows);
                let mut dense = vec![vec![0.0; columns]; rows];
                for (row, (start, values)) in dense.iter_mut().zip(&independent) {
                    row[*start..start + 6].copy_from_slice(values);
                }
                for (k, &(a, b)) in pairs.iter().enumerate() {
                    let sum = dense[a].iter().zip(&dense[b]).map(|(a, b)| a + b).collect();
                    dense[rows - copies + k] = sum;
                }
                for row in &dense {
                    for (column, &value) in row.iter().enumerate() {
                        if value > 0.0 {
                            matrix.push(column, value);
                        }
                    }
                    matrix.end_row();
                }
                matrix.set_column_count(columns);
                matrix
            })
    }

    fn solve(matrix: SparseRows, method: Method, b: &[[f64; 1]]) -> LeastNorm<1> {
        let mut system = LeastNorm::with_method(matrix, 0.0, method);
        system.solve(b, |_| 0.0);
        system
    }

    fn distance(a: &[[f64; 1]], b: &[[f64; 1]]) -> f64 {
        let squares = a.iter().zip(b).map(|(a, b)| (a[0] - b[0]) * (a[0] - b[0]));
        squares.sum::<f64>().sqrt()
    }

    fn pseudoinverse(matrix: &SparseRows) -> (Method, f64) {
        let condition = std::cell::Cell::new(1.0_f64);
        let inverse = filtered_inverse(matrix, |sigma, largest| {
            if sigma > 1e-11 * largest {
                condition.set(condition.get().max(largest / sigma));
                1.0 / sigma
            } else {
                0.0
            }
        });
        (Method::Inverse(inverse.unwrap()), condition.get())
    }

    fn copy(matrix: &SparseRows) -> SparseRows {
        // Twice transposed; the order within rows does not matter.
        matrix.transposed().transposed()
    }

    proptest! {
        /// Both filtered methods find the solution that the pseudoinverse gives, for
        /// dependent rows and right-hand sides that cannot be met.
        #[test]
        fn filtered_steps_lead_to_the_pseudoinverse(
            matrix in matrix(24, 6, 30),
            b in proptest::collection::vec(proptest::array::uniform1(-1.0..1.0_f64), 24),
        ) {
            let (inverse, condition) = pseudoinverse(&matrix);
            // Beyond, singular values approach those that the filter drops.
            prop_assume!(condition < 1e3);
            let expected = solve(copy(&matrix), inverse, &b);
            let zero = vec![[0.0]; 30];
            // Rounding errors of 1e-16 |b|, enlarged by (1e-16/λ)²/1e-16 = 2e-11 on the
            // way in, and by the condition on the way to x.
            let tolerance = 1e-9 * (1.0 + distance(&expected.x, &zero));
            for by_rows in [true, false] {
                let gram = if by_rows { Gram::of(&matrix) } else { Gram::of_transposed(&matrix) };
                let found = solve(copy(&matrix), filtered::<1>(gram, by_rows).unwrap(), &b);
                let error = distance(&found.x, &expected.x);
                prop_assert!(error <= tolerance, "{error} {condition} {by_rows}");
            }
        }

        /// The product is the same, dense or sparse, by rows or by columns; so are
        /// solutions with its factor.
        #[test]
        fn dense_and_sparse_agree(matrix in matrix(20, 0, 60)) {
            let (inverse, condition) = pseudoinverse(&matrix);
            // Seven rows may share six columns by chance.
            let dense = Cholesky::new(&Gram::dense(&matrix), 1);
            prop_assume!(condition < 1e3 && dense.is_ok_and(|f| f.smallest_pivot() > 1e-6));
            let b: Vec<[f64; 1]> = (0..20).map(|i| [f64::from(i).cos()]).collect();
            let expected = solve(copy(&matrix), inverse, &b);
            for gram in [Gram::dense(&matrix), Gram::sparse(&matrix, &matrix.transposed())] {
                let factor = Cholesky::new(&gram, 1).unwrap();
                let found = solve(copy(&matrix), Method::Rows(factor), &b);
                // Steps are refined to some 1e-16 of x, enlarged by the condition.
                prop_assert!(distance(&found.x, &expected.x) <= 1e-11);
            }
        }
    }
}
