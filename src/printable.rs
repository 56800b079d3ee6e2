//! Text with names from files of strangers, made fit to be printed.

use std::fmt::Write;

/// The text on one line: line breaks and all other characters that move the cursor, switch colours or turn the
/// direction of writing are written out, as JSON has them.
pub fn line(text: &str) -> String {
    escape(text, false)
}

/// As [`line`](fn@line), but line breaks and tabs stay.
pub fn lines(text: &str) -> String {
    escape(text, true)
}

fn escape(text: &str, breaks_stay: bool) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        let _ = match c {
            '\n' | '\t' if breaks_stay => write!(out, "{c}"),
            '\n' => write!(out, "\\n"),
            '\r' => write!(out, "\\r"),
            '\t' => write!(out, "\\t"),
            c if is_control(c) => write!(out, "\\u{:04x}", u32::from(c)),
            c => write!(out, "{c}"),
        };
    }
    out
}

/// Control characters, ends of lines, and what turns the direction of writing.
fn is_control(c: char) -> bool {
    c.is_control()
        || matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_that_steers_a_terminal_is_left() {
        assert_eq!(line("a\u{1b}[2J\r\nb\tü\u{9b}\u{202e}\u{7f}"), "a\\u001b[2J\\r\\nb\\tü\\u009b\\u202e\\u007f");
        assert_eq!(lines("a\n\tb\u{7}\r"), "a\n\tb\\u0007\\r");
        for c in (0..0x3000).filter_map(char::from_u32) {
            let text = lines(&c.to_string());
            assert!(
                text.chars().all(|c| "\n\t".contains(c) || !is_control(c)) && !line(&text).contains(['\n', '\t']),
                "{c:?}"
            );
        }
        // In JSON the same text is meant.
        let json = serde_json::json!({ "a": "\u{1b}\u{9b}\u{202e}" });
        assert_eq!(serde_json::from_str::<serde_json::Value>(&line(&json.to_string())).unwrap(), json);
    }
}
