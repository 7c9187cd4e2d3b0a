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
pub(super) fn read(field: [u8; WIDTH], decimals: usize) -> Option<f64> {
    let (whole, fraction) = field.split_at(WIDTH - 1 - decimals);
    let fraction = fraction.strip_prefix(b".")?;
    let whole = whole.trim_ascii_start();
    let (negative, whole) = match whole {
        [b'-', rest @ ..] => (true, rest.trim_ascii_start()),
        [b'+', rest @ ..] => (false, rest.trim_ascii_start()),
        _ => (false, whole),
    };
    if whole.is_empty() {
        return None;
    }
    let mut scaled = 0_u32;
    for &digit in whole.iter().chain(fraction) {
        if !digit.is_ascii_digit() {
            return None;
        }
        scaled = 10 * scaled + u32::from(digit - b'0');
    }
    // Both operands are exact, so the quotient is the nearest double.
    let value = f64::from(scaled) / power_of_ten(decimals);
    Some(if negative { -value } else { value })
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
