//! Lattices that fold, and such as are about to.

use super::class::{Class, Known};
use super::field::{grid_and_field, in_cells, read_field};
use super::grids::{GridOptions, Shape};
use super::numbers::Made;
use crate::{Border, Budget, CheckOptions, Lattice, Outcome};
use proptest::strategy::Strategy;

/// Beyond rounding errors by far.
const CLEARLY: f64 = 1.0 / 16.0;

/// Lattices that fold: `det J` is less than −1/16 at one of 3 × 3 (× 3) places of each
/// cell, and more than 1/16 at another. That is seen by evaluating it there, where rounding
/// errors are far smaller. Control points move by up to three cells along each axis. For
/// folds that are hard to find there is [`near_limit`].
///
/// They shrink to one cell of which a single control point, if possible, is pulled across;
/// see [`lattices`](super::lattices).
pub fn folded<const D: usize>(
    options: GridOptions,
) -> impl Strategy<Value = Lattice<D>> + Clone + Send + Sync {
    let layout = grid_and_field::<D>(&options, |_| ());
    Made::new("folded lattice", layout, move |mut reader| {
        let grid = Shape::read(&options, &mut reader).grid()?;
        let field = read_field(&options, &grid, reader);
        let lattice = in_cells(grid, |i| field[i].map(|x| 3.0 * x))?;
        has_both_signs(&lattice).then_some(lattice)
    })
}

/// Whether `det J` clearly has both signs at the corners and in the middles of cells, their
/// edges and faces.
fn has_both_signs<const D: usize>(lattice: &Lattice<D>) -> bool {
    let grid = lattice.grid();
    let domain = grid.domain();
    let places: [usize; D] = std::array::from_fn(|axis| 2 * grid.domain_cells(axis) + 1);
    let [mut least, mut most] = [f64::INFINITY, f64::NEG_INFINITY];
    for mut place in 0..places.iter().product() {
        let u = std::array::from_fn(|axis| {
            let step = place % places[axis];
            place /= places[axis];
            domain[axis][0] + 0.5 * step as f64
        });
        // A place at the border may be rounded out of the domain.
        if let Some(there) = lattice.evaluate(grid.frame().to_world(u)) {
            least = least.min(there.determinant);
            most = most.max(there.determinant);
        }
    }
    least < -CLEARLY && most > CLEARLY
}

/// Lattices that are nearly folded, or just so: all displacements of a random direction are
/// scaled up until the lattice ceases to be regular, and then by a little less or a little
/// more.
///
/// The class is [`Class::Regular`] ([`Class::Injective`] with an identity border) or
/// [`Class::Folded`], each about every other time; it was proven by [`Lattice::check`]. By
/// that test the displacements of a regular one, times a factor of at most 1 + `gap`, are
/// those of a lattice that is not regular; and those of a folded one, divided by at most
/// (1 + `gap`)², of one that is. `gap` must lie between 10⁻⁹ and 1.
///
/// To test code against a proof of its own rather than against this crate, use
/// [`injective`](super::injective) and [`folded`].
///
/// The direction shrinks as in [`lattices`](super::lattices), and the limit is searched for
/// anew each time.
///
/// # Example
///
/// ```
/// use ffd_core::{CheckOptions, strategies::{GridOptions, near_limit}};
/// use proptest::{prelude::*, test_runner::TestRunner};
///
/// let mut runner = TestRunner::new(ProptestConfig::with_cases(32));
/// runner.run(&near_limit::<2>(GridOptions::default(), 1e-3), |known| {
///     let verdict = known.lattice.check(&CheckOptions::default());
///     prop_assert_eq!(verdict.is_regular(), known.class.is_regular());
///     Ok(())
/// })?;
/// # Ok::<(), proptest::test_runner::TestError<ffd_core::strategies::Known<2>>>(())
/// ```
pub fn near_limit<const D: usize>(
    options: GridOptions,
    gap: f64,
) -> impl Strategy<Value = Known<D>> + Clone + Send + Sync {
    let layout = match (1e-9..=1.0).contains(&gap) {
        true => grid_and_field::<D>(&options, |layout| layout.push(0..=1)),
        false => Err(format!("a gap of {gap} is not between 1e-9 and 1")),
    };
    Made::new("lattice near the limit", layout, move |mut reader| {
        let grid = Shape::read(&options, &mut reader).grid()?;
        let is_folded = reader.next() == 1;
        let field = read_field(&options, &grid, reader);
        let direction = in_cells(grid, |i| field[i])?;
        let [inside, outside] = limit(&direction, gap)?;
        if !is_folded {
            let class = match direction.grid().border() {
                Border::Free => Class::Regular,
                Border::Identity => Class::Injective,
            };
            return Some(Known::new(scaled(&direction, inside)?, class));
        }
        // At the limit itself the determinant may just touch zero.
        [outside, outside * (1.0 + gap)]
            .into_iter()
            .find_map(|factor| {
                let lattice = scaled(&direction, factor)?;
                let is_folded = judge(&lattice) == Some(Sign::Both);
                is_folded.then(|| Known::new(lattice, Class::Folded))
            })
    })
}

/// The same lattice with all displacements times a factor.
fn scaled<const D: usize>(lattice: &Lattice<D>, factor: f64) -> Option<Lattice<D>> {
    let displacements = lattice.displacements().iter();
    let displacements = displacements.map(|d| d.map(|x| x * factor)).collect();
    Lattice::new(lattice.grid().clone(), displacements).ok()
}

/// What was proven of `det J`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Sign {
    Positive,
    Both,
    Other,
}

/// `None` if the test gave up.
fn judge<const D: usize>(lattice: &Lattice<D>) -> Option<Sign> {
    let verdict = lattice.check(&CheckOptions {
        global: false,
        budget: Budget {
            boxes: 20_000,
            exact_boxes: 50,
        },
        ..CheckOptions::default()
    });
    match verdict.outcome {
        Outcome::Injective(_) | Outcome::LocallyInjective => Some(Sign::Positive),
        Outcome::NotInjective(_) => Some(Sign::Both),
        Outcome::Degenerate { .. } | Outcome::Reversed => Some(Sign::Other),
        Outcome::Undecided(_) => None,
    }
}

/// A factor with which a lattice is regular, and one larger by at most `gap`, relatively,
/// with which it is not; `None` if there are no such up to a thousand, or a test gave up.
///
/// Scaling up begins small, so most often this is where it ceases to be regular for the
/// first time; but nothing depends on that.
fn limit<const D: usize>(direction: &Lattice<D>, gap: f64) -> Option<[f64; 2]> {
    let is_regular = |factor| Some(judge(&scaled(direction, factor)?)? == Sign::Positive);
    let is_zero = |d: &f64| d.abs() <= 0.0;
    if direction.displacements().as_flattened().iter().all(is_zero) {
        return None;
    }
    let [mut inside, mut outside] = [0.0, 0.125];
    while is_regular(outside)? {
        inside = outside;
        outside *= 2.0;
        if outside > 1024.0 {
            return None;
        }
    }
    while outside - inside > gap * inside {
        let middle = f64::midpoint(inside, outside);
        if is_regular(middle)? {
            inside = middle;
        } else {
            outside = middle;
        }
    }
    Some([inside, outside])
}
