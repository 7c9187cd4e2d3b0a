//! Polynomials over the unit cube in Bernstein form, and the signs they take.

use super::number::{Number, binomial};

/// Coefficients along every axis, first axis fastest.
#[derive(Debug, Clone)]
pub(crate) struct Bernstein<T, const D: usize> {
    pub(crate) degree: [usize; D],
    pub(crate) coefficients: Vec<T>,
}

/// Which signs a polynomial takes on the closed unit cube, as far as that was found out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Signs {
    /// It is positive somewhere.
    pub(crate) positive: bool,
    /// It is negative somewhere.
    pub(crate) negative: bool,
    /// It is zero somewhere; not looked for once it has both signs.
    pub(crate) zero: bool,
    /// Some part was given up, so that there may be more signs than those named.
    pub(crate) open: bool,
}

impl Signs {
    pub(crate) fn only_positive(self) -> bool {
        self.positive && !self.negative && !self.zero && !self.open
    }

    pub(crate) fn both(self) -> bool {
        self.positive && self.negative
    }

    pub(crate) fn with(self, other: Self) -> Self {
        Self {
            positive: self.positive || other.positive,
            negative: self.negative || other.negative,
            zero: self.zero || other.zero,
            open: self.open || other.open,
        }
    }
}

/// All index tuples below `count`, first axis fastest.
pub(crate) fn indices<const D: usize>(count: [usize; D]) -> impl Iterator<Item = [usize; D]> {
    (0..count.iter().product()).map(move |mut rest: usize| {
        count.map(|n| {
            let index = rest % n;
            rest /= n;
            index
        })
    })
}

pub(crate) fn linear<const D: usize>(index: [usize; D], count: [usize; D]) -> usize {
    (0..D)
        .rev()
        .fold(0, |sum, axis| sum * count[axis] + index[axis])
}

impl<T: Number, const D: usize> Bernstein<T, D> {
    fn count(&self) -> [usize; D] {
        self.degree.map(|n| n + 1)
    }

    /// One number from each coefficient and its index.
    fn map<U>(&self, f: impl Fn([usize; D], &T) -> U) -> Bernstein<U, D> {
        let coefficients = std::iter::zip(indices(self.count()), &self.coefficients)
            .map(|(index, c)| f(index, c))
            .collect();
        Bernstein {
            degree: self.degree,
            coefficients,
        }
    }

    /// The derivative along an axis, plus a constant.
    pub(crate) fn slope(&self, axis: usize, constant: &T) -> Self {
        let mut degree = self.degree;
        degree[axis] -= 1;
        let count = self.count();
        let coefficients = indices(degree.map(|n| n + 1))
            .map(|mut index| {
                let low = &self.coefficients[linear(index, count)];
                index[axis] += 1;
                let high = &self.coefficients[linear(index, count)];
                high.difference(low)
                    .times(self.degree[axis] as u64)
                    .sum(constant)
            })
            .collect();
        Self {
            degree,
            coefficients,
        }
    }

    /// The coefficients times the binomials: products of polynomials are then
    /// convolutions.
    fn scaled(&self) -> Self {
        self.map(|index, c| {
            let factor = (0..D).map(|axis| binomial(self.degree[axis], index[axis]));
            c.times(factor.product())
        })
    }

    /// Back from the scaled form: the Bernstein coefficients, all times the same number,
    /// which is returned as well.
    fn unscaled(&self) -> (Self, u64) {
        // The least common multiple of the binomials of n is that of 1 … n + 1 over n + 1.
        let gcd = |mut a: u64, mut b: u64| {
            while b > 0 {
                (a, b) = (b, a % b);
            }
            a
        };
        let multiple = |n: usize| {
            (0..=n).fold(1, |m, k| {
                let b = binomial(n, k);
                m / gcd(m, b) * b
            })
        };
        let multiples = self.degree.map(multiple);
        let unscaled = self.map(|index, c| {
            let factor =
                (0..D).map(|axis| multiples[axis] / binomial(self.degree[axis], index[axis]));
            c.times(factor.product())
        });
        (unscaled, multiples.iter().product())
    }

    /// The product of polynomials in scaled form.
    fn convolution(&self, other: &Self) -> Self {
        let degree: [usize; D] = std::array::from_fn(|i| self.degree[i] + other.degree[i]);
        let count = degree.map(|n| n + 1);
        let mut coefficients = vec![T::zero(); count.iter().product()];
        // Where the coefficients of `other` go, relative to one of `self`.
        let places: Vec<_> = indices(other.count())
            .map(|index| linear(index, count))
            .collect();
        for (index, a) in std::iter::zip(indices(self.count()), &self.coefficients) {
            let start = linear(index, count);
            for (b, place) in other.coefficients.iter().zip(&places) {
                let sum = &mut coefficients[start + place];
                *sum = sum.sum(&a.product(b));
            }
        }
        Self {
            degree,
            coefficients,
        }
    }

    fn minus(&self, other: &Self) -> Self {
        assert_eq!(self.degree, other.degree);
        let coefficients = std::iter::zip(&self.coefficients, &other.coefficients)
            .map(|(a, b)| a.difference(b))
            .collect();
        Self {
            degree: self.degree,
            coefficients,
        }
    }

    fn plus(&self, other: &Self) -> Self {
        assert_eq!(self.degree, other.degree);
        let coefficients = std::iter::zip(&self.coefficients, &other.coefficients)
            .map(|(a, b)| a.sum(b))
            .collect();
        Self {
            degree: self.degree,
            coefficients,
        }
    }

    /// The determinant of a matrix of polynomials, `matrix[row][column]`, times the
    /// number that is returned as well.
    pub(crate) fn determinant(matrix: &[Vec<Self>]) -> (Self, u64) {
        let m: Vec<Vec<_>> = matrix
            .iter()
            .map(|row| row.iter().map(Self::scaled).collect())
            .collect();
        // Of rows a and b in columns 0 and 1.
        let minor = |a: usize, b: usize| {
            let (first, second) = (&m[a], &m[b]);
            first[0]
                .convolution(&second[1])
                .minus(&second[0].convolution(&first[1]))
        };
        let scaled = if D == 2 {
            minor(0, 1)
        } else {
            // Along the last column.
            let term = |row: usize| minor((row + 1) % 3, (row + 2) % 3).convolution(&m[row][2]);
            term(0).plus(&term(1)).plus(&term(2))
        };
        scaled.unscaled()
    }

    /// Where each line of coefficients along an axis begins, and the step along it.
    fn lines(&self, axis: usize) -> (impl Iterator<Item = usize>, usize) {
        let stride: usize = self.count()[..axis].iter().product();
        let length = stride * (self.degree[axis] + 1);
        let starts = (0..self.coefficients.len())
            .step_by(length)
            .flat_map(move |block| block..block + stride);
        (starts, stride)
    }

    /// The two halves along an axis, both times 2^degree, by de Casteljau's scheme.
    pub(crate) fn halves(&self, axis: usize) -> [Self; 2] {
        let n = self.degree[axis];
        let mut halves = [self.clone(), self.clone()];
        let mut line = vec![T::zero(); n + 1];
        let (starts, stride) = self.lines(axis);
        for start in starts {
            for i in 0..=n {
                line[i].clone_from(&self.coefficients[start + i * stride]);
            }
            // After `level` steps the line holds sums of 2^level coefficients.
            for level in 0..=n {
                let ends = [(0, &line[0], level), (1, &line[n - level], n - level)];
                for (half, end, place) in ends {
                    halves[half].coefficients[start + place * stride] = end.doubled(n - level);
                }
                for i in 0..n - level {
                    line[i] = line[i].sum(&line[i + 1]);
                }
            }
        }
        halves
    }

    /// The axis along which the coefficients change most.
    fn steepest_axis(&self) -> usize {
        let rounded: Vec<_> = self.coefficients.iter().map(Number::rounded).collect();
        let change = |axis: usize| -> f64 {
            let (starts, stride) = self.lines(axis);
            let changes = starts.flat_map(|start| {
                let line = (0..self.degree[axis]).map(move |i| start + i * stride);
                line.map(|i| (rounded[i + stride] - rounded[i]).abs())
            });
            changes.fold(0.0, f64::max)
        };
        let changes: [f64; D] = std::array::from_fn(change);
        (0..D)
            .max_by(|&a, &b| changes[a].total_cmp(&changes[b]))
            .unwrap_or(0)
    }

    /// What the coefficients and corners say: the signs taken for certain, and whether
    /// there may be more.
    fn look(&self) -> Signs {
        let zero = T::zero();
        let some_positive = self.coefficients.iter().any(|c| *c > zero);
        let some_negative = self.coefficients.iter().any(|c| *c < zero);
        let mut signs = Signs {
            // With coefficients of both signs, corners do not tell everything. Without,
            // the polynomial is zero only on faces all of whose coefficients are zero,
            // and these have corners.
            open: some_positive && some_negative,
            ..Signs::default()
        };
        let corner_counts = [2; D];
        for corner in indices(corner_counts) {
            let index = std::array::from_fn(|axis| corner[axis] * self.degree[axis]);
            let value = &self.coefficients[linear(index, self.count())];
            signs.positive |= *value > zero;
            signs.negative |= *value < zero;
            signs.zero |= *value == zero;
        }
        // Inside, a polynomial whose coefficients are ≥ 0 and not all zero is positive.
        signs.positive |= some_positive && !some_negative;
        signs.negative |= some_negative && !some_positive;
        signs
    }

    /// The signs taken, from at most `boxes` parts of the cube. Ends when both signs are
    /// found.
    pub(crate) fn signs(&self, mut boxes: usize) -> Signs {
        let mut found = Signs::default();
        let mut stack = vec![self.clone()];
        while let Some(part) = stack.pop() {
            let look = part.look();
            found = found.with(Signs {
                open: false,
                ..look
            });
            if found.both() {
                break;
            }
            if !look.open {
                continue;
            }
            if boxes == 0 {
                found.open = true;
                break;
            }
            boxes -= 1;
            let [a, b] = part.halves(part.steepest_axis());
            // The half where coefficients are lowest comes next.
            let lowest = |half: &Self| {
                let rounded = half.coefficients.iter().map(Number::rounded);
                rounded.fold(f64::INFINITY, f64::min)
            };
            if lowest(&a) < lowest(&b) {
                stack.extend([b, a]);
            } else {
                stack.extend([a, b]);
            }
        }
        found
    }
}
