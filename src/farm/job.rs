//! A job for a farm: a scene, split into shards, in one frame or many.

use std::path::{Path, PathBuf};

use super::frames::{FrameList, file_of_frame};

/// What is to be rendered on a farm. All paths are absolute, and mean the same on every machine.
#[derive(Clone, Debug)]
pub struct Job {
    /// A name for queues: the scene's.
    pub name: String,
    /// The program `steradian`: its path on the machines of the farm.
    pub program: PathBuf,
    /// The scene's file, or with a place for the frame's number one for each frame.
    pub scene: PathBuf,
    /// The pictures; of a sequence, with a place for the frame's number. At least one.
    pub outputs: Vec<PathBuf>,
    /// Where shards, checkpoints, logs and scripts are; every machine can write to it.
    pub folder: PathBuf,
    /// Into how many shards a picture is split, at least 1.
    pub shards: u32,
    /// The frames of a sequence.
    pub frames: Option<FrameList>,
    /// Whether frames whose files exist are rendered again.
    pub overwrite: bool,
    /// Seconds between checkpoints.
    pub every: u32,
    /// Further options of `steradian render`.
    pub options: Vec<String>,
}

impl Job {
    /// The pictures of a frame.
    pub fn outputs_of_frame(&self, frame: Option<i64>) -> Vec<PathBuf> {
        let name = |output: &PathBuf| match frame {
            Some(frame) => PathBuf::from(file_of_frame(&output.to_string_lossy(), frame)),
            None => output.clone(),
        };
        self.outputs.iter().map(name).collect()
    }
}

/// A word as POSIX shells read it back, whatever it contains.
pub fn quote(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "_-./=:,@%+".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

/// A path as POSIX shells read it back.
pub(super) fn quote_path(path: &Path) -> String {
    quote(&path.to_string_lossy())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_survive_the_shell() {
        assert_eq!(
            [quote("a/b.c"), quote(""), quote("a b"), quote("it's $x")],
            ["a/b.c", "''", "'a b'", r"'it'\''s $x'"]
        );
    }
}
