//! The thread of a driver: connect, start, receive, and again after a failure.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Receiver;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::Device;
use super::error::{DriverError, StartError};
use super::line::{Event, Line, PIECE, Tap, read_some};
use super::port::{Connect, Port, READ_TIMEOUT};
use super::samples::{Shared, Stamped, State, Status};
use crate::Counters;

/// How long a driver waits after a failure: first `first`, then twice as long
/// each time, but at most `longest`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Backoff {
    /// After the first failure.
    pub first: Duration,
    /// After many.
    pub longest: Duration,
}

impl Backoff {
    /// The wait after this many failures in a row, counted from 0.
    fn wait(&self, failures: u32) -> Duration {
        let doubled = self.first.saturating_mul(1 << failures.min(16));
        doubled.min(self.longest)
    }
}

/// How a driver treats its device.
pub struct Options {
    /// Without a sample for this long the device counts as lost.
    pub silence: Duration,
    /// A polled device is asked again after this long without an answer.
    pub request_again: Duration,
    /// The least time between two requests to a polled device; zero asks as soon
    /// as the last answer is complete.
    pub request_interval: Duration,
    /// Waits between tries.
    pub backoff: Backoff,
    /// Sees all bytes, if set; a [`SessionRecorder`](super::SessionRecorder) gives one.
    pub tap: Option<Tap>,
}

impl Default for Options {
    /// Lost after 1 s, asked again after 0.1 s, 100 requests a second at most,
    /// tries after 0.1 s, 0.2 s, … 5 s, no tap.
    fn default() -> Self {
        Self {
            silence: Duration::from_secs(1),
            request_again: Duration::from_millis(100),
            request_interval: Duration::from_millis(10),
            backoff: Backoff {
                first: Duration::from_millis(100),
                longest: Duration::from_secs(5),
            },
            tap: None,
        }
    }
}

/// A running driver. Dropping it stops it.
pub struct Driver<D: Device> {
    shared: Arc<Shared<D::Sample>>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl<D: Device> Driver<D> {
    /// Starts the thread, which opens the port with `connect` and starts `device`.
    ///
    /// This function returns at once; that the port is missing or the device is
    /// switched off shows in [`status`](Self::status), and the driver keeps trying.
    ///
    /// # Errors
    ///
    /// If the operating system refuses a thread.
    pub fn spawn(connect: impl Connect, device: D, options: Options) -> io::Result<Self> {
        let shared = Arc::new(Shared::new());
        let stop = Arc::new(AtomicBool::new(false));
        let mut worker = Worker {
            device,
            options,
            shared: Arc::clone(&shared),
            stop: Arc::clone(&stop),
            parsed: Counters::default(),
        };
        let thread = std::thread::Builder::new()
            .name("glove-io driver".to_owned())
            .spawn(move || {
                worker.run(connect);
                worker.shared.close();
            })?;
        Ok(Self {
            shared,
            stop,
            thread: Some(thread),
        })
    }

    /// The newest sample, if there was one. It stays when the device is lost; look
    /// at its time or at [`status`](Self::status).
    #[must_use]
    pub fn newest(&self) -> Option<Stamped<D::Sample>> {
        self.shared.newest()
    }

    /// The newest sample of one source (see [`Device::source`]).
    #[must_use]
    pub fn newest_of(&self, source: usize) -> Option<Stamped<D::Sample>> {
        self.shared.newest_of(source)
    }

    /// Sleeps until there is a sample with a greater [`sequence`](Stamped::sequence)
    /// than `than`, or any if that is `None`. `None` if none came within `patience`
    /// or the driver has stopped.
    #[must_use]
    pub fn wait_newer(&self, than: Option<u64>, patience: Duration) -> Option<Stamped<D::Sample>> {
        self.shared.wait_newer(than, patience)
    }

    /// Every sample from now on, through a channel that holds up to `capacity`.
    ///
    /// The driver never waits for the receiver: what finds the channel full is
    /// dropped and counted in [`Status::dropped_samples`].
    #[must_use]
    pub fn subscribe(&self, capacity: usize) -> Receiver<Stamped<D::Sample>> {
        self.shared.subscribe(capacity)
    }

    /// How the driver fares.
    #[must_use]
    pub fn status(&self) -> Status {
        self.shared.status()
    }

    /// Sleeps until the status is as `wanted`; `None` if it is not within `patience`.
    #[must_use]
    pub fn wait_status(
        &self,
        patience: Duration,
        wanted: impl Fn(&Status) -> bool,
    ) -> Option<Status> {
        self.shared.wait_status(patience, wanted)
    }

    /// Ends the device's stream, closes the port and waits for the thread.
    pub fn stop(self) {
        drop(self);
    }
}

impl<D: Device> Drop for Driver<D> {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // A panic of the thread (of a tap, say) has been reported by then.
            let _ = thread.join();
        }
    }
}

struct Worker<D: Device> {
    device: D,
    options: Options,
    shared: Arc<Shared<D::Sample>>,
    stop: Arc<AtomicBool>,
    /// Counters of the connections before this one.
    parsed: Counters,
}

impl<D: Device> Worker<D> {
    fn run(&mut self, mut connect: impl Connect) {
        let mut failures = 0;
        // A port that cannot be opened says nothing about the device.
        let mut attempt = 0;
        while !self.stopped() {
            self.shared
                .update(|status| status.state = State::Connecting);
            let samples = self.shared.status().samples;
            let error = match connect() {
                Ok(mut port) => match self.serve(port.as_mut(), attempt) {
                    Ok(()) => return,
                    Err(error) => {
                        attempt += 1;
                        error
                    }
                },
                Err(error) => DriverError::Connect(Arc::new(error)),
            };
            // A device that worked gets a fresh start.
            if self.shared.status().samples > samples {
                failures = 0;
                attempt = 0;
            }
            let wait = self.options.backoff.wait(failures);
            failures = failures.saturating_add(1);
            self.shared.update(|status| {
                status.state = State::Waiting;
                status.error = Some(error);
            });
            let begin = Instant::now();
            while let Some(left) = wait.checked_sub(begin.elapsed())
                && !self.stopped()
            {
                std::thread::sleep(left.min(READ_TIMEOUT));
            }
        }
    }

    fn stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Starts the device at an open port and receives until it fails, or, without
    /// an error, until the driver shall stop.
    fn serve(&mut self, port: &mut dyn Port, attempt: u32) -> Result<(), DriverError> {
        self.shared.update(|status| status.state = State::Starting);
        if let Some(tap) = &mut self.options.tap {
            tap(Instant::now(), Event::Opened);
        }
        let mut line = Line {
            port,
            stop: &self.stop,
            tap: &mut self.options.tap,
        };
        match self.device.start(&mut line, attempt) {
            Ok(()) => {}
            Err(StartError::Stopped) => return Ok(()),
            Err(error) => return Err(DriverError::Start(error)),
        }
        if let Some(tap) = &mut self.options.tap {
            tap(Instant::now(), Event::Started(&self.device.description()));
        }
        self.shared.update(|status| {
            status.state = State::Running;
            status.error = None;
            status.starts += 1;
        });
        let received = self.receive(port);
        self.parsed = self.parsed.plus(self.device.counters());
        received.map_err(|failure| match failure {
            Failure::Io(error) => DriverError::Lost(Arc::new(error)),
            Failure::Silent { silence, bytes } => DriverError::Silent { silence, bytes },
        })
    }

    fn receive(&mut self, port: &mut dyn Port) -> Result<(), Failure> {
        let mut buffer = [0; PIECE];
        let mut last_sample = Instant::now();
        let mut first_byte = last_sample;
        let mut bytes_since = 0;
        let mut asked: Option<Instant> = None;
        let mut answered = true;
        loop {
            if self.stopped() {
                self.send(port, self.device.end())?;
                return Ok(());
            }
            if let Some(request) = self.device.request() {
                let since = asked.map_or(Duration::MAX, |asked| asked.elapsed());
                if answered && let Some(early) = self.options.request_interval.checked_sub(since) {
                    // Nothing is on its way while no request is.
                    std::thread::sleep(early.min(READ_TIMEOUT));
                    continue;
                }
                if answered || since >= self.options.request_again {
                    self.send(port, request)?;
                    asked = Some(Instant::now());
                    answered = false;
                }
            }
            let count = read_some(port, &mut buffer)?;
            let now = Instant::now();
            if count > 0 {
                let bytes = &buffer[..count];
                if self.device.pending() == 0 {
                    first_byte = now;
                }
                if let Some(tap) = &mut self.options.tap {
                    tap(now, Event::Received(bytes));
                }
                let mut samples = 0;
                let shared = &self.shared;
                self.device.receive(bytes, &mut |sample| {
                    shared.publish(D::source(&sample), sample, first_byte, now);
                    // What follows in this piece began in it, too.
                    first_byte = now;
                    samples += 1;
                });
                bytes_since += count as u64;
                if samples > 0 {
                    answered = true;
                    last_sample = now;
                    bytes_since = 0;
                }
                let counters = self.parsed.plus(self.device.counters());
                self.shared.update(|status| {
                    status.bytes += count as u64;
                    status.counters = counters;
                });
            }
            let silence = now.duration_since(last_sample);
            if silence >= self.options.silence {
                return Err(Failure::Silent {
                    silence,
                    bytes: bytes_since,
                });
            }
        }
    }

    fn send(&mut self, port: &mut dyn Port, bytes: &[u8]) -> io::Result<()> {
        port.write_all(bytes)?;
        if let Some(tap) = &mut self.options.tap {
            tap(Instant::now(), Event::Sent(bytes));
        }
        Ok(())
    }
}

/// Why receiving ended.
enum Failure {
    Io(io::Error),
    Silent { silence: Duration, bytes: u64 },
}

impl From<io::Error> for Failure {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}
