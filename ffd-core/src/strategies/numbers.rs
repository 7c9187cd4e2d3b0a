//! Values made of integers, and how they shrink.
//!
//! Each value is made, by a function, of a list of integers of fixed length, each within a
//! range of its own. Zero stands for what is simplest: the fewest cells, the unit frame, no
//! displacement. The function returns nothing if the numbers do not have the property that
//! a strategy promises; such numbers are drawn again, or passed over in shrinking. So a
//! shrunk value has the property of the first one, whatever was taken away.

use proptest::strategy::{NewTree, Strategy, ValueTree};
use proptest::test_runner::TestRunner;
use std::fmt;
use std::ops::RangeInclusive;
use std::sync::Arc;

/// How often numbers are drawn again before a strategy gives up.
const ATTEMPTS: usize = 200;

/// Which integers there are.
#[derive(Debug, Clone, Default)]
pub(super) struct Layout {
    ranges: Vec<RangeInclusive<i32>>,
    /// The last numbers, if they are vectors at the points of a grid.
    field: Option<Field>,
}

/// Vectors of numbers at the points of a grid, the first axis running fastest.
#[derive(Debug, Clone)]
struct Field {
    first: usize,
    points_per_axis: Vec<usize>,
}

impl Layout {
    /// Appends a number, whose range contains zero.
    pub(super) fn push(&mut self, range: RangeInclusive<i32>) {
        debug_assert!(range.contains(&0) && self.field.is_none());
        self.ranges.push(range);
    }

    /// Appends a vector of D numbers from −`most` to `most` for each point of a grid. Must
    /// come last.
    pub(super) fn push_field<const D: usize>(&mut self, points_per_axis: [usize; D], most: i32) {
        let first = self.ranges.len();
        let count = D * points_per_axis.iter().product::<usize>();
        self.ranges.extend(std::iter::repeat_n(-most..=most, count));
        self.field = Some(Field {
            first,
            points_per_axis: points_per_axis.to_vec(),
        });
    }

    /// All simplifications that are tried, the largest first.
    fn steps(&self) -> Vec<Step> {
        let count = self.ranges.len();
        let first = self.field.as_ref().map_or(count, |field| field.first);
        let mut steps: Vec<Step> = (0..first).map(|i| Step::Zero(i, i + 1)).collect();
        if let Some(field) = &self.field {
            let d = field.points_per_axis.len();
            let points = (count - first) / d;
            let mut size = points;
            while size > 0 {
                steps.extend((0..points).step_by(size).map(|begin| {
                    let end = (begin + size).min(points);
                    Step::Zero(first + d * begin, first + d * end)
                }));
                size /= 2;
            }
            steps.extend((0..d).map(Step::Shift));
            steps.extend((first..count).map(|i| Step::Zero(i, i + 1)));
        }
        steps.extend((0..count).map(Step::Halve));
        steps.extend((0..first).map(Step::TowardZero));
        steps.extend((first..count).map(Step::Round));
        steps
    }
}

/// One way to make a list of numbers simpler.
#[derive(Debug, Clone, Copy)]
enum Step {
    /// The numbers from the first index to before the second become zero.
    Zero(usize, usize),
    /// The field moves by a point toward the beginning of an axis.
    Shift(usize),
    /// A number becomes half as large.
    Halve(usize),
    /// A number comes one nearer to zero.
    TowardZero(usize),
    /// The last binary digit of a number that is one becomes zero.
    Round(usize),
}

impl Step {
    /// The simpler numbers; `None` if they would be the same.
    fn apply(self, numbers: &[i32], layout: &Layout) -> Option<Vec<i32>> {
        let replaced = |i: usize, simpler: i32| {
            (simpler != numbers[i]).then(|| {
                let mut numbers = numbers.to_vec();
                numbers[i] = simpler;
                numbers
            })
        };
        match self {
            Self::Zero(begin, end) => {
                if numbers[begin..end].iter().all(|&n| n == 0) {
                    return None;
                }
                let mut numbers = numbers.to_vec();
                numbers[begin..end].fill(0);
                Some(numbers)
            }
            Self::Shift(axis) => layout.field.as_ref()?.shifted(numbers, axis),
            Self::Halve(i) => replaced(i, numbers[i] / 2),
            Self::TowardZero(i) => replaced(i, numbers[i] - numbers[i].signum()),
            Self::Round(i) => {
                let size = numbers[i].abs();
                // The only digit is left alone.
                let rounded = size & size.wrapping_sub(1);
                if rounded == 0 {
                    return None;
                }
                replaced(i, rounded * numbers[i].signum())
            }
        }
    }
}

impl Field {
    /// Moved by one point toward the beginning of an axis; `None` if something is there
    /// already, or nothing anywhere.
    fn shifted(&self, numbers: &[i32], axis: usize) -> Option<Vec<i32>> {
        let d = self.points_per_axis.len();
        let stride: usize = self.points_per_axis[..axis].iter().product();
        let points = self.points_per_axis[axis];
        let (head, field) = numbers.split_at(self.first);
        if field.iter().all(|&n| n == 0) {
            return None;
        }
        let mut moved = vec![0; field.len()];
        for (point, vector) in field.chunks(d).enumerate() {
            if vector.iter().all(|&n| n == 0) {
                continue;
            }
            if (point / stride).is_multiple_of(points) {
                return None;
            }
            moved[d * (point - stride)..][..d].copy_from_slice(vector);
        }
        Some([head, &moved].concat())
    }
}

/// Takes numbers from a list, one after the other.
#[derive(Debug)]
pub(super) struct Reader<'a> {
    numbers: &'a [i32],
}

impl<'a> Reader<'a> {
    /// The next number.
    pub(super) fn next(&mut self) -> i32 {
        let (&first, rest) = self
            .numbers
            .split_first()
            .expect("as many as in the layout");
        self.numbers = rest;
        first
    }

    /// The next number, from a range without negative ones.
    pub(super) fn next_index(&mut self) -> usize {
        usize::try_from(self.next()).expect("no negative numbers in its range")
    }

    /// All that are left: those of the field.
    pub(super) fn rest(self) -> &'a [i32] {
        self.numbers
    }
}

/// The function that makes a value of numbers.
type Make<T> = dyn Fn(Reader) -> Option<T> + Send + Sync;

/// The strategy: values made of numbers.
pub(super) struct Made<T> {
    /// Which numbers, or why there are none.
    layout: Result<Arc<Layout>, String>,
    make: Arc<Make<T>>,
    /// What is made, for messages.
    what: &'static str,
}

impl<T> Made<T> {
    pub(super) fn new(
        what: &'static str,
        layout: Result<Layout, String>,
        make: impl Fn(Reader) -> Option<T> + Send + Sync + 'static,
    ) -> Self {
        Self {
            layout: layout.map(Arc::new),
            make: Arc::new(make),
            what,
        }
    }
}

impl<T> Clone for Made<T> {
    fn clone(&self) -> Self {
        Self {
            layout: self.layout.clone(),
            make: Arc::clone(&self.make),
            what: self.what,
        }
    }
}

impl<T> fmt::Debug for Made<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Made")
            .field("what", &self.what)
            .finish_non_exhaustive()
    }
}

impl<T: Clone + fmt::Debug> Strategy for Made<T> {
    type Tree = Tree<T>;
    type Value = T;

    fn new_tree(&self, runner: &mut TestRunner) -> NewTree<Self> {
        let layout = self.layout.clone()?;
        for _ in 0..ATTEMPTS {
            let mut numbers = Vec::with_capacity(layout.ranges.len());
            for range in &layout.ranges {
                numbers.push(range.new_tree(runner)?.current());
            }
            if let Some(value) = (self.make)(Reader { numbers: &numbers }) {
                return Ok(Tree {
                    layout,
                    make: Arc::clone(&self.make),
                    best: (numbers, value),
                    trial: None,
                    steps: None,
                    next: 0,
                    has_progressed: false,
                });
            }
            runner.reject_local(self.what)?;
        }
        Err(format!("these options allow no {}, or hardly any", self.what).into())
    }
}

/// Numbers that are made simpler step by step.
pub(super) struct Tree<T> {
    layout: Arc<Layout>,
    make: Arc<Make<T>>,
    /// The simplest for which simplifying was asked for, and what is made of them.
    best: (Vec<i32>, T),
    /// Simpler ones, of which it is not yet known whether they will do.
    trial: Option<(Vec<i32>, T)>,
    /// All simplifications; `None` until they are needed.
    steps: Option<Vec<Step>>,
    /// The one to try next.
    next: usize,
    /// Whether one was good in this round.
    has_progressed: bool,
}

impl<T> fmt::Debug for Tree<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Tree")
            .field("numbers", &self.best.0)
            .finish_non_exhaustive()
    }
}

impl<T: Clone + fmt::Debug> ValueTree for Tree<T> {
    type Value = T;

    fn current(&self) -> T {
        self.trial.as_ref().unwrap_or(&self.best).1.clone()
    }

    fn simplify(&mut self) -> bool {
        let steps = self.steps.get_or_insert_with(|| self.layout.steps());
        if let Some(trial) = self.trial.take() {
            // It was good, and the same step may be good again.
            self.best = trial;
            self.has_progressed = true;
            self.next -= 1;
        }
        loop {
            while let Some(step) = steps.get(self.next) {
                self.next += 1;
                let made = step.apply(&self.best.0, &self.layout).and_then(|numbers| {
                    let value = (self.make)(Reader { numbers: &numbers })?;
                    Some((numbers, value))
                });
                if made.is_some() {
                    self.trial = made;
                    return true;
                }
            }
            self.next = 0;
            if !std::mem::take(&mut self.has_progressed) {
                return false;
            }
        }
    }

    fn complicate(&mut self) -> bool {
        self.trial.take().is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layout() -> Layout {
        let mut layout = Layout::default();
        layout.push(0..=9);
        layout.push_field([3, 2], 100);
        layout
    }

    /// The simplest numbers with a property that some have.
    fn shrunk(has: impl Fn(&[i32]) -> bool + Send + Sync + Copy + 'static) -> Vec<i32> {
        let strategy = Made::new("numbers", Ok(layout()), |reader| {
            Some(reader.rest().to_vec())
        });
        let mut runner = TestRunner::deterministic();
        let mut tree = strategy.new_tree(&mut runner).unwrap();
        while !has(&tree.current()) {
            tree = strategy.new_tree(&mut runner).unwrap();
        }
        let mut simpler = tree.simplify();
        while simpler {
            simpler = if has(&tree.current()) {
                tree.simplify()
            } else {
                assert!(tree.complicate() && has(&tree.current()));
                tree.simplify()
            };
        }
        assert!(!tree.complicate() && has(&tree.current()));
        tree.current()
    }

    #[test]
    fn what_does_not_matter_becomes_zero() {
        assert_eq!(shrunk(|_| true), [0; 13]);
        assert_eq!(shrunk(|n| n[0] >= 4)[0], 4);
    }

    /// A vector at any of the points will do: it ends at the first, and is round.
    #[test]
    fn the_field_moves_to_the_beginning() {
        let small = shrunk(|n| n[1..].iter().any(|&n| n > 40));
        let mut left = small.iter().filter(|&&n| n != 0);
        assert!(
            matches!((left.next(), left.next()), (Some(48 | 64), None)),
            "{small:?}"
        );
        assert!(small[1..3].iter().any(|&n| n != 0));
    }

    #[test]
    fn numbers_that_make_nothing_are_passed_over() {
        let odd = Made::new("odd numbers", Ok(layout()), |mut reader| {
            Some(reader.next()).filter(|n| n % 2 == 1)
        });
        let mut runner = TestRunner::deterministic();
        for _ in 0..20 {
            let mut tree = odd.new_tree(&mut runner).unwrap();
            assert_eq!(tree.current() % 2, 1);
            while tree.simplify() {
                assert_eq!(tree.current() % 2, 1);
            }
        }
        let none = Made::new("such value", Ok(layout()), |_| None::<i32>);
        let reason = none.new_tree(&mut runner).unwrap_err();
        assert_eq!(
            reason.message(),
            "these options allow no such value, or hardly any"
        );
    }
}
