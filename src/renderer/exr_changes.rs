//! Keys of EXR outputs, changed for one render by a line of text.

use std::str::FromStr;

use serde_json::{Map, Value};

use crate::import::describe_value;
use crate::render::ExrOverrides;

/// Keys whose values are text, whatever they look like.
const TEXTS: [&str; 2] = ["owner", "comments"];

/// Keys of [`ExrOverrides`] with their values. Parsed from `KEY=VALUE[,KEY=VALUE...]`; in the text of `owner` and
/// `comments` a comma is a part of the text unless `KEY=` follows it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ExrChanges {
    pairs: Vec<(String, String)>,
    changes: ExrOverrides,
}

impl ExrChanges {
    /// The keys and the values as they were written.
    pub fn pairs(&self) -> impl Iterator<Item = (&str, &str)> {
        self.pairs.iter().map(|(key, value)| (key.as_str(), value.as_str()))
    }

    /// All these changes; of two values of a key the later counts.
    pub fn merged<'a>(list: impl IntoIterator<Item = &'a Self>) -> ExrOverrides {
        list.into_iter().fold(ExrOverrides::default(), |merged, next| next.changes.clone().or(merged))
    }
}

impl FromStr for ExrChanges {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut pairs: Vec<(String, String)> = Vec::new();
        for part in text.split(',') {
            match (part.split_once('='), pairs.last_mut()) {
                (Some((key, value)), _) => pairs.push((key.trim().to_owned(), value.trim().to_owned())),
                (None, Some((key, value))) if TEXTS.contains(&key.as_str()) => value.extend([",", part]),
                (None, _) => return Err(format!("expected KEY=VALUE, such as profile=nuke; found \"{part}\"")),
            }
        }
        let parsed: Result<Vec<Self>, String> = pairs.iter().map(|(key, value)| single(key, value)).collect();
        let changes = Self::merged(&parsed?);
        Ok(Self { pairs, changes })
    }
}

/// The change of one key.
fn single(key: &str, text: &str) -> Result<ExrChanges, String> {
    let word = || Value::from(text);
    let value = if TEXTS.contains(&key) { word() } else { serde_json::from_str(text).unwrap_or_else(|_| word()) };
    let object = Value::Object(Map::from_iter([(key.to_owned(), value.clone())]));
    match serde_json::from_value(object) {
        Ok(changes) => Ok(ExrChanges { pairs: Vec::new(), changes }),
        Err(error) => {
            let message = describe_value(key, &value, error.to_string());
            Err(if message.starts_with("unknown key") { message } else { format!("{key}: {message}") })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::desc::{CompressionDesc, ExrProfileDesc};

    fn parsed(text: &str) -> ExrChanges {
        text.parse().unwrap()
    }

    #[test]
    fn keys_and_values_are_read() {
        let list = [
            parsed("profile=nuke, dwa_level=20,uncropped=true"),
            parsed("comments=Take 3, graded,owner=42,compression=piz"),
            parsed("profile=blender,uncropped=false"),
        ];
        let expected = ExrOverrides {
            profile: Some(ExrProfileDesc::Blender),
            compression: Some(CompressionDesc::Piz),
            dwa_level: Some(20.0),
            uncropped: Some(false),
            owner: Some("42".to_owned()),
            comments: Some("Take 3, graded".to_owned()),
            ..ExrOverrides::default()
        };
        assert_eq!(ExrChanges::merged(&list), expected);
        let pairs: Vec<_> = list[1].pairs().collect();
        assert_eq!(pairs, [("comments", "Take 3, graded"), ("owner", "42"), ("compression", "piz")]);
    }

    #[test]
    fn faults_name_the_key() {
        for (text, expected) in [
            ("", "expected KEY=VALUE, such as profile=nuke; found \"\""),
            ("uncropped", "expected KEY=VALUE"),
            ("profile=nuke,uncropped", "found \"uncropped\""),
            ("profil=nuke", "unknown key \"profil\" (did you mean \"profile\"?)"),
            ("frames_per_second=25", "unknown key \"frames_per_second\": use one of profile, compression, dwa_level"),
            ("profile=nuk", "profile: unknown value \"nuk\" (did you mean \"nuke\"?)"),
            ("compression=lzw", "compression: unknown value \"lzw\": use one of zip, zips"),
            ("uncropped=yes", "uncropped: expected true or false, found the text \"yes\""),
            ("crypto_depth=-1", "crypto_depth: expected a whole number that is not negative, found -1"),
            ("dwa_level=much", "dwa_level: expected a number, found the text \"much\""),
        ] {
            let message = text.parse::<ExrChanges>().unwrap_err();
            assert!(message.contains(expected), "{text}: {message}");
        }
    }
}
