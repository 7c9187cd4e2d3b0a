//! Boxes that prove the sign of the determinant by their Bernstein coefficients alone, for
//! certificates.
//!
//! The exact test has better bounds for boxes near a minimum ([`lower`](super::lower)), and
//! so needs fewer boxes. Here each box must speak for itself.

use super::queue::Node;
use super::search::{DEEPEST, Search};
use crate::Lattice;
use crate::certificate::{Writer, character};

/// What floating point could not decide: a cell, and the lower corner of a part of it and
/// halvings along each axis.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Doubt<const D: usize> {
    pub(crate) cell: [usize; D],
    pub(crate) low: [f64; D],
    pub(crate) level: [usize; D],
}

/// Boxes that tile all cells.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Found {
    /// As a certificate has them.
    pub(crate) cuts: String,
    /// A lower bound of `det J`, or of `− det J` if everything was to be negative; zero if
    /// none is known.
    pub(crate) least: f64,
}

/// Cuts all cells until Bernstein coefficients have one sign. Boxes are cut further, as long
/// as at most `boxes` come to be and rounding errors allow, if they are below `target`. What is
/// in doubt is left to `settle`, which may give a tree. If it does not, the cell is returned as
/// an error.
pub(crate) fn find<const D: usize>(
    lattice: &Lattice<D>,
    reversed: bool,
    target: f64,
    boxes: usize,
    mut settle: impl FnMut(Doubt<D>) -> Option<String>,
) -> Result<Found, [usize; D]> {
    let mut search = Search::new(lattice, false);
    search.partials.prepare();
    let mut writer = Writer::default();
    let mut least = f64::INFINITY;
    let mut left = boxes;
    for number in 0..search.states.len() {
        let cell = search.partials.cell(number);
        let mut text = String::new();
        let mut stack = vec![search.whole_cell(number)];
        while let Some(node) = stack.pop() {
            let bounds = &node.bounds;
            let lowest = if reversed { -bounds.max } else { bounds.min };
            let bound = lowest - node.error;
            let [in_world, _] = search.partials.divide_by_frame([bound, f64::INFINITY]);
            let may_cut = left > 0 && !is_exhausted(&node);
            if bound > 0.0 && (in_world >= target || !may_cut) {
                least = least.min(in_world);
                text.push('.');
            } else if may_cut {
                left -= 1;
                let level = node.level;
                let [low, high] = search.cut(node);
                let axis = (0..D).find(|&a| low.level[a] > level[a]);
                text.push(character(axis.expect("one axis is cut")));
                stack.push(high);
                stack.push(low);
            } else {
                let doubt = Doubt {
                    cell,
                    low: node.low,
                    level: node
                        .level
                        .map(|l| usize::try_from(l).expect("not negative")),
                };
                text.push_str(&settle(doubt).ok_or(cell)?);
                least = 0.0;
            }
        }
        writer.tree(&text);
    }
    Ok(Found {
        cuts: writer.finish(),
        least: least.max(0.0),
    })
}

/// Whether floating point can tell no more of smaller boxes: a corner, or all values, are as
/// small as rounding errors.
fn is_exhausted<const D: usize>(node: &Node<D>) -> bool {
    let bounds = &node.bounds;
    let smallest = bounds.low_corner.0.abs().min(bounds.high_corner.0.abs());
    node.error == f64::INFINITY
        || node.level.iter().any(|&level| level >= DEEPEST)
        || bounds.max - bounds.min <= 4.0 * node.error
        || smallest <= node.error
}
