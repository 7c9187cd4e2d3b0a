//! The command line.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};
use ffd_core::Outside;

const EXAMPLES: &str = "\
Examples:
  ffd pull ball.obj --at 0,1,0 --by 0,0.3,0 -o pear.obj --save-lattice pear.json
  ffd deform ball.obj --lattice pear.json -o pear.ply
  ffd undo pear.ply --lattice pear.json -o ball-again.obj
  ffd eval pear.json points.json

A lattice file is JSON, {\"degree\":[3,3,3],\"cells\":[2,2,2],\"origin\":[0,0,0],
\"axes\":[[1,0,0],[0,1,0],[0,0,1]],\"displacements\":[[dx,dy,dz],…]}, or
{\"sequence\":[lattice,…]}; the documentation has the details.

Each command prints a summary as JSON to standard output, and notes to standard
error. It exits with 0 if it did what it was asked, with 2 if the input is bad; then
nothing is written.
";

const DEFORM_EXAMPLES: &str = "\
Examples:
  ffd deform hand.obj --lattice bend.json -o bent.obj
  ffd deform hand.stl --lattice bend.json -o bent.ply --outside clamp
";

const UNDO_EXAMPLES: &str = "\
Examples:
  ffd undo bent.obj --lattice bend.json -o hand.obj

Undone is a deformation with `--outside keep`. A point can have come from two places,
one within the lattice and one outside: the first is taken. A point that no place is
moved to stays where it is, and so does one for which that cannot be told, where the
deformation folds. These points are counted on standard error and in the summary; the
exit code is 0 all the same.
";

const PULL_EXAMPLES: &str = "\
Examples:
  ffd pull ball.obj --at 0,1,0 --by 0,0.3,0 -o pear.obj
  ffd pull ball.obj --at 0,1,0 --by 0,0.3,0 --at 0,-1,0 --by 0,0,0 -o pear.obj
                                              the second point stays where it is
  ffd pull sheet.ply --at 0,0,0 --by 0,0,-0.1 --cells 8,8,1 -o dent.ply

The lattice is cubic. Its box is that of the mesh and 5 % of its length more on each
side, but along no axis shorter than a tenth of its longest side, so that a flat mesh
has room, too. Around it lie three more cells a side, in which the deformation fades
out. The first --by belongs to the first --at, and so on. Displacements of control
points are the smallest that move the points as told.
";

const EVAL_EXAMPLES: &str = "\
Examples:
  ffd eval bend.json points.json              points.json: [[0,0,0],[0.5,1,0.25]]

Prints {\"points\":[[x,y,z],…],\"jacobians\":[[9 numbers, row by row],…],\"det\":[…]}; for a
sequence the Jacobian of all lattices together. Points outside stay where they are, and
their Jacobian is the identity. Lattices in two dimensions take and give [x,y] and 4
numbers.
";

/// Deforms meshes by lattices of control points (free-form deformation).
///
/// Meshes are OBJ, PLY or STL files, told apart by their names.
#[derive(Debug, Parser)]
#[command(name = "ffd", version, after_help = EXAMPLES, arg_required_else_help = false)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Moves the points and normals of a mesh as a lattice, or a sequence of them, does
    #[command(after_help = DEFORM_EXAMPLES)]
    Deform(Deform),
    /// Moves the points and normals of a deformed mesh back to where they were
    #[command(after_help = UNDO_EXAMPLES)]
    Undo(Undo),
    /// Drags points of a mesh to where you want them, and their surroundings along
    #[command(after_help = PULL_EXAMPLES)]
    Pull(Pull),
    /// Prints images of points, Jacobians and their determinants
    #[command(after_help = EVAL_EXAMPLES)]
    Eval(Eval),
}

#[derive(Debug, Args)]
pub(crate) struct Deform {
    /// The mesh: .obj, .ply or .stl
    pub(crate) mesh: PathBuf,
    /// The lattice, or a sequence of lattices
    #[arg(long, value_name = "L.json")]
    pub(crate) lattice: PathBuf,
    #[command(flatten)]
    pub(crate) output: Output,
    /// What happens to points outside the lattice
    #[arg(long, value_enum, default_value = "keep")]
    pub(crate) outside: OutsideChoice,
}

#[derive(Debug, Args)]
pub(crate) struct Undo {
    /// The deformed mesh: .obj, .ply or .stl
    pub(crate) mesh: PathBuf,
    /// The lattice, or sequence of lattices, by which it was deformed
    #[arg(long, value_name = "L.json")]
    pub(crate) lattice: PathBuf,
    #[command(flatten)]
    pub(crate) output: Output,
}

#[derive(Debug, Args)]
pub(crate) struct Pull {
    /// The mesh: .obj, .ply or .stl
    pub(crate) mesh: PathBuf,
    /// A point to be dragged; may be repeated
    #[arg(long, value_name = "x,y,z", required = true, allow_hyphen_values = true, value_parser = parse_vector)]
    pub(crate) at: Vec<[f64; 3]>,
    /// How far it moves; one for each --at
    #[arg(long, value_name = "dx,dy,dz", required = true, allow_hyphen_values = true, value_parser = parse_vector)]
    pub(crate) by: Vec<[f64; 3]>,
    /// Cells of the lattice along each axis, 1 to 128: few make a wide, soft pull
    #[arg(long, value_name = "nx,ny,nz", default_value = "4,4,4", value_parser = parse_cells)]
    pub(crate) cells: [usize; 3],
    #[command(flatten)]
    pub(crate) output: Output,
    /// Also write the lattice
    #[arg(long, value_name = "L.json")]
    pub(crate) save_lattice: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct Eval {
    /// The lattice, or a sequence of lattices
    #[arg(value_name = "L.json")]
    pub(crate) lattice: PathBuf,
    /// The points
    #[arg(value_name = "POINTS.json", help = "The points, [[x,y,z],…]")]
    pub(crate) points: PathBuf,
}

#[derive(Debug, Args)]
pub(crate) struct Output {
    /// Where the mesh goes; the ending says in which format
    #[arg(short = 'o', long = "output", value_name = "OUT")]
    pub(crate) path: PathBuf,
    /// Replace files that are there already
    #[arg(long)]
    pub(crate) force: bool,
}

/// [`Outside`] as the user writes it.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum OutsideChoice {
    /// They stay where they are
    Keep,
    /// They move with the nearest point of the lattice's box
    Clamp,
    /// Nothing is deformed if there are any
    Error,
}

impl From<OutsideChoice> for Outside {
    fn from(choice: OutsideChoice) -> Self {
        match choice {
            OutsideChoice::Keep => Self::Keep,
            OutsideChoice::Clamp => Self::Clamp,
            OutsideChoice::Error => Self::Error,
        }
    }
}

fn parse_vector(text: &str) -> Result<[f64; 3], String> {
    let number = |part: &str| part.trim().parse().ok().filter(|c: &f64| c.is_finite());
    parse_three(text, number).ok_or_else(|| "three finite numbers are needed: x,y,z".to_owned())
}

/// A lattice of as many cells a side takes 54 MB.
const MOST_CELLS: usize = 128;

fn parse_cells(text: &str) -> Result<[usize; 3], String> {
    let number = |part: &str| {
        let count = part.trim().parse().ok();
        count.filter(|count| (1..=MOST_CELLS).contains(count))
    };
    parse_three(text, number)
        .ok_or_else(|| format!("three whole numbers from 1 to {MOST_CELLS} are needed: nx,ny,nz"))
}

fn parse_three<T>(text: &str, parse: impl Fn(&str) -> Option<T>) -> Option<[T; 3]> {
    let parts: Option<Vec<T>> = text.split(',').map(parse).collect();
    parts?.try_into().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        use clap::CommandFactory as _;
        Cli::command().debug_assert();
    }

    #[test]
    fn vectors_are_three_finite_numbers() {
        assert_eq!(parse_vector("-0.1,0, 2e-3"), Ok([-0.1, 0.0, 2e-3]));
        for bad in [
            "",
            "1,2",
            "1,2,3,4",
            "1,2,x",
            "1,,3",
            "inf,0,0",
            "NaN,0,0",
            "1e999,0,0",
        ] {
            assert!(parse_vector(bad).is_err(), "{bad}");
        }
        assert_eq!(parse_cells("1,2,128"), Ok([1, 2, 128]));
        for bad in ["0,1,1", "1,1", "129,1,1", "-1,1,1", "1.5,1,1"] {
            assert!(parse_cells(bad).is_err(), "{bad}");
        }
    }
}
