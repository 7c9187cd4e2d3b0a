//! How cells are cut into boxes, as text.
//!
//! For each cell of the domain, first axis fastest, there is a binary tree in preorder: `.`
//! is a box that is not cut, and `x`, `y` or `z` one that is cut in the middle of that axis,
//! followed by its lower and its upper half. A number in front of a `.` repeats it:
//! `3.x..2.` is about six cells, of which the fourth is cut once. Boxes tile each cell
//! by construction.

/// Halvings of a cell along one axis, at most.
pub(super) const DEEPEST: usize = 60;

/// Why cuts do not fit a lattice.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum CutsError {
    /// A character means nothing there.
    #[error("character {position} of the cuts is unexpected")]
    Character {
        /// Counted from 0.
        position: usize,
    },
    /// The text ends within the tree of a cell.
    #[error("the cuts end within a tree")]
    End,
    /// There are too few or too many trees.
    #[error("there are cuts for {found} cells, and the domain has {expected}")]
    Count {
        /// Cells of the domain.
        expected: usize,
        /// Trees found; if there are too many, not all were counted.
        found: usize,
    },
    /// A cell is halved too often along one axis.
    #[error("the tree that ends at character {position} of the cuts is deeper than {DEEPEST}")]
    Depth {
        /// Counted from 0.
        position: usize,
    },
}

/// One step of a tree.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Step {
    Leaf,
    /// Cut along an axis.
    Cut(u8),
}

/// The tree of a cell.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Tree {
    pub(super) steps: Vec<Step>,
    /// Halvings along each axis, at most.
    pub(super) depth: [usize; 3],
}

impl Tree {
    pub(super) fn leaf() -> Self {
        Self {
            steps: vec![Step::Leaf],
            depth: [0; 3],
        }
    }
}

/// Reads the trees of all cells one by one; gives the first cell that each belongs to and
/// the number of cells.
pub(super) fn read<E: From<CutsError>>(
    text: &str,
    dimension: usize,
    cells: usize,
    mut each: impl FnMut(std::ops::Range<usize>, &Tree) -> Result<(), E>,
) -> Result<(), E> {
    let bytes = text.as_bytes();
    let mut at = 0;
    let mut cell = 0;
    while at < bytes.len() {
        let mut count = 1;
        let digits = bytes[at..]
            .iter()
            .take_while(|b| b.is_ascii_digit())
            .count();
        if digits > 0 {
            let number = text[at..at + digits].parse().ok();
            count = number
                .filter(|&count: &usize| count > 0)
                .ok_or(CutsError::Character { position: at })?;
            at += digits;
            // Only what is cheap can be repeated, so that work is bounded by length.
            if bytes.get(at).is_some_and(|&b| b != b'.') {
                return Err(CutsError::Character { position: at }.into());
            }
        }
        let tree = read_tree(bytes, &mut at, dimension)?;
        if count > cells - cell {
            let found = cell.saturating_add(count);
            return Err(CutsError::Count {
                expected: cells,
                found,
            }
            .into());
        }
        each(cell..cell + count, &tree)?;
        cell += count;
    }
    if cell < cells {
        return Err(CutsError::Count {
            expected: cells,
            found: cell,
        }
        .into());
    }
    Ok(())
}

fn read_tree(bytes: &[u8], at: &mut usize, dimension: usize) -> Result<Tree, CutsError> {
    let mut tree = Tree {
        steps: Vec::new(),
        depth: [0; 3],
    };
    // The levels of boxes that are still to come.
    let mut open = vec![[0; 3]];
    while let Some(mut level) = open.pop() {
        let byte = *bytes.get(*at).ok_or(CutsError::End)?;
        let position = *at;
        *at += 1;
        if byte == b'.' {
            tree.steps.push(Step::Leaf);
            continue;
        }
        let number = byte.wrapping_sub(b'x');
        let axis = usize::from(number);
        if axis >= dimension {
            return Err(CutsError::Character { position });
        }
        level[axis] += 1;
        if level[axis] > DEEPEST {
            return Err(CutsError::Depth { position });
        }
        tree.depth[axis] = tree.depth[axis].max(level[axis]);
        tree.steps.push(Step::Cut(number));
        open.extend([level, level]);
    }
    Ok(tree)
}

/// Writes trees one by one.
#[derive(Debug, Default)]
pub(crate) struct Writer {
    text: String,
    /// Cells in a row that are not cut.
    leaves: usize,
}

impl Writer {
    /// A cell that is not cut.
    pub(crate) fn leaf(&mut self) {
        self.leaves += 1;
    }

    /// A cell by its tree.
    pub(crate) fn tree(&mut self, tree: &str) {
        if tree == "." {
            self.leaf();
        } else {
            self.flush();
            self.text.push_str(tree);
        }
    }

    fn flush(&mut self) {
        match std::mem::take(&mut self.leaves) {
            0 => {}
            1 => self.text.push('.'),
            count => self.text.push_str(&format!("{count}.")),
        }
    }

    pub(crate) fn finish(mut self) -> String {
        self.flush();
        self.text
    }
}

/// The character of a cut.
pub(crate) fn character(axis: usize) -> char {
    ['x', 'y', 'z'][axis]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(text: &str, dimension: usize, cells: usize) -> Result<Vec<(usize, usize)>, CutsError> {
        let mut found = Vec::new();
        read(text, dimension, cells, |cells, tree| {
            found.push((cells.len(), tree.steps.len()));
            Ok(())
        })
        .map(|()| found)
    }

    #[test]
    fn trees_are_read_and_written() {
        let text = "3.x..2.xyz....";
        assert_eq!(all(text, 3, 7).unwrap(), [(3, 1), (1, 3), (2, 1), (1, 7)]);
        let mut writer = Writer::default();
        for tree in [".", ".", ".", "x..", ".", ".", "xyz...."] {
            writer.tree(tree);
        }
        assert_eq!(writer.finish(), text);
    }

    #[test]
    fn what_is_no_tree_is_refused() {
        let character = |position| Err(CutsError::Character { position });
        assert_eq!(all("z..", 2, 1), character(0));
        assert_eq!(all("2x...", 2, 2), character(1));
        assert_eq!(all("0.", 2, 1), character(0));
        assert_eq!(all("99999999999999999999999.", 2, 1), character(0));
        assert_eq!(all(".é", 2, 2), character(1));
        for text in ["x.", "x", "3"] {
            assert_eq!(all(text, 2, 3), Err(CutsError::End), "{text}");
        }
        let count = |found| Err(CutsError::Count { expected: 3, found });
        assert_eq!(all("", 2, 3), count(0));
        assert_eq!(all("..", 2, 3), count(2));
        assert_eq!(all("..2.", 2, 3), count(4));
        let deep = "x".repeat(61);
        assert_eq!(all(&deep, 2, 1), Err(CutsError::Depth { position: 60 }));
    }
}
