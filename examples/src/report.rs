//! What a run reports: `report.json` and the table on the terminal.

use std::{collections::BTreeMap, time::Duration};

use glove_io::hand::Finger;
use serde::Serialize;

use crate::{
    deformer::{Certified, Deformer, DeformerKind},
    grasp::{GraspEvent, Phase},
    session::Outcome,
};

/// Time spent in each stage of one frame.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct StageTimes {
    /// Bytes to a hand sample.
    pub parse: Duration,
    /// Joint angles to a hand in the object's frame.
    pub hand: Duration,
    /// Collision and contacts.
    pub touch: Duration,
    /// Grasp rules.
    pub grasp: Duration,
    /// Elasticity, or free-form deformation.
    pub deform: Duration,
    /// Sphere tree brought up to date.
    pub refit: Duration,
    /// Keep shape: factorisation or a new lattice, and a new tree, on the frame where it happens.
    pub keep_shape: Duration,
}

impl StageTimes {
    /// Names and values, in order.
    fn stages(&self) -> [(&'static str, Duration); 7] {
        [
            ("parse", self.parse),
            ("hand", self.hand),
            ("touch", self.touch),
            ("grasp", self.grasp),
            ("deform", self.deform),
            ("refit", self.refit),
            ("keep shape", self.keep_shape),
        ]
    }

    /// From bytes to positions.
    #[must_use]
    pub fn total(&self) -> Duration {
        self.stages().iter().map(|&(_, time)| time).sum()
    }
}

/// One frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameRecord {
    /// Number, from 0.
    pub frame: usize,
    /// What the object is to the hand.
    pub phase: Phase,
    /// Which fingers touch or hold the object.
    pub touching: [bool; 5],
    /// Share of the fingertips' displacement that the object could take.
    pub displaced_fraction: f64,
    /// What was proven of the lattice it follows.
    pub certificate: Option<Certified>,
    /// Times.
    pub times: StageTimes,
}

/// Something that happened.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct EventRecord {
    /// In which frame.
    pub frame: usize,
    /// What.
    pub event: GraspEvent,
}

/// One keep shape.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct KeepShapeRecord {
    /// In which frame.
    pub frame: usize,
    /// Volume of the old rest shape, cubic metres.
    pub rest_volume_before_m3: f64,
    /// Volume of the deformed shape that was kept, cubic metres.
    pub deformed_volume_m3: f64,
    /// Volume of the new rest shape, cubic metres.
    pub rest_volume_after_m3: f64,
    /// Largest displacement from the old rest shape, metres.
    pub largest_displacement_before_m: f64,
    /// Largest displacement from the new rest shape: zero.
    pub largest_displacement_after_m: f64,
}

/// Fingertips that hold an elastic object without determining its deformation.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct RefusedRecord {
    /// In which frame they took hold.
    pub frame: usize,
    /// What they leave free.
    pub reason: String,
}

/// Median, 99th percentile and worst of a stage, microseconds.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Quantiles {
    /// Half of the frames took less.
    pub median_us: f64,
    /// All but one in a hundred took less.
    pub p99_us: f64,
    /// The longest.
    pub worst_us: f64,
}

impl Quantiles {
    fn of(mut times: Vec<Duration>) -> Self {
        times.sort_unstable();
        let at = |per_mille: usize| {
            let index = (times.len() * per_mille / 1000).min(times.len().saturating_sub(1));
            times.get(index).map_or(0.0, |t| t.as_secs_f64() * 1e6)
        };
        Self {
            median_us: at(500),
            p99_us: at(990),
            worst_us: at(1000),
        }
    }
}

/// One stage in the report.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StageReport {
    /// Which stage; `frame` is all of them together.
    pub stage: &'static str,
    /// Its times.
    #[serde(flatten)]
    pub times: Quantiles,
}

/// The object in the report.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ObjectReport {
    /// Its name, or the path it was read from.
    pub name: String,
    /// What deforms it.
    pub deformer: DeformerKind,
    /// Number of nodes.
    pub nodes: usize,
    /// Number of tetrahedra.
    pub tetrahedra: usize,
    /// Number of surface triangles.
    pub surface_triangles: usize,
    /// Volume before anything happened, cubic metres.
    pub initial_volume_m3: f64,
    /// Volume at the end, cubic metres.
    pub final_volume_m3: f64,
}

/// What was proven of the lattices that an object followed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FreeFormReport {
    /// How many frames had which verdict: each is proven not to fold before the object
    /// follows it.
    pub verdicts: BTreeMap<&'static str, usize>,
    /// Frames in which the fingers asked for a lattice that folds: the object went as far
    /// towards it as it safely could.
    pub stopped_frames: usize,
    /// How far that was in each of them, as a share of the way from the frame before.
    pub steps: Vec<f64>,
    /// Bounds of the least determinant of the Jacobian in all frames.
    pub min_det: [f64; 2],
    /// The same frame by frame, for those in which the object gave way.
    pub min_det_by_frame: Vec<(usize, [f64; 2])>,
    /// Lattices in the journal: the shapes that were kept, and the last one.
    pub journal: usize,
    /// The file that holds them, beside this report.
    pub journal_file: &'static str,
    /// How far the object was moved besides, to keep its centre of mass, metres.
    pub moved_m: [f64; 3],
    /// The largest distance of a node from where it was at first after everything is
    /// undone, metres; `null` if there is no way back.
    pub round_trip_error_m: Option<f64>,
}

/// One grasp, from attaching to release.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct GraspReport {
    /// Frame in which the object was attached.
    pub attached_frame: usize,
    /// Frame in which it was released or its shape kept; `null` if it never was.
    pub released_frame: Option<usize>,
    /// Most fingers in contact in one of its frames.
    pub most_fingers: usize,
    /// Frames in which the object gave way.
    pub elastic_frames: usize,
}

/// The stream of one device.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct StreamReport {
    /// Records received whole.
    pub records: u64,
    /// Times the parser had to look for the next record.
    pub resyncs: u64,
    /// Bytes that belong to no record.
    pub dropped_bytes: u64,
}

/// Name of the file that holds the object as it ended.
pub const OBJECT_FILE: &str = "object.txt";

/// Name of the file that holds the lattices which made its shape.
pub const JOURNAL_FILE: &str = "journal.json";

/// Everything in `report.json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// Version of this layout.
    pub format: u32,
    /// The command line, without the program's name, that makes this report again; for
    /// the program to fill in.
    pub arguments: Vec<String>,
    /// The object.
    pub object: ObjectReport,
    /// Seed of the script; `null` for recordings.
    pub seed: Option<u64>,
    /// Number of frames.
    pub frames: usize,
    /// Seconds between frames.
    pub frame_s: f64,
    /// Fingers that touch the object or hold it, frame by frame.
    pub contacts: Vec<u8>,
    /// Frames with at least one.
    pub contact_frames: usize,
    /// The grasps, in order.
    pub grasps: Vec<GraspReport>,
    /// Every keep shape.
    pub kept_shapes: Vec<KeepShapeRecord>,
    /// What happened, in order.
    pub events: Vec<EventRecord>,
    /// Sets of fingertips that do not determine how the object deforms; it kept its
    /// shape while they held it.
    pub refused_contact_sets: Vec<RefusedRecord>,
    /// Frames in which the fingers would have taken more than nine tenths of its volume
    /// from an element, and their displacement was scaled back.
    pub limited_frames: usize,
    /// What was proven, with `--deformer ffd`.
    pub free_form: Option<FreeFormReport>,
    /// Times a frame used a device's last record because no new one had come, counted
    /// for each device.
    pub held_samples: u64,
    /// Sensor values that the simulated glove could not send: outside its range.
    pub clamped_sensors: u64,
    /// The CyberGlove's stream.
    pub glove: StreamReport,
    /// The FASTRAK's stream.
    pub tracker: StreamReport,
    /// Time to build, assemble and factor the object and its tree, milliseconds.
    pub set_up_ms: f64,
    /// Times from bytes to positions.
    pub stages: Vec<StageReport>,
    /// The object as it ended, beside this report.
    pub object_file: &'static str,
    /// FNV-1a hash of the final positions: see [`position_hash`].
    pub position_hash: String,
}

impl Report {
    /// Draws the report from what a session left.
    #[must_use]
    pub fn new(
        outcome: &Outcome,
        seed: Option<u64>,
        frame_s: f64,
        initial_volume_m3: f64,
        set_up: Duration,
    ) -> Self {
        let object = &outcome.object;
        let contacts: Vec<u8> = outcome
            .frames
            .iter()
            .map(|f| finger_count(f.touching))
            .collect();
        let mesh = object.rest();
        let stream = |c: glove_io::Counters| StreamReport {
            records: c.records,
            resyncs: c.resyncs,
            dropped_bytes: c.dropped_bytes,
        };
        Self {
            format: 1,
            arguments: Vec::new(),
            object: ObjectReport {
                name: object.name().to_owned(),
                deformer: object.deformer().kind(),
                nodes: mesh.positions().len(),
                tetrahedra: mesh.tets().len(),
                surface_triangles: object.triangles().len(),
                initial_volume_m3,
                final_volume_m3: object.volume_m3(),
            },
            seed,
            frames: outcome.frames.len(),
            frame_s,
            contact_frames: contacts.iter().filter(|&&c| c > 0).count(),
            contacts,
            grasps: grasps(outcome),
            kept_shapes: outcome.kept.clone(),
            events: outcome.events.clone(),
            refused_contact_sets: outcome.refused.clone(),
            limited_frames: outcome
                .frames
                .iter()
                .filter(|f| f.displaced_fraction < 1.0)
                .count(),
            free_form: free_form(outcome),
            held_samples: outcome.held_samples,
            clamped_sensors: outcome.clamped_sensors,
            glove: stream(outcome.counters[0]),
            tracker: stream(outcome.counters[1]),
            set_up_ms: set_up.as_secs_f64() * 1e3,
            stages: stages(outcome),
            object_file: OBJECT_FILE,
            position_hash: format!("{:016x}", position_hash(&outcome.positions)),
        }
    }

    /// The summary for a terminal.
    #[must_use]
    pub fn table(&self) -> String {
        use std::fmt::Write as _;
        let mut out = String::new();
        let object = &self.object;
        let mut line = |text: std::fmt::Arguments<'_>| {
            let _infallible = writeln!(out, "{text}");
        };
        line(format_args!(
            "{}: {} nodes, {} tetrahedra, {:.1} cm³; {} frames of {:.1} ms, set up in {:.1} ms",
            object.name,
            object.nodes,
            object.tetrahedra,
            object.initial_volume_m3 * 1e6,
            self.frames,
            self.frame_s * 1e3,
            self.set_up_ms
        ));
        line(format_args!(
            "contact in {} frames; {} grasp(s)",
            self.contact_frames,
            self.grasps.len()
        ));
        for (i, grasp) in self.grasps.iter().enumerate() {
            let end = grasp
                .released_frame
                .map_or("held to the end".to_owned(), |f| {
                    format!("released in frame {f}")
                });
            line(format_args!(
                "  grasp {}: attached in frame {}, {} fingers, elastic for {} frames, {end}",
                i + 1,
                grasp.attached_frame,
                grasp.most_fingers,
                grasp.elastic_frames
            ));
        }
        for kept in &self.kept_shapes {
            line(format_args!(
                "  shape kept in frame {}: volume {:.2} cm³ (before {:.2}), largest displacement {:.2} mm, then {:.2} mm",
                kept.frame,
                kept.rest_volume_after_m3 * 1e6,
                kept.rest_volume_before_m3 * 1e6,
                kept.largest_displacement_before_m * 1e3,
                kept.largest_displacement_after_m * 1e3
            ));
        }
        for refused in &self.refused_contact_sets {
            line(format_args!(
                "  frame {}: no deformation: {}",
                refused.frame, refused.reason
            ));
        }
        if let Some(free_form) = &self.free_form {
            let verdicts = free_form.verdicts.iter();
            let verdicts: Vec<String> = verdicts
                .map(|(verdict, count)| format!("{verdict} in {count} frames"))
                .collect();
            line(format_args!(
                "lattice: {}; least det J {:.3}; stopped short of a fold in {} frames",
                verdicts.join(", "),
                free_form.min_det[0],
                free_form.stopped_frames
            ));
            let undone = free_form.round_trip_error_m.map_or_else(
                || "cannot be undone".to_owned(),
                |error| format!("undone to {error:.1e} m"),
            );
            line(format_args!(
                "  {} in the journal, {undone}",
                free_form.journal
            ));
        }
        line(format_args!(""));
        line(format_args!(
            "{:<12}{:>12}{:>12}{:>12}",
            "stage", "median µs", "p99 µs", "worst µs"
        ));
        for StageReport { stage, times } in &self.stages {
            line(format_args!(
                "{stage:<12}{:>12.1}{:>12.1}{:>12.1}",
                times.median_us, times.p99_us, times.worst_us
            ));
        }
        line(format_args!(""));
        line(format_args!("final positions: hash {}", self.position_hash));
        out
    }
}

fn free_form(outcome: &Outcome) -> Option<FreeFormReport> {
    let Deformer::FreeForm(free_form) = outcome.object.deformer() else {
        return None;
    };
    let mut verdicts = BTreeMap::new();
    let (mut steps, mut min_det) = (Vec::new(), [1.0_f64; 2]);
    let mut min_det_by_frame = Vec::new();
    for record in &outcome.frames {
        let Some(certified) = record.certificate else {
            continue;
        };
        *verdicts.entry(certified.verdict).or_insert(0) += 1;
        if certified.step < 1.0 {
            steps.push(certified.step);
        }
        for (least, bound) in min_det.iter_mut().zip(certified.min_det) {
            *least = least.min(bound);
        }
        min_det_by_frame.push((record.frame, certified.min_det));
    }
    let (journal, moved) = free_form.journal().ok()?;
    let undone = free_form.round_trip_error_m(outcome.object.positions());
    Some(FreeFormReport {
        verdicts,
        stopped_frames: steps.len(),
        steps,
        min_det,
        min_det_by_frame,
        journal: journal.lattices().len(),
        journal_file: JOURNAL_FILE,
        moved_m: moved.to_array(),
        round_trip_error_m: undone.ok().flatten(),
    })
}

/// FNV-1a, 64 bits, over the little-endian bytes of the coordinates in order
/// (G. Fowler, L. Noll, K.-P. Vo): equal hashes mean, for all practical purposes,
/// positions equal to the last bit.
#[must_use]
pub fn position_hash(positions: &[[f64; 3]]) -> u64 {
    positions
        .as_flattened()
        .iter()
        .flat_map(|c| c.to_le_bytes())
        .fold(0xCBF2_9CE4_8422_2325, |hash, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01B3)
        })
}

fn finger_count(touching: [bool; 5]) -> u8 {
    Finger::ALL
        .iter()
        .map(|f| u8::from(touching[f.index()]))
        .sum()
}

fn grasps(outcome: &Outcome) -> Vec<GraspReport> {
    let mut grasps: Vec<GraspReport> = Vec::new();
    for &EventRecord { frame, event } in &outcome.events {
        match event {
            GraspEvent::Attached => grasps.push(GraspReport {
                attached_frame: frame,
                released_frame: None,
                most_fingers: 0,
                elastic_frames: 0,
            }),
            GraspEvent::Released | GraspEvent::KeptShape => {
                if let Some(grasp) = grasps.last_mut() {
                    grasp.released_frame = Some(frame);
                }
            }
            GraspEvent::TookHold | GraspEvent::LetGo | GraspEvent::BecameElastic => {}
        }
    }
    for grasp in &mut grasps {
        let end = grasp.released_frame.unwrap_or(outcome.frames.len());
        for record in &outcome.frames[grasp.attached_frame..end] {
            grasp.most_fingers = grasp.most_fingers.max(finger_count(record.touching).into());
            grasp.elastic_frames += usize::from(record.phase == Phase::Deforming);
        }
    }
    grasps
}

/// A stage's quantiles are over the frames in which it ran.
fn stages(outcome: &Outcome) -> Vec<StageReport> {
    let names = StageTimes::default().stages().map(|(name, _)| name);
    let mut reports: Vec<StageReport> = names
        .iter()
        .enumerate()
        .filter_map(|(i, &stage)| {
            let times: Vec<Duration> = outcome
                .frames
                .iter()
                .map(|f| f.times.stages()[i].1)
                .filter(|t| !t.is_zero())
                .collect();
            (!times.is_empty()).then(|| StageReport {
                stage,
                times: Quantiles::of(times),
            })
        })
        .collect();
    reports.push(StageReport {
        stage: "frame",
        times: Quantiles::of(outcome.frames.iter().map(|f| f.times.total()).collect()),
    });
    reports
}
