//! What is to hold everywhere in a cell, and whether it does, box by box.
//!
//! A polynomial is a mean of its Bernstein coefficients, and a matrix of polynomials of the
//! same degrees one of the matrices of their coefficients. So what is true of all
//! coefficients, and of the means of what it is true of, is true everywhere in the box.

use dashu_int::ops::{BitTest, Gcd};
use dashu_int::{IBig, Sign};

use super::cell::{self, Exact, Numbers};
use super::cuts::{DEEPEST, Step, Tree, character};
use super::form::{Form, binomial, multiple};
use super::wide::{Integer, Wide};
use crate::injectivity::tiling::Doubt;

/// A matrix of integers, `m[row][column]`.
pub(super) type Whole<const D: usize> = [[IBig; D]; D];

/// What is to hold at every point of the domain. Matrices `after` are times a positive
/// number, and for the derivatives by lattice coordinates in world vectors: see [`after`].
#[derive(Debug, Clone, Copy)]
pub(super) enum Condition<'a, const D: usize> {
    /// `det J > 0`, and not below a bound that is not negative.
    Above(f64),
    /// `det J < 0`.
    Negative,
    /// `det J ≥ 0`, or, reversed, `det J ≤ 0`.
    NotBeyondZero { reversed: bool },
    /// An entry on the diagonal of `C J` is positive.
    Entry { after: &'a Whole<D>, row: usize },
    /// The principal minor of two rows of `C J` is positive.
    Minor {
        after: &'a Whole<D>,
        rows: [usize; 2],
    },
    /// The symmetric part of `C J` is positive definite.
    Definite { after: &'a Whole<D> },
    /// In each row of `C J` the entry on the diagonal is larger than the sum of the absolute
    /// values of the others.
    Dominant { after: &'a Whole<D> },
    /// Column a of `J` makes an angle with the vector `axes[a]` whose sine times the length of
    /// that vector is at most `sines[a]`, and points to the same side.
    Cones {
        after: &'a Whole<D>,
        axes: &'a Whole<D>,
        sines: &'a [IBig; D],
    },
}

/// `C A⁻¹` for the axes of the frame as the columns of A, times a positive number: applied to
/// the derivatives in the world it is `C J`, with J in lattice coordinates.
pub(super) fn after<const D: usize>(exact: &Exact<'_, D>, matrix: &[[f64; D]; D]) -> Whole<D> {
    let frame = columns_of_frame(exact);
    let mut inverse = cell::adjugate(&frame);
    if cell::determinant(&frame).sign() == Sign::Negative {
        for entry in inverse.as_flattened_mut() {
            *entry = -&*entry;
        }
    }
    let (entries, _) = cell::integers(matrix.as_flattened());
    let mut product: Whole<D> = std::array::from_fn(|r| {
        std::array::from_fn(|c| {
            let terms = (0..D).map(|k| &entries[r * D + k] * &inverse[k][c]);
            terms.fold(IBig::ZERO, |sum, term| sum + term)
        })
    });
    // Shorter numbers are faster.
    let entries = product.as_flattened().iter().filter(|x| !x.is_zero());
    let sizes = entries.map(|x| x.clone().into_parts().1);
    if let Some(common) = sizes.reduce(|a, b| a.gcd(b)) {
        let common = IBig::from(common);
        for entry in product.as_flattened_mut() {
            *entry = &*entry / &common;
        }
    }
    product
}

/// A, times a power of two.
fn columns_of_frame<const D: usize>(exact: &Exact<'_, D>) -> Whole<D> {
    let axes = exact.lattice.grid().frame().axes();
    let (integers, _) = cell::integers(axes.as_flattened());
    std::array::from_fn(|r| std::array::from_fn(|a| integers[a * D + r].clone()))
}

/// Whether the axes of the frame are left-handed.
pub(super) fn is_mirrored<const D: usize>(exact: &Exact<'_, D>) -> bool {
    cell::determinant(&columns_of_frame(exact)).sign() == Sign::Negative
}

impl<const D: usize> Condition<'_, D> {
    /// Whether it holds in all boxes of a cell.
    pub(super) fn holds(&self, exact: &Exact<'_, D>, cell: [usize; D], tree: &Tree) -> bool {
        let numbers = exact.numbers(cell);
        let cell = Cell {
            exact,
            numbers: &numbers,
            cell,
        };
        if !self.is_scalar() {
            return self.walk::<IBig>(cell, tree);
        }
        // One more for the sign.
        match (self.bits(cell, tree) + 1).div_ceil(64) {
            0..=3 => self.walk::<Wide<3>>(cell, tree),
            4 => self.walk::<Wide<4>>(cell, tree),
            5 => self.walk::<Wide<5>>(cell, tree),
            6 => self.walk::<Wide<6>>(cell, tree),
            7..=8 => self.walk::<Wide<8>>(cell, tree),
            9..=16 => self.walk::<Wide<16>>(cell, tree),
            _ => self.walk::<IBig>(cell, tree),
        }
    }

    /// A tree for a cell in whose boxes it holds; `None` if there is none, or none of at most
    /// as many cuts as are left.
    pub(super) fn find(
        &self,
        exact: &Exact<'_, D>,
        cell: [usize; D],
        left: &mut usize,
    ) -> Option<String> {
        if self.holds(exact, cell, &Tree::leaf()) {
            return Some(".".to_owned());
        }
        let whole = Doubt {
            cell,
            low: [0.0; D],
            level: [0; D],
        };
        self.find_in_part(exact, &whole, left)
    }

    /// The same for a part of a cell.
    pub(super) fn find_in_part(
        &self,
        exact: &Exact<'_, D>,
        part: &Doubt<D>,
        left: &mut usize,
    ) -> Option<String> {
        let numbers = exact.numbers(part.cell);
        let mut forms = self.forms::<IBig>(Cell {
            exact,
            numbers: &numbers,
            cell: part.cell,
        });
        if self.is_scaled() {
            forms.iter_mut().for_each(Form::unscale);
        }
        for axis in 0..D {
            // The bits of the position say which half is taken each time.
            let mut position = part.low[axis];
            for _ in 0..part.level[axis] {
                position *= 2.0;
                let [low, high] = split(&forms, axis);
                forms = if position >= 1.0 { high } else { low };
                position -= position.floor();
            }
        }
        let mut text = String::new();
        let mut stack = vec![(forms, part.level)];
        while let Some((forms, level)) = stack.pop() {
            let counts = forms[0].counts;
            let corner = |number: usize| {
                let end = |axis: usize| (counts[axis] - 1) * (number >> axis & 1);
                end(0) + counts[0] * (end(1) + counts[1] * end(2))
            };
            if !(0..1 << D).all(|number| self.test(&forms, corner(number))) {
                return None;
            }
            if (0..forms[0].values.len()).all(|index| self.test(&forms, index)) {
                text.push('.');
                continue;
            }
            let axis = (0..D).min_by_key(|&a| level[a]).expect("two or three axes");
            if *left == 0 || level[axis] == DEEPEST {
                return None;
            }
            *left -= 1;
            text.push(character(axis));
            let mut finer = level;
            finer[axis] += 1;
            let [low, high] = split(&forms, axis);
            stack.push((high, finer));
            stack.push((low, finer));
        }
        Some(text)
    }

    /// Whether it is about the sign of one polynomial.
    fn is_scalar(&self) -> bool {
        !matches!(
            self,
            Self::Definite { .. } | Self::Dominant { .. } | Self::Cones { .. }
        )
    }

    /// Whether [`Condition::forms`] are in scaled Bernstein form.
    fn is_scaled(&self) -> bool {
        matches!(
            self,
            Self::Above(_) | Self::Negative | Self::NotBeyondZero { .. } | Self::Minor { .. }
        )
    }

    fn walk<T: Integer>(&self, cell: Cell<'_, D>, tree: &Tree) -> bool {
        let mut forms = self.forms::<T>(cell);
        // Factors that are positive do not matter, as long as nothing is cut.
        if tree.steps.len() > 1 && self.is_scaled() {
            forms.iter_mut().for_each(Form::unscale);
        }
        let mut stack = vec![forms];
        for step in &tree.steps {
            let forms = stack.pop().expect("trees are complete");
            match step {
                Step::Leaf => {
                    if !(0..forms[0].values.len()).all(|index| self.test(&forms, index)) {
                        return false;
                    }
                }
                Step::Cut(axis) => {
                    let [low, high] = split(&forms, usize::from(*axis));
                    stack.push(high);
                    stack.push(low);
                }
            }
        }
        true
    }

    /// The size, in bits and without the sign, of the largest number that is tested.
    fn bits(&self, cell: Cell<'_, D>, tree: &Tree) -> usize {
        let column = cell.numbers.column_bits(cell.exact);
        let entry = |after: &Whole<D>| {
            let longest = after.as_flattened().iter().map(BitTest::bit_len).max();
            column + longest.unwrap_or(0) + 2
        };
        // Determinants have at most six terms.
        let (factors, product) = match self {
            Self::Above(bound) => {
                let (mantissa, exponent) = cell::decode(*bound);
                let exponent = usize::try_from(exponent.unsigned_abs()).unwrap_or(usize::MAX);
                (D, D * column + 3 + mantissa.bit_len() + exponent + 1)
            }
            Self::Negative | Self::NotBeyondZero { .. } => (D, D * column + 3),
            Self::Entry { after, .. } => (1, entry(after)),
            Self::Minor { after, .. } => (2, 2 * entry(after) + 1),
            Self::Definite { after } | Self::Dominant { after } | Self::Cones { after, .. } => {
                (1, entry(after))
            }
        };
        let mut bits = product;
        for axis in 0..D {
            let degree = factors * cell.exact.degree[axis];
            bits += u64::BITS as usize - binomial(degree, degree / 2).leading_zeros() as usize;
            if tree.steps.len() > 1 {
                // Of the degree of the form, which is one less for some, and then may be larger.
                let multiple = multiple(degree).max(multiple(degree - 1));
                bits += u64::BITS as usize - multiple.leading_zeros() as usize;
                bits += degree * tree.depth[axis];
            }
        }
        bits
    }

    /// The polynomials that are tested, each times a positive number (matrices, row by row,
    /// all times the same).
    fn forms<T: Integer>(&self, cell: Cell<'_, D>) -> Vec<Form<T>> {
        let columns = cell.exact.columns::<T>(cell.cell, cell.numbers);
        match *self {
            Self::Above(bound) => {
                let mut form = signed_determinant(cell, columns, false);
                if bound > 0.0 {
                    subtract_bound(cell, &mut form, bound);
                }
                vec![form]
            }
            Self::Negative => vec![signed_determinant(cell, columns, true)],
            Self::NotBeyondZero { reversed } => vec![signed_determinant(cell, columns, reversed)],
            Self::Entry { after, row } => vec![entry(after, &columns, row, row)],
            Self::Minor {
                after,
                rows: [i, j],
            } => {
                let entry = |r: usize, a: usize| entry(after, &columns, r, a).scaled();
                let mut minor = entry(i, j).product(&entry(j, i));
                minor.negate();
                minor.add_product(&entry(i, i), &entry(j, j));
                vec![minor]
            }
            Self::Definite { after } | Self::Dominant { after } | Self::Cones { after, .. } => {
                let degree = cell.exact.degree;
                let raised = |r: usize, a: usize| {
                    let mut form = entry(after, &columns, r, a).raised(a);
                    // Raising multiplies by the degree, which is another for each column.
                    let others = (0..D).filter(|&b| b != a).map(|b| degree[b] as u64);
                    let factor = others.product();
                    form.factors(|axis, _| if axis == 0 { factor } else { 1 });
                    form
                };
                (0..D * D)
                    .map(|number| raised(number / D, number % D))
                    .collect()
            }
        }
    }

    /// Whether one coefficient, or one matrix of coefficients, is as it should be.
    fn test<T: Integer>(&self, forms: &[Form<T>], index: usize) -> bool {
        let value = &forms[0].values[index];
        let m = |r: usize, c: usize| forms[r * D + c].values[index].to_big();
        match *self {
            Self::Above(bound) if bound > 0.0 => !value.is_negative(),
            Self::NotBeyondZero { .. } => !value.is_negative(),
            Self::Above(_) | Self::Negative | Self::Entry { .. } | Self::Minor { .. } => {
                !value.is_negative() && !value.is_zero()
            }
            Self::Definite { .. } => {
                let s: Whole<D> =
                    std::array::from_fn(|r| std::array::from_fn(|c| m(r, c) + m(c, r)));
                let square = &s[0][0] * &s[1][1] - &s[0][1] * &s[1][0];
                let positive = |x: &IBig| *x > IBig::ZERO;
                positive(&s[0][0])
                    && positive(&square)
                    && (D == 2 || positive(&cell::determinant(&s)))
            }
            Self::Dominant { .. } => (0..D).all(|r| {
                let others = (0..D).filter(|&c| c != r);
                let sum = others.fold(IBig::ZERO, |sum, c| sum + magnitude(m(r, c)));
                m(r, r) > sum
            }),
            Self::Cones { axes, sines, .. } => (0..D).all(|a| {
                let v: [IBig; D] = std::array::from_fn(|c| m(c, a));
                let along = dot(&v, &axes[a]);
                let length = dot(&v, &v);
                let across = &length * dot(&axes[a], &axes[a]) - &along * &along;
                along > IBig::ZERO && across <= length * &sines[a] * &sines[a]
            }),
        }
    }
}

/// A cell in integers.
#[derive(Clone, Copy)]
struct Cell<'a, const D: usize> {
    exact: &'a Exact<'a, D>,
    numbers: &'a Numbers<D>,
    cell: [usize; D],
}

pub(super) fn dot<const D: usize>(a: &[IBig; D], b: &[IBig; D]) -> IBig {
    std::iter::zip(a, b).fold(IBig::ZERO, |sum, (a, b)| sum + a * b)
}

fn magnitude(x: IBig) -> IBig {
    if x.sign() == Sign::Negative { -x } else { x }
}

fn split<T: Integer>(forms: &[Form<T>], axis: usize) -> [Vec<Form<T>>; 2] {
    let mut halves = [
        Vec::with_capacity(forms.len()),
        Vec::with_capacity(forms.len()),
    ];
    for form in forms {
        let [low, high] = form.split(axis);
        halves[0].push(low);
        halves[1].push(high);
    }
    halves
}

/// An entry of `C J` in Bernstein form.
fn entry<T: Integer, const D: usize>(
    after: &Whole<D>,
    columns: &[[Form<T>; D]; D],
    row: usize,
    column: usize,
) -> Form<T> {
    let factors: [T; D] = std::array::from_fn(|c| T::from_big(&after[row][c]));
    let column = &columns[column];
    let sum = |index: usize| {
        let mut sum = T::zero();
        for (factor, form) in factors.iter().zip(column) {
            sum.add_product(factor, &form.values[index]);
        }
        sum
    };
    Form {
        counts: column[0].counts,
        values: (0..column[0].values.len()).map(sum).collect(),
    }
}

/// The determinant of the columns in scaled form, with the sign of `det J`, or of
/// `− det J`.
fn signed_determinant<T: Integer, const D: usize>(
    cell: Cell<'_, D>,
    columns: [[Form<T>; D]; D],
    reversed: bool,
) -> Form<T> {
    let columns = columns.map(|column| column.map(Form::scaled));
    let [first, second] = [&columns[0], &columns[1]];
    let cross = |p: usize, q: usize| {
        let mut cross = first[q].product(&second[p]);
        cross.negate();
        cross.add_product(&first[p], &second[q]);
        cross
    };
    let mut det = cross(0, 1);
    if D == 3 {
        let third = &columns[2];
        det = third[2].product(&det);
        det.add_product(&third[0], &cross(1, 2));
        det.add_product(&third[1], &cross(2, 0));
    }
    let mirrored = cell::determinant(&cell.numbers.axes).sign() == Sign::Negative;
    if mirrored != reversed {
        det.negate();
    }
    det
}

/// Turns `det J`, in scaled form, into `det J − bound`.
fn subtract_bound<T: Integer, const D: usize>(cell: Cell<'_, D>, det: &mut Form<T>, bound: f64) {
    // What stands for det J = 1.
    let one = (0..D).fold(
        magnitude(cell::determinant(&cell.numbers.axes)),
        |product, _| product * &cell.exact.unit,
    );
    let (mantissa, exponent) = cell::decode(bound);
    let shift = usize::try_from(exponent.unsigned_abs()).expect("an exponent of a double");
    let mut part = T::from_big(&(-(one * mantissa)));
    if exponent < 0 {
        det.values.iter_mut().for_each(|value| value.shift(shift));
    } else {
        part.shift(shift);
    }
    let mut constant = Form {
        counts: det.counts,
        values: vec![part; det.values.len()],
    }
    .scaled();
    std::mem::swap(det, &mut constant);
    det.add(&constant);
}
