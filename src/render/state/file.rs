//! The file of a checkpoint: one writer at a time, each state written to a temporary file, synced to the disk and only
//! then renamed.

use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::file::{self, Lock, LockError};

/// A file that only this process writes, as long as this lives.
#[derive(Debug)]
pub struct StateFile {
    /// As it was named.
    path: PathBuf,
    /// Where it is, behind symbolic links.
    target: PathBuf,
    _lock: Lock,
}

impl StateFile {
    /// Takes the file for this process and cleans up after killed ones. The file itself is not touched. The lock is
    /// beside the file that symbolic links lead to, so that it is one lock by whatever name.
    ///
    /// # Errors
    /// [`Error::Output`] if another process has it, it cannot be written, or is no regular file.
    pub fn take(path: &Path) -> Result<Self> {
        let fail = |message: String| Error::Output { file: path.to_owned(), message };
        let target = file::resolve(path)?;
        file::check_creatable(path)?;
        let mut name = std::ffi::OsString::from(".");
        name.push(target.file_name().unwrap_or_default());
        name.push(".lock");
        let lock = Lock::take(&target.with_file_name(name)).map_err(|e| match e {
            LockError::Held(owner) if owner.is_empty() => fail("another process is writing it".to_owned()),
            LockError::Held(owner) => fail(format!("another process ({owner}) is writing it")),
            LockError::System(e) => fail(format!("it cannot be locked: {e}")),
        })?;
        Ok(Self { path: path.to_owned(), target, _lock: lock })
    }

    /// Where the file is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Replaces the file by what `write` writes. What was there stays until the new one is on the disk.
    ///
    /// # Errors
    /// [`Error::Output`] if that fails; nothing is left behind, and the earlier file is as it was.
    pub fn replace(&self, write: impl FnOnce(&mut BufWriter<&mut File>) -> std::io::Result<()>) -> Result<()> {
        file::write_synchronized(&self.target, |out| write(out).map_err(|e| e.to_string()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;
    use std::io::{self, Write};
    use std::os::unix::fs::symlink;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<_> = fs::read_dir(folder)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn a_state_replaces_the_earlier_one_whole_or_not_at_all() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.state");
        fs::write(folder.path().join(".b.state.lock"), "of another").unwrap();
        let file = StateFile::take(&path).unwrap();
        assert_eq!(names(folder.path()), [".a.state.lock", ".b.state.lock"]);
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
        assert_eq!(names(folder.path()), [".b.state.lock", "a.state"]);
    }

    #[test]
    fn only_one_has_it_at_a_time() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.state");
        let first = StateFile::take(&path).unwrap();
        let second = StateFile::take(&path).unwrap_err();
        assert_eq!(second.kind(), crate::ErrorKind::Output);
        assert!(
            second.to_string().contains(&format!("another process (process {}) is writing it", std::process::id())),
            "{second}"
        );
        drop(first);
        let again = StateFile::take(&path).unwrap();
        // One that was killed leaves its lock file, but no lock.
        fs::write(folder.path().join(".b.state.lock"), "process 1\n").unwrap();
        StateFile::take(&folder.path().join("b.state")).unwrap();
        drop(again);
        assert!(names(folder.path()).is_empty());
    }

    #[test]
    fn a_link_stays_and_has_the_lock_of_its_file() {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("there")).unwrap();
        let (link, path) = (folder.path().join("a.state"), folder.path().join("there/b.state"));
        symlink("there/b.state", &link).unwrap();
        let file = StateFile::take(&link).unwrap();
        assert!(StateFile::take(&path).unwrap_err().to_string().contains("another process"));
        file.replace(|out| out.write_all(b"state")).unwrap();
        drop(file);
        assert_eq!(fs::read(&path).unwrap(), b"state");
        assert_eq!(fs::read_link(&link).unwrap(), Path::new("there/b.state"));
        assert_eq!(
            (names(folder.path()), names(&folder.path().join("there"))),
            (vec!["a.state".into(), "there".into()], vec!["b.state".into()])
        );
    }

    #[test]
    fn places_that_cannot_be_written_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        for path in [folder.path().to_owned(), folder.path().join("missing/a"), "/proc/a".into(), "/dev/null".into()] {
            assert!(matches!(StateFile::take(&path), Err(Error::Output { .. })), "{}", path.display());
        }
    }
}
