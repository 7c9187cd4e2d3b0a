//! The numbers of a PLY file.

use std::ops::Range;

use ply_rs_bw::ply::{Encoding, ScalarType};

use super::super::{
    error::{Problem, finite, number, quote, to_f32},
    splice::{Shortest, Splice},
};

/// What a number is stored as.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Kind {
    pub(super) fn of(scalar: &ScalarType) -> Self {
        match scalar {
            ScalarType::Char => Self::I8,
            ScalarType::UChar => Self::U8,
            ScalarType::Short => Self::I16,
            ScalarType::UShort => Self::U16,
            ScalarType::Int => Self::I32,
            ScalarType::UInt => Self::U32,
            ScalarType::Float => Self::F32,
            ScalarType::Double => Self::F64,
        }
    }

    /// Bytes in a binary file.
    pub(super) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    pub(super) fn is_real(self) -> bool {
        matches!(self, Self::F32 | Self::F64)
    }

    /// Reads a real number. Text is rounded to the type it is declared to have.
    pub(super) fn real(self, bytes: &[u8], encoding: Encoding) -> Result<f64, Problem> {
        Ok(match (self, encoding) {
            (Self::F32, Encoding::Ascii) => number::<f32>(bytes)?.into(),
            (_, Encoding::Ascii) => number(bytes)?,
            (Self::F32, _) => f32::from_le_bytes(ordered(bytes, encoding)).into(),
            (_, _) => f64::from_le_bytes(ordered(bytes, encoding)),
        })
    }

    /// Reads a whole number.
    pub(super) fn whole(self, bytes: &[u8], encoding: Encoding) -> Result<i64, Problem> {
        if encoding == Encoding::Ascii {
            return number(bytes).map_err(|_| Problem::NotAnIndex { text: quote(bytes) });
        }
        Ok(match self {
            Self::I8 => i8::from_le_bytes(ordered(bytes, encoding)).into(),
            Self::U8 => u8::from_le_bytes(ordered(bytes, encoding)).into(),
            Self::I16 => i16::from_le_bytes(ordered(bytes, encoding)).into(),
            Self::U16 => u16::from_le_bytes(ordered(bytes, encoding)).into(),
            Self::I32 => i32::from_le_bytes(ordered(bytes, encoding)).into(),
            Self::U32 => u32::from_le_bytes(ordered(bytes, encoding)).into(),
            Self::F32 | Self::F64 => unreachable!("the header allows whole numbers only"),
        })
    }

    /// The finite real number that is stored for a value.
    pub(super) fn rounded(self, value: f64) -> Result<f64, Problem> {
        match self {
            Self::F32 => to_f32(value).map(f64::from),
            _ => finite(value),
        }
    }

    /// Puts a number that was [rounded](Self::rounded) in the place of another one.
    pub(super) fn replace(
        self,
        out: &mut Splice,
        place: Range<usize>,
        value: f64,
        encoding: Encoding,
    ) {
        let single = to_f32(value).ok().filter(|_| self == Self::F32);
        match (encoding, single) {
            (Encoding::Ascii, Some(value)) => out.replace(place, Shortest(value)),
            (Encoding::Ascii, None) => out.replace(place, Shortest(value)),
            (Encoding::BinaryBigEndian, Some(value)) => {
                out.replace_bytes(place, &value.to_be_bytes());
            }
            (Encoding::BinaryBigEndian, None) => out.replace_bytes(place, &value.to_be_bytes()),
            (Encoding::BinaryLittleEndian, Some(value)) => {
                out.replace_bytes(place, &value.to_le_bytes());
            }
            (Encoding::BinaryLittleEndian, None) => out.replace_bytes(place, &value.to_le_bytes()),
        }
    }
}

/// The bytes of a number, least significant first.
fn ordered<const N: usize>(bytes: &[u8], encoding: Encoding) -> [u8; N] {
    let mut array: [u8; N] = bytes.try_into().expect("as many as the type has");
    if encoding == Encoding::BinaryBigEndian {
        array.reverse();
    }
    array
}
