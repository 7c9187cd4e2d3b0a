//! The bytes of headers and chunks.

use super::{Chunk, Content, Damage, DeviceDescription, MAX_PAYLOAD, RawError};

/// What a recording begins with. The first byte is no ASCII, and the line ends
/// and Ctrl-Z do not survive a transfer as text.
pub(super) const MAGIC: [u8; 8] = *b"\x89GRAW\r\n\x1a";
/// The version written and read.
const VERSION: u32 = 1;
/// Length of the header of a file.
pub(super) const FILE_HEADER_LEN: usize = 24;

/// What a chunk begins with. No byte of it occurs twice, so no two marks overlap.
pub(super) const MARK: [u8; 4] = [0xA7, b'C', b'K', 0x9C];
/// Length of the header of a chunk.
pub(super) const CHUNK_HEADER_LEN: usize = 20;
/// Length of a checksum.
const SUM_LEN: usize = 4;
/// Length of the longest chunk.
pub(super) const MAX_CHUNK: usize = CHUNK_HEADER_LEN + MAX_PAYLOAD + SUM_LEN;

const FROM_DEVICE: u8 = 0;
const TO_DEVICE: u8 = 1;
const NOTE: u8 = 2;
const DESCRIPTION: u8 = 3;

/// The header of a file.
pub(super) fn encode_file_header(start_unix_ns: u64) -> [u8; FILE_HEADER_LEN] {
    let mut out = [0; FILE_HEADER_LEN];
    out[..8].copy_from_slice(&MAGIC);
    out[8..12].copy_from_slice(&VERSION.to_le_bytes());
    out[12..20].copy_from_slice(&start_unix_ns.to_le_bytes());
    let sum = crc32fast::hash(&out[..20]);
    out[20..].copy_from_slice(&sum.to_le_bytes());
    out
}

/// The wall clock of a header, which may be cut short.
pub(super) fn decode_file_header(bytes: &[u8]) -> Result<u64, RawError> {
    if !bytes.starts_with(&MAGIC[..bytes.len().min(MAGIC.len())]) {
        return Err(RawError::NotARecording);
    }
    let Some(header) = bytes.first_chunk::<FILE_HEADER_LEN>() else {
        return Err(RawError::NoHeader { len: bytes.len() });
    };
    if u32_at(header, 20) != crc32fast::hash(&header[..20]) {
        return Err(RawError::DamagedHeader);
    }
    match u32_at(header, 8) {
        VERSION => Ok(u64_at(header, 12)),
        version => Err(RawError::Version { version }),
    }
}

/// Replaces what is in `out` by the bytes of a chunk.
pub(super) fn encode_chunk(chunk: &Chunk, out: &mut Vec<u8>) -> Result<(), RawError> {
    out.clear();
    out.resize(CHUNK_HEADER_LEN, 0);
    let kind = match &chunk.content {
        Content::FromDevice(bytes) => {
            out.extend_from_slice(bytes);
            FROM_DEVICE
        }
        Content::ToDevice(bytes) => {
            out.extend_from_slice(bytes);
            TO_DEVICE
        }
        Content::Note(text) => {
            out.extend_from_slice(text.as_bytes());
            NOTE
        }
        Content::Description(description) => {
            description.write_to(out)?;
            DESCRIPTION
        }
    };
    let (header, payload) = out.split_at_mut(CHUNK_HEADER_LEN);
    let len = payload.len();
    let payload_len = u16::try_from(len).map_err(|_| RawError::TooLong { len })?;
    let payload_sum = crc32fast::hash(payload);
    header[..4].copy_from_slice(&MARK);
    header[4] = kind;
    header[5] = chunk.device;
    header[6..8].copy_from_slice(&payload_len.to_le_bytes());
    header[8..16].copy_from_slice(&chunk.time_ns.to_le_bytes());
    let header_sum = crc32fast::hash(&header[..16]);
    header[16..].copy_from_slice(&header_sum.to_le_bytes());
    out.extend_from_slice(&payload_sum.to_le_bytes());
    Ok(())
}

/// What the front of some bytes is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Front {
    /// A chunk of this many bytes, checksums right.
    Whole(usize),
    /// As far as they go, the bytes may become a chunk; so many are needed to
    /// tell more.
    Needs(usize),
    /// No chunk.
    Damaged(Damage),
}

/// Examines the front of `bytes`, which are never empty.
pub(super) fn examine(bytes: &[u8]) -> Front {
    if !bytes.starts_with(&MARK[..bytes.len().min(MARK.len())]) {
        return Front::Damaged(Damage::Mark);
    }
    let Some(header) = bytes.first_chunk::<CHUNK_HEADER_LEN>() else {
        return Front::Needs(CHUNK_HEADER_LEN);
    };
    if u32_at(header, 16) != crc32fast::hash(&header[..16]) {
        return Front::Damaged(Damage::Header);
    }
    let payload_end = CHUNK_HEADER_LEN + usize::from(u16::from_le_bytes([header[6], header[7]]));
    let len = payload_end + SUM_LEN;
    if bytes.len() < len {
        return Front::Needs(len);
    }
    if u32_at(bytes, payload_end) != crc32fast::hash(&bytes[CHUNK_HEADER_LEN..payload_end]) {
        return Front::Damaged(Damage::Payload);
    }
    Front::Whole(len)
}

/// The content of a chunk that [`examine`] calls whole.
pub(super) fn decode_chunk(bytes: &[u8]) -> Result<Chunk<'_>, Damage> {
    let payload = &bytes[CHUNK_HEADER_LEN..bytes.len() - SUM_LEN];
    let text = || str::from_utf8(payload).map_err(|_| Damage::Text);
    let content = match bytes[4] {
        FROM_DEVICE => Content::FromDevice(payload),
        TO_DEVICE => Content::ToDevice(payload),
        NOTE => Content::Note(text()?),
        DESCRIPTION => Content::Description(DeviceDescription::parse(text()?).ok_or(Damage::Text)?),
        _ => return Err(Damage::Kind),
    };
    Ok(Chunk {
        device: bytes[5],
        time_ns: u64_at(bytes, 8),
        content,
    })
}

fn u32_at(bytes: &[u8], place: usize) -> u32 {
    let four = bytes[place..]
        .first_chunk()
        .expect("the length was checked");
    u32::from_le_bytes(*four)
}

fn u64_at(bytes: &[u8], place: usize) -> u64 {
    let eight = bytes[place..]
        .first_chunk()
        .expect("the length was checked");
    u64::from_le_bytes(*eight)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The format as documented, byte for byte; the sums were computed with
    /// another implementation (zlib).
    #[test]
    fn documented_bytes() {
        let header = encode_file_header(0x0102_0304_0506_0708);
        assert_eq!(
            header,
            *b"\x89GRAW\r\n\x1a\x01\0\0\0\x08\x07\x06\x05\x04\x03\x02\x01\x23\x9E\x3E\x1E"
        );
        let mut out = Vec::new();
        let chunk = Chunk {
            device: 5,
            time_ns: 0x0A0B,
            content: Content::ToDevice(b"?S"),
        };
        encode_chunk(&chunk, &mut out).unwrap();
        assert_eq!(
            out,
            b"\xA7CK\x9C\x01\x05\x02\0\x0B\x0A\0\0\0\0\0\0\x8F\xB1\x4D\x16?S\x8D\x38\x65\xEB"
        );
        assert_eq!(examine(&out), Front::Whole(26));
        assert_eq!(decode_chunk(&out), Ok(chunk));
    }
}
