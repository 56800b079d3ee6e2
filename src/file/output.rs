//! Files that are written.

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Seek, Write};
use std::os::fd::AsFd;
use std::os::unix::fs::{FileTypeExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use rustix::fs::{Access, MemfdFlags, OFlags};
use rustix::io::Errno;

use super::aside::{self, Aside};
use super::{folder_of, kind, words};
use crate::error::{Error, Result};

/// Symbolic links that are followed one after the other.
const MOST_LINKS: usize = 40;
/// How long a pipe without a reader is waited for.
const READER_WAIT: Duration = Duration::from_secs(10);
/// The time between two looks for a reader.
const READER_STEP: Duration = Duration::from_millis(20);

/// Where output goes.
#[derive(Debug, PartialEq, Eq)]
enum Place {
    /// A regular file, or none so far, at a path without links at its end.
    Regular(PathBuf),
    /// A pipe or a device.
    Stream(PathBuf),
    /// An open file of this process, by its number.
    Descriptor(PathBuf, u32),
}

/// Follows links, which stay what they are.
fn place(path: &Path) -> io::Result<Place> {
    let invalid = |message: &str| io::Error::new(io::ErrorKind::InvalidInput, message);
    let mut path = path.to_owned();
    for _ in 0..MOST_LINKS {
        let Ok(metadata) = fs::symlink_metadata(&path) else { return Ok(Place::Regular(path)) };
        match metadata.file_type() {
            t if t.is_symlink() => {
                if let Some(number) = descriptor(&path) {
                    return Ok(Place::Descriptor(path, number));
                }
                path = folder_of(&path).join(fs::read_link(&path)?);
            }
            t if t.is_file() => return Ok(Place::Regular(path)),
            t if t.is_fifo() || t.is_char_device() => return Ok(Place::Stream(path)),
            t => return Err(invalid(kind(t))),
        }
    }
    Err(invalid("there are too many symbolic links"))
}

/// The number of the open file that a path such as `/dev/fd/3` or `/proc/self/fd/3` is a link to.
fn descriptor(path: &Path) -> Option<u32> {
    let folder = folder_of(path).canonicalize().ok()?;
    let own = Path::new("/proc").join(std::process::id().to_string()).join("fd");
    (folder == own).then(|| path.file_name()?.to_str()?.parse().ok())?
}

/// The path of a regular file, or of one to be, without symbolic links at its end.
///
/// # Errors
/// [`Error::Output`] if there is something else in its place.
pub fn resolve(path: &Path) -> Result<PathBuf> {
    match place(path) {
        Ok(Place::Regular(path)) => Ok(path),
        Ok(_) => Err(failed(path, "it is no regular file, and has to be read again")),
        Err(e) => Err(failed(path, e)),
    }
}

/// Writes a file beside `path` and puts it there when it is complete; what was there stays until then. Symbolic links
/// stay, and so do pipes and devices, which get the bytes when all are there.
///
/// # Errors
/// [`Error::Output`] if that fails; nothing is left behind.
pub fn write_atomically(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<&mut File>) -> Result<(), String>,
) -> Result<()> {
    let aside = match place(path).map_err(|e| failed(path, e))? {
        Place::Regular(target) => create_aside(path, &target)?,
        stream => return write_stream(path, &stream, write),
    };
    commit(path, aside, false, write)
}

/// As [`write_atomically`], for a regular file at a [resolved](resolve) path, which is on the disk when this returns.
///
/// # Errors
/// As there.
pub fn write_synchronized(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<&mut File>) -> Result<(), String>,
) -> Result<()> {
    commit(path, create_aside(path, path)?, true, write)?;
    // The name comes to the disk too. Where folders cannot be synchronised, the system does it in its time.
    let folder = File::open(folder_of(path)).ok();
    let _ = folder.map(|folder| folder.sync_all());
    Ok(())
}

fn commit(
    path: &Path,
    mut aside: Aside,
    sync: bool,
    write: impl FnOnce(&mut BufWriter<&mut File>) -> Result<(), String>,
) -> Result<()> {
    fill(aside.file(), write).map_err(|message| failed(path, message))?;
    let synchronized = if sync { aside.file().sync_data() } else { Ok(()) };
    synchronized.and_then(|()| aside.commit()).map_err(|e| failed(path, e))
}

fn fill(file: &mut File, write: impl FnOnce(&mut BufWriter<&mut File>) -> Result<(), String>) -> Result<(), String> {
    let mut buffered = BufWriter::with_capacity(1 << 20, file);
    write(&mut buffered)?;
    buffered.flush().map_err(|e| e.to_string())
}

/// Writes to memory, where one can go back and forth, and from there to the stream.
fn write_stream(
    path: &Path,
    place: &Place,
    write: impl FnOnce(&mut BufWriter<&mut File>) -> Result<(), String>,
) -> Result<()> {
    let memory = rustix::fs::memfd_create("steradian", MemfdFlags::CLOEXEC).map_err(|e| failed(path, e))?;
    let mut memory = File::from(memory);
    fill(&mut memory, write).map_err(|message| failed(path, message))?;
    let copy = |memory: &mut File| -> io::Result<()> {
        memory.rewind()?;
        let mut stream = open_stream(place)?;
        io::copy(memory, &mut stream)?;
        stream.flush()
    };
    copy(&mut memory).map_err(|e| failed(path, e))
}

fn open_stream(place: &Place) -> io::Result<File> {
    match place {
        // The same open file, so that what others write to it comes before or after.
        Place::Descriptor(_, 1) => {
            io::stdout().flush()?;
            Ok(io::stdout().as_fd().try_clone_to_owned()?.into())
        }
        Place::Descriptor(_, 2) => Ok(io::stderr().as_fd().try_clone_to_owned()?.into()),
        Place::Descriptor(path, _) | Place::Stream(path) | Place::Regular(path) => open_appending(path),
    }
}

/// Opens a file to append to, or a pipe, for whose reader it waits no longer than some seconds.
fn open_appending(path: &Path) -> io::Result<File> {
    let mut options = OpenOptions::new();
    options.append(true).create(true).custom_flags((OFlags::NONBLOCK | OFlags::NOCTTY).bits() as i32);
    let start = Instant::now();
    loop {
        match options.open(path) {
            Err(e) if e.raw_os_error() == Some(Errno::NXIO.raw_os_error()) => {
                if start.elapsed() >= READER_WAIT {
                    return Err(io::Error::new(io::ErrorKind::TimedOut, "nobody reads from it"));
                }
                std::thread::sleep(READER_STEP);
            }
            opened => {
                let file = opened?;
                let flags = rustix::fs::fcntl_getfl(&file)?;
                rustix::fs::fcntl_setfl(&file, flags - OFlags::NONBLOCK)?;
                return Ok(file);
            }
        }
    }
}

/// Opens a file to append lines to, which need not exist; a pipe or a device is written to as it is.
///
/// # Errors
/// [`Error::Output`] if that fails.
pub fn append(path: &Path) -> Result<File> {
    place(path).and_then(|place| open_stream(&place)).map_err(|e| failed(path, e))
}

/// Checks that a file can be written to `path`: an existing folder and the right to create files there, or a pipe or
/// device that may be written to. Removes what killed processes left on their way to it.
///
/// # Errors
/// [`Error::Output`] if not.
pub fn check_creatable(path: &Path) -> Result<()> {
    match place(path).map_err(|e| failed(path, e))? {
        Place::Regular(target) => {
            aside::clean(&target);
            create_aside(path, &target).map(drop)
        }
        Place::Stream(stream) => rustix::fs::access(&stream, Access::WRITE_OK).map_err(|e| failed(path, e)),
        Place::Descriptor(..) => Ok(()),
    }
}

fn create_aside(path: &Path, target: &Path) -> Result<Aside> {
    let folder = folder_of(target);
    if target.file_name().is_none() {
        return Err(failed(path, "it has no name"));
    }
    if !folder.is_dir() {
        return Err(failed(path, format!("no folder {}", folder.display())));
    }
    Aside::create(target).map_err(|e| failed(path, format!("no file can be created in {}: {e}", folder.display())))
}

fn failed(path: &Path, message: impl ToString) -> Error {
    Error::Output { file: path.to_owned(), message: words(&message.to_string()).to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;
    use std::os::fd::AsRawFd;
    use std::os::unix::fs::{PermissionsExt, symlink};

    fn write(path: &Path, text: &str) -> Result<()> {
        write_atomically(path, |out| out.write_all(text.as_bytes()).map_err(|e| e.to_string()))
    }

    #[test]
    fn a_file_appears_whole_or_not_at_all() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        write(&path, "old").unwrap();
        let failed = write_atomically(&path, |out| {
            out.write_all(b"half of the n").map_err(|e| e.to_string())?;
            Err("the disk is full".to_owned())
        });
        assert_eq!(failed.unwrap_err().to_string(), format!("cannot write {}: the disk is full", path.display()));
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        assert_ne!(fs::metadata(&path).unwrap().permissions().mode() & 0o077, 0);
    }

    #[test]
    fn links_stay_and_lead_to_what_is_written() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::create_dir(at("there")).unwrap();
        symlink("there/first", at("one")).unwrap();
        symlink("one", at("two")).unwrap();
        for text in ["new", "newer"] {
            write(&at("two"), text).unwrap();
            assert_eq!(fs::read_to_string(at("there/first")).unwrap(), text);
        }
        assert_eq!(fs::read_link(at("two")).unwrap(), Path::new("one"));
        assert_eq!(resolve(&at("two")).unwrap(), at("there/first"));
        symlink("round", at("round")).unwrap();
        assert!(matches!(write(&at("round"), ""), Err(Error::Output { .. })));
        assert!(matches!(resolve(folder.path()), Err(Error::Output { .. })));
    }

    #[test]
    fn pipes_and_devices_are_written_to_and_not_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        rustix::fs::mkfifoat(rustix::fs::CWD, &pipe, rustix::fs::Mode::RUSR | rustix::fs::Mode::WUSR).unwrap();
        let reader = std::thread::spawn({
            let pipe = pipe.clone();
            move || fs::read(pipe).unwrap()
        });
        let text = "x".repeat(300_000);
        check_creatable(&pipe).unwrap();
        write(&pipe, &text).unwrap();
        assert_eq!(reader.join().unwrap(), text.as_bytes());
        assert!(fs::symlink_metadata(&pipe).unwrap().file_type().is_fifo());
        assert!(resolve(&pipe).unwrap_err().to_string().contains("no regular file"));
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);

        let null = Path::new("/dev/null");
        let before = fs::metadata(null).unwrap().file_type();
        check_creatable(null).unwrap();
        write(null, "text").unwrap();
        append(null).unwrap().write_all(b"text").unwrap();
        assert!(before.is_char_device() && fs::symlink_metadata(null).unwrap().file_type().is_char_device());
        assert!(write(Path::new("/dev/full"), "text").unwrap_err().to_string().contains("No space left"));
    }

    #[test]
    fn open_files_are_appended_to_in_place() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log");
        fs::write(&path, "before ").unwrap();
        let mut open = File::options().read(true).append(true).open(&path).unwrap();
        for folder in ["/dev/fd", "/proc/self/fd"] {
            let numbered = format!("{folder}/{}", open.as_raw_fd());
            check_creatable(Path::new(&numbered)).unwrap();
            write(Path::new(&numbered), "after ").unwrap();
        }
        let mut text = String::new();
        open.read_to_string(&mut text).unwrap();
        assert_eq!(text, "before after after ");
    }

    #[test]
    fn places_that_cannot_be_written_are_found() {
        let folder = tempfile::tempdir().unwrap();
        let is_output = |path: &Path| matches!(check_creatable(path), Err(Error::Output { .. }));
        check_creatable(&folder.path().join("a.png")).unwrap();
        assert!(is_output(&folder.path().join("missing/a.exr")));
        assert!(is_output(Path::new("/proc/a.exr")) && is_output(Path::new("/")) && is_output(Path::new("")));
        fs::create_dir(folder.path().join("b.exr")).unwrap();
        assert!(is_output(&folder.path().join("b.exr")));
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
