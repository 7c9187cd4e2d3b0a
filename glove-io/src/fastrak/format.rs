//! What the tracker is set to send.

/// The most items an output list may have.
pub const MAX_ITEMS: usize = 32;

/// The longest record in bytes, a limit of the tracker's output buffer.
pub const MAX_RECORD: usize = 254;

/// Length of the header: `0`, station, error letter.
pub(super) const HEADER_LEN: usize = 3;

/// One item of an output list.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Item {
    /// A blank (code 0; 50 means the same).
    Space,
    /// Carriage return and line feed (code 1; 51 means the same).
    CrLf,
    /// Position x, y, z (code 2).
    Position,
    /// Azimuth, elevation and roll in degrees (code 4).
    Angles,
    /// Quaternion, scalar first (code 11).
    Quaternion,
}

impl Item {
    /// The number that stands for the item in the `O` command.
    #[must_use]
    pub const fn code(self) -> u8 {
        match self {
            Self::Space => 0,
            Self::CrLf => 1,
            Self::Position => 2,
            Self::Angles => 4,
            Self::Quaternion => 11,
        }
    }

    /// The item with this number, if it is one of the supported ones.
    #[must_use]
    pub const fn from_code(code: u8) -> Option<Self> {
        match code {
            0 | 50 => Some(Self::Space),
            1 | 51 => Some(Self::CrLf),
            2 => Some(Self::Position),
            4 => Some(Self::Angles),
            11 => Some(Self::Quaternion),
            _ => None,
        }
    }

    /// Bytes of the item in a record.
    const fn len(self, encoding: Encoding) -> usize {
        let number = match encoding {
            Encoding::Ascii => super::field::WIDTH,
            Encoding::Binary => 4,
        };
        match self {
            Self::Space => 1,
            Self::CrLf => 2,
            Self::Position | Self::Angles => 3 * number,
            Self::Quaternion => 4 * number,
        }
    }
}

/// How numbers are sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Encoding {
    /// Text of fixed width (`F`), the state at power-up.
    #[default]
    Ascii,
    /// IEEE single-precision floats, little-endian (`f`).
    Binary,
}

/// In which unit positions are sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Units {
    /// Inches (`U`), the state at power-up.
    #[default]
    Inches,
    /// Centimetres (`u`).
    Centimetres,
}

impl Units {
    /// Length of the unit in metres.
    #[must_use]
    pub const fn metres(self) -> f64 {
        match self {
            Self::Inches => 0.0254,
            Self::Centimetres => 0.01,
        }
    }
}

/// The items of a record, in order.
///
/// # Example
///
/// ```
/// use glove_io::fastrak::{Item, OutputList};
///
/// // The list that VRPN asks for.
/// let list = OutputList::try_new(&[Item::Position, Item::Quaternion, Item::Space])?;
/// assert_eq!(list.items().len(), 3);
/// # Ok::<(), glove_io::fastrak::OutputListError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct OutputList {
    /// Beyond `count` all [`Item::Space`], so that equal lists compare equal.
    items: [Item; MAX_ITEMS],
    count: usize,
}

impl OutputList {
    /// Position, angles, CR LF (`2,4,1`): what the tracker sends at power-up.
    pub const DEFAULT: Self = Self::short([Item::Position, Item::Angles, Item::CrLf]);

    /// A list too short to exceed a limit.
    pub(crate) const fn short(items: [Item; 3]) -> Self {
        let mut list = Self {
            items: [Item::Space; MAX_ITEMS],
            count: 3,
        };
        let mut place = 0;
        while place < items.len() {
            list.items[place] = items[place];
            place += 1;
        }
        list
    }

    /// Takes the items of a list.
    ///
    /// # Errors
    ///
    /// * [`OutputListError::TooManyItems`] beyond [`MAX_ITEMS`].
    /// * [`OutputListError::TooLong`] if a record in text would exceed
    ///   [`MAX_RECORD`].
    pub fn try_new(items: &[Item]) -> Result<Self, OutputListError> {
        if items.len() > MAX_ITEMS {
            return Err(OutputListError::TooManyItems { count: items.len() });
        }
        let mut list = Self {
            items: [Item::Space; MAX_ITEMS],
            count: items.len(),
        };
        list.items[..items.len()].copy_from_slice(items);
        let len = list.record_len(Encoding::Ascii);
        if len > MAX_RECORD {
            return Err(OutputListError::TooLong { len });
        }
        Ok(list)
    }

    /// The items in order.
    #[must_use]
    pub fn items(&self) -> &[Item] {
        &self.items[..self.count]
    }

    fn record_len(&self, encoding: Encoding) -> usize {
        let items: usize = self.items().iter().map(|item| item.len(encoding)).sum();
        HEADER_LEN + items
    }
}

impl Default for OutputList {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// Why items do not make an output list.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum OutputListError {
    /// There are too many items.
    #[error("{count} items, but the tracker takes at most {MAX_ITEMS}")]
    TooManyItems {
        /// How many there are.
        count: usize,
    },
    /// A record would be too long.
    #[error("a record in text would take {len} bytes, but the tracker sends at most {MAX_RECORD}")]
    TooLong {
        /// Bytes of the record in text, header included.
        len: usize,
    },
}

/// Everything one must know to read a record.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct RecordFormat {
    /// The items after the header.
    pub items: OutputList,
    /// Text or binary.
    pub encoding: Encoding,
    /// Unit of positions.
    pub units: Units,
}

impl RecordFormat {
    /// Bytes of a record, header included; at most [`MAX_RECORD`].
    #[must_use]
    pub fn record_len(&self) -> usize {
        self.items.record_len(self.encoding)
    }

    /// Whether records end in a blank or a CR LF that can be checked.
    pub(super) fn has_end_mark(&self) -> bool {
        matches!(self.items.items().last(), Some(Item::Space | Item::CrLf))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_of_records() {
        let mut format = RecordFormat::default();
        assert_eq!(format.record_len(), 47);
        format.encoding = Encoding::Binary;
        assert_eq!(format.record_len(), 29);
        format.items =
            OutputList::try_new(&[Item::Position, Item::Quaternion, Item::Space]).unwrap();
        assert_eq!(format.record_len(), 32);
    }

    #[test]
    fn limits_of_the_tracker() {
        assert!(OutputList::try_new(&[Item::Space; 32]).is_ok());
        assert_eq!(
            OutputList::try_new(&[Item::Space; 33]),
            Err(OutputListError::TooManyItems { count: 33 })
        );
        assert_eq!(
            OutputList::try_new(&[Item::Quaternion; 9]),
            Err(OutputListError::TooLong { len: 255 })
        );
    }

    #[test]
    fn codes() {
        for code in 0..=u8::MAX {
            if let Some(item) = Item::from_code(code) {
                assert!(item.code() == code || item.code() + 50 == code);
            }
        }
    }
}
