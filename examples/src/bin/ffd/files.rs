//! Reading and writing the files of a command.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use examples::{
    command::read,
    mesh_file::{MeshFile, MeshFileError, MeshFormat},
};
use ffd_core::Sequence;
use serde::Deserialize;
use serde::de::{DeserializeOwned, IgnoredAny};

/// Why a file cannot be used.
#[derive(Debug, thiserror::Error)]
pub(crate) enum FileError {
    /// The message of the error begins with the path.
    #[error(transparent)]
    Unreadable(#[from] io::Error),
    /// The message of the error ends in line and column.
    #[error("{path}: {error}", path = path.display())]
    Json {
        path: PathBuf,
        error: serde_json::Error,
    },
    #[error("{path}: {error}", path = path.display())]
    Mesh { path: PathBuf, error: MeshFileError },
    #[error("{path}: it deforms the plane, and a mesh lies in space", path = path.display())]
    Planar { path: PathBuf },
    #[error(
        "{path}: there is such a file already; --force replaces it",
        path = path.display()
    )]
    Exists { path: PathBuf },
    #[error("{path}: this is what is read; the output needs a name of its own", path = path.display())]
    OutputIsInput { path: PathBuf },
    #[error("{path}: two outputs cannot have the same name", path = path.display())]
    SameOutput { path: PathBuf },
}

/// Reads a mesh of whatever format its name promises.
pub(crate) fn read_mesh(path: &Path) -> Result<MeshFile, FileError> {
    let at_path = |error| FileError::Mesh {
        path: path.to_owned(),
        error,
    };
    let format = MeshFormat::from_path(path).map_err(at_path)?;
    MeshFile::parse(&read(path)?, format).map_err(at_path)
}

/// Reads JSON text.
pub(crate) fn parse_json<T: DeserializeOwned>(path: &Path, bytes: &[u8]) -> Result<T, FileError> {
    // Some editors put a mark in front of Unicode text.
    let text = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    serde_json::from_slice(text).map_err(|error| FileError::Json {
        path: path.to_owned(),
        error,
    })
}

/// Lattices of one dimension or the other.
pub(crate) enum AnySequence {
    Plane(Sequence<2>),
    Space(Sequence<3>),
}

/// Reads a lattice, as a sequence of one, or a sequence.
pub(crate) fn read_any_sequence(path: &Path) -> Result<AnySequence, FileError> {
    let bytes = read(path)?;
    // Errors are left to the reader proper, which knows better what is wrong.
    let outline = parse_json::<Outline>(path, &bytes).unwrap_or_default();
    if outline.dimension() == Some(2) {
        parse_json(path, &bytes).map(AnySequence::Plane)
    } else {
        parse_json(path, &bytes).map(AnySequence::Space)
    }
}

/// Reads lattices for a mesh.
pub(crate) fn read_sequence(path: &Path) -> Result<Sequence<3>, FileError> {
    match read_any_sequence(path)? {
        AnySequence::Space(sequence) => Ok(sequence),
        AnySequence::Plane(_) => Err(FileError::Planar {
            path: path.to_owned(),
        }),
    }
}

/// As much of a lattice file as tells its dimension.
#[derive(Default, Deserialize)]
#[serde(default)]
struct Outline {
    degree: Vec<IgnoredAny>,
    sequence: Vec<Outline>,
}

impl Outline {
    fn dimension(&self) -> Option<usize> {
        let lattice = self.sequence.first().unwrap_or(self);
        (!lattice.degree.is_empty()).then_some(lattice.degree.len())
    }
}

/// Checks early that a file can be written, so that no work is done in vain; writing
/// checks again.
pub(crate) fn check_output(path: &Path, force: bool, inputs: &[&Path]) -> Result<(), FileError> {
    let path = path.to_owned();
    if let Ok(target) = path.canonicalize() {
        let is_target = |input: &&Path| input.canonicalize().is_ok_and(|input| input == target);
        if inputs.iter().any(is_target) {
            return Err(FileError::OutputIsInput { path });
        }
    }
    if path.symlink_metadata().is_ok() && !force {
        return Err(FileError::Exists { path });
    }
    Ok(())
}

/// Checks the same for two files, which must be different.
pub(crate) fn check_distinct(a: &Path, b: &Path) -> Result<(), FileError> {
    // Of a file that is not there yet, the folder is.
    let place = |path: &Path| -> Option<PathBuf> {
        path.canonicalize().ok().or_else(|| {
            let folder = path.parent().filter(|p| !p.as_os_str().is_empty());
            let folder = fs::canonicalize(folder.unwrap_or(Path::new("."))).ok()?;
            Some(folder.join(path.file_name()?))
        })
    };
    if a == b || place(a).is_some_and(|a| Some(a) == place(b)) {
        return Err(FileError::SameOutput { path: b.to_owned() });
    }
    Ok(())
}

/// Checks that the name of an output promises a format.
pub(crate) fn check_format(path: &Path) -> Result<(), FileError> {
    match MeshFormat::from_path(path) {
        Ok(_) => Ok(()),
        Err(error) => Err(FileError::Mesh {
            path: path.to_owned(),
            error,
        }),
    }
}

/// The bytes of a mesh in the format that the name of the output promises.
pub(crate) fn encode(mesh: &MeshFile, path: &Path) -> Result<Vec<u8>, FileError> {
    let bytes = MeshFormat::from_path(path).and_then(|format| mesh.encode(format));
    bytes.map_err(|error| FileError::Mesh {
        path: path.to_owned(),
        error,
    })
}

/// What the output does not keep.
pub(crate) fn encoding_notes(mesh: &MeshFile, path: &Path) -> Vec<String> {
    let format = MeshFormat::from_path(path);
    let notes = format.map_or(Vec::new(), |format| mesh.notes(format));
    let with_path = |note| format!("{}: {note}", path.display());
    notes.into_iter().map(with_path).collect()
}
