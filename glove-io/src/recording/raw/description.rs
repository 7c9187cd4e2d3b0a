//! What a device is and how it is set up.

use super::RawError;

/// The kind of a device and the settings that its parser needs.
///
/// Kinds and keys are free; a reader ignores keys that it does not know. The
/// kinds of this crate's devices are `cyberglove` and `fastrak`.
///
/// # Example
///
/// ```
/// use glove_io::recording::raw::DeviceDescription;
///
/// let tracker = DeviceDescription::new("fastrak")
///     .with("items", "2,11,0")
///     .with("encoding", "binary");
/// assert_eq!(tracker.setting("items"), Some("2,11,0"));
/// assert_eq!(tracker.setting("units"), None);
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DeviceDescription {
    kind: String,
    settings: Vec<(String, String)>,
}

impl DeviceDescription {
    /// A device of this kind without settings.
    #[must_use]
    pub fn new(kind: impl Into<String>) -> Self {
        Self {
            kind: kind.into(),
            settings: Vec::new(),
        }
    }

    /// The same with one setting more; the last of equal keys counts.
    #[must_use]
    pub fn with(mut self, key: impl Into<String>, value: impl Into<String>) -> Self {
        self.settings.push((key.into(), value.into()));
        self
    }

    /// What the device is.
    #[must_use]
    pub fn kind(&self) -> &str {
        &self.kind
    }

    /// The value of a setting.
    #[must_use]
    pub fn setting(&self, key: &str) -> Option<&str> {
        let found = self.settings().rev().find(|(name, _)| *name == key);
        found.map(|(_, value)| value)
    }

    /// All settings in their order.
    pub fn settings(&self) -> impl DoubleEndedIterator<Item = (&str, &str)> {
        self.settings
            .iter()
            .map(|(key, value)| (key.as_str(), value.as_str()))
    }

    /// Appends the payload of a chunk.
    pub(super) fn write_to(&self, out: &mut Vec<u8>) -> Result<(), RawError> {
        let refuse = |text: &str| {
            Err(RawError::BadDescription {
                text: text.to_owned(),
            })
        };
        if !is_name(&self.kind) {
            return refuse(&self.kind);
        }
        out.extend_from_slice(self.kind.as_bytes());
        for (key, value) in self.settings() {
            if !is_name(key) {
                return refuse(key);
            }
            if value.contains('\n') {
                return refuse(value);
            }
            for part in ["\n", key, "=", value] {
                out.extend_from_slice(part.as_bytes());
            }
        }
        Ok(())
    }

    /// Reads the payload of a chunk.
    pub(super) fn parse(text: &str) -> Option<Self> {
        let mut lines = text.split('\n');
        let kind = lines.next().filter(|kind| is_name(kind))?;
        let mut description = Self::new(kind);
        for line in lines {
            let (key, value) = line.split_once('=')?;
            if !is_name(key) {
                return None;
            }
            description = description.with(key, value);
        }
        Some(description)
    }
}

/// Whether a kind or a key is unambiguous when written.
fn is_name(text: &str) -> bool {
    !text.is_empty() && !text.contains(['\n', '='])
}
