//! Parameter lists: `"rgb reflectance" [ 0.5 0.5 0.5 ] "float roughness" 0.1`.

use std::cell::RefCell;
use std::path::PathBuf;

use super::tokens::{Lexer, Position, Token, TokenKind};
use crate::error::{Error, Result};
use crate::import::foreign::Draft;
use crate::import::foreign::report::Outcome;

/// No directive has a tenth of them.
const MAX_PARAMS: usize = 256;

/// Numbers, or text.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// Numbers.
    Numbers(Vec<f64>),
    /// Strings.
    Strings(Vec<String>),
    /// `true` and `false`.
    Bools(Vec<bool>),
}

/// A parameter.
#[derive(Clone, Debug)]
pub struct Param {
    /// Such as `float`, `rgb` or `texture`.
    pub kind: String,
    /// Such as `roughness`.
    pub name: String,
    /// What it is given.
    pub values: Values,
    file: PathBuf,
    at: Position,
    /// What became of it, once it has been read.
    outcome: RefCell<Option<(Outcome, String)>>,
}

impl Param {
    /// An error about the parameter.
    pub fn error(&self, message: impl std::fmt::Display) -> Error {
        let message = format!("\"{} {}\": {message}", self.kind, self.name);
        Error::Parse { file: self.file.clone(), line: self.at.line as usize, column: self.at.column as usize, message }
    }

    fn numbers(&self) -> Result<&[f64]> {
        match &self.values {
            Values::Numbers(numbers) => Ok(numbers),
            _ => Err(self.error("needs numbers")),
        }
    }

    fn settle(&self, outcome: Outcome, note: String) {
        let mut old = self.outcome.borrow_mut();
        if old.as_ref().is_none_or(|(old, _)| *old < outcome) {
            *old = Some((outcome, note));
        }
    }
}

/// The parameters of a directive.
#[derive(Clone, Debug)]
pub struct Params {
    list: Vec<Param>,
    /// Where the directive stands, for reports.
    pub place: String,
    /// The directive and its type, for reports, such as `Shape sphere`.
    pub element: String,
    file: PathBuf,
    at: Position,
}

impl Params {
    /// All values that are text, some of which may be names of files.
    pub fn strings(&self) -> impl Iterator<Item = &String> {
        self.list
            .iter()
            .filter_map(|param| if let Values::Strings(texts) = &param.values { Some(texts) } else { None })
            .flatten()
    }

    /// No parameters, for a directive at a place.
    pub fn none(lexer: &Lexer, at: Position, element: String) -> Self {
        Self { list: Vec::new(), place: lexer.place(at), element, file: lexer.file.clone(), at }
    }

    /// Reads all that follow.
    pub fn read(lexer: &mut Lexer, at: Position, element: String) -> Result<Self> {
        let mut params = Self::none(lexer, at, element);
        while let Some(token) = lexer.peek()?.filter(|token| token.kind == TokenKind::Quoted) {
            lexer.take()?;
            let declaration = lexer.string(&token);
            let mut words = declaration.split_ascii_whitespace();
            let (Some(kind), Some(name), None) = (words.next(), words.next(), words.next()) else {
                return Err(lexer
                    .error(token.at, format!("expected a parameter such as \"float radius\", not \"{declaration}\"")));
            };
            if params.list.iter().any(|param| param.name == name) {
                return Err(lexer.error(token.at, format!("\"{declaration}\": the parameter is given twice")));
            }
            if params.list.len() == MAX_PARAMS {
                return Err(lexer.error(token.at, format!("more than {MAX_PARAMS} parameters")));
            }
            let values = read_values(lexer, &token, kind)?;
            let (kind, name) = (kind.to_owned(), name.to_owned());
            params.list.push(Param {
                kind,
                name,
                values,
                file: lexer.file.clone(),
                at: token.at,
                outcome: RefCell::default(),
            });
        }
        Ok(params)
    }

    /// Adds those of `defaults` that are not given.
    pub fn with_defaults(mut self, defaults: &[Param]) -> Self {
        for param in defaults {
            if !self.list.iter().any(|own| own.name == param.name) {
                self.list.push(Param { outcome: RefCell::default(), ..param.clone() });
            }
        }
        self
    }

    /// The parameters alone.
    pub fn into_list(self) -> Vec<Param> {
        self.list
    }

    /// An error about the directive.
    pub fn error(&self, message: impl std::fmt::Display) -> Error {
        let message = format!("{}: {message}", self.element);
        Error::Parse { file: self.file.clone(), line: self.at.line as usize, column: self.at.column as usize, message }
    }

    /// A parameter, which from then on counts as mapped.
    pub fn get(&self, name: &str) -> Option<&Param> {
        let param = self.list.iter().find(|param| param.name == name)?;
        param.settle(Outcome::Mapped, String::new());
        Some(param)
    }

    /// Whether a parameter is given; without marking it as used.
    pub fn has(&self, name: &str) -> bool {
        self.list.iter().any(|param| param.name == name)
    }

    /// Whether any parameter names a texture.
    pub fn names_textures(&self) -> bool {
        self.list.iter().any(|param| param.kind == "texture")
    }

    /// One finite number.
    pub fn number(&self, name: &str) -> Result<Option<f64>> {
        let Some(param) = self.get(name) else { return Ok(None) };
        match param.numbers()? {
            [x] if x.is_finite() => Ok(Some(*x)),
            [x] => Err(param.error(format!("{x} is not a finite number"))),
            other => Err(param.error(format!("needs one number, not {}", other.len()))),
        }
    }

    /// One finite number, or the default.
    pub fn number_or(&self, name: &str, default: f64) -> Result<f64> {
        Ok(self.number(name)?.unwrap_or(default))
    }

    /// One number above 0, or the default.
    pub fn positive_or(&self, name: &str, default: f64) -> Result<f64> {
        match (self.number(name)?, self.get(name)) {
            (Some(x), Some(param)) if x <= 0.0 => Err(param.error(format!("must be above 0, not {x}"))),
            (x, _) => Ok(x.unwrap_or(default)),
        }
    }

    /// One whole number, or the default.
    pub fn integer_or(&self, name: &str, default: i64) -> Result<i64> {
        Ok(self.number(name)?.map_or(default, |x| x as i64))
    }

    /// A fixed number of finite numbers.
    pub fn array<const N: usize>(&self, name: &str) -> Result<Option<[f64; N]>> {
        let Some(param) = self.get(name) else { return Ok(None) };
        let numbers = param.numbers()?;
        match <[f64; N]>::try_from(numbers) {
            Ok(array) if array.iter().all(|x| x.is_finite()) => Ok(Some(array)),
            Ok(_) => Err(param.error("needs finite numbers")),
            Err(_) => Err(param.error(format!("needs {N} numbers, not {}", numbers.len()))),
        }
    }

    /// Numbers in groups of `N`, as floats.
    pub fn groups<const N: usize>(&self, name: &str) -> Result<Option<Vec<[f32; N]>>> {
        Ok(self
            .wide_groups(name)?
            .map(|groups| groups.into_iter().map(|group: [f64; N]| group.map(|x| x as f32)).collect()))
    }

    /// As [`groups`](Self::groups), as the file has them.
    pub fn wide_groups<const N: usize>(&self, name: &str) -> Result<Option<Vec<[f64; N]>>> {
        let Some(param) = self.get(name) else { return Ok(None) };
        let (groups, rest) = param.numbers()?.as_chunks::<N>();
        if !rest.is_empty() {
            return Err(param.error(format!("needs groups of {N} numbers, and {} are left over", rest.len())));
        }
        Ok(Some(groups.to_vec()))
    }

    /// Indices of vertices in groups of `N`, each below `count`.
    pub fn indices<const N: usize>(&self, name: &str, count: usize) -> Result<Option<Vec<[u32; N]>>> {
        let Some(param) = self.get(name) else { return Ok(None) };
        let (groups, rest) = param.numbers()?.as_chunks::<N>();
        if !rest.is_empty() {
            return Err(param.error(format!("needs groups of {N} indices, and {} are left over", rest.len())));
        }
        let is_index = |x: f64| x >= 0.0 && x < count as f64 && x.fract() == 0.0;
        if let Some(x) = groups.as_flattened().iter().find(|&&x| !is_index(x)) {
            return Err(param.error(format!("the index {x} is not that of one of {count} vertices")));
        }
        Ok(Some(groups.iter().map(|group| group.map(|x| x as u32)).collect()))
    }

    /// `true` or `false`, or the default.
    pub fn bool_or(&self, name: &str, default: bool) -> Result<bool> {
        let Some(param) = self.get(name) else { return Ok(default) };
        match &param.values {
            Values::Bools(values) if values.len() == 1 => Ok(values[0]),
            _ => Err(param.error("needs true or false")),
        }
    }

    /// One string.
    pub fn string(&self, name: &str) -> Result<Option<&str>> {
        let Some(param) = self.get(name) else { return Ok(None) };
        match &param.values {
            Values::Strings(values) if values.len() == 1 => Ok(Some(&values[0])),
            _ => Err(param.error("needs one string")),
        }
    }

    /// Reports a parameter as mapped, with a note, if it is given.
    pub fn map_as(&self, name: &str, how: impl Into<String>) {
        if let Some(param) = self.list.iter().find(|param| param.name == name) {
            param.settle(Outcome::Mapped, how.into());
        }
    }

    /// Reports that a parameter, if it is given, was approximated.
    pub fn approximate(&self, name: &str, how: impl Into<String>) {
        if let Some(param) = self.get(name) {
            param.settle(Outcome::Approximated, how.into());
        }
    }

    /// Reports that a parameter, if it is given, was ignored.
    pub fn ignore(&self, name: &str, why: impl Into<String>) {
        if let Some(param) = self.get(name) {
            param.settle(Outcome::Ignored, why.into());
        }
    }

    /// Reports the outcome of each to the draft; those that were never read are unsupported.
    pub fn report(&self, draft: &mut Draft) {
        for param in &self.list {
            match param.outcome.borrow().as_ref() {
                Some((outcome, note)) => draft.note(&self.place, &self.element, &param.name, *outcome, note.clone()),
                None => draft.ignored(&self.place, &self.element, &param.name, "not known here"),
            }
        }
        if self.list.is_empty() {
            draft.mapped(&self.place, &self.element, "");
        }
    }
}

fn read_values(lexer: &mut Lexer, declaration: &Token, kind: &str) -> Result<Values> {
    let mut values = match kind {
        "string" | "texture" => Values::Strings(Vec::new()),
        "bool" => Values::Bools(Vec::new()),
        // Of a spectrum: numbers, or the name of one, depending on the first value.
        "spectrum" | "integer" | "float" | "point2" | "point3" | "point" | "vector2" | "vector3" | "vector"
        | "normal" | "normal3" | "rgb" | "blackbody" => Values::Numbers(Vec::new()),
        _ => return Err(lexer.error(declaration.at, format!("unknown type of parameters \"{kind}\""))),
    };
    let open = lexer.peek()?.is_some_and(|token| token.kind == TokenKind::Open);
    if open {
        lexer.take()?;
    }
    loop {
        let Some(token) = lexer.take()? else {
            return Err(lexer.error(declaration.at, "the file ends within a parameter"));
        };
        if open && token.kind == TokenKind::Close {
            break;
        }
        if kind == "spectrum" && token.kind == TokenKind::Quoted && values == Values::Numbers(Vec::new()) {
            values = Values::Strings(Vec::new());
        }
        push_value(lexer, &token, &mut values)?;
        if !open {
            break;
        }
    }
    Ok(values)
}

fn push_value(lexer: &Lexer, token: &Token, values: &mut Values) -> Result<()> {
    let text = lexer.text(token);
    match (values, token.kind) {
        (Values::Numbers(numbers), TokenKind::Word) => match text.parse::<f64>() {
            Ok(number) => numbers.push(number),
            Err(_) => return Err(lexer.error(token.at, format!("expected a number, not {text}"))),
        },
        (Values::Strings(strings), TokenKind::Quoted) => strings.push(lexer.string(token)),
        (Values::Bools(bools), TokenKind::Word | TokenKind::Quoted) => match text {
            "true" => bools.push(true),
            "false" => bools.push(false),
            _ => return Err(lexer.error(token.at, format!("expected true or false, not {text}"))),
        },
        (Values::Numbers(_), _) => return Err(lexer.error(token.at, format!("expected a number, not \"{text}\""))),
        (Values::Strings(_), _) => {
            return Err(lexer.error(token.at, format!("expected a string in quotes, not {text}")));
        }
        (Values::Bools(_), _) => return Err(lexer.error(token.at, format!("expected true or false, not {text}"))),
    }
    Ok(())
}
