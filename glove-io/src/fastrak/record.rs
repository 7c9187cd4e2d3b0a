//! One data record: its bytes, and its pose in the world.

use core::f64::consts::PI;

use super::format::{Encoding, HEADER_LEN, Item, MAX_RECORD, RecordFormat};
use super::{angles, field};
use crate::math::to_single;
use crate::{Pose, Quaternion};

/// First byte of a data record.
const DATA: u8 = b'0';
/// Decimals of positions and angles in text.
const LENGTH_DECIMALS: usize = 2;
/// Decimals of quaternions in text.
const UNIT_DECIMALS: usize = 4;
/// Degrees beyond a full turn are damage; this also bounds the arguments of
/// the trigonometry.
const FULL_TURN_DEG: f64 = 360.0;

/// One of the four receiver ports.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub enum Station {
    /// The first port.
    #[default]
    One,
    /// The second port.
    Two,
    /// The third port.
    Three,
    /// The fourth port.
    Four,
}

impl Station {
    /// All stations in the order of their records.
    pub const ALL: [Self; 4] = [Self::One, Self::Two, Self::Three, Self::Four];

    /// The number on the port, 1–4.
    #[must_use]
    pub const fn number(self) -> u8 {
        self as u8 + 1
    }

    /// The station with this number, if it is one of 1–4.
    #[must_use]
    pub fn from_number(number: u8) -> Option<Self> {
        Self::ALL
            .into_iter()
            .find(|station| station.number() == number)
    }
}

/// One sample of one receiver, in the transmitter's frame.
///
/// The frame has x forward, y right and z *down*. What the output list does not
/// contain is `None`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Record {
    /// The receiver.
    pub station: Station,
    /// The letter of an error the tracker reports, for example `x` outside the
    /// position envelope. Anything but an ASCII letter is sent as no error.
    pub error: Option<u8>,
    /// Position of the receiver in metres.
    pub position_m: Option<[f64; 3]>,
    /// Rotation from the receiver's axes to the transmitter's.
    ///
    /// A quaternion as it was sent: its length is one up to the printed digits.
    /// If the output list has angles only, it is computed from them; if it has
    /// both, the quaternion is taken.
    pub orientation: Option<Quaternion>,
}

impl Record {
    /// The pose in the world frame, which has x right, y up and −z forward.
    ///
    /// With transmitter and world looking in the same direction,
    /// `(X, Y, Z) = (y, −z, −x)`. The receiver's axes map in the same way, so a
    /// receiver aligned with the transmitter has no rotation. The quaternion is
    /// normalised. `None` if position or orientation is missing, or if the
    /// quaternion has no direction.
    ///
    /// # Example
    ///
    /// ```
    /// use glove_io::Quaternion;
    /// use glove_io::fastrak::{Record, Station};
    ///
    /// let record = Record {
    ///     station: Station::One,
    ///     error: None,
    ///     position_m: Some([0.4, 0.1, -0.2]), // forward, right, above
    ///     orientation: Some(Quaternion::IDENTITY),
    /// };
    /// assert_eq!(record.to_world().unwrap().position_m, [0.1, 0.2, -0.4]);
    /// ```
    #[must_use]
    pub fn to_world(&self) -> Option<Pose> {
        let position = self.position_m?;
        let q = self.orientation?.normalized()?;
        let [qx, qy, qz] = vector_to_world([q.x, q.y, q.z]);
        Some(Pose {
            position_m: vector_to_world(position),
            orientation: Quaternion {
                x: qx,
                y: qy,
                z: qz,
                w: q.w,
            },
        })
    }

    /// The record, without error, of a receiver at this pose: the inverse of
    /// [`to_world`](Self::to_world).
    #[must_use]
    pub fn from_world(station: Station, pose: &Pose) -> Self {
        let q = pose.orientation;
        let [x, y, z] = vector_from_world([q.x, q.y, q.z]);
        Self {
            station,
            error: None,
            position_m: Some(vector_from_world(pose.position_m)),
            orientation: Some(Quaternion { x, y, z, w: q.w }),
        }
    }

    /// Writes the bytes the tracker would send and returns how many there are.
    ///
    /// Text rounds positions and angles to 0.01 and quaternions to 0.0001;
    /// binary rounds to single precision.
    ///
    /// # Errors
    ///
    /// `out` is then partly written.
    ///
    /// * [`EncodeError::Missing`] if the format has an item that the record
    ///   lacks.
    /// * [`EncodeError::OutOfRange`] if a number is not finite or does not fit
    ///   its field, or if angles are asked for and the quaternion is zero.
    pub fn encode(
        &self,
        format: &RecordFormat,
        out: &mut [u8; MAX_RECORD],
    ) -> Result<usize, EncodeError> {
        let error = self.error.filter(u8::is_ascii_alphabetic);
        out[..HEADER_LEN].copy_from_slice(&[
            DATA,
            b'0' + self.station.number(),
            error.unwrap_or(b' '),
        ]);
        let mut writer = Writer {
            out,
            len: HEADER_LEN,
            encoding: format.encoding,
        };
        for &item in format.items.items() {
            let missing = EncodeError::Missing { item };
            match item {
                Item::Space => writer.bytes(b" "),
                Item::CrLf => writer.bytes(b"\r\n"),
                Item::Position => {
                    let position = self.position_m.ok_or(missing)?;
                    let in_units = position.map(|x| x / format.units.metres());
                    writer.numbers(item, &in_units, LENGTH_DECIMALS)?;
                }
                Item::Angles => {
                    let q = self.orientation.ok_or(missing)?;
                    let q = q.normalized().ok_or(EncodeError::OutOfRange { item })?;
                    let degrees = angles::from_quaternion(q).map(|rad| rad * (180.0 / PI));
                    writer.numbers(item, &degrees, LENGTH_DECIMALS)?;
                }
                Item::Quaternion => {
                    let q = self.orientation.ok_or(missing)?;
                    writer.numbers(item, &[q.w, q.x, q.y, q.z], UNIT_DECIMALS)?;
                }
            }
        }
        Ok(writer.len)
    }

    /// Reads a record of exactly the length of the format; `None` if a byte is
    /// not what it has to be.
    pub(super) fn decode(format: &RecordFormat, bytes: &[u8]) -> Option<Self> {
        let (&[DATA, station, error], rest) = bytes.split_first_chunk::<HEADER_LEN>()? else {
            return None;
        };
        let mut record = Self {
            station: Station::from_number(station.wrapping_sub(b'0'))?,
            error: Some(error).filter(u8::is_ascii_alphabetic),
            position_m: None,
            orientation: None,
        };
        let mut from_angles = None;
        let mut reader = Reader {
            rest,
            encoding: format.encoding,
        };
        for item in format.items.items() {
            match item {
                Item::Space => reader.literal(b" ")?,
                Item::CrLf => reader.literal(b"\r\n")?,
                Item::Position => {
                    let position = reader.numbers::<3>(LENGTH_DECIMALS)?;
                    record.position_m = Some(position.map(|x| x * format.units.metres()));
                }
                Item::Angles => {
                    let degrees = reader.numbers::<3>(LENGTH_DECIMALS)?;
                    if degrees.iter().any(|angle| angle.abs() > FULL_TURN_DEG) {
                        return None;
                    }
                    let radians = degrees.map(|angle| angle * (PI / 180.0));
                    from_angles = Some(angles::to_quaternion(radians));
                }
                Item::Quaternion => {
                    let [w, x, y, z] = reader.numbers(UNIT_DECIMALS)?;
                    record.orientation = Some(Quaternion { x, y, z, w });
                }
            }
        }
        record.orientation = record.orientation.or(from_angles);
        reader.rest.is_empty().then_some(record)
    }
}

/// Whether `bytes` may be the beginning of a data record.
pub(super) fn may_begin_record(bytes: &[u8]) -> bool {
    bytes
        .iter()
        .take(HEADER_LEN)
        .enumerate()
        .all(|(place, &byte)| match place {
            0 => byte == DATA,
            1 => matches!(byte, b'1'..=b'4'),
            _ => byte == b' ' || byte.is_ascii_alphabetic(),
        })
}

/// Transmitter axes (forward, right, down) to world axes (right, up, back).
fn vector_to_world([x, y, z]: [f64; 3]) -> [f64; 3] {
    [y, -z, -x]
}

/// The inverse of [`vector_to_world`].
fn vector_from_world([x, y, z]: [f64; 3]) -> [f64; 3] {
    [-z, x, -y]
}

struct Writer<'a> {
    out: &'a mut [u8; MAX_RECORD],
    len: usize,
    encoding: Encoding,
}

impl Writer<'_> {
    fn bytes(&mut self, bytes: &[u8]) {
        self.out[self.len..self.len + bytes.len()].copy_from_slice(bytes);
        self.len += bytes.len();
    }

    fn numbers(&mut self, item: Item, values: &[f64], decimals: usize) -> Result<(), EncodeError> {
        for &value in values {
            match self.encoding {
                Encoding::Ascii => {
                    let mut text = [0; field::WIDTH];
                    field::write(&mut text, value, decimals)
                        .ok_or(EncodeError::OutOfRange { item })?;
                    self.bytes(&text);
                }
                Encoding::Binary => {
                    let single = to_single(value);
                    if !single.is_finite() {
                        return Err(EncodeError::OutOfRange { item });
                    }
                    self.bytes(&single.to_le_bytes());
                }
            }
        }
        Ok(())
    }
}

struct Reader<'a> {
    rest: &'a [u8],
    encoding: Encoding,
}

impl Reader<'_> {
    fn literal(&mut self, expected: &[u8]) -> Option<()> {
        self.rest = self.rest.strip_prefix(expected)?;
        Some(())
    }

    fn numbers<const N: usize>(&mut self, decimals: usize) -> Option<[f64; N]> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = match self.encoding {
                Encoding::Ascii => {
                    let (text, rest) = self.rest.split_first_chunk::<{ field::WIDTH }>()?;
                    self.rest = rest;
                    field::read(*text, decimals)?
                }
                Encoding::Binary => {
                    let (bytes, rest) = self.rest.split_first_chunk::<4>()?;
                    self.rest = rest;
                    f64::from(f32::from_le_bytes(*bytes))
                }
            };
            if !value.is_finite() {
                return None;
            }
        }
        Some(values)
    }
}

/// Why a record cannot be sent in a format.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum EncodeError {
    /// The output list has an item that the record does not have.
    #[error("the output list asks for {item:?}, which the record lacks")]
    Missing {
        /// The item.
        item: Item,
    },
    /// A number does not fit the item.
    #[error("{item:?} is not finite, or too large for its field")]
    OutOfRange {
        /// The item.
        item: Item,
    },
}

#[cfg(test)]
mod tests {
    use super::super::format::{OutputList, Units};
    use super::*;
    use proptest::prelude::*;

    fn pose() -> Record {
        Record {
            station: Station::One,
            error: None,
            position_m: Some([12.34, -5.6, 0.07].map(|inches| inches * 0.0254)),
            orientation: Some(angles::to_quaternion(
                [30.0, 20.0, 10.0].map(f64::to_radians),
            )),
        }
    }

    fn format(items: &[Item], encoding: Encoding) -> RecordFormat {
        RecordFormat {
            items: OutputList::try_new(items).unwrap(),
            encoding,
            units: Units::Inches,
        }
    }

    #[test]
    fn documented_text() {
        let mut out = [0; MAX_RECORD];
        let format_angles = RecordFormat::default();
        let len = pose().encode(&format_angles, &mut out).unwrap();
        let expected = b"01   12.34  -5.60   0.07  30.00  20.00  10.00\r\n";
        assert_eq!(&out[..len], expected);
        let decoded = Record::decode(&format_angles, expected).unwrap();
        assert_eq!(decoded.position_m, pose().position_m);

        let format_quaternion = format(&[Item::Quaternion, Item::CrLf], Encoding::Ascii);
        let len = pose().encode(&format_quaternion, &mut out).unwrap();
        assert_eq!(&out[..len], b"01  0.9515 0.0381 0.1893 0.2393\r\n");
    }

    #[test]
    fn documented_binary() {
        let bytes = [
            0x30, 0x31, 0x20, // header
            0x00, 0x00, 0x20, 0x41, 0x00, 0x00, 0x20, 0xC0, 0x00, 0x00, 0x00,
            0x3F, // position
            0xAF, 0x98, 0x73, 0x3F, 0x00, 0x33, 0x1C, 0x3D, // quaternion
            0xEB, 0xD9, 0x41, 0x3E, 0xA0, 0x0A, 0x75, 0x3E, 0x20,
        ];
        let format = format(
            &[Item::Position, Item::Quaternion, Item::Space],
            Encoding::Binary,
        );
        let record = Record::decode(&format, &bytes).unwrap();
        assert_eq!(
            record.position_m,
            Some([10.0, -2.5, 0.5].map(|inches: f64| inches * 0.0254))
        );
        let found = record.orientation.unwrap();
        let expected = pose().orientation.unwrap();
        // Rounding to single precision below one: half of 2⁻²⁴.
        for (a, b) in [
            (found.w, expected.w),
            (found.x, expected.x),
            (found.y, expected.y),
            (found.z, expected.z),
        ] {
            assert!((a - b).abs() <= 0.5_f64.powi(25), "{a} for {b}");
        }
        let mut out = [0; MAX_RECORD];
        let len = record.encode(&format, &mut out).unwrap();
        assert_eq!(out[..len], bytes);
    }

    #[test]
    fn what_cannot_be_sent() {
        let mut out = [0; MAX_RECORD];
        let format = RecordFormat::default();
        let mut record = pose();
        record.position_m = Some([26.0, 0.0, 0.0]);
        assert_eq!(
            record.encode(&format, &mut out),
            Err(EncodeError::OutOfRange {
                item: Item::Position
            })
        );
        record.position_m = None;
        assert_eq!(
            record.encode(&format, &mut out),
            Err(EncodeError::Missing {
                item: Item::Position
            })
        );
    }

    #[test]
    fn axes_of_the_world() {
        // A quarter turn in azimuth: clockwise seen from above, that is, by −90°
        // about the world's upward axis.
        let record = Record {
            position_m: Some([0.0; 3]),
            orientation: Some(angles::to_quaternion([PI / 2.0, 0.0, 0.0])),
            ..pose()
        };
        let q = record.to_world().unwrap().orientation;
        assert!((q.y + 0.5_f64.sqrt()).abs() < 1e-15 && (q.w - 0.5_f64.sqrt()).abs() < 1e-15);
        assert_eq!((q.x.abs(), q.z.abs()), (0.0, 0.0));
    }

    proptest! {
        /// Going to the world and back changes nothing but the length of the quaternion.
        #[test]
        fn the_world_is_a_change_of_axes(position in [-1.0..1.0_f64, -1.0..1.0, -1.0..1.0], az in -3.0..3.0_f64, el in -1.5..1.5_f64) {
            let record = Record {
                position_m: Some(position),
                orientation: Some(angles::to_quaternion([az, el, 0.3])),
                ..pose()
            };
            let world = record.to_world().expect("the record is complete");
            let back = Record::from_world(Station::One, &world);
            prop_assert_eq!(back.position_m, record.position_m);
            let (a, b) = (back.orientation.expect("set"), record.orientation.expect("set"));
            for (a, b) in [(a.x, b.x), (a.y, b.y), (a.z, b.z), (a.w, b.w)] {
                // Length one and quotient: a few roundings of numbers up to one.
                prop_assert!((a - b).abs() <= 4.0 * f64::EPSILON);
            }
        }
    }
}
