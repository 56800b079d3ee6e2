//! Where a scene comes from.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::Assets;

/// The file of a scene, the assets that are no files, and the places of its parts for messages.
#[derive(Clone, Debug)]
pub struct SceneSource {
    /// The file, beside which those lie that the scene names.
    pub file: PathBuf,
    /// What is named like a file and has none.
    pub assets: Arc<Assets>,
    /// The places in the file of another renderer that became `shapes[0]` and so on.
    pub places: Arc<BTreeMap<String, String>>,
}

impl SceneSource {
    /// A scene whose assets are all files.
    pub fn new(file: impl Into<PathBuf>) -> Self {
        Self { file: file.into(), assets: Arc::default(), places: Arc::default() }
    }

    /// Where an asset lies.
    pub fn asset(&self, name: &str) -> PathBuf {
        self.file.parent().unwrap_or(Path::new("")).join(name)
    }

    /// A part of the scene, with its place in the file that it was read from.
    pub fn place(&self, path: &str) -> String {
        let parts = self.places.iter().filter(|(part, _)| path.strip_prefix(part.as_str()).is_some_and(ends_a_name));
        match parts.max_by_key(|(part, _)| part.len()) {
            Some((_, place)) => format!("{path} (from {place})"),
            None => path.into(),
        }
    }
}

/// Whether what follows a name in a path does not belong to the name.
fn ends_a_name(rest: &str) -> bool {
    rest.is_empty() || rest.starts_with(['.', '['])
}
