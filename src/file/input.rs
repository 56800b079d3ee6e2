//! Files that are read.

use std::fs::{File, Metadata};
use std::io::{self, BufRead, Read, Take};
use std::os::unix::fs::{FileTypeExt, OpenOptionsExt};
use std::path::Path;

use rustix::fs::OFlags;

use super::{in_words, kind};

/// The most that is read of a stream, in bytes.
const MAX_STREAM: u64 = 1 << 32;

/// Opens a regular file for reading. Of one that grows, no more is read than it held.
///
/// # Errors
/// The system's, or [`io::ErrorKind::InvalidInput`] for folders, devices, pipes and sockets: reading those may wait, or
/// go on, for ever.
pub fn open(path: &Path) -> io::Result<Take<File>> {
    open_regular(path).map_err(in_words)
}

fn open_regular(path: &Path) -> io::Result<Take<File>> {
    // Checked before opening, which can make a device act; and after it, in case the file was exchanged in between.
    check_regular(&std::fs::metadata(path)?)?;
    let file = File::options().read(true).custom_flags((OFlags::NONBLOCK | OFlags::NOCTTY).bits() as i32).open(path)?;
    let metadata = file.metadata()?;
    check_regular(&metadata)?;
    Ok(file.take(metadata.len()))
}

fn check_regular(metadata: &Metadata) -> io::Result<()> {
    if metadata.is_file() {
        Ok(())
    } else {
        Err(io::Error::new(io::ErrorKind::InvalidInput, kind(metadata.file_type())))
    }
}

/// All bytes of a regular file.
///
/// # Errors
/// As [`open`].
pub fn read(path: &Path) -> io::Result<Vec<u8>> {
    read_all(&mut open(path)?)
}

fn read_all(file: &mut Take<File>) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    bytes.try_reserve_exact(usize::try_from(file.limit()).unwrap_or(usize::MAX))?;
    file.read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// The text of a regular file, without a byte order mark.
///
/// # Errors
/// As [`open`], or [`io::ErrorKind::InvalidData`] if it is not UTF-8.
pub fn read_to_string(path: &Path) -> io::Result<String> {
    String::from_utf8(without_mark(read(path)?))
        .map_err(|_| io::Error::new(io::ErrorKind::InvalidData, "the file is not UTF-8"))
}

/// The byte order mark, which some editors put before UTF-8.
pub const MARK: &[u8] = "\u{feff}".as_bytes();

/// The bytes of a text without a byte order mark.
pub fn without_mark(mut bytes: Vec<u8>) -> Vec<u8> {
    if bytes.starts_with(MARK) {
        bytes.drain(..MARK.len());
    }
    bytes
}

/// A reader at its beginning, past a byte order mark.
///
/// # Errors
/// The reader's.
pub fn skip_mark<R: BufRead>(mut source: R) -> io::Result<R> {
    if source.fill_buf()?.starts_with(MARK) {
        source.consume(MARK.len());
    }
    Ok(source)
}

/// All bytes of a regular file or, up to 4 GiB, of a pipe. For files that the user names, not for those named by files:
/// a pipe without a writer waits for one.
///
/// # Errors
/// As [`open`], but for pipes.
pub fn read_stream(path: &Path) -> io::Result<Vec<u8>> {
    if !std::fs::metadata(path).map_err(in_words)?.file_type().is_fifo() {
        return read(path);
    }
    let mut bytes = Vec::new();
    File::open(path)?.take(MAX_STREAM + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > MAX_STREAM {
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, "there is more than 4 GiB in the pipe"));
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::net::UnixListener;

    #[test]
    fn only_regular_files_are_read() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("a"), "text").unwrap();
        std::os::unix::fs::symlink("a", at("link")).unwrap();
        std::fs::write(at("marked"), "\u{feff}text\u{feff}").unwrap();
        assert_eq!(read_to_string(&at("marked")).unwrap(), "text\u{feff}");
        for text in ["", "t", "text", "text\u{feff}"] {
            for marked in [text.to_owned(), format!("\u{feff}{text}")] {
                let mut read = String::new();
                skip_mark(marked.as_bytes()).unwrap().read_to_string(&mut read).unwrap();
                assert_eq!(read, text);
            }
        }
        assert_eq!(
            (read(&at("a")).unwrap(), read_to_string(&at("link")).unwrap()),
            (b"text".to_vec(), "text".to_owned())
        );
        rustix::fs::mkfifoat(rustix::fs::CWD, at("pipe"), rustix::fs::Mode::RUSR | rustix::fs::Mode::WUSR).unwrap();
        let _socket = UnixListener::bind(at("socket")).unwrap();
        for (path, what) in [
            (at("pipe"), "it is a pipe"),
            (at("socket"), "it is a socket"),
            (folder.path().to_owned(), "it is a folder"),
            ("/dev/zero".into(), "it is a device"),
            ("/dev/null".into(), "it is a device"),
        ] {
            let error = read(&path).unwrap_err();
            assert!(error.to_string().starts_with(what), "{}: {error}", path.display());
            assert_eq!(open(&path).map(|_| ()).unwrap_err().kind(), io::ErrorKind::InvalidInput);
        }
        for error in [read(&at("none")).unwrap_err(), read_stream(&at("none")).unwrap_err()] {
            assert_eq!(
                (error.kind(), error.to_string().as_str()),
                (io::ErrorKind::NotFound, "No such file or directory")
            );
        }
        assert_eq!(read_stream(Path::new("/dev/zero")).unwrap_err().kind(), io::ErrorKind::InvalidInput);
        // Files of the kernel that wait, or never end, have no length.
        assert_eq!(read(Path::new("/proc/self/status")).unwrap(), b"");
    }

    #[test]
    fn streams_are_read_to_their_end() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        rustix::fs::mkfifoat(rustix::fs::CWD, &pipe, rustix::fs::Mode::RUSR | rustix::fs::Mode::WUSR).unwrap();
        let writer = std::thread::spawn({
            let pipe = pipe.clone();
            move || std::fs::write(pipe, "{}")
        });
        assert_eq!(read_stream(&pipe).unwrap(), b"{}");
        writer.join().unwrap().unwrap();
    }
}
