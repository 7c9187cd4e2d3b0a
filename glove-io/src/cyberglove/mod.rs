//! The serial protocol of the CyberGlove I and II, and the 16-bit packets of the
//! III.
//!
//! The glove answers `G` with one record and `S` with a stream of them until
//! it receives Ctrl-C. A record is
//!
//! ```text
//! 'G' or 'S' | 18 or 22 sensor bytes | [time stamp, 5] | [status, 1] | ["es"] | ["eg"] | NUL
//! ```
//!
//! What is in brackets depends on the settings of the glove ([`RecordFormat`]),
//! except for the error marks, which appear when there is something to report.
//! Queries (`?` and a letter) and settings (a letter and a value) have replies
//! of known length, see [`parse_reply`].
//!
//! # Telling records apart
//!
//! The protocol goes out of its way to keep zeros out of a record: the firmware
//! raises sensor values to at least 1, bytes of the time stamp that would be
//! zero are sent as 1 and flagged, and bit 7 of the status byte is always set.
//! So, unlike in a reply, the only NUL of a record is its last byte, and
//! [`Parser`] accepts the bytes between two NULs if they have *exactly* the
//! length of a record. `G` and `S` are legal sensor values and prove nothing
//! alone.
//!
//! # Packets of the CyberGlove III
//!
//! The III also answers `1G` with one packet of 61 bytes and `1S` with the echo
//! of the command and a stream of them ([`Packet`], [`PacketParser`]):
//!
//! ```text
//! HH:MM:SS:FF:nS | 22 big-endian 16-bit values, 12 bits each | 3 bytes
//! ```
//!
//! # Limits
//!
//! ASCII records (`g`, `s`), records shortened by a software mask, the other
//! commands of the CyberGlove III and CyberTouch are not covered.
//!
//! # References
//!
//! * Virtual Technologies, *CyberGlove Reference Manual*, 1998.
//! * Immersion, *CyberGlove III Wireless Data Glove Programmer's Guide*.

mod packet;
mod parser;
mod period;
mod record;
mod reply;

pub use packet::{PACKET_LEN, Packet, PacketError, PacketParser, TimeCode};
pub use parser::Parser;
pub use period::{SamplePeriod, WordOrder};
pub use record::{MAX_RECORD, Record, RecordError, RecordFormat, SensorCount, Status};
pub use reply::{DeviceError, Query, Reply, ReplyError, Setting, SettingLetter, parse_reply};

#[cfg(feature = "sim")]
pub(crate) use record::encode_parts;
