//! Files written together or not at all.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

/// A folder in which a run leaves its files.
///
/// Everything is first written to a hidden folder inside it and moved into place by
/// [`commit`](Self::commit), which replaces files of the same names; a run that fails
/// before that leaves no trace and spoils nothing that was there.
#[derive(Debug)]
pub struct OutputFolder {
    path: PathBuf,
    staging: PathBuf,
    /// Folders that this run made, innermost first.
    created: Vec<PathBuf>,
    files: Vec<PathBuf>,
    committed: bool,
}

impl OutputFolder {
    /// Prepares a folder, making it if need be.
    ///
    /// # Errors
    ///
    /// What the file system says.
    pub fn create(path: &Path) -> io::Result<Self> {
        let created = path
            .ancestors()
            .filter(|p| !p.as_os_str().is_empty() && !p.exists())
            .map(Path::to_owned)
            .collect();
        let staging = path.join(format!(".unfinished-{}", std::process::id()));
        fs::create_dir_all(&staging)?;
        Ok(Self {
            path: path.to_owned(),
            staging,
            created,
            files: Vec::new(),
            committed: false,
        })
    }

    /// Writes a file; `name` may have folders in it.
    ///
    /// # Errors
    ///
    /// What the file system says.
    pub fn write(&mut self, name: &str, contents: &[u8]) -> io::Result<()> {
        let path = self.staging.join(name);
        if let Some(parent) = path.parent() {
            fs::create_dir_all(parent)?;
        }
        fs::write(path, contents)?;
        self.files.push(PathBuf::from(name));
        Ok(())
    }

    /// Moves everything into place and names the files, in order of writing.
    ///
    /// # Errors
    ///
    /// What the file system says, with the path. Nothing is moved if a target is
    /// something else than a file that may be replaced.
    pub fn commit(mut self) -> io::Result<Vec<PathBuf>> {
        let targets: Vec<PathBuf> = self.files.iter().map(|name| self.path.join(name)).collect();
        for target in &targets {
            if target.exists() && !target.is_file() {
                return Err(io::Error::other(format!(
                    "{} is in the way: not a file",
                    target.display()
                )));
            }
            if let Some(parent) = target.parent() {
                fs::create_dir_all(parent).map_err(|e| named(parent, &e))?;
            }
        }
        for (name, target) in self.files.iter().zip(&targets) {
            fs::rename(self.staging.join(name), target).map_err(|e| named(target, &e))?;
        }
        self.committed = true;
        Ok(targets)
    }
}

fn named(path: &Path, error: &io::Error) -> io::Error {
    io::Error::new(error.kind(), format!("{}: {error}", path.display()))
}

impl Drop for OutputFolder {
    fn drop(&mut self) {
        // Nothing can be done about a failure here, and nothing is lost by one.
        let _ignored = fs::remove_dir_all(&self.staging);
        if !self.committed {
            for folder in &self.created {
                let _ignored = fs::remove_dir(folder);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_appear_together_or_not_at_all() {
        let root = std::env::temp_dir().join(format!("glove-loop-output-{}", std::process::id()));
        let path = root.join("a/b");

        let mut folder = OutputFolder::create(&path).expect("writable");
        folder.write("report.json", b"1").expect("writable");
        drop(folder);
        assert!(!root.exists(), "a run that failed leaves no trace");

        let mut folder = OutputFolder::create(&path).expect("writable");
        folder.write("report.json", b"1").expect("writable");
        folder.write("frames/0.vtu", b"2").expect("writable");
        assert!(!path.join("report.json").exists());
        let files = folder.commit().expect("writable");
        assert_eq!(files.len(), 2);

        let mut folder = OutputFolder::create(&path).expect("writable");
        folder.write("report.json", b"3").expect("writable");
        drop(folder);
        assert_eq!(fs::read(path.join("report.json")).expect("there"), b"1");

        // A folder where a file must go: nothing is moved.
        fs::create_dir(path.join("object.txt")).expect("writable");
        let mut folder = OutputFolder::create(&path).expect("writable");
        folder.write("report.json", b"4").expect("writable");
        folder.write("object.txt", b"5").expect("writable");
        let error = folder.commit().expect_err("in the way");
        assert!(
            error.to_string().contains("object.txt is in the way"),
            "{error}"
        );
        assert_eq!(fs::read(path.join("report.json")).expect("there"), b"1");
        assert_eq!(fs::read_dir(&path).expect("there").count(), 3);
        fs::remove_dir_all(root).expect("ours");
    }
}
