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

/// Pivots below this, relative to the diagonal, count as zero: the row is a combination
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

/// Singular values below this, relative to the largest, count as zero.
const SMALLEST_SINGULAR_VALUE: f64 = 1e-13;

/// Steps at most. Each one that is taken is shorter than the one before.
const STEPS: usize = 40;

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
    /// Factors what is needed. The error is what the last factorisation said.
    pub(super) fn new(matrix: SparseRows, damping: f64) -> Result<Self, String> {
        let (rows, columns) = (matrix.row_count(), matrix.column_count());
        Ok(Self {
            method: choose::<D>(&matrix, damping)?,
            matrix,
            damping,
            x: vec![[0.0; D]; columns],
            step: vec![[0.0; D]; columns],
            residual: vec![[0.0; D]; rows],
            dual: vec![[0.0; D]; rows],
            work: vec![[0.0; D]; rows],
        })
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
            let small = |(row, r): (usize, &[f64; D])| largest(&[*r]) <= goal(row);
            if self.damping <= 0.0 && self.residual.iter().enumerate().all(small) {
                break;
            }
            self.find_step();
            let length = largest(&self.step);
            // Also if it is not a number.
            if !(length < 0.9 * before) {
                break;
            }
            before = length;
            add(&mut self.x, &self.step);
            self.update_residual(b);
            if self.damping > 0.0 && matches!(self.method, Method::Inverse(_)) {
                break;
            }
            if length <= f64::EPSILON * largest(&self.x) {
                break;
            }
        }
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

fn choose<const D: usize>(matrix: &SparseRows, damping: f64) -> Result<Method, String> {
    let (rows, columns) = (matrix.row_count(), matrix.column_count());
    let by_rows = rows <= columns;
    let mut gram = if by_rows {
        Gram::of(matrix)
    } else {
        Gram::of_transposed(matrix)
    };
    let order = gram.order();
    let largest = (0..order).fold(0.0_f64, |a, j| a.max(gram.diagonal(j)));
    let smallest = if damping > 0.0 {
        SMALLEST_DAMPED_PIVOT
    } else {
        SMALLEST_PIVOT
    };

    gram.shift(damping);
    // Rows may be scaled at will; columns may not: one that hardly occurs in any row is
    // as good as none.
    let reference: Vec<f64> = (0..order)
        .map(|j| {
            if by_rows {
                gram.diagonal(j)
            } else {
                largest + damping
            }
        })
        .collect();
    if let Ok(mut factor) = Cholesky::new(&gram, D) {
        let pivot = factor.smallest_pivot(|j| reference[j]);
        if pivot >= SAFE_PIVOT
            || pivot >= smallest && is_accurate(matrix, by_rows, damping, &mut factor, &reference)
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
            } else if sigma > SMALLEST_SINGULAR_VALUE * largest {
                1.0 / sigma
            } else {
                0.0
            }
        });
        if let Ok(inverse) = inverse {
            return Ok(Method::Inverse(inverse));
        }
    }

    let mut shift = FILTER * largest;
    gram.shift(shift - damping);
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

/// Whether solutions of `A Aᵀ + μ` or `Aᵀ A + μ` can be refined: not if rounding has put
/// something in the place of a pivot that is zero.
fn is_accurate(
    matrix: &SparseRows,
    by_rows: bool,
    damping: f64,
    factor: &mut Cholesky,
    reference: &[f64],
) -> bool {
    // Any vector rich in all directions serves; this one needs no random source.
    let scale = |j: usize| reference[j].sqrt();
    let rhs: Vec<[f64; 1]> = (0..reference.len())
        .map(|j| [scale(j) * (1.0 + j as f64).sin()])
        .collect();
    let (mut x, mut residual) = (vec![[0.0]; rhs.len()], rhs.clone());
    let mut other = vec![
        [0.0];
        if by_rows {
            matrix.column_count()
        } else {
            matrix.row_count()
        }
    ];
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
        let mut worst = 0.0_f64;
        for (j, r) in residual.iter_mut().enumerate() {
            r[0] = rhs[j][0] - r[0] - damping * x[j][0];
            worst = worst.max(r[0].abs() / scale(j));
        }
        if worst <= 1e-8 {
            return true;
        }
    }
    false
}

/// The largest component.
fn largest<const D: usize>(x: &[[f64; D]]) -> f64 {
    x.as_flattened().iter().fold(0.0, |a, c| {
        // Unlike `max`, keeps what is not a number.
        if c.abs() <= a { a } else { c.abs() }
    })
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
