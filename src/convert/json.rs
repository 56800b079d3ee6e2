//! A scene as text that people can read and change.

use crate::desc::SceneDesc;
use crate::error::{Error, Result};

/// Longest list of numbers that stays on one line, in characters.
const MAX_LINE: usize = 140;

/// A scene as JSON, short lists on one line.
pub fn scene_text(desc: &SceneDesc) -> Result<String> {
    let text = serde_json::to_string_pretty(desc).map_err(|e| Error::Internal(e.to_string()))?;
    let mut text = joined(&text);
    text.push('\n');
    Ok(text)
}

/// The text with every list and object that has no strings, and is short, on one line.
fn joined(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let bytes = text.as_bytes();
    let mut at = 0;
    while at < bytes.len() {
        let end = match bytes[at] {
            b'"' => {
                let end = string_end(bytes, at);
                out.push_str(&text[at..end]);
                end
            }
            b'[' => match short_list(text, at) {
                Some((line, end)) => {
                    out.push_str(&line);
                    end
                }
                None => {
                    out.push('[');
                    at + 1
                }
            },
            _ => {
                let end = text[at..].find(['"', '[']).map_or(text.len(), |length| at + length);
                out.push_str(&text[at..end]);
                end
            }
        };
        at = end;
    }
    out
}

/// Behind the string that begins at `start`.
fn string_end(bytes: &[u8], start: usize) -> usize {
    let mut at = start + 1;
    while at < bytes.len() && bytes[at] != b'"' {
        at += if bytes[at] == b'\\' { 2 } else { 1 };
    }
    (at + 1).min(bytes.len())
}

/// A list of numbers (or of lists of numbers) that begins at `start`, on one line if it fits, and its end.
fn short_list(text: &str, start: usize) -> Option<(String, usize)> {
    let mut line = String::new();
    let mut depth = 0usize;
    for (i, c) in text[start..].char_indices() {
        match c {
            '[' => depth += 1,
            ']' => depth -= 1,
            '"' | '{' => return None,
            _ => {}
        }
        match c {
            ',' => line.push_str(", "),
            c if c.is_whitespace() => {}
            c => line.push(c),
        }
        if line.len() > MAX_LINE {
            return None;
        }
        if depth == 0 {
            return Some((line, start + i + 1));
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::parse_scene;
    use std::path::Path;

    #[test]
    fn the_text_means_the_same_and_lists_are_short() {
        let scene = r#"{ "camera": { "position": [0.1, 2, 3], "look_at": [0, 0, 0] }, "comment": "a [1,\n 2] \"b\"",
            "shapes": [{ "type": "sphere", "name": "[",
                         "transform": [{ "matrix": [[1,0,0,0.1],[0,1,0,0],[0,0,1,0],[0,0,0,1]] }] },
                       { "type": "quad", "material": "m", "emission": { "radiance": [1, 1, 1] } }],
            "materials": { "m": { "type": "diffuse", "albedo": [0.1, 0.2, 0.3] } } }"#;
        let desc = parse_scene(scene, Path::new("s.json")).unwrap();
        let text = scene_text(&desc).unwrap();
        assert!(text.contains("\"position\": [0.1, 2.0, 3.0]"), "{text}");
        assert!(text.contains("\"matrix\": [[1.0, 0.0, 0.0, 0.1], ["), "{text}");
        assert!(text.contains("\"albedo\": [0.1, 0.2, 0.3]"), "{text}");
        assert!(!text.contains("reverse_normal") && !text.contains("\"transform\": []"), "{text}");
        let again = parse_scene(&text, Path::new("t.json")).unwrap();
        assert_eq!(serde_json::to_value(&again).unwrap(), serde_json::to_value(&desc).unwrap());
    }
}
