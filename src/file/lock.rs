//! Locks: a file beside the one that a single process may write.

use std::fs::{self, File, TryLockError};
use std::io::{self, Read, Seek, Write};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

use rustix::fs::OFlags;
use rustix::io::Errno;

/// How the text of a lock file begins.
const MARK: &str = "process ";

/// A lock that this process holds as long as this lives.
#[derive(Debug)]
pub struct Lock {
    path: PathBuf,
    _locked: File,
}

/// Why a lock cannot be had.
#[derive(Debug)]
pub enum LockError {
    /// Another process holds it; its number as text, if it left one.
    Held(String),
    /// The system rejects.
    System(io::Error),
}

impl Lock {
    /// Makes a lock file and locks it. A symbolic link in its place is not followed, and what is no lock file is not
    /// touched.
    ///
    /// # Errors
    /// [`LockError`].
    pub fn take(path: &Path) -> Result<Self, LockError> {
        loop {
            let flags = (OFlags::NOFOLLOW | OFlags::NONBLOCK).bits() as i32;
            let mut options = File::options();
            options.read(true).write(true).create(true).truncate(false).custom_flags(flags);
            let mut file = options.open(path).map_err(LockError::System)?;
            let metadata = file.metadata().map_err(LockError::System)?;
            let mut text = String::new();
            if !metadata.is_file() || metadata.nlink() > 1 || metadata.len() > 64 {
                return Err(LockError::System(foreign(path)));
            }
            let _ = Read::by_ref(&mut file).take(64).read_to_string(&mut text);
            if !text.is_empty() && !text.starts_with(MARK) {
                return Err(LockError::System(foreign(path)));
            }
            match file.try_lock() {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => return Err(LockError::Held(text.trim().to_owned())),
                // A file system without locks: better no lock than no render. NOLCK is what network file systems
                // without a lock service report.
                Err(TryLockError::Error(e))
                    if e.kind() == io::ErrorKind::Unsupported
                        || e.raw_os_error() == Some(Errno::NOLCK.raw_os_error()) => {}
                Err(TryLockError::Error(e)) => return Err(LockError::System(e)),
            }
            // Between opening and locking, the owner may have removed the file; then it is another that has to be
            // locked.
            let own = (metadata.dev(), metadata.ino());
            if fs::symlink_metadata(path).is_ok_and(|there| (there.dev(), there.ino()) == own) {
                // For those who come later.
                let write = |file: &mut File| {
                    file.set_len(0)?;
                    file.rewind()?;
                    writeln!(file, "{MARK}{}", std::process::id())
                };
                let _ = write(&mut file);
                return Ok(Self { path: path.to_owned(), _locked: file });
            }
        }
    }
}

fn foreign(path: &Path) -> io::Error {
    io::Error::new(io::ErrorKind::AlreadyExists, format!("{} is there and is no lock; remove it", path.display()))
}

impl Drop for Lock {
    fn drop(&mut self) {
        // Before the lock goes, so that nobody finds a file that is about to vanish.
        let _ = fs::remove_file(&self.path);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lock_is_held_by_one_and_touches_no_other_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(".a.lock");
        let lock = Lock::take(&path).unwrap();
        let held = Lock::take(&path).unwrap_err();
        assert!(
            matches!(&held, LockError::Held(owner) if *owner == format!("process {}", std::process::id())),
            "{held:?}"
        );
        drop(lock);
        assert!(!path.exists());
        // Of a killed process.
        fs::write(&path, "process 1\n").unwrap();
        drop(Lock::take(&path).unwrap());

        let precious = folder.path().join("precious");
        fs::write(&precious, "text").unwrap();
        std::os::unix::fs::symlink(&precious, &path).unwrap();
        assert!(matches!(Lock::take(&path), Err(LockError::System(_))));
        fs::remove_file(&path).unwrap();
        fs::hard_link(&precious, &path).unwrap();
        assert!(matches!(Lock::take(&path), Err(LockError::System(_))));
        fs::remove_file(&path).unwrap();
        fs::write(&path, "notes").unwrap();
        let refused = Lock::take(&path).unwrap_err();
        assert!(matches!(&refused, LockError::System(e) if e.to_string().contains("is no lock")), "{refused:?}");
        fs::remove_file(&path).unwrap();
        rustix::fs::mkfifoat(rustix::fs::CWD, &path, rustix::fs::Mode::RUSR | rustix::fs::Mode::WUSR).unwrap();
        assert!(matches!(Lock::take(&path), Err(LockError::System(_))));
        assert_eq!(fs::read(&precious).unwrap(), b"text");
    }
}
