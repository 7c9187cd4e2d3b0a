//! Certificates from verdicts.
//!
//! Nothing here is trusted: what is wrong is rejected by the checker.

use super::cell::Exact;
use super::condition::{Condition, after};
use super::cuts::Writer;
use super::verify::{Cones, minors, unit};
use super::{Certificate, Certified, Global, Proof, Uncertified};
use crate::injectivity::tiling;
use crate::{CheckOptions, Evidence, Lattice, Outcome, Theorem, Verdict};

pub(super) fn certify<const D: usize>(
    lattice: &Lattice<D>,
    options: &CheckOptions,
) -> Certified<D> {
    let verdict = lattice.check(options);
    let exact = Exact::new(lattice);
    let certificate = proof(&exact, &verdict, options).map(|proof| Certificate {
        degree: exact.degree,
        cells: exact.cells,
        proof,
    });
    Certified {
        verdict,
        certificate,
    }
}

fn proof<const D: usize>(
    exact: &Exact<'_, D>,
    verdict: &Verdict<D>,
    options: &CheckOptions,
) -> Result<Proof<D>, Uncertified<D>> {
    let cuts = |condition, reversed| cuts(exact, condition, reversed, 0.0, options);
    Ok(match &verdict.outcome {
        Outcome::Injective(theorem) => {
            regular(exact, verdict, options, find(exact, theorem, options))?
        }
        Outcome::LocallyInjective => regular(exact, verdict, options, None)?,
        Outcome::Reversed => Proof::Reversed {
            cuts: cuts(Condition::Negative, true)?.cuts,
        },
        Outcome::Degenerate { zero, reversed } => {
            let reversed = *reversed;
            Proof::Degenerate {
                cuts: cuts(Condition::NotBeyondZero { reversed }, reversed)?.cuts,
                zero: zero.into(),
                reversed,
            }
        }
        Outcome::NotInjective(Evidence::BothSigns { positive, negative }) => Proof::BothSigns {
            positive: positive.into(),
            negative: negative.into(),
        },
        Outcome::NotInjective(Evidence::Overlap {
            point,
            other,
            radius,
        }) => Proof::Overlap {
            point: point.into(),
            other: other.into(),
            radius: *radius,
        },
        Outcome::Undecided(_) => return Err(Uncertified::Undecided),
    })
}

/// Boxes for a condition on the determinant, above a bound if that is possible.
fn cuts<const D: usize>(
    exact: &Exact<'_, D>,
    condition: Condition<'_, D>,
    reversed: bool,
    target: f64,
    options: &CheckOptions,
) -> Result<tiling::Found, Uncertified<D>> {
    let mut left = options.budget.exact_boxes;
    let settle = |doubt: tiling::Doubt<D>| condition.find_in_part(exact, &doubt, &mut left);
    tiling::find(
        exact.lattice,
        reversed,
        target,
        options.budget.boxes,
        settle,
    )
    .map_err(|cell| Uncertified::Budget { cell })
}

fn regular<const D: usize>(
    exact: &Exact<'_, D>,
    verdict: &Verdict<D>,
    options: &CheckOptions,
    theorem: Option<Global<D>>,
) -> Result<Proof<D>, Uncertified<D>> {
    let condition = Condition::Above(0.0);
    let target = options.enclose.map(|width| verdict.min_det[0] - width);
    let tight = target.filter(|&target| target > 0.0);
    let with_target = tight.and_then(|target| cuts(exact, condition, false, target, options).ok());
    let found = match with_target {
        Some(found) => found,
        None => cuts(exact, condition, false, 0.0, options)?,
    };
    // A short number takes less arithmetic to check.
    let min_det = if tight.is_some() {
        found.least
    } else {
        f64::from_bits(found.least.to_bits() & !((1 << 43) - 1))
    };
    Ok(Proof::Regular {
        cuts: found.cuts,
        min_det,
        theorem,
    })
}

/// A theorem that can be certified in place of the one of a verdict: the same, or one that
/// follows from it.
fn find<const D: usize>(
    exact: &Exact<'_, D>,
    theorem: &Theorem<D>,
    options: &CheckOptions,
) -> Option<Global<D>> {
    match *theorem {
        Theorem::IdentityBorder => Some(Global::IdentityBorder),
        Theorem::PMatrix { after } => p_matrix(exact, after, options),
        Theorem::Monotone { after } => monotone(exact, after, options),
        Theorem::CommonCones => common_cones(exact, options)
            .or_else(|| p_matrix(exact, unit(), options))
            .or_else(|| monotone(exact, unit(), options)),
        // By the bound, `Σ |(J − I) v| < 1` for all v with entries ± 1.
        Theorem::DisplacementBound => dominant_rows(exact, options),
        Theorem::InjectiveBoundary => None,
    }
}

/// Boxes in which a condition holds, for all cells.
fn everywhere<const D: usize>(
    exact: &Exact<'_, D>,
    condition: &Condition<'_, D>,
    options: &CheckOptions,
) -> Option<String> {
    let mut left = options.budget.exact_boxes;
    let mut writer = Writer::default();
    for number in 0..exact.cell_count() {
        let cell = exact.cell(number);
        writer.tree(&condition.find(exact, cell, &mut left)?);
    }
    Some(writer.finish())
}

fn p_matrix<const D: usize>(
    exact: &Exact<'_, D>,
    matrix: [[f64; D]; D],
    options: &CheckOptions,
) -> Option<Global<D>> {
    if exact.degree.contains(&1) {
        return None;
    }
    let after = after(exact, &matrix);
    let cuts = minors(&after)
        .iter()
        .map(|minor| everywhere(exact, minor, options))
        .collect::<Option<_>>()?;
    Some(Global::PMatrix {
        after: matrix,
        cuts,
    })
}

fn monotone<const D: usize>(
    exact: &Exact<'_, D>,
    matrix: [[f64; D]; D],
    options: &CheckOptions,
) -> Option<Global<D>> {
    let after = &after(exact, &matrix);
    let cuts = everywhere(exact, &Condition::Definite { after }, options)?;
    Some(Global::Monotone {
        after: matrix,
        cuts,
    })
}

fn dominant_rows<const D: usize>(
    exact: &Exact<'_, D>,
    options: &CheckOptions,
) -> Option<Global<D>> {
    let after = &after(exact, &unit());
    let cuts = everywhere(exact, &Condition::Dominant { after }, options)?;
    Some(Global::DominantRows {
        after: unit(),
        cuts,
    })
}

/// Places along each axis of a cell at which columns are looked at.
const PLACES: usize = 5;

/// Cones around the axes of the lattice, or around the means of the columns: halfway between
/// the angles seen at some places and those at which the cones are no longer separate.
fn common_cones<const D: usize>(exact: &Exact<'_, D>, options: &CheckOptions) -> Option<Global<D>> {
    let columns = columns_at_places(exact)?;
    let mean = |a: usize| -> [f64; D] {
        let sums: [f64; D] = std::array::from_fn(|c| columns.iter().map(|m| m[a][c]).sum::<f64>());
        let length = norm(sums);
        sums.map(|x| x / length)
    };
    let around_means: [[f64; D]; D] = std::array::from_fn(mean);
    [unit(), around_means].into_iter().find_map(|axes| {
        let sines: [f64; D] = std::array::from_fn(|a| {
            let sine = |column: &[f64; D]| {
                let along: f64 = (0..D).map(|c| column[c] * axes[a][c]).sum();
                let across: [f64; D] = std::array::from_fn(|c| column[c] - along * axes[a][c]);
                if along > 0.0 {
                    norm(across) / norm(*column)
                } else {
                    f64::INFINITY
                }
            };
            let all = columns.iter().map(|m| sine(&m[a]));
            all.fold(1e-3, f64::max)
        });
        let scaled = |factor: f64| sines.map(|s| s * factor);
        let are_separate = |factor: f64| {
            let sines = scaled(factor);
            sines.iter().all(|s| s.is_finite()) && Cones::new(&axes, &sines).are_separate()
        };
        if !are_separate(1.0) {
            return None;
        }
        let (mut low, mut high) = (1.0, 2e3);
        for _ in 0..40 {
            let middle = f64::midpoint(low, high);
            if are_separate(middle) {
                low = middle;
            } else {
                high = middle;
            }
        }
        let sines = scaled(f64::midpoint(1.0, low));
        let cones = Cones::new(&axes, &sines);
        let condition = Condition::Cones {
            after: &after(exact, &unit()),
            axes: &cones.axes,
            sines: &cones.sines,
        };
        let cuts = everywhere(exact, &condition, options)?;
        Some(Global::CommonCones { axes, sines, cuts })
    })
}

fn norm<const D: usize>(v: [f64; D]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// The columns of J in lattice coordinates at some places of each cell, rounded.
fn columns_at_places<const D: usize>(exact: &Exact<'_, D>) -> Option<Vec<[[f64; D]; D]>> {
    let grid = exact.lattice.grid();
    let (axes, inverse) = (grid.frame().axes(), grid.frame().inverse());
    let domain = grid.domain();
    let mut columns = Vec::new();
    let per_axis = exact.cells.map(|count| (PLACES - 1) * count + 1);
    for number in 0..per_axis.iter().product() {
        let mut rest: usize = number;
        let u = std::array::from_fn(|a| {
            let index = rest % per_axis[a];
            rest /= per_axis[a];
            domain[a][0] + index as f64 / (PLACES - 1) as f64
        });
        // Rounding may put places of the border outside.
        let Some(there) = exact.lattice.evaluate(grid.frame().to_world(u)) else {
            continue;
        };
        columns.push(std::array::from_fn(|a| {
            let world: [f64; D] =
                std::array::from_fn(|r| (0..D).map(|c| there.jacobian[r][c] * axes[a][c]).sum());
            inverse.map(|row| (0..D).map(|c| row[c] * world[c]).sum())
        }));
    }
    (!columns.is_empty()).then_some(columns)
}
