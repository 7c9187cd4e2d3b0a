//! Slow and obvious: the map and its Jacobian in exact rational arithmetic.
//!
//! For a lattice with origin o, axes A (as columns) and displacements dᵢ, all of them the
//! stored numbers taken as exact real ones, F(x) = x + Σ Bᵢ(A⁻¹(x − o)) dᵢ has
//! det J = det(A + D) / det A with D = Σ dᵢ ∇Bᵢᵀ, the gradients with respect to lattice
//! coordinates. Nothing but the numbers of the lattice is taken from the crate: basis
//! functions come from the Cox–de Boor recursion in fractions.

mod bernstein;
mod number;
mod overlap;

pub(crate) use bernstein::{Bernstein, Signs, indices};
pub(crate) use number::{Number, exact, power_of_two};

use bernstein::linear;
use dashu_int::IBig;
use dashu_ratio::RBig;
use ffd_core::{Border, Knots, Lattice};
use number::{binomial, integers, over_common_denominator};

/// A polynomial in the position within a cell: coefficient k belongs to tᵏ.
type Polynomial = Vec<RBig>;

/// A lattice in exact numbers.
pub(crate) struct Oracle<'a, const D: usize> {
    lattice: &'a Lattice<D>,
    /// Cells of the domain along each axis.
    pub(crate) cells: [usize; D],
    /// Cells of the domain before the lattice's own.
    pub(crate) layers: [usize; D],
    degree: [usize; D],
    /// For each axis and cell of the domain, the basis functions …
    bases: [Vec<Vec<Polynomial>>; D],
    /// … and their Bernstein coefficients times `basis_unit`: `[axis][cell][function][k]`.
    bernstein: [Vec<Vec<Vec<IBig>>>; D],
    basis_unit: [IBig; D],
    /// `axes[i][c]` and displacements, all times 2^−`exponent`.
    axes: [[IBig; D]; D],
    displacements: Vec<[IBig; D]>,
    exponent: i64,
    /// det A in the same unit.
    volume: IBig,
}

/// The basis functions of degree `n` that are not zero in the cell that begins at knot
/// `cell`, as polynomials in u − cell. The recursion of Cox and de Boor, with 0/0 = 0.
fn basis(n: usize, cell: i64, knot: &dyn Fn(i64) -> i64) -> Vec<Polynomial> {
    // (a + b t) p(t) / c, or zero if c is.
    let part = |a: i64, b: i64, c: i64, p: Option<&Polynomial>| -> Polynomial {
        let mut product = vec![RBig::ZERO; n + 1];
        if let Some(p) = p.filter(|_| c != 0) {
            for k in 0..n {
                product[k] += &p[k] * RBig::from(a) / RBig::from(c);
                product[k + 1] += &p[k] * RBig::from(b) / RBig::from(c);
            }
        }
        product
    };
    // Of degree p there are those that begin at the knots cell − p … cell.
    let mut functions = vec![vec![RBig::ZERO; n + 1]];
    functions[0][0] = RBig::ONE;
    for p in 1..=n {
        let lower = |begin: i64| {
            let index = begin - (cell - p as i64 + 1);
            usize::try_from(index).ok().and_then(|i| functions.get(i))
        };
        let p = p as i64;
        functions = (cell - p..=cell)
            .map(|i| {
                let (low, high) = (knot(i), knot(i + p + 1));
                let rising = part(cell - low, 1, knot(i + p) - low, lower(i));
                let falling = part(high - cell, -1, high - knot(i + 1), lower(i + 1));
                std::iter::zip(rising, falling)
                    .map(|(a, b)| a + b)
                    .collect()
            })
            .collect();
    }
    functions
}

/// From powers of t to Bernstein polynomials of degree n.
fn to_bernstein(polynomial: &Polynomial) -> Vec<RBig> {
    let n = polynomial.len() - 1;
    let coefficient = |k: usize| {
        (0..=k)
            .map(|i| &polynomial[i] * RBig::from(binomial(k, i)) / RBig::from(binomial(n, i)))
            .fold(RBig::ZERO, |sum, term| sum + term)
    };
    (0..=n).map(coefficient).collect()
}

/// The determinant of a matrix of numbers, `m[row][column]`.
pub(crate) fn determinant<const D: usize>(m: &[[RBig; D]; D]) -> RBig {
    let minor = |a: usize, b: usize| &m[a][0] * &m[b][1] - &m[b][0] * &m[a][1];
    if D == 2 {
        minor(0, 1)
    } else {
        (0..3)
            .map(|row| minor((row + 1) % 3, (row + 2) % 3) * &m[row][2])
            .fold(RBig::ZERO, |sum, term| sum + term)
    }
}

fn integer(x: &IBig) -> RBig {
    RBig::from(x.clone())
}

/// det J − `level`, times a positive number, from what [`Oracle::det`] returned.
pub(crate) fn det_above<const D: usize>(
    (det, one): &(Bernstein<IBig, D>, IBig),
    level: f64,
) -> Bernstein<IBig, D> {
    let level = exact(level);
    let denominator = IBig::from(level.denominator().clone());
    let subtrahend = level.numerator() * one;
    let coefficients = det.coefficients.iter();
    Bernstein {
        degree: det.degree,
        coefficients: coefficients
            .map(|c| c * &denominator - &subtrahend)
            .collect(),
    }
}

impl<'a, const D: usize> Oracle<'a, D> {
    pub(crate) fn new(lattice: &'a Lattice<D>) -> Self {
        let grid = lattice.grid();
        let degree = grid.degree().map(|n| n.get());
        let layers = match grid.border() {
            Border::Free => [0; D],
            Border::Identity => degree,
        };
        let cells: [usize; D] = std::array::from_fn(|i| grid.cells()[i] + 2 * layers[i]);

        let bases: [Vec<Vec<Polynomial>>; D] = std::array::from_fn(|axis| {
            let (n, last) = (degree[axis], grid.cells()[axis] as i64);
            match grid.knots()[axis] {
                // All cells are alike.
                Knots::Uniform => vec![basis(n, 0, &|i| i); cells[axis]],
                Knots::Clamped => (0..last)
                    .map(|cell| basis(n, cell, &|i| i.clamp(0, last)))
                    .collect(),
            }
        });
        let mut basis_unit = [const { IBig::ONE }; D];
        let bernstein = std::array::from_fn(|axis| {
            let n = degree[axis];
            let all: Vec<_> = bases[axis]
                .iter()
                .flatten()
                .flat_map(to_bernstein)
                .collect();
            let (all, unit) = over_common_denominator(&all);
            basis_unit[axis] = unit;
            all.chunks((n + 1) * (n + 1))
                .map(|cell| cell.chunks(n + 1).map(<[IBig]>::to_vec).collect())
                .collect()
        });

        let mut numbers: Vec<f64> = grid.frame().axes().as_flattened().to_vec();
        numbers.extend(lattice.displacements().as_flattened());
        let (numbers, exponent) = integers(&numbers);
        let vectors: Vec<[IBig; D]> = numbers
            .chunks(D)
            .map(|vector| std::array::from_fn(|c| vector[c].clone()))
            .collect();
        let axes: [[IBig; D]; D] = std::array::from_fn(|i| vectors[i].clone());
        let volume = determinant(&axes.each_ref().map(|a| a.each_ref().map(integer)));
        Self {
            lattice,
            cells,
            layers,
            degree,
            bases,
            bernstein,
            basis_unit,
            axes,
            displacements: vectors[D..].to_vec(),
            exponent,
            volume: volume.numerator().clone(),
        }
    }

    /// All cells of the domain.
    pub(crate) fn all_cells(&self) -> Vec<[usize; D]> {
        indices(self.cells).collect()
    }

    /// The displacement, in integers, of a control point that acts on a cell; `None` for
    /// one of the border.
    fn displacement(&self, cell: [usize; D], function: [usize; D]) -> Option<&[IBig; D]> {
        let per_axis = self.lattice.grid().control_points_per_axis();
        let mut indices = [0; D];
        for axis in 0..D {
            indices[axis] = (cell[axis] + function[axis]).checked_sub(self.layers[axis])?;
            if indices[axis] >= per_axis[axis] {
                return None;
            }
        }
        Some(&self.displacements[linear(indices, per_axis)])
    }

    /// Σ Bᵢ dᵢ over a cell in Bernstein form, in units of 2^`exponent` / Π `basis_unit`,
    /// each component.
    fn bezier(&self, cell: [usize; D]) -> [Bernstein<IBig, D>; D] {
        let count = self.degree.map(|n| n + 1);
        std::array::from_fn(|c| {
            let mut coefficients: Vec<IBig> = indices(count)
                .map(|function| self.displacement(cell, function))
                .map(|d| d.map_or(IBig::ZERO, |d| d[c].clone()))
                .collect();
            // One axis after the other.
            for axis in 0..D {
                let along = &self.bernstein[axis][cell[axis]];
                let sum = |index: [usize; D]| {
                    let term = |function: usize| {
                        let mut from = index;
                        from[axis] = function;
                        &coefficients[linear(from, count)] * &along[function][index[axis]]
                    };
                    (0..count[axis])
                        .map(term)
                        .fold(IBig::ZERO, |sum, term| sum + term)
                };
                coefficients = indices(count).map(sum).collect();
            }
            Bernstein {
                degree: self.degree,
                coefficients,
            }
        })
    }

    /// det(A + t D) · sign det A over a cell as integers, and the integer that stands for
    /// det J = 1; here t = 1.
    pub(crate) fn det(&self, cell: [usize; D]) -> (Bernstein<IBig, D>, IBig) {
        let scale = self.basis_unit.iter().fold(IBig::ONE, |p, unit| p * unit);
        let bezier = self.bezier(cell);
        let matrix: Vec<Vec<_>> = (0..D)
            .map(|c| {
                (0..D)
                    .map(|axis| bezier[c].slope(axis, &(&self.axes[axis][c] * &scale)))
                    .collect()
            })
            .collect();
        let (mut det, multiple) = Bernstein::determinant(&matrix);
        let mut one = self.volume.clone() * IBig::from(multiple) * scale.pow(D);
        if one < IBig::ZERO {
            one = -one;
            for c in &mut det.coefficients {
                *c = -&*c;
            }
        }
        (det, one)
    }

    /// Signs of det J on the closed domain, from at most `boxes` parts of each cell; ends
    /// when both are found.
    pub(crate) fn signs(&self, boxes: usize) -> Signs {
        let mut found = Signs::default();
        for cell in self.all_cells() {
            found = found.with(self.det(cell).0.signs(boxes));
            if found.both() {
                break;
            }
        }
        found
    }

    /// Values and slopes of the basis functions of a cell.
    fn basis_at(&self, axis: usize, cell: usize, t: &RBig) -> [Vec<RBig>; 2] {
        let functions = &self.bases[axis][cell];
        // Horner's scheme.
        let value = |p: &Polynomial| p.iter().rev().fold(RBig::ZERO, |sum, c| sum * t + c);
        let slope = |p: &Polynomial| {
            let derivative = (1..p.len()).map(|k| &p[k] * RBig::from(k)).collect();
            value(&derivative)
        };
        [
            functions.iter().map(value).collect(),
            functions.iter().map(slope).collect(),
        ]
    }

    /// Σ dᵢ Π weights, one list of weights for each axis, in world units.
    fn weighted(&self, cell: [usize; D], weights: [&[RBig]; D]) -> [RBig; D] {
        let mut unit = power_of_two(self.exponent);
        let weights = weights.map(|w| {
            let (integers, denominator) = over_common_denominator(w);
            unit /= RBig::from(denominator);
            integers
        });
        let mut sum = [const { IBig::ZERO }; D];
        for function in indices(self.degree.map(|n| n + 1)) {
            if let Some(d) = self.displacement(cell, function) {
                let weight = (0..D)
                    .map(|axis| &weights[axis][function[axis]])
                    .fold(IBig::ONE, |product, w| product * w);
                for c in 0..D {
                    sum[c] += &d[c] * &weight;
                }
            }
        }
        sum.map(|s| RBig::from(s) * &unit)
    }

    /// A + D at a position within a cell, `[row][column]`.
    fn matrix_at(&self, cell: [usize; D], t: [f64; D]) -> [[RBig; D]; D] {
        let along: [_; D] =
            std::array::from_fn(|axis| self.basis_at(axis, cell[axis], &exact(t[axis])));
        let columns: [[RBig; D]; D] = std::array::from_fn(|i| {
            let weights = std::array::from_fn(|axis| &*along[axis][usize::from(axis == i)]);
            let slope = self.weighted(cell, weights);
            std::array::from_fn(|c| exact(self.lattice.grid().frame().axes()[i][c]) + &slope[c])
        });
        std::array::from_fn(|r| std::array::from_fn(|c| columns[c][r].clone()))
    }

    /// A, `[row][column]`.
    fn frame(&self) -> [[RBig; D]; D] {
        let axes = self.lattice.grid().frame().axes();
        std::array::from_fn(|r| std::array::from_fn(|c| exact(axes[c][r])))
    }

    /// det J at a position within a cell, exactly; where it jumps between cells, that of
    /// this one.
    pub(crate) fn det_at(&self, cell: [usize; D], t: [f64; D]) -> RBig {
        determinant(&self.matrix_at(cell, t)) / determinant(&self.frame())
    }

    /// A⁻¹ J A at a position within a cell: the Jacobian in lattice coordinates.
    pub(crate) fn lattice_jacobian(&self, cell: [usize; D], t: [f64; D]) -> [[RBig; D]; D] {
        let (frame, matrix) = (self.frame(), self.matrix_at(cell, t));
        let volume = determinant(&frame);
        // Cramer's rule for A X = A + D.
        std::array::from_fn(|r| {
            std::array::from_fn(|c| {
                let mut replaced = frame.clone();
                for row in 0..D {
                    replaced[row][r] = matrix[row][c].clone();
                }
                determinant(&replaced) / &volume
            })
        })
    }

    /// The world position of a place, exactly.
    pub(crate) fn position(&self, cell: [usize; D], t: [f64; D]) -> [RBig; D] {
        let frame = self.lattice.grid().frame();
        std::array::from_fn(|c| {
            (0..D).fold(exact(frame.origin()[c]), |sum, i| {
                let u = RBig::from(cell[i]) - RBig::from(self.layers[i]) + exact(t[i]);
                sum + u * exact(frame.axes()[i][c])
            })
        })
    }

    /// F at a position within a cell, exactly.
    pub(crate) fn image(&self, cell: [usize; D], t: [f64; D]) -> [RBig; D] {
        let along: [_; D] =
            std::array::from_fn(|axis| self.basis_at(axis, cell[axis], &exact(t[axis])));
        let displacement = self.weighted(cell, along.each_ref().map(|[values, _]| &**values));
        let position = self.position(cell, t);
        std::array::from_fn(|c| &position[c] + &displacement[c])
    }

    /// An estimate, in floating point, of the largest t up to which det(A + t D) > 0,
    /// going up from 0 as far as `most`.
    pub(crate) fn limit_estimate(&self, most: f64) -> f64 {
        let scale = self.basis_unit.iter().fold(IBig::ONE, |p, unit| p * unit);
        let largest = self
            .axes
            .as_flattened()
            .iter()
            .map(|x| x.rounded().abs())
            .fold(0.0, f64::max);
        let mut limit = most;
        for cell in self.all_cells() {
            let parts = self.bezier(cell);
            let det = |t: f64| {
                let matrix: Vec<Vec<_>> = (0..D)
                    .map(|c| {
                        let part = Bernstein {
                            degree: self.degree,
                            coefficients: parts[c]
                                .coefficients
                                .iter()
                                .map(|x| x.rounded() / scale.rounded() / largest * t)
                                .collect(),
                        };
                        (0..D)
                            .map(|axis| part.slope(axis, &(self.axes[axis][c].rounded() / largest)))
                            .collect()
                    })
                    .collect();
                let mut det = Bernstein::determinant(&matrix).0;
                if self.volume < IBig::ZERO {
                    for c in &mut det.coefficients {
                        *c = -*c;
                    }
                }
                det
            };
            if det(limit).signs(100).only_positive() {
                continue;
            }
            // det is a cubic in t, so four values tell the others.
            let (mut low, mut high) = (0.0, limit);
            let values = [0.0, 1.0, 2.0, 3.0].map(|k| det(limit * k / 3.0));
            while high - low > 1e-6 * limit {
                let middle = 0.5 * (low + high);
                let s = 3.0 * middle / limit;
                // Lagrange's polynomials for the nodes 0, 1, 2 and 3.
                let weights = [
                    -(s - 1.0) * (s - 2.0) * (s - 3.0) / 6.0,
                    s * (s - 2.0) * (s - 3.0) / 2.0,
                    -s * (s - 1.0) * (s - 3.0) / 2.0,
                    s * (s - 1.0) * (s - 2.0) / 6.0,
                ];
                let coefficients = (0..values[0].coefficients.len())
                    .map(|i| {
                        (0..4)
                            .map(|k| weights[k] * values[k].coefficients[i])
                            .sum::<f64>()
                    })
                    .collect();
                let at_middle = Bernstein {
                    degree: values[0].degree,
                    coefficients,
                };
                if at_middle.signs(100).only_positive() {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            limit = low;
        }
        limit
    }
}
