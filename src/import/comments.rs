//! What scene files may have beyond JSON: comments, `//` to the end of the line and `/* */`, and a comma behind the
//! last entry of a list or an object.

/// A text that is plain JSON if the scene file is valid.
pub struct Blanked {
    /// The text with every comment, trailing comma and byte order mark replaced by spaces, byte by byte; line breaks
    /// stay, so that positions in messages are right.
    pub text: String,
    /// Where a comment begins that never ends.
    pub open_comment: Option<usize>,
}

/// Replaces comments and trailing commas by spaces.
pub fn blank_comments(text: &str) -> Blanked {
    let mut out = Vec::with_capacity(text.len());
    let bytes = text.as_bytes();
    let mut state = State::Code;
    let mut comment_start = 0;
    let mut commas = LastComma::default();
    let mut i = 0;
    if text.starts_with('\u{feff}') {
        i = '\u{feff}'.len_utf8();
        out.resize(i, b' ');
    }
    while i < bytes.len() {
        let (byte, next) = (bytes[i], bytes.get(i + 1));
        match state {
            State::Code if byte == b'/' && next == Some(&b'/') => state = State::Line,
            State::Code if byte == b'/' && next == Some(&b'*') => {
                out.extend(b"  ");
                comment_start = i;
                i += 2;
                state = State::Block;
                continue;
            }
            State::Code if byte == b'"' => state = State::Text,
            State::Text if byte == b'\\' => {
                commas = LastComma::default();
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
        match state {
            State::Code => commas.next(out.len(), byte).into_iter().for_each(|comma| out[comma] = b' '),
            State::Text => commas = LastComma { at: None, last: b'"' },
            State::Line | State::Block => {}
        }
        let blank = matches!(state, State::Line | State::Block) && byte != b'\n';
        out.push(if blank { b' ' } else { byte });
        i += 1;
    }
    // Only whole comments were replaced, by ASCII, so this is still UTF-8.
    Blanked {
        text: String::from_utf8(out).unwrap_or_default(),
        open_comment: (state == State::Block).then_some(comment_start),
    }
}

/// The comma that nothing but spaces and comments follow so far.
#[derive(Default)]
struct LastComma {
    at: Option<usize>,
    /// The last byte that is no space.
    last: u8,
}

impl LastComma {
    /// Takes the next byte outside of comments, which stands at `index`; gives the place of a comma that it makes a
    /// trailing one.
    fn next(&mut self, index: usize, byte: u8) -> Option<usize> {
        if byte.is_ascii_whitespace() {
            return None;
        }
        let comma = self.at.take();
        // A comma behind nothing is a fault.
        if byte == b',' && !b"[{,:".contains(&self.last) {
            self.at = Some(index);
        }
        self.last = byte;
        comma.filter(|_| matches!(byte, b']' | b'}'))
    }
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
        let blank = blank_comments(text).text;
        assert_eq!(blank.lines().count(), text.lines().count());
        let value: serde_json::Value = serde_json::from_str(&blank).unwrap();
        assert_eq!(value["a"], "// no");
        assert_eq!(value["b\"/*"], 1);
    }

    #[test]
    fn trailing_commas_become_blanks() {
        let text = "{ \"a\": [1, 2, // two\n ], \"b\": \",]\\\",\", \"c\": { \"d\": [[],], } /* end */ , }";
        let blank = blank_comments(text).text;
        assert_eq!(blank.len(), text.len());
        let value: serde_json::Value = serde_json::from_str(&blank).unwrap();
        assert_eq!(value, serde_json::json!({ "a": [1, 2], "b": ",]\",", "c": { "d": [[]] } }));
        for fault in ["[,]", "[1,,]", "{,}", "{\"a\":,}", "[1],"] {
            assert!(serde_json::from_str::<serde_json::Value>(&blank_comments(fault).text).is_err(), "{fault}");
        }
    }

    #[test]
    fn an_open_comment_or_string_ends_with_the_text() {
        for text in ["/* open", "\"open \\", "//", "/", "\"\\"] {
            let blanked = blank_comments(text);
            assert_eq!(blanked.text.len(), text.len(), "{text}");
            assert_eq!(blanked.open_comment, text.starts_with("/*").then_some(0), "{text}");
        }
    }
}
