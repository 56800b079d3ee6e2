//! Scene files of all formats to [`SceneDesc`], with the assets that are no files.

mod comments;
mod fault;
mod faults;
mod fingerprint;
mod foreign;
mod scene_file;
mod wording;

pub use faults::RepairedScene;
pub use fingerprint::{SceneFingerprint, files_of_scene, scene_fingerprint};
pub use foreign::{Draft, ImportOptions, ImportReport, Imported, Outcome, ReportEntry, read_scene};
pub use scene_file::{load_scene, parse_scene, repaired_scene, scene_as_written};
pub use wording::describe_value;

use crate::desc::SceneDesc;

/// The JSON Schema of scene files, as text.
pub fn schema() -> String {
    let schema = schemars::schema_for!(SceneDesc);
    serde_json::to_string_pretty(&schema).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metal::{Metal, MetalNames};

    #[test]
    fn the_schema_has_the_names_of_all_metals() {
        let schema = schema();
        let (_, list) = schema.split_once("A metal by name: ").unwrap();
        let (list, _) = list.split_once(".\"").unwrap();
        let list = list.replace("\\n", " ");
        let mut listed: Vec<_> = list.split(", ").map(|name| name.trim_matches('`')).collect();
        listed.sort_unstable();
        assert_eq!(listed, Metal::names(MetalNames::Steradian).collect::<Vec<_>>());
    }

    #[test]
    fn words_of_other_programs_lead_to_words_of_the_schema() {
        let schema = schema();
        for word in crate::suggestion::targets() {
            assert!(schema.contains(&format!("\"{word}\"")) || schema.contains(&format!("`{word}`")), "{word}");
        }
    }
}
