//! Free-form deformation for those who do not write programs: deforms mesh files by
//! lattice files, undoes that, drags points, evaluates lattices, finds out whether they
//! fold, or when, and checks proofs of that.

mod check;
mod cli;
mod deform;
mod eval;
mod files;
mod pull;
mod step;
mod undo;
mod verify;

use std::process::ExitCode;

use cli::{Cli, Command};
use examples::command::{self, Answer};

type Error = Box<dyn std::error::Error>;

fn main() -> ExitCode {
    command::run(|cli: &Cli| match &cli.command {
        Command::Deform(arguments) => deform::run(arguments),
        Command::Undo(arguments) => undo::run(arguments),
        Command::Pull(arguments) => pull::run(arguments),
        Command::Eval(arguments) => eval::run(arguments),
        Command::Check(arguments) => check::run(arguments),
        Command::Verify(arguments) => verify::run(arguments),
        Command::Step(arguments) => step::run(arguments),
    })
}
