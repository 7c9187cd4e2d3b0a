//! Queries, settings and the replies to them.
//!
//! A query is `?` and a letter, its reply `?`, the letter, a payload and NUL.
//! A setting is a letter and a payload, its reply the letter and NUL. Payloads
//! are binary and may contain zeros, so a reply is read by its known length.

use super::period::{SamplePeriod, WordOrder};

/// What one can ask the glove.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Query {
    /// `?G`: is the glove initialised and plugged in?
    GloveState,
    /// `?S`: how many sensors does it have?
    SensorsPresent,
    /// `?N`: how many of them does it sample?
    SensorsSampled,
    /// `?K`: which slots have a sensor?
    HardwareMask,
    /// `?M`: which slots may appear in a record?
    SoftwareMask,
    /// `?R`: is it a right hand?
    RightHand,
    /// `?U`: do records carry a status byte?
    StatusByte,
    /// `?D`: do records carry a time stamp?
    TimeStamp,
    /// `?W`: is the switch on the wristband on?
    WristSwitch,
    /// `?T`: how often does it sample?
    SamplePeriod,
    /// `?V`: versions of firmware and glove.
    Version,
}

impl Query {
    /// All queries.
    pub const ALL: [Self; 11] = [
        Self::GloveState,
        Self::SensorsPresent,
        Self::SensorsSampled,
        Self::HardwareMask,
        Self::SoftwareMask,
        Self::RightHand,
        Self::StatusByte,
        Self::TimeStamp,
        Self::WristSwitch,
        Self::SamplePeriod,
        Self::Version,
    ];

    /// The letter after the question mark.
    #[must_use]
    pub const fn letter(self) -> u8 {
        match self {
            Self::GloveState => b'G',
            Self::SensorsPresent => b'S',
            Self::SensorsSampled => b'N',
            Self::HardwareMask => b'K',
            Self::SoftwareMask => b'M',
            Self::RightHand => b'R',
            Self::StatusByte => b'U',
            Self::TimeStamp => b'D',
            Self::WristSwitch => b'W',
            Self::SamplePeriod => b'T',
            Self::Version => b'V',
        }
    }

    /// The query with this letter, if there is one.
    #[must_use]
    pub fn from_letter(letter: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|query| query.letter() == letter)
    }

    /// The two bytes to send.
    #[must_use]
    pub const fn command(self) -> [u8; 2] {
        [b'?', self.letter()]
    }

    /// Number of bytes between the letter and the NUL of the reply.
    #[must_use]
    pub const fn payload_len(self) -> usize {
        match self {
            Self::HardwareMask | Self::SoftwareMask => 3,
            Self::SamplePeriod | Self::Version => 4,
            _ => 1,
        }
    }
}

/// The settings this crate knows, without their values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SettingLetter {
    /// `U`: status byte in records.
    StatusByte,
    /// `D`: time stamp in records.
    TimeStamp,
    /// `N`: number of sensors sampled.
    SensorsSampled,
    /// `M`: software mask.
    SoftwareMask,
    /// `T`: sample period.
    SamplePeriod,
}

impl SettingLetter {
    /// All settings.
    pub const ALL: [Self; 5] = [
        Self::StatusByte,
        Self::TimeStamp,
        Self::SensorsSampled,
        Self::SoftwareMask,
        Self::SamplePeriod,
    ];

    /// The letter the command begins with.
    #[must_use]
    pub const fn letter(self) -> u8 {
        match self {
            Self::StatusByte => b'U',
            Self::TimeStamp => b'D',
            Self::SensorsSampled => b'N',
            Self::SoftwareMask => b'M',
            Self::SamplePeriod => b'T',
        }
    }

    /// The setting with this letter, if there is one.
    #[must_use]
    pub fn from_letter(letter: u8) -> Option<Self> {
        Self::ALL
            .into_iter()
            .find(|setting| setting.letter() == letter)
    }

    /// Number of bytes after the letter.
    #[must_use]
    pub const fn payload_len(self) -> usize {
        match self {
            Self::SoftwareMask => 3,
            Self::SamplePeriod => 4,
            _ => 1,
        }
    }
}

/// A setting and its value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Setting {
    /// Put a status byte into records.
    StatusByte(bool),
    /// Put a time stamp into records.
    TimeStamp(bool),
    /// Sample this many sensors.
    SensorsSampled(u8),
    /// Allow these slots in a record; bit k is slot k.
    SoftwareMask(u32),
    /// Sample once per period.
    SamplePeriod(SamplePeriod, WordOrder),
}

impl Setting {
    /// Writes the command and returns its length; the rest of `out` is left as
    /// it was. Bits of a mask beyond the 24 slots are not sent.
    pub fn encode(self, out: &mut [u8; 5]) -> usize {
        let (letter, payload) = match self {
            Self::StatusByte(on) => (SettingLetter::StatusByte, [u8::from(on), 0, 0, 0]),
            Self::TimeStamp(on) => (SettingLetter::TimeStamp, [u8::from(on), 0, 0, 0]),
            Self::SensorsSampled(count) => (SettingLetter::SensorsSampled, [count, 0, 0, 0]),
            Self::SoftwareMask(slots) => {
                let [low, middle, high, _] = slots.to_le_bytes();
                (SettingLetter::SoftwareMask, [low, middle, high, 0])
            }
            Self::SamplePeriod(period, order) => {
                (SettingLetter::SamplePeriod, period.to_bytes(order))
            }
        };
        let len = letter.payload_len();
        out[0] = letter.letter();
        out[1..=len].copy_from_slice(&payload[..len]);
        1 + len
    }
}

/// What the glove answers to a query or a setting.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Reply {
    /// To `?G`.
    GloveState {
        /// The glove has been initialised.
        initialised: bool,
        /// The glove is plugged in.
        plugged_in: bool,
    },
    /// To `?S`: 18 or 22.
    SensorsPresent(u8),
    /// To `?N`.
    SensorsSampled(u8),
    /// To `?K`; bit k is slot k.
    HardwareMask(u32),
    /// To `?M`; bit k is slot k.
    SoftwareMask(u32),
    /// To `?R`.
    RightHand(bool),
    /// To `?U`.
    StatusByte(bool),
    /// To `?D`.
    TimeStamp(bool),
    /// To `?W`.
    WristSwitch(bool),
    /// To `?T`, for [`SamplePeriod::from_bytes`].
    SamplePeriod([u8; 4]),
    /// To `?V`: firmware major and minor, glove major and minor.
    Version([u8; 4]),
    /// A setting was taken.
    Accepted(SettingLetter),
    /// A command was refused.
    Refused(DeviceError),
}

/// Error messages of the glove that stand alone.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum DeviceError {
    /// `e?`: unknown command.
    UnknownCommand,
    /// `en`: a number is out of range, or there are too many.
    BadNumber,
    /// `ey`: synchronisation input too fast.
    SyncTooFast,
}

impl DeviceError {
    /// What it means, for a message.
    #[must_use]
    pub const fn meaning(self) -> &'static str {
        match self {
            Self::UnknownCommand => "unknown command",
            Self::BadNumber => "a number is out of range, or there are too many",
            Self::SyncTooFast => "synchronisation input too fast",
        }
    }
}

/// The bytes are not a reply.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ReplyError {
    /// No known reply begins like this.
    #[error("no known reply begins with byte {head:#04x}")]
    Unknown {
        /// The first byte, or the second of a `?` or `e` reply.
        head: u8,
    },
    /// A reply does not end in NUL where it should.
    #[error("the reply ends in byte {found:#04x} where a NUL belongs")]
    NoNul {
        /// The byte in its place.
        found: u8,
    },
}

/// Reads one reply from the front of `bytes`.
///
/// Returns the reply and how many bytes it takes, or `None` as long as it is
/// incomplete.
///
/// # Errors
///
/// * [`ReplyError::Unknown`] if the first bytes begin no reply.
/// * [`ReplyError::NoNul`] if there is no NUL where the reply should end.
///
/// # Example
///
/// ```
/// use glove_io::cyberglove::{Reply, parse_reply};
///
/// assert_eq!(
///     parse_reply(b"?K\x7F\xFF\x7F\0?W"),
///     Ok(Some((Reply::HardwareMask(0x7F_FF7F), 6)))
/// );
/// // The zero is payload: the reply is still incomplete.
/// assert_eq!(parse_reply(b"?W\0"), Ok(None));
/// ```
pub fn parse_reply(bytes: &[u8]) -> Result<Option<(Reply, usize)>, ReplyError> {
    let Some((&head, rest)) = bytes.split_first() else {
        return Ok(None);
    };
    let (reply, len) = match head {
        b'?' | b'e' => {
            let Some((&letter, rest)) = rest.split_first() else {
                return Ok(None);
            };
            let unknown = ReplyError::Unknown { head: letter };
            if head == b'e' {
                (Reply::Refused(device_error(letter).ok_or(unknown)?), 2)
            } else {
                let query = Query::from_letter(letter).ok_or(unknown)?;
                let Some(payload) = rest.get(..query.payload_len()) else {
                    return Ok(None);
                };
                (answer(query, payload), 2 + payload.len())
            }
        }
        letter => {
            let setting =
                SettingLetter::from_letter(letter).ok_or(ReplyError::Unknown { head: letter })?;
            (Reply::Accepted(setting), 1)
        }
    };
    match bytes.get(len) {
        None => Ok(None),
        Some(0) => Ok(Some((reply, len + 1))),
        Some(&found) => Err(ReplyError::NoNul { found }),
    }
}

fn device_error(letter: u8) -> Option<DeviceError> {
    match letter {
        b'?' => Some(DeviceError::UnknownCommand),
        b'n' => Some(DeviceError::BadNumber),
        b'y' => Some(DeviceError::SyncTooFast),
        _ => None,
    }
}

/// Interprets a payload of the length the query promises.
fn answer(query: Query, payload: &[u8]) -> Reply {
    let mut bytes = [0; 4];
    bytes[..payload.len()].copy_from_slice(payload);
    let first = bytes[0];
    let number = u32::from_le_bytes(bytes);
    match query {
        Query::GloveState => Reply::GloveState {
            initialised: first & 1 != 0,
            plugged_in: first & 2 != 0,
        },
        Query::SensorsPresent => Reply::SensorsPresent(first),
        Query::SensorsSampled => Reply::SensorsSampled(first),
        Query::HardwareMask => Reply::HardwareMask(number),
        Query::SoftwareMask => Reply::SoftwareMask(number),
        Query::RightHand => Reply::RightHand(first != 0),
        Query::StatusByte => Reply::StatusByte(first != 0),
        Query::TimeStamp => Reply::TimeStamp(first != 0),
        Query::WristSwitch => Reply::WristSwitch(first != 0),
        Query::SamplePeriod => Reply::SamplePeriod(bytes),
        Query::Version => Reply::Version(bytes),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn payloads_may_contain_zeros() {
        assert_eq!(
            parse_reply(b"?V\x02\0\x01\0\0"),
            Ok(Some((Reply::Version([2, 0, 1, 0]), 7)))
        );
        assert_eq!(parse_reply(b"?V\x02\0\x01\0"), Ok(None));
        assert_eq!(
            parse_reply(b"?W\x01\0"),
            Ok(Some((Reply::WristSwitch(true), 4)))
        );
    }

    #[test]
    fn settings_and_their_acknowledgement() {
        let mut out = [0xAA; 5];
        assert_eq!(Setting::SensorsSampled(18).encode(&mut out), 2);
        assert_eq!(out[..2], [0x4E, 0x12]);
        assert_eq!(Setting::SoftwareMask(0x7B_BB3F).encode(&mut out), 4);
        assert_eq!(out[..4], [b'M', 0x3F, 0xBB, 0x7B]);
        assert_eq!(
            parse_reply(b"N\0"),
            Ok(Some((Reply::Accepted(SettingLetter::SensorsSampled), 2)))
        );
        assert_eq!(
            parse_reply(b"e?\0"),
            Ok(Some((Reply::Refused(DeviceError::UnknownCommand), 3)))
        );
    }

    #[test]
    fn every_prefix_is_incomplete_and_damage_is_named() {
        for query in Query::ALL {
            let mut reply = [0; 8];
            reply[..2].copy_from_slice(&query.command());
            let len = 3 + query.payload_len();
            for cut in 0..len {
                assert_eq!(
                    parse_reply(&reply[..cut]),
                    Ok(None),
                    "{query:?}, {cut} bytes"
                );
            }
            assert!(matches!(parse_reply(&reply), Ok(Some((_, n))) if n == len));
            reply[len - 1] = 9;
            assert_eq!(parse_reply(&reply), Err(ReplyError::NoNul { found: 9 }));
        }
        assert_eq!(parse_reply(b"x"), Err(ReplyError::Unknown { head: b'x' }));
        assert_eq!(parse_reply(b"?!"), Err(ReplyError::Unknown { head: b'!' }));
    }
}
