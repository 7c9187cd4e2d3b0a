//! Data records of the Polhemus FASTRAK electromagnetic tracker.
//!
//! One transmitter defines the frame; up to four receivers, called stations,
//! are located in it. The tracker sends one record per active station for each
//! `P`, or without end after `C`. A record is
//!
//! ```text
//! '0' | station '1'..'4' | error letter or blank | items of the output list
//! ```
//!
//! in text of fixed width ([`Encoding::Ascii`]) or with little-endian
//! single-precision floats ([`Encoding::Binary`]). Neither has a checksum, and
//! fields of the text may touch (`-12.34-100.20`), so both are cut by width.
//!
//! # Conventions
//!
//! A [`Record`] holds SI units in the *transmitter's* frame: x forward (away
//! from its cable), y right, z down. [`Record::to_world`] turns it into a
//! [`Pose`](crate::Pose) in the world frame of this crate.
//!
//! # Limits
//!
//! Supported items are blank, CR LF, position, angles and quaternion
//! ([`Item`]), the same for all stations. Direction cosines, extended precision,
//! the 14-bit form, stylus switch and increments are not covered, nor are
//! status and readback records (first byte `2`): the parser drops them.
//!
//! # References
//!
//! * Polhemus, *3SPACE FASTRAK User Manual*, Rev. G, 2012.
//! * VRPN, `vrpn_Tracker_Fastrak`, for what a long-lived client relies on.

mod angles;
mod field;
mod format;
mod parser;
mod record;

pub use format::{
    Encoding, Item, MAX_ITEMS, MAX_RECORD, OutputList, OutputListError, RecordFormat, Units,
};
pub use parser::Parser;
pub use record::{EncodeError, Record, Station};
