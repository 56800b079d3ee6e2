//! The file of a checkpoint: one writer at a time, each state written aside, brought to the disk and only then renamed into place.

use std::fs::{self, File, TryLockError};
use std::io::{self, BufWriter, Read, Seek, Write};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};

/// What network file systems without a lock service answer.
const ENOLCK: i32 = 37;

/// A file that only this process writes, as long as this lives.
#[derive(Debug)]
pub struct StateFile {
    path: PathBuf,
    /// Where a state is written before it is renamed; a killed process leaves it behind.
    part: PathBuf,
    lock: PathBuf,
    /// Held locked.
    _locked: File,
}

impl StateFile {
    /// Takes the file for this process and cleans up after killed ones. The file itself is not touched.
    ///
    /// # Errors
    /// [`Error::Output`] if another process has it, or it cannot be written.
    pub fn take(path: &Path) -> Result<Self> {
        let fail = |message: String| Error::Output { file: path.to_owned(), message };
        if path.is_dir() {
            return Err(fail("it is a folder".to_owned()));
        }
        let name = path.file_name().ok_or_else(|| fail("it has no name".to_owned()))?.to_string_lossy().into_owned();
        let folder = match path.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
        };
        if !folder.is_dir() {
            return Err(fail(format!("there is no folder {}", folder.display())));
        }
        let lock = folder.join(format!(".{name}.lock"));
        let locked = locked(&lock).map_err(|e| match e {
            Refusal::Held(owner) => fail(format!("another process{owner} is writing it")),
            Refusal::System(e) => fail(format!("no file can be created in {}: {e}", folder.display())),
        })?;
        let file = Self { path: path.to_owned(), part: folder.join(format!(".{name}.part")), lock, _locked: locked };
        remove(&file.part).map_err(|e| fail(format!("the left-over {} cannot be removed: {e}", file.part.display())))?;
        Ok(file)
    }

    /// Where the file is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Replaces the file by what `write` writes. What was there stays until the new one is on the disk.
    ///
    /// # Errors
    /// [`Error::Output`] if that fails; nothing is left behind, and the earlier file is as it was.
    pub fn replace(&self, write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>) -> Result<()> {
        let replaced = replace(&self.path, &self.part, write);
        if replaced.is_err() {
            // The first error is the one to tell of.
            let _ = remove(&self.part);
        }
        replaced.map_err(|e| Error::Output { file: self.path.clone(), message: e.to_string() })
    }
}

impl Drop for StateFile {
    fn drop(&mut self) {
        // Before the lock goes, so that nobody finds a file that is about to vanish.
        let _ = remove(&self.lock);
    }
}

fn replace(path: &Path, part: &Path, write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>) -> io::Result<()> {
    remove(part)?;
    let mut out = BufWriter::with_capacity(1 << 20, File::create_new(part)?);
    write(&mut out)?;
    let file = out.into_inner().map_err(io::IntoInnerError::into_error)?;
    file.sync_data()?;
    drop(file);
    fs::rename(part, path)?;
    // The name comes to the disk too. Where folders cannot be synchronised, the system does it in its time.
    let folder = part.parent().and_then(|folder| File::open(folder).ok());
    let _ = folder.map(|folder| folder.sync_all());
    Ok(())
}

/// Removes a file that may not be there.
fn remove(path: &Path) -> io::Result<()> {
    match fs::remove_file(path) {
        Err(e) if e.kind() != io::ErrorKind::NotFound => Err(e),
        _ => Ok(()),
    }
}

enum Refusal {
    /// Another process holds the lock; its number as text, if it has left it.
    Held(String),
    System(io::Error),
}

/// Makes a lock file and locks it.
fn locked(path: &Path) -> Result<File, Refusal> {
    loop {
        let mut file = File::options().read(true).write(true).create(true).truncate(false).open(path).map_err(Refusal::System)?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                let mut owner = String::new();
                let _ = file.take(64).read_to_string(&mut owner);
                let owner = owner.trim();
                return Err(Refusal::Held(if owner.is_empty() { String::new() } else { format!(" ({owner})") }));
            }
            // A file system without locks: better no lock than no render.
            Err(TryLockError::Error(e)) if e.kind() == io::ErrorKind::Unsupported || e.raw_os_error() == Some(ENOLCK) => {}
            Err(TryLockError::Error(e)) => return Err(Refusal::System(e)),
        }
        // Between opening and locking, the owner may have removed the file; then it is another that has to be locked.
        let ours = file.metadata().map_err(Refusal::System)?;
        if fs::metadata(path).is_ok_and(|there| (there.dev(), there.ino()) == (ours.dev(), ours.ino())) {
            // Only told to those who come later.
            let _ = file.set_len(0).and_then(|()| file.rewind()).and_then(|()| writeln!(file, "process {}", std::process::id()));
            return Ok(file);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<_> =
            fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_state_replaces_the_earlier_one_whole_or_not_at_all() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.state");
        fs::write(folder.path().join(".a.state.part"), "left over").unwrap();
        fs::write(folder.path().join(".b.state.part"), "of another").unwrap();
        let file = StateFile::take(&path).unwrap();
        assert_eq!(names(folder.path()), [".a.state.lock", ".b.state.part"]);
        file.replace(|out| out.write_all(b"first")).unwrap();
        let failed = file.replace(|out| {
            out.write_all(b"half of the n")?;
            Err(io::Error::from(io::ErrorKind::StorageFull))
        });
        assert!(failed.unwrap_err().to_string().starts_with(&format!("cannot write {}: ", path.display())));
        assert_eq!(fs::read(&path).unwrap(), b"first");
        file.replace(|out| out.write_all(b"second")).unwrap();
        drop(file);
        assert_eq!(fs::read(&path).unwrap(), b"second");
        assert_eq!(names(folder.path()), [".b.state.part", "a.state"]);
    }

    #[test]
    fn only_one_has_it_at_a_time() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.state");
        let first = StateFile::take(&path).unwrap();
        let second = StateFile::take(&path).unwrap_err();
        assert_eq!(second.kind(), crate::ErrorKind::Output);
        assert!(second.to_string().contains(&format!("another process (process {}) is writing it", std::process::id())), "{second}");
        drop(first);
        let again = StateFile::take(&path).unwrap();
        // One that was killed leaves its lock file, but no lock.
        fs::write(folder.path().join(".b.state.lock"), "process 1\n").unwrap();
        StateFile::take(&folder.path().join("b.state")).unwrap();
        drop(again);
        assert!(names(folder.path()).is_empty());
    }

    #[test]
    fn places_that_cannot_be_written_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        for path in [folder.path().to_owned(), folder.path().join("missing/a"), "/proc/a".into()] {
            assert!(matches!(StateFile::take(&path), Err(Error::Output { .. })), "{}", path.display());
        }
    }
}
