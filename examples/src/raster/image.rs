//! Pictures of 8-bit sRGB pixels, and PNG output.

use glam::DVec3;
use std::io::Write;
use std::sync::LazyLock;

/// A picture with rows from top to bottom and pixels from left to right.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Image {
    /// Pixels per row.
    pub width: usize,
    /// Number of rows.
    pub height: usize,
    /// `width × height` sRGB triples; pixel (x, y) is number `x + width y`.
    pub rgb: Vec<[u8; 3]>,
}

impl Image {
    /// A picture of one sRGB colour.
    #[must_use]
    pub fn filled(width: usize, height: usize, colour: [f32; 3]) -> Self {
        Self {
            width,
            height,
            rgb: vec![to_bytes(colour); width * height],
        }
    }

    /// Writes the picture as an 8-bit RGB file marked as sRGB.
    ///
    /// # Errors
    ///
    /// What the writer reports, and [`png::EncodingError`] for a picture
    /// without pixels or with more than `u32::MAX` in a direction.
    pub fn write_png(&self, writer: impl Write) -> Result<(), png::EncodingError> {
        let too_large = |_| std::io::Error::other("the picture is too large for a PNG file");
        let width = u32::try_from(self.width).map_err(too_large)?;
        let height = u32::try_from(self.height).map_err(too_large)?;
        let mut encoder = png::Encoder::new(writer, width, height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::RelativeColorimetric);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(self.rgb.as_flattened())?;
        writer.finish()
    }

    /// Reads a PNG file of any kind. Sixteen bits are cut to eight, transparent parts lie
    /// on white; colour profiles are not looked at.
    ///
    /// # Errors
    ///
    /// What the reader reports; [`png::DecodingError::LimitsExceeded`] for pictures that
    /// take more than 256 MB.
    pub fn read_png(bytes: &[u8]) -> Result<Self, png::DecodingError> {
        let mut decoder = png::Decoder::new(std::io::Cursor::new(bytes));
        decoder.set_transformations(png::Transformations::EXPAND | png::Transformations::STRIP_16);
        let mut reader = decoder.read_info()?;
        let size = reader.output_buffer_size().filter(|&size| size <= 1 << 28);
        let mut samples = vec![0; size.ok_or(png::DecodingError::LimitsExceeded)?];
        let info = reader.next_frame(&mut samples)?;
        let samples = &samples[..info.buffer_size()];
        let channels = info.color_type.samples();
        let rgb = samples.chunks_exact(channels).map(|pixel| {
            let (colour, alpha) = match *pixel {
                [grey] => ([grey; 3], u8::MAX),
                [grey, alpha] => ([grey; 3], alpha),
                [r, g, b] => ([r, g, b], u8::MAX),
                [r, g, b, alpha, ..] => ([r, g, b], alpha),
                [] => ([0; 3], 0),
            };
            let alpha = f32::from(alpha) / 255.0;
            to_bytes(colour.map(|c| alpha * f32::from(c) / 255.0 + (1.0 - alpha)))
        });
        Ok(Self {
            width: info.width as usize,
            height: info.height as usize,
            rgb: rgb.collect(),
        })
    }

    /// Copies `other` to column `x` and row `y`; what sticks out is left away.
    pub fn paste(&mut self, other: &Image, x: usize, y: usize) {
        let columns = other.width.min(self.width.saturating_sub(x));
        let rows = other.height.min(self.height.saturating_sub(y));
        for row in 0..rows {
            let to = x + self.width * (y + row);
            let from = other.width * row;
            self.rgb[to..to + columns].copy_from_slice(&other.rgb[from..from + columns]);
        }
    }
}

/// An sRGB colour in whole steps of 1/255.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the float-to-integer conversion saturates at 0 and 255, as wanted"
)]
pub(crate) fn to_bytes(colour: [f32; 3]) -> [u8; 3] {
    colour.map(|c| (255.0 * c + 0.5) as u8)
}

/// The light that an sRGB colour stands for (IEC 61966-2-1).
pub(crate) fn to_linear(colour: [f32; 3]) -> DVec3 {
    DVec3::from(colour.map(|c| {
        let c = f64::from(c).clamp(0.0, 1.0);
        if c <= 0.040_45 {
            c / 12.92
        } else {
            ((c + 0.055) / 1.055).powf(2.4)
        }
    }))
}

/// Last entry of [`SRGB`]; its steps are below one 8-bit level even in the dark.
const SRGB_LAST: f64 = 8191.0;

/// The sRGB byte of each of 8192 amounts of light, for one power per entry
/// instead of three per pixel.
static SRGB: LazyLock<Vec<u8>> = LazyLock::new(|| {
    (0..=8191_u16)
        .map(|i| {
            let light = f64::from(i) / SRGB_LAST;
            let c = if light <= 0.003_130_8 {
                12.92 * light
            } else {
                1.055 * light.powf(1.0 / 2.4) - 0.055
            };
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "c is in [0, 1]"
            )]
            let byte = (255.0 * c + 0.5) as u8;
            byte
        })
        .collect()
});

/// The pixel that shows `light`; amounts above 1 are cut off.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped to the table"
)]
pub(crate) fn from_linear(light: DVec3) -> [u8; 3] {
    light
        .to_array()
        .map(|c| SRGB[(c * SRGB_LAST + 0.5).clamp(0.0, SRGB_LAST) as usize])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_survives_the_way_through_linear_light() {
        for byte in 0..=255_u8 {
            let c = f32::from(byte) / 255.0;
            assert_eq!(from_linear(to_linear([c; 3])), [byte; 3]);
        }
    }

    #[test]
    fn png_decodes_to_the_same_pixels() {
        let mut image = Image::filled(5, 3, [0.0; 3]);
        for (pixel, i) in image.rgb.iter_mut().zip(0_u8..) {
            *pixel = [i, 17 * i, 255 - i];
        }
        let mut bytes = Vec::new();
        image.write_png(&mut bytes).unwrap();

        let mut reader = png::Decoder::new(std::io::Cursor::new(&bytes))
            .read_info()
            .unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut pixels).unwrap();
        assert_eq!((info.width, info.height), (5, 3));
        assert_eq!(pixels, image.rgb.as_flattened());

        assert_eq!(Image::read_png(&bytes).unwrap(), image);
        for length in 0..bytes.len() - 12 {
            assert!(Image::read_png(&bytes[..length]).is_err(), "{length} bytes");
        }
    }

    #[test]
    fn transparent_grey_lies_on_white() {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, 3, 1);
        encoder.set_color(png::ColorType::GrayscaleAlpha);
        let mut writer = encoder.write_header().unwrap();
        writer.write_image_data(&[0, 255, 0, 0, 55, 51]).unwrap();
        writer.finish().unwrap();
        // 0.2 of 55 and 0.8 of 255 are 215.
        let image = Image::read_png(&bytes).unwrap();
        assert_eq!(image.rgb, [[0; 3], [255; 3], [215; 3]]);
    }

    #[test]
    fn an_image_without_pixels_is_an_error() {
        let image = Image::filled(0, 3, [0.0; 3]);
        assert!(image.write_png(Vec::new()).is_err());
    }
}
