//! Warps a picture by dragging points of it, and shows where space is stretched and whether
//! it folds.

use std::{path::PathBuf, process::ExitCode};

use clap::Parser;
use examples::{
    command::{self, Answer},
    output::write_new_file,
    raster::Image,
    warp::{self, Drag, FEWEST_CELLS, Panels, Watch},
};
use ffd_core::{Constraint, DirectError, Evidence, Outcome, PullOptions};
use serde_json::json;

const EXAMPLES: &str = "\
Examples:
  warp -o warp.png                            a face smiles
  warp -o hat.png --drag 480,180:120,0 --drag 480,400:0,0
                                              a hat is pushed aside
  warp -o cat.png --image cat.png --drag 200,150:0,-40 --cells 20

Positions are pixels, x to the right and y down; the face has 960 by 960. The edges of
the picture stay where they are. Written is a PNG of three panels: what is dragged, the
warped picture with the lattice, and the determinant of the Jacobian, with stripes where
the picture is folded, and outlines around cells that are proven to fold.

The warp grows in steps, as if the mouse were dragged, and each step is tested. Printed as
JSON: the verdict on the last, in the words of `ffd check`, with an interval for the least
determinant; how far the warp had come when it began to fold, and how long the tests took
(`live`); and the range of the determinant as found by computing it four times a pixel of
the panel (`det`, `folded`), which proves nothing.

Exits with 0 if the picture was written, whatever the verdict, with 2 if the input is bad.
";

/// More cells than this a side are finer than the pixels of a panel.
const MOST_CELLS: usize = 200;

/// Larger pictures take more than a gigabyte of memory.
const MOST_PIXELS: usize = 40_000_000;

/// Warps a picture by dragging points.
#[derive(Debug, Parser)]
#[command(name = "warp", version, after_help = EXAMPLES)]
struct Cli {
    /// A point and how far it is dragged; may be repeated. 0,0 holds a point in place
    #[arg(long, value_name = "x,y:dx,dy", allow_hyphen_values = true, value_parser = parse_drag)]
    drag: Vec<Drag>,

    /// A picture to warp instead of the face
    #[arg(long, value_name = "PNG", requires = "drag")]
    image: Option<PathBuf>,

    /// Cells of the lattice along the longer side, 7 to 200: many make a local warp
    #[arg(long, value_name = "N", default_value = "14", value_parser = parse_cells)]
    cells: usize,

    /// In how many steps the warp grows, 1 to 10000
    #[arg(long, value_name = "N", default_value = "25", value_parser = clap::value_parser!(u16).range(1..=10_000))]
    steps: u16,

    /// Where the PNG goes
    #[arg(short = 'o', long = "output", value_name = "OUT")]
    output: PathBuf,

    /// Replace a file that is there already
    #[arg(long)]
    force: bool,
}

type Error = Box<dyn std::error::Error>;

fn main() -> ExitCode {
    command::run(run)
}

fn run(cli: &Cli) -> Result<Answer, Error> {
    if cli.output.symlink_metadata().is_ok() {
        let is_input = |image: &PathBuf| {
            let target = cli.output.canonicalize();
            target.is_ok_and(|target| image.canonicalize().is_ok_and(|image| image == target))
        };
        let name = cli.output.display();
        if cli.image.as_ref().is_some_and(is_input) {
            return Err(format!(
                "{name}: this is what is read; the output needs a name of its own"
            )
            .into());
        }
        if !cli.force {
            return Err(
                format!("{name}: there is such a file already; --force replaces it").into(),
            );
        }
    }
    let picture = match &cli.image {
        None => warp::portrait(),
        Some(path) => {
            let picture = Image::read_png(&command::read(path)?);
            let picture = picture.map_err(|error| format!("{}: {error}", path.display()))?;
            if picture.rgb.len() > MOST_PIXELS {
                let pixels = picture.rgb.len();
                let path = path.display();
                return Err(format!("{path}: {pixels} pixels are more than {MOST_PIXELS}").into());
            }
            picture
        }
    };
    let drags = match cli.drag.as_slice() {
        [] => warp::portrait_drags(),
        drags => drags.to_vec(),
    };
    for Drag { at: [x, y], .. } in &drags {
        let inside =
            (0.0..=picture.width as f64).contains(x) && (0.0..=picture.height as f64).contains(y);
        if !inside {
            let (width, height) = (picture.width, picture.height);
            return Err(
                format!("--drag {x},{y}: the picture has {width} by {height} pixels").into(),
            );
        }
    }

    let mut lattice = warp::lattice_at_rest(&picture, cli.cells)?;
    let constraints: Vec<_> = drags.iter().map(|d| Constraint::new(d.at, d.by)).collect();
    let pull = lattice
        .pull(&constraints, &PullOptions::default())
        .map_err(|error| describe(&error, &drags))?;
    let watch = Watch::new(&lattice, cli.steps.into())?;
    let verdict = &watch.verdict;
    let panels = Panels::new(&picture, &lattice, &drags, verdict);
    let mut png = Vec::new();
    panels.sheet().write_png(&mut png)?;
    write_new_file(&cli.output, &png, cli.force)?;

    let range = panels.range();
    let mut notes = Vec::new();
    if !verdict.is_regular() {
        let part = 100.0 * watch.irregular_from.unwrap_or(1.0);
        let what = match verdict.outcome {
            Outcome::Undecided(_) => "it is undecided whether the warp folds the picture,",
            Outcome::Degenerate { .. } => "the warp squeezes the picture flat at a point,",
            _ => "the warp folds the picture,",
        };
        notes.push(format!(
            "{what} from {part:.0} % of the way on; drag less far or with fewer cells"
        ));
    }
    let witness = match verdict.outcome {
        Outcome::NotInjective(Evidence::BothSigns { positive, negative }) => {
            Some(vec![positive.world, negative.world])
        }
        Outcome::Degenerate { zero, .. } => Some(vec![zero.world]),
        _ => None,
    };
    let mut micros: Vec<_> = watch.times.iter().map(|t| t.as_secs_f64() * 1e6).collect();
    micros.sort_by(f64::total_cmp);
    let summary = json!({
        "picture": [picture.width, picture.height],
        "cells": lattice.grid().cells(),
        "drags": drags.len(),
        "largest_residual": pull.largest_residual,
        "verdict": verdict.outcome.name(),
        "theorem": verdict.theorem().map(|theorem| theorem.name()),
        "min_det": verdict.min_det,
        "witness": witness,
        "irregular_cells": verdict.irregular_cells,
        "live": {
            "steps": micros.len(),
            "irregular_from": watch.irregular_from,
            "median_micros": micros[micros.len() / 2],
            "worst_micros": micros.last(),
        },
        "det": { "min": range.min, "max": range.max },
        "folded": range.folded,
    });
    Ok(Answer::new(&summary, notes)?)
}

/// What is wrong, with the drags as the user wrote them.
fn describe(error: &DirectError, drags: &[Drag]) -> String {
    let name = |&index: &usize| {
        let [x, y] = drags[index].at;
        format!("{x},{y}")
    };
    match error {
        DirectError::Inconsistent { constraints, .. } => {
            let names: Vec<_> = constraints.iter().map(name).collect();
            format!("--drag {}: they contradict each other", names.join(" and "))
        }
        DirectError::Unreachable { constraint, .. } => format!(
            "--drag {}: this is too near to the edge of the picture, which does not move",
            name(constraint)
        ),
        error => format!("--drag: {error}"),
    }
}

fn parse_drag(text: &str) -> Result<Drag, String> {
    let pair = |text: &str| -> Option<[f64; 2]> {
        let (x, y) = text.split_once(',')?;
        let number = |c: &str| c.trim().parse().ok().filter(|c: &f64| c.is_finite());
        Some([number(x)?, number(y)?])
    };
    text.split_once(':')
        .and_then(|(at, by)| {
            Some(Drag {
                at: pair(at)?,
                by: pair(by)?,
            })
        })
        .ok_or_else(|| "four finite numbers are needed: x,y:dx,dy".to_owned())
}

fn parse_cells(text: &str) -> Result<usize, String> {
    text.parse()
        .ok()
        .filter(|cells| (FEWEST_CELLS..=MOST_CELLS).contains(cells))
        .ok_or_else(|| format!("a whole number from {FEWEST_CELLS} to {MOST_CELLS} is needed"))
}
