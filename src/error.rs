//! The one error type of the library. Every variant names the place of the fault; nothing here prints or exits.

use std::path::PathBuf;

/// What kind of fault ended the work; the binary maps each to an exit code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ErrorKind {
    /// The command line is impossible.
    Usage,
    /// The scene (or a file it names) is malformed or makes no sense.
    Scene,
    /// A file that the scene names does not exist or cannot be read.
    AssetMissing,
    /// An output cannot be written.
    Output,
    /// A checkpoint or shard is damaged, or does not belong to the render requested.
    Checkpoint,
    /// Memory ran out, or no more threads can be started.
    OutOfMemory,
    /// Anything else: a device fault, a failed comparison.
    Internal,
}

/// An error with its place.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The command line is impossible.
    #[error("{0}")]
    Usage(String),
    /// A setting of a render is impossible, or unsupported beside another.
    #[error("{message}")]
    Setting {
        /// The setting, such as `max_depth`: a field of [`Overrides`](crate::render::Overrides).
        setting: &'static str,
        /// What is wrong: `` `max_depth` 0: depth counts from 1 ``. Names of settings are in backquotes.
        message: String,
    },
    /// A fault in a scene's text: `scene.json:3:14: shapes[2].radius: ...`.
    #[error("{}:{line}:{column}: {message}", file.display())]
    Parse {
        /// The scene file.
        file: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// What is wrong, with the path inside the scene.
        message: String,
    },
    /// A fault in a scene: `scene.json: shapes[3].material: no material named "gold"`.
    #[error("{}: {path}: {message}", file.display())]
    Scene {
        /// The scene file.
        file: PathBuf,
        /// Where in the scene, such as `shapes[3].material`.
        path: String,
        /// What is wrong.
        message: String,
    },
    /// A fault inside a file that the scene loads.
    #[error("{}: {path}: {}: {message}", scene.display(), asset.display())]
    Asset {
        /// The scene file.
        scene: PathBuf,
        /// Where the scene names the asset.
        path: String,
        /// The asset.
        asset: PathBuf,
        /// What is wrong, with the line or element where known.
        message: String,
    },
    /// A file does not exist or cannot be read.
    #[error("{}: {message}", file.display())]
    Missing {
        /// The file.
        file: PathBuf,
        /// Why it cannot be read, and where the scene names it.
        message: String,
    },
    /// A file that is read (an image to compare, for example) is malformed.
    #[error("{}: {message}", file.display())]
    Malformed {
        /// The file.
        file: PathBuf,
        /// What is wrong.
        message: String,
    },
    /// An output cannot be written.
    #[error("cannot write {}: {message}", file.display())]
    Output {
        /// The output.
        file: PathBuf,
        /// Why.
        message: String,
    },
    /// A checkpoint or shard is damaged, or does not belong to the render requested.
    #[error("{}: {message}", file.display())]
    Checkpoint {
        /// The checkpoint or shard.
        file: PathBuf,
        /// What is wrong, or what differs.
        message: String,
    },
    /// Embree reported an error.
    #[error("Embree: {0}")]
    Embree(String),
    /// Memory ran out.
    #[error("out of memory: {0}")]
    OutOfMemory(String),
    /// Threads cannot be started, for lack of memory or by a limit of the system.
    #[error("{count} threads cannot be started: {message} (ulimit -u limits processes and threads, ulimit -v memory)")]
    Threads {
        /// How many were to be started.
        count: usize,
        /// The system's reason.
        message: String,
    },
    /// Several faults of one file, two or more, in the order of their places.
    #[error("{}", lines(.0))]
    Several(Vec<Error>),
    /// Anything else.
    #[error("{0}")]
    Internal(String),
}

/// One line for each error.
fn lines(errors: &[Error]) -> String {
    errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
}

impl Error {
    /// All of these as one error; `None` if there are none.
    pub fn from_all(mut errors: Vec<Error>) -> Option<Self> {
        if errors.len() > 1 { Some(Self::Several(errors)) } else { errors.pop() }
    }

    /// The errors that it consists of: itself, unless there are several.
    pub fn parts(&self) -> &[Error] {
        match self {
            Self::Several(errors) => errors,
            single => std::slice::from_ref(single),
        }
    }

    /// The kind of fault.
    pub fn kind(&self) -> ErrorKind {
        match self {
            Self::Usage(_) | Self::Setting { .. } => ErrorKind::Usage,
            Self::Parse { .. } | Self::Scene { .. } | Self::Asset { .. } | Self::Malformed { .. } => ErrorKind::Scene,
            Self::Missing { .. } => ErrorKind::AssetMissing,
            Self::Output { .. } => ErrorKind::Output,
            Self::Checkpoint { .. } => ErrorKind::Checkpoint,
            Self::OutOfMemory(_) | Self::Threads { .. } => ErrorKind::OutOfMemory,
            Self::Several(errors) => errors.first().map_or(ErrorKind::Internal, Self::kind),
            Self::Embree(_) | Self::Internal(_) => ErrorKind::Internal,
        }
    }
}

/// A result with the library's [`Error`].
pub type Result<T, E = Error> = std::result::Result<T, E>;
