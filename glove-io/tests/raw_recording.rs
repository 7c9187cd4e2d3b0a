//! Raw recordings: what was recorded comes back, whatever happens to the file.

#[path = "laws/raw_recording.rs"]
mod laws;

use std::fs::{self, File};
use std::io::Write;
use std::path::PathBuf;
use std::time::Duration;

use glove_io::recording::raw::{
    Chunk, Content, Damage, DeviceDescription, MAX_PAYLOAD, Player, RawError, RawReader,
    RawRecorder,
};
use proptest::prelude::*;

fn bytes_at(time_ns: u64, bytes: &[u8]) -> Chunk<'_> {
    Chunk {
        device: 0,
        time_ns,
        content: Content::FromDevice(bytes),
    }
}

fn recording(chunks: &[Chunk]) -> Vec<u8> {
    let mut recorder = RawRecorder::new(Vec::new(), 0).unwrap();
    for chunk in chunks {
        recorder.record(chunk).unwrap();
    }
    recorder.into_inner()
}

/// A file of its own for each test.
fn file(name: &str, content: &[u8]) -> (PathBuf, File) {
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    fs::write(&path, content).unwrap();
    (path.clone(), open(&path))
}

fn open(path: &PathBuf) -> File {
    File::options().read(true).write(true).open(path).unwrap()
}

fn times(bytes: &[u8]) -> Vec<u64> {
    let mut reader = RawReader::new(bytes).unwrap();
    let mut times = Vec::new();
    while let Some(chunk) = reader.next_chunk().unwrap() {
        times.push(chunk.time_ns);
    }
    times
}

proptest! {
    /// Both laws, on random entries.
    #[test]
    fn what_was_recorded_comes_back(data in prop::collection::vec(any::<u8>(), 0..600)) {
        laws::check_round_trip(&data);
    }

    /// Pieces of recordings and of noise, as a file.
    #[test]
    fn any_file_is_read_without_panic(
        piece in any::<u8>(),
        good_header in any::<bool>(),
        parts in prop::collection::vec(
            (prop::collection::vec(any::<u8>(), 0..40), any::<bool>(), any::<prop::sample::Index>()),
            0..8,
        ),
    ) {
        let mut data = vec![piece];
        if good_header {
            data.extend(recording(&[]));
        }
        for (bytes, as_chunk, cut) in parts {
            if as_chunk {
                let mut chunk = recording(&[bytes_at(9, &bytes)]).split_off(24);
                // As often as not the whole chunk.
                chunk.truncate(cut.index(2 * chunk.len()));
                data.extend(chunk);
            } else {
                data.extend(bytes);
            }
        }
        laws::check_any_file(&data);
    }

    /// A recording cut anywhere goes on, and then holds what it held and what was added.
    #[test]
    fn a_torn_recording_goes_on(lengths in prop::collection::vec(0..30_usize, 0..5), cut in any::<prop::sample::Index>()) {
        let payloads: Vec<_> = lengths.iter().map(|&len| vec![0x55; len]).collect();
        let chunks: Vec<_> = (1..).zip(&payloads).map(|(time, bytes)| bytes_at(time, bytes)).collect();
        let whole = recording(&chunks);
        let cut = cut.index(whole.len() + 1);
        let (path, torn) = file("torn.graw", &whole[..cut]);
        let (mut recorder, appended) = RawRecorder::append(torn, 0).unwrap();
        recorder.record(&bytes_at(100, b"new")).unwrap();

        let mut kept = 0;
        let mut end = 24;
        for payload in &payloads {
            if end + 24 + payload.len() > cut {
                break;
            }
            end += 24 + payload.len();
            kept += 1;
        }
        let mut expected: Vec<u64> = (1..=kept).collect();
        prop_assert_eq!(appended.chunks, kept);
        prop_assert_eq!(appended.latest_time_ns, kept);
        let torn_bytes = if cut < 24 { cut } else { cut - end };
        prop_assert_eq!(appended.cut_off, torn_bytes as u64);
        expected.push(100);
        prop_assert_eq!(times(&fs::read(path).unwrap()), expected);
    }
}

#[test]
fn every_changed_byte_is_noticed() {
    let file = recording(&[
        bytes_at(1, b"G\x80"),
        Chunk {
            device: 1,
            time_ns: 2,
            content: Content::Description(DeviceDescription::new("fastrak").with("units", "cm")),
        },
        Chunk {
            device: 1,
            time_ns: 3,
            content: Content::Note("the end"),
        },
    ]);
    for place in 0..file.len() {
        for change in 1..=u8::MAX {
            let mut damaged = file.clone();
            damaged[place] ^= change;
            let errors = match RawReader::new(damaged.as_slice()) {
                Err(_) => 1,
                Ok(mut reader) => {
                    let mut errors = 0;
                    loop {
                        match reader.next_chunk() {
                            Ok(Some(_)) => {}
                            Ok(None) => break errors,
                            Err(_) => errors += 1,
                        }
                    }
                }
            };
            assert_eq!(errors, 1, "byte {place}, change {change}");
        }
    }
}

#[test]
fn lost_bytes_cost_one_chunk() {
    let whole = recording(&[
        bytes_at(1, b"first"),
        bytes_at(2, b"second"),
        bytes_at(3, b"third"),
    ]);
    let second = 24 + 24 + 5;
    for place in second..second + 24 + 6 {
        let mut file = whole.clone();
        file.remove(place);
        let mut reader = RawReader::new(file.as_slice()).unwrap();
        assert_eq!(reader.next_chunk().unwrap().unwrap().time_ns, 1);
        let error = reader.next_chunk().unwrap_err();
        assert!(
            matches!(error, RawError::Damaged { offset, .. } if offset == second as u64),
            "{error}"
        );
        assert_eq!(reader.next_chunk().unwrap().unwrap().time_ns, 3);
        assert_eq!(reader.skipped_bytes(), 24 + 6 - 1);
        assert!(reader.next_chunk().unwrap().is_none());
    }
}

#[test]
fn errors_name_the_cause() {
    let open = |bytes: &[u8]| RawReader::new(bytes).map(|_| ()).unwrap_err();
    assert!(matches!(open(b"0 : 0 : 0"), RawError::NotARecording));
    assert!(matches!(open(b""), RawError::NoHeader { len: 0 }));
    let header = recording(&[]);
    assert!(matches!(
        open(&header[..23]),
        RawError::NoHeader { len: 23 }
    ));
    // As transferred by a program that changes line ends.
    let mut as_text = header.clone();
    as_text.remove(5);
    assert!(matches!(open(&as_text), RawError::NotARecording));
    let mut damaged = header.clone();
    damaged[12] ^= 1;
    assert!(matches!(open(&damaged), RawError::DamagedHeader));

    let mut recorder = RawRecorder::new(Vec::new(), 0).unwrap();
    let long = vec![0; MAX_PAYLOAD + 1];
    let error = recorder.record(&bytes_at(0, &long)).unwrap_err();
    assert!(matches!(error, RawError::TooLong { len: 65536 }));
    for bad in [
        DeviceDescription::new(""),
        DeviceDescription::new("a=b"),
        DeviceDescription::new("a\nb"),
        DeviceDescription::new("a").with("", "v"),
        DeviceDescription::new("a").with("k=", "v"),
        DeviceDescription::new("a").with("k", "1\n2"),
    ] {
        let content = Content::Description(bad);
        let error = recorder
            .record(&Chunk {
                device: 0,
                time_ns: 0,
                content,
            })
            .unwrap_err();
        assert!(matches!(error, RawError::BadDescription { .. }), "{error}");
    }
    assert_eq!(recorder.into_inner(), header, "nothing was written");

    for speed in [0.0, -1.0, f64::NAN] {
        let player = Player::new(RawReader::new(header.as_slice()).unwrap(), speed);
        assert!(matches!(player, Err(RawError::Speed { .. })));
    }
}

#[test]
fn a_newer_version_is_refused() {
    // Version 2 with the sum that zlib computes.
    let newer = b"\x89GRAW\r\n\x1a\x02\0\0\0\0\0\0\0\0\0\0\0\x9F\x7E\x4E\xA9";
    let error = RawReader::new(newer.as_slice()).map(|_| ()).unwrap_err();
    assert!(matches!(error, RawError::Version { version: 2 }), "{error}");
}

#[test]
fn the_longest_chunk_fits() {
    let long: Vec<u8> = (0..MAX_PAYLOAD).map(|k| k.to_le_bytes()[0]).collect();
    let file = recording(&[bytes_at(1, &long), bytes_at(2, b""), bytes_at(3, &long)]);
    let mut reader = RawReader::new(file.as_slice()).unwrap();
    for expected in [&long[..], b"", &long] {
        let chunk = reader.next_chunk().unwrap().unwrap();
        assert_eq!(chunk.content, Content::FromDevice(expected));
    }
    assert!(reader.next_chunk().unwrap().is_none());
}

#[test]
fn appending_refuses_damage_before_the_last_chunk() {
    let mut damaged = recording(&[bytes_at(1, b"first"), bytes_at(2, b"second")]);
    damaged[24 + 20] ^= 1;
    let (path, damaged_file) = file("damaged.graw", &damaged);
    let error = RawRecorder::append(damaged_file, 0).unwrap_err();
    let expected = Damage::Payload;
    assert!(
        matches!(error, RawError::Damaged { offset: 24, damage } if damage == expected),
        "{error}"
    );
    assert_eq!(fs::read(&path).unwrap(), damaged, "it is left as it was");

    let (path, text) = file("text.graw", b"0 : 0 : 0");
    assert!(matches!(
        RawRecorder::append(text, 0),
        Err(RawError::NotARecording)
    ));
    assert_eq!(fs::read(&path).unwrap(), b"0 : 0 : 0");
}

#[test]
fn appending_cuts_off_the_zeros_of_a_crashed_file_system() {
    let (path, mut zeros) = file("zeros.graw", &recording(&[bytes_at(1, b"first")]));
    let whole = fs::read(&path).unwrap();
    std::io::Seek::seek(&mut zeros, std::io::SeekFrom::End(0)).unwrap();
    zeros.write_all(&[0; 4096]).unwrap();
    let (_, appended) = RawRecorder::append(open(&path), 0).unwrap();
    assert_eq!((appended.chunks, appended.cut_off), (1, 4096));
    assert_eq!(fs::read(&path).unwrap(), whole);
}

#[test]
fn replay_keeps_the_times_at_any_speed() {
    let file = recording(&[
        bytes_at(500, b"a"),
        bytes_at(2_000_500, b"b"),
        bytes_at(400, b"late"),
        bytes_at(u64::MAX, b"c"),
    ]);
    let dues = |speed: f64| {
        let mut player = Player::new(RawReader::new(file.as_slice()).unwrap(), speed).unwrap();
        let mut dues = Vec::new();
        while let Some(due) = player.next_due().unwrap() {
            dues.push(due.after);
        }
        dues
    };
    let millis = Duration::from_millis;
    assert_eq!(dues(1.0)[..3], [millis(0), millis(2), millis(0)]);
    assert_eq!(dues(2.0)[..2], [millis(0), millis(1)]);
    assert_eq!(dues(0.5)[..2], [millis(0), millis(4)]);
    assert_eq!(dues(1e-300)[3], Duration::from_nanos(u64::MAX));
    assert_eq!(dues(f64::INFINITY), [Duration::ZERO; 4]);
}
