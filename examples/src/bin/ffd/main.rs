//! Free-form deformation for those who do not write programs: deforms mesh files by
//! lattice files, undoes that, drags points, and evaluates lattices.

mod cli;
mod deform;
mod eval;
mod files;
mod pull;
mod undo;

use std::{
    io::{self, Write as _},
    process::ExitCode,
};

use clap::Parser as _;
use cli::{Cli, Command};

type Error = Box<dyn std::error::Error>;

/// What a command has to say when it has done its work.
struct Answer {
    /// Goes to standard output.
    json: serde_json::Value,
    /// Go to standard error, a line each.
    notes: Vec<String>,
}

fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) if error.use_stderr() => {
            // The message proper, without how to get help, on one line.
            let text = error.to_string();
            let lines = text.lines().take_while(|line| !line.is_empty());
            let line = lines.map(str::trim).collect::<Vec<_>>().join(" ");
            eprintln!("{}", on_one_line(&line));
            return ExitCode::from(2);
        }
        Err(help) => help.exit(),
    };
    match run(&cli.command) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {}", on_one_line(&error.to_string()));
            ExitCode::from(2)
        }
    }
}

fn run(command: &Command) -> Result<(), Error> {
    let answer = match command {
        Command::Deform(arguments) => deform::run(arguments),
        Command::Undo(arguments) => undo::run(arguments),
        Command::Pull(arguments) => pull::run(arguments),
        Command::Eval(arguments) => eval::run(arguments),
    }?;
    for note in answer.notes {
        eprintln!("note: {}", on_one_line(&note));
    }
    let mut out = io::BufWriter::new(io::stdout().lock());
    let written = serde_json::to_writer(&mut out, &answer.json)
        .map_err(io::Error::from)
        .and_then(|()| out.write_all(b"\n"))
        .and_then(|()| out.flush());
    match written {
        // Whoever reads has seen enough, as in `ffd eval … | head`.
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        written => Ok(written?),
    }
}

/// Longest message, in characters: a file may hold a name of any length.
const LONGEST: usize = 500;

/// A message that may quote a file, made fit for a terminal.
fn on_one_line(message: &str) -> String {
    let mut line = String::new();
    for (count, c) in message.chars().enumerate() {
        if count == LONGEST {
            line.push('…');
            break;
        }
        if c.is_control() {
            line.extend(c.escape_default());
        } else {
            line.push(c);
        }
    }
    line
}
