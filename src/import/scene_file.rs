//! Scene files: JSON with comments to [`SceneDesc`], with the place of every error.

use std::path::Path;

use super::comments::blank_comments;
use crate::desc::SceneDesc;
use crate::error::{Error, Result};

/// Reads a scene file.
///
/// # Errors
/// [`Error::Missing`] if it cannot be read, [`Error::Parse`] with line, column and path for what it says.
pub fn load_scene(path: &Path) -> Result<SceneDesc> {
    let missing = |message: String| Error::Missing { file: path.into(), message };
    let bytes = std::fs::read(path).map_err(|e| missing(e.to_string()))?;
    let text = String::from_utf8(bytes).map_err(|e| {
        let line = 1 + e.as_bytes()[..e.utf8_error().valid_up_to()].iter().filter(|&&b| b == b'\n').count();
        Error::Parse { file: path.into(), line, column: 1, message: "the file is not UTF-8 text".into() }
    })?;
    parse_scene(&text, path)
}

/// Parses the text of a scene; `path` is only for messages.
///
/// # Errors
/// As [`load_scene`].
pub fn parse_scene(text: &str, path: &Path) -> Result<SceneDesc> {
    let json = blank_comments(text);
    let fault = |error: &serde_json::Error, place: &str| Error::Parse {
        file: path.into(),
        line: error.line(),
        column: error.column(),
        message: describe(error, place),
    };
    let mut deserializer = serde_json::Deserializer::from_str(&json);
    let scene = serde_path_to_error::deserialize(&mut deserializer).map_err(|e| {
        let place = e.path().to_string();
        fault(e.inner(), if place == "." { "" } else { &place })
    })?;
    deserializer.end().map_err(|e| fault(&e, ""))?;
    Ok(scene)
}

/// The message without its position (which stands elsewhere), with the path in front and a suggestion behind.
fn describe(error: &serde_json::Error, place: &str) -> String {
    let text = error.to_string();
    let text = text.rsplit_once(" at line ").map_or(text.as_str(), |(message, _)| message);
    let place = if place.is_empty() { String::new() } else { format!("{place}: ") };
    let suggestion = suggestion(text).map_or(String::new(), |name| format!(" (did you mean `{name}`?)"));
    format!("{place}{text}{suggestion}")
}

/// For "unknown field `x`, expected one of `a`, `b`": the expected word nearest to `x`.
fn suggestion(message: &str) -> Option<&str> {
    if !(message.starts_with("unknown field") || message.starts_with("unknown variant")) {
        return None;
    }
    let mut words = message.split('`').skip(1).step_by(2);
    let given = words.next()?;
    closest_name(given, words)
}

/// The candidate that `name` is most likely a slip of, if any is near.
pub fn closest_name<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let lower = name.to_lowercase();
    candidates
        .into_iter()
        .map(|candidate| (strsim::damerau_levenshtein(&lower, &candidate.to_lowercase()), candidate))
        .filter(|(distance, _)| *distance <= 1 + name.chars().count() / 4)
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, candidate)| candidate)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(text: &str) -> String {
        parse_scene(text, Path::new("s.json")).unwrap_err().to_string()
    }

    #[test]
    fn a_typo_has_its_place_and_a_suggestion() {
        let text = "{\n \"camera\": {},\n \"shapes\": [{ \"type\": \"sphere\", \"radus\": 2 }]\n}";
        let message = message(text);
        assert!(
            message.starts_with("s.json:3:") && message.contains("shapes[0]") && message.contains("did you mean `radius`"),
            "{message}"
        );
    }

    #[test]
    fn unknown_types_are_named() {
        let message = message("{ \"camera\": {}, \"shapes\": [{ \"type\": \"shpere\" }] }");
        assert!(message.contains("`shpere`") && message.contains("did you mean `sphere`"), "{message}");
    }

    #[test]
    fn truncated_empty_and_trailing_texts_are_errors() {
        for text in ["", "{", "{ \"camera\": {}", "[1, 2", "{ \"camera\": {} } x", "nul"] {
            assert!(message(text).starts_with("s.json:1:"), "{text}");
        }
        let deep = "[".repeat(100_000);
        assert!(message(&deep).contains("s.json:1:"));
    }

    #[test]
    fn names_are_matched_regardless_of_case() {
        assert_eq!(closest_name("gold", ["Silver", "Gold"]), Some("Gold"));
        assert_eq!(closest_name("gold", ["Silver", "Chrome"]), None);
    }
}
