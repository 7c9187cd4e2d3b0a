//! How often the glove samples.

/// Ticks per second of the clock that times the samples.
const CLOCK_HZ: f64 = 115_200.0;

/// Which byte of a 16-bit word of the setting `T` comes first: other drivers
/// disagree, and the manuals do not say.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum WordOrder {
    /// The least significant byte.
    #[default]
    LowFirst,
    /// The most significant byte.
    HighFirst,
}

/// The two words of the setting `T`: their product is the sample period in
/// ticks of 1/115200 s.
///
/// # Example
///
/// ```
/// use glove_io::cyberglove::{SamplePeriod, WordOrder};
///
/// let period = SamplePeriod([1440, 1]);
/// assert_eq!(period.seconds(), 1.0 / 80.0);
/// assert_eq!(period.to_bytes(WordOrder::HighFirst), [0x05, 0xA0, 0, 1]);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct SamplePeriod(pub [u16; 2]);

impl SamplePeriod {
    /// The period in seconds; zero if a word is, as a CyberGlove III reports.
    #[must_use]
    pub fn seconds(self) -> f64 {
        f64::from(self.0[0]) * f64::from(self.0[1]) / CLOCK_HZ
    }

    /// Reads the four bytes of `T` or of the reply to `?T`.
    #[must_use]
    pub fn from_bytes([a, b, c, d]: [u8; 4], order: WordOrder) -> Self {
        let word = match order {
            WordOrder::LowFirst => u16::from_le_bytes,
            WordOrder::HighFirst => u16::from_be_bytes,
        };
        Self([word([a, b]), word([c, d])])
    }

    /// The four bytes of `T`.
    #[must_use]
    pub fn to_bytes(self, order: WordOrder) -> [u8; 4] {
        let word = match order {
            WordOrder::LowFirst => u16::to_le_bytes,
            WordOrder::HighFirst => u16::to_be_bytes,
        };
        let [[a, b], [c, d]] = self.0.map(word);
        [a, b, c, d]
    }
}
