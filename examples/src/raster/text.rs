//! Labels in a bitmap font.

use super::image::{Image, to_bytes};
use embedded_graphics::mono_font::{MonoFont, MonoTextStyle, iso_8859_1};
use embedded_graphics::pixelcolor::Rgb888;
use embedded_graphics::prelude::*;
use embedded_graphics::text::{Baseline, Text};
use std::convert::Infallible;

/// The fonts there are, from large to small.
const FONTS: [&MonoFont<'static>; 5] = [
    &iso_8859_1::FONT_10X20,
    &iso_8859_1::FONT_9X15,
    &iso_8859_1::FONT_7X13,
    &iso_8859_1::FONT_6X10,
    &iso_8859_1::FONT_5X8,
];

/// Writes `text` with its upper left corner at column `x` and row `y`.
///
/// `size` is the height of a line in pixels. Glyphs are bitmaps: the largest
/// font that is not higher is taken, and from 40 on its pixels are enlarged by a
/// whole number. Letters of Latin-1 can be shown; what lies outside the picture
/// is cut off.
pub fn draw_text(image: &mut Image, x: i32, y: i32, text: &str, size: usize, colour: [f32; 3]) {
    let (font, scale) = choose_font(size);
    let [r, g, b] = to_bytes(colour);
    let style = MonoTextStyle::new(font, Rgb888::new(r, g, b));
    let mut target = Target { image, x, y, scale };
    match Text::with_baseline(text, Point::zero(), style, Baseline::Top).draw(&mut target) {
        Ok(_) => {}
        Err(never) => match never {},
    }
}

/// Width and height that [`draw_text`] needs for one line of text, in pixels.
#[must_use]
pub fn text_size(text: &str, size: usize) -> [usize; 2] {
    let (font, scale) = choose_font(size);
    let glyph = font.character_size;
    [
        text.chars().count() * glyph.width as usize,
        glyph.height as usize,
    ]
    .map(|n| n * scale)
}

/// A font, and how many pixels wide its dots are.
fn choose_font(size: usize) -> (&'static MonoFont<'static>, usize) {
    let height = |font: &MonoFont<'_>| font.character_size.height as usize;
    let font = FONTS
        .into_iter()
        .find(|font| height(font) <= size)
        .unwrap_or(FONTS[FONTS.len() - 1]);
    (font, (size / height(font)).max(1))
}

/// An image seen as the dots of enlarged text.
struct Target<'a> {
    image: &'a mut Image,
    x: i32,
    y: i32,
    scale: usize,
}

impl DrawTarget for Target<'_> {
    type Color = Rgb888;
    type Error = Infallible;

    fn draw_iter<I>(&mut self, pixels: I) -> Result<(), Infallible>
    where
        I: IntoIterator<Item = Pixel<Rgb888>>,
    {
        let place = |start: i32, dot: i32, step: usize| -> Option<usize> {
            let offset = i64::from(dot) * self.scale as i64 + step as i64;
            usize::try_from(i64::from(start) + offset).ok()
        };
        for Pixel(dot, colour) in pixels {
            for step in 0..self.scale * self.scale {
                let x = place(self.x, dot.x, step % self.scale);
                let y = place(self.y, dot.y, step / self.scale);
                if let (Some(x), Some(y)) = (x, y)
                    && x < self.image.width
                    && y < self.image.height
                {
                    let i = x + self.image.width * y;
                    self.image.rgb[i] = [colour.r(), colour.g(), colour.b()];
                }
            }
        }
        Ok(())
    }
}

impl Dimensions for Target<'_> {
    /// Everywhere: what is not in the image is skipped dot by dot.
    fn bounding_box(&self) -> embedded_graphics::primitives::Rectangle {
        let corner = Point::new(i32::MIN / 2, i32::MIN / 2);
        embedded_graphics::primitives::Rectangle::new(corner, Size::new(u32::MAX, u32::MAX))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn inked(image: &Image) -> usize {
        image.rgb.iter().filter(|&&p| p != [255; 3]).count()
    }

    #[test]
    fn text_stays_in_the_size_announced() {
        for size in [3, 8, 13, 20, 39, 40, 61] {
            let [width, height] = text_size("Ég²", size);
            let mut tight = Image::filled(width, height, [1.0; 3]);
            draw_text(&mut tight, 0, 0, "Ég²", size, [0.0; 3]);
            let mut roomy = Image::filled(width + 40, height + 40, [1.0; 3]);
            draw_text(&mut roomy, 20, 20, "Ég²", size, [0.0; 3]);
            assert!(inked(&tight) > 0);
            assert_eq!(inked(&tight), inked(&roomy), "size {size}");
        }
    }

    #[test]
    fn text_outside_is_cut_off() {
        let mut image = Image::filled(9, 9, [1.0; 3]);
        draw_text(&mut image, -1000, 2, "far left", 20, [0.0; 3]);
        draw_text(&mut image, 2, i32::MAX, "far below", 20, [0.0; 3]);
        assert_eq!(inked(&image), 0);
        draw_text(&mut image, -5, -5, "MMM", 20, [0.0; 3]);
        assert!(inked(&image) > 0);
    }
}
