//! Comments in scene files: `//` to the end of the line and `/* */`, outside of strings.

/// The text with every comment replaced by spaces; line breaks stay, so that positions in messages are right.
pub fn blank_comments(text: &str) -> String {
    let mut out = Vec::with_capacity(text.len());
    let bytes = text.as_bytes();
    let mut state = State::Code;
    let mut i = 0;
    while i < bytes.len() {
        let (byte, next) = (bytes[i], bytes.get(i + 1));
        match state {
            State::Code if byte == b'/' && next == Some(&b'/') => state = State::Line,
            State::Code if byte == b'/' && next == Some(&b'*') => {
                out.extend(b"  ");
                i += 2;
                state = State::Block;
                continue;
            }
            State::Code if byte == b'"' => state = State::Text,
            State::Text if byte == b'\\' => {
                out.push(byte);
                if let Some(&escaped) = next {
                    out.push(escaped);
                }
                i += 2;
                continue;
            }
            State::Text if byte == b'"' => state = State::Code,
            State::Line if byte == b'\n' => state = State::Code,
            State::Block if byte == b'*' && next == Some(&b'/') => {
                out.extend(b"  ");
                i += 2;
                state = State::Code;
                continue;
            }
            _ => {}
        }
        let blank = matches!(state, State::Line | State::Block) && byte != b'\n';
        out.push(if blank { b' ' } else { byte });
        i += 1;
    }
    // Only whole comments were replaced, by ASCII, so this is still UTF-8.
    String::from_utf8(out).unwrap_or_default()
}

#[derive(Clone, Copy, PartialEq)]
enum State {
    Code,
    Text,
    Line,
    Block,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_become_blanks_and_positions_stay() {
        let text = "{ // one é\n \"a\": \"// no\", /* two\n three */ \"b\\\"/*\": 1 }";
        let blank = blank_comments(text);
        assert_eq!(blank.lines().count(), text.lines().count());
        let value: serde_json::Value = serde_json::from_str(&blank).unwrap();
        assert_eq!(value["a"], "// no");
        assert_eq!(value["b\"/*"], 1);
    }

    #[test]
    fn an_open_comment_or_string_ends_with_the_text() {
        for text in ["/* open", "\"open \\", "//", "/", "\"\\"] {
            assert!(blank_comments(text).len() <= text.len());
        }
    }
}
