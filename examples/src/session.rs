//! The loop: device bytes in, deformed positions out, frame by frame.

use std::time::{Duration, Instant};

use fem_tet::Contact;
use glam::{DQuat, DVec3};
use glove_io::{
    Calibration,
    hand::{HandModel, HandPose},
};

use crate::{
    deformer::Step,
    devices::{Device, DeviceError, Devices, Fault, HandSample, Receiver},
    geometry::Rigid,
    grasp::{Grasp, GraspEvent, GraspRules, Grip, Phase},
    hand_proxy::{HandProxy, Posture},
    motion::Motion,
    report::{EventRecord, FrameRecord, KeepShapeRecord, RefusedRecord, StageTimes},
    soft_body::{SoftBody, SoftBodyError},
    touch::{FingerShapes, Touch},
};

/// Speed at which the virtual hand catches up with the real one when the object no
/// longer holds it back, metres per second; a quick squeeze is slower than this.
const CATCH_UP_M_PER_S: f64 = 0.25;

/// Length over which a turn of the hand moves its fingers, metres.
const HAND_M: f64 = 0.2;

/// Radius of the area on which a fingertip presses, metres.
const PATCH_RADIUS_M: f64 = 0.012;

/// What becomes of fingertips that displace nothing.
const WHOLE: Step = Step {
    fraction: 1.0,
    certificate: None,
};

/// How a session runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SessionOptions {
    /// Number of frames; the motion is sampled evenly over them.
    pub frames: usize,
    /// Seconds between two frames.
    pub frame_s: f64,
    /// When the object gives way and when it is released.
    pub rules: GraspRules,
    /// Damage to the devices' bytes.
    pub fault: Option<Fault>,
}

/// What stops a session.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// A device.
    #[error(transparent)]
    Device(#[from] DeviceError),
    /// A pose that the tracker cannot report.
    #[error("frame {frame}: the tracker cannot report the recorded pose: {source}")]
    Pose {
        /// Which frame.
        frame: usize,
        /// Why.
        source: glove_io::fastrak::EncodeError,
    },
    /// Keep shape failed.
    #[error("frame {frame}: the shape cannot be kept: {source}")]
    KeepShape {
        /// Which frame.
        frame: usize,
        /// Why.
        source: SoftBodyError,
    },
}

/// Everything there is to see at one instant, in the world.
#[derive(Debug, Clone)]
pub struct Snapshot {
    /// Frame number.
    pub frame: usize,
    /// Caption.
    pub name: String,
    /// Positions of the object's vertices, metres.
    pub positions: Vec<[f64; 3]>,
    /// How far each has been displaced from the rest shape of the moment, metres.
    pub displacement_m: Vec<f64>,
    /// The virtual hand, in the world.
    pub hand: HandPose,
    /// Which fingertips touch the object.
    pub touching: [bool; 5],
}

/// What a session leaves behind.
#[derive(Debug)]
pub struct Outcome {
    /// One record a frame.
    pub frames: Vec<FrameRecord>,
    /// What happened, in order.
    pub events: Vec<EventRecord>,
    /// Every keep shape, in order.
    pub kept: Vec<KeepShapeRecord>,
    /// Sets of fingertips that do not determine how the object deforms.
    pub refused: Vec<RefusedRecord>,
    /// Times a frame had to do with a device's former sample.
    pub held_samples: u64,
    /// Sensor values outside the calibrated range.
    pub clamped_sensors: u64,
    /// Record counters of glove and tracker.
    pub counters: [glove_io::Counters; 2],
    /// The object as it stands at the end.
    pub object: SoftBody,
    /// Positions of its vertices in the world at the end, metres.
    pub positions: Vec<[f64; 3]>,
}

/// A fingertip's hold on the object.
#[derive(Clone)]
struct Hold {
    /// Centre of the fingertip when it took hold, object frame.
    tip: DVec3,
    /// Outward normal of the surface there.
    normal: DVec3,
    /// Where it presses.
    patch: Contact,
    /// How far the surface there was displaced already.
    displaced: DVec3,
}

/// The state between frames.
struct Loop<'a> {
    model: &'a HandModel,
    rules: GraspRules,
    /// How far a finger moves in one frame at most while the object gives way.
    catch_up_m: f64,
    object: SoftBody,
    /// The object's pose at rest, and where it is now.
    place: Rigid,
    pose: Rigid,
    /// The object's pose relative to the palm, while it is attached.
    in_palm: Option<Rigid>,
    /// The virtual wrist in the frame of the real one, while the object is attached.
    lag: Rigid,
    proxy: HandProxy,
    grasp: Grasp,
    holds: [Option<Hold>; 5],
    /// Fingertips that the body was last condensed to, and whether they hold it.
    condensed: [bool; 5],
    held: bool,
    refused: Vec<RefusedRecord>,
    switch_was_down: bool,
    hand: HandPose,
    touching: [bool; 5],
    grasp_events: Vec<GraspEvent>,
    tip_displacements: Vec<[f64; 3]>,
}

/// Runs a motion against an object. `watch` sees every frame after it is done.
///
/// # Errors
///
/// [`SessionError`] if a device fails or a shape cannot be kept.
pub fn run(
    options: &SessionOptions,
    motion: &dyn Motion,
    model: &HandModel,
    object: SoftBody,
    mut watch: impl FnMut(&dyn Fn(&str) -> Snapshot, &FrameRecord),
) -> Result<Outcome, SessionError> {
    let calibration = Calibration::average();
    let mut devices = Devices::new(motion, calibration.clone(), options.fault);
    let mut receiver = Receiver::start(&mut devices, calibration, options.frame_s)?;
    let place = Rigid::from(motion.object_place());
    let still = motion.sample(0.0);
    let mut state = Loop {
        model,
        rules: options.rules,
        catch_up_m: CATCH_UP_M_PER_S * options.frame_s,
        object,
        place,
        pose: place,
        in_palm: None,
        lag: Rigid::IDENTITY,
        proxy: HandProxy::default(),
        grasp: Grasp::default(),
        holds: [const { None }; 5],
        condensed: [false; 5],
        held: false,
        refused: Vec::new(),
        switch_was_down: false,
        hand: model.pose(&still.wrist, &still.angles),
        touching: [false; 5],
        grasp_events: Vec::new(),
        tip_displacements: Vec::with_capacity(5),
    };

    let (mut frames, mut events, mut kept) =
        (Vec::with_capacity(options.frames), Vec::new(), Vec::new());
    let (mut glove_bytes, mut tracker_bytes) = (Vec::new(), Vec::new());
    for frame in 0..options.frames {
        devices
            .set_time(frame as f64 * options.frame_s)
            .map_err(|source| SessionError::Pose { frame, source })?;
        glove_bytes.clear();
        tracker_bytes.clear();
        for (device, bytes) in [
            (Device::Glove, &mut glove_bytes),
            (Device::Tracker, &mut tracker_bytes),
        ] {
            devices.exchange(device, Receiver::request(device), Some(frame), bytes);
        }

        // From here on only bytes are known; the clock runs from bytes to positions.
        let mut clock = Stopwatch::start();
        let sample = receiver.receive(frame, &glove_bytes, &tracker_bytes)?;
        let mut times = StageTimes {
            parse: clock.lap(),
            ..StageTimes::default()
        };
        let mut step = WHOLE;
        state.grasp_events.clear();
        if let Some(sample) = sample {
            step = state.step(frame, &sample, &mut times, &mut clock);
            if sample.wrist_switch
                && !state.switch_was_down
                && let Some(record) = state
                    .keep_shape(frame)
                    .map_err(|source| SessionError::KeepShape { frame, source })?
            {
                kept.push(record);
                times.keep_shape = clock.lap();
            }
            state.switch_was_down = sample.wrist_switch;
        }
        let record = FrameRecord {
            frame,
            phase: state.grasp.phase(),
            touching: state.touching,
            displaced_fraction: step.fraction,
            certificate: step.certificate,
            times,
        };
        events.extend(
            state
                .grasp_events
                .iter()
                .map(|&event| EventRecord { frame, event }),
        );
        watch(&|name| state.snapshot(frame, name), &record);
        frames.push(record);
    }
    receiver.finish()?;
    let positions = state.world_positions();
    Ok(Outcome {
        frames,
        events,
        kept,
        refused: state.refused,
        held_samples: receiver.held(),
        clamped_sensors: devices.clamped(),
        counters: receiver.counters(),
        object: state.object,
        positions,
    })
}

impl Loop<'_> {
    /// One frame after the bytes are parsed. Returns what the object could take of the
    /// fingertips' displacement.
    fn step(
        &mut self,
        frame: usize,
        sample: &HandSample,
        times: &mut StageTimes,
        clock: &mut Stopwatch,
    ) -> Step {
        // Hand: where the real hand is, in the object's frame.
        self.lag = self.catch_up(self.lag);
        let wrist = Rigid::from(sample.wrist).after(&self.lag);
        let palm = Rigid::from(self.model.pose(&wrist.into(), &sample.angles).palm);
        if let Some(in_palm) = &self.in_palm {
            self.pose = palm.after(in_palm);
        }
        let target = Posture {
            wrist: self.pose.inverse().after(&wrist),
            angles: sample.angles,
        };
        times.hand = clock.lap();

        // Touch: how far the virtual hand gets, and what its fingertips meet.
        let attached = self.grasp.phase() != Phase::Free;
        let advance = if self.grasp.phase() == Phase::Deforming {
            self.proxy.follow(self.model, target, self.catch_up_m)
        } else {
            let surface = self.object.surface();
            self.proxy.advance(self.model, target, surface, attached)
        };
        let surface = self.object.surface();
        let fingers = &advance.hand.fingers;
        let touch: [Touch; 5] = std::array::from_fn(|f| match advance.inside[f] {
            true => Touch::Apart,
            false => Touch::of(&fingers[f], surface),
        });
        let tips = fingers.map(|f| DVec3::from_array(f.tip_center_m()));
        let gap = self.rules.release_gap_m;
        let opening = std::array::from_fn(|f| match (&self.holds[f], self.grasp.grips()[f]) {
            // A fingertip sticks to the surface, which follows it outward.
            (Some(hold), _) => (tips[f] - hold.tip).dot(hold.normal),
            // A segment does not: it has opened when it is nowhere near any more.
            (None, Grip::Finger) if !FingerShapes::padded(&fingers[f], gap).hit(surface) => {
                f64::INFINITY
            }
            _ => 0.0,
        });
        times.touch = clock.lap();

        // Grasp.
        let touching = touch.map(|touch| match touch {
            Touch::Apart => Grip::None,
            Touch::Finger => Grip::Finger,
            Touch::Fingertip(_) => Grip::Fingertip,
        });
        self.grasp
            .update(&self.rules, touching, opening, &mut self.grasp_events);
        let grips = self.grasp.grips();
        for f in 0..5 {
            if grips[f] != Grip::Fingertip {
                self.holds[f] = None;
            } else if self.holds[f].is_none() {
                // A fingertip takes hold by touching, so there is a contact.
                self.holds[f] = touch[f].fingertip().map(|contact| {
                    let patch = self.object.patch(&contact, PATCH_RADIUS_M);
                    Hold {
                        tip: tips[f],
                        normal: DVec3::from_array(contact.normal),
                        displaced: self.object.mean_displacement(&patch),
                        patch,
                    }
                });
            }
        }
        let now_attached = self.grasp.phase() != Phase::Free;
        if now_attached && !attached {
            // To the palm of the virtual hand, which the object may have held back: from
            // here on both catch up with the real one.
            let virtual_palm = self.pose.after(&advance.hand.palm.into());
            self.in_palm = Some(virtual_palm.inverse().after(&self.pose));
            let virtual_wrist = self.pose.after(&advance.posture.wrist);
            self.lag = Rigid::from(sample.wrist).inverse().after(&virtual_wrist);
        } else if !now_attached && attached {
            self.let_go();
        }
        self.touching =
            std::array::from_fn(|f| touching[f] != Grip::None || grips[f] != Grip::None);
        times.grasp = clock.lap();

        // Deformation.
        let mut step = WHOLE;
        if self.grasp.phase() == Phase::Deforming {
            step = self.deform(frame, tips);
            times.deform = clock.lap();
            self.object.refit();
            times.refit = clock.lap();
        }
        self.hand = in_world(self.model, &self.pose, &advance.posture);
        step
    }

    /// A lag one frame later: shorter by the catch-up speed.
    fn catch_up(&self, lag: Rigid) -> Rigid {
        let length_m =
            lag.translation.length() + HAND_M * lag.rotation.angle_between(DQuat::IDENTITY);
        if length_m <= self.catch_up_m {
            return Rigid::IDENTITY;
        }
        lag.interpolate(&Rigid::IDENTITY, self.catch_up_m / length_m)
    }

    /// Displaces the held points with their fingertips.
    fn deform(&mut self, frame: usize, tips: [DVec3; 5]) -> Step {
        let holding = self.holds.each_ref().map(Option::is_some);
        if holding != self.condensed {
            self.condensed = holding;
            let contacts = self
                .holds
                .iter()
                .flatten()
                .map(|hold| hold.patch.clone())
                .collect();
            let answer = self.object.hold(contacts);
            self.held = answer.is_ok();
            if let Err(error) = answer {
                self.refused.push(RefusedRecord {
                    frame,
                    reason: error.to_string(),
                });
            }
        }
        if !self.held {
            // The fingertips do not determine the shape: it stays as it is until
            // others take hold.
            return WHOLE;
        }
        self.tip_displacements.clear();
        for (hold, tip) in self.holds.iter().zip(tips) {
            if let Some(hold) = hold {
                let displacement = hold.displaced + tip - hold.tip;
                self.tip_displacements.push(displacement.to_array());
            }
        }
        self.object.displace(&self.tip_displacements)
    }

    /// The object stays where it is, springs back, and is rigid again.
    fn let_go(&mut self) {
        self.in_palm = None;
        self.lag = Rigid::IDENTITY;
        self.holds = [const { None }; 5];
        self.condensed = [false; 5];
        self.held = false;
        self.object.relax();
    }

    /// Keep shape, if the object is held and deformed. The object is detached and
    /// returns to its place.
    fn keep_shape(&mut self, frame: usize) -> Result<Option<KeepShapeRecord>, SoftBodyError> {
        if self.grasp.phase() != Phase::Deforming {
            return Ok(None);
        }
        let rest_volume_before_m3 = self.object.rest_volume_m3();
        let deformed_volume_m3 = self.object.volume_m3();
        let largest_before_m = self.object.largest_displacement_m();
        self.object.keep_shape()?;
        self.grasp.release();
        self.let_go();
        self.pose = self.place;
        self.proxy.reset();
        self.touching = [false; 5];
        self.grasp_events.push(GraspEvent::KeptShape);
        Ok(Some(KeepShapeRecord {
            frame,
            rest_volume_before_m3,
            deformed_volume_m3,
            rest_volume_after_m3: self.object.rest_volume_m3(),
            largest_displacement_before_m: largest_before_m,
            largest_displacement_after_m: self.object.largest_displacement_m(),
        }))
    }

    fn world_positions(&self) -> Vec<[f64; 3]> {
        self.object
            .positions()
            .iter()
            .map(|&p| self.pose.point(DVec3::from_array(p)).to_array())
            .collect()
    }

    fn snapshot(&self, frame: usize, name: &str) -> Snapshot {
        Snapshot {
            frame,
            name: name.to_owned(),
            positions: self.world_positions(),
            displacement_m: self
                .object
                .displacements()
                .iter()
                .map(|&u| DVec3::from_array(u).length())
                .collect(),
            hand: self.hand,
            touching: self.touching,
        }
    }
}

fn in_world(model: &HandModel, object: &Rigid, posture: &Posture) -> HandPose {
    model.pose(&object.after(&posture.wrist).into(), &posture.angles)
}

/// Measures one stage after another.
struct Stopwatch(Instant);

impl Stopwatch {
    fn start() -> Self {
        Self(Instant::now())
    }

    fn lap(&mut self) -> Duration {
        let now = Instant::now();
        let lap = now - self.0;
        self.0 = now;
        lap
    }
}
