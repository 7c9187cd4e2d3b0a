//! What is known of a lattice.

use crate::{Lattice, Outcome};

/// What is known of a lattice because of how it was made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Class {
    /// `det J > 0` on the closed domain, and one-to-one there.
    Injective,
    /// `det J > 0` on the closed domain; it may be one-to-one or not.
    Regular,
    /// `det J > 0` on the closed domain, and yet distant points have the same image.
    Overlapping,
    /// `det J ≥ 0`, and zero somewhere, exactly.
    Degenerate,
    /// `det J` has both signs.
    Folded,
    /// `det J < 0` on the closed domain. Those made here are one-to-one.
    Reversed,
}

impl Class {
    /// Whether `det J > 0` on the closed domain.
    #[must_use]
    pub fn is_regular(self) -> bool {
        matches!(self, Self::Injective | Self::Regular | Self::Overlapping)
    }

    /// Whether the map is one-to-one on its domain, if that is known.
    #[must_use]
    pub fn is_one_to_one(self) -> Option<bool> {
        match self {
            Self::Injective | Self::Reversed => Some(true),
            Self::Overlapping | Self::Folded => Some(false),
            Self::Regular | Self::Degenerate => None,
        }
    }

    /// Whether a verdict may say this of such a lattice. It may always be
    /// [undecided](Outcome::Undecided).
    #[must_use]
    pub fn allows<const D: usize>(self, outcome: &Outcome<D>) -> bool {
        match outcome {
            Outcome::Injective(_) => matches!(self, Self::Injective | Self::Regular),
            Outcome::LocallyInjective => self.is_regular(),
            // A regular lattice may overlap.
            Outcome::NotInjective(crate::Evidence::Overlap { .. }) => {
                matches!(self, Self::Regular | Self::Overlapping)
            }
            Outcome::NotInjective(_) => self == Self::Folded,
            Outcome::Degenerate { reversed, .. } => self == Self::Degenerate && !reversed,
            Outcome::Reversed => self == Self::Reversed,
            Outcome::Undecided(_) => true,
        }
    }
}

/// A lattice and what is known of it.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Known<const D: usize> {
    /// The lattice.
    pub lattice: Lattice<D>,
    /// What is known of it.
    pub class: Class,
}

impl<const D: usize> Known<D> {
    pub(super) fn new(lattice: Lattice<D>, class: Class) -> Self {
        Self { lattice, class }
    }
}
