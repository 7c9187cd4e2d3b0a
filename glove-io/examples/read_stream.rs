//! Reads a simulated glove and a simulated tracker, with a damaged byte on the way.
//!
//! Run with `cargo run -p glove-io --example read_stream`. It needs no hardware
//! and prints ten lines, in which the index finger bends and the wrist moves
//! forward, and then the statistics: 9 of the 10 glove records and all tracker
//! records arrive.

use glove_io::cyberglove::{self, Record};
use glove_io::fastrak::{self, Encoding, Item, OutputList, Station, Units};
use glove_io::sim::{CyberGlove, Fastrak};
use glove_io::{Calibration, JointAngles, Pose, Sensor};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let calibration = Calibration::average();
    let mut glove = CyberGlove::default();
    let mut tracker = Fastrak::default();
    let (mut glove_bytes, mut tracker_bytes) = (Vec::new(), Vec::new());

    // What a client sends once: stream; position and quaternion in binary
    // centimetres, stream.
    glove.receive(b"S", &mut glove_bytes);
    tracker.receive(b"O1,2,11,0\rufC", &mut tracker_bytes);

    let mut glove_parser = cyberglove::Parser::new(cyberglove::RecordFormat::default());
    let mut tracker_parser = fastrak::Parser::new(fastrak::RecordFormat {
        items: OutputList::try_new(&[Item::Position, Item::Quaternion, Item::Space])?,
        encoding: Encoding::Binary,
        units: Units::Centimetres,
    });

    for step in 0..10_u8 {
        // What the hand does.
        let mut angles = JointAngles::default();
        angles[Sensor::IndexPip] = -0.15 * f64::from(step);
        let (raw, _) = calibration.raw_values(&angles);
        glove.set_sensors(raw);
        let position_m = [0.2, 0.1, -0.3 - 0.01 * f64::from(step)];
        tracker.set_pose(
            Station::One,
            Pose {
                position_m,
                ..Pose::IDENTITY
            },
        )?;
        glove.tick(&mut glove_bytes);
        tracker.tick(&mut tracker_bytes);

        // A line that loses a byte now and then.
        if step == 4 {
            glove_bytes.remove(7);
        }

        // What the computer makes of it. A serial port delivers any pieces.
        let mut newest: Option<Record> = None;
        for piece in glove_bytes.chunks(5) {
            glove_parser.push(piece, |record| newest = Some(record));
        }
        let mut wrist: Option<Pose> = None;
        for piece in tracker_bytes.chunks(7) {
            tracker_parser.push(piece, |record| wrist = record.to_world());
        }
        glove_bytes.clear();
        tracker_bytes.clear();

        let bend = newest
            .as_ref()
            .and_then(Record::all_sensors)
            .map(|raw| calibration.angles(raw)[Sensor::IndexPip]);
        match (bend, wrist) {
            (Some(bend), Some(wrist)) => println!(
                "{step}: index finger {bend:+.2} rad, wrist at z = {:+.2} m",
                wrist.position_m[2]
            ),
            _ => println!("{step}: a record was lost"),
        }
    }

    println!("glove:   {:?}", glove_parser.counters());
    println!("tracker: {:?}", tracker_parser.counters());
    Ok(())
}
