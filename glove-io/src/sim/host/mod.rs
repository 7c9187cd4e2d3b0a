//! Simulated devices on a pseudo-terminal or a socket, at the pace of real ones.
//!
//! A [`Host`] runs one simulator in a thread of its own. It calls the simulator's
//! `tick` on schedule, lets bytes leave no faster than the baud rate allows, and
//! damages them if it is told to ([`Faults`]). Real clients cannot tell it from a
//! device on a serial port. Unix only, as pseudo-terminals are.
//!
//! # Example
//!
//! ```no_run
//! use glove_io::sim::{self, host::{Endpoint, Host, Options}};
//!
//! let glove = Host::spawn(
//!     &Endpoint::Pty { link: "./glove.pty".into() },
//!     sim::CyberGlove::default(),
//!     |glove, time_s| glove.set_sensors([128 + (60.0 * time_s.sin()) as u8; 22]),
//!     Options::default(),
//! )?;
//! std::thread::sleep(std::time::Duration::from_secs(60));
//! println!("{:.2} ticks a second", glove.stats().tick_rate_hz());
//! # Ok::<(), std::io::Error>(())
//! ```

mod endpoint;
mod faults;
mod line;

use std::io;
use std::net::SocketAddr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

pub use endpoint::Endpoint;
use endpoint::{Outcome, Wire};
use faults::Damage;
pub use faults::Faults;
use line::SlowLine;

use super::Device;

/// The longest sleep: so often the thread looks whether it shall stop.
const NAP: Duration = Duration::from_millis(20);
/// Records that find this many bytes waiting are not sent: the line is too slow
/// for the rate. A real device skips samples as well.
const BACKLOG: usize = 256;
/// Commands are not read while this many bytes of answers wait.
const ANSWERS: usize = 1 << 16;
/// A schedule that lies this far behind, after the computer slept, starts afresh.
const TOO_LATE: Duration = Duration::from_millis(500);

/// How a simulated device is connected.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Bits a second on the line, 8N1.
    pub baud: u32,
    /// What goes wrong.
    pub faults: Faults,
}

impl Default for Options {
    /// 115 200 baud, no faults.
    fn default() -> Self {
        Self {
            baud: 115_200,
            faults: Faults::default(),
        }
    }
}

/// What a host has done so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct Stats {
    /// Calls of `tick`.
    pub ticks: u64,
    /// Time from the first to the last of them.
    pub ticking: Duration,
    /// Ticks left out because the computer was too late for them.
    pub missed_ticks: u64,
    /// Bytes that left the device, whether a client was there or not.
    pub sent_bytes: u64,
    /// Bytes that clients sent.
    pub received_bytes: u64,
    /// Ticks whose records found no room on the line.
    pub overruns: u64,
    /// When the line last ran empty: the last byte of a record had left.
    pub last_sent: Option<Instant>,
}

impl Stats {
    /// Ticks per second.
    #[must_use]
    pub fn tick_rate_hz(&self) -> f64 {
        self.ticks.saturating_sub(1) as f64 / self.ticking.as_secs_f64().max(f64::MIN_POSITIVE)
    }
}

/// A simulated device at work. Dropping it takes the device away.
pub struct Host {
    shared: Arc<Shared>,
    address: Option<SocketAddr>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Default)]
struct Shared {
    stop: AtomicBool,
    stats: Mutex<Stats>,
    orders: Mutex<Orders>,
}

/// Faults to happen at once.
#[derive(Default)]
struct Orders {
    stall: Option<Duration>,
    unplug: Option<Duration>,
}

impl Host {
    /// Opens the endpoint and starts the device.
    ///
    /// Before each tick `motion` is called with the device and the seconds since
    /// the start, to move what it measures.
    ///
    /// # Errors
    ///
    /// If the endpoint cannot be opened, or the operating system refuses a thread.
    pub fn spawn<D: Device + Send + 'static>(
        endpoint: &Endpoint,
        device: D,
        motion: impl FnMut(&mut D, f64) + Send + 'static,
        options: Options,
    ) -> io::Result<Self> {
        let wire = Wire::open(endpoint)?;
        let address = wire.local_address();
        let endpoint = match (endpoint, address) {
            // The same port again after the plug was pulled.
            (Endpoint::TcpListen(_), Some(address)) => Endpoint::TcpListen(address),
            _ => endpoint.clone(),
        };
        let shared = Arc::new(Shared::default());
        let now = Instant::now();
        let mut bench = Bench {
            device,
            motion,
            endpoint,
            wire: Some(wire),
            line: SlowLine::new(options.baud, now),
            damage: Damage::new(options.faults),
            silent_until: now,
            unplugged_until: now,
            shared: Arc::clone(&shared),
            stats: Stats::default(),
            output: Vec::new(),
        };
        let thread = std::thread::Builder::new()
            .name("simulated device".to_owned())
            .spawn(move || bench.run(options.faults))?;
        Ok(Self {
            shared,
            address,
            thread: Some(thread),
        })
    }

    /// The address of a socket that listens.
    #[must_use]
    pub fn address(&self) -> Option<SocketAddr> {
        self.address
    }

    /// What it has done so far.
    #[must_use]
    pub fn stats(&self) -> Stats {
        *lock(&self.shared.stats)
    }

    /// Lets the device fall silent for a while, wherever it is in a record.
    pub fn stall(&self, duration: Duration) {
        lock(&self.shared.orders).stall = Some(duration);
    }

    /// Pulls the plug and puts it back after a while: clients lose the connection,
    /// a pseudo-terminal vanishes.
    pub fn unplug(&self, duration: Duration) {
        lock(&self.shared.orders).unplug = Some(duration);
    }
}

impl Drop for Host {
    fn drop(&mut self) {
        self.shared.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The thread's side of a host.
struct Bench<D, M> {
    device: D,
    motion: M,
    endpoint: Endpoint,
    /// `None` while the plug is pulled.
    wire: Option<Wire>,
    line: SlowLine,
    damage: Damage,
    silent_until: Instant,
    unplugged_until: Instant,
    shared: Arc<Shared>,
    stats: Stats,
    /// Room for what the device says, used again and again.
    output: Vec<u8>,
}

impl<D: Device, M: FnMut(&mut D, f64)> Bench<D, M> {
    fn run(&mut self, faults: Faults) {
        let start = Instant::now();
        let mut next_tick = start;
        let mut next_stall = faults.stall_every.map(|every| start + every);
        let mut next_unplug = faults.unplug_every.map(|every| start + every);
        while !self.shared.stop.load(Ordering::Relaxed) {
            let now = Instant::now();
            if let Some(at) = next_stall
                && at <= now
            {
                self.stall(now, faults.stall);
                next_stall = faults.stall_every.map(|every| now + faults.stall + every);
            }
            if let Some(at) = next_unplug
                && at <= now
            {
                self.unplug(now, faults.unplugged);
                next_unplug = faults
                    .unplug_every
                    .map(|every| now + faults.unplugged + every);
            }
            self.obey(now);
            self.plug_in(now);
            while next_tick <= now {
                self.tick(start, next_tick);
                let period = Duration::from_secs_f64(self.device.tick_period_s());
                next_tick += period;
                if now.saturating_duration_since(next_tick) > TOO_LATE {
                    let late = now.duration_since(next_tick).as_nanos() / period.as_nanos().max(1);
                    self.stats.missed_ticks += u64::try_from(late).unwrap_or(u64::MAX);
                    next_tick = now;
                }
            }
            self.hand_over();
            *lock(&self.shared.stats) = self.stats;
            let due = self
                .line
                .next_due()
                .map_or(next_tick, |due| due.min(next_tick));
            self.listen(due.saturating_duration_since(Instant::now()).min(NAP));
        }
    }

    /// One tick of the device, due at `due`.
    fn tick(&mut self, start: Instant, due: Instant) {
        let time = due.duration_since(start);
        (self.motion)(&mut self.device, time.as_secs_f64());
        self.output.clear();
        self.device.tick(&mut self.output);
        self.stats.ticks += 1;
        self.stats.ticking = time;
        if self.output.is_empty() {
            return;
        }
        if self.line.queued() > BACKLOG {
            self.stats.overruns += 1;
        } else {
            self.send(due);
        }
    }

    /// Puts the device's output on the line, unless it is silent.
    fn send(&mut self, now: Instant) {
        if now >= self.silent_until {
            let Self {
                damage,
                line,
                output,
                ..
            } = self;
            line.send(now, |queue| damage.pass(output, queue));
        }
    }

    /// Hands the client the bytes that have left the device.
    fn hand_over(&mut self) {
        self.output.clear();
        self.line.arrived(Instant::now(), &mut self.output);
        if self.output.is_empty() {
            return;
        }
        self.stats.sent_bytes += self.output.len() as u64;
        if self.line.queued() == 0 {
            self.stats.last_sent = Some(Instant::now());
            // Before the client can see the bytes, so that it finds the time.
            *lock(&self.shared.stats) = self.stats;
        }
        if let Some(wire) = &mut self.wire {
            // What nobody takes is lost, as on a cable.
            let _ = wire.write(&self.output);
        }
    }

    /// Waits for commands and lets the device answer them.
    fn listen(&mut self, duration: Duration) {
        let Some(wire) = &mut self.wire else {
            std::thread::sleep(duration);
            return;
        };
        if self.line.queued() > ANSWERS || wire.wait(duration).is_err() {
            std::thread::sleep(duration);
            return;
        }
        let mut commands = [0; 256];
        if let Outcome::Bytes(count) = wire.read(&mut commands) {
            self.stats.received_bytes += count as u64;
            self.output.clear();
            self.device.receive(&commands[..count], &mut self.output);
            self.send(Instant::now());
        }
    }

    fn stall(&mut self, now: Instant, duration: Duration) {
        self.line.cut();
        self.silent_until = now + duration;
    }

    fn unplug(&mut self, now: Instant, duration: Duration) {
        self.wire = None;
        self.line.cut();
        self.unplugged_until = now + duration;
    }

    /// Faults ordered by the owner.
    fn obey(&mut self, now: Instant) {
        let Orders { stall, unplug } = std::mem::take(&mut *lock(&self.shared.orders));
        if let Some(duration) = stall {
            self.stall(now, duration);
        }
        if let Some(duration) = unplug {
            self.unplug(now, duration);
        }
    }

    /// Puts the plug back when it is time; a name that is taken is tried again.
    fn plug_in(&mut self, now: Instant) {
        if self.wire.is_none() && now >= self.unplugged_until {
            self.wire = Wire::open(&self.endpoint).ok();
            self.unplugged_until = now + NAP;
        }
    }
}
