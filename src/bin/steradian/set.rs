//! `--set KEY=VALUE`: keys of a scene's film, sampler and integrator, changed for one render.

use std::path::Path;

use serde_json::{Map, Value, json};
use steradian::desc::SceneDesc;
use steradian::{Error, Result, compile, import};

/// The parts of a scene that can be changed: what EXR files hold of a render for `rerender`.
const PARTS: [&str; 3] = ["film", "sampler", "integrator"];

/// A key of the scene format, such as `integrator.clamp`, and its value.
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
        let part = key.split('.').next().unwrap_or_default();
        if !PARTS.contains(&part) || !key.contains('.') {
            return Err(format!("{form}; keys begin with film., sampler. or integrator."));
        }
        // What is no JSON is a word, which needs no quotes here.
        Ok(Self { key: key.to_owned(), value: serde_json::from_str(value).unwrap_or_else(|_| value.into()) })
    }
}

/// The settings of a scene with these changes; it holds neither shapes nor lights.
pub fn changed(desc: &SceneDesc, assignments: &[Assignment]) -> Result<SceneDesc> {
    let mut parts = json!({ "camera": {}, "film": desc.film, "sampler": desc.sampler, "integrator": desc.integrator });
    for Assignment { key, value } in assignments {
        set(&mut parts, key, value.clone());
        check(&parts).map_err(|message| Error::Usage(format!("--set {key}={value}: {message}")))?;
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

/// Another type has other keys: those of the one before do not remain.
fn set(parts: &mut Value, key: &str, value: Value) {
    let (outer, last) = key.rsplit_once('.').unwrap_or(("", key));
    let mut node = parts;
    for key in outer.split('.') {
        node = &mut node[key];
    }
    if !node.is_object() || last == "type" && node.get(last) != Some(&value) {
        *node = Value::Object(Map::new());
    }
    node[last] = value;
}

fn read(parts: &Value) -> Result<SceneDesc> {
    import::parse_scene(&parts.to_string(), Path::new("--set"))
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
    compile::check_film_and_integrator(&desc.film, &desc.integrator, Path::new("--set")).map_err(message)
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
            ("integrator.clmap=10", &["--set integrator.clmap=10", "did you mean \"clamp\"?"][..]),
            ("integrator.clamp=-1", &["--set integrator.clamp=-1", "above 0"]),
            ("sampler.spp=many", &["--set sampler.spp=\"many\"", "expected a whole number"]),
            ("sampler.spp=0", &["at least one sample"]),
            ("camera.near=1", &["keys begin with film., sampler. or integrator."]),
            ("integrator", &["expected KEY=VALUE"]),
        ] {
            let message = with(&[text]).unwrap_err();
            assert!(parts.iter().all(|part| message.contains(part)), "{text}: {message}");
        }
    }
}
