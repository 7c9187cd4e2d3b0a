//! The exact test while a warp grows.

use std::time::{Duration, Instant};

use ffd_core::{CheckOptions, Checker, FfdError, Lattice, Verdict};

/// How far the least determinant is narrowed down.
const WIDTH: f64 = 1e-3;

/// What was found while a warp grew from nothing to what it is, in equal steps: as if
/// the user dragged and each frame were tested.
#[derive(Debug, Clone)]
pub struct Watch {
    /// The verdict on the warp as it is in the end, with the least determinant enclosed
    /// and all folded cells.
    pub verdict: Verdict<2>,
    /// How far the warp had grown when it was not regular for the first time, from 0
    /// to 1.
    pub irregular_from: Option<f64>,
    /// How long the test took in each step.
    pub times: Vec<Duration>,
}

impl Watch {
    /// Tests a warp in some steps, at least one. The test of a step takes over what the
    /// last one knew of cells that did not change.
    ///
    /// # Errors
    ///
    /// [`FfdError::TooManyControlPoints`] if memory does not suffice for a second lattice.
    pub fn new(lattice: &Lattice<2>, steps: usize) -> Result<Self, FfdError> {
        let options = CheckOptions {
            enclose: Some(WIDTH),
            all_cells: true,
            ..CheckOptions::default()
        };
        let steps = steps.max(1);
        let displacements = lattice.displacements();
        let moved = displacements.iter().enumerate();
        let moved = moved
            .filter(|(_, by)| by.iter().any(|&c| c != 0.0))
            .map(|(i, _)| i);
        let moved: Vec<_> = moved.collect();
        let mut growing = Lattice::at_rest(lattice.grid().clone())?;
        let mut checker = Checker::new(&growing, &options);
        let mut irregular_from = None;
        let mut times = Vec::with_capacity(steps);
        for step in 1..=steps {
            let part = step as f64 / steps as f64;
            for &i in &moved {
                growing.set_displacement(i, displacements[i].map(|c| part * c))?;
            }
            let start = Instant::now();
            let verdict = checker.update(&growing, &moved)?;
            times.push(start.elapsed());
            if !verdict.is_regular() && irregular_from.is_none() {
                irregular_from = Some(part);
            }
        }
        Ok(Self {
            verdict: checker.verdict().clone(),
            irregular_from,
            times,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::Image;
    use crate::warp::lattice_at_rest;
    use ffd_core::Outcome;

    #[test]
    fn a_warp_folds_on_the_way() {
        let picture = Image::filled(100, 80, [0.5; 3]);
        let mut lattice = lattice_at_rest(&picture, 10).unwrap();
        let still = Watch::new(&lattice, 3).unwrap();
        assert!(still.verdict.is_injective());
        assert_eq!((still.irregular_from, still.times.len()), (None, 3));

        let middle = lattice.grid().control_point([2, 1]);
        lattice.set_displacement(middle, [40.0, 5.0]).unwrap();
        let watch = Watch::new(&lattice, 8).unwrap();
        assert!(matches!(watch.verdict.outcome, Outcome::NotInjective(_)));
        let from = watch.irregular_from.unwrap();
        assert!(from > 0.125 && from < 1.0, "{from}");

        // The same as all at once, and at the step before it does not fold.
        let options = CheckOptions {
            all_cells: true,
            ..CheckOptions::default()
        };
        let at_once = lattice.check(&options);
        assert_eq!(at_once.irregular_cells, watch.verdict.irregular_cells);
        for (part, regular) in [(from, false), (from - 0.125, true)] {
            let by = [40.0, 5.0].map(|c| part * c);
            lattice.set_displacement(middle, by).unwrap();
            assert_eq!(lattice.check(&options).is_regular(), regular);
        }
    }
}
