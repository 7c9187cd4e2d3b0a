//! Samples on their way from the driver's thread to those who want them.

use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use super::error::DriverError;
use crate::Counters;

/// Sources of which the newest sample is kept: the tracker has four stations.
pub(super) const SOURCES: usize = 4;

/// A sample and when it came.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stamped<S> {
    /// The sample.
    pub value: S,
    /// Number of the sample since the driver was made, from 0.
    pub sequence: u64,
    /// When the first of its bytes was read; as a rule the earlier end of what a
    /// clock fit wants.
    pub first_byte: Instant,
    /// When the last of its bytes was read.
    pub last_byte: Instant,
}

/// What a driver is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum State {
    /// Opening the port.
    Connecting,
    /// Starting the device.
    Starting,
    /// Receiving samples.
    Running,
    /// Waiting to try again.
    Waiting,
    /// Finished.
    Stopped,
}

/// How a driver fares.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Status {
    /// What it is doing.
    pub state: State,
    /// What went wrong last, if anything did since the device was last running.
    pub error: Option<DriverError>,
    /// How often a device was started with success.
    pub starts: u64,
    /// Bytes received.
    pub bytes: u64,
    /// Samples received.
    pub samples: u64,
    /// Samples that found a subscriber's channel full, each subscriber counted.
    pub dropped_samples: u64,
    /// Records, resyncs and dropped bytes of the parser, over all connections.
    pub counters: Counters,
}

/// What the thread and its owner share.
pub(super) struct Shared<S> {
    inner: Mutex<Inner<S>>,
    changed: Condvar,
}

struct Inner<S> {
    newest: [Option<Stamped<S>>; SOURCES],
    /// The source of the last sample.
    last: usize,
    status: Status,
    subscribers: Vec<SyncSender<Stamped<S>>>,
}

impl<S: Copy> Shared<S> {
    pub(super) fn new() -> Self {
        Self {
            inner: Mutex::new(Inner {
                newest: [None; SOURCES],
                last: 0,
                status: Status {
                    state: State::Connecting,
                    error: None,
                    starts: 0,
                    bytes: 0,
                    samples: 0,
                    dropped_samples: 0,
                    counters: Counters::default(),
                },
                subscribers: Vec::new(),
            }),
            changed: Condvar::new(),
        }
    }

    /// The lock is never held while foreign code runs, so a panic elsewhere
    /// leaves nothing half-done.
    fn lock(&self) -> MutexGuard<'_, Inner<S>> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn publish(&self, source: usize, value: S, first_byte: Instant, last_byte: Instant) {
        let mut inner = self.lock();
        let inner = &mut *inner;
        let sample = Stamped {
            value,
            sequence: inner.status.samples,
            first_byte,
            last_byte,
        };
        inner.status.samples += 1;
        inner.last = source.min(SOURCES - 1);
        inner.newest[inner.last] = Some(sample);
        let dropped = &mut inner.status.dropped_samples;
        inner
            .subscribers
            .retain(|subscriber| match subscriber.try_send(sample) {
                Ok(()) => true,
                Err(TrySendError::Full(_)) => {
                    *dropped += 1;
                    true
                }
                Err(TrySendError::Disconnected(_)) => false,
            });
        self.changed.notify_all();
    }

    pub(super) fn update(&self, change: impl FnOnce(&mut Status)) {
        change(&mut self.lock().status);
        self.changed.notify_all();
    }

    pub(super) fn status(&self) -> Status {
        self.lock().status.clone()
    }

    pub(super) fn newest(&self) -> Option<Stamped<S>> {
        let inner = self.lock();
        inner.newest[inner.last]
    }

    pub(super) fn newest_of(&self, source: usize) -> Option<Stamped<S>> {
        self.lock().newest.get(source).copied().flatten()
    }

    pub(super) fn wait_newer(&self, than: Option<u64>, patience: Duration) -> Option<Stamped<S>> {
        let fresh = |inner: &Inner<S>| {
            inner.newest[inner.last].filter(|sample| than.is_none_or(|than| sample.sequence > than))
        };
        let (inner, _) = self
            .changed
            .wait_timeout_while(self.lock(), patience, |inner| {
                fresh(inner).is_none() && inner.status.state != State::Stopped
            })
            .unwrap_or_else(PoisonError::into_inner);
        fresh(&inner)
    }

    pub(super) fn wait_status(
        &self,
        patience: Duration,
        wanted: impl Fn(&Status) -> bool,
    ) -> Option<Status> {
        let (inner, _) = self
            .changed
            .wait_timeout_while(self.lock(), patience, |inner| !wanted(&inner.status))
            .unwrap_or_else(PoisonError::into_inner);
        wanted(&inner.status).then(|| inner.status.clone())
    }

    pub(super) fn subscribe(&self, capacity: usize) -> Receiver<Stamped<S>> {
        let (sender, receiver) = sync_channel(capacity);
        self.lock().subscribers.push(sender);
        receiver
    }

    /// Lets the receivers know that nothing more will come.
    pub(super) fn close(&self) {
        let mut inner = self.lock();
        inner.subscribers.clear();
        inner.status.state = State::Stopped;
        self.changed.notify_all();
    }
}
