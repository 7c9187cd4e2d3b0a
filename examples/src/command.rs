//! What small programs have in common: arguments, files to read, answers, messages.
//!
//! They print JSON to standard output and one line for each message to standard error,
//! and exit with 0 if they have answered, 1 if what they were to check does not
//! hold or what they were to do was possible only in part, and 2 if
//! the input is bad.

use std::{
    fs::File,
    io::{self, Read as _, Write as _},
    path::Path,
    process::ExitCode,
};

use serde::Serialize;

/// Larger files are not read: they would fill the memory of many machines several times.
pub const MOST_BYTES: u64 = 1 << 30;

/// Longest message, in characters: a file may hold a name of any length.
const LONGEST: usize = 500;

/// What a program has to say when it has done its work.
#[derive(Debug)]
pub struct Answer {
    /// Goes to standard output, unless it is there already.
    json: Option<String>,
    /// Go to standard error, a line each.
    notes: Vec<String>,
    exit: Exit,
}

/// How a program ends that had something to say.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Exit {
    Complete = 0,
    Refused = 1,
    Incomplete = 2,
}

impl Answer {
    /// An answer in JSON, and notes of one sentence each.
    ///
    /// # Errors
    ///
    /// Those of the data.
    pub fn new(json: &impl Serialize, notes: Vec<String>) -> serde_json::Result<Self> {
        Ok(Self {
            json: Some(serde_json::to_string(json)?),
            notes,
            exit: Exit::Complete,
        })
    }

    /// For a program that has printed its answers one by one, with [`print_line`], and
    /// its errors with [`print_error`]. If not all questions had an answer, the program
    /// exits with 2.
    #[must_use]
    pub fn printed(complete: bool) -> Self {
        Self {
            json: None,
            notes: Vec::new(),
            exit: if complete {
                Exit::Complete
            } else {
                Exit::Incomplete
            },
        }
    }

    /// For a program that has printed, with [`print_line`], whether what it was to check
    /// holds. If not, it exits with 1.
    #[must_use]
    pub fn checked(holds: bool) -> Self {
        Self {
            json: None,
            notes: Vec::new(),
            exit: if holds { Exit::Complete } else { Exit::Refused },
        }
    }

    /// An answer in JSON, and notes, for a program that could do only part of what it was
    /// asked: it exits with 1.
    ///
    /// # Errors
    ///
    /// Those of the data.
    pub fn short(json: &impl Serialize, notes: Vec<String>) -> serde_json::Result<Self> {
        Ok(Self {
            exit: Exit::Refused,
            ..Self::new(json, notes)?
        })
    }

    /// With notes of one sentence each.
    #[must_use]
    pub fn with_notes(mut self, notes: Vec<String>) -> Self {
        self.notes.extend(notes);
        self
    }
}

/// Parses the arguments, runs the program and reports, all in the usual manner.
pub fn run<C: clap::Parser>(
    program: impl FnOnce(&C) -> Result<Answer, Box<dyn std::error::Error>>,
) -> ExitCode {
    let arguments = match C::try_parse() {
        Ok(arguments) => arguments,
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
    let reported = program(&arguments).and_then(|answer| {
        for note in &answer.notes {
            eprintln!("note: {}", on_one_line(note));
        }
        if let Some(json) = &answer.json {
            print(json)?;
        }
        Ok(answer.exit)
    });
    match reported {
        Ok(exit) => ExitCode::from(exit as u8),
        Err(error) => {
            print_error(error.as_ref());
            ExitCode::from(2)
        }
    }
}

/// Prints one of several answers to standard output at once, as a line of JSON. Returns
/// whether anybody still reads.
///
/// # Errors
///
/// Those of the data and of standard output.
pub fn print_line(json: &impl Serialize) -> io::Result<bool> {
    print(&serde_json::to_string(json)?)
}

/// Prints a line to standard error: what is wrong with one of several questions.
pub fn print_error(error: &dyn std::error::Error) {
    eprintln!("error: {}", on_one_line(&error.to_string()));
}

/// Reads a file that is not too large.
///
/// # Errors
///
/// What the file system says, with the path; [`io::ErrorKind::FileTooLarge`] beyond
/// [`MOST_BYTES`].
pub fn read(path: &Path) -> io::Result<Vec<u8>> {
    read_at_most(path, MOST_BYTES)
        .map_err(|error| io::Error::new(error.kind(), format!("{}: {error}", path.display())))
}

fn read_at_most(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    // Not all files say how large they are, and some have no end.
    File::open(path)?.take(most + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most {
        let message = format!("it has more than {most} bytes");
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, message));
    }
    Ok(bytes)
}

fn print(text: &str) -> io::Result<bool> {
    let mut out = io::stdout().lock();
    match writeln!(out, "{text}").and_then(|()| out.flush()) {
        // Whoever reads has seen enough, as in `ffd eval … | head`.
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(false),
        written => written.map(|()| true),
    }
}

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_stay_on_one_line() {
        assert_eq!(on_one_line("a\nb\u{1b}[0m é"), "a\\nb\\u{1b}[0m é");
        assert_eq!(
            on_one_line(&"x".repeat(10_000)).chars().count(),
            LONGEST + 1
        );
    }

    #[test]
    fn files_without_end_are_refused() {
        #[cfg(unix)]
        {
            let error = read_at_most("/dev/zero".as_ref(), 1000).expect_err("too large");
            assert_eq!(error.kind(), io::ErrorKind::FileTooLarge);
        }
        let error = read("no/such file".as_ref()).expect_err("not there");
        assert!(error.to_string().starts_with("no/such file: "), "{error}");
    }
}
