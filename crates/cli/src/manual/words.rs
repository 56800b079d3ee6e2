//! Types of the scene format in words.

use std::collections::BTreeMap;

use serde_json::{Map, Value};

/// Types whose names are not those of their Rust types.
const NAMES: [(&str, &str); 4] =
    [("Color", "colour"), ("LayerKind", "layer"), ("Ranged", "ranged number"), ("Scalar", "number within 0 and 1")];
/// Choices of at most this many names are listed where they are used.
const FEW_NAMES: usize = 5;

/// The types of the schema, and the page that describes each.
pub struct Types<'a> {
    /// The types by name.
    pub definitions: &'a Map<String, Value>,
    /// The page of each, without extension.
    pub homes: BTreeMap<&'a str, &'static str>,
}

/// What a type is called: `NormalMapDesc` is a normal map.
pub fn name_of(definition: &str) -> String {
    let name = definition.strip_suffix("Desc").unwrap_or(definition);
    if let Some((_, words)) = NAMES.iter().find(|(special, _)| *special == name) {
        return (*words).to_owned();
    }
    let mut words = String::new();
    for c in name.chars() {
        if c.is_uppercase() && !words.is_empty() {
            words.push(' ');
        }
        words.push(c.to_ascii_lowercase());
    }
    words.replace("color", "colour")
}

/// The same as a heading.
pub fn title_of(definition: &str) -> String {
    let name = name_of(definition);
    let mut rest = name.chars();
    rest.next().map_or_else(String::new, |first| first.to_uppercase().chain(rest).collect())
}

impl Types<'_> {
    /// The type of a key's values, with links to pages from `page`.
    pub fn words(&self, key: &str, value: &Value, page: &str) -> String {
        let inner = |value: &Value| self.words(key, value, page);
        if let Some(reference) = value["$ref"].as_str() {
            return self.link(reference, page);
        }
        if let Some(name) = value["const"].as_str() {
            return format!("`{name}`");
        }
        if let Some(choices) = value["anyOf"].as_array().or_else(|| value["oneOf"].as_array()) {
            let kinds: Vec<&Value> = choices.iter().filter(|choice| choice["type"] != "null").collect();
            return match kinds[..] {
                [list, one] if list["items"] == *one && list["minItems"].is_null() => {
                    format!("{}, or a list", inner(one))
                }
                _ => kinds.iter().map(|kind| inner(kind)).collect::<Vec<_>>().join(" or "),
            };
        }
        match kind(value) {
            "number" => "number".to_owned(),
            "integer" => "whole number".to_owned(),
            "boolean" => "`true` or `false`".to_owned(),
            "string" if key == "file" || key.ends_with("_file") || key.ends_with("_files") => "path".to_owned(),
            "string" => "text".to_owned(),
            "array" => self.list(key, value, page),
            _ if value["additionalProperties"].is_object() => {
                format!("names, each with: {}", inner(&value["additionalProperties"]))
            }
            _ => self.object(value, page),
        }
    }

    fn list(&self, key: &str, value: &Value, page: &str) -> String {
        let item = self.words(key, &value["items"], page);
        let plural = match item.as_str() {
            "number" | "whole number" | "path" => format!("{item}s"),
            "text" => "texts".to_owned(),
            _ => format!("({item})"),
        };
        match (value["minItems"].as_u64(), value["maxItems"].as_u64()) {
            (Some(min), Some(max)) if min == max => format!("{} {plural}", count(min)),
            _ if plural.starts_with('(') => format!("list of {plural}"),
            _ => plural,
        }
    }

    /// An object of few keys, such as `{ "texture": text }`.
    fn object(&self, value: &Value, page: &str) -> String {
        let keys = value["properties"].as_object().into_iter().flatten();
        let keys: Vec<String> =
            keys.map(|(key, value)| format!("`\"{key}\":` {}", self.words(key, value, page))).collect();
        format!("`{{` {} `}}`", keys.join(", "))
    }

    fn link(&self, reference: &str, page: &str) -> String {
        let definition = reference.rsplit('/').next().unwrap_or(reference);
        let home = self.homes.get(definition).copied().unwrap_or(page);
        let file = if home == page { String::new() } else { format!("{home}.md") };
        let name = name_of(definition);
        let link = format!("[{name}]({file}#{})", name.replace(' ', "-"));
        let names: Option<Vec<&str>> = self.definitions.get(definition).and_then(|definition| {
            definition["oneOf"].as_array()?.iter().map(|choice| choice["const"].as_str()).collect()
        });
        match names {
            Some(names) if names.len() <= FEW_NAMES => {
                let names: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
                format!("{link}: {}", names.join(", "))
            }
            _ => link,
        }
    }
}

/// The JSON type of a value, `null` aside.
pub fn kind(value: &Value) -> &str {
    let named = |value: &'_ Value| value.as_str().is_some_and(|name| name != "null");
    let first = value["type"].as_array().and_then(|kinds| kinds.iter().find(|kind| named(kind)));
    first.unwrap_or(&value["type"]).as_str().unwrap_or("object")
}

fn count(number: u64) -> String {
    match number {
        2 => "two".to_owned(),
        3 => "three".to_owned(),
        4 => "four".to_owned(),
        _ => number.to_string(),
    }
}
