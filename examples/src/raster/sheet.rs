//! Contact sheets: several pictures with titles, and what their colours mean.

use super::colormap::colormap;
use super::image::{Image, to_bytes};
use super::text::{draw_text, text_size};

const PAPER: [f32; 3] = [0.985, 0.985, 0.98];
const INK: [f32; 3] = [0.13, 0.15, 0.19];
const FRAME: [f32; 3] = [0.74, 0.77, 0.80];

/// Sizes in pixels.
const MARGIN: usize = 28;
const GAP: usize = 20;
const TITLE: usize = 40;
const CAPTION: usize = 20;
const SMALL: usize = 15;
const BAR_HEIGHT: usize = 14;
const BAR_WIDTH: usize = 320;

/// One picture of a contact sheet.
#[derive(Debug, Clone)]
pub struct Panel {
    /// Written above the picture.
    pub title: String,
    /// The picture.
    pub image: Image,
}

/// The legend of [`colormap`]: what its two ends stand for.
#[derive(Debug, Clone)]
pub struct ColorBar {
    /// The quantity, with its unit.
    pub label: String,
    /// The value shown in the first colour.
    pub min: String,
    /// The value shown in the last colour.
    pub max: String,
}

/// Pictures in rows, with a title above and a legend below.
///
/// Text does not wrap: what is wider than its panel is cut off.
#[derive(Debug, Clone)]
pub struct ContactSheet {
    /// Written at the top.
    pub title: String,
    /// Panels per row; zero counts as one.
    pub columns: usize,
    /// The pictures, row by row.
    pub panels: Vec<Panel>,
    /// The legend, if colours mean something.
    pub color_bar: Option<ColorBar>,
}

impl ContactSheet {
    /// Puts everything on one picture.
    ///
    /// Every panel gets as much room as the largest one.
    #[must_use]
    pub fn compose(&self) -> Image {
        let columns = self.columns.clamp(1, self.panels.len().max(1));
        let rows = self.panels.len().div_ceil(columns);
        let largest = |size: fn(&Image) -> usize| {
            let sizes = self.panels.iter().map(|p| size(&p.image));
            sizes.max().unwrap_or(0)
        };
        let cell = [
            largest(|i| i.width) + GAP,
            largest(|i| i.height) + GAP + CAPTION + GAP / 2,
        ];
        let title_width = text_size(&self.title, TITLE)[0];
        let bar_width = self.color_bar.as_ref().map_or(0, |_| BAR_WIDTH);
        let inner = (columns * cell[0] - GAP).max(title_width).max(bar_width);
        let top = MARGIN + TITLE + GAP;
        let bottom = top + rows * cell[1];
        let legend = self
            .color_bar
            .as_ref()
            .map_or(0, |_| 2 * SMALL + BAR_HEIGHT + GAP);
        let mut sheet = Image::filled(2 * MARGIN + inner, bottom + legend + MARGIN - GAP, PAPER);

        write(&mut sheet, MARGIN, MARGIN, &self.title, TITLE);
        for (i, panel) in self.panels.iter().enumerate() {
            let x = MARGIN + i % columns * cell[0];
            let y = top + i / columns * cell[1];
            let mut caption = Image::filled(cell[0] - GAP, CAPTION, PAPER);
            write(&mut caption, 0, 0, &panel.title, CAPTION);
            sheet.paste(&caption, x, y);
            framed(&mut sheet, &panel.image, x, y + CAPTION + GAP / 2);
        }
        if let Some(bar) = &self.color_bar {
            bar.draw(&mut sheet, MARGIN, bottom);
        }
        sheet
    }
}

impl ColorBar {
    /// Draws label, colours and ends below each other at column `x`, row `y`.
    fn draw(&self, sheet: &mut Image, x: usize, y: usize) {
        write(sheet, x, y, &self.label, SMALL);
        let mut bar = Image::filled(BAR_WIDTH, BAR_HEIGHT, PAPER);
        for (i, pixel) in bar.rgb.iter_mut().enumerate() {
            let t = (i % BAR_WIDTH) as f64 / (BAR_WIDTH - 1) as f64;
            *pixel = to_bytes(colormap(t));
        }
        let y = y + SMALL + 4;
        framed(sheet, &bar, x, y);
        let y = y + BAR_HEIGHT + 4;
        write(sheet, x, y, &self.min, SMALL);
        let right = BAR_WIDTH.saturating_sub(text_size(&self.max, SMALL)[0]);
        write(sheet, x + right, y, &self.max, SMALL);
    }
}

/// Pastes `image` with a hairline around it.
fn framed(sheet: &mut Image, image: &Image, x: usize, y: usize) {
    let frame = Image::filled(image.width + 2, image.height + 2, FRAME);
    sheet.paste(&frame, x - 1, y - 1);
    sheet.paste(image, x, y);
}

fn write(image: &mut Image, x: usize, y: usize, text: &str, size: usize) {
    // A column beyond i32 is beyond every picture that fits into memory.
    let [x, y] = [x, y].map(|n| i32::try_from(n).unwrap_or(i32::MAX));
    draw_text(image, x, y, text, size, INK);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_panel_is_on_the_sheet_once() {
        let marks = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let sheet = ContactSheet {
            title: "Three".into(),
            columns: 2,
            panels: marks
                .iter()
                .map(|&c| Panel {
                    title: "a title much too long for so small a picture".into(),
                    image: Image::filled(30, 20, c),
                })
                .collect(),
            color_bar: Some(ColorBar {
                label: "depth".into(),
                min: "0".into(),
                max: "1 mm".into(),
            }),
        }
        .compose();
        for mark in marks.map(to_bytes) {
            let count = sheet.rgb.iter().filter(|&&p| p == mark).count();
            assert_eq!(count, 30 * 20);
        }
        for end in [0.0, 1.0] {
            assert!(sheet.rgb.contains(&to_bytes(colormap(end))));
        }
    }

    #[test]
    fn an_empty_sheet_has_only_its_title() {
        let sheet = ContactSheet {
            title: String::new(),
            columns: 0,
            panels: Vec::new(),
            color_bar: None,
        };
        assert!(sheet.compose().width > 0);
    }
}
