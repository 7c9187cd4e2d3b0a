//! The panels side by side, with titles and a legend.

use super::{
    determinant::{colour, folded_colour},
    panels::Panels,
};
use crate::{
    ink::{Ink, rgb},
    raster::{Image, draw_text, text_size, to_bytes},
};

const PAPER: [f32; 3] = rgb(0xFB_FB_F9);
const INK: [f32; 3] = rgb(0x21_26_31);
const GREY: [f32; 3] = rgb(0x5C_63_70);
const FRAME: [f32; 3] = rgb(0xBD_C4_CC);

/// Sizes in pixels.
const MARGIN: usize = 36;
const GAP: usize = 30;
const TITLE: usize = 20;
const SMALL: usize = 15;
const BAR_HEIGHT: usize = 16;
/// Least room for a panel with its text below.
const COLUMN: usize = 420;

impl Panels {
    /// One picture of all panels.
    #[must_use]
    pub fn sheet(&self) -> Image {
        let [width, height] = [self.before.width, self.before.height];
        let column = width.max(COLUMN);
        let top = MARGIN + TITLE + 14;
        let below = top + height + 16;
        let legend = BAR_HEIGHT + 8 + SMALL + 10 + SMALL + 7 + SMALL;
        let mut sheet = Image::filled(
            2 * MARGIN + 3 * column + 2 * GAP,
            below + legend + MARGIN,
            PAPER,
        );
        let columns = [0, 1, 2].map(|i| MARGIN + i * (column + GAP));
        let panels = [
            ("What is dragged", &self.before),
            ("The warped picture", &self.after),
            ("How much area grows", &self.determinant),
        ];
        for (x, (title, panel)) in columns.into_iter().zip(panels) {
            write(&mut sheet, x, MARGIN, title, TITLE, INK);
            let frame = Image::filled(width + 2, height + 2, FRAME);
            sheet.paste(&frame, x - 1, top - 1);
            sheet.paste(panel, x, top);
        }
        let texts = [
            [
                "Arrows: from where to where a point goes",
                "Rings: points held in place",
            ],
            [
                "Lines: cells of the cubic lattice, moved",
                "Dots: where the points have arrived",
            ],
        ];
        for (x, lines) in columns.into_iter().zip(texts) {
            for (line, text) in lines.into_iter().enumerate() {
                write(&mut sheet, x, below + line * (SMALL + 7), text, SMALL, GREY);
            }
        }
        self.legend(&mut sheet, columns[2], below, width);
        sheet
    }

    /// The colours of the determinant and its range.
    fn legend(&self, sheet: &mut Image, x: usize, y: usize, width: usize) {
        let width = width.max(COLUMN);
        let doublings = self.field.doublings();
        let range = self.range();
        let frame = Image::filled(width + 2, BAR_HEIGHT + 2, FRAME);
        sheet.paste(&frame, x - 1, y - 1);
        let mut bar = Image::filled(width, BAR_HEIGHT, PAPER);
        for (i, pixel) in bar.rgb.iter_mut().enumerate() {
            let t = 2.0 * (i % width) as f64 / (width - 1) as f64 - 1.0;
            *pixel = to_bytes(colour((t * doublings).exp2(), doublings));
        }
        sheet.paste(&bar, x, y);

        // The range as a bracket over the bar.
        let place = |det: f64| {
            let t = (det.max(0.0).log2() / doublings).clamp(-1.0, 1.0);
            x as f64 + 1.0 + (t + 1.0) / 2.0 * (width - 3) as f64
        };
        let mut ink = Ink::for_image(sheet);
        let (high, low) = (y as f64 + 2.0, (y + BAR_HEIGHT) as f64 - 2.0);
        let [from, to] = [range.min, range.max].map(place);
        let middle = f64::midpoint(high, low);
        ink.line([[from, high], [from, low]], 2.0)
            .line([[to, high], [to, low]], 2.0)
            .line([[from, middle], [to, middle]], 1.2);
        ink.paint(sheet, INK, 0.9);

        let ticks_y = y + BAR_HEIGHT + 7;
        #[expect(clippy::cast_possible_truncation, reason = "from 1 to 4")]
        let most = doublings as i32;
        for power in -most..=most {
            let factor = 1_u32 << power.unsigned_abs();
            let text = if power < 0 {
                format!("1/{factor}")
            } else {
                factor.to_string()
            };
            let [text_width, _] = text_size(&text, SMALL);
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "a column of the picture"
            )]
            let middle = place(f64::from(power).exp2()) as usize;
            let left = middle.saturating_sub(text_width / 2);
            let left = left.clamp(x, x + width - text_width);
            write(sheet, left, ticks_y, &text, SMALL, GREY);
        }

        let y = ticks_y + SMALL + 10;
        let text = format!("det J from {} to {}", short(range.min), short(range.max));
        write(sheet, x, y, &text, SMALL, INK);
        let word = self.verdict.outcome.name();
        let left = x + width - text_size(word, SMALL)[0];
        write(sheet, left, y, word, SMALL, INK);
        if range.folded > 0.0 {
            let mut swatch = Image::filled(22, SMALL - 1, PAPER);
            for (i, pixel) in swatch.rgb.iter_mut().enumerate() {
                *pixel = to_bytes(folded_colour(i % 22, i / 22));
            }
            sheet.paste(&swatch, left - 22 - 9, y);
        }

        let y = y + SMALL + 7;
        let [least, most] = self.verdict.min_det;
        let text = format!(
            "least in [{}, {}]",
            bound(least, f64::floor),
            bound(most, f64::ceil)
        );
        write(sheet, x, y, &text, SMALL, GREY);
        let text = match (self.verdict.theorem(), self.verdict.irregular_cells.len()) {
            (Some(theorem), _) => theorem.name().to_owned(),
            (None, 0) => String::new(),
            (None, 1) => "1 cell folds".to_owned(),
            (None, count) => format!("{count} cells fold"),
        };
        let left = x + width - text_size(&text, SMALL)[0];
        write(sheet, left, y, &text, SMALL, GREY);
    }
}

/// A bound with four digits that count, rounded away from what it bounds.
fn bound(x: f64, round: impl Fn(f64) -> f64) -> String {
    let digits: i32 = match x.abs() {
        size if !(1e-3..1e4).contains(&size) => return short(x),
        size if size >= 100.0 => 1,
        size if size >= 10.0 => 2,
        size if size >= 1.0 => 3,
        _ => 4,
    };
    let unit = 10_f64.powi(digits);
    format!(
        "{:.*}",
        digits.unsigned_abs() as usize,
        round(x * unit) / unit
    )
}

/// A number with three digits that count.
fn short(x: f64) -> String {
    match x.abs() {
        size if size >= 1e4 || (size > 0.0 && size < 1e-3) => format!("{x:.2e}"),
        size if size >= 100.0 => format!("{x:.0}"),
        size if size >= 10.0 => format!("{x:.1}"),
        size if size >= 0.1 => format!("{x:.2}"),
        _ => format!("{x:.4}"),
    }
}

fn write(image: &mut Image, x: usize, y: usize, text: &str, size: usize, colour: [f32; 3]) {
    // A column beyond i32 is beyond every picture that fits into memory.
    let [x, y] = [x, y].map(|n| i32::try_from(n).unwrap_or(i32::MAX));
    draw_text(image, x, y, text, size, colour);
}
