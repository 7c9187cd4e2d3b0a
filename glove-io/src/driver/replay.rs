//! From recorded bytes to samples, by the parsers that the devices themselves use.

use super::Device;
use super::record::{STARTING, STATE};
use crate::Counters;
use crate::recording::raw::{Chunk, Content, DeviceDescription};

/// A sample of a recording and when it came.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Replayed<S> {
    /// The sample.
    pub value: S,
    /// When the first of its bytes was read, nanoseconds of the recording's clock.
    pub first_byte_ns: u64,
    /// When the last of its bytes was read.
    pub last_byte_ns: u64,
}

/// One device of a recording. The samples are those that the driver handed out when
/// the recording was made, with their times.
pub struct Replay<D> {
    device: Option<D>,
    first_byte_ns: u64,
    /// Counters of the starts before this one.
    before: Counters,
}

impl<D: Device> Default for Replay<D> {
    fn default() -> Self {
        Self {
            device: None,
            first_byte_ns: 0,
            before: Counters::default(),
        }
    }
}

impl<D: Device> Replay<D> {
    /// Takes the next chunk of this device and hands out the samples it completes.
    /// Bytes of start-ups are passed over.
    ///
    /// # Errors
    ///
    /// [`ReplayError`] if a description is of another kind of device or lacks what
    /// the parser needs; what follows it is passed over.
    pub fn take(
        &mut self,
        chunk: &Chunk<'_>,
        mut sink: impl FnMut(Replayed<D::Sample>),
    ) -> Result<(), ReplayError> {
        match &chunk.content {
            Content::Description(description) => {
                self.before = self.counters();
                self.device = None;
                if description.kind() != D::KIND {
                    return Err(ReplayError::Kind {
                        expected: D::KIND,
                        found: description.kind().to_owned(),
                    });
                }
                if description.setting(STATE) != Some(STARTING) {
                    self.device = Some(D::from_description(description)?);
                }
            }
            Content::FromDevice(bytes) => {
                if let Some(device) = &mut self.device {
                    let now = chunk.time_ns;
                    if device.pending() == 0 {
                        self.first_byte_ns = now;
                    }
                    let first = &mut self.first_byte_ns;
                    device.receive(bytes, &mut |value| {
                        sink(Replayed {
                            value,
                            first_byte_ns: *first,
                            last_byte_ns: now,
                        });
                        *first = now;
                    });
                }
            }
            Content::ToDevice(_) | Content::Note(_) => {}
        }
        Ok(())
    }

    /// Statistics over all starts.
    #[must_use]
    pub fn counters(&self) -> Counters {
        let now = self.device.as_ref().map(Device::counters);
        self.before.plus(now.unwrap_or_default())
    }
}

/// Why the bytes of a device cannot be understood.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ReplayError {
    /// The device is another one.
    #[error("the recording describes a device of kind `{found}` instead of `{expected}`")]
    Kind {
        /// The kind asked for.
        expected: &'static str,
        /// The kind in the recording.
        found: String,
    },
    /// A setting is missing or unknown.
    #[error("the description of the device has {}", match value {
        Some(value) => format!("`{key}={value}`, which is unknown"),
        None => format!("no setting `{key}`"),
    })]
    Setting {
        /// The setting.
        key: &'static str,
        /// Its value, if it is there.
        value: Option<String>,
    },
}

/// Reads a setting of a description.
pub(super) fn setting<T>(
    description: &DeviceDescription,
    key: &'static str,
    read: impl FnOnce(&str) -> Option<T>,
) -> Result<T, ReplayError> {
    let value = description.setting(key);
    value.and_then(read).ok_or_else(|| ReplayError::Setting {
        key,
        value: value.map(str::to_owned),
    })
}
