//! The glove-driven deformation loop: a virtual hand squeezes a soft object.
//!
//! Simulated devices, moved by a script or by recordings, send protocol bytes; the
//! loop reads them and writes a contact sheet, a report and the deformed object.

mod cli;

use std::{
    fs,
    io::{IsTerminal as _, Write as _},
    path::{Path, PathBuf},
    process::ExitCode,
    time::Instant,
};

use clap::Parser as _;
use cli::Cli;
use examples::{
    deformer::{Deformer, DeformerKind},
    moments::Moments,
    motion::{Motion, NoGrasp, Recording, RecordingSource, Script},
    output::OutputFolder,
    picture::contact_sheet,
    rehearsal,
    report::{JOURNAL_FILE, OBJECT_FILE, Report},
    scene::{Object, Resolution},
    session::{self, SessionOptions},
    soft_body::SoftBody,
    vtu,
};
use fem_tet::io::ObjectFile;
use glove_io::{
    hand::HandModel,
    recording::{parse_joint_recording, parse_pose_recording},
};

/// Frames between two grids of the VTU series.
const VTU_STRIDE: usize = 10;
/// Frame rate of a played recording, frames per second.
const RECORDING_HZ: f64 = 100.0;

type Error = Box<dyn std::error::Error>;

fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) if error.use_stderr() => {
            // One line, without how to get help.
            let text = error.to_string();
            eprintln!("{}", text.lines().next().unwrap_or("error: bad arguments"));
            return ExitCode::from(2);
        }
        Err(help) => help.exit(),
    };
    match run(&cli) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}

fn run(cli: &Cli) -> Result<(), Error> {
    if let Some(threads) = cli.threads {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads.get())
            .build_global()?;
    }
    let model = HandModel::average_right();
    let power_up = Instant::now();
    let object = SoftBody::new(load_object(cli)?, cli.deformer)
        .map_err(|error| format!("{}: {error}", cli.object))?;
    let set_up = power_up.elapsed();
    let recording = load_recording(cli)?;
    let mut out = OutputFolder::create(&cli.out).map_err(|e| at_path(&cli.out, &e))?;

    // A fine object is rehearsed with a coarse one, which costs a tenth of a second.
    let rehearsed = match cli.builtin() {
        Some(kind) if cli.resolution.is_fine() => {
            SoftBody::new(Object::build(kind, Resolution::default())?, cli.deformer)?
        }
        _ => object.clone(),
    };

    // The motion, and how many frames of which length it takes.
    let no_grasp = |error: &dyn std::fmt::Display| format!("{}: {error}", cli.object);
    let (motion, options): (Option<Box<dyn Motion>>, SessionOptions) = match recording {
        Some(source) => {
            let recording = Recording::new(source, &model).map_err(|error| {
                at_path(cli.pose.as_deref().unwrap_or(Path::new("poses")), &error)
            })?;
            let frame_s = 1.0 / RECORDING_HZ;
            let options = cli.session(whole(recording.duration_s() / frame_s) + 1, frame_s);
            let variants = recording.variants(&model);
            let placed = rehearsal::best(variants, &model, &rehearsed, &options)?;
            (placed.map(|m| Box::new(m) as _), options)
        }
        None => {
            let variants = Script::variants(&model, object.surface(), cli.seed)
                .map_err(|error| no_grasp(&error))?;
            // The script is told in as many frames as there are.
            let options = cli.session(cli::SCRIPT_FRAMES, 0.0);
            let duration_s = variants.first().map_or(0.0, Motion::duration_s);
            let options = SessionOptions {
                frame_s: duration_s / options.frames as f64,
                ..options
            };
            let chosen = rehearsal::best(variants, &model, &rehearsed, &options)?;
            (chosen.map(|m| Box::new(m) as _), options)
        }
    };
    let motion = motion.ok_or_else(|| no_grasp(&NoGrasp))?;
    if let Some(fault) = cli.fault
        && fault.frame >= options.frames
    {
        return Err(format!("--fault: there is no frame {}", fault.frame).into());
    }

    let initial_volume_m3 = object.volume_m3();
    let display = object.display().to_vec();
    let tets = object.rest().tets().to_vec();

    let progress = progress_bar(options.frames);
    let mut moments = Moments::new(motion.key_moments(), options.frames, options.frame_s);
    let mut series = Vec::new();
    let mut failed = None;
    let outcome = session::run(&options, &*motion, &model, object, |snapshot, record| {
        moments.see(snapshot, record);
        if cli.vtu && record.frame % VTU_STRIDE == 0 && failed.is_none() {
            let now = snapshot("");
            let name = format!("frames/frame-{:06}.vtu", record.frame);
            let grid = vtu::grid(&now.positions, &tets, &now.displacement_m);
            failed = out.write(&name, grid.as_bytes()).err();
            series.push((name, record.frame as f64 * options.frame_s));
        }
        progress.inc(1);
    })?;
    progress.finish_and_clear();
    if let Some(error) = failed {
        return Err(at_path(&cli.out, &error).into());
    }

    let scripted = cli.joints.is_none() && cli.pose.is_none();
    let seed = scripted.then_some(cli.seed);
    let report = Report {
        arguments: std::env::args().skip(1).collect(),
        ..Report::new(&outcome, seed, options.frame_s, initial_volume_m3, set_up)
    };
    let json = serde_json::to_string_pretty(&report)? + "\n";
    let mut png = Vec::new();
    contact_sheet(
        &format!(
            "{}, {} nodes{}",
            report.object.name,
            report.object.nodes,
            match cli.deformer {
                DeformerKind::Fem => "",
                DeformerKind::Ffd => ", in a lattice",
            }
        ),
        &moments.into_snapshots(),
        &display,
    )
    .write_png(&mut png)?;
    let object_text = outcome.object.to_file()?.to_text();
    let mut files: Vec<(&str, &[u8])> = vec![
        ("report.json", json.as_bytes()),
        ("contact-sheet.png", &png),
        (OBJECT_FILE, object_text.as_bytes()),
    ];
    let journal;
    if let Deformer::FreeForm(free_form) = outcome.object.deformer() {
        journal = serde_json::to_string(&free_form.journal()?.0)? + "\n";
        files.push((JOURNAL_FILE, journal.as_bytes()));
    }
    let pvd = vtu::collection(&series);
    if cli.vtu {
        files.push(("series.pvd", pvd.as_bytes()));
    }
    for (name, contents) in files {
        out.write(name, contents)
            .map_err(|e| at_path(&cli.out, &e))?;
    }
    let written = out.commit()?;

    let mut text = if cli.json { json } else { report.table() };
    if !cli.json {
        for path in written
            .iter()
            .filter(|p| p.extension() != Some("vtu".as_ref()))
        {
            text += &format!("wrote {}\n", path.display());
        }
    }
    match std::io::stdout().write_all(text.as_bytes()) {
        // Whoever reads has seen enough, as in `glove-loop | head`.
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
        answer => Ok(answer?),
    }
}

fn load_object(cli: &Cli) -> Result<Object, Error> {
    if let Some(kind) = cli.builtin() {
        return Ok(Object::build(kind, cli.resolution)?);
    }
    let path = PathBuf::from(&cli.object);
    let text = read(&path)?;
    let file = ObjectFile::parse(&text).map_err(|error| at_path(&path, &error))?;
    Ok(Object::from_file(&cli.object, file).map_err(|error| at_path(&path, &error))?)
}

fn load_recording(cli: &Cli) -> Result<Option<RecordingSource>, Error> {
    if cli.joints.is_none() && cli.pose.is_none() {
        return Ok(None);
    }
    let mut source = RecordingSource::default();
    if let Some(path) = &cli.joints {
        let joints = parse_joint_recording(&read(path)?).map_err(|error| at_path(path, &error))?;
        source.joints = Some(joints);
    }
    if let Some(path) = &cli.pose {
        let poses = parse_pose_recording(&read(path)?).map_err(|error| at_path(path, &error))?;
        source.poses = Some(poses);
    }
    Ok(Some(source))
}

fn read(path: &Path) -> Result<String, String> {
    let bytes = fs::read(path).map_err(|error| at_path(path, &error))?;
    String::from_utf8(bytes).map_err(|error| {
        let valid = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let line = 1 + valid.iter().filter(|&&byte| byte == b'\n').count();
        at_path(path, &format_args!("line {line}: this is not text"))
    })
}

/// The message of an error with the file it belongs to.
fn at_path(path: &Path, error: &dyn std::fmt::Display) -> String {
    format!("{}: {error}", path.display())
}

/// A bar on a terminal, nothing elsewhere.
fn progress_bar(frames: usize) -> indicatif::ProgressBar {
    if std::io::stderr().is_terminal() {
        indicatif::ProgressBar::new(frames as u64)
    } else {
        indicatif::ProgressBar::hidden()
    }
}

/// A number of frames, rounded.
fn whole(frames: f64) -> usize {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "recordings are far shorter than 2^53 frames"
    )]
    let frames = frames.round() as usize;
    frames
}
