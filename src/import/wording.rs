//! Messages of the JSON parser in the words of those who write scenes.

use serde_json::Value;

use super::fault::{Step, node_at};
use super::faults::SceneFault;
use crate::suggestion::{did_you_mean, elsewhere, nearest};

/// What is wrong, for a fault of a scene that is valid JSON.
pub fn describe(fault: &SceneFault, scene: &Value) -> String {
    let message = fault.message.as_str();
    let key = fault.steps.last().and_then(|step| if let Step::Key(key) = step { Some(key.as_str()) } else { None });
    let node = node_at(scene, &fault.steps);
    if let Some(rest) = message.strip_prefix("missing field ") {
        return format!("{rest} is missing");
    }
    if message.starts_with("unknown field") {
        return unknown("key", message);
    }
    if message.starts_with("unknown variant") {
        let is_value = node.is_some_and(Value::is_string);
        return unknown(
            if !is_value {
                "key"
            } else if key == Some("type") {
                "type"
            } else {
                "value"
            },
            message,
        );
    }
    if let Some(length) = message.strip_prefix("invalid length ") {
        let numbers = node.and_then(Value::as_array).map_or(Vec::new(), Clone::clone);
        let given: Option<usize> = length.split(',').next().and_then(|number| number.parse().ok());
        let expected = fault.length.or_else(|| length.rsplit("array of length ").next()?.parse().ok());
        if let (Some(expected), Some(given)) = (expected, given) {
            let given = if expected < given { numbers.len() } else { given };
            let entries = entries(expected, &numbers);
            return format!("expected a list of {entries}, found {}", count(given));
        }
    }
    let expected = message.rsplit_once(", expected ").map(|(_, expected)| expected);
    // Of several forms of a value, the place may be a key that belongs to none.
    let has_one_form = !message.starts_with("expected ");
    let node = node.filter(|node| has_one_form || node.is_string() || node.is_boolean());
    match (expected.or_else(|| message.strip_prefix("expected ")), node) {
        (Some("map with a single key" | "1 element in map"), _) => {
            "one entry has one key: write a list such as [{ \"scale\": 2 }, { \"translate\": [0, 1, 0] }]".to_owned()
        }
        (Some(expected), Some(node)) => format!("expected {}, found {}", kind_named(expected), kind_of(node)),
        _ => message.to_owned(),
    }
}

/// What is wrong with the value of a key, for the parser's message about it.
pub fn describe_value(key: &str, value: &Value, message: String) -> String {
    let fault = SceneFault { steps: vec![Step::Key(key.to_owned())], message, length: None };
    describe(&fault, &serde_json::json!({ key: value }))
}

/// The message about a scene that is another value.
pub fn no_object(scene: &Value) -> String {
    format!("expected an object {{...}}, found {}", kind_of(scene))
}

/// The message about a text that is no JSON, or that a fault keeps from being read as a whole.
pub fn describe_syntax(message: &str) -> String {
    let message = message.rsplit_once(" at line ").map_or(message, |(message, _)| message);
    if message.starts_with("EOF while parsing") {
        return "the file ends too early: a bracket or a quote is not closed".to_owned();
    }
    if let Some(key) = message.strip_prefix("duplicate field ") {
        return format!("{key} is given twice");
    }
    match message {
        "key must be a string" => "a key must stand in double quotes".to_owned(),
        "trailing characters" => {
            "the scene ends before this: there is a bracket too many, or text behind it".to_owned()
        }
        "expected value" => {
            "expected a value: a number, a text in double quotes, true, false, [...] or {...}".to_owned()
        }
        "expected ident" => "expected true, false or null; texts stand in double quotes".to_owned(),
        "recursion limit exceeded" => "brackets are nested too deep".to_owned(),
        _ => message.to_owned(),
    }
}

/// The message about a word that is none of those allowed, which serde's message lists.
fn unknown(what: &str, message: &str) -> String {
    let words = words_of(message);
    let Some((given, allowed)) = words.split_first() else { return message.to_owned() };
    let head = format!("unknown {what} \"{given}\"");
    if allowed.is_empty() {
        return format!("{head}: no keys are allowed here");
    }
    let hint = did_you_mean(given, allowed.iter().copied(), ["\"", "\""]);
    match elsewhere(given) {
        _ if !hint.is_empty() => format!("{head}{hint}"),
        Some(place) => format!("{head}: {place}"),
        None => format!("{head}: use one of {}", allowed.join(", ")),
    }
}

/// The word that is none of those allowed, and those.
fn words_of(message: &str) -> Vec<&str> {
    message.split('`').skip(1).step_by(2).collect()
}

/// The word that the message about an unknown one suggests in its place.
pub fn suggested(message: &str) -> Option<&str> {
    let words = words_of(message);
    let (given, allowed) = words.split_first()?;
    nearest(given, allowed.iter().copied())
}

/// "three numbers" of a list that should have them.
fn entries(count_expected: usize, given: &[Value]) -> String {
    let what = match given.first() {
        Some(Value::String(_)) => ["text", "texts"],
        Some(Value::Array(_)) => ["list", "lists"],
        _ => ["number", "numbers"],
    };
    format!("{} {}", count(count_expected), what[usize::from(count_expected != 1)])
}

fn count(number: usize) -> String {
    let words = ["none", "one", "two", "three", "four", "five", "six"];
    words.get(number).map_or_else(|| number.to_string(), |&word| word.to_owned())
}

/// A kind of value, by serde's name for it.
fn kind_named(expected: &str) -> String {
    if let Some(number) = expected.strip_prefix("an array of length ") {
        return number
            .parse()
            .map_or_else(|_| expected.to_owned(), |n: usize| format!("a list of {}", entries(n, &[])));
    }
    match expected {
        "f32" | "f64" => "a number",
        "u8" | "u16" | "u32" | "u64" | "usize" => "a whole number that is not negative",
        "i8" | "i16" | "i32" | "i64" | "isize" => "a whole number",
        "a string" | "string" => "a text in double quotes",
        "a boolean" | "boolean" => "true or false",
        "a sequence" | "sequence" => "a list",
        "a map" | "map" => "an object {...}",
        "string or map" => "a word or an object {...}",
        _ if expected.ends_with("elements in sequence") || expected.ends_with("element in sequence") => {
            "an object {...}"
        }
        _ if expected.starts_with("struct ") || expected.starts_with("internally tagged enum ") => "an object {...}",
        _ if expected.starts_with("enum ") => "an object {...} with one key",
        _ if expected.starts_with("variant identifier") => "a text in double quotes",
        _ => expected,
    }
    .to_owned()
}

/// What a value is.
fn kind_of(value: &Value) -> String {
    match value {
        Value::Null => "null".to_owned(),
        Value::Bool(value) => value.to_string(),
        Value::Number(number) => number.to_string(),
        Value::String(text) if text.chars().count() <= 40 => format!("the text \"{text}\""),
        Value::String(_) => "a text".to_owned(),
        Value::Array(list) => format!("a list of {}", list.len()),
        Value::Object(_) => "an object {...}".to_owned(),
    }
}
