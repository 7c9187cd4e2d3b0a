//! Sparse matrices by rows, and their products with themselves.

/// A sparse matrix, row after row. Within a row, columns are all different.
#[derive(Debug, Clone)]
pub(super) struct SparseRows {
    starts: Vec<usize>,
    columns: Vec<usize>,
    values: Vec<f64>,
    column_count: usize,
}

impl SparseRows {
    /// A matrix without rows, with room for some entries.
    pub(super) fn with_capacity(rows: usize, entries: usize) -> Self {
        let mut starts = Vec::with_capacity(rows + 1);
        starts.push(0);
        Self {
            starts,
            columns: Vec::with_capacity(entries),
            values: Vec::with_capacity(entries),
            column_count: 0,
        }
    }

    /// Adds an entry to the row that [`Self::end_row`] will close.
    #[inline]
    pub(super) fn push(&mut self, column: usize, value: f64) {
        self.columns.push(column);
        self.values.push(value);
    }

    /// The entries pushed since the last row.
    pub(super) fn open_row(&self) -> &[f64] {
        &self.values[*self.starts.last().expect("there is a first start")..]
    }

    /// Closes a row.
    pub(super) fn end_row(&mut self) {
        self.starts.push(self.columns.len());
    }

    /// Forgets the entries pushed since the last row.
    pub(super) fn discard_row(&mut self) {
        let start = *self.starts.last().expect("there is a first start");
        self.columns.truncate(start);
        self.values.truncate(start);
    }

    /// Must follow the last row.
    pub(super) fn set_column_count(&mut self, count: usize) {
        self.column_count = count;
    }

    pub(super) fn row_count(&self) -> usize {
        self.starts.len() - 1
    }

    pub(super) fn column_count(&self) -> usize {
        self.column_count
    }

    /// Columns and values of a row.
    #[inline]
    pub(super) fn row(&self, row: usize) -> (&[usize], &[f64]) {
        let range = self.starts[row]..self.starts[row + 1];
        (&self.columns[range.clone()], &self.values[range])
    }

    /// Multiplies each row by a number.
    pub(super) fn scale_rows(&mut self, factors: &[f64]) {
        for (row, &factor) in factors.iter().enumerate() {
            for value in &mut self.values[self.starts[row]..self.starts[row + 1]] {
                *value *= factor;
            }
        }
    }

    /// The product of a row with a vector.
    #[inline]
    pub(super) fn row_times<const D: usize>(&self, row: usize, x: &[[f64; D]]) -> [f64; D] {
        let (columns, values) = self.row(row);
        let mut sum = [0.0; D];
        for (&column, &value) in columns.iter().zip(values) {
            let x = &x[column];
            for c in 0..D {
                sum[c] += value * x[c];
            }
        }
        sum
    }

    /// The product of a row with a vector of numbers.
    fn row_dot(&self, row: usize, x: &[f64]) -> f64 {
        // Several sums at a time, which a processor can add in parallel.
        let mut sums = [0.0; 4];
        let (columns, values) = self.row(row);
        let (columns, last_columns) = columns.as_chunks::<4>();
        let (values, last_values) = values.as_chunks::<4>();
        for (columns, values) in columns.iter().zip(values) {
            for lane in 0..4 {
                sums[lane] += values[lane] * x[columns[lane]];
            }
        }
        for (&column, &value) in last_columns.iter().zip(last_values) {
            sums[0] += value * x[column];
        }
        sums.iter().sum()
    }

    /// `out = A x`.
    pub(super) fn multiply<const D: usize>(&self, x: &[[f64; D]], out: &mut [[f64; D]]) {
        for (row, out) in out.iter_mut().enumerate() {
            *out = self.row_times(row, x);
        }
    }

    /// `out += Aᵀ y`.
    pub(super) fn add_transposed<const D: usize>(&self, y: &[[f64; D]], out: &mut [[f64; D]]) {
        for (row, y) in y.iter().enumerate() {
            let (columns, values) = self.row(row);
            for (&column, &value) in columns.iter().zip(values) {
                let out = &mut out[column];
                for c in 0..D {
                    out[c] += value * y[c];
                }
            }
        }
    }

    /// The transpose, its columns in ascending order within each row.
    pub(super) fn transposed(&self) -> Self {
        let mut starts = vec![0; self.column_count + 1];
        for &column in &self.columns {
            starts[column + 1] += 1;
        }
        for i in 1..starts.len() {
            starts[i] += starts[i - 1];
        }
        let mut next = starts.clone();
        let mut columns = vec![0; self.columns.len()];
        let mut values = vec![0.0; self.values.len()];
        for row in 0..self.row_count() {
            let (from, numbers) = self.row(row);
            for (&column, &value) in from.iter().zip(numbers) {
                columns[next[column]] = row;
                values[next[column]] = value;
                next[column] += 1;
            }
        }
        Self {
            starts,
            columns,
            values,
            column_count: self.row_count(),
        }
    }

    /// The same numbers as a dense matrix, row after row.
    pub(super) fn to_dense(&self) -> Vec<f64> {
        let mut dense = vec![0.0; self.row_count() * self.column_count];
        for row in 0..self.row_count() {
            let (columns, values) = self.row(row);
            for (&column, &value) in columns.iter().zip(values) {
                dense[row * self.column_count + column] = value;
            }
        }
        dense
    }
}

/// The lower triangle of a symmetric matrix `A Aᵀ`, column after column.
#[derive(Debug)]
pub(super) enum Gram {
    /// All entries; those above the diagonal are zero.
    Dense { order: usize, values: Vec<f64> },
    /// The entries that are not zero, rows in ascending order within a column.
    Sparse {
        starts: Vec<usize>,
        rows: Vec<usize>,
        values: Vec<f64>,
    },
}

/// Matrices of at most this order are dense: below, the symbolic analysis of the sparse
/// factorisation costs more than the multiplications that it saves.
pub(super) const DENSE_ORDER: usize = 128;

impl Gram {
    /// The product `A Aᵀ`.
    pub(super) fn of(matrix: &SparseRows) -> Self {
        if matrix.row_count() <= DENSE_ORDER {
            Self::dense(matrix)
        } else {
            Self::sparse(matrix, &matrix.transposed())
        }
    }

    /// The product `Aᵀ A`.
    pub(super) fn of_transposed(matrix: &SparseRows) -> Self {
        let transposed = matrix.transposed();
        if transposed.row_count() <= DENSE_ORDER {
            Self::dense(&transposed)
        } else {
            Self::sparse(&transposed, matrix)
        }
    }

    pub(super) fn dense(matrix: &SparseRows) -> Self {
        let order = matrix.row_count();
        let mut values = vec![0.0; order * order];
        let mut spread = vec![0.0; matrix.column_count()];
        for j in 0..order {
            let (columns, numbers) = matrix.row(j);
            for (&column, &value) in columns.iter().zip(numbers) {
                spread[column] = value;
            }
            for i in j..order {
                values[i + order * j] = matrix.row_dot(i, &spread);
            }
            for &column in columns {
                spread[column] = 0.0;
            }
        }
        Self::Dense { order, values }
    }

    pub(super) fn sparse(matrix: &SparseRows, transposed: &SparseRows) -> Self {
        let order = matrix.row_count();
        let mut starts = Vec::with_capacity(order + 1);
        let (mut rows, mut values) = (Vec::new(), Vec::new());
        // The column in the making, and for which column an entry of it was last used.
        let mut sums = vec![0.0; order];
        let mut used = vec![usize::MAX; order];
        starts.push(0);
        for j in 0..order {
            let first = rows.len();
            let (columns, numbers) = matrix.row(j);
            for (&column, &a) in columns.iter().zip(numbers) {
                let (partners, weights) = transposed.row(column);
                for (&i, &b) in partners.iter().zip(weights) {
                    if i < j {
                        continue;
                    }
                    if used[i] == j {
                        sums[i] += a * b;
                    } else {
                        used[i] = j;
                        sums[i] = a * b;
                        rows.push(i);
                    }
                }
            }
            rows[first..].sort_unstable();
            values.extend(rows[first..].iter().map(|&i| sums[i]));
            starts.push(rows.len());
        }
        Self::Sparse {
            starts,
            rows,
            values,
        }
    }

    pub(super) fn order(&self) -> usize {
        match self {
            Self::Dense { order, .. } => *order,
            Self::Sparse { starts, .. } => starts.len() - 1,
        }
    }

    pub(super) fn diagonal(&self, j: usize) -> f64 {
        match self {
            Self::Dense { order, values } => values[j * (order + 1)],
            // Rows ascend, so each column of a lower triangle starts on the diagonal.
            Self::Sparse { starts, values, .. } => values[starts[j]],
        }
    }

    /// Adds a number to each entry of the diagonal.
    pub(super) fn shift(&mut self, shift: f64) {
        for j in 0..self.order() {
            match self {
                Self::Dense { order, values } => values[j * (*order + 1)] += shift,
                Self::Sparse { starts, values, .. } => values[starts[j]] += shift,
            }
        }
    }
}
