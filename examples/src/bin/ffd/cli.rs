//! The command line.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};
use ffd_core::{ConicHull, Method, Outside, StepPolicy};

const EXAMPLES: &str = "\
Examples:
  ffd pull ball.obj --at 0,1,0 --by 0,0.3,0 -o pear.obj --save-lattice pear.json
  ffd deform ball.obj --lattice pear.json -o pear.ply
  ffd undo pear.ply --lattice pear.json -o ball-again.obj
  ffd eval pear.json points.json
  ffd check pear.json --certificate proof.json
  ffd verify pear.json proof.json
  ffd check pear.json
  ffd step rest.json pear.json

A lattice file is JSON, {\"degree\":[3,3,3],\"cells\":[2,2,2],\"origin\":[0,0,0],
\"axes\":[[1,0,0],[0,1,0],[0,0,1]],\"displacements\":[[dx,dy,dz],…]}, or
{\"sequence\":[lattice,…]}; the documentation has the details.

Each command prints a summary as JSON to standard output, and notes to standard
error; `check` and `verify` print a line of JSON for each lattice. It exits with 0 if it
did what it was asked, with 1 if a certificate was rejected, with 2 if the input is bad;
then no file is written.
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
  ffd pull ball.obj --at 0,1,0 --by 0,2,0 --injective -o club.obj --save-lattice club.json

The lattice is cubic. Its box is that of the mesh and 5 % of its length more on each
side, but along no axis shorter than a tenth of its longest side, so that a flat mesh
has room, too. Around it lie three more cells a side, in which the deformation fades
out. The first --by belongs to the first --at, and so on. Displacements of control
points are the smallest that move the points as told.

With --injective the pull is cut into steps, lattices that are applied one after the other
and of which none folds: the deformation as a whole is one-to-one. --save-lattice then
writes {\"sequence\":[lattice,…]}, which all other commands take as well. Where points
cannot go all the way, they go as far as they can, and the exit code is 1; with the policy
paper nothing is written then.
";

const EVAL_EXAMPLES: &str = "\
Examples:
  ffd eval bend.json points.json              points.json: [[0,0,0],[0.5,1,0.25]]

Prints {\"points\":[[x,y,z],…],\"jacobians\":[[9 numbers, row by row],…],\"det\":[…]}; for a
sequence the Jacobian of all lattices together. Points outside stay where they are, and
their Jacobian is the identity. Lattices in two dimensions take and give [x,y] and 4
numbers.
";

const CHECK_EXAMPLES: &str = "\
Examples:
  ffd check pear.json
  ffd check *.json --enclose 1e-6             and the minimum of det J, to a millionth
  ffd check bend.json --method conic          a faster test that gives up more often
  ffd check bend.json --certificate proof.json and a proof, for `ffd verify`

Prints a line for each lattice, as soon as it is judged:

  {\"file\":\"pear.json\",\"verdict\":\"injective\",\"theorem\":\"identity_border\",
   \"min_det\":[0.52,0.61],\"witness\":null,\"conic\":false,\"micros\":412.5,\"index\":0,
   \"method\":\"exact\",\"evidence\":null}                          (on one line)

verdict   injective          det J > 0 on the closed domain, and one-to-one by `theorem`
          locally_injective  det J > 0, but distant points may have the same image
          not_injective      proven to fold
          degenerate         det J is zero at the witness, and nowhere of the other sign
          reversed           det J < 0 on the closed domain: a mirror image
          undecided          none of these was proven
min_det   an interval that contains the least det J; null for a bound not known
witness   not_injective: two points, where det J is positive and where it is negative, or
          two points with the same image; degenerate: one point; else null
conic     whether the conic-hull test of each cell passes
micros    microseconds that the test took, without reading
index     which lattice of a sequence, from 0
evidence  where exactly: cells of the domain and positions in them, from 0 to 1

The lattices of a sequence are judged one by one. If all are injective by
`identity_border`, so is the whole sequence; with other theorems only if each lattice
takes its domain into that of the next.

A certificate is written only if every lattice of the file has one; a note says so if not.

All files that can be read are judged. The exit code is 0 if these are all, whatever the
verdicts; else 2.
";

const VERIFY_EXAMPLES: &str = "\
Examples:
  ffd check bend.json --certificate proof.json
  ffd verify bend.json proof.json

Prints a line for each lattice:

  {\"valid\":true,\"claim\":\"injective\",\"theorem\":\"p_matrix\",\"min_det\":0.52,
   \"reason\":null,\"index\":0}                                    (on one line)

claim     what the certificate says of the lattice, in the words of `ffd check`
theorem   why the map is one-to-one; null unless it is injective
min_det   a lower bound of det J on the closed domain; null unless det J > 0 was claimed
reason    why a certificate is rejected; then nothing is proven, nor disproven

Everything is computed again from the lattice in exact arithmetic. The exit code is 0 if
all certificates are valid, 1 if one is rejected, 2 if a file cannot be read.
";

const STEP_EXAMPLES: &str = "\
Examples:
  ffd step rest.json pear.json
  ffd step before.json after.json --width 1e-9

Displacements go on a straight way from those of the first file, at t = 0, to those of the
second, at t = 1, on the same grid. Prints {\"t\":[lo,hi]} around the first t at which det J
is zero anywhere on the closed domain: it is proven to be positive everywhere for all t up
to lo, and not positive somewhere for some t up to hi.

  [1,null]   nothing folds up to t = 1
  [0,0]      the first lattice is folded, or det J is zero somewhere
  [lo,null]  no fold was found, but lo is as far as anything was proven

Of two sequences of the same length, each lattice goes to the one at the same place, all
at the same t. The answer is about the first of all lattices that folds: up to lo each is
regular, and so is their composition as far as each takes its domain into that of the
next; at some t up to hi one of them is not.
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
    /// Finds out whether lattices fold, with proof
    #[command(after_help = CHECK_EXAMPLES)]
    Check(Check),
    /// Checks certificates of `ffd check` in exact arithmetic
    #[command(after_help = VERIFY_EXAMPLES)]
    Verify(Verify),
    /// Finds out how far a lattice can go towards another before it folds, with proof
    #[command(after_help = STEP_EXAMPLES)]
    Step(Step),
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
    /// Do not fold: pull in as many steps as it takes, each proven to be one-to-one
    #[arg(long, value_enum, value_name = "POLICY", num_args = 0..=1, default_missing_value = "exact")]
    pub(crate) injective: Option<PolicyChoice>,
    #[command(flatten)]
    pub(crate) output: Output,
    /// Also write the lattice, or with --injective the sequence of them
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
pub(crate) struct Check {
    /// Lattices, or sequences of lattices, in the plane or in space
    #[arg(value_name = "L.json", required = true)]
    pub(crate) lattices: Vec<PathBuf>,
    /// Enclose the least det J in an interval of at most this width
    #[arg(long, value_name = "WIDTH", allow_hyphen_values = true, value_parser = parse_width)]
    pub(crate) enclose: Option<f64>,
    /// The test
    #[arg(long, value_enum, default_value = "exact")]
    pub(crate) method: MethodChoice,
    /// Also list all cells that are not regular, as `irregular_cells`
    #[arg(long)]
    pub(crate) all_cells: bool,
    /// Also write a proof of the verdict, for one lattice file
    #[arg(long, value_name = "OUT")]
    pub(crate) certificate: Option<PathBuf>,
    /// Replace a certificate that is there already
    #[arg(long, requires = "certificate")]
    pub(crate) force: bool,
}

#[derive(Debug, Args)]
pub(crate) struct Verify {
    /// The lattice, or a sequence of lattices
    #[arg(value_name = "L.json")]
    pub(crate) lattice: PathBuf,
    /// What `ffd check --certificate` has written
    #[arg(value_name = "CERT.json")]
    pub(crate) certificate: PathBuf,
}

#[derive(Debug, Args)]
pub(crate) struct Step {
    /// The lattice at t = 0, or a sequence of lattices
    #[arg(value_name = "L0.json")]
    pub(crate) from: PathBuf,
    /// The lattice at t = 1 on the same grid, or as many
    #[arg(value_name = "L1.json")]
    pub(crate) to: PathBuf,
    /// The width of the enclosure relative to its upper end
    #[arg(long, value_name = "WIDTH", default_value = "1e-6", allow_hyphen_values = true, value_parser = parse_width)]
    pub(crate) width: f64,
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

/// [`StepPolicy`] as the user writes it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum PolicyChoice {
    /// Halve steps that fail the conic-hull test; all or nothing, as Gain and Dodgson
    Paper,
    /// Halve steps that fail the exact test
    Exact,
    /// Take steps nearly as long as can be, of equal lengths
    Greedy,
}

impl From<PolicyChoice> for StepPolicy {
    fn from(choice: PolicyChoice) -> Self {
        match choice {
            PolicyChoice::Paper => Self::Paper,
            PolicyChoice::Exact => Self::Exact,
            PolicyChoice::Greedy => Self::Greedy,
        }
    }
}

/// [`Method`] as the user writes it.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum MethodChoice {
    /// Bernstein form of det J, subdivision, exact arithmetic: decides nearly everything
    Exact,
    /// The exact test of Gain and Dodgson, as printed: slow
    Paper,
    /// All determinants of partial differences are positive
    Phi,
    /// Cones around the partial differences of each cell
    Conic,
    /// The same cones for the whole lattice
    ConicLattice,
    /// Cones around the mean of the differences of each cell
    ConicOffAxis,
    /// Cones, and cells that fail are cut into halves, up to three times
    ConicSubdivided,
    /// No control point moves by more than the bound of Choi and Lee
    ChoiLee,
}

/// How often [`MethodChoice::ConicSubdivided`] halves cells.
const SUBDIVISIONS: u32 = 3;

impl From<MethodChoice> for Method {
    fn from(choice: MethodChoice) -> Self {
        let hull = ConicHull::default();
        match choice {
            MethodChoice::Exact => Self::Exact,
            MethodChoice::Paper => Self::Paper,
            MethodChoice::Phi => Self::Phi,
            MethodChoice::Conic => Self::Conic(hull),
            MethodChoice::ConicLattice => Self::Conic(ConicHull {
                one_for_all: true,
                ..hull
            }),
            MethodChoice::ConicOffAxis => Self::Conic(ConicHull {
                off_axis: true,
                ..hull
            }),
            MethodChoice::ConicSubdivided => Self::Conic(ConicHull {
                subdivisions: SUBDIVISIONS,
                ..hull
            }),
            MethodChoice::ChoiLee => Self::ChoiLee,
        }
    }
}

fn parse_width(text: &str) -> Result<f64, String> {
    let width = text.trim().parse().ok();
    width
        .filter(|width: &f64| width.is_finite() && *width >= 0.0)
        .ok_or_else(|| "a finite number is needed that is not negative".to_owned())
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
    fn numbers_are_checked() {
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
        for good in ["0", "1e-6", "2"] {
            assert!(parse_width(good).is_ok(), "{good}");
        }
        for bad in ["", "-1e-9", "NaN", "inf", "x"] {
            assert!(parse_width(bad).is_err(), "{bad}");
        }
    }
}
