//! Which numbers the normals of an OBJ file get when some have to be split.

use std::{collections::BTreeMap, iter::once};

use super::super::geometry::VertexNormal;

/// The `vn` statements there have to be: every one of the file keeps its place, and those
/// that are needed besides follow the one that was shared.
///
/// Behind rather than at the end of the file, because some programs want a normal to be
/// defined before it is used.
pub(super) struct Numbering<'a> {
    /// For each normal: its `vn` in the file, and its vertex. Sorted.
    pairs: &'a [(u32, u32)],
    /// Which `vn` it becomes.
    number_of_pair: Vec<usize>,
    /// Which `vn` each one in the file becomes, and how many there will be.
    numbers: Vec<usize>,
    /// The different values, in order of `vn`; none for one that is not used.
    values: Vec<[f64; 3]>,
    /// Where the values of each `vn` in the file begin, and where the last ones end.
    starts: Vec<usize>,
}

impl<'a> Numbering<'a> {
    /// Lays out the values that `pairs` have now.
    pub(super) fn new(pairs: &'a [(u32, u32)], count: usize, normals: &[VertexNormal]) -> Self {
        let mut this = Self {
            pairs,
            number_of_pair: Vec::with_capacity(pairs.len()),
            numbers: once(0).collect(),
            values: Vec::with_capacity(count),
            starts: once(0).collect(),
        };
        let mut shared = BTreeMap::new();
        let mut at = 0;
        for statement in 0..count {
            let number = this.numbers[statement];
            shared.clear();
            while at < pairs.len() && pairs[at].0 as usize == statement {
                let value = normals[at].normal;
                let next = shared.len();
                let place = *shared.entry(value.map(f64::to_bits)).or_insert(next);
                if place == next {
                    this.values.push(value);
                }
                this.number_of_pair.push(number + place);
                at += 1;
            }
            this.numbers.push(number + shared.len().max(1));
            this.starts.push(this.values.len());
        }
        this
    }

    /// Whether any normal was split, so that indices change.
    pub(super) fn is_new(&self) -> bool {
        self.numbers.last() != Some(&(self.numbers.len() - 1))
    }

    /// The values of a `vn` of the file.
    pub(super) fn values(&self, statement: usize) -> &[[f64; 3]] {
        &self.values[self.starts[statement]..self.starts[statement + 1]]
    }

    /// The index that a corner must have now, written after `defined` statements of the
    /// file; relative ones stay relative.
    pub(super) fn written(&self, normal: u32, vertex: u32, relative: bool, defined: usize) -> i64 {
        let number = match self.pairs.binary_search(&(normal, vertex)) {
            Ok(pair) => self.number_of_pair[pair],
            // One without direction: there is still only one of it.
            Err(_) => self.numbers[normal as usize],
        };
        let number = i64::try_from(number).expect("fewer than bytes in memory");
        if relative {
            number.saturating_sub_unsigned(self.numbers[defined] as u64)
        } else {
            number + 1
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_split_moves_those_behind_it() {
        let [x, y] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let pairs = [(1, 0), (1, 4), (1, 5), (2, 4)];
        let normals = |values: [[f64; 3]; 4]| {
            let vertices = pairs.map(|(_, vertex)| vertex);
            [0, 1, 2, 3].map(|i| VertexNormal {
                vertex: vertices[i],
                normal: values[i],
            })
        };

        let kept = Numbering::new(&pairs, 4, &normals([x, x, x, y]));
        assert!(!kept.is_new());
        assert_eq!(kept.values(1), [x]);

        let split = Numbering::new(&pairs, 4, &normals([x, y, x, y]));
        assert!(split.is_new());
        assert!(split.values(0).is_empty());
        assert_eq!(split.values(1), [x, y]);
        assert_eq!(split.written(0, 9, false, 4), 1);
        assert_eq!(split.written(1, 5, false, 4), 2);
        assert_eq!(split.written(1, 4, false, 4), 3);
        assert_eq!(split.written(2, 4, false, 4), 4);
        assert_eq!(split.written(3, 4, false, 4), 5);
        // After three of the four: vn 2 to 4, counted from one, are -3 to -1.
        assert_eq!(split.written(1, 0, true, 3), -3);
        assert_eq!(split.written(1, 4, true, 3), -2);
        assert_eq!(split.written(2, 4, true, 3), -1);
    }
}
