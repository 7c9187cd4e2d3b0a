//! Small square matrices, row-major, of two or three rows.

/// A matrix: `m[row][column]`.
pub(crate) type Matrix<const D: usize> = [[f64; D]; D];

/// The determinant.
pub(crate) fn determinant<const D: usize>(m: &Matrix<D>) -> f64 {
    let cofactors = cofactors(m);
    let mut sum = m[0][0] * cofactors[0][0];
    for c in 1..D {
        sum += m[0][c] * cofactors[0][c];
    }
    sum
}

/// The matrix of cofactors, `det(m) m⁻ᵀ`; it exists for singular matrices too.
pub(crate) fn cofactors<const D: usize>(m: &Matrix<D>) -> Matrix<D> {
    std::array::from_fn(|r| {
        std::array::from_fn(|c| {
            if D == 2 {
                let sign = if r == c { 1.0 } else { -1.0 };
                return sign * m[1 - r][1 - c];
            }
            let (r1, r2) = ((r + 1) % 3, (r + 2) % 3);
            let (c1, c2) = ((c + 1) % 3, (c + 2) % 3);
            m[r1][c1] * m[r2][c2] - m[r1][c2] * m[r2][c1]
        })
    })
}

/// The product with a vector.
pub(crate) fn multiply<const D: usize>(m: &Matrix<D>, v: [f64; D]) -> [f64; D] {
    m.map(|row| {
        let mut sum = row[0] * v[0];
        for c in 1..D {
            sum += row[c] * v[c];
        }
        sum
    })
}

/// The product of the inverse with a vector; not finite if there is no inverse.
pub(crate) fn solve<const D: usize>(m: &Matrix<D>, v: [f64; D]) -> [f64; D] {
    let cofactors = cofactors(m);
    let determinant = determinant(m);
    std::array::from_fn(|r| {
        let mut sum = cofactors[0][r] * v[0];
        for c in 1..D {
            sum += cofactors[c][r] * v[c];
        }
        sum / determinant
    })
}
