//! Files written together or not at all.

use std::{
    fs::{self, File},
    io::{self, Write as _},
    path::{Path, PathBuf},
    sync::atomic::{AtomicU32, Ordering},
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

/// Writes one file, whole or not at all.
///
/// The bytes go to a hidden file beside it, which then takes its place in one step. Unless
/// `force` is set, a file that is there already stays, even if it appeared meanwhile; with
/// `force`, it is replaced and its permissions are kept. A link is followed, so that the
/// file behind it is replaced rather than the link.
///
/// # Errors
///
/// What the file system says, with the path; [`io::ErrorKind::AlreadyExists`] without
/// `force`. Something else than a file is never replaced.
pub fn write_new_file(path: &Path, bytes: &[u8], force: bool) -> io::Result<()> {
    write_new_files(&[(path, bytes)], force)
}

/// Writes several files as [`write_new_file`] does, all of them or none.
///
/// All bytes are on the disk before the first file takes its place. Should a later one
/// fail to do so even then, those that are new are removed again; what `force` has
/// replaced stays replaced.
///
/// # Errors
///
/// As [`write_new_file`].
pub fn write_new_files(files: &[(&Path, &[u8])], force: bool) -> io::Result<()> {
    let mut staged = Vec::with_capacity(files.len());
    for (path, bytes) in files {
        staged.push(Staged::new(path, bytes, force).map_err(|error| named(path, &error))?);
    }
    for (number, ((path, _), file)) in files.iter().zip(&staged).enumerate() {
        file.put_in_place(force).map_err(|error| {
            for earlier in staged[..number].iter().filter(|earlier| !earlier.replaces) {
                let _ignored = fs::remove_file(&earlier.target);
            }
            named(path, &error)
        })?;
    }
    Ok(())
}

/// A file that is written, but not yet where it belongs.
struct Staged {
    unfinished: Unfinished,
    target: PathBuf,
    /// Whether there was a file already.
    replaces: bool,
}

impl Staged {
    fn new(path: &Path, bytes: &[u8], force: bool) -> io::Result<Self> {
        // The link itself, should it lead nowhere.
        let replaces = path.symlink_metadata().is_ok();
        if replaces && !force {
            return Err(already_there());
        }
        let mut target = path.to_owned();
        let mut permissions = None;
        if replaces {
            target = path.canonicalize()?;
            let metadata = target.metadata()?;
            if !metadata.is_file() {
                return Err(io::Error::other("in the way: not a file"));
            }
            permissions = Some(metadata.permissions());
        }
        let (unfinished, mut file) = Unfinished::create_beside(&target)?;
        file.write_all(bytes)?;
        if let Some(permissions) = permissions {
            file.set_permissions(permissions)?;
        }
        // Otherwise a power cut could leave the name without the contents.
        file.sync_all()?;
        Ok(Self {
            unfinished,
            target,
            replaces,
        })
    }

    fn put_in_place(&self, force: bool) -> io::Result<()> {
        let (unfinished, target) = (&self.unfinished.0, &self.target);
        if force {
            return fs::rename(unfinished, target);
        }
        // A hard link, unlike renaming, fails if the name has been taken in the meantime.
        match fs::hard_link(unfinished, target) {
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => Err(already_there()),
            Ok(()) => Ok(()),
            // Some file systems have no hard links: take the name, then fill it.
            Err(_) => {
                File::create_new(target)?;
                fs::rename(unfinished, target).inspect_err(|_| {
                    // Ours, and empty.
                    let _ignored = fs::remove_file(target);
                })
            }
        }
    }
}

fn already_there() -> io::Error {
    io::Error::new(io::ErrorKind::AlreadyExists, "there is such a file already")
}

/// A file of our own that goes away.
struct Unfinished(PathBuf);

impl Unfinished {
    fn create_beside(path: &Path) -> io::Result<(Self, File)> {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        // A run that was killed may have left one that has our number.
        for _ in 0..100 {
            let count = COUNT.fetch_add(1, Ordering::Relaxed);
            let name = format!(".unfinished-{}-{count}", std::process::id());
            let beside = path.with_file_name(name);
            match File::create_new(&beside) {
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                result => return result.map(|file| (Self(beside), file)),
            }
        }
        Err(io::Error::other("no name is left for an unfinished file"))
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        // Gone already if it was renamed.
        let _ignored = fs::remove_file(&self.0);
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

    #[test]
    fn a_file_is_replaced_only_when_told() {
        let root = std::env::temp_dir().join(format!("write-new-file-{}", std::process::id()));
        fs::create_dir_all(&root).expect("writable");
        let path = root.join("mesh.obj");
        let names = || fs::read_dir(&root).expect("there").count();

        write_new_file(&path, b"1", false).expect("free");
        let error = write_new_file(&path, b"2", false).expect_err("taken");
        assert_eq!(error.kind(), io::ErrorKind::AlreadyExists);
        assert!(error.to_string().contains("mesh.obj: "), "{error}");
        assert_eq!(fs::read(&path).expect("there"), b"1");
        write_new_file(&path, b"3", true).expect("writable");
        assert_eq!(fs::read(&path).expect("there"), b"3");
        assert_eq!(names(), 1, "nothing is left beside it");

        // Of many that write at once, one wins, and what it wrote is whole.
        let raced = root.join("raced.obj");
        let winners: usize = std::thread::scope(|scope| {
            let write = |byte| write_new_file(&raced, &[byte; 1000], false);
            let threads: Vec<_> = (0..8)
                .map(|byte| scope.spawn(move || write(byte)))
                .collect();
            let results = threads.into_iter().map(|t| t.join().expect("no panic"));
            results.filter(Result::is_ok).count()
        });
        assert_eq!(winners, 1);
        let bytes = fs::read(&raced).expect("there");
        assert_eq!(bytes, [bytes[0]; 1000]);
        assert_eq!(names(), 2);

        // Of two files with one name, and of one that fits and one that does not, none.
        let other = root.join("other.obj");
        write_new_files(&[(&other, b"1"), (&other, b"2")], false).expect_err("one name");
        write_new_files(&[(&other, b"1"), (&path, b"2")], false).expect_err("taken");
        assert_eq!(names(), 2);
        write_new_files(&[(&other, b"1"), (&path, b"3")], true).expect("writable");
        assert_eq!(fs::read(&other).expect("there"), b"1");
        fs::remove_file(other).expect("ours");

        // A folder is never replaced.
        let folder = root.join("folder");
        fs::create_dir(&folder).expect("writable");
        for force in [false, true] {
            write_new_file(&folder, b"4", force).expect_err("in the way");
        }
        assert!(folder.is_dir());
        write_new_file(&root.join("nowhere/mesh.obj"), b"5", true).expect_err("no folder");
        assert_eq!(names(), 3);

        #[cfg(unix)]
        {
            let link = root.join("link.obj");
            std::os::unix::fs::symlink(&path, &link).expect("writable");
            write_new_file(&link, b"6", false).expect_err("taken");
            write_new_file(&link, b"7", true).expect("writable");
            assert!(link.is_symlink());
            assert_eq!(fs::read(&path).expect("there"), b"7");
            write_new_file(Path::new("/dev/null"), b"8", true).expect_err("a device");
        }
        fs::remove_dir_all(root).expect("ours");
    }
}
