//! The 16-bit packets of the CyberGlove III.

use crate::Counters;
use crate::joints::{SENSOR_COUNT, Sensor};

/// Length of a packet in bytes: time code, 22 values of two bytes, trailer.
pub const PACKET_LEN: usize = TIME_CODE_LEN + 2 * SENSOR_COUNT + TRAILER_LEN;

const TIME_CODE_LEN: usize = 14;
const TRAILER_LEN: usize = 3;
/// Sensor values have 12 bits.
const VALUE_LIMIT: u16 = 1 << 12;
/// The largest time code character by character; a digit goes from 0 to the one
/// shown, the others are fixed.
const LAST_TIME_CODE: [u8; TIME_CODE_LEN] = *b"29:59:59:29:9S";

/// When a packet was sampled, as the glove writes it: `HH:MM:SS:FF:nS`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub struct TimeCode {
    /// Hours, 0–23.
    pub hours: u8,
    /// Minutes, 0–59.
    pub minutes: u8,
    /// Seconds, 0–59.
    pub seconds: u8,
    /// Frame within the second, 0–29.
    pub frame: u8,
    /// Sub-frame within the frame, 0–9.
    pub subframe: u8,
}

impl TimeCode {
    fn is_valid(self) -> bool {
        self.hours < 24
            && self.minutes < 60
            && self.seconds < 60
            && self.frame < 30
            && self.subframe < 10
    }
}

/// One 16-bit sample of all sensors: the answer to `1G`, and what `1S` streams.
///
/// # Example
///
/// ```
/// use glove_io::Sensor;
/// use glove_io::cyberglove::{Packet, TimeCode};
///
/// let packet = Packet::try_new(TimeCode::default(), [0x0805; 22])?;
/// assert_eq!(packet.encode()[..16], *b"00:00:00:00:0S\x08\x05");
/// assert_eq!(packet.value(Sensor::WristYaw), 0x0805);
/// assert_eq!(packet.eight_bit_values(), [0x80; 22]);
/// # Ok::<(), glove_io::cyberglove::PacketError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Packet {
    time: TimeCode,
    values: [u16; SENSOR_COUNT],
    /// The last three bytes as they came. Their meaning is not documented.
    pub trailer: [u8; TRAILER_LEN],
}

impl Packet {
    /// A packet with these values, in record order, and a trailer of zeros.
    ///
    /// # Errors
    ///
    /// * [`PacketError::TimeCode`] if a part of the time code is out of range.
    /// * [`PacketError::Value`] if a value has more than 12 bits.
    pub fn try_new(time: TimeCode, values: [u16; SENSOR_COUNT]) -> Result<Self, PacketError> {
        if !time.is_valid() {
            return Err(PacketError::TimeCode { time });
        }
        if let Some(index) = values.iter().position(|&value| value >= VALUE_LIMIT) {
            let value = values[index];
            return Err(PacketError::Value { index, value });
        }
        Ok(Self {
            time,
            values,
            trailer: [0; TRAILER_LEN],
        })
    }

    /// When the sample was taken.
    #[must_use]
    pub fn time(&self) -> TimeCode {
        self.time
    }

    /// The 12-bit sensor values in record order.
    #[must_use]
    pub fn values(&self) -> &[u16; SENSOR_COUNT] {
        &self.values
    }

    /// The 12-bit value of one sensor.
    #[must_use]
    pub fn value(&self, sensor: Sensor) -> u16 {
        self.values[sensor.index()]
    }

    /// The sensor values as an 8-bit record has them, ready for
    /// [`Calibration::angles`](crate::Calibration::angles): the upper 8 of the
    /// 12 bits.
    #[must_use]
    pub fn eight_bit_values(&self) -> [u8; SENSOR_COUNT] {
        self.values.map(|value| (value >> 4).to_le_bytes()[0])
    }

    /// The bytes the glove would send.
    #[must_use]
    pub fn encode(&self) -> [u8; PACKET_LEN] {
        let mut out = [0; PACKET_LEN];
        let (stamp, rest) = out.split_at_mut(TIME_CODE_LEN);
        let (values, trailer) = rest.split_at_mut(2 * SENSOR_COUNT);
        let TimeCode {
            hours,
            minutes,
            seconds,
            frame,
            subframe,
        } = self.time;
        stamp.copy_from_slice(&LAST_TIME_CODE);
        for (place, number) in [(0, hours), (3, minutes), (6, seconds), (9, frame)] {
            stamp[place] = b'0' + number / 10;
            stamp[place + 1] = b'0' + number % 10;
        }
        stamp[12] = b'0' + subframe;
        for (pair, value) in values.chunks_exact_mut(2).zip(self.values) {
            pair.copy_from_slice(&value.to_be_bytes());
        }
        trailer.copy_from_slice(&self.trailer);
        out
    }

    fn decode(bytes: &[u8; PACKET_LEN]) -> Option<Self> {
        let (stamp, rest) = bytes.split_at(TIME_CODE_LEN);
        if !may_begin_packet(stamp) {
            return None;
        }
        let digit = |place: usize| stamp[place] - b'0';
        let number = |place: usize| 10 * digit(place) + digit(place + 1);
        let time = TimeCode {
            hours: number(0),
            minutes: number(3),
            seconds: number(6),
            frame: number(9),
            subframe: digit(12),
        };
        let (pairs, trailer) = rest.split_at(2 * SENSOR_COUNT);
        let mut values = [0; SENSOR_COUNT];
        for (value, pair) in values.iter_mut().zip(pairs.chunks_exact(2)) {
            *value = u16::from_be_bytes([pair[0], pair[1]]);
        }
        // Every part of the time code but the hours is in range by its digits.
        let in_range = values.iter().fold(0, |all, value| all | value) < VALUE_LIMIT;
        (time.hours < 24 && in_range).then_some(Self {
            time,
            values,
            trailer: [trailer[0], trailer[1], trailer[2]],
        })
    }
}

/// Whether the first bytes (all of them, if fewer than a time code) look like a
/// time code.
fn may_begin_packet(bytes: &[u8]) -> bool {
    bytes.iter().zip(&LAST_TIME_CODE).all(|(byte, last)| {
        if last.is_ascii_digit() {
            (b'0'..=*last).contains(byte)
        } else {
            byte == last
        }
    })
}

/// Why time and values do not make a packet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PacketError {
    /// A part of the time code is out of range.
    #[error("{time:?} is no time of day with frames 0 to 29 and sub-frames 0 to 9")]
    TimeCode {
        /// The time code.
        time: TimeCode,
    },
    /// A sensor value has more than 12 bits.
    #[error("sensor value {index} (counted from 0) is {value}; the glove sends at most 4095")]
    Value {
        /// Place of the first such value, counted from 0.
        index: usize,
        /// The value.
        value: u16,
    },
}

/// Bytes in, packets out, in pieces of any size.
///
/// A packet is handed out the moment its last byte arrives. The time code at its
/// front and the upper four bits of its values, which are zero, tell it from
/// damage; after damage the parser goes on at the next time code. What precedes
/// the first one, such as the echo of `1S`, is dropped and counted.
///
/// A byte missing from the trailer goes unnoticed until the next time code is
/// found to be incomplete: the packet then has a wrong trailer, and the one after
/// it is lost.
///
/// A byte missing among the values goes unnoticed in the same way if the shifted
/// values all happen to fit 12 bits: that packet then holds wrong values, and the
/// one after it is lost.
///
/// # Example
///
/// ```
/// use glove_io::cyberglove::{Packet, PacketParser, TimeCode};
///
/// let sent = Packet::try_new(TimeCode::default(), [2048; 22])?;
/// let mut parser = PacketParser::default();
/// let mut packets = Vec::new();
/// parser.push(b"1S", |packet| packets.push(packet));
/// parser.push(&sent.encode(), |packet| packets.push(packet));
/// assert_eq!(packets, [sent]);
/// assert_eq!(parser.counters().dropped_bytes, 2);
/// # Ok::<(), glove_io::cyberglove::PacketError>(())
/// ```
#[derive(Debug, Clone)]
pub struct PacketParser {
    buffer: [u8; PACKET_LEN],
    len: usize,
    /// Whether the buffer begins where a packet ended or the stream began.
    in_step: bool,
    counters: Counters,
}

impl Default for PacketParser {
    fn default() -> Self {
        Self::new()
    }
}

impl PacketParser {
    /// A parser at the start of a stream.
    #[must_use]
    pub fn new() -> Self {
        Self {
            buffer: [0; PACKET_LEN],
            len: 0,
            in_step: true,
            counters: Counters::default(),
        }
    }

    /// Takes the next bytes of the stream and hands every completed packet to
    /// `sink`, in order.
    ///
    /// Constant memory. Time in proportion to the number of bytes, times the
    /// length of a packet where the stream is damaged.
    pub fn push(&mut self, bytes: &[u8], mut sink: impl FnMut(Packet)) {
        let mut bytes = bytes;
        loop {
            // The usual case, without copying: nothing held back, a whole packet.
            while self.len == 0
                && let Some((front, rest)) = bytes.split_first_chunk()
                && let Some(packet) = Packet::decode(front)
            {
                self.hand_out(packet, &mut sink);
                bytes = rest;
            }
            let Some((&byte, rest)) = bytes.split_first() else {
                return;
            };
            bytes = rest;
            self.buffer[self.len] = byte;
            self.len += 1;
            self.advance(&mut sink);
        }
    }

    /// Statistics since the parser was made.
    #[must_use]
    pub fn counters(&self) -> Counters {
        self.counters
    }

    /// Number of bytes held back that may become part of a packet.
    #[must_use]
    pub fn pending(&self) -> usize {
        self.len
    }

    /// Takes a complete packet or damaged bytes off the front of the buffer.
    fn advance(&mut self, sink: &mut impl FnMut(Packet)) {
        let mut start = 0;
        if self.len == PACKET_LEN {
            if let Some(packet) = Packet::decode(&self.buffer) {
                self.len = 0;
                self.hand_out(packet, sink);
                return;
            }
            start = 1;
        }
        while !may_begin_packet(&self.buffer[start..self.len]) {
            start += 1;
        }
        if start > 0 {
            self.buffer.copy_within(start..self.len, 0);
            self.len -= start;
            self.counters.dropped_bytes += start as u64;
            self.counters.resyncs += u64::from(self.in_step);
            self.in_step = false;
        }
    }

    fn hand_out(&mut self, packet: Packet, sink: &mut impl FnMut(Packet)) {
        self.in_step = true;
        self.counters.records += 1;
        sink(packet);
    }
}
