//! Repeatable randomness for the script: the differences between two people.

/// `SplitMix64` (G. Steele, D. Lea, C. Flood, *Fast splittable pseudorandom number
/// generators*, OOPSLA 2014): the same numbers on every machine and version.
pub(super) struct SplitMix64(u64);

impl SplitMix64 {
    pub(super) fn new(seed: u64) -> Self {
        Self(seed)
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Uniform in `[−1, 1)`.
    pub(super) fn signed(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

/// A smooth wander around zero, at most `amplitude` away: the tremor of a hand
/// that tries to hold still, slow enough to be seen and not to buzz.
pub(super) struct Tremor {
    waves: [(f64, f64); 3],
    amplitude: f64,
}

impl Tremor {
    pub(super) fn new(random: &mut SplitMix64, amplitude: f64) -> Self {
        let waves = [0.7, 1.9, 4.3].map(|hertz: f64| {
            let frequency = hertz * (1.0 + 0.2 * random.signed());
            (
                std::f64::consts::TAU * frequency,
                std::f64::consts::PI * random.signed(),
            )
        });
        Self { waves, amplitude }
    }

    pub(super) fn at(&self, time_s: f64) -> f64 {
        let sum: f64 = self
            .waves
            .iter()
            .map(|(omega, phase)| (omega * time_s + phase).sin())
            .sum();
        self.amplitude * sum / 3.0
    }
}
