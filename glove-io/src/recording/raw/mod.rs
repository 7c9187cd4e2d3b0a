//! Recording the bytes of all devices with their times, and replaying them.
//!
//! One file holds every device of a session: what each sent, what it was sent,
//! how it was set up, and notes. A reader gets back exactly the bytes and the
//! times that were recorded, so that a replay goes through the same parsers as
//! the devices did.
//!
//! [`RawRecorder`] writes, [`RawReader`] reads, and [`Player`] says when each
//! chunk is due at any speed. None of them keeps time, sleeps or opens a file.
//!
//! # Format, version 1
//!
//! All numbers are little-endian. The file begins with 24 bytes:
//!
//! | bytes | content |
//! |---|---|
//! | 8 | `89 47 52 41 57 0D 0A 1A`: a byte that is no ASCII, `GRAW`, CR LF, Ctrl-Z |
//! | 4 | version, 1 |
//! | 8 | wall clock at the start, nanoseconds since 1970 (UTC), for information |
//! | 4 | CRC-32 of the 20 bytes before |
//!
//! Chunks follow, each of them
//!
//! | bytes | content |
//! |---|---|
//! | 4 | `A7 43 4B 9C`, by which a reader finds its place again |
//! | 1 | kind: 0 from the device, 1 to the device, 2 note, 3 description |
//! | 1 | device, numbered by the recorder |
//! | 2 | length n of the payload |
//! | 8 | time, nanoseconds of a monotonic clock |
//! | 4 | CRC-32 of the 16 bytes before |
//! | n | payload |
//! | 4 | CRC-32 of the payload |
//!
//! A note is UTF-8. A description is UTF-8 too: the kind of device, and then
//! one line `key=value` per setting ([`DeviceDescription`]).
//!
//! # What damage does
//!
//! * A writer that dies leaves at most one unfinished chunk at the end. Readers
//!   give all chunks before it and count its bytes
//!   ([`RawReader::torn_bytes`]); [`RawRecorder::append`] cuts it off.
//! * CRC-32 finds every change of up to 32 neighbouring bits, one byte
//!   included; other damage escapes it with a chance of 2⁻³². The header has a
//!   sum of its own, so that a damaged length cannot pass for an unfinished
//!   chunk.
//! * A reader reports damage with its place ([`RawError::Damaged`]), and goes on
//!   with the next chunk that is whole.
//!
//! # Example
//!
//! ```
//! use glove_io::recording::raw::{Chunk, Content, DeviceDescription, RawReader, RawRecorder};
//!
//! let mut recorder = RawRecorder::new(Vec::new(), 0)?;
//! let glove = DeviceDescription::new("cyberglove").with("sensors", "22");
//! recorder.record(&Chunk { device: 0, time_ns: 0, content: Content::Description(glove) })?;
//! let bytes = b"G\x80\x81";
//! recorder.record(&Chunk { device: 0, time_ns: 1_000, content: Content::FromDevice(bytes) })?;
//! let file = recorder.into_inner();
//!
//! let mut reader = RawReader::new(file.as_slice())?;
//! let mut received = Vec::new();
//! while let Some(chunk) = reader.next_chunk()? {
//!     match chunk.content {
//!         Content::Description(device) => assert_eq!(device.setting("sensors"), Some("22")),
//!         Content::FromDevice(bytes) => received.extend_from_slice(bytes),
//!         _ => {}
//!     }
//! }
//! assert_eq!(received, bytes);
//! # Ok::<(), glove_io::recording::raw::RawError>(())
//! ```

mod description;
mod format;
mod player;
mod reader;
mod recorder;

pub use description::DeviceDescription;
pub use player::{Due, Player};
pub use reader::RawReader;
pub use recorder::{Appended, RawRecorder};

use std::io;

/// The longest payload of a chunk in bytes.
pub const MAX_PAYLOAD: usize = u16::MAX as usize;

/// One entry of a recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Chunk<'a> {
    /// The device it belongs to. The recorder chooses the numbers; a
    /// description says what is behind them.
    pub device: u8,
    /// Nanoseconds of a monotonic clock, the same for all devices. Its zero is
    /// up to the recorder. Of bytes from a device: when the first of them came.
    pub time_ns: u64,
    /// What happened.
    pub content: Content<'a>,
}

/// What a chunk holds.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Content<'a> {
    /// Bytes that came from the device.
    FromDevice(&'a [u8]),
    /// Bytes that were sent to the device.
    ToDevice(&'a [u8]),
    /// A remark, such as "the user closes the hand" or "port reopened".
    Note(&'a str),
    /// What the device is and how it is set up from now on.
    Description(DeviceDescription),
}

/// What is wrong with a part of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Damage {
    /// There is no mark of a chunk.
    Mark,
    /// Kind, device, length and time do not match their checksum.
    Header,
    /// The payload does not match its checksum.
    Payload,
    /// The checksums are right, but the kind is none of version 1.
    Kind,
    /// The checksums are right, but a note or description is not in its form.
    Text,
}

impl std::fmt::Display for Damage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Mark => "no chunk begins here",
            Self::Header => "the header of the chunk does not match its checksum",
            Self::Payload => "the payload of the chunk does not match its checksum",
            Self::Kind => "a chunk of unknown kind",
            Self::Text => "a note or description in no known form",
        })
    }
}

/// Why a recording cannot be written or read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RawError {
    /// The file does not begin like a recording.
    #[error("this is not a recording of raw bytes: it does not begin with their mark")]
    NotARecording,
    /// The first 24 bytes do not match their checksum.
    #[error("the header of the recording (the first 24 bytes) does not match its checksum")]
    DamagedHeader,
    /// The file ends within its first 24 bytes.
    #[error("the recording ends after {len} bytes, within its header of 24")]
    NoHeader {
        /// How many bytes there are.
        len: usize,
    },
    /// A newer version of the format.
    #[error("the recording has version {version} of the format; this reader knows version 1")]
    Version {
        /// The version of the file.
        version: u32,
    },
    /// A part of the file is damaged. Reading may go on: the next call returns
    /// the next chunk that is whole.
    #[error("the recording is damaged at byte {offset}: {damage}")]
    Damaged {
        /// Place in the file, in bytes from its beginning.
        offset: u64,
        /// What is wrong there.
        damage: Damage,
    },
    /// A payload is longer than a chunk can hold. Nothing was written.
    #[error("{len} bytes are too many for one chunk, which holds 65535")]
    TooLong {
        /// How many bytes there are.
        len: usize,
    },
    /// A description has a line break or an empty or ambiguous name. Nothing was
    /// written.
    #[error("{text:?} cannot be part of a description: empty, or with a line break or `=`")]
    BadDescription {
        /// The offending kind, key or value.
        text: String,
    },
    /// A speed of replay that is not positive.
    #[error("{speed} is no speed of replay: it must be positive")]
    Speed {
        /// The speed.
        speed: f64,
    },
    /// Reading or writing failed.
    #[error(transparent)]
    Io(#[from] io::Error),
}
