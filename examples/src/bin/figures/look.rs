//! Colours of the figures, and panels put together with their captions.

use examples::{
    ink::rgb,
    raster::{Image, draw_text, text_size},
};

pub(crate) const PAPER: [f32; 3] = rgb(0xFB_FB_F9);
pub(crate) const INK: [f32; 3] = rgb(0x21_26_31);
pub(crate) const GREY: [f32; 3] = rgb(0x5C_63_70);
const FRAME: [f32; 3] = rgb(0xBD_C4_CC);
/// The object, as in the paper.
pub(crate) const BLUE: [f32; 3] = rgb(0x2F_6F_C4);
/// Lattices and constraints, as in the paper.
pub(crate) const RED: [f32; 3] = rgb(0xC8_2A_2A);
/// Where an object crosses itself.
pub(crate) const AMBER: [f32; 3] = rgb(0xF2_A9_1E);
/// Control points, and lines between them.
pub(crate) const SLATE: [f32; 3] = rgb(0x8A_93_A0);

/// Sizes in pixels.
const MARGIN: usize = 32;
const GAP: usize = 28;
const TITLE: usize = 20;
const SMALL: usize = 15;
const LINE: usize = SMALL + 6;

/// A picture with a heading above and lines of text below.
#[derive(Debug, Clone)]
pub(crate) struct Panel {
    pub(crate) heading: String,
    pub(crate) image: Image,
    pub(crate) lines: Vec<String>,
}

/// Panels in rows under a title. Columns are as wide as the widest panel or text needs.
pub(crate) fn sheet(title: &str, columns: usize, panels: &[Panel]) -> Image {
    let texts = |panel: &Panel| {
        let heading = text_size(&panel.heading, TITLE)[0];
        let lines = panel.lines.iter().map(|line| text_size(line, SMALL)[0]);
        lines.fold(heading, usize::max)
    };
    let widths = panels.iter().map(|p| texts(p).max(p.image.width));
    let column = widths.max().unwrap_or(0);
    let width = (columns * (column + GAP) - GAP).max(text_size(title, TITLE)[0]);
    let row_height = |row: &[Panel]| {
        let image = row.iter().map(|p| p.image.height).max().unwrap_or(0);
        let lines = row.iter().map(|p| p.lines.len()).max().unwrap_or(0);
        TITLE + 12 + image + 12 + lines * LINE
    };
    let rows: Vec<_> = panels.chunks(columns).collect();
    let height: usize = rows.iter().map(|row| row_height(row) + GAP).sum();
    let top = MARGIN + TITLE + GAP;
    let mut sheet = Image::filled(2 * MARGIN + width, top + height - GAP + MARGIN, PAPER);
    write(&mut sheet, [MARGIN, MARGIN], title, TITLE, INK);
    let mut y = top;
    for row in rows {
        for (number, panel) in row.iter().enumerate() {
            let x = MARGIN + number * (column + GAP);
            write(&mut sheet, [x, y], &panel.heading, TITLE, INK);
            let at = y + TITLE + 12;
            let frame = Image::filled(panel.image.width + 2, panel.image.height + 2, FRAME);
            sheet.paste(&frame, x - 1, at - 1);
            sheet.paste(&panel.image, x, at);
            let below = at + panel.image.height + 12;
            for (number, line) in panel.lines.iter().enumerate() {
                write(&mut sheet, [x, below + number * LINE], line, SMALL, GREY);
            }
        }
        y += row_height(row) + GAP;
    }
    sheet
}

fn write(image: &mut Image, at: [usize; 2], text: &str, size: usize, colour: [f32; 3]) {
    // A column beyond i32 is beyond every picture that fits into memory.
    let [x, y] = at.map(|n| i32::try_from(n).unwrap_or(i32::MAX));
    draw_text(image, x, y, text, size, colour);
}

/// Between two colours.
pub(crate) fn mix(from: [f32; 3], to: [f32; 3], part: f64) -> [f32; 3] {
    #[expect(clippy::cast_possible_truncation, reason = "between 0 and 1")]
    let part = part.clamp(0.0, 1.0) as f32;
    [0, 1, 2].map(|c| from[c] + part * (to[c] - from[c]))
}

/// A number with three digits that count.
pub(crate) fn short(x: f64) -> String {
    match x.abs() {
        size if size >= 1e4 || (size > 0.0 && size < 1e-3) => format!("{x:.1e}"),
        size if size >= 100.0 => format!("{x:.0}"),
        size if size >= 10.0 => format!("{x:.1}"),
        size if size >= 0.1 => format!("{x:.2}"),
        _ => format!("{x:.4}"),
    }
}
