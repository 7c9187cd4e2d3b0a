//! The two devices, and the end of the wire where the loop listens.
//!
//! ```text
//! motion ──▶ simulated CyberGlove, FASTRAK ──bytes──▶ parsers, calibration ──▶ HandSample
//!  (Devices)                              (fault)                      (Receiver)
//! ```
//!
//! Only bytes cross from [`Devices`] to [`Receiver`].

use glove_io::{
    Calibration, JointAngles, Pose,
    cyberglove::{self, Query, Reply, SensorCount, SettingLetter, parse_reply},
    fastrak::{self, Encoding, Item, OutputList, Station, Units},
    sim,
};

use crate::motion::Motion;

/// Seconds and frames without a record after which a device counts as lost: a byte may
/// be lost now and then, however long a frame takes.
const PATIENCE_S: f64 = 0.5;
const PATIENCE_FRAMES: usize = 5;

/// The tracker's record as this program asks for it: position, quaternion, and a
/// blank that ends the record.
const TRACKER_ITEMS: [Item; 3] = [Item::Position, Item::Quaternion, Item::Space];

/// One of the devices.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Device {
    /// The CyberGlove.
    Glove,
    /// The FASTRAK tracker.
    Tracker,
}

impl Device {
    /// Its name in messages.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Glove => "glove",
            Self::Tracker => "tracker",
        }
    }
}

/// Damage on the wire.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FaultKind {
    /// The lowest bit of one byte of the record is flipped.
    Flip,
    /// One byte of the record is lost.
    Drop,
    /// The line goes dead in the middle of the record.
    Cut,
}

/// Damage to one device's bytes in one frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fault {
    /// Whose bytes.
    pub device: Device,
    /// What happens to them.
    pub kind: FaultKind,
    /// In which frame, counted from 0.
    pub frame: usize,
}

impl std::str::FromStr for Fault {
    type Err = String;

    /// `DEVICE:KIND:FRAME`, such as `glove:drop:120`.
    fn from_str(text: &str) -> Result<Self, String> {
        let wanted = || format!("expected DEVICE:KIND:FRAME, such as glove:drop:120, not {text:?}");
        let [device, kind, frame] = text
            .split(':')
            .collect::<Vec<_>>()
            .try_into()
            .map_err(|_| wanted())?;
        Ok(Self {
            device: match device {
                "glove" => Device::Glove,
                "tracker" => Device::Tracker,
                _ => return Err(wanted()),
            },
            kind: match kind {
                "flip" => FaultKind::Flip,
                "drop" => FaultKind::Drop,
                "cut" => FaultKind::Cut,
                _ => return Err(wanted()),
            },
            frame: frame.parse().map_err(|_| wanted())?,
        })
    }
}

/// The far end of the wire: both simulated devices, moved by a motion.
pub struct Devices<'a> {
    motion: &'a dyn Motion,
    calibration: Calibration,
    glove: sim::CyberGlove,
    tracker: sim::Fastrak,
    fault: Option<Fault>,
    /// Devices whose line is dead.
    dead: [bool; 2],
    clamped: u64,
}

impl<'a> Devices<'a> {
    /// Devices worn by a hand that moves so.
    #[must_use]
    pub fn new(motion: &'a dyn Motion, calibration: Calibration, fault: Option<Fault>) -> Self {
        Self {
            motion,
            calibration,
            glove: sim::CyberGlove::new(SensorCount::TwentyTwo),
            tracker: sim::Fastrak::new(),
            fault,
            dead: [false; 2],
            clamped: 0,
        }
    }

    /// Moves the hand to where it is at this time.
    ///
    /// # Errors
    ///
    /// The tracker's refusal of a pose it could not report.
    pub fn set_time(&mut self, time_s: f64) -> Result<(), fastrak::EncodeError> {
        let sample = self.motion.sample(time_s);
        let (raw, clamped) = self.calibration.raw_values(&sample.angles);
        self.clamped += clamped as u64;
        self.glove.set_sensors(raw);
        self.glove.set_wrist_switch(sample.wrist_switch);
        self.tracker.set_pose(Station::One, sample.wrist)
    }

    /// Sends command bytes to a device and appends its answer to `reply`.
    /// `frame` is `None` during start-up, when no fault strikes.
    pub fn exchange(
        &mut self,
        device: Device,
        command: &[u8],
        frame: Option<usize>,
        reply: &mut Vec<u8>,
    ) {
        if self.dead[device as usize] {
            return;
        }
        let start = reply.len();
        match device {
            Device::Glove => self.glove.receive(command, reply),
            Device::Tracker => self.tracker.receive(command, reply),
        }
        if let Some(fault) = self.fault
            && fault.device == device
            && Some(fault.frame) == frame
        {
            let length = reply.len() - start;
            if length == 0 {
                return;
            }
            // A finger's sensor, or a coordinate of the position.
            let place = start + length * 3 / 8;
            match fault.kind {
                FaultKind::Flip => reply[place] ^= 1,
                FaultKind::Drop => {
                    reply.remove(place);
                }
                FaultKind::Cut => {
                    reply.truncate(start + length / 2);
                    self.dead[device as usize] = true;
                }
            }
        }
    }

    /// Sensor values that lay outside the calibrated range so far.
    #[must_use]
    pub fn clamped(&self) -> u64 {
        self.clamped
    }
}

/// What the loop knows of the real hand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HandSample {
    /// Pose of the receiver on the wrist, world frame.
    pub wrist: Pose,
    /// Calibrated joint angles.
    pub angles: JointAngles,
    /// Whether the switch on the glove's wrist is held down.
    pub wrist_switch: bool,
}

/// What went wrong on the wire.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DeviceError {
    /// A device does not answer as it should when it is set up.
    #[error("{device}: start-up failed: {reason}")]
    StartUp {
        /// Which device.
        device: &'static str,
        /// What it answered.
        reason: String,
    },
    /// A device has sent no complete record for a while.
    #[error(
        "{device}: the byte stream is truncated: no complete record {}, and it ends {pending} bytes into a record, at byte {byte}",
        last_frame.map_or("at all".to_owned(), |frame| format!("since frame {frame}"))
    )]
    Silent {
        /// Which device.
        device: &'static str,
        /// The last frame with a record, if there was one.
        last_frame: Option<usize>,
        /// Bytes of the record that was never completed.
        pending: usize,
        /// Bytes received in all.
        byte: u64,
    },
}

/// The near end of the wire: bytes to samples.
pub struct Receiver {
    calibration: Calibration,
    glove: cyberglove::Parser,
    tracker: fastrak::Parser,
    angles: Option<(JointAngles, bool)>,
    wrist: Option<Pose>,
    bytes: [u64; 2],
    /// Frames asked for so far, and the last in which each device sent a record.
    frames: usize,
    last_frame: [Option<usize>; 2],
    frame_s: f64,
    held: u64,
}

impl Receiver {
    /// Commands that set up the glove, and the answers they must get: is it ready, how
    /// many sensors, status byte on.
    const GLOVE_START_UP: [(&'static [u8], Reply); 3] = [
        (
            &Query::GloveState.command(),
            Reply::GloveState {
                initialised: true,
                plugged_in: true,
            },
        ),
        (&Query::SensorsPresent.command(), Reply::SensorsPresent(22)),
        (b"U\x01", Reply::Accepted(SettingLetter::StatusByte)),
    ];
    /// Commands that set up the tracker: stop, centimetres, our record, binary.
    const TRACKER_START_UP: &'static [u8] = b"cuO1,2,11,0\rf";

    /// Sets up both devices as a driver would: asks, and believes only the answers.
    /// Frames are `frame_s` seconds apart.
    ///
    /// # Errors
    ///
    /// [`DeviceError::StartUp`] with the answer that was not the expected one.
    pub fn start(
        devices: &mut Devices<'_>,
        calibration: Calibration,
        frame_s: f64,
    ) -> Result<Self, DeviceError> {
        let fail = |device: Device, reason: String| DeviceError::StartUp {
            device: device.name(),
            reason,
        };
        let mut reply = Vec::new();
        for (command, expected) in Self::GLOVE_START_UP {
            reply.clear();
            devices.exchange(Device::Glove, command, None, &mut reply);
            let answer = parse_reply(&reply).map_err(|e| fail(Device::Glove, e.to_string()))?;
            if answer.map(|(reply, _)| reply) != Some(expected) {
                return Err(fail(
                    Device::Glove,
                    format!("it answers {answer:?} instead of {expected:?}"),
                ));
            }
        }
        reply.clear();
        devices.exchange(Device::Tracker, Self::TRACKER_START_UP, None, &mut reply);
        if !reply.is_empty() {
            let text = String::from_utf8_lossy(&reply).into_owned();
            return Err(fail(
                Device::Tracker,
                format!("it answers {text:?} to settings"),
            ));
        }
        let items = OutputList::try_new(&TRACKER_ITEMS)
            .map_err(|e| fail(Device::Tracker, e.to_string()))?;
        Ok(Self {
            calibration,
            glove: cyberglove::Parser::new(cyberglove::RecordFormat {
                sensors: SensorCount::TwentyTwo,
                time_stamp: false,
                status: true,
            }),
            tracker: fastrak::Parser::new(fastrak::RecordFormat {
                items,
                encoding: Encoding::Binary,
                units: Units::Centimetres,
            }),
            angles: None,
            wrist: None,
            bytes: [0; 2],
            frames: 0,
            last_frame: [None; 2],
            frame_s,
            held: 0,
        })
    }

    /// The command that asks a device for one record.
    #[must_use]
    pub fn request(device: Device) -> &'static [u8] {
        match device {
            Device::Glove => b"G",
            Device::Tracker => b"P",
        }
    }

    /// Takes the bytes that arrived from both devices in this frame. A frame
    /// without a complete record keeps the last sample; `None` until both devices
    /// have sent one.
    ///
    /// # Errors
    ///
    /// [`DeviceError::Silent`] when a device has been without a record too long.
    pub fn receive(
        &mut self,
        frame: usize,
        glove: &[u8],
        tracker: &[u8],
    ) -> Result<Option<HandSample>, DeviceError> {
        self.frames = frame + 1;
        let mut fresh = [false; 2];
        let Self {
            calibration,
            angles,
            wrist,
            ..
        } = self;
        self.glove.push(glove, |record| {
            if let Some(raw) = record.all_sensors() {
                let switch = record.status.is_some_and(|status| status.wrist_switch);
                *angles = Some((calibration.angles(raw), switch));
                fresh[Device::Glove as usize] = true;
            }
        });
        self.tracker.push(tracker, |record| {
            if record.station == Station::One
                && let Some(pose) = record.to_world()
            {
                *wrist = Some(pose);
                fresh[Device::Tracker as usize] = true;
            }
        });
        for (device, received, pending) in [
            (Device::Glove, glove.len(), self.glove.pending()),
            (Device::Tracker, tracker.len(), self.tracker.pending()),
        ] {
            let d = device as usize;
            self.bytes[d] += received as u64;
            if fresh[d] {
                self.last_frame[d] = Some(frame);
                continue;
            }
            self.held += 1;
            let silent = self.frames_without(device);
            if silent >= PATIENCE_FRAMES && silent as f64 * self.frame_s >= PATIENCE_S {
                return Err(self.silent(device, pending));
            }
        }
        Ok(self
            .angles
            .zip(self.wrist)
            .map(|((angles, wrist_switch), wrist)| HandSample {
                wrist,
                angles,
                wrist_switch,
            }))
    }

    /// Must be asked after the last frame: a stream that ends in the middle of a record
    /// was cut.
    ///
    /// # Errors
    ///
    /// [`DeviceError::Silent`] for the device whose stream was.
    pub fn finish(&self) -> Result<(), DeviceError> {
        for (device, pending) in [
            (Device::Glove, self.glove.pending()),
            (Device::Tracker, self.tracker.pending()),
        ] {
            if pending > 0 && self.frames_without(device) > 0 {
                return Err(self.silent(device, pending));
            }
        }
        Ok(())
    }

    /// Frames since a device's last record.
    fn frames_without(&self, device: Device) -> usize {
        self.frames - self.last_frame[device as usize].map_or(0, |frame| frame + 1)
    }

    fn silent(&self, device: Device, pending: usize) -> DeviceError {
        DeviceError::Silent {
            device: device.name(),
            last_frame: self.last_frame[device as usize],
            pending,
            byte: self.bytes[device as usize],
        }
    }

    /// Times a frame had to do with a device's former sample, counted for each device.
    #[must_use]
    pub fn held(&self) -> u64 {
        self.held
    }

    /// Records, resyncs and dropped bytes of glove and tracker.
    #[must_use]
    pub fn counters(&self) -> [glove_io::Counters; 2] {
        [self.glove.counters(), self.tracker.counters()]
    }
}
