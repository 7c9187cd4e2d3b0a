//! Polynomials over a box in Bernstein form, with integers as coefficients.

use super::wide::Integer;

/// Coefficients along up to three axes, first axis fastest.
#[derive(Debug, Clone)]
pub(super) struct Form<T> {
    pub(super) counts: [usize; 3],
    pub(super) values: Vec<T>,
}

pub(super) fn binomial(n: usize, k: usize) -> u64 {
    (0..k).fold(1, |b, i| b * (n - i) as u64 / (i + 1) as u64)
}

/// The least common multiple of the binomial coefficients of n.
pub(super) fn multiple(n: usize) -> u64 {
    let gcd = |mut a: u64, mut b: u64| {
        while b > 0 {
            (a, b) = (b, a % b);
        }
        a
    };
    (0..=n)
        .map(|k| binomial(n, k))
        .fold(1, |m, b| m / gcd(m, b) * b)
}

fn indices(number: usize, counts: [usize; 3]) -> [usize; 3] {
    let rest = number / counts[0];
    [number % counts[0], rest % counts[1], rest / counts[1]]
}

impl<T: Integer> Form<T> {
    fn zero(counts: [usize; 3]) -> Self {
        Self {
            counts,
            values: vec![T::zero(); counts.iter().product()],
        }
    }

    /// Where each line of coefficients along an axis begins, and the step along it.
    fn lines(&self, axis: usize) -> (impl Iterator<Item = usize> + use<T>, usize) {
        let stride: usize = self.counts[..axis].iter().product();
        let length = stride * self.counts[axis];
        let slabs = (0..self.values.len()).step_by(length);
        (slabs.flat_map(move |slab| slab..slab + stride), stride)
    }

    /// Replaces the values along an axis by sums: `weights[i][m]` is the weight of value m in
    /// sum i.
    pub(super) fn mixed(&self, axis: usize, weights: &[Vec<u64>]) -> Self {
        let mut mixed = Self::zero(self.counts);
        let (lines, stride) = self.lines(axis);
        for start in lines {
            for (i, row) in weights.iter().enumerate() {
                let sum = &mut mixed.values[start + i * stride];
                for (m, &weight) in row.iter().enumerate() {
                    sum.add_scaled(&self.values[start + m * stride], weight);
                }
            }
        }
        mixed
    }

    /// The derivative along an axis, plus a constant.
    pub(super) fn slope(&self, axis: usize, constant: &T) -> Self {
        let n = self.counts[axis] - 1;
        let mut counts = self.counts;
        counts[axis] = n;
        let stride: usize = self.counts[..axis].iter().product();
        let values = (0..counts.iter().product())
            .map(|number| {
                let [i, j, k] = indices(number, counts);
                let at = i + self.counts[0] * (j + self.counts[1] * k);
                let mut difference = self.values[at].clone();
                difference.negate();
                difference.add(&self.values[at + stride]);
                let mut value = constant.clone();
                value.add_scaled(&difference, n as u64);
                value
            })
            .collect();
        Self { counts, values }
    }

    /// Multiplies each coefficient by a factor, the product of one for each axis.
    pub(super) fn factors(&mut self, factor: impl Fn(usize, usize) -> u64) {
        let rows: [Vec<u64>; 3] =
            std::array::from_fn(|a| (0..self.counts[a]).map(|i| factor(a, i)).collect());
        for (number, value) in self.values.iter_mut().enumerate() {
            let [i, j, k] = indices(number, self.counts);
            let mut product = T::zero();
            // Binomial coefficients of 14 at most, and their least common multiple.
            product.add_scaled(value, rows[0][i] * rows[1][j]);
            *value = T::zero();
            value.add_scaled(&product, rows[2][k]);
        }
    }

    /// Times the binomial coefficients: products of polynomials are then convolutions.
    pub(super) fn scaled(mut self) -> Self {
        let counts = self.counts;
        self.factors(|axis, i| binomial(counts[axis] - 1, i));
        self
    }

    /// Back from the scaled form, times the least common multiple of the binomials along each
    /// axis.
    pub(super) fn unscale(&mut self) {
        let counts = self.counts;
        let multiples = counts.map(|count| multiple(count - 1));
        self.factors(|axis, i| multiples[axis] / binomial(counts[axis] - 1, i));
    }

    /// A product of two polynomials in scaled form.
    pub(super) fn product(&self, other: &Self) -> Self {
        let counts = std::array::from_fn(|a| self.counts[a] + other.counts[a] - 1);
        let mut product = Self::zero(counts);
        product.add_product(self, other);
        product
    }

    /// Adds a product of two polynomials, all in scaled form. Faster if the first is that of
    /// shorter numbers.
    pub(super) fn add_product(&mut self, a: &Self, b: &Self) {
        let row = b.counts[0];
        for (number, x) in a.values.iter().enumerate() {
            let [i1, j1, k1] = indices(number, a.counts);
            for (number, values) in b.values.chunks_exact(row).enumerate() {
                let (j2, k2) = (number % b.counts[1], number / b.counts[1]);
                let at = i1 + self.counts[0] * ((j1 + j2) + self.counts[1] * (k1 + k2));
                T::add_multiples(&mut self.values[at..at + row], x, values);
            }
        }
    }

    pub(super) fn add(&mut self, other: &Self) {
        for (a, b) in self.values.iter_mut().zip(&other.values) {
            a.add(b);
        }
    }

    pub(super) fn negate(&mut self) {
        self.values.iter_mut().for_each(T::negate);
    }

    /// One degree more along an axis; all values times the new degree.
    pub(super) fn raised(&self, axis: usize) -> Self {
        let n = self.counts[axis];
        let mut counts = self.counts;
        counts[axis] = n + 1;
        let mut raised = Self::zero(counts);
        let (lines, stride) = self.lines(axis);
        for (line, start) in lines.enumerate() {
            let target = line / stride * (stride * (n + 1)) + line % stride;
            for i in 0..=n {
                let value = &mut raised.values[target + i * stride];
                if i > 0 {
                    value.add_scaled(&self.values[start + (i - 1) * stride], i as u64);
                }
                if i < n {
                    value.add_scaled(&self.values[start + i * stride], (n - i) as u64);
                }
            }
        }
        raised
    }

    /// The lower and the upper half of the box along an axis (de Casteljau), all values
    /// times 2ⁿ.
    pub(super) fn split(&self, axis: usize) -> [Self; 2] {
        let n = self.counts[axis] - 1;
        let mut halves = [Self::zero(self.counts), Self::zero(self.counts)];
        let (lines, stride) = self.lines(axis);
        let mut line = vec![T::zero(); n + 1];
        for start in lines {
            for (i, value) in line.iter_mut().enumerate() {
                value.clone_from(&self.values[start + i * stride]);
            }
            // After so many steps the line holds sums of 2^step coefficients.
            for step in 0..=n {
                let [low, high] = &mut halves;
                for (half, place, value) in
                    [(low, step, &line[0]), (high, n - step, &line[n - step])]
                {
                    let target = &mut half.values[start + place * stride];
                    target.clone_from(value);
                    target.shift(n - step);
                }
                for i in 0..n - step {
                    let (this, next) = line.split_at_mut(i + 1);
                    this[i].add(&next[0]);
                }
            }
        }
        halves
    }
}
