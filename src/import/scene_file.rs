//! Scene files: JSON with comments to [`SceneDesc`], with the place of every error.

use std::path::Path;

use serde_json::Value;
use serde_json::error::Category;

use super::comments::blank_comments;
use super::fault::{self, Step};
use super::faults::{RepairedScene, all_faults, names_key};
use super::wording;
use crate::desc::SceneDesc;
use crate::error::{Error, Result};

/// Reads a scene file.
///
/// # Errors
/// [`Error::Missing`] if it cannot be read, [`Error::Parse`] with line, column and path for faults in it.
pub fn load_scene(path: &Path) -> Result<SceneDesc> {
    let bytes =
        crate::file::read_stream(path).map_err(|e| Error::Missing { file: path.into(), message: e.to_string() })?;
    match std::str::from_utf8(&bytes) {
        Ok(text) => parse_scene(text, path),
        Err(e) => {
            let valid = String::from_utf8_lossy(&bytes[..e.valid_up_to()]);
            Err(fault_at(path, &valid, valid.len(), "the file is not UTF-8 text".into()))
        }
    }
}

/// Parses the text of a scene; `path` is only for messages.
///
/// # Errors
/// As [`load_scene`].
pub fn parse_scene(text: &str, path: &Path) -> Result<SceneDesc> {
    let blanked = blank_comments(text);
    let json = blanked.text.as_str();
    if let Some(start) = blanked.open_comment {
        return Err(fault_at(path, text, start, "the comment is never closed".into()));
    }
    if json.trim().is_empty() {
        return Err(fault_at(
            path,
            text,
            0,
            "the file is empty: a scene is a JSON object with at least a `camera`".into(),
        ));
    }
    let mut deserializer = serde_json::Deserializer::from_str(json);
    let parsed = serde_path_to_error::deserialize::<_, SceneDesc>(&mut deserializer);
    match parsed {
        Ok(scene) => match deserializer.end() {
            Ok(()) => Ok(scene),
            Err(e) => Err(fault_at(path, text, offset(text, &e), wording::describe_syntax(&e.to_string()))),
        },
        Err(e) => Err(parse_fault(path, text, json, &e)),
    }
}

/// A scene in the native format as its file has it, without any default; `None` if it cannot be read or is no JSON.
pub fn scene_as_written(path: &Path) -> Option<Value> {
    let text = crate::file::read_to_string(path).ok()?;
    serde_json::from_str(&blank_comments(&text).text).ok()
}

/// A scene file in the native format without its faults of keys and types, to look for others; `None` if that cannot be
/// told, or if there are none.
pub fn repaired_scene(path: &Path) -> Option<RepairedScene> {
    let scene = scene_as_written(path)?;
    let length = serde_json::to_string(&scene).ok()?.len();
    let (faults, repaired) = all_faults(&scene, length);
    repaired.filter(|_| !faults.is_empty())
}

/// The error for what serde complains about: all faults, as far as they can be told apart.
fn parse_fault(path: &Path, text: &str, json: &str, error: &serde_path_to_error::Error<serde_json::Error>) -> Error {
    let inner = error.inner();
    let scene = serde_json::from_str::<Value>(json).ok();
    let plain = |place: &[Step]| {
        let message = with_place(&fault::path_text(place), &wording::describe_syntax(&inner.to_string()));
        fault_at(path, text, offset(text, inner), message)
    };
    // The text may break off further on, or name a key twice: then serde's own words must do.
    let (Some(scene), Category::Data) = (scene, inner.classify()) else {
        return plain(&fault::steps_before(error.path()));
    };
    if !scene.is_object() {
        let start = json.len() - json.trim_start().len();
        return fault_at(path, text, start, wording::no_object(&scene));
    }
    let mut steps = fault::steps_of(error.path(), &scene);
    let mut errors: Vec<(usize, Error)> = Vec::new();
    if fault::refine(&scene, &mut steps).is_none() {
        errors.push((offset(text, inner), plain(&steps)));
    }
    for fault in all_faults(&scene, text.len()).0 {
        // Where the message itself names the last key, the place is the key's.
        let names_key = names_key(&fault.steps, &fault.message).is_some();
        let start = fault::locate(json, &fault.steps, names_key).unwrap_or_else(|| offset(text, inner));
        let place = &fault.steps[..fault.steps.len() - usize::from(names_key)];
        let message = with_place(&fault::path_text(place), &wording::describe(&fault, &scene));
        errors.push((start, fault_at(path, text, start, message)));
    }
    errors.sort_by_key(|(start, _)| *start);
    Error::from_all(errors.into_iter().map(|(_, error)| error).collect()).unwrap_or_else(|| plain(&[]))
}

fn with_place(place: &str, message: &str) -> String {
    if place.is_empty() { message.to_owned() } else { format!("{place}: {message}") }
}

/// The error at a byte of the text; columns count characters.
fn fault_at(path: &Path, text: &str, offset: usize, message: String) -> Error {
    let before = text.get(..offset).unwrap_or(text);
    let line_start = before.rfind('\n').map_or(0, |i| i + 1);
    let line = 1 + before.bytes().filter(|&b| b == b'\n').count();
    Error::Parse { file: path.into(), line, column: 1 + before[line_start..].chars().count(), message }
}

/// The byte that serde's line and column (which counts bytes) mean.
fn offset(text: &str, error: &serde_json::Error) -> usize {
    let line_start = text.split_inclusive('\n').take(error.line().saturating_sub(1)).map(str::len).sum::<usize>();
    text.floor_char_boundary(line_start + error.column().saturating_sub(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(text: &str) -> String {
        parse_scene(text, Path::new("s.json")).unwrap_err().to_string()
    }

    #[track_caller]
    fn assert_message(text: &str, start: &str, parts: &[&str]) {
        let message = message(text);
        assert!(message.starts_with(start), "{message}");
        for part in parts {
            assert!(message.contains(part), "{part} is not in: {message}");
        }
    }

    #[test]
    fn a_typo_has_its_place_and_a_suggestion() {
        let text = "{\n \"camera\": {},\n \"shapes\": [{ \"type\": \"sphere\", \"radus\": 2 }]\n}";
        assert_message(text, "s.json:3:33: shapes[0]: ", &["unknown key \"radus\" (did you mean \"radius\"?)"]);
        assert_message(
            "{ \"camera\": {}, \"shaeps\": [] }",
            "s.json:1:17: unknown key \"shaeps\"",
            &["did you mean \"shapes\""],
        );
    }

    #[test]
    fn faults_inside_typed_values_have_their_own_path() {
        let shape = |body: &str| {
            format!("{{ \"camera\": {{}}, // é\n \"shapes\": [{{ \"type\": \"cube\" }},\n {{ {body} }}] }}")
        };
        let text = shape("\"type\": \"sphere\", \"z_max\": \"high\"");
        assert_message(&text, "s.json:3:31: shapes[1].z_max: expected a number, found the text \"high\"", &[]);
        let text = shape("\"emission\": { \"radiance\": [1, true, 1] }, \"type\": \"disk\"");
        assert_message(&text, "s.json:3:34: shapes[1].emission.radiance[1]: expected a number, found true", &[]);
        let text = shape("\"type\": \"disk\", \"emission\": {}");
        assert_message(&text, "s.json:3:32: shapes[1].emission: `radiance` is missing", &[]);
        let text = shape("\"type\": \"cube\", \"transform\": [{ \"scale\": 2 }, { \"trnslate\": [1, 2, 3] }]");
        assert_message(
            &text,
            "s.json:3:",
            &["shapes[1].transform[1]", "unknown key \"trnslate\" (did you mean \"translate\"?)"],
        );
        let text =
            "{ \"camera\": {}, \"objects\": { \"o\": { \"shapes\": [{ \"type\": \"quad\", \"origin\": [1, 2] }] } } }";
        assert_message(text, "s.json:1:", &["objects.o.shapes[0].origin: expected a list of three numbers, found two"]);
    }

    #[test]
    fn unknown_types_are_named() {
        let text = "{ \"camera\": {}, \"shapes\": [{ \"type\": \"shpere\" }] }";
        assert_message(text, "s.json:1:38: shapes[0].type: unknown type \"shpere\"", &["did you mean \"sphere\""]);
        assert_message(
            "{ \"camera\": {}, \"shapes\": [{ \"radius\": 1 }] }",
            "s.json:1:28: shapes[0]: `type` is missing",
            &[],
        );
    }

    #[test]
    fn integrators_without_parameters_take_none() {
        assert_message(
            "{ \"camera\": {}, \"integrator\": { \"type\": \"normal\", \"max_depth\": 3 } }",
            "s.json:1:",
            &["max_depth"],
        );
        assert!(
            parse_scene("{ \"camera\": {}, \"integrator\": { \"type\": \"shading_normal\" } }", Path::new("s.json"))
                .is_ok()
        );
    }

    #[test]
    fn names_and_keys_are_given_once() {
        let text =
            "{ \"camera\": {}, \"materials\": { \"a\": { \"type\": \"mirror\" }, \"a\": { \"type\": \"diffuse\" } } }";
        assert_message(text, "s.json:1:", &["\"a\" is given twice"]);
        assert_message("{ \"camera\": {}, \"camera\": {} }", "s.json:1:", &["`camera` is given twice"]);
        assert_message(
            "{ \"camera\": { \"position\": [0, 0, 0], \"position\": [1, 1, 1] } }",
            "s.json:1:",
            &["`position` is given twice"],
        );
    }

    #[test]
    fn colours_say_what_they_may_be() {
        let text = "{ \"camera\": {}, \"materials\": { \"m\": { \"type\": \"diffuse\", \"albedo\": \"red\" } } }";
        assert_message(text, "s.json:1:", &["materials.m.albedo", "expected a colour"]);
    }

    #[test]
    fn truncated_empty_and_trailing_texts_are_errors() {
        for text in
            ["", " \n", "// nothing", "{", "{ \"camera\": {}", "[1, 2", "{ \"camera\": {} } x", "nul", "/* open"]
        {
            assert!(message(text).starts_with("s.json:1:"), "{text}");
        }
        let whole = "{ \"camera\": { \"position\": [0, 1, 2] }, \"shapes\": [{ \"type\": \"sphere\", \"name\": \
                     \"a\\u00e9\" }] }";
        assert!(parse_scene(whole, Path::new("s.json")).is_ok());
        for end in 0..whole.len() {
            assert!(parse_scene(&whole[..end], Path::new("s.json")).is_err(), "{end}");
        }
        assert!(parse_scene(&format!("\u{feff}{whole}"), Path::new("s.json")).is_ok());
    }

    #[test]
    fn deep_nesting_is_an_error() {
        for deep in
            ["[".repeat(100_000), "{\"camera\":".repeat(100_000), format!("{{ \"camera\": {} }}", "[".repeat(100_000))]
        {
            assert_message(&deep, "s.json:1:", &[]);
        }
    }
}
