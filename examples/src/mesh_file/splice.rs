//! A copy of a file in which some pieces are replaced.

use std::{
    fmt::{self, LowerExp},
    io::Write as _,
    ops::Range,
};

/// Copies `source`, except where it is told otherwise, from front to back.
pub(super) struct Splice<'a> {
    source: &'a [u8],
    /// Up to here the source has been copied or replaced.
    done: usize,
    out: Vec<u8>,
}

impl<'a> Splice<'a> {
    pub(super) fn new(source: &'a [u8]) -> Self {
        Self {
            source,
            done: 0,
            out: Vec::with_capacity(source.len()),
        }
    }

    /// Puts something in the place of a piece. Pieces come in order.
    pub(super) fn replace(&mut self, piece: Range<usize>, with: impl fmt::Display) {
        self.replace_bytes(piece, &[]);
        write!(self.out, "{with}").expect("memory takes everything");
    }

    /// Puts bytes in the place of a piece. Pieces come in order.
    pub(super) fn replace_bytes(&mut self, piece: Range<usize>, with: &[u8]) {
        self.out
            .extend_from_slice(&self.source[self.done..piece.start]);
        self.out.extend_from_slice(with);
        self.done = piece.end;
    }

    pub(super) fn finish(mut self) -> Vec<u8> {
        self.out.extend_from_slice(&self.source[self.done..]);
        self.out
    }
}

/// The shortest decimal number that reads back as the same value.
///
/// Rust's `{}` never uses an exponent: a number near the ends of the range would take
/// hundreds of digits. Outside `1e-5..1e16` there is one.
pub(super) struct Shortest<T>(pub(super) T);

impl<T: Copy + fmt::Display + LowerExp + Into<f64>> fmt::Display for Shortest<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let size = self.0.into().abs();
        if size == 0.0 || (1e-5..1e16).contains(&size) {
            write!(f, "{}", self.0)
        } else {
            write!(f, "{:e}", self.0)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_are_replaced_and_the_rest_is_kept() {
        let mut splice = Splice::new(b"v 1 2 3\n");
        splice.replace(2..3, Shortest(-0.5));
        splice.replace(5..5, "x");
        splice.replace_bytes(6..7, b"three");
        assert_eq!(splice.finish(), b"v -0.5 2x three\n");
    }

    #[test]
    fn numbers_are_short_and_exact() {
        let text = |x: f64| Shortest(x).to_string();
        assert_eq!(
            [0.1, -0.0, 1.0, 1e300, -5e-324].map(text),
            ["0.1", "-0", "1", "1e300", "-5e-324"]
        );
        assert_eq!(Shortest(0.1_f32).to_string(), "0.1");
    }
}
