//! Sparse Cholesky factorisation. The only file that names faer.
//!
//! The factorisation runs on one thread by request (`Par::Seq`), whatever the
//! process-wide setting is: results are then bitwise repeatable, and the open
//! reports of wrong parallel results do not apply.

use faer::{
    Conj, MatMut, Par, Side,
    dyn_stack::{MemBuffer, MemStack, StackReq},
    sparse::{
        SparseColMatRef, SymbolicSparseColMatRef,
        linalg::cholesky::{
            CholeskySymbolicParams, LltRef, SymbolicCholesky, SymbolicCholeskyRaw,
            SymmetricOrdering, factorize_symbolic_cholesky, supernodal::SupernodalLltRef,
        },
    },
};
use nalgebra_sparse::CscMatrix;

use crate::FemError;

/// A probe solution may miss its right-hand side by this much, relative to
/// `‖A‖ ‖x‖`. Backward-stable Cholesky stays below `n ε` with `n` the unknowns,
/// in practice near `√n ε`: 1e-10 leaves room for half a million unknowns and is
/// far from what a wrong factor gives.
const PROBE_TOLERANCE: f64 = 1e-10;

/// The Cholesky factor `L Lᵀ = P A Pᵀ` of a symmetric positive definite matrix.
#[derive(Debug)]
pub(crate) struct SparseCholesky {
    symbolic: SymbolicCholesky<usize>,
    values: Vec<f64>,
    diagonal: Vec<f64>,
}

impl SparseCholesky {
    /// Factors `a`, both triangles stored, and checks one probe solution.
    pub(crate) fn factor(a: &CscMatrix<f64>) -> Result<Self, FemError> {
        let unknowns = a.ncols();
        let fail = |reason: String| FemError::Factorisation { unknowns, reason };

        let pattern = SymbolicSparseColMatRef::new_checked(
            unknowns,
            unknowns,
            a.col_offsets(),
            None,
            a.row_indices(),
        );
        let symbolic = factorize_symbolic_cholesky(
            pattern,
            Side::Lower,
            SymmetricOrdering::Amd,
            CholeskySymbolicParams::default(),
        )
        .map_err(|error| fail(format!("symbolic analysis: {error}")))?;

        let mut values = vec![0.0; symbolic.len_val()];
        let request = symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default());
        symbolic
            .factorize_numeric_llt(
                &mut values,
                SparseColMatRef::new(pattern, a.values()),
                Side::Lower,
                Default::default(),
                Par::Seq,
                MemStack::new(&mut MemBuffer::new(request)),
                Default::default(),
            )
            .map_err(|error| fail(format!("not positive definite: {error:?}")))?;

        let mut diagonal = vec![0.0; unknowns];
        for (j, column) in a.col_iter().enumerate() {
            diagonal[j] = column.get_entry(j).map_or(0.0, |entry| entry.into_value());
        }
        let factor = Self {
            symbolic,
            values,
            diagonal,
        };
        factor.check_probe(a)?;
        Ok(factor)
    }

    /// Solves `A X = B` in place for `columns` right-hand sides stored one after
    /// another.
    pub(crate) fn solve_in_place(&self, rhs: &mut [f64], columns: usize) {
        let unknowns = self.symbolic.nrows();
        let request: StackReq = self
            .symbolic
            .solve_in_place_scratch::<f64>(columns, Par::Seq);
        LltRef::new(&self.symbolic, &self.values).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(rhs, unknowns, columns),
            Par::Seq,
            MemStack::new(&mut MemBuffer::new(request)),
        );
    }

    /// The unknown with the smallest pivot `L_kk²` relative to its diagonal entry
    /// `A_kk`, and that ratio. Rounding leaves a singular matrix with pivots near 1e-12,
    /// so this tells what "the factorisation succeeded" does not.
    pub(crate) fn smallest_pivot(&self) -> (usize, f64) {
        let forward = self.symbolic.perm().map(|perm| perm.arrays().0);
        let original = |k: usize| forward.map_or(k, |forward| forward[k]);
        let mut smallest = (0, f64::INFINITY);
        let mut visit = |k: usize, pivot: f64| {
            let unknown = original(k);
            let ratio = pivot * pivot / self.diagonal[unknown];
            if ratio < smallest.1 {
                smallest = (unknown, ratio);
            }
        };
        match self.symbolic.raw() {
            SymbolicCholeskyRaw::Simplicial(structure) => {
                // Rows ascend within a column of L, so each starts on the diagonal.
                for (k, &start) in structure.col_ptr()[..structure.ncols()].iter().enumerate() {
                    visit(k, self.values[start]);
                }
            }
            SymbolicCholeskyRaw::Supernodal(structure) => {
                let factor = SupernodalLltRef::new(structure, &self.values);
                for s in 0..structure.n_supernodes() {
                    let node = factor.supernode(s);
                    for j in 0..node.val().ncols() {
                        visit(node.start() + j, node.val()[(j, j)]);
                    }
                }
            }
        }
        smallest
    }

    fn check_probe(&self, a: &CscMatrix<f64>) -> Result<(), FemError> {
        let unknowns = a.ncols();
        // Any vector rich in all directions serves; this one needs no random source.
        let rhs: Vec<f64> = (0..unknowns).map(|i| (1.0 + i as f64).sin()).collect();
        let scale = self.diagonal.iter().fold(0.0_f64, |m, &d| m.max(d));
        let rhs: Vec<f64> = rhs.iter().map(|v| v * scale).collect();
        let mut x = rhs.clone();
        self.solve_in_place(&mut x, 1);
        let mut residual = rhs;
        for (j, column) in a.col_iter().enumerate() {
            for (&i, &v) in column.row_indices().iter().zip(column.values()) {
                residual[i] -= v * x[j];
            }
        }
        let max = |v: &[f64]| v.iter().fold(0.0_f64, |m, c| m.max(c.abs()));
        let relative = max(&residual) / (scale * max(&x));
        if relative <= PROBE_TOLERANCE {
            return Ok(());
        }
        Err(FemError::Factorisation {
            unknowns,
            reason: format!("a probe solution misses its right-hand side by {relative:.1e}"),
        })
    }
}
