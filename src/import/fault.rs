//! Where in a scene's text a fault lies.
//!
//! Serde reads a value with a `type` as a whole before it looks inside, and so names only the value that holds a fault.
//! [`refine`] follows the fault inward by trying which part makes it go away; [`locate`] finds the part in the text.

use serde::Deserialize;
use serde_json::Value;

use crate::desc::SceneDesc;

/// A step into a JSON value.
#[derive(Clone, Debug, PartialEq)]
pub enum Step {
    /// Into an object.
    Key(String),
    /// Into an array.
    Index(usize),
}

/// The path as messages write it: `shapes[3].radius`.
pub fn path_text(steps: &[Step]) -> String {
    let mut text = String::new();
    for step in steps {
        match step {
            Step::Key(key) if text.is_empty() => text.push_str(key),
            Step::Key(key) => text.extend([".", key]),
            Step::Index(index) => text.push_str(&format!("[{index}]")),
        }
    }
    text
}

/// The steps of a path as serde tracked it, as far as the scene has them.
pub fn steps_of(path: &serde_path_to_error::Path, scene: &Value) -> Vec<Step> {
    let mut steps = Vec::new();
    let mut node = Some(scene);
    for step in steps_before(path) {
        node = node.and_then(|node| child(node, &step));
        if node.is_none() {
            break;
        }
        steps.push(step);
    }
    steps
}

/// The steps of a path as serde tracked it, up to the first that it does not know.
pub fn steps_before(path: &serde_path_to_error::Path) -> Vec<Step> {
    use serde_path_to_error::Segment;
    let step = |segment: &Segment| match segment {
        Segment::Seq { index } => Some(Step::Index(*index)),
        Segment::Map { key } | Segment::Enum { variant: key } => Some(Step::Key(key.clone())),
        Segment::Unknown => None,
    };
    path.iter().map_while(step).collect()
}

/// The scene's first fault: where it lies, and serde's message for it.
pub fn first_fault(scene: &Value) -> Option<(Vec<Step>, String)> {
    let error = serde_path_to_error::deserialize::<_, SceneDesc>(scene).err()?;
    let mut steps = steps_of(error.path(), scene);
    let message = refine(scene, &mut steps)?;
    Some((steps, message))
}

/// A scene of nothing but the part that `steps` lead to, and where it lies there: cheap to read again.
pub fn part_alone(scene: &Value, steps: &[Step]) -> Option<(Value, Vec<Step>)> {
    let mut trial = node_at(scene, steps)?.clone();
    for step in steps.iter().rev() {
        trial = match step {
            Step::Key(key) => Value::Object([(key.clone(), trial)].into_iter().collect()),
            Step::Index(_) => Value::Array(vec![trial]),
        };
    }
    if let (Value::Object(root), Some(Step::Key(_))) = (&mut trial, steps.first()) {
        root.entry("camera").or_insert_with(|| Value::Object(serde_json::Map::new()));
    }
    let at = steps.iter().map(|step| if let Step::Index(_) = step { Step::Index(0) } else { step.clone() }).collect();
    Some((trial, at))
}

/// Follows the fault that lies within `steps` further inward; gives serde's message for it, if it still has one.
pub fn refine(scene: &Value, steps: &mut Vec<Step>) -> Option<String> {
    let (mut trial, mut at) = part_alone(scene, steps)?;
    let message = fault(&trial)?;
    while let Some(step) = culprit(&mut trial, &at, &message) {
        at.push(step.clone());
        steps.push(step);
    }
    Some(message)
}

fn fault(scene: &Value) -> Option<String> {
    SceneDesc::deserialize(scene).err().map(|e| e.to_string())
}

/// The child of the value at `at` without which the scene's fault is another, or none.
fn culprit(scene: &mut Value, at: &[Step], message: &str) -> Option<Step> {
    match follow(scene, at)? {
        Value::Object(map) => {
            // Without its type a value cannot be checked, so the type comes last, and only if it is the word in
            // question.
            let is_type = |key: &str| key == "type";
            let mut keys: Vec<String> = map.keys().filter(|key| !is_type(key)).cloned().collect();
            let type_is_wrong =
                map.get("type").is_some_and(|t| t.as_str().is_none_or(|t| message.contains(&format!("variant `{t}`"))));
            keys.extend(type_is_wrong.then(|| "type".to_owned()));
            keys.into_iter().map(Step::Key).find(|step| {
                let Step::Key(key) = step else { return false };
                let Some(Value::Object(map)) = follow(scene, at) else { return false };
                let Some(taken) = map.remove(key) else { return false };
                let changed = fault(scene);
                let is_needed = message.starts_with("missing field")
                    && changed.as_ref().is_some_and(|changed| *changed == format!("missing field `{key}`"));
                let changes = !is_needed && changed.as_deref() != Some(message);
                if let Some(Value::Object(map)) = follow(scene, at) {
                    map.insert(key.clone(), taken);
                }
                changes
            })
        }
        Value::Array(list)
            if ["invalid type", "invalid value", "invalid length", "unknown", "missing"]
                .iter()
                .any(|start| message.starts_with(start)) =>
        {
            // The shortest beginning of the list that has the fault ends with its cause; it is not the empty one.
            let list_length = list.len();
            let (mut low, mut high) = (0, list_length);
            while low < high {
                let middle = low.midpoint(high);
                if beginning_fault(scene, at, middle).as_deref() == Some(message) {
                    high = middle;
                } else {
                    low = middle + 1;
                }
            }
            // A list that is itself of the wrong length has another length without its end.
            let last = low.checked_sub(1)?;
            let without = beginning_fault(scene, at, last).and_then(|message| length_fault(&message));
            let is_own = length_fault(message).is_some()
                && (length_fault(message) == Some(list_length) && without == Some(last)
                    || !matches!(node_at(scene, at)?.get(last), Some(Value::Array(_) | Value::Object(_))));
            (!is_own).then_some(Step::Index(last))
        }
        _ => None,
    }
}

/// The length that the message calls wrong.
fn length_fault(message: &str) -> Option<usize> {
    message.strip_prefix("invalid length ")?.split(',').next()?.parse().ok()
}

/// The scene's fault with no more than the first `length` entries of the list at `at`.
fn beginning_fault(scene: &mut Value, at: &[Step], length: usize) -> Option<String> {
    let Some(Value::Array(list)) = follow(scene, at) else { return None };
    let mut rest = list.split_off(length);
    let found = fault(scene);
    if let Some(Value::Array(list)) = follow(scene, at) {
        list.append(&mut rest);
    }
    found
}

fn child<'a>(node: &'a Value, step: &Step) -> Option<&'a Value> {
    match step {
        Step::Key(key) => node.get(key),
        Step::Index(index) => node.get(index),
    }
}

/// What the steps lead to.
pub fn node_at<'a>(scene: &'a Value, steps: &[Step]) -> Option<&'a Value> {
    steps.iter().try_fold(scene, child)
}

/// As [`node_at`], to be changed.
pub fn follow<'a>(scene: &'a mut Value, steps: &[Step]) -> Option<&'a mut Value> {
    steps.iter().try_fold(scene, |node, step| match step {
        Step::Key(key) => node.get_mut(key),
        Step::Index(index) => node.get_mut(index),
    })
}

/// Byte offset of what `steps` lead to in valid JSON: the last key, or the value.
pub fn locate(text: &str, steps: &[Step], at_key: bool) -> Option<usize> {
    let mut scanner = Scanner { bytes: text.as_bytes(), at: 0 };
    for (i, step) in steps.iter().enumerate() {
        scanner.space();
        match step {
            Step::Key(key) => loop {
                scanner.at += 1;
                scanner.space();
                let start = scanner.at;
                scanner.value()?;
                let found = serde_json::from_str::<String>(text.get(start..scanner.at)?).ok()? == *key;
                if found && at_key && i + 1 == steps.len() {
                    return Some(start);
                }
                scanner.space();
                scanner.at += 1;
                scanner.space();
                if found {
                    break;
                }
                scanner.value()?;
                scanner.space();
            },
            Step::Index(index) => {
                for _ in 0..*index {
                    scanner.at += 1;
                    scanner.space();
                    scanner.value()?;
                    scanner.space();
                }
                scanner.at += 1;
            }
        }
    }
    scanner.space();
    (scanner.at < text.len()).then_some(scanner.at)
}

/// Walks over valid JSON without recursion.
struct Scanner<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl Scanner<'_> {
    fn space(&mut self) {
        while self.bytes.get(self.at).is_some_and(u8::is_ascii_whitespace) {
            self.at += 1;
        }
    }

    /// Steps over one value.
    fn value(&mut self) -> Option<()> {
        let mut depth = 0usize;
        loop {
            match self.bytes.get(self.at)? {
                b'"' => self.string()?,
                b'{' | b'[' => {
                    depth += 1;
                    self.at += 1;
                }
                b'}' | b']' => {
                    depth = depth.checked_sub(1)?;
                    self.at += 1;
                }
                b',' | b':' => self.at += 1,
                byte if byte.is_ascii_whitespace() => self.at += 1,
                _ => {
                    while self.bytes.get(self.at).is_some_and(|b| !b",:]}".contains(b) && !b.is_ascii_whitespace()) {
                        self.at += 1;
                    }
                }
            }
            if depth == 0 {
                return Some(());
            }
        }
    }

    fn string(&mut self) -> Option<()> {
        self.at += 1;
        loop {
            match self.bytes.get(self.at)? {
                b'"' => break,
                b'\\' => self.at += 2,
                _ => self.at += 1,
            }
        }
        self.at += 1;
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_found_in_the_text() {
        let text = r#" { "a\"": [1, {"x": "}]"}, [ ]], "b" : { "c": true, "d": -1e5 } } "#;
        let at = |steps: &[Step], at_key| locate(text, steps, at_key).map(|i| &text[i..=i]);
        let key = |k: &str| Step::Key(k.into());
        assert_eq!(at(&[], false), Some("{"));
        assert_eq!(at(&[key("a\""), Step::Index(1), key("x")], false), Some("\""));
        assert_eq!(at(&[key("a\""), Step::Index(2)], false), Some("["));
        assert_eq!(at(&[key("b"), key("d")], false), Some("-"));
        assert_eq!(locate(text, &[key("b"), key("d")], true), text.find("\"d\""));
        assert_eq!(locate(text, &[key("b"), key("e")], false), None);
        assert_eq!(locate(text, &[key("a\""), Step::Index(9)], false), None);
    }

    #[test]
    fn paths_read_as_in_code() {
        assert_eq!(
            path_text(&[Step::Key("shapes".into()), Step::Index(3), Step::Key("radius".into())]),
            "shapes[3].radius"
        );
    }
}
