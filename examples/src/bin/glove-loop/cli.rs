//! The command line.

use std::{num::NonZeroUsize, path::PathBuf};

use clap::{Parser, ValueEnum as _};
use examples::{
    deformer::DeformerKind,
    devices::Fault,
    grasp::{FEWEST_HOLDING, GraspRules},
    scene::{ObjectKind, Resolution},
    session::SessionOptions,
};

/// Frames of the script: 100 a second.
pub(crate) const SCRIPT_FRAMES: usize = 1800;

const EXAMPLES: &str = "\
Examples:
  glove-loop                                  squeeze a ball, write out/
  glove-loop --object strawberry --seed 7     another object, another hand
  glove-loop --deformer ffd                   bend space instead of an elastic solid
  glove-loop --object out/object.txt          go on with the object kept last
  glove-loop --joints hand.txt --pose wrist.traj --out real
                                              a recorded hand
  glove-loop --fault tracker:drop:300 --json  lose a byte, report to standard output
";

/// A virtual hand squeezes a soft object.
///
/// Simulated CyberGlove and FASTRAK devices, moved by a script or by recordings,
/// send protocol bytes; the loop reads only those. It writes `report.json`, a contact
/// sheet `contact-sheet.png` and the final object `object.txt`.
#[derive(Debug, Parser)]
#[command(name = "glove-loop", version, after_help = EXAMPLES)]
pub(crate) struct Cli {
    /// The object: cube, ball, strawberry, tube, or the path of an object file
    #[arg(long, value_name = "NAME|FILE", default_value = "ball")]
    pub(crate) object: String,

    /// Cells across a built object, 3 to 16
    #[arg(long, value_name = "CELLS", default_value = "5", value_parser = parse_resolution)]
    pub(crate) resolution: Resolution,

    /// What deforms the object: fem, an elastic solid, or ffd, a lattice around it that
    /// bends with the fingertips
    #[arg(long, value_enum, default_value_t)]
    pub(crate) deformer: DeformerKind,

    /// Number of frames, at most 100000 [default: 1800 for the script, all of a recording].
    /// The script is told in as many frames as there are; below about 100 it skips parts
    #[arg(long, value_name = "N", value_parser = parse_frames)]
    pub(crate) frames: Option<NonZeroUsize>,

    /// Which hand the script has: its tremor and how far each finger closes
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,

    /// VirtualHand text recording of joint angles that moves the glove
    #[arg(long, value_name = "FILE")]
    pub(crate) joints: Option<PathBuf>,

    /// Sequence of 4×4 pose matrices that moves the tracker
    #[arg(long, value_name = "FILE")]
    pub(crate) pose: Option<PathBuf>,

    /// Fingertips that must hold the object before it gives way, 3 to 5
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = parse_fingers)]
    pub(crate) fingers: usize,

    /// Damage a device's bytes: DEVICE:KIND:FRAME with glove|tracker, flip|drop|cut
    #[arg(long, value_name = "FAULT")]
    pub(crate) fault: Option<Fault>,

    /// Folder for the output
    #[arg(long, value_name = "DIR", default_value = "out")]
    pub(crate) out: PathBuf,

    /// Also write a VTU series with a PVD collection, every tenth frame
    #[arg(long)]
    pub(crate) vtu: bool,

    /// Print the report as JSON instead of a table
    #[arg(long)]
    pub(crate) json: bool,

    /// Threads that draw [default: all cores]; results do not depend on it
    #[arg(long, value_name = "N")]
    pub(crate) threads: Option<NonZeroUsize>,
}

impl Cli {
    /// The built-in object asked for, if it is one.
    pub(crate) fn builtin(&self) -> Option<ObjectKind> {
        ObjectKind::from_str(&self.object, true).ok()
    }

    /// Options of a session that takes `frames` frames unless told otherwise.
    pub(crate) fn session(&self, frames: usize, frame_s: f64) -> SessionOptions {
        SessionOptions {
            frames: self.frames.map_or(frames, NonZeroUsize::get),
            frame_s,
            rules: GraspRules {
                fingers_to_deform: self.fingers,
                ..GraspRules::default()
            },
            fault: self.fault,
        }
    }
}

fn parse_resolution(text: &str) -> Result<Resolution, String> {
    let (low, high) = Resolution::RANGE.into_inner();
    text.parse()
        .ok()
        .and_then(Resolution::new)
        .ok_or_else(|| format!("a whole number from {low} to {high} is needed"))
}

/// A report line a frame is kept in memory: this many are 20 MB.
const MOST_FRAMES: usize = 100_000;

fn parse_frames(text: &str) -> Result<NonZeroUsize, String> {
    text.parse()
        .ok()
        .filter(|&frames: &NonZeroUsize| frames.get() <= MOST_FRAMES)
        .ok_or_else(|| format!("a whole number from 1 to {MOST_FRAMES} is needed"))
}

fn parse_fingers(text: &str) -> Result<usize, String> {
    text.parse()
        .ok()
        .filter(|fingers| (FEWEST_HOLDING..=5).contains(fingers))
        .ok_or_else(|| format!("a whole number from {FEWEST_HOLDING} to 5 is needed"))
}
