//! Keys of a scene's film, sampler and integrator, changed for one render.

use std::path::Path;

use crate::compile::check_film_and_integrator;
use crate::desc::SceneDesc;
use crate::error::{Error, Result};
use crate::import::parse_scene;
use crate::render::{Overrides, Settings, refused};
use serde_json::{Map, Value, json};

/// The parts of a scene that can be changed: what EXR files hold of a render.
const PARTS: [&str; 3] = ["film", "sampler", "integrator"];

/// A key of the scene format below `film`, `sampler` or `integrator`, such as `integrator.clamp`, and its value. Parsed
/// from `KEY=VALUE`, where the value is JSON or a word.
#[derive(Clone, Debug, PartialEq)]
pub struct Assignment {
    key: String,
    value: Value,
}

impl std::str::FromStr for Assignment {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let form = "expected KEY=VALUE, such as integrator.clamp=10";
        let (key, value) = text.split_once('=').ok_or(form)?;
        let (key, value) = (key.trim(), value.trim());
        // What is no JSON is a word, which needs no quotes here.
        let value = serde_json::from_str(value).unwrap_or_else(|_| value.into());
        Self::new(key, value).map_err(|_| format!("{form}; {KEYS}"))
    }
}

/// Which keys can be set.
const KEYS: &str = "keys begin with film., sampler. or integrator.";

impl Assignment {
    /// The value of a key.
    ///
    /// # Errors
    /// [`Error::Setting`] if the key is of another part of the scene.
    pub fn new(key: &str, value: Value) -> Result<Self> {
        let part = key.split('.').next().unwrap_or_default();
        if !PARTS.contains(&part) || !key.contains('.') {
            return Err(refused("set", format!(" {key}: {KEYS}")));
        }
        Ok(Self { key: key.to_owned(), value })
    }
}

/// The settings of a scene with some of its keys set, and then with overrides.
///
/// # Errors
/// [`Error::Setting`] if a change is impossible.
pub fn changed_settings(desc: &SceneDesc, assignments: &[Assignment], overrides: &Overrides) -> Result<Settings> {
    if assignments.is_empty() {
        Settings::new(desc, overrides)
    } else {
        Settings::new(&changed(desc, assignments)?, overrides)
    }
}

/// The settings of a scene with these changes; it holds neither shapes nor lights.
fn changed(desc: &SceneDesc, assignments: &[Assignment]) -> Result<SceneDesc> {
    let mut parts = json!({ "camera": {}, "film": desc.film, "sampler": desc.sampler, "integrator": desc.integrator });
    for Assignment { key, value } in assignments {
        assign(&mut parts, &key.split('.').collect::<Vec<_>>(), value.clone());
        check(&parts).map_err(|message| refused("set", format!(" {key}={value}: {message}")))?;
    }
    let SceneDesc { film, sampler, integrator, .. } = read(&parts)?;
    Ok(SceneDesc {
        film,
        sampler,
        integrator,
        camera: desc.camera.clone(),
        outputs: desc.outputs.clone(),
        ..SceneDesc::default()
    })
}

/// Sets the value at the end of these keys. Another type has other keys: those of the one before do not remain.
pub(super) fn assign(value: &mut Value, keys: &[&str], new: Value) {
    let Some((last, outer)) = keys.split_last() else { return };
    let mut node = value;
    for key in outer {
        node = match key.parse::<usize>() {
            Ok(i) if node.get(i).is_some() => &mut node[i],
            _ => &mut node[*key],
        };
    }
    if let Ok(i) = last.parse::<usize>()
        && node.get(i).is_some()
    {
        node[i] = new;
        return;
    }
    if !node.is_object() || *last == "type" && node.get(*last) != Some(&new) {
        *node = Value::Object(Map::new());
    }
    node[*last] = new;
}

fn read(parts: &Value) -> Result<SceneDesc> {
    parse_scene(&parts.to_string(), Path::new("set"))
}

/// What is wrong with the settings.
fn check(parts: &Value) -> Result<(), String> {
    let message = |error: Error| match error.parts() {
        [Error::Parse { message, .. } | Error::Scene { message, .. }, ..] => message.clone(),
        _ => error.to_string(),
    };
    let desc = read(parts).map_err(message)?;
    if desc.sampler.spp == 0 {
        return Err("a picture needs at least one sample per pixel".to_owned());
    }
    check_film_and_integrator(&desc.film, &desc.integrator, Path::new("set")).map_err(message)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with(texts: &[&str]) -> Result<Value, String> {
        let assignments: Result<Vec<Assignment>, String> = texts.iter().map(|text| text.parse()).collect();
        let desc = changed(&SceneDesc::default(), &assignments?).map_err(|e| e.to_string())?;
        Ok(json!({ "film": desc.film, "sampler": desc.sampler, "integrator": desc.integrator }))
    }

    #[test]
    fn keys_of_the_scene_format_are_set() {
        let value = with(&["integrator.clamp=10", "film.filter.type=box", "sampler.spp=7", "film.width=33"]).unwrap();
        assert_eq!((&value["integrator"]["clamp"], &value["sampler"]["spp"]), (&json!(10.0), &json!(7)));
        assert_eq!((&value["film"]["filter"]["type"], &value["film"]["width"]), (&json!("box"), &json!(33)));
        let value = with(&["integrator.type=whitted", "integrator.ambient=0.5"]).unwrap();
        assert_eq!(value["integrator"]["ambient"], json!([0.5, 0.5, 0.5]));
    }

    #[test]
    fn faults_name_the_assignment() {
        for (text, parts) in [
            ("integrator.clmap=10", &["`set` integrator.clmap=10", "did you mean \"clamp\"?"][..]),
            ("integrator.clamp=-1", &["`set` integrator.clamp=-1", "above 0"]),
            ("sampler.spp=many", &["`set` sampler.spp=\"many\"", "expected a whole number"]),
            ("sampler.spp=0", &["at least one sample"]),
            ("camera.near=1", &["keys begin with film., sampler. or integrator."]),
            ("integrator", &["expected KEY=VALUE"]),
        ] {
            let message = with(&[text]).unwrap_err();
            assert!(parts.iter().all(|part| message.contains(part)), "{text}: {message}");
        }
    }
}
