//! All faults of a scene's text: each is repaired by what comes closest to valid, and the rest is read again.

use serde_json::{Value, json};

use super::fault::{Step, first_fault, follow, node_at, part_alone, path_text};
use super::wording::suggested;
use crate::desc::SceneDesc;

/// More faults than this are not reported.
const MAX_FAULTS: usize = 20;

/// Of longer texts, in bytes, only the first fault is reported: each further one takes the time of reading all of it.
const MAX_TEXT: usize = 1 << 24;

/// Keys of the root that define no names.
const WITHOUT_NAMES: [&str; 7] = ["camera", "film", "instances", "integrator", "lights", "outputs", "sampler"];

/// A fault: where it lies, and serde's message for it.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneFault {
    /// The value, or the key, that is wrong.
    pub steps: Vec<Step>,
    /// The message.
    pub message: String,
    /// How many entries the list should have that has too many.
    pub length: Option<usize>,
}

/// A scene without its faults of keys and types, to look for others.
#[derive(Clone, Debug)]
pub struct RepairedScene {
    /// The scene with other values in place of what was wrong.
    pub desc: SceneDesc,
    /// Where it has other values than its file.
    changed: Vec<String>,
}

impl RepairedScene {
    /// Whether a fault at this path, such as `shapes[3].material`, may come from a repair.
    pub fn is_changed(&self, path: &str) -> bool {
        let is_within = |inner: &str, outer: &str| {
            inner.strip_prefix(outer).is_some_and(|rest| !rest.starts_with(|c: char| c.is_alphanumeric() || c == '_'))
        };
        self.changed.iter().any(|changed| is_within(path, changed) || is_within(changed, path))
    }
}

/// The faults of a scene that is valid JSON of so many bytes, as far as each can be told from the others, and the scene
/// without them, if each can be repaired and no name is lost with it.
pub fn all_faults(scene: &Value, text_length: usize) -> (Vec<SceneFault>, Option<RepairedScene>) {
    let most = if text_length > MAX_TEXT { 1 } else { MAX_FAULTS };
    let (mut faults, mut changed, mut keeps_names) = (Vec::new(), Vec::new(), true);
    let mut scene = scene.clone();
    let mut next = first_fault(&scene);
    while let Some((steps, message)) = next.take() {
        let is_long = message.contains("fewer elements") || message.contains(" in sequence");
        let length = if is_long { fitting_length(&scene, &steps) } else { None };
        let fault = SceneFault { steps, message, length };
        let repaired = repair(&mut scene, &fault);
        faults.push(fault);
        match repaired {
            Some(Repair::Value(place)) => {
                keeps_names &=
                    place.len() > 1 || matches!(&place[..], [Step::Key(key)] if WITHOUT_NAMES.contains(&key.as_str()));
                changed.push(path_text(&place));
            }
            Some(Repair::Name) => {}
            None => break,
        }
        if faults.len() == most {
            break;
        }
        // What a repair breaks is no fault of the file's.
        next = first_fault(&scene)
            .filter(|(steps, message)| !faults.iter().any(|fault| fault.message == *message && fault.steps == *steps));
    }
    let desc = if keeps_names { serde_json::from_value(scene).ok() } else { None };
    (faults, desc.map(|desc| RepairedScene { desc, changed }))
}

/// What was changed to take a fault out of a scene.
enum Repair {
    /// The value here, which may be gone.
    Value(Vec<Step>),
    /// A name, to the one that was meant.
    Name,
}

/// Takes a fault out of the scene; `None` if that fails.
fn repair(scene: &mut Value, fault: &SceneFault) -> Option<Repair> {
    let mut steps = fault.steps.clone();
    if let Some(key) = names_key(&fault.steps, &fault.message) {
        if fault.message.starts_with("unknown field") {
            let (_, outer) = steps.split_last()?;
            let value = follow(scene, outer)?.as_object_mut()?.remove(&key)?;
            let is_renamed = suggested(&fault.message).is_some_and(|name| add(scene, outer, name, value));
            return Some(if is_renamed { Repair::Name } else { Repair::Value(steps) });
        }
        steps.pop();
    }
    if fault.message.starts_with("unknown variant")
        && matches!(steps.last(), Some(Step::Key(key)) if key == "type")
        && let Some(name) = suggested(&fault.message)
    {
        set(scene, &steps, json!(name))?;
        return Some(Repair::Name);
    }
    if let Some(key) = missing_key(&fault.message)
        && key != "type"
    {
        let mut with_key = steps.clone();
        with_key.push(Step::Key(key.to_owned()));
        if node_at(scene, &steps)?.is_object() && replace(scene, &with_key).is_some() {
            return Some(Repair::Value(with_key));
        }
    }
    // Where nothing replaces a value, something may replace what it is a part of.
    loop {
        if replace(scene, &steps).is_some() {
            return Some(Repair::Value(steps));
        }
        steps.pop()?;
    }
}

/// Adds a key to the object that the steps lead to; `false`, and nothing changes, if it is there or the value is a
/// fault.
fn add(scene: &mut Value, steps: &[Step], key: &str, value: Value) -> bool {
    let mut place = steps.to_vec();
    place.push(Step::Key(key.to_owned()));
    if node_at(scene, &place).is_some() {
        return false;
    }
    let is_valid = set(scene, &place, value).is_some() && is_valid_alone(scene, &place);
    if !is_valid && let Some(Value::Object(map)) = follow(scene, steps) {
        map.remove(key);
    }
    is_valid
}

/// Whether no fault lies where the steps lead in a scene of nothing but that and the types of what it is a part of.
fn is_valid_alone(scene: &Value, steps: &[Step]) -> bool {
    let Some(mut trial) = node_at(scene, steps).cloned() else { return false };
    let mut at = steps.to_vec();
    for i in (0..steps.len()).rev() {
        trial = match &steps[i] {
            Step::Key(key) => {
                let kind = node_at(scene, &steps[..i]).and_then(|outer| outer.get("type")).cloned();
                let kind = kind.map(|kind| ("type".to_owned(), kind));
                Value::Object(kind.into_iter().chain([(key.clone(), trial)]).collect())
            }
            Step::Index(_) => {
                at[i] = Step::Index(0);
                Value::Array(vec![trial])
            }
        };
    }
    first_fault(&trial).is_none_or(|(fault, _)| !fault.starts_with(&at))
}

/// Puts a value to where the steps lead with which no fault lies there; `None` if there is none.
fn replace(scene: &mut Value, steps: &[Step]) -> Option<()> {
    let (mut trial, place) = entry_alone(scene, steps)?;
    let value = candidates().into_iter().find(|value| {
        set(&mut trial, &place, value.clone()).is_some()
            && first_fault(&trial).is_none_or(|(fault, _)| !fault.starts_with(&place))
    })?;
    set(scene, steps, value)
}

/// A scene of nothing but the entry that the steps lead into, such as a shape, and where they lead there.
fn entry_alone(scene: &Value, steps: &[Step]) -> Option<(Value, Vec<Step>)> {
    let is_index = |i: usize| matches!(steps.get(i), Some(Step::Index(_)));
    let length = match steps.first()? {
        Step::Key(key) if key == "objects" => {
            if is_index(3) {
                4
            } else {
                3
            }
        }
        Step::Key(key) if key == "materials" || key == "textures" => 2,
        _ if is_index(1) => 2,
        _ => 1,
    };
    // The last step may lead to a key that is missing.
    let (entry, inner) = steps.split_at(length.min(steps.len() - 1));
    let (trial, mut at) = part_alone(scene, entry)?;
    at.extend_from_slice(inner);
    Some((trial, at))
}

fn set(scene: &mut Value, steps: &[Step], value: Value) -> Option<()> {
    let (last, outer) = steps.split_last()?;
    match (follow(scene, outer)?, last) {
        (Value::Object(map), Step::Key(key)) => {
            map.insert(key.clone(), value);
        }
        (Value::Array(list), Step::Index(index)) => *list.get_mut(*index)? = value,
        _ => return None,
    }
    Some(())
}

/// Values of every kind that a scene has.
fn candidates() -> Vec<Value> {
    vec![
        json!(1),
        json!([0, 0, 0]),
        json!([0, 0]),
        json!([1, 1, 1, 1]),
        json!(""),
        json!(false),
        json!([]),
        json!({}),
        json!({ "type": "cube" }),
        json!({ "type": "diffuse" }),
        json!({ "type": "environment" }),
        json!({ "type": "vertex_color" }),
        json!({ "type": "path" }),
        json!({ "type": "box" }),
        json!({ "object": "" }),
        json!({ "file": "" }),
        json!({ "scale": 1 }),
        json!({ "time": 0 }),
        json!({ "radiance": [0, 0, 0] }),
        json!({ "bezier": [] }),
        json!({ "texture": "" }),
        json!(["", ""]),
    ]
}

/// How many entries a list has without the fault of being too long; `None` if an object is expected.
fn fitting_length(scene: &Value, steps: &[Step]) -> Option<usize> {
    let (trial, at) = entry_alone(scene, steps)?;
    let list = node_at(&trial, &at)?.as_array()?.clone();
    let mut object = trial.clone();
    set(&mut object, &at, json!({}))?;
    first_fault(&object).filter(|(_, message)| message.starts_with("invalid type"))?;
    (1..list.len().min(64)).rev().find(|&length| {
        let mut shorter = trial.clone();
        set(&mut shorter, &at, Value::Array(list[..length].to_vec())).is_some()
            && first_fault(&shorter).is_none_or(|(fault, _)| !fault.starts_with(&at))
    })
}

/// The last key of the path, if that is what the message is about.
pub fn names_key(steps: &[Step], message: &str) -> Option<String> {
    let Some(Step::Key(key)) = steps.last() else { return None };
    let is_named = ["field", "variant"].iter().any(|what| message.starts_with(&format!("unknown {what} `{key}`")));
    is_named.then(|| key.clone())
}

/// The key that the message misses.
pub fn missing_key(message: &str) -> Option<&str> {
    message.strip_prefix("missing field `")?.split('`').next()
}
