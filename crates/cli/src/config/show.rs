//! `steradian config show`.

use std::path::Path;

use clap::CommandFactory;
use serde_json::{Map, Value, json};
use steradian::internal::import::{self, ImportOptions};
use steradian::{Error, Result};

use super::{EXR_KEYS, Options, settings};
use crate::args::{Cli, ConfigShowArgs};
use crate::log::{self, Level};
use crate::text;

/// Options whose values a scene has, with their places in it.
const IN_SCENES: [(&str, &[&str]); 14] = [
    ("output", &["/outputs"]),
    ("spp", &["/sampler/spp"]),
    ("size", &["/film/width", "/film/height"]),
    ("crop", &["/film/crop"]),
    ("integrator", &["/integrator/type"]),
    ("max-depth", &["/integrator/max_depth"]),
    ("strategy", &["/integrator/strategy"]),
    ("roulette", &["/integrator/roulette"]),
    ("clamp", &["/integrator/clamp"]),
    ("regularize", &["/integrator/regularize"]),
    ("caustics", &["/integrator/caustics"]),
    ("bidirectional", &["/integrator/bidirectional"]),
    ("sampler", &["/sampler/type"]),
    ("seed", &["/sampler/seed"]),
];

/// A value and where it comes from.
struct SettingRow {
    key: String,
    value: String,
    origin: String,
}

/// Prints what options `render` has without a command line, and where they come from.
pub fn run(arguments: &ConfigShowArgs) -> Result<()> {
    let options = Options::new(&Cli::command());
    let nowhere = Path::new("scene.json").to_owned();
    let found = settings(&options, arguments.scene.as_ref().unwrap_or(&nowhere))?;
    found.warnings.iter().for_each(|warning| log::message(Level::Warning, warning));
    let of_scene = scene_rows(arguments.scene.as_deref())?;
    let mut rows: Vec<SettingRow> = Vec::new();
    let keys = found.settings.iter().map(|setting| setting.key.as_str()).filter(|key| key.starts_with(EXR_KEYS));
    for name in options.names().chain(keys) {
        let setting = found.settings.iter().find(|setting| setting.key == name).map(|setting| {
            let value = if setting.values.is_empty() { "false".to_owned() } else { setting.values.join(",") };
            SettingRow { key: name.to_owned(), value, origin: setting.origin.to_string() }
        });
        let built_in = || {
            let value = options.default_of(name)?;
            Some(SettingRow { key: name.to_owned(), value, origin: "built-in".to_owned() })
        };
        let in_scene = || {
            of_scene.iter().find(|row| row.key == name).map(|row| SettingRow {
                key: row.key.clone(),
                value: row.value.clone(),
                origin: row.origin.clone(),
            })
        };
        rows.extend(setting.or_else(in_scene).or_else(built_in));
    }
    if arguments.json {
        let entry = |row: &SettingRow| (row.key.clone(), json!({ "value": row.value, "origin": row.origin }));
        return text::print_json(&Value::Object(rows.iter().map(entry).collect::<Map<_, _>>()));
    }
    let width = |column: fn(&SettingRow) -> &str| rows.iter().map(|row| column(row).chars().count()).max().unwrap_or(0);
    let (keys, values) = (width(|row| &row.key), width(|row| &row.value));
    let line = |row: &SettingRow| match arguments.origin {
        true => format!("{:keys$}  {:values$}  {}", row.key, row.value, row.origin),
        false => format!("{:keys$}  {}", row.key, row.value),
    };
    text::print(&rows.iter().map(line).collect::<Vec<_>>().join("\n"))
}

/// The scene's values, and the defaults of those it does not have.
fn scene_rows(scene: Option<&Path>) -> Result<Vec<SettingRow>> {
    let as_json =
        |desc: &steradian::desc::SceneDesc| serde_json::to_value(desc).map_err(|e| Error::Internal(e.to_string()));
    let bare = as_json(&import::parse_scene(r#"{ "camera": {} }"#, Path::new("scene.json"))?)?;
    let (desc, written) = match scene {
        None => (bare.clone(), None),
        Some(path) => {
            let desc = as_json(&import::read_scene(path, &ImportOptions::default())?.desc)?;
            (desc, import::scene_as_written(path))
        }
    };
    let mut rows = Vec::new();
    for (key, places) in IN_SCENES {
        let values: Vec<&Value> =
            places.iter().filter_map(|place| desc.pointer(place)).filter(|value| !value.is_null()).collect();
        if values.len() < places.len() || values.iter().any(|value| value.as_array().is_some_and(Vec::is_empty)) {
            continue;
        }
        // A scene in the native format has the key or not; in an imported scene, a value that differs from the default
        // was given.
        let is_given = match &written {
            Some(written) => places.iter().any(|place| written.pointer(place).is_some()),
            None => places.iter().any(|place| desc.pointer(place) != bare.pointer(place)),
        };
        let origin = match scene {
            Some(path) if is_given => format!("scene: {}", path.display()),
            _ => "built-in".to_owned(),
        };
        let separator = if key == "size" { "x" } else { "," };
        rows.push(SettingRow {
            key: key.to_owned(),
            value: values.into_iter().map(word).collect::<Vec<_>>().join(separator),
            origin,
        });
    }
    Ok(rows)
}

/// A value as the command line would have it; of an output, its file.
fn word(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Array(items) => items.iter().map(word).collect::<Vec<_>>().join(","),
        Value::Object(map) => map.get("file").map_or_else(String::new, word),
        other => other.to_string(),
    }
}
