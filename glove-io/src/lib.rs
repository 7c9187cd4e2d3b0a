//! CyberGlove and FASTRAK: parsers, encoders, simulators, calibration and hand kinematics.
//!
//! An instrumented glove measures how the fingers bend, an electromagnetic
//! tracker where the wrist is. This crate turns the bytes of both into numbers
//! in SI units and back, without doing any input or output itself: a caller
//! who owns a serial port, a socket or a file pushes the bytes in and receives
//! records.
//!
//! | module | what it does | needs |
//! |---|---|---|
//! | [`cyberglove`] | records, queries and settings of the CyberGlove I and II, packets of the III | `core` |
//! | [`fastrak`] | data records of the Polhemus FASTRAK, to and from world poses | `core` |
//! | [`Calibration`] | sensor bytes to joint angles and back | `core` |
#![cfg_attr(
    feature = "hand",
    doc = "| [`hand`] | forward kinematics of the hand | feature `hand` |"
)]
#![cfg_attr(
    feature = "std",
    doc = "| [`recording`] | recordings of raw bytes, joint angles and wrist poses | feature `std` |"
)]
#![cfg_attr(
    feature = "sim",
    doc = "| [`sim`] | devices that answer real commands with real bytes | feature `sim` |"
)]
//!
//! # Conventions
//!
//! Lengths are in metres and angles in radians. Poses are in the world frame
//! of OpenXR: right-handed, x right, y up, −z forward. Joint angles follow the
//! VirtualHand library: record order of the 22-sensor glove, flexion negative
//! (see [`JointAngles`]).
//!
//! # Without the standard library
//!
//! With `default-features = false` the crate is `no_std`, does not allocate
//! and depends on nothing but `thiserror`.

#![cfg_attr(not(any(feature = "std", test)), no_std)]

mod calibration;
mod counters;
pub mod cyberglove;
#[cfg(feature = "driver")]
pub mod driver;
pub mod fastrak;
#[cfg(feature = "hand")]
pub mod hand;
mod joints;
mod math;
mod pose;
#[cfg(feature = "std")]
pub mod recording;
#[cfg(feature = "sim")]
pub mod sim;

pub use calibration::{Calibration, CalibrationError, SensorCalibration};
pub use counters::Counters;
pub use joints::{JointAngles, SENSOR_COUNT, Sensor};
pub use pose::{Pose, PoseError, Quaternion};

// Compiles and runs the example of the README with the documentation tests.
#[cfg(all(doctest, feature = "sim"))]
#[doc = include_str!("../README.md")]
struct ReadmeExample;
