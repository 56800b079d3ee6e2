//! Tokens of the scene language: words and numbers, quoted strings, brackets; `#` begins a comment.

use std::path::PathBuf;

use crate::error::Error;

/// A place in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Position {
    /// From 1.
    pub line: u32,
    /// From 1, in bytes.
    pub column: u32,
}

/// What a token is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TokenKind {
    /// A directive, a number, `true` or `false`.
    Word,
    /// A string, without its quotes.
    Quoted,
    /// `[`
    Open,
    /// `]`
    Close,
}

/// A token: bytes of its file.
#[derive(Clone, Copy, Debug)]
pub struct Token {
    /// What it is.
    pub kind: TokenKind,
    /// Where it begins.
    pub at: Position,
    start: usize,
    end: usize,
}

/// One file while it is read.
#[derive(Clone, Debug)]
pub struct Lexer {
    /// The file.
    pub file: PathBuf,
    /// Its name in messages.
    pub name: String,
    bytes: Vec<u8>,
    next: usize,
    at: Position,
    waiting: Option<Token>,
}

impl Lexer {
    /// Begins to read a file's bytes.
    pub fn new(file: PathBuf, bytes: Vec<u8>) -> Self {
        let name =
            file.file_name().map_or_else(|| file.display().to_string(), |name| name.to_string_lossy().into_owned());
        Self {
            file,
            name,
            bytes: crate::file::without_mark(bytes),
            next: 0,
            at: Position { line: 1, column: 1 },
            waiting: None,
        }
    }

    /// The text of a token.
    pub fn text(&self, token: &Token) -> &str {
        self.bytes.get(token.start..token.end).and_then(|bytes| std::str::from_utf8(bytes).ok()).unwrap_or_default()
    }

    /// A quoted string with its escapes resolved.
    pub fn string(&self, token: &Token) -> String {
        let text = self.text(token);
        if !text.contains('\\') {
            return text.into();
        }
        let mut out = String::with_capacity(text.len());
        let mut chars = text.chars();
        while let Some(c) = chars.next() {
            out.push(match (c, if c == '\\' { chars.next() } else { None }) {
                ('\\', Some('n')) => '\n',
                ('\\', Some('t')) => '\t',
                ('\\', Some('r')) => '\r',
                ('\\', Some('b')) => '\u{8}',
                ('\\', Some('f')) => '\u{c}',
                ('\\', Some(other)) => other,
                (other, _) => other,
            });
        }
        out
    }

    /// An error at a place of the file.
    pub fn error(&self, at: Position, message: impl Into<String>) -> Error {
        Error::Parse {
            file: self.file.clone(),
            line: at.line as usize,
            column: at.column as usize,
            message: message.into(),
        }
    }

    /// A place of the file for reports.
    pub fn place(&self, at: Position) -> String {
        format!("{}:{}:{}", self.name, at.line, at.column)
    }

    /// Where reading has come to.
    pub fn position(&self) -> Position {
        self.waiting.map_or(self.at, |token| token.at)
    }

    /// The next token without taking it.
    pub fn peek(&mut self) -> Result<Option<Token>, Error> {
        if self.waiting.is_none() {
            self.waiting = self.scan()?;
        }
        Ok(self.waiting)
    }

    /// Takes the next token.
    pub fn take(&mut self) -> Result<Option<Token>, Error> {
        match self.waiting.take() {
            Some(token) => Ok(Some(token)),
            None => self.scan(),
        }
    }

    fn advance(&mut self) {
        if self.bytes.get(self.next) == Some(&b'\n') {
            self.at = Position { line: self.at.line.saturating_add(1), column: 1 };
        } else {
            self.at.column = self.at.column.saturating_add(1);
        }
        self.next += 1;
    }

    fn scan(&mut self) -> Result<Option<Token>, Error> {
        let mut is_comment = false;
        while let Some(&c) = self.bytes.get(self.next) {
            match c {
                b'\n' => is_comment = false,
                b'#' => is_comment = true,
                _ if is_comment || c.is_ascii_whitespace() => {}
                _ => break,
            }
            self.advance();
        }
        let (start, at) = (self.next, self.at);
        let Some(&first) = self.bytes.get(start) else { return Ok(None) };
        let (kind, range) = match first {
            b'[' | b']' => {
                self.advance();
                (if first == b'[' { TokenKind::Open } else { TokenKind::Close }, start..start + 1)
            }
            b'"' => {
                self.advance();
                loop {
                    match self.bytes.get(self.next) {
                        Some(b'"') => break,
                        Some(b'\\') => self.advance(),
                        Some(b'\n') | None => return Err(self.error(at, "the string has no end on its line")),
                        Some(_) => {}
                    }
                    self.advance();
                }
                self.advance();
                (TokenKind::Quoted, start + 1..self.next - 1)
            }
            _ => {
                while self.bytes.get(self.next).is_some_and(|c| !c.is_ascii_whitespace() && !b"[]\"#".contains(c)) {
                    self.advance();
                }
                (TokenKind::Word, start..self.next)
            }
        };
        let token = Token { kind, at, start: range.start, end: range.end };
        if std::str::from_utf8(self.bytes.get(range).unwrap_or_default()).is_err() {
            return Err(self.error(at, "not UTF-8 text"));
        }
        Ok(Some(token))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(text: &str) -> Vec<(TokenKind, String, u32, u32)> {
        let mut lexer = Lexer::new("s.pbrt".into(), text.into());
        let mut tokens = Vec::new();
        while let Some(token) = lexer.take().unwrap() {
            tokens.push((token.kind, lexer.string(&token), token.at.line, token.at.column));
        }
        tokens
    }

    #[test]
    fn tokens_have_kinds_and_places() {
        let tokens = all("Shape \"sph ere\" # [ a \" comment\n \"float r\"[1 -2e3]\n\"a\\\"b\\\\\"");
        let texts: Vec<&str> = tokens.iter().map(|(_, text, ..)| text.as_str()).collect();
        assert_eq!(texts, ["Shape", "sph ere", "float r", "[", "1", "-2e3", "]", "a\"b\\"]);
        assert_eq!(tokens[2], (TokenKind::Quoted, "float r".into(), 2, 2));
        assert_eq!(tokens[3], (TokenKind::Open, "[".into(), 2, 11));
    }

    #[test]
    fn strings_without_end_and_other_bytes_are_errors() {
        for bytes in [&b"\"abc"[..], b"\"ab\nc\"", b"\"abc\\", b"\"\\\"", b"\xff\xfe", b"\"\xff\""] {
            let mut lexer = Lexer::new("s.pbrt".into(), bytes.to_vec());
            assert!(lexer.take().is_err(), "{bytes:?}");
        }
    }
}
