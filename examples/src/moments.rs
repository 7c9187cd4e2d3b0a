//! Which frames get a picture.

use crate::{grasp::Phase, motion::KeyMoment, report::FrameRecord, session::Snapshot};

/// Most pictures of a session whose motion names no moments.
const MOST: usize = 8;

/// Collects the snapshots of a session's key moments.
///
/// A script names its moments; their captions add what the object then was to the
/// hand. A recording does not know what will come of it, so there the events decide:
/// the first touch, attaching, giving way, release.
pub struct Moments {
    planned: Vec<KeyMoment>,
    frame_s: f64,
    frames: usize,
    by_events: bool,
    last: (Phase, bool),
    snapshots: Vec<Snapshot>,
}

impl Moments {
    /// For a session of `frames` frames, `frame_s` seconds apart.
    #[must_use]
    pub fn new(planned: &[KeyMoment], frames: usize, frame_s: f64) -> Self {
        Self {
            planned: planned.iter().rev().copied().collect(),
            frame_s,
            frames,
            by_events: planned.is_empty(),
            last: (Phase::Free, false),
            snapshots: Vec::new(),
        }
    }

    /// Looks at a frame, and takes its picture if it is due.
    pub fn see(&mut self, snapshot: &dyn Fn(&str) -> Snapshot, record: &FrameRecord) {
        let time_s = record.frame as f64 * self.frame_s;
        let end = record.frame + 1 == self.frames;
        while let Some(moment) = self.planned.pop_if(|moment| moment.time_s <= time_s) {
            // What was planned, and what came of it.
            let phase = match record.phase {
                Phase::Free => "free",
                Phase::Attached => "attached",
                Phase::Deforming => "elastic",
            };
            self.snapshots
                .push(snapshot(&format!("{}, {phase}", moment.name)));
        }
        if end && !self.by_events && !self.planned.is_empty() {
            self.snapshots.push(snapshot("end"));
        }
        if self.by_events {
            let now = (record.phase, record.touching.contains(&true));
            let name = match (self.last, now) {
                _ if now.1 && self.snapshots.is_empty() => Some("first touch"),
                ((Phase::Free, _), (Phase::Attached, _)) => Some("attached"),
                ((Phase::Free | Phase::Attached, _), (Phase::Deforming, _)) => Some("elastic"),
                ((Phase::Attached | Phase::Deforming, _), (Phase::Free, _)) => Some("released"),
                _ => None,
            };
            if let Some(name) = name.or(end.then_some("end")) {
                // The end always gets its place.
                if self.snapshots.len() < MOST - 1 || end {
                    self.snapshots.push(snapshot(name));
                }
            }
            self.last = now;
        }
    }

    /// The pictures, in order.
    #[must_use]
    pub fn into_snapshots(self) -> Vec<Snapshot> {
        self.snapshots
    }
}
