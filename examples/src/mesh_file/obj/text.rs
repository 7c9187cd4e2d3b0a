//! The text of an OBJ file: lines, words, and the corners of faces.

use std::{ops::Range, str};

use super::super::error::{Problem, number, quote};

/// A statement, which may go over several lines of the file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Statement {
    /// Number of its first line, counted from one.
    pub(super) line: usize,
    /// Its bytes, with the end of the line.
    pub(super) bytes: Range<usize>,
}

/// The statements of a file. Lines end with LF, CRLF or CR; a backslash before the end
/// joins a line with the next one.
pub(super) fn statements(source: &[u8]) -> impl Iterator<Item = Statement> {
    // Some programs mark UTF-8 with three bytes in front.
    let mut at = if source.starts_with(b"\xEF\xBB\xBF") {
        3
    } else {
        0
    };
    let mut line = 1;
    std::iter::from_fn(move || {
        let (start, first_line) = (at, line);
        while at < source.len() {
            let byte = source[at];
            at += 1;
            if byte != b'\n' && byte != b'\r' {
                continue;
            }
            let joined = at >= 2 && source[at - 2] == b'\\';
            if byte == b'\r' && source.get(at) == Some(&b'\n') {
                at += 1;
            }
            line += 1;
            if !joined {
                break;
            }
        }
        (start < at).then_some(Statement {
            line: first_line,
            bytes: start..at,
        })
    })
}

/// The words of a statement, as places in the file; a comment ends them.
#[derive(Debug, Clone)]
pub(super) struct Words<'a> {
    source: &'a [u8],
    rest: Range<usize>,
}

impl<'a> Words<'a> {
    pub(super) fn of(source: &'a [u8], statement: &Statement) -> Self {
        Self {
            source,
            rest: statement.bytes.clone(),
        }
    }

    /// Whether a word ends at this place: by white space, or by a backslash that joins
    /// two lines.
    fn is_space(&self, at: usize) -> bool {
        let byte = self.source[at];
        byte.is_ascii_whitespace()
            || byte == b'\x0B'
            || (byte == b'\\'
                && at + 1 < self.rest.end
                && matches!(self.source[at + 1], b'\r' | b'\n'))
    }

    /// Reads three numbers.
    pub(super) fn vector(&mut self) -> Result<[(Range<usize>, f64); 3], Problem> {
        let mut vector = [const { (0..0, 0.0) }; 3];
        for (found, out) in vector.iter_mut().enumerate() {
            let word = self
                .next()
                .ok_or(Problem::TooFewValues { expected: 3, found })?;
            *out = (word.clone(), number(&self.source[word])?);
        }
        Ok(vector)
    }
}

impl Iterator for Words<'_> {
    type Item = Range<usize>;

    fn next(&mut self) -> Option<Range<usize>> {
        while self.rest.start < self.rest.end && self.is_space(self.rest.start) {
            self.rest.start += 1;
        }
        let start = self.rest.start;
        while self.rest.start < self.rest.end
            && self.source[self.rest.start] != b'#'
            && !self.is_space(self.rest.start)
        {
            self.rest.start += 1;
        }
        (start < self.rest.start).then_some(start..self.rest.start)
    }
}

/// A corner of a face as it is written: `v`, `v/vt`, `v//vn` or `v/vt/vn`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Corner {
    pub(super) vertex: i64,
    /// The normal, and where its index stands.
    pub(super) normal: Option<(i64, Range<usize>)>,
}

impl Corner {
    pub(super) fn parse(source: &[u8], word: Range<usize>) -> Result<Self, Problem> {
        let text = &source[word.clone()];
        let wrong = || Problem::NotAnIndex { text: quote(text) };
        let mut parts = [None, None, None];
        let mut start = word.start;
        for (number, part) in text.split(|&byte| byte == b'/').enumerate() {
            let place = start..start + part.len();
            start = place.end + 1;
            let out = parts.get_mut(number).ok_or_else(wrong)?;
            if !part.is_empty() {
                let index = str::from_utf8(part).ok().and_then(|text| text.parse().ok());
                *out = Some((index.ok_or_else(wrong)?, place));
            }
        }
        let [vertex, _texture, normal] = parts;
        Ok(Self {
            vertex: vertex.ok_or_else(wrong)?.0,
            normal,
        })
    }
}

/// The index, counted from zero, that a written one means after so many definitions.
pub(super) fn resolve(written: i64, defined: usize) -> i64 {
    if written < 0 {
        // A file has fewer bytes than an i64 can count.
        written.saturating_add_unsigned(defined as u64)
    } else {
        // Zero means nothing, and becomes an index that nothing has.
        written - 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(source: &str) -> Vec<(usize, Vec<&str>)> {
        statements(source.as_bytes())
            .map(|s| {
                let words = Words::of(source.as_bytes(), &s);
                (s.line, words.map(|word| &source[word]).collect())
            })
            .collect()
    }

    #[test]
    fn every_way_to_end_a_line() {
        assert_eq!(
            words("v 1\r\nf\t2\r#x\n\n  o é#x"),
            [
                (1, vec!["v", "1"]),
                (2, vec!["f", "2"]),
                (3, vec![]),
                (4, vec![]),
                (5, vec!["o", "é"])
            ]
        );
        assert_eq!(
            words("\u{FEFF}v 1 \\\r\n 2\\\n3\nf \\x\\"),
            [(1, vec!["v", "1", "2", "3"]), (4, vec!["f", "\\x\\"])]
        );
        assert_eq!(words(""), []);
    }

    #[test]
    fn corners_of_every_form() {
        let corner = |text: &str| Corner::parse(text.as_bytes(), 0..text.len());
        let with = |vertex, normal| Ok(Corner { vertex, normal });
        assert_eq!(corner("7"), with(7, None));
        assert_eq!(corner("7/2"), with(7, None));
        assert_eq!(corner("7//"), with(7, None));
        assert_eq!(corner("7//-3"), with(7, Some((-3, 3..5))));
        assert_eq!(corner("-7/2/3"), with(-7, Some((3, 5..6))));
        for bad in ["/1/1", "1/2/3/4", "1/x", "1.0", "x"] {
            assert_eq!(corner(bad), Err(Problem::NotAnIndex { text: bad.into() }));
        }
    }
}
