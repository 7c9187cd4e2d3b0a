//! What goes wrong on a real line.

use std::time::Duration;

/// Damage to the bytes a simulated device sends, the same for the same seed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Faults {
    /// Seed of the random numbers.
    pub seed: u64,
    /// Probability that a byte is lost.
    pub loss: f64,
    /// Probability that one bit of a byte is flipped.
    pub noise: f64,
    /// Probability that a byte arrives twice.
    pub repeat: f64,
    /// The device falls silent, in the middle of a record as a rule: how often.
    pub stall_every: Option<Duration>,
    /// For how long.
    pub stall: Duration,
    /// The plug is pulled: how often.
    pub unplug_every: Option<Duration>,
    /// How long until it is put back.
    pub unplugged: Duration,
}

impl Default for Faults {
    /// None. A stall takes 2 s and a pulled plug 3 s if they are asked for.
    fn default() -> Self {
        Self {
            seed: 1,
            loss: 0.0,
            noise: 0.0,
            repeat: 0.0,
            stall_every: None,
            stall: Duration::from_secs(2),
            unplug_every: None,
            unplugged: Duration::from_secs(3),
        }
    }
}

/// Faults and the state of their random numbers.
pub(super) struct Damage {
    faults: Faults,
    random: fastrand::Rng,
}

impl Damage {
    pub(super) fn new(faults: Faults) -> Self {
        Self {
            faults,
            random: fastrand::Rng::with_seed(faults.seed),
        }
    }

    /// Appends what is left of `bytes` to `out`.
    pub(super) fn pass(&mut self, bytes: &[u8], out: &mut impl Extend<u8>) {
        let Faults {
            loss,
            noise,
            repeat,
            ..
        } = self.faults;
        for &byte in bytes {
            if self.random.f64() < loss {
                continue;
            }
            let flip = self.random.f64() < noise;
            let byte = if flip {
                byte ^ (1 << self.random.u8(..8))
            } else {
                byte
            };
            let twice = self.random.f64() < repeat;
            out.extend(std::iter::repeat_n(byte, 1 + usize::from(twice)));
        }
    }
}
