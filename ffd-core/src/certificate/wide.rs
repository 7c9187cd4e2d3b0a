//! Integers to compute with: of any size, and of fixed sizes modulo a power of two.
//!
//! Sums and products modulo 2⁶⁴ᴺ are those of the integers as long as the *last* result is
//! known to lie between −2⁶⁴ᴺ⁻¹ and 2⁶⁴ᴺ⁻¹: what overflows on the way does not matter. So a
//! bound of the result, computed beforehand, makes them exact, without memory for each number.

use dashu_int::{IBig, Sign};

/// What polynomials have as coefficients: integers, exactly.
pub(super) trait Integer: Clone {
    fn zero() -> Self;
    fn from_big(value: &IBig) -> Self;
    fn to_big(&self) -> IBig;
    /// Adds a number.
    fn add(&mut self, other: &Self);
    /// Adds a number times a small one.
    fn add_scaled(&mut self, other: &Self, factor: u64);
    /// Adds a product.
    fn add_product(&mut self, a: &Self, b: &Self) {
        Self::add_multiples(std::slice::from_mut(self), a, std::slice::from_ref(b));
    }
    /// Adds products with one factor to numbers, as many as there are other factors. Faster
    /// if that factor is short.
    fn add_multiples(sums: &mut [Self], factor: &Self, others: &[Self]);
    fn negate(&mut self);
    /// Multiplies by a power of two.
    fn shift(&mut self, bits: usize);
    fn is_negative(&self) -> bool;
    fn is_zero(&self) -> bool;
}

impl Integer for IBig {
    fn zero() -> Self {
        Self::ZERO
    }

    fn from_big(value: &IBig) -> Self {
        value.clone()
    }

    fn to_big(&self) -> IBig {
        self.clone()
    }

    fn add(&mut self, other: &Self) {
        *self += other;
    }

    fn add_scaled(&mut self, other: &Self, factor: u64) {
        *self += other * Self::from(factor);
    }

    fn add_multiples(sums: &mut [Self], factor: &Self, others: &[Self]) {
        for (sum, other) in sums.iter_mut().zip(others) {
            *sum += factor * other;
        }
    }

    fn negate(&mut self) {
        *self = -std::mem::take(self);
    }

    fn shift(&mut self, bits: usize) {
        *self <<= bits;
    }

    fn is_negative(&self) -> bool {
        self.sign() == Sign::Negative
    }

    fn is_zero(&self) -> bool {
        Self::is_zero(self)
    }
}

/// An integer modulo 2⁶⁴ᴺ, as the one between −2⁶⁴ᴺ⁻¹ and 2⁶⁴ᴺ⁻¹: two's complement, lowest
/// digits first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Wide<const N: usize>([u64; N]);

#[expect(
    clippy::cast_possible_truncation,
    reason = "the lower and the upper half of a product"
)]
#[inline(always)]
fn halves(x: u128) -> (u64, u64) {
    (x as u64, (x >> 64) as u64)
}

impl<const N: usize> Wide<N> {
    #[inline(always)]
    fn invert(&mut self) {
        for digit in &mut self.0 {
            *digit = !*digit;
        }
    }
}

impl<const N: usize> Integer for Wide<N> {
    fn zero() -> Self {
        Self([0; N])
    }

    fn from_big(value: &IBig) -> Self {
        let mut digits = [0; N];
        let (sign, magnitude) = value.clone().into_parts();
        let bytes = magnitude.to_le_bytes();
        for (digit, bytes) in digits.iter_mut().zip(bytes.chunks(8)) {
            let mut whole = [0; 8];
            whole[..bytes.len()].copy_from_slice(bytes);
            *digit = u64::from_le_bytes(whole);
        }
        let mut number = Self(digits);
        if sign == Sign::Negative {
            number.negate();
        }
        number
    }

    fn to_big(&self) -> IBig {
        let bytes: Vec<u8> = self
            .0
            .iter()
            .flat_map(|digit| digit.to_le_bytes())
            .collect();
        IBig::from_le_bytes(&bytes)
    }

    #[inline(always)]
    fn add(&mut self, other: &Self) {
        let mut carry = false;
        for (a, b) in self.0.iter_mut().zip(other.0) {
            let (sum, first) = a.overflowing_add(b);
            let (sum, second) = sum.overflowing_add(u64::from(carry));
            *a = sum;
            carry = first | second;
        }
    }

    #[inline(always)]
    fn add_scaled(&mut self, other: &Self, factor: u64) {
        let mut carry = 0;
        for (a, b) in self.0.iter_mut().zip(other.0) {
            let sum = u128::from(b) * u128::from(factor) + u128::from(*a) + u128::from(carry);
            (*a, carry) = halves(sum);
        }
    }

    /// With the magnitude of the factor, of which leading zeros need not be multiplied.
    #[inline(always)]
    fn add_multiples(sums: &mut [Self], factor: &Self, others: &[Self]) {
        let is_negative = factor.is_negative();
        let mut magnitude = *factor;
        if is_negative {
            magnitude.negate();
        }
        let used = N - magnitude.0.iter().rev().take_while(|&&d| d == 0).count();
        for (sum, other) in sums.iter_mut().zip(others) {
            // −1 − x is what has all digits inverted; so s − p is −1 − ((−1 − s) + p).
            if is_negative {
                sum.invert();
            }
            for (i, &digit) in magnitude.0[..used].iter().enumerate() {
                let mut carry = 0;
                for j in 0..N - i {
                    let product = u128::from(digit) * u128::from(other.0[j]);
                    let total = product + u128::from(sum.0[i + j]) + u128::from(carry);
                    (sum.0[i + j], carry) = halves(total);
                }
            }
            if is_negative {
                sum.invert();
            }
        }
    }

    #[inline(always)]
    fn negate(&mut self) {
        let mut carry = true;
        for a in &mut self.0 {
            let (sum, over) = (!*a).overflowing_add(u64::from(carry));
            *a = sum;
            carry = over;
        }
    }

    fn shift(&mut self, bits: usize) {
        let (digits, bits) = (bits / 64, bits % 64);
        for i in (0..N).rev() {
            let digit = |i: Option<usize>| i.map_or(0, |i| self.0[i]);
            let upper = digit(i.checked_sub(digits)) << bits;
            let lower = digit(i.checked_sub(digits + 1));
            self.0[i] = if bits == 0 {
                upper
            } else {
                upper | lower >> (64 - bits)
            };
        }
    }

    fn is_negative(&self) -> bool {
        self.0[N - 1] >> 63 == 1
    }

    fn is_zero(&self) -> bool {
        self.0 == [0; N]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Something done to a number, with two others, a factor and a number of bits.
    type Operation = fn(&mut Wide<4>, &[Wide<4>; 2], u64, usize);

    fn big() -> impl Strategy<Value = IBig> {
        let number = |(bytes, shift): (Vec<u8>, usize)| {
            let value = IBig::from_le_bytes(&bytes);
            value >> shift
        };
        (proptest::collection::vec(any::<u8>(), 1..40), 0_usize..200).prop_map(number)
    }

    /// Modulo 2²⁵⁶, by the definition.
    fn reduced(value: IBig) -> IBig {
        let modulus = IBig::ONE << 256;
        let half = IBig::ONE << 255;
        let rest = ((value + &half) % &modulus + &modulus) % &modulus;
        rest - half
    }

    fn same(wide: Wide<4>, value: IBig) -> Result<(), TestCaseError> {
        let value = reduced(value);
        prop_assert_eq!(&wide.to_big(), &value);
        prop_assert_eq!(wide, Wide::from_big(&value));
        prop_assert_eq!(wide.is_negative(), Integer::is_negative(&value));
        prop_assert_eq!(wide.is_zero(), value.is_zero());
        Ok(())
    }

    proptest! {
        /// Every operation is that of the integers, modulo 2²⁵⁶.
        #[test]
        fn wide_numbers_are_integers(
            a in big(), b in big(), c in big(), factor in any::<u64>(), bits in 0_usize..300,
        ) {
            let wide = |value: &IBig| Wide::<4>::from_big(value);
            same(wide(&a), a.clone())?;
            let all: [Operation; 5] = [
                |x, [b, _], _, _| x.add(b),
                |x, [b, _], factor, _| x.add_scaled(b, factor),
                |x, [b, c], _, _| x.add_product(b, c),
                |x, _, _, _| x.negate(),
                |x, _, _, bits| x.shift(bits),
            ];
            let expected = [
                &a + &b,
                &a + &b * IBig::from(factor),
                &a + &b * &c,
                -&a,
                &a << bits,
            ];
            for (operation, expected) in all.iter().zip(expected) {
                let mut x = wide(&a);
                operation(&mut x, &[wide(&b), wide(&c)], factor, bits);
                same(x, expected)?;
            }
        }
    }
}
