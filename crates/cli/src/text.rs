//! Results on stdout.

use std::io::{ErrorKind, Write};

use serde_json::Value;
use steradian::internal::farm::message_lines;
use steradian::internal::printable;
use steradian::{Error, Result};

/// Prints a line or several, in which names of strangers steer no terminal and no farm.
pub fn print(text: &str) -> Result<()> {
    print_as_it_is(&message_lines(text))
}

/// Prints text of the program itself. A reader that has gone (such as `head`) is no error.
pub fn print_as_it_is(text: &str) -> Result<()> {
    let mut out = std::io::stdout().lock();
    match writeln!(out, "{text}").and_then(|()| out.flush()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => {
            Err(Error::Output { file: "stdout".into(), message: e.to_string() })
        }
        _ => Ok(()),
    }
}

/// Prints a JSON value.
pub fn print_json(value: &Value) -> Result<()> {
    print(&format!("{value:#}"))
}

/// A number with what it counts: `1 sample`, `2 samples`.
pub fn counted(number: u64, what: &str) -> String {
    format!("{number} {what}{}", if number == 1 { "" } else { "s" })
}

/// A JSON value as aligned lines, nested objects indented.
pub fn outline(value: &Value) -> String {
    let mut lines = Vec::new();
    add_lines(value, 0, &mut lines);
    lines.join("\n")
}

fn add_lines(value: &Value, depth: usize, lines: &mut Vec<String>) {
    let Value::Object(map) = value else {
        lines.push(inline(value));
        return;
    };
    let width = map.keys().map(|key| key.chars().count()).max().unwrap_or(0);
    let indent = "  ".repeat(depth);
    for (key, value) in map {
        let label = printable::line(&key.replace('_', " "));
        if value.as_object().is_some_and(|inner| !inner.is_empty()) {
            lines.push(format!("{indent}{label}"));
            add_lines(value, depth + 1, lines);
        } else {
            lines.push(format!("{indent}{label:width$}  {}", inline(value)));
        }
    }
}

fn inline(value: &Value) -> String {
    match value {
        Value::Null => "-".to_owned(),
        Value::String(text) => printable::line(text),
        Value::Array(items) => items.iter().map(inline).collect::<Vec<_>>().join(" "),
        Value::Bool(true) => "yes".to_owned(),
        Value::Bool(false) => "no".to_owned(),
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn one_is_no_plural() {
        assert_eq!([0, 1, 2].map(|n| counted(n, "sample")), ["0 samples", "1 sample", "2 samples"]);
    }

    #[test]
    fn values_are_aligned_and_nested_ones_indented() {
        assert_eq!(outline(&json!({ "a\n": "b\n\u{1b}" })), "a\\n  b\\n\\u001b");
        let value = json!({ "a": 1, "long_name": [1, 2], "inner": { "b": true, "c": null } });
        assert_eq!(outline(&value), "a          1\ninner\n  b  yes\n  c  -\nlong name  1 2");
    }
}
