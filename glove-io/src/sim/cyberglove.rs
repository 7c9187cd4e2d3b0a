//! A simulated CyberGlove.

use std::time::Duration;

use crate::SENSOR_COUNT;
use crate::cyberglove::{
    MAX_RECORD, Query, SamplePeriod, SensorCount, SettingLetter, Status, WordOrder, encode_parts,
};
use crate::joints::Sensor;

/// Ends a stream.
const CTRL_C: u8 = 0x03;
/// The simulator's answer to `?V`: firmware 1.0, glove 1.0.
const VERSION: [u8; 4] = [1, 0, 1, 0];

/// 100 samples per second.
const POWER_UP_PERIOD: SamplePeriod = SamplePeriod([1152, 1]);

/// A CyberGlove as it behaves on its serial line.
///
/// | command | effect | reply |
/// |---|---|---|
/// | `G` | one sample | a record |
/// | `S` | stream, one record per [`tick`](Self::tick) | records |
/// | Ctrl-C | ends the stream | `03 00` |
/// | `T` + 4 bytes | sample period | `T`, NUL |
/// | `?` + one of `GSNKMRUDWTV` | query | `?`, letter, payload, NUL |
/// | `U`, `D` + 0 or 1 | status byte, time stamp in records | letter, NUL |
/// | `N` + count | sample the first sensors only | `N`, NUL |
/// | `M` + 3 bytes | allow these slots only | `M`, NUL |
/// | CR, LF, NUL | ignored | none |
/// | anything else | none | `e?`, NUL |
///
/// A value out of range is answered with `en`, NUL. At power-up neither status
/// byte nor time stamp is on, all sensors are sampled, and the light follows
/// the wrist switch. The real glove does not say how long a tick of its time
/// stamp is; here the stamp counts calls of [`tick`](Self::tick).
///
/// # Example
///
/// ```
/// use glove_io::sim::CyberGlove;
///
/// let mut glove = CyberGlove::default();
/// let mut reply = Vec::new();
/// glove.receive(b"?W", &mut reply);
/// assert_eq!(reply, b"?W\0\0");
/// ```
#[derive(Debug, Clone)]
pub struct CyberGlove {
    count: SensorCount,
    right_hand: bool,
    plugged_in: bool,
    wrist_switch: bool,
    sensors: [u8; SENSOR_COUNT],
    /// The settings N, M, T, U and D.
    sampled: u8,
    mask: u32,
    period: [u8; 4],
    status_on: bool,
    time_stamp_on: bool,
    streaming: bool,
    ticks: u32,
    /// A command whose bytes have not all arrived.
    command: [u8; 5],
    command_len: usize,
}

impl CyberGlove {
    /// A plugged-in right-hand glove with all sensors at 128.
    #[must_use]
    pub fn new(count: SensorCount) -> Self {
        let mut glove = Self {
            count,
            right_hand: true,
            plugged_in: true,
            wrist_switch: false,
            sensors: [128; SENSOR_COUNT],
            sampled: 0,
            mask: 0,
            period: POWER_UP_PERIOD.to_bytes(WordOrder::LowFirst),
            status_on: false,
            time_stamp_on: false,
            streaming: false,
            ticks: 0,
            command: [0; 5],
            command_len: 0,
        };
        glove.sampled = glove.sensors_present();
        glove.mask = glove.hardware_mask();
        glove
    }

    /// Sets what all 22 sensors measure, in record order; an 18-sensor glove
    /// leaves out the distal joints. Like the firmware, raises 0 to 1.
    pub fn set_sensors(&mut self, sensors: [u8; SENSOR_COUNT]) {
        self.sensors = sensors.map(|value| value.max(1));
    }

    /// Turns the switch on the wristband on or off.
    pub fn set_wrist_switch(&mut self, on: bool) {
        self.wrist_switch = on;
    }

    /// Plugs the glove in or out. Without a glove records carry the mark `eg`.
    pub fn set_plugged_in(&mut self, plugged_in: bool) {
        self.plugged_in = plugged_in;
    }

    /// Makes it a right-hand or a left-hand glove.
    pub fn set_right_hand(&mut self, right_hand: bool) {
        self.right_hand = right_hand;
    }

    /// How long to wait between two calls of [`tick`](Self::tick), as the client
    /// set it; 10 ms at power-up. Of the words of `T` the low byte comes first.
    #[must_use]
    pub fn sample_period(&self) -> Duration {
        let period = SamplePeriod::from_bytes(self.period, WordOrder::LowFirst);
        Duration::from_secs_f64(period.seconds())
    }

    /// Takes bytes from the client and appends the answers to `reply`.
    pub fn receive(&mut self, bytes: &[u8], reply: &mut Vec<u8>) {
        for &byte in bytes {
            self.command[self.command_len] = byte;
            self.command_len += 1;
            if self.command_len == self.expected_len() {
                self.command_len = 0;
                self.execute(reply);
            }
        }
    }

    /// Lets one sample period pass: a streaming glove appends a record.
    pub fn tick(&mut self, reply: &mut Vec<u8>) {
        self.ticks = self.ticks.wrapping_add(1);
        if self.streaming {
            self.sample(true, reply);
        }
    }

    /// Length of the command that begins with the bytes received.
    fn expected_len(&self) -> usize {
        match self.command[0] {
            b'?' => 2,
            letter => {
                SettingLetter::from_letter(letter).map_or(1, |setting| 1 + setting.payload_len())
            }
        }
    }

    fn execute(&mut self, reply: &mut Vec<u8>) {
        let [letter, payload @ ..] = self.command;
        match letter {
            0 | b'\r' | b'\n' => {}
            b'G' => self.sample(false, reply),
            b'S' => self.streaming = true,
            CTRL_C => {
                self.streaming = false;
                reply.extend([CTRL_C, 0]);
            }
            b'?' => match Query::from_letter(payload[0]) {
                Some(query) => self.answer(query, reply),
                None => reply.extend(b"e?\0"),
            },
            _ => match SettingLetter::from_letter(letter) {
                Some(setting) if self.set(setting, payload) => reply.extend([letter, 0]),
                Some(_) => reply.extend(b"en\0"),
                None => reply.extend(b"e?\0"),
            },
        }
    }

    fn answer(&self, query: Query, reply: &mut Vec<u8>) {
        let [low, middle, high, _] = match query {
            Query::HardwareMask => self.hardware_mask(),
            _ => self.mask,
        }
        .to_le_bytes();
        reply.extend(query.command());
        match query {
            Query::GloveState => reply.push(1 | (u8::from(self.plugged_in) << 1)),
            Query::SensorsPresent => reply.push(self.sensors_present()),
            Query::SensorsSampled => reply.push(self.sampled),
            Query::HardwareMask | Query::SoftwareMask => reply.extend([low, middle, high]),
            Query::RightHand => reply.push(u8::from(self.right_hand)),
            Query::StatusByte => reply.push(u8::from(self.status_on)),
            Query::TimeStamp => reply.push(u8::from(self.time_stamp_on)),
            Query::WristSwitch => reply.push(u8::from(self.wrist_switch)),
            Query::SamplePeriod => reply.extend(self.period),
            Query::Version => reply.extend(VERSION),
        }
        reply.push(0);
    }

    /// Takes a setting; `false` if its value is out of range.
    fn set(&mut self, setting: SettingLetter, [first, second, third, fourth]: [u8; 4]) -> bool {
        match setting {
            SettingLetter::StatusByte if first <= 1 => self.status_on = first == 1,
            SettingLetter::TimeStamp if first <= 1 => self.time_stamp_on = first == 1,
            SettingLetter::SensorsSampled if (1..=self.sensors_present()).contains(&first) => {
                self.sampled = first;
            }
            SettingLetter::SoftwareMask => {
                self.mask = u32::from_le_bytes([first, second, third, 0]);
            }
            // A period of zero has no rate.
            SettingLetter::SamplePeriod
                if [first, second] != [0; 2] && [third, fourth] != [0; 2] =>
            {
                self.period = [first, second, third, fourth];
            }
            _ => return false,
        }
        true
    }

    fn sample(&self, streamed: bool, reply: &mut Vec<u8>) {
        let mut values = [0; SENSOR_COUNT];
        let mut count = 0;
        for sensor in self
            .count
            .sensors()
            .filter(|sensor| self.mask & slot_bit(*sensor) != 0)
            .take(self.sampled.into())
        {
            values[count] = self.sensors[sensor.index()];
            count += 1;
        }
        let status = Status {
            plugged_in: self.plugged_in,
            wrist_switch: self.wrist_switch,
            light: self.wrist_switch,
        };
        let mut record = [0; MAX_RECORD];
        let len = encode_parts(
            streamed,
            &values[..count],
            self.time_stamp_on.then_some(self.ticks),
            self.status_on.then_some(status),
            [false, !self.plugged_in],
            &mut record,
        );
        reply.extend_from_slice(&record[..len]);
    }

    fn sensors_present(&self) -> u8 {
        match self.count {
            SensorCount::Eighteen => 18,
            SensorCount::TwentyTwo => 22,
        }
    }

    fn hardware_mask(&self) -> u32 {
        self.count
            .sensors()
            .fold(0, |mask, sensor| mask | slot_bit(sensor))
    }
}

impl Default for CyberGlove {
    fn default() -> Self {
        Self::new(SensorCount::TwentyTwo)
    }
}

fn slot_bit(sensor: Sensor) -> u32 {
    1 << sensor.slot()
}
