//! What a driver hands out while it is recorded comes out of the recording again, sample
//! by sample and nanosecond by nanosecond, over damage and a pulled plug.

#![cfg(unix)]

use std::io::Write;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use glove_io::driver::{
    Backoff, CyberGlove, Device, Driver, Fastrak, Options, Replay, Replayed, SessionRecorder,
    Stamped, serial,
};
use glove_io::recording::raw::{RawError, RawReader, RawRecorder};
use glove_io::sim::{
    self,
    host::{Endpoint, Faults, Host, Options as LineOptions},
};

/// A file in memory that can be looked at while it is written.
#[derive(Clone, Default)]
struct Memory(Arc<Mutex<Vec<u8>>>);

impl Write for Memory {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.lock().unwrap().extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// Records a device on a noisy line, with its plug pulled in between, and returns what
/// the driver handed out, with times since `start`, and the recording.
fn recorded<D: Device, S: sim::Device + Send + 'static>(
    name: &str,
    simulator: S,
    device: D,
) -> (Vec<Stamped<D::Sample>>, Instant, Vec<u8>) {
    let link = std::env::temp_dir().join(format!("glove-io-{}-{name}", std::process::id()));
    let line = LineOptions {
        faults: Faults {
            loss: 0.002,
            noise: 0.002,
            repeat: 0.002,
            ..Faults::default()
        },
        ..LineOptions::default()
    };
    let endpoint = Endpoint::Pty { link: link.clone() };
    let host = Host::spawn(&endpoint, simulator, |_, _| {}, line).unwrap();
    let file = Memory::default();
    let start = Instant::now();
    let session = SessionRecorder::new(RawRecorder::new(file.clone(), 0).unwrap(), start);
    let options = Options {
        tap: Some(session.tap(3, D::KIND)),
        silence: Duration::from_millis(300),
        backoff: Backoff {
            first: Duration::from_millis(20),
            longest: Duration::from_millis(50),
        },
        ..Options::default()
    };
    // The reader of the samples must be there before the first one: the port opens
    // only when it is.
    let gate = Arc::new(Mutex::new(()));
    let closed = gate.lock().unwrap();
    let mut connect = serial(link.to_string_lossy(), 115_200);
    let opening = Arc::clone(&gate);
    let driver = Driver::spawn(
        move || {
            drop(opening.lock());
            connect()
        },
        device,
        options,
    )
    .unwrap();
    let every = driver.subscribe(100_000);
    drop(closed);
    let patience = Duration::from_secs(30);
    let running = |starts: u64, samples: u64| {
        driver
            .wait_status(patience, |status| {
                status.starts >= starts && status.samples >= samples
            })
            .expect("samples come")
    };
    let first = running(1, 60);
    host.unplug(Duration::from_millis(100));
    running(first.starts + 1, first.samples + 60);
    driver.stop();
    assert!(session.take_error().is_none());
    let bytes = file.0.lock().unwrap().clone();
    (every.iter().collect(), start, bytes)
}

fn replayed<D: Device>(file: &[u8]) -> Vec<Replayed<D::Sample>> {
    let mut reader = RawReader::new(file).unwrap();
    let mut replay = Replay::<D>::default();
    let mut samples = Vec::new();
    while let Some(chunk) = reader.next_chunk().unwrap() {
        assert_eq!(chunk.device, 3);
        replay.take(&chunk, |sample| samples.push(sample)).unwrap();
    }
    assert_eq!(replay.counters().records, samples.len() as u64);
    samples
}

fn assert_same<D: Device>(live: &[Stamped<D::Sample>], start: Instant, file: &[u8])
where
    D::Sample: PartialEq + std::fmt::Debug,
{
    let replayed = replayed::<D>(file);
    assert_eq!(replayed.len(), live.len());
    let ns = |time: Instant| u64::try_from(time.duration_since(start).as_nanos()).unwrap();
    for (again, sample) in replayed.iter().zip(live) {
        assert_eq!(again.value, sample.value);
        assert_eq!(again.first_byte_ns, ns(sample.first_byte));
        assert_eq!(again.last_byte_ns, ns(sample.last_byte));
    }
}

#[test]
fn a_glove_session_replays_exactly() {
    let (live, start, file) = recorded(
        "glove-session",
        sim::CyberGlove::default(),
        CyberGlove::default(),
    );
    assert_same::<CyberGlove>(&live, start, &file);
}

#[test]
fn a_tracker_session_replays_exactly() {
    let (live, start, file) = recorded(
        "tracker-session",
        sim::Fastrak::default(),
        Fastrak::default(),
    );
    assert_same::<Fastrak>(&live, start, &file);
}

/// A disk that is full stops the recording, says so once, and not the driver.
#[test]
fn a_full_disk_does_not_stop_the_driver() {
    struct Full(usize);
    impl Write for Full {
        fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
            let count = bytes.len().min(self.0);
            self.0 -= count;
            if count == 0 {
                return Err(std::io::ErrorKind::StorageFull.into());
            }
            Ok(count)
        }
        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }
    let link = std::env::temp_dir().join(format!("glove-io-{}-full", std::process::id()));
    let endpoint = Endpoint::Pty { link: link.clone() };
    let glove = sim::CyberGlove::default();
    let _host = Host::spawn(&endpoint, glove, |_, _| {}, LineOptions::default()).unwrap();
    let recorder = RawRecorder::new(Full(1000), 0).unwrap();
    let session = SessionRecorder::new(recorder, Instant::now());
    let options = Options {
        tap: Some(session.tap(0, CyberGlove::KIND)),
        ..Options::default()
    };
    let connect = serial(link.to_string_lossy(), 115_200);
    let driver = Driver::spawn(connect, CyberGlove::default(), options).unwrap();
    driver
        .wait_status(Duration::from_secs(30), |status| status.samples > 100)
        .expect("samples come");
    assert!(matches!(session.take_error(), Some(RawError::Io(_))));
    assert!(session.take_error().is_none());
}
