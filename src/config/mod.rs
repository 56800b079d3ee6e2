//! Configuration files: `steradian.toml` of a project and `config.toml` of a user, whose keys are the options of
//! `render`. Whether there is such an option, and whether it takes the value, the command line's definition decides.

mod trust;

pub use trust::{Trust, options, trust};

use std::io::Read;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use toml::Spanned;
use toml::de::{DeString, DeTable, DeValue};

use crate::error::{Error, Result};
use crate::file;

/// What environment variables begin with whose names are those of options.
pub const PREFIX: &str = "STERADIAN_";

/// Root's number: who can write such a file can do anything.
const ROOT: u32 = 0;

/// The project's file, in the scene's folder.
const PROJECT: &str = "steradian.toml";

/// No configuration is longer, in bytes.
const MAX_LENGTH: u64 = 1 << 20;

/// Options of which a value is `KEY=VALUE`: files may have a table of them.
const TABLES: [&str; 2] = ["define", "exr"];

/// The value of an option, by a variable or a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Words {
    /// A word or a number.
    One(String),
    /// A list.
    Many(Vec<String>),
    /// Yes or no.
    Switch(bool),
}

/// A line of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry {
    /// The option's name without its dashes.
    pub key: String,
    /// Its value.
    pub words: Words,
    /// The line, from 1.
    pub line: usize,
}

/// The files for a scene that exist, the stronger first, with what they may set.
pub fn for_scene(scene: &Path) -> Vec<(PathBuf, Trust)> {
    let project = scene.parent().map(|folder| (folder.join(PROJECT), Trust::Project));
    let user = user_file().map(|file| (file, Trust::User));
    project.into_iter().chain(user).filter(|(file, _)| file.is_file()).collect()
}

/// The user's own file, whether it exists or not.
fn user_file() -> Option<PathBuf> {
    let variable = |name: &str| std::env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let folder = variable("XDG_CONFIG_HOME").or_else(|| variable("HOME").map(|home| home.join(".config")));
    folder.map(|folder| folder.join("steradian").join("config.toml"))
}

/// The entries of a file by their lines, for a process of `user`; a warning if the file belongs to somebody else, who
/// is neither the user nor root: it is not read.
///
/// # Errors
/// [`Error::Usage`] with file and line for what is no TOML, no value of an option, or not for such a file to set.
pub fn read(file: &Path, trust: Trust, user: u32) -> Result<Result<Vec<Entry>, String>> {
    let fault = |message: String| Error::Usage(format!("{}: {message}", file.display()));
    let opened = file::open(file).map_err(|e| fault(e.to_string()))?;
    // That of the open file: the name may belong to another one meanwhile.
    let owner = opened.get_ref().metadata().map_err(|e| fault(e.to_string()))?.uid();
    if owner != user && owner != ROOT {
        return Ok(Err(format!("{} belongs to another user (uid {owner}): it is not read", file.display())));
    }
    let mut bytes = Vec::new();
    opened.take(MAX_LENGTH + 1).read_to_end(&mut bytes).map_err(|e| fault(e.to_string()))?;
    if bytes.len() as u64 > MAX_LENGTH {
        return Err(fault(format!("longer than {MAX_LENGTH} bytes")));
    }
    let text = String::from_utf8(file::without_mark(bytes)).map_err(|_| fault("the file is not UTF-8".to_owned()))?;
    parse(file, trust, &text).map(Ok)
}

/// The message about an option that a project's file cannot set, with where it can be set.
fn not_for_projects(key: &str) -> String {
    let variable = format!("{PREFIX}{}", key.to_uppercase().replace('-', "_"));
    let file =
        user_file().map_or_else(|| "~/.config/steradian/config.toml".to_owned(), |file| file.display().to_string());
    format!(
        "\"{key}\" is not for a project's file, which sets what the picture is, not what is loaded, written or \
         connected to; use --{key}, {variable} or {file}"
    )
}

/// The entries of a file's text, as [`read`].
///
/// # Errors
/// As [`read`].
pub fn parse(file: &Path, trust: Trust, text: &str) -> Result<Vec<Entry>> {
    let line_of = |offset: usize| text.as_bytes().iter().take(offset).filter(|byte| **byte == b'\n').count() + 1;
    let fault = |line: usize, message: &str| Error::Usage(format!("{}:{line}: {message}", file.display()));
    let table = DeTable::parse(text).map_err(|e| fault(e.span().map_or(1, |span| line_of(span.start)), e.message()))?;
    let mut pairs: Vec<_> =
        table.get_ref().iter().map(|(key, value)| (key.span().start, key.get_ref(), value.get_ref())).collect();
    pairs.sort_by_key(|(start, ..)| *start);
    let mut entries: Vec<Entry> = Vec::new();
    for (start, key, value) in pairs {
        let (line, key) = (line_of(start), key.replace('_', "-"));
        if trust == Trust::Project && self::trust(&key) == Some(Trust::User) {
            return Err(fault(line, &not_for_projects(&key)));
        }
        if entries.iter().any(|entry| entry.key == key) {
            return Err(fault(line, &format!("\"{key}\" is set twice")));
        }
        let words = match value {
            DeValue::Table(table) if TABLES.contains(&key.as_str()) => assignments(table),
            value => words(value),
        };
        entries.push(Entry { words: words.map_err(|message| fault(line, message))?, key, line });
    }
    Ok(entries)
}

fn one(value: &DeValue<'_>) -> Result<String, &'static str> {
    match value {
        DeValue::String(text) => Ok(text.to_string()),
        DeValue::Integer(number) => Ok(number.as_str().replace('_', "")),
        DeValue::Float(number) => Ok(number.as_str().replace('_', "")),
        _ => Err("expected a word, a number, true, false or a list of words"),
    }
}

/// The entries of a table as the command line would have them.
fn assignments(table: &DeTable<'_>) -> Result<Words, &'static str> {
    let assignment = |(key, value): (&Spanned<DeString<'_>>, &Spanned<DeValue<'_>>)| {
        let text = match value.get_ref() {
            DeValue::Boolean(on) => on.to_string(),
            value => one(value)?,
        };
        Ok(format!("{}={text}", key.get_ref()))
    };
    table.iter().map(assignment).collect::<Result<_, _>>().map(Words::Many)
}

fn words(value: &DeValue<'_>) -> Result<Words, &'static str> {
    match value {
        DeValue::Boolean(on) => Ok(Words::Switch(*on)),
        DeValue::Array(items) => {
            items.iter().map(|item| one(item.get_ref())).collect::<Result<_, _>>().map(Words::Many)
        }
        value => one(value).map(Words::One),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_have_their_lines() {
        let text = "# project\nspp = 1_000\n\nguiding = true\ntarget_error = 1e-3\nlayers = [\"Z\", \"N\"]\n[exr]\n\
                    crypto_depth = 4\nprofile = \"nuke\"\nuncropped = true\n";
        let entries = parse(Path::new("s.toml"), Trust::Project, text).unwrap();
        let words = |words: &[&str]| Words::Many(words.iter().map(|word| (*word).to_owned()).collect());
        let entry = |key: &str, words: Words, line: usize| Entry { key: key.to_owned(), words, line };
        let expected = [
            entry("spp", Words::One("1000".to_owned()), 2),
            entry("guiding", Words::Switch(true), 4),
            entry("target-error", Words::One("1e-3".to_owned()), 5),
            entry("layers", words(&["Z", "N"]), 6),
            entry("exr", words(&["crypto_depth=4", "profile=nuke", "uncropped=true"]), 7),
        ];
        assert_eq!(entries, expected);
        for (text, message) in [
            ("spp = 1\nspp = 2", "s.toml:2: "),
            ("max_depth = 1\nspp = 2\nmax-depth = 2", "s.toml:3: \"max-depth\" is set twice"),
            ("spp =", "s.toml:1: "),
            ("\n[render]\nspp = 2", "s.toml:2: expected a word"),
            ("exr = { profile = [1] }", "s.toml:1: expected a word"),
            ("date = 1979-05-27", "s.toml:1: expected a word"),
            ("spp = 2\noutput = 1979-05-27", "s.toml:2: \"output\" is not for a project's file"),
        ] {
            let error = parse(Path::new("s.toml"), Trust::Project, text).unwrap_err();
            assert!(matches!(&error, Error::Usage(found) if found.starts_with(message)), "{error}");
        }
    }

    #[test]
    fn files_of_others_are_not_read() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("s.toml");
        std::fs::write(&file, "\u{feff}spp = 3").unwrap();
        if std::fs::metadata(&file).unwrap().uid() == ROOT {
            assert!(read(&file, Trust::Project, 7).unwrap().is_ok());
            std::os::unix::fs::chown(&file, Some(1), None).unwrap();
        }
        let owner = std::fs::metadata(&file).unwrap().uid();
        let entry = Entry { key: "spp".to_owned(), words: Words::One("3".to_owned()), line: 1 };
        assert_eq!(read(&file, Trust::Project, owner).unwrap().unwrap(), [entry]);
        for user in [owner + 1, ROOT] {
            let warning = read(&file, Trust::User, user).unwrap().unwrap_err();
            assert!(warning.contains("s.toml belongs to another user"), "{warning}");
        }
        for (bytes, message) in
            [("#".repeat(2 << 20).into_bytes(), "longer than"), (b"owner = \"\xe9\"".to_vec(), "not UTF-8")]
        {
            std::fs::write(&file, bytes).unwrap();
            assert!(read(&file, Trust::Project, owner).unwrap_err().to_string().contains(message));
        }
    }
}
