//! The whole loop, from bytes to positions: the script of `glove-loop`, at its frame
//! rate, with the default ball, as an elastic solid and in a lattice.
//!
//! What is timed is what the loop itself times, frame by frame: the devices that
//! make the bytes stay outside. A mean over a session hides the frames that matter
//! most, so the median and the worst frame of one session are printed as well.

use std::time::Duration;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use examples::{
    deformer::DeformerKind,
    grasp::{GraspRules, Phase},
    motion::{Motion as _, Script},
    report::FrameRecord,
    scene::{Object, ObjectKind, Resolution},
    session::{self, SessionOptions},
    soft_body::SoftBody,
};
use glove_io::hand::HandModel;

/// Frames of a session.
const FRAMES: u32 = 1800;

fn whole_loop(c: &mut Criterion) {
    for deformer in [DeformerKind::Fem, DeformerKind::Ffd] {
        session_with(c, deformer);
    }
}

fn session_with(c: &mut Criterion, deformer: DeformerKind) {
    let model = HandModel::average_right();
    let object = Object::build(ObjectKind::Ball, Resolution::default()).expect("a sound mesh");
    let object = SoftBody::new(object, deformer).expect("a sound body");
    let script = Script::variants(&model, object.surface(), 1)
        .expect("the hand finds a grasp")
        .swap_remove(0);
    let options = SessionOptions {
        frames: FRAMES as usize,
        frame_s: script.duration_s() / f64::from(FRAMES),
        rules: GraspRules::default(),
        fault: None,
    };
    let play = || {
        session::run(&options, &script, &model, object.clone(), |_, _| ())
            .expect("nothing fails without a fault")
            .frames
    };

    // Frames that deform are the purpose of the loop: they get figures of their own.
    let frames = play();
    println!(
        "one session of {FRAMES} frames, {} nodes, {deformer:?}:",
        object.positions().len()
    );
    describe("all frames", frames.iter());
    let deforming = |frame: &&FrameRecord| frame.phase == Phase::Deforming;
    describe("deforming", frames.iter().filter(deforming));

    let mut group = c.benchmark_group("frame");
    group.throughput(Throughput::Elements(u64::from(FRAMES)));
    group.bench_function(format!("session of 1800, {deformer:?}"), |b| {
        b.iter_custom(|sessions| (0..sessions).flat_map(|_| play()).map(time).sum());
    });
    group.finish();
}

fn time(frame: FrameRecord) -> Duration {
    frame.times.total()
}

fn describe<'a>(name: &str, frames: impl Iterator<Item = &'a FrameRecord>) {
    let mut times: Vec<Duration> = frames.copied().map(time).collect();
    times.sort_unstable();
    let worst = times.last().expect("the script touches the object");
    let median = times[times.len() / 2];
    println!("  {name}: median {median:.1?}, worst {worst:.1?}");
}

criterion_group!(frame, whole_loop);
criterion_main!(frame);
