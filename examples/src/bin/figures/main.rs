//! Draws and measures the figures of J. Gain, N. Dodgson, *Preventing self-intersection
//! under free-form deformation*, IEEE Transactions on Visualization and Computer Graphics
//! 7(4), 2001.

mod cases;
mod comparison;
mod cones;
mod free_form;
mod look;
mod plane;
mod self_intersection;
mod shapes;
mod solid;
mod timings;

use std::{collections::BTreeSet, fmt::Write as _, path::PathBuf, process::ExitCode};

use clap::Parser;
use comparison::Manner;
use examples::{
    command::{self, Answer},
    output::OutputFolder,
    raster::Image,
};
use ffd_core::StepPolicy;
use serde_json::{Value, json};

const EXAMPLES: &str = "\
Examples:
  figures --out figures                       all figures, tables and numbers
  figures --out figures --figure 7 --force    only figure 7

Figures: 1 control points are moved; 2 a point is dragged; 3 pulls that fold; 4 their
determinants; 5 the cones of an injective cell; 6 timings; 7 a squashed hemisphere and
8 a chain, pulled by one lattice and in steps that cannot fold, with pairs of triangles
that cross, counted exactly.

Written are figure-1.png and so on, tables.md and figures.json. Printed is a summary as
JSON. Timings mean something in a release build on an idle machine only. Exits with 0 if
all was written, with 2 if not.
";

/// Draws and measures the figures of the paper on injective free-form deformation.
#[derive(Debug, Parser)]
#[command(name = "figures", version, after_help = EXAMPLES)]
struct Cli {
    /// Folder for the pictures and tables; made if need be
    #[arg(long, value_name = "DIR")]
    out: PathBuf,

    /// Only this figure; may be repeated
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=8))]
    figure: Vec<u8>,

    /// Smaller pictures, coarse meshes, one policy, a single run for each timing
    #[arg(long)]
    quick: bool,

    /// Replace files that are there already
    #[arg(long)]
    force: bool,
}

type Error = Box<dyn std::error::Error>;

/// How much trouble is taken.
#[derive(Debug)]
struct Settings {
    quick: bool,
    /// Width of a panel in pixels, and samples across a pixel.
    panel: usize,
    samples: usize,
    /// Pieces along a side of the height fields, a multiple of the cells.
    field: usize,
    /// Pieces along an edge of the net on which determinants are sampled.
    net: usize,
    policies: Vec<StepPolicy>,
    manners: Vec<Manner>,
    /// Runs for each timing.
    repeats: usize,
}

impl Settings {
    fn new(quick: bool) -> Self {
        let policies = if quick {
            vec![StepPolicy::Exact]
        } else {
            vec![StepPolicy::Paper, StepPolicy::Exact, StepPolicy::Greedy]
        };
        let injective = policies.iter().map(|&policy| Manner::Injective(policy));
        Self {
            quick,
            panel: if quick { 120 } else { 400 },
            samples: if quick { 1 } else { 3 },
            field: if quick { 24 } else { 180 },
            net: if quick { 12 } else { 60 },
            manners: [Manner::Conventional]
                .into_iter()
                .chain(injective)
                .collect(),
            policies,
            repeats: if quick { 1 } else { 21 },
        }
    }
}

/// A figure of the paper, drawn and measured again.
#[derive(Debug)]
struct Figure {
    name: &'static str,
    title: &'static str,
    picture: Option<Image>,
    /// In Markdown.
    table: Option<String>,
    numbers: Value,
}

type Draw = fn(&Settings) -> Result<Figure, Error>;

const FIGURES: [Draw; 8] = [
    free_form::moved_control_points,
    free_form::dragged_point,
    self_intersection::folded_circles,
    self_intersection::determinants,
    cones::conic_hull,
    timings::timings,
    comparison::hemispheres,
    comparison::links,
];

fn main() -> ExitCode {
    command::run(run)
}

fn run(cli: &Cli) -> Result<Answer, Error> {
    let all = 1..=8;
    let chosen: BTreeSet<u8> = match cli.figure.as_slice() {
        [] => all.collect(),
        some => some.iter().copied().collect(),
    };
    let mut names: Vec<_> = chosen
        .iter()
        .filter(|&&number| number != 6)
        .map(|number| format!("figure-{number}.png"))
        .collect();
    names.extend(["tables.md".to_owned(), "figures.json".to_owned()]);
    if !cli.force {
        for name in &names {
            let path = cli.out.join(name);
            if path.symlink_metadata().is_ok() {
                let path = path.display();
                return Err(
                    format!("{path}: there is such a file already; --force replaces it").into(),
                );
            }
        }
    }
    let settings = Settings::new(cli.quick);
    let mut folder = OutputFolder::create(&cli.out)
        .map_err(|error| format!("{}: {error}", cli.out.display()))?;
    let mut tables = String::from("# Figures of Gain & Dodgson 2001\n");
    let mut numbers = serde_json::Map::new();
    for number in chosen {
        let figure = FIGURES[usize::from(number) - 1](&settings)?;
        if let Some(picture) = &figure.picture {
            let mut png = Vec::new();
            picture.write_png(&mut png)?;
            folder.write(&format!("{}.png", figure.name), &png)?;
        }
        if let Some(table) = &figure.table {
            let _infallible = write!(tables, "\n## {}\n\n{table}", figure.title);
        }
        numbers.insert(figure.name.replace('-', "_"), figure.numbers);
    }
    let numbers = Value::Object(numbers);
    folder.write("tables.md", tables.as_bytes())?;
    let mut text = serde_json::to_string_pretty(&numbers)?;
    text.push('\n');
    folder.write("figures.json", text.as_bytes())?;
    let files = folder.commit()?;
    let files: Vec<_> = files
        .iter()
        .map(|path| path.display().to_string())
        .collect();
    Ok(Answer::new(
        &json!({ "files": files, "quick": cli.quick }),
        Vec::new(),
    )?)
}
