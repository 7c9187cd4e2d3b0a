//! One record of the glove and its bytes.

use crate::joints::{SENSOR_COUNT, Sensor};

/// The longest record: head, 22 sensors, time stamp, status, two error marks, NUL.
pub const MAX_RECORD: usize = 1 + SENSOR_COUNT + TIME_STAMP_LEN + STATUS_LEN + 4 + 1;

pub(super) const TIME_STAMP_LEN: usize = 5;
pub(super) const STATUS_LEN: usize = 1;

/// Head of a record sent on request.
const POLLED: u8 = b'G';
/// Head of a record of a stream.
const STREAMED: u8 = b'S';
/// Mark of a record sampled too fast.
const TOO_FAST: [u8; 2] = *b"es";
/// Mark of a record sent while no glove was plugged in.
const NO_GLOVE: [u8; 2] = *b"eg";
/// Bit 7 of the status byte keeps it from being zero.
const STATUS_ALWAYS: u8 = 0x80;
/// Bit 7 of the flags of a time stamp keeps them from being zero.
const FLAGS_ALWAYS: u8 = 0x80;

/// Which of the two gloves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum SensorCount {
    /// The glove without sensors on the distal joints of the fingers.
    Eighteen,
    /// The fully equipped glove.
    #[default]
    TwentyTwo,
}

impl SensorCount {
    /// The number itself.
    #[must_use]
    pub const fn get(self) -> usize {
        match self {
            Self::Eighteen => 18,
            Self::TwentyTwo => SENSOR_COUNT,
        }
    }

    /// The sensors of this glove in the order of its records.
    pub fn sensors(self) -> impl Iterator<Item = Sensor> {
        Sensor::ALL
            .into_iter()
            .filter(move |sensor| self == Self::TwentyTwo || !sensor.is_distal())
    }
}

/// What the glove is set to put into its records.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct RecordFormat {
    /// How many sensor bytes a record holds.
    pub sensors: SensorCount,
    /// Whether a time stamp follows them (setting `D`).
    pub time_stamp: bool,
    /// Whether a status byte follows (setting `U`).
    pub status: bool,
}

impl RecordFormat {
    /// Length of a record without error marks and without the final NUL.
    pub(super) fn base_len(&self) -> usize {
        let time_stamp = if self.time_stamp { TIME_STAMP_LEN } else { 0 };
        let status = if self.status { STATUS_LEN } else { 0 };
        1 + self.sensors.get() + time_stamp + status
    }
}

/// The status byte.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Status {
    /// A glove is plugged into the interface unit.
    pub plugged_in: bool,
    /// The switch on the wristband is on.
    pub wrist_switch: bool,
    /// The light in the switch is on.
    pub light: bool,
}

impl Status {
    fn from_byte(byte: u8) -> Option<Self> {
        (byte & STATUS_ALWAYS != 0).then_some(Self {
            plugged_in: byte & 1 != 0,
            wrist_switch: byte & 2 != 0,
            light: byte & 4 != 0,
        })
    }

    fn to_byte(self) -> u8 {
        STATUS_ALWAYS
            | u8::from(self.plugged_in)
            | (u8::from(self.wrist_switch) << 1)
            | (u8::from(self.light) << 2)
    }
}

/// One sample of all sensors.
///
/// # Example
///
/// ```
/// use glove_io::cyberglove::{MAX_RECORD, Record};
///
/// let record = Record::try_new(&[128; 18])?;
/// let mut bytes = [0; MAX_RECORD];
/// let length = record.encode(&mut bytes);
/// assert_eq!(length, 20); // head, 18 sensors, NUL
/// assert_eq!((bytes[0], bytes[18], bytes[19]), (b'G', 128, 0));
/// # Ok::<(), glove_io::cyberglove::RecordError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Record {
    count: SensorCount,
    /// Beyond `count` all zero, so that equal records compare equal.
    values: [u8; SENSOR_COUNT],
    /// Part of a stream (`S`) rather than the answer to a request (`G`).
    pub streamed: bool,
    /// Time stamp in the device's ticks, if it sends one. The length of a tick
    /// is not documented.
    pub time_stamp: Option<u32>,
    /// Status byte, if the device sends one.
    pub status: Option<Status>,
    /// The device reports that it was asked to sample too fast (`es`).
    pub sampling_too_fast: bool,
    /// The device reports that no glove is plugged in (`eg`).
    pub glove_missing: bool,
}

impl Record {
    /// A polled record with nothing but sensor values, 18 or 22 of them.
    ///
    /// # Errors
    ///
    /// * [`RecordError::SensorCount`] if there are neither 18 nor 22 values.
    /// * [`RecordError::ZeroSensor`] if a value is zero, which the protocol
    ///   reserves for the end of a record.
    pub fn try_new(sensors: &[u8]) -> Result<Self, RecordError> {
        let count = match sensors.len() {
            18 => SensorCount::Eighteen,
            SENSOR_COUNT => SensorCount::TwentyTwo,
            found => return Err(RecordError::SensorCount { found }),
        };
        // Without an early exit the usual search, which finds nothing, is a few
        // vector instructions.
        if sensors
            .iter()
            .fold(false, |zero, &value| zero | (value == 0))
        {
            let index = sensors.iter().take_while(|&&value| value != 0).count();
            return Err(RecordError::ZeroSensor { index });
        }
        let mut values = [0; SENSOR_COUNT];
        values[..sensors.len()].copy_from_slice(sensors);
        Ok(Self {
            count,
            values,
            streamed: false,
            time_stamp: None,
            status: None,
            sampling_too_fast: false,
            glove_missing: false,
        })
    }

    /// The sensor bytes, 1–255 each, in record order: 18 or 22 of them.
    #[must_use]
    pub fn sensors(&self) -> &[u8] {
        &self.values[..self.count.get()]
    }

    /// The sensor bytes of a 22-sensor glove, ready for
    /// [`Calibration::angles`](crate::Calibration::angles); `None` for an
    /// 18-sensor glove.
    #[must_use]
    pub fn all_sensors(&self) -> Option<&[u8; SENSOR_COUNT]> {
        (self.count == SensorCount::TwentyTwo).then_some(&self.values)
    }

    /// The format a parser needs to read this record.
    #[must_use]
    pub fn format(&self) -> RecordFormat {
        RecordFormat {
            sensors: self.count,
            time_stamp: self.time_stamp.is_some(),
            status: self.status.is_some(),
        }
    }

    /// Writes the bytes the glove would send and returns how many there are.
    ///
    /// The rest of `out` is left as it was.
    pub fn encode(&self, out: &mut [u8; MAX_RECORD]) -> usize {
        encode_parts(
            self.streamed,
            self.sensors(),
            self.time_stamp,
            self.status,
            [self.sampling_too_fast, self.glove_missing],
            out,
        )
    }

    /// Reads the bytes of a record up to, but without, the final NUL.
    ///
    /// `None` if they are not exactly a record of this format.
    pub(super) fn decode(format: RecordFormat, bytes: &[u8]) -> Option<Self> {
        let (&head, rest) = bytes.split_first()?;
        let (sensors, rest) = rest.split_at_checked(format.sensors.get())?;
        let mut record = Self::try_new(sensors).ok()?;
        record.streamed = match head {
            POLLED => false,
            STREAMED => true,
            _ => return None,
        };
        let mut rest = rest;
        if format.time_stamp {
            let (stamp, after) = rest.split_first_chunk::<TIME_STAMP_LEN>()?;
            record.time_stamp = Some(decode_time_stamp(*stamp));
            rest = after;
        }
        if format.status {
            let (&status, after) = rest.split_first()?;
            record.status = Some(Status::from_byte(status)?);
            rest = after;
        }
        (record.sampling_too_fast, record.glove_missing) = match rest {
            b"" => (false, false),
            b"es" => (true, false),
            b"eg" => (false, true),
            b"eseg" => (true, true),
            _ => return None,
        };
        Some(record)
    }
}

/// Whether a byte can begin a record.
pub(super) fn is_head(byte: u8) -> bool {
    matches!(byte, POLLED | STREAMED)
}

/// Writes a record from its parts; `sensors` holds at most 22 non-zero values.
pub(crate) fn encode_parts(
    streamed: bool,
    sensors: &[u8],
    time_stamp: Option<u32>,
    status: Option<Status>,
    [too_fast, no_glove]: [bool; 2],
    out: &mut [u8; MAX_RECORD],
) -> usize {
    let mut length = 0;
    let mut put = |bytes: &[u8]| {
        out[length..length + bytes.len()].copy_from_slice(bytes);
        length += bytes.len();
    };
    put(&[if streamed { STREAMED } else { POLLED }]);
    put(sensors);
    if let Some(ticks) = time_stamp {
        put(&encode_time_stamp(ticks));
    }
    if let Some(status) = status {
        put(&[status.to_byte()]);
    }
    if too_fast {
        put(&TOO_FAST);
    }
    if no_glove {
        put(&NO_GLOVE);
    }
    put(&[0]);
    length
}

/// Bit k of the flags says that byte k, least significant first, was zero and
/// is sent as one.
fn encode_time_stamp(ticks: u32) -> [u8; TIME_STAMP_LEN] {
    let mut stamp = [FLAGS_ALWAYS; TIME_STAMP_LEN];
    for (k, byte) in ticks.to_le_bytes().into_iter().enumerate() {
        stamp[k + 1] = byte.max(1);
        stamp[0] |= u8::from(byte == 0) << k;
    }
    stamp
}

fn decode_time_stamp([flags, bytes @ ..]: [u8; TIME_STAMP_LEN]) -> u32 {
    let mut ticks = bytes;
    for (k, byte) in ticks.iter_mut().enumerate() {
        *byte ^= (flags >> k) & 1;
    }
    u32::from_le_bytes(ticks)
}

/// Why sensor values do not make a record.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum RecordError {
    /// No glove has this many sensors.
    #[error("{found} sensor values, but a record holds 18 or 22")]
    SensorCount {
        /// How many values there are.
        found: usize,
    },
    /// Sensor bytes are never zero.
    #[error("sensor value {index} (counted from 0) is zero; the glove sends 1 to 255")]
    ZeroSensor {
        /// Place of the first zero, counted from 0.
        index: usize,
    },
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    #[test]
    fn documented_time_stamp() {
        assert_eq!(
            decode_time_stamp([0x88, 0x05, 0x2C, 0x01, 0x01]),
            0x0001_2C05
        );
        assert_eq!(
            encode_time_stamp(0x0001_2C05),
            [0x88, 0x05, 0x2C, 0x01, 0x01]
        );
        // Every flag flips bit 0 of its byte, not a bit of its own.
        assert_eq!(encode_time_stamp(0), [0x8F, 1, 1, 1, 1]);
        assert_eq!(decode_time_stamp([0x8F, 1, 1, 1, 1]), 0);
    }

    #[test]
    fn documented_records() {
        let mut out = [0xAA; MAX_RECORD];
        let record = Record::try_new(&[128; 22]).unwrap();
        assert_eq!(record.encode(&mut out), 24);
        assert_eq!(out[..2], [0x47, 0x80]);
        assert_eq!(out[22..24], [0x80, 0]);

        let record = Record {
            sampling_too_fast: true,
            ..record
        };
        assert_eq!(record.encode(&mut out), 26);
        assert_eq!(out[22..26], [0x80, 0x65, 0x73, 0]);
    }

    #[test]
    fn everything_at_once_fills_the_longest_record() {
        let record = Record {
            streamed: true,
            time_stamp: Some(0xFF00_1234),
            status: Some(Status {
                plugged_in: true,
                wrist_switch: false,
                light: true,
            }),
            sampling_too_fast: true,
            glove_missing: true,
            ..Record::try_new(&[7; 22]).unwrap()
        };
        let mut out = [0; MAX_RECORD];
        assert_eq!(record.encode(&mut out), MAX_RECORD);
        assert_eq!(out[23..28], [0x84, 0x34, 0x12, 0x01, 0xFF]);
        assert_eq!(out[28..], *b"\x85eseg\0");
        let decoded = Record::decode(record.format(), &out[..MAX_RECORD - 1]);
        assert_eq!(decoded, Some(record));
    }

    #[test]
    fn eighteen_sensors_lack_the_distal_joints() {
        let sensors: Vec<_> = SensorCount::Eighteen.sensors().collect();
        assert_eq!(sensors.len(), 18);
        assert_eq!(sensors[5], Sensor::IndexPip);
        assert_eq!(sensors[6], Sensor::MiddleMcp);
        assert_eq!(sensors[17], Sensor::WristYaw);
        assert_eq!(SensorCount::TwentyTwo.sensors().count(), 22);
    }

    #[test]
    fn impossible_records_are_refused() {
        assert_eq!(
            Record::try_new(&[1; 20]),
            Err(RecordError::SensorCount { found: 20 })
        );
        let mut values = [9; 18];
        values[4] = 0;
        assert_eq!(
            Record::try_new(&values),
            Err(RecordError::ZeroSensor { index: 4 })
        );
    }
}
