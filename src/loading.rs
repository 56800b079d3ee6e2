//! Reading scene files of every kind, with all that is wrong with them in one error.

use std::path::Path;

use tracing::subscriber::{NoSubscriber, with_default};

use crate::assets::SceneSource;
use crate::compile;
use crate::error::{Error, Result};
use crate::import::{self, ImportOptions, Imported, repaired_scene};

/// Reads a scene file of any kind.
///
/// # Errors
/// As [`import::read_scene`]. Faults of keys and types in a scene of the native format are followed by those of its
/// settings, names and files, as far as they do not depend on the former.
pub fn read_scene(path: &Path, options: &ImportOptions) -> Result<Imported> {
    import::read_scene(path, options).map_err(|error| with_later_faults(error, path))
}

/// An error of a scene's text, and the faults that the scene would have without it.
fn with_later_faults(error: Error, path: &Path) -> Error {
    if !error.parts().iter().all(|part| matches!(part, Error::Parse { .. })) {
        return error;
    }
    let Some(scene) = repaired_scene(path) else { return error };
    // Warnings would be about a scene that is not the user's.
    let later = with_default(NoSubscriber::new(), || compile::find_faults(&scene.desc, SceneSource::new(path)));
    let Some(later) = later else { return error };
    let parts = |error| match error {
        Error::Several(errors) => errors,
        single => vec![single],
    };
    let is_own = |error: &Error| match error {
        Error::Scene { path, .. } | Error::Asset { path, .. } => !scene.is_changed(path),
        Error::Missing { .. } => true,
        _ => false,
    };
    let mut all = parts(error);
    all.extend(parts(later).into_iter().filter(is_own));
    Error::from_all(all).unwrap_or_else(|| Error::Internal("a fault without a message".into()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn messages(scene: &str) -> Vec<String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("s.json");
        std::fs::write(&path, scene).unwrap();
        let error = read_scene(&path, &ImportOptions::default()).unwrap_err();
        let start = format!("{}/", folder.path().display());
        error.parts().iter().map(|part| part.to_string().replace(&start, "")).collect()
    }

    #[track_caller]
    fn assert_messages(scene: &str, expected: &[&str]) {
        let messages = messages(scene);
        let is_alike = messages.len() == expected.len()
            && messages.iter().zip(expected).all(|(message, start)| message.starts_with(start));
        assert!(is_alike, "{messages:#?}");
    }

    #[test]
    fn faults_of_text_settings_names_and_files_are_reported_together() {
        assert_messages(
            r#"{
                "camera": { "center": [0, 0, 5], "look_at": [0, 0, 0], "vertical_fov_degrees": 400 },
                "sampler": { "spp": 0 },
                "textures": { "wood": { "type": "image", "file": "wood.png" } },
                "materials": { "a": { "type": "glass" }, "b": { "type": "diffuse", "albedo": [2, 0, 0] },
                    "d": { "type": "diffuse", "albedo": { "texture": "wood" } } },
                "shapes": [
                    { "type": "sphere", "radius": "big", "material": "c" },
                    { "type": "mesh", "file": "chair.obj", "material": "d" },
                    { "type": "cube", "material": "b" }
                ]
            }"#,
            &[
                "s.json:2:29: camera: unknown key \"center\" (did you mean",
                "s.json:5:47: materials.a.type: unknown type \"glass\" (did you mean \"dielectric\"?)",
                "s.json:8:51: shapes[0].radius: expected a number",
                "s.json: sampler.spp: must be at least 1",
                "s.json: camera.vertical_fov_degrees: ",
                "wood.png: ",
                "s.json: materials.b.albedo: ",
                "s.json: shapes[0].material: no material named \"c\"",
                "chair.obj: ",
            ],
        );
    }

    #[test]
    fn what_a_repair_breaks_is_no_fault() {
        let scene =
            |rest: &str| format!("{{\n\"camera\": {{ \"position\": [0, 0, 5], \"look_at\": [0, 0, 0] }},\n{rest} }}");
        // A key that is left out may define names.
        let text = scene(r#""stuff": { "a": 1 }, "shapes": [{ "type": "cube", "material": "a" }]"#);
        assert_messages(&text, &["s.json:3:1: unknown key \"stuff\""]);
        let shapes = r#""shapes": [{ "type": "cube", "material": "a" }, { "type": "cube", "material": "b" }]"#;
        let text = scene(&format!(r#""material": {{ "a": {{ "type": "mirror" }} }}, {shapes}"#));
        assert_messages(&text, &["s.json:3:1: unknown key \"material\"", "s.json: shapes[1].material: no material"]);
        // A conductor without its metal has nothing.
        let text = scene(r#""materials": { "a": { "type": "conductor", "metl": 3 } }"#);
        assert_messages(&text, &["s.json:3:44: materials.a"]);
    }
}
