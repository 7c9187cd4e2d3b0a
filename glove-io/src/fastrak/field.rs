//! Numbers in fields of fixed width.
//!
//! A field is seven characters: sign, digits and a point, with two decimals
//! (`Sxxx.xx`) or four (`Sx.xxxx`). Short numbers are padded on the left with
//! blanks, or with zeros on some firmware; the sign stands first or next to
//! the number.

use crate::math::round;

/// Characters of a number in text.
pub(super) const WIDTH: usize = 7;

/// The powers of ten this file needs.
fn power_of_ten(decimals: usize) -> f64 {
    (0..decimals).fold(1.0, |power, _| power * 10.0)
}

/// Writes a number padded with blanks; `None`, with the field untouched, if it
/// is not finite or needs more digits than there are.
pub(super) fn write(field: &mut [u8; WIDTH], value: f64, decimals: usize) -> Option<()> {
    let scaled = value * power_of_ten(decimals);
    // Five digits: all of the field but sign and point.
    if scaled.is_nan() || scaled.abs() >= 99_999.5 {
        return None;
    }
    let scaled = round(scaled);
    let mut rest = scaled.unsigned_abs();
    let point = WIDTH - 1 - decimals;
    *field = [b' '; WIDTH];
    let mut place = WIDTH;
    while rest > 0 || place >= point {
        place -= 1;
        if place == point {
            field[place] = b'.';
        } else {
            field[place] = b"0123456789"[(rest % 10) as usize];
            rest /= 10;
        }
    }
    if scaled < 0 {
        field[place - 1] = b'-';
    }
    Some(())
}

/// Reads a number that has its point in the right place.
#[inline]
pub(super) fn read(field: [u8; WIDTH], decimals: usize) -> Option<f64> {
    let point = WIDTH - 1 - decimals;
    if field[point] != b'.' {
        return None;
    }
    let skip_blanks = |mut place: usize| {
        while place < point && field[place].is_ascii_whitespace() {
            place += 1;
        }
        place
    };
    let mut place = skip_blanks(0);
    let negative = field[place] == b'-';
    if negative || field[place] == b'+' {
        place = skip_blanks(place + 1);
    }
    if place == point {
        return None;
    }
    let mut scaled = 0_u32;
    let mut all_digits = true;
    for (at, &character) in field.iter().enumerate().skip(place) {
        if at != point {
            let digit = character.wrapping_sub(b'0');
            all_digits &= digit < 10;
            // Six characters of at most 255: no overflow.
            scaled = 10 * scaled + u32::from(digit);
        }
    }
    // Both operands are exact, so the quotient is the nearest double.
    let value = f64::from(scaled) / power_of_ten(decimals);
    all_digits.then_some(if negative { -value } else { value })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Every value a field can hold survives, at both precisions.
        #[test]
        fn reading_inverts_writing(scaled in -99_999_i32..=99_999, decimals in prop_oneof![Just(2_usize), Just(4)]) {
            let value = f64::from(scaled) / power_of_ten(decimals);
            let mut field = [0; WIDTH];
            prop_assert!(write(&mut field, value, decimals).is_some());
            prop_assert_eq!(read(field, decimals), Some(value));
        }

        /// Any seven characters: either refused, or what the standard library reads.
        #[test]
        fn reading_agrees_with_the_standard_library(
            mut field in prop::array::uniform7(prop_oneof![
                4 => prop::sample::select(b"0123456789".to_vec()),
                2 => Just(b' '),
                1 => prop::sample::select(b"+-.\tx:/".to_vec()),
                1 => any::<u8>(),
            ]),
            padding in 0..WIDTH,
            point in prop::bool::weighted(0.9),
            decimals in prop_oneof![Just(2_usize), Just(4)],
        ) {
            field[..padding].fill(b' ');
            if point {
                field[WIDTH - 1 - decimals] = b'.';
            }
            prop_assert_eq!(read(field, decimals).map(f64::to_bits), oracle(field, decimals));
        }
    }

    /// The bits of the number in a field, by way of `str::parse`.
    fn oracle(field: [u8; WIDTH], decimals: usize) -> Option<u64> {
        let text = core::str::from_utf8(&field).ok()?.trim_ascii_start();
        let (sign, magnitude) = match text.strip_prefix(['-', '+']) {
            Some(rest) => (&text[..1], rest.trim_ascii_start()),
            None => ("", text),
        };
        let (whole, fraction) = magnitude.split_once('.')?;
        let digits = |part: &str| part.bytes().all(|byte| byte.is_ascii_digit());
        let plain = !whole.is_empty() && fraction.len() == decimals;
        if !plain || !digits(whole) || !digits(fraction) {
            return None;
        }
        let number: f64 = std::format!("{sign}{magnitude}").parse().ok()?;
        Some(number.to_bits())
    }

    #[test]
    fn layouts() {
        let mut field = [0; WIDTH];
        for (value, decimals, expected) in [
            (12.34, 2, b"  12.34"),
            (-5.6, 2, b"  -5.60"),
            (-100.2, 2, b"-100.20"),
            (-0.001, 2, b"   0.00"),
            (0.0381, 4, b" 0.0381"),
            (-1.0, 4, b"-1.0000"),
        ] {
            write(&mut field, value, decimals).unwrap();
            assert_eq!(&field, expected);
        }
        for too_large in [1000.0, -999.995, f64::NAN, f64::INFINITY] {
            assert_eq!(write(&mut field, too_large, 2), None);
        }
    }

    #[test]
    fn paddings() {
        for accepted in [b"  -5.60", b"-  5.60", b"-005.60"] {
            assert_eq!(read(*accepted, 2), Some(-5.6));
        }
        for accepted in [b"  +5.60", b"   5.60", b"+005.60", b"0005.60"] {
            assert_eq!(read(*accepted, 2), Some(5.6));
        }
        for refused in [
            b"   5.6 ", b"    .60", b"  5 .60", b"  --.60", b"5.60   ", b"    nan",
        ] {
            assert_eq!(read(*refused, 2), None);
        }
    }
}
