//! Files that appear whole or not at all.

use std::fs::{File, Permissions};
use std::io::{BufWriter, Write};
use std::os::unix::fs::PermissionsExt;
use std::path::Path;

use tempfile::NamedTempFile;

use super::Format;
use crate::error::{Error, Result};

/// Writes a file beside `path` and renames it to `path` when it is complete; what was there stays until then.
///
/// # Errors
/// [`Error::Output`] if that fails; nothing is left behind.
pub fn write_atomically(path: &Path, write: impl FnOnce(&mut BufWriter<&mut File>) -> Result<(), String>) -> Result<()> {
    let fail = |message: String| Error::Output { file: path.to_owned(), message };
    let mut file = create_aside(path)?;
    let mut buffered = BufWriter::with_capacity(1 << 20, file.as_file_mut());
    write(&mut buffered).map_err(fail)?;
    buffered.flush().map_err(|e| fail(e.to_string()))?;
    drop(buffered);
    file.persist(path).map_err(|e| fail(e.error.to_string()))?;
    Ok(())
}

/// Checks that a picture can be written to `path`: a known extension, an existing folder, and the right to create files there.
///
/// # Errors
/// [`Error::Usage`] for an unknown extension, [`Error::Output`] otherwise.
pub fn check_writable(path: &Path) -> Result<()> {
    Format::from_path(path)?;
    check_creatable(path)
}

/// Checks that a file can be written to `path`: an existing folder and the right to create files there.
///
/// # Errors
/// [`Error::Output`] if not.
pub fn check_creatable(path: &Path) -> Result<()> {
    if path.is_dir() {
        return Err(Error::Output { file: path.to_owned(), message: "it is a folder".to_owned() });
    }
    create_aside(path).map(drop)
}

fn create_aside(path: &Path) -> Result<NamedTempFile> {
    let fail = |message: String| Error::Output { file: path.to_owned(), message };
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    if !folder.is_dir() {
        return Err(fail(format!("there is no folder {}", folder.display())));
    }
    let mut builder = tempfile::Builder::new();
    // Reduced by the process' mask, as for any file; the default would hide the file from everyone else.
    builder.prefix(".steradian-").permissions(Permissions::from_mode(0o666));
    builder.tempfile_in(folder).map_err(|e| fail(format!("no file can be created in {}: {}", folder.display(), io_message(&e))))
}

/// The system's message without the temporary file's name.
fn io_message(error: &std::io::Error) -> String {
    error.get_ref().and_then(std::error::Error::source).map_or_else(|| error.to_string(), ToString::to_string)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_appears_whole_or_not_at_all() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        write_atomically(&path, |out| out.write_all(b"old").map_err(|e| e.to_string())).unwrap();
        let failed = write_atomically(&path, |out| {
            out.write_all(b"half of the n").map_err(|e| e.to_string())?;
            Err("the disk is full".to_owned())
        });
        assert_eq!(failed.unwrap_err().to_string(), format!("cannot write {}: the disk is full", path.display()));
        assert_eq!(std::fs::read(&path).unwrap(), b"old");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
        assert_ne!(std::fs::metadata(&path).unwrap().permissions().mode() & 0o077, 0);
    }

    #[test]
    fn places_that_cannot_be_written_are_found_before_rendering() {
        let folder = tempfile::tempdir().unwrap();
        let is_output = |path: &Path| matches!(check_writable(path), Err(Error::Output { .. }));
        check_writable(&folder.path().join("a.png")).unwrap();
        assert!(is_output(&folder.path().join("missing/a.exr")));
        assert!(is_output(Path::new("/proc/a.exr")));
        std::fs::create_dir(folder.path().join("b.exr")).unwrap();
        assert!(is_output(&folder.path().join("b.exr")));
        let unknown = check_writable(&folder.path().join("a.jpg")).unwrap_err();
        assert!(matches!(&unknown, Error::Usage(message) if message.contains(".exr and .png")), "{unknown}");
        assert!(matches!(check_writable(&folder.path().join("a")), Err(Error::Usage(_))));
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
