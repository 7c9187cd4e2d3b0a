//! Factorisations. The only file here that names faer.
//!
//! All run on one thread by request (`Par::Seq`), whatever the process-wide setting is,
//! so that results are repeatable.

use std::sync::Arc;

use faer::{
    Conj, MatMut, MatRef, Par,
    diag::DiagMut,
    dyn_stack::{MemBuffer, MemStack, StackReq},
    linalg::{
        cholesky::llt,
        svd::{ComputeSvdVectors, svd, svd_scratch},
    },
    sparse::{
        SparseColMatRef, SymbolicSparseColMatRef,
        linalg::cholesky::{
            CholeskySymbolicParams, LltRef, SymbolicCholesky, SymbolicCholeskyRaw,
            SymmetricOrdering, factorize_symbolic_cholesky, supernodal::SupernodalLltRef,
        },
    },
};

use super::sparse::{Gram, SparseRows};

/// The Cholesky factor of a symmetric positive definite matrix, with the memory that
/// solving with it needs.
pub(super) struct Cholesky {
    /// Shared by copies, which have scratch memory of their own.
    factor: Arc<Factor>,
    request: StackReq,
    scratch: MemBuffer,
}

impl Clone for Cholesky {
    fn clone(&self) -> Self {
        Self::with_scratch(Arc::clone(&self.factor), self.request)
    }
}

enum Factor {
    /// The lower triangle, column after column; what is above is not used.
    Dense { order: usize, values: Vec<f64> },
    Sparse {
        symbolic: Box<SymbolicCholesky<usize>>,
        values: Vec<f64>,
    },
}

impl std::fmt::Debug for Cholesky {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let kind = match &*self.factor {
            Factor::Dense { order, .. } => format!("dense of order {order}"),
            Factor::Sparse { symbolic, .. } => format!("sparse of order {}", symbolic.nrows()),
        };
        f.debug_tuple("Cholesky").field(&kind).finish()
    }
}

impl Cholesky {
    /// Factors a matrix, to solve for `columns` right-hand sides at a time.
    pub(super) fn new(gram: &Gram, columns: usize) -> Result<Self, String> {
        match gram {
            Gram::Dense { order, values } => Self::dense(*order, values.clone(), columns),
            Gram::Sparse {
                starts,
                rows,
                values,
            } => Self::sparse(starts, rows, values, columns),
        }
    }

    fn dense(order: usize, mut values: Vec<f64>, columns: usize) -> Result<Self, String> {
        let request =
            llt::factor::cholesky_in_place_scratch::<f64>(order, Par::Seq, <_>::default());
        llt::factor::cholesky_in_place(
            MatMut::from_column_major_slice_mut(&mut values, order, order),
            <_>::default(),
            Par::Seq,
            MemStack::new(&mut MemBuffer::new(request)),
            <_>::default(),
        )
        .map_err(|error| format!("not positive definite: {error:?}"))?;
        let request = llt::solve::solve_in_place_scratch::<f64>(order, columns, Par::Seq);
        let factor = Factor::Dense { order, values };
        Ok(Self::with_scratch(Arc::new(factor), request))
    }

    fn sparse(
        starts: &[usize],
        rows: &[usize],
        values: &[f64],
        columns: usize,
    ) -> Result<Self, String> {
        let order = starts.len() - 1;
        let pattern = SymbolicSparseColMatRef::new_checked(order, order, starts, None, rows);
        let symbolic = factorize_symbolic_cholesky(
            pattern,
            faer::Side::Lower,
            SymmetricOrdering::Amd,
            CholeskySymbolicParams::default(),
        )
        .map_err(|error| format!("symbolic analysis: {error}"))?;
        let mut factor = vec![0.0; symbolic.len_val()];
        let request = symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, <_>::default());
        symbolic
            .factorize_numeric_llt(
                &mut factor,
                SparseColMatRef::new(pattern, values),
                faer::Side::Lower,
                <_>::default(),
                Par::Seq,
                MemStack::new(&mut MemBuffer::new(request)),
                <_>::default(),
            )
            .map_err(|error| format!("not positive definite: {error:?}"))?;
        let request = symbolic.solve_in_place_scratch::<f64>(columns, Par::Seq);
        let factor = Factor::Sparse {
            symbolic: Box::new(symbolic),
            values: factor,
        };
        Ok(Self::with_scratch(Arc::new(factor), request))
    }

    fn with_scratch(factor: Arc<Factor>, request: StackReq) -> Self {
        Self {
            factor,
            request,
            scratch: MemBuffer::new(request),
        }
    }

    /// Solves in place, for as many right-hand sides as were announced, without
    /// allocation.
    pub(super) fn solve<const D: usize>(&mut self, x: &mut [[f64; D]]) {
        let order = x.len();
        let x = MatMut::from_row_major_slice_mut(x.as_flattened_mut(), order, D);
        let stack = MemStack::new(&mut self.scratch);
        match &*self.factor {
            Factor::Dense { order, values } => {
                let factor = MatRef::from_column_major_slice(values, *order, *order);
                llt::solve::solve_in_place_with_conj(factor, Conj::No, x, Par::Seq, stack);
            }
            Factor::Sparse { symbolic, values } => {
                LltRef::new(symbolic, values).solve_in_place_with_conj(Conj::No, x, Par::Seq, stack)
            }
        }
    }

    /// The smallest pivot, the square of a diagonal entry of the factor, relative to
    /// `reference` of the same unknown.
    pub(super) fn smallest_pivot(&self, reference: impl Fn(usize) -> f64) -> f64 {
        let mut smallest = f64::INFINITY;
        let mut visit = |unknown: usize, entry: f64| {
            smallest = smallest.min(entry * entry / reference(unknown));
        };
        let (symbolic, values) = match &*self.factor {
            Factor::Dense { order, values } => {
                for j in 0..*order {
                    visit(j, values[j * (order + 1)]);
                }
                return smallest;
            }
            Factor::Sparse { symbolic, values } => (symbolic, values),
        };
        let order = symbolic.perm().map(|perm| perm.arrays().0);
        let original = |k: usize| order.map_or(k, |order| order[k]);
        match symbolic.raw() {
            SymbolicCholeskyRaw::Simplicial(structure) => {
                // Each column of the factor starts on the diagonal.
                for (k, &start) in structure.col_ptr()[..structure.ncols()].iter().enumerate() {
                    visit(original(k), values[start]);
                }
            }
            SymbolicCholeskyRaw::Supernodal(structure) => {
                let factor = SupernodalLltRef::new(structure, values);
                for s in 0..structure.n_supernodes() {
                    let node = factor.supernode(s);
                    for j in 0..node.val().ncols() {
                        visit(original(node.start() + j), node.val()[(j, j)]);
                    }
                }
            }
        }
        smallest
    }
}

/// The dense matrix `V g(Σ) Uᵀ`, row after row, of a matrix `U Σ Vᵀ`: its pseudoinverse
/// if `g(σ)` is 1/σ. The second argument of `g` is the largest singular value.
pub(super) fn filtered_inverse(
    matrix: &SparseRows,
    g: impl Fn(f64, f64) -> f64,
) -> Result<Vec<f64>, String> {
    let (m, n) = (matrix.row_count(), matrix.column_count());
    let k = m.min(n);
    let dense = matrix.to_dense();
    let (mut u, mut s, mut v) = (vec![0.0; m * k], vec![0.0; k], vec![0.0; n * k]);
    let thin = ComputeSvdVectors::Thin;
    let request = svd_scratch::<f64>(m, n, thin, thin, Par::Seq, <_>::default());
    svd(
        MatRef::from_row_major_slice(&dense, m, n),
        DiagMut::from_slice_mut(&mut s),
        Some(MatMut::from_column_major_slice_mut(&mut u, m, k)),
        Some(MatMut::from_column_major_slice_mut(&mut v, n, k)),
        Par::Seq,
        MemStack::new(&mut MemBuffer::new(request)),
        <_>::default(),
    )
    .map_err(|error| format!("singular values: {error:?}"))?;
    let largest = s.iter().fold(0.0_f64, |a, &b| a.max(b));
    let mut inverse = vec![0.0; n * m];
    for (l, &sigma) in s.iter().enumerate() {
        let factor = g(sigma, largest);
        let u = &u[m * l..m * (l + 1)];
        for (row, &v) in inverse.chunks_exact_mut(m).zip(&v[n * l..n * (l + 1)]) {
            for (entry, &u) in row.iter_mut().zip(u) {
                *entry += v * factor * u;
            }
        }
    }
    Ok(inverse)
}
