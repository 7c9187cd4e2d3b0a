//! Numbers as colours.

/// Sixteen evenly spaced entries of *viridis* (S. van der Walt, N. Smith, 2015,
/// published under CC0), in sRGB.
const VIRIDIS: [[u8; 3]; 16] = [
    [0x44, 0x01, 0x54],
    [0x48, 0x1a, 0x6c],
    [0x47, 0x2f, 0x7d],
    [0x41, 0x44, 0x87],
    [0x39, 0x56, 0x8c],
    [0x31, 0x68, 0x8e],
    [0x2a, 0x78, 0x8e],
    [0x23, 0x88, 0x8e],
    [0x1f, 0x98, 0x8b],
    [0x22, 0xa8, 0x84],
    [0x35, 0xb7, 0x79],
    [0x54, 0xc5, 0x68],
    [0x7a, 0xd1, 0x51],
    [0xa5, 0xdb, 0x36],
    [0xd2, 0xe2, 0x1b],
    [0xfd, 0xe7, 0x25],
];

/// The sRGB colour of `t` in `[0, 1]`, from bright yellow to dark violet: little is
/// light, much is dark.
///
/// Equal steps of `t` look equally large, and lightness falls throughout, so
/// the map reads in grey and to colour-blind eyes. Between the entries of a
/// table it is linear. Numbers outside are shown like the nearer end, NaN as
/// grey.
#[must_use]
pub fn colormap(t: f64) -> [f32; 3] {
    if t.is_nan() {
        return [0.6; 3];
    }
    let last = VIRIDIS.len() - 1;
    let position = (1.0 - t.clamp(0.0, 1.0)) * last as f64;
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "position is in [0, last]"
    )]
    let i = (position as usize).min(last - 1);
    #[expect(clippy::cast_possible_truncation, reason = "a fraction in [0, 1]")]
    let fraction = (position - i as f64) as f32;
    std::array::from_fn(|channel| {
        let [low, high] = [VIRIDIS[i], VIRIDIS[i + 1]].map(|c| f32::from(c[channel]) / 255.0);
        low + fraction * (high - low)
    })
}

#[cfg(test)]
mod tests {
    use super::super::image::{to_bytes, to_linear};
    use super::*;

    #[test]
    fn ends_are_those_of_the_table() {
        for (t, bytes) in [(0.0, VIRIDIS[15]), (1.0, VIRIDIS[0]), (-3.0, VIRIDIS[15])] {
            assert_eq!(to_bytes(colormap(t)), bytes);
        }
        assert_eq!(to_bytes(colormap(f64::INFINITY)), VIRIDIS[0]);
        assert_eq!(to_bytes(colormap(f64::NAN)), [153; 3]);
    }

    #[test]
    fn luminance_falls_throughout() {
        let luminance = |t| to_linear(colormap(t)).dot([0.2126, 0.7152, 0.0722].into());
        for i in 0..200 {
            let t = f64::from(i) / 200.0;
            assert!(luminance(t) > luminance(t + 0.005), "at {t}");
        }
    }
}
