//! Does a deformation fold? Through the public interface, against exact arithmetic.
//!
//! | module | |
//! |---|---|
//! | `oracle` | the map, its Jacobian and its signs in fractions and integers; `oracle_facts` tests it |
//! | `claims` | holds every word of a verdict against the oracle |
//! | `families` | random lattices, and such as touch zero or overlap by construction |
//! | `laws`, `named` | what holds for any lattice, and what must be said of some |
//! | `strategies` | those for users keep what they promise |
//! | `regressions` | what once went wrong |
//! | `certificates` | what can be proven of them again, and what cannot |
//! | `safe_step` | how far a lattice can go, against exact values on the way |
//! | `bulk` | many random lattices, a hundred thousand in the long form |

#![allow(
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    clippy::cast_sign_loss,
    clippy::float_cmp,
    clippy::needless_range_loop,
    reason = "small numbers; what must be equal is compared; indices as in the formulas"
)]

mod bulk;
mod certificates;
mod claims;
#[path = "../common/mod.rs"]
mod common;
mod families;
mod laws;
mod named;
mod oracle;
mod oracle_facts;
mod regressions;
mod safe_step;
mod strategies;
