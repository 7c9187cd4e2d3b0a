//! Laws of raw recordings, for arbitrary bytes.
//!
//! Each function derives everything from its bytes and panics where a law is broken.

use std::io::{Read, Result};

use glove_io::recording::raw::{
    Chunk, Content, DeviceDescription, RawError, RawReader, RawRecorder,
};

/// Length of the header of a recording and of a chunk without payload.
const FILE_HEADER: u64 = 24;
const CHUNK_FRAME: u64 = 24;
const MARK: &[u8] = b"\xA7CK\x9C";

/// Hands out at most `piece` bytes at a time.
struct InPieces<'a> {
    bytes: &'a [u8],
    piece: usize,
}

impl Read for InPieces<'_> {
    fn read(&mut self, out: &mut [u8]) -> Result<usize> {
        let len = out.len().min(self.piece);
        self.bytes.read(&mut out[..len])
    }
}

/// What a reader found: encoded chunks, damage, bytes skipped and torn.
#[derive(Debug, PartialEq)]
struct Found {
    chunks: Vec<Vec<u8>>,
    damage: Vec<u64>,
    skipped: u64,
    torn: u64,
}

/// Reads all of a recording; `None` if it has no good header.
fn read(bytes: &[u8], piece: usize) -> Option<Found> {
    let mut reader = RawReader::new(InPieces { bytes, piece }).ok()?;
    let mut found = Found {
        chunks: Vec::new(),
        damage: Vec::new(),
        skipped: 0,
        torn: 0,
    };
    loop {
        match reader.next_chunk() {
            Ok(Some(chunk)) => found.chunks.push(encode(&chunk)),
            Ok(None) => break,
            Err(RawError::Damaged { offset, .. }) => found.damage.push(offset),
            Err(error) => panic!("reading from memory cannot fail: {error}"),
        }
    }
    assert!(reader.next_chunk().is_ok_and(|chunk| chunk.is_none()));
    found.skipped = reader.skipped_bytes();
    found.torn = reader.torn_bytes();
    Some(found)
}

/// The bytes of one chunk, by which the laws compare.
fn encode(chunk: &Chunk) -> Vec<u8> {
    let mut recorder = RawRecorder::new(Vec::new(), 0).expect("memory takes everything");
    let header = recorder.get_ref().len();
    recorder
        .record(chunk)
        .expect("what was read can be written");
    recorder.into_inner().split_off(header)
}

/// Any bytes as a file: pieces do not matter, every byte is accounted for, damage is
/// reported in order, and chunks come back as the bytes they were read from.
pub(crate) fn check_any_file(data: &[u8]) {
    let Some((&piece, bytes)) = data.split_first() else {
        return;
    };
    let found = read(bytes, usize::MAX);
    assert_eq!(read(bytes, usize::from(piece).max(1)), found);
    let Some(found) = found else {
        return;
    };
    let in_chunks: usize = found.chunks.iter().map(Vec::len).sum();
    assert_eq!(
        FILE_HEADER + in_chunks as u64 + found.skipped + found.torn,
        bytes.len() as u64
    );
    assert_eq!(found.damage.is_empty(), found.skipped == 0);
    assert!(found.damage.is_sorted_by(|a, b| a < b));
    let mut rest = bytes;
    for chunk in &found.chunks {
        let place = rest.windows(chunk.len()).position(|part| part == chunk);
        rest = &rest[place.expect("a chunk is a part of the file") + chunk.len()..];
    }
}

/// Takes `len` bytes off the front, or as many as there are.
fn take<'a>(data: &mut &'a [u8], len: usize) -> &'a [u8] {
    let (taken, rest) = data.split_at(len.min(data.len()));
    *data = rest;
    taken
}

fn take_byte(data: &mut &[u8]) -> u8 {
    take(data, 1).first().copied().unwrap_or(0)
}

fn take_number(data: &mut &[u8]) -> u64 {
    take(data, 8).iter().fold(0, |n, &b| n << 8 | u64::from(b))
}

/// Something recorded, chosen by the bytes.
struct Entry<'a> {
    kind: u8,
    device: u8,
    time_ns: u64,
    bytes: &'a [u8],
    text: String,
}

impl<'a> Entry<'a> {
    fn take(data: &mut &'a [u8]) -> Self {
        let kind = take_byte(data);
        let device = take_byte(data);
        let time_ns = take_number(data);
        let len = usize::from(take_byte(data));
        let bytes = take(data, len);
        // Without the characters that cannot be part of a name.
        let text = String::from_utf8_lossy(bytes).replace(['\n', '='], " ");
        Self {
            kind,
            device,
            time_ns,
            bytes,
            text,
        }
    }

    fn chunk(&self) -> Chunk<'_> {
        let content = match self.kind % 4 {
            0 => Content::FromDevice(self.bytes),
            1 => Content::ToDevice(self.bytes),
            2 => Content::Note(&self.text),
            _ => {
                let (key, value) = (format!("k{}", self.text), format!("={}", self.text));
                Content::Description(DeviceDescription::new("cyberglove").with(key, value))
            }
        };
        Chunk {
            device: self.device,
            time_ns: self.time_ns,
            content,
        }
    }
}

/// What was recorded comes back; a beginning of the file gives a beginning of the
/// chunks and no damage; a changed byte is noticed and costs the chunk it is in.
pub(crate) fn check_round_trip(data: &[u8]) {
    let mut data = data;
    let (cut, place, change) = (
        take_number(&mut data),
        take_number(&mut data),
        take_byte(&mut data).max(1),
    );
    let mut entries = Vec::new();
    while !data.is_empty() {
        entries.push(Entry::take(&mut data));
    }

    let mut recorder = RawRecorder::new(Vec::new(), cut).expect("memory takes everything");
    let mut ends = Vec::new();
    for entry in &entries {
        recorder.record(&entry.chunk()).expect("short enough");
        ends.push(recorder.get_ref().len());
    }
    let mut file = recorder.into_inner();
    let whole = read(&file, 7).expect("a good header");
    assert!(whole.damage.is_empty());
    assert_eq!((whole.skipped, whole.torn), (0, 0));

    // Value for value, and its length.
    let mut reader = RawReader::new(file.as_slice()).expect("a good header");
    assert_eq!(reader.start_unix_ns(), cut);
    let mut start = FILE_HEADER;
    for (entry, &end) in entries.iter().zip(&ends) {
        assert_eq!(reader.offset(), start);
        let chunk = reader
            .next_chunk()
            .expect("undamaged")
            .expect("not the end");
        assert_eq!(chunk, entry.chunk());
        if let Content::FromDevice(bytes) | Content::ToDevice(bytes) = chunk.content {
            assert_eq!(start + CHUNK_FRAME + bytes.len() as u64, end as u64);
        }
        start = end as u64;
    }

    // A beginning.
    let modulo = |n: u64, len: usize| usize::try_from(n % len as u64).expect("below len");
    let cut = modulo(cut, file.len() + 1);
    if let Some(part) = read(&file[..cut], usize::MAX) {
        let complete = ends.iter().filter(|&&end| end <= cut).count();
        assert_eq!(part.chunks, whole.chunks[..complete]);
        assert!(part.damage.is_empty());
        let end = ends[..complete]
            .last()
            .map_or(FILE_HEADER, |&end| end as u64);
        assert_eq!(part.torn, cut as u64 - end);
    } else {
        assert!((cut as u64) < FILE_HEADER);
    }

    // A changed byte. Bytes of a device that are themselves a chunk would be found
    // in place of the damaged one.
    if entries
        .iter()
        .any(|entry| entry.bytes.windows(4).any(|part| part == MARK))
    {
        return;
    }
    let place = modulo(place, file.len());
    file[place] ^= change;
    if let Some(damaged) = read(&file, usize::MAX) {
        let hit = ends.iter().filter(|&&end| end <= place).count();
        let mut expected = whole.chunks;
        let lost = expected.remove(hit);
        assert_eq!(damaged.chunks, expected);
        assert_eq!(damaged.damage, [(ends[hit] - lost.len()) as u64]);
        assert_eq!(damaged.skipped, lost.len() as u64);
    } else {
        assert!((place as u64) < FILE_HEADER);
    }
}
