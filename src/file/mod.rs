//! Files, the one way in and the one way out: inputs are regular files (or, where the user names one stream, a pipe),
//! outputs appear whole or not at all. What is no regular file, such as `/dev/null` or a pipe, is written to and never
//! replaced.

mod aside;
pub mod exr_blocks;
pub mod exr_headers;
mod input;
mod lock;
mod output;

pub use input::{MARK, open, read, read_stream, read_to_string, skip_mark, without_mark};
pub use lock::{Lock, LockError};
pub use output::{append, check_creatable, resolve, write_atomically, write_synchronized};

use std::fs::FileType;
use std::io;
use std::os::unix::fs::FileTypeExt;
use std::path::Path;

/// What a file is that is no regular file.
fn kind(file_type: FileType) -> &'static str {
    match file_type {
        t if t.is_dir() => "it is a folder",
        t if t.is_fifo() => "it is a pipe, not a regular file",
        t if t.is_socket() => "it is a socket, not a regular file",
        t if t.is_symlink() => "it is a symbolic link, not a regular file",
        _ => "it is a device, not a regular file",
    }
}

/// A message of the system without its number, ` (os error 2)`.
fn words(message: &str) -> &str {
    message.split_once(" (os error ").map_or(message, |(words, _)| words)
}

/// An error in words alone.
fn in_words(error: io::Error) -> io::Error {
    let message = error.to_string();
    let words = words(&message);
    if words == message { error } else { io::Error::new(error.kind(), words) }
}

/// The folder of a file.
fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}
