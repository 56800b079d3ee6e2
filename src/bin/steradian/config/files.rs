//! Configuration files: `steradian.toml` of a project and `config.toml` of a user, whose keys are the options of `render`.

use std::path::{Path, PathBuf};

use steradian::{Error, Result};
use toml::de::{DeTable, DeValue};

use super::{Options, Origin, Setting, Words};

/// The project's file, in the scene's folder or the nearest one above that has it.
const PROJECT: &str = "steradian.toml";

/// The files that speak for a scene, the stronger first.
pub fn for_scene(scene: &Path) -> Vec<PathBuf> {
    let folder = std::path::absolute(scene).ok().and_then(|path| path.parent().map(Path::to_owned));
    let project = folder.iter().flat_map(|folder| folder.ancestors()).map(|folder| folder.join(PROJECT)).find(|file| file.is_file());
    let variable = |name: &str| std::env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let folder = variable("XDG_CONFIG_HOME").or_else(|| variable("HOME").map(|home| home.join(".config")));
    let user = folder.map(|folder| folder.join("steradian").join("config.toml")).filter(|file| file.is_file());
    project.into_iter().chain(user).collect()
}

/// What a file says.
///
/// # Errors
/// [`Error::Usage`] with file and line for what is no TOML, no option, or no value of the option.
pub fn read(options: &Options, file: &Path) -> Result<Vec<Setting>> {
    let text = steradian::file::read_to_string(file).map_err(|e| Error::Usage(format!("{}: {e}", file.display())))?;
    parse(options, file, &text)
}

fn parse(options: &Options, file: &Path, text: &str) -> Result<Vec<Setting>> {
    let line_of = |offset: usize| text.as_bytes().iter().take(offset).filter(|byte| **byte == b'\n').count() + 1;
    let fault = |offset: usize, message: &str| Error::Usage(format!("{}:{}: {message}", file.display(), line_of(offset)));
    let table = DeTable::parse(text).map_err(|e| fault(e.span().map_or(0, |span| span.start), e.message()))?;
    let mut found = Vec::new();
    for (key, value) in table.get_ref() {
        let start = key.span().start;
        let setting = words(value.get_ref()).and_then(|words| {
            let origin = Origin::File(file.to_owned(), line_of(start));
            options.setting(key.get_ref(), words, origin)
        });
        found.push((start, setting.map_err(|message| fault(start, &message))?));
    }
    found.sort_by_key(|(start, _)| *start);
    Ok(found.into_iter().map(|(_, setting)| setting).collect())
}

fn words(value: &DeValue<'_>) -> Result<Words, String> {
    let one = |value: &DeValue<'_>| match value {
        DeValue::String(text) => Ok(text.to_string()),
        DeValue::Integer(number) => Ok(number.as_str().replace('_', "")),
        DeValue::Float(number) => Ok(number.as_str().replace('_', "")),
        _ => Err("expected a word, a number, true, false or a list of words".to_owned()),
    };
    match value {
        DeValue::Boolean(on) => Ok(Words::Switch(*on)),
        DeValue::Array(items) => items.iter().map(|item| one(item.get_ref())).collect::<Result<_, _>>().map(Words::Many),
        value => one(value).map(Words::One),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::Cli;
    use clap::CommandFactory;

    fn parsed(text: &str) -> Result<Vec<Setting>> {
        parse(&Options::new(&Cli::command()), Path::new("s.toml"), text)
    }

    #[test]
    fn keys_are_options_and_values_what_they_take() {
        let found = parsed(
            "# ours\nspp = 64\ntarget_error = 1e-3\nsize = \"64x32\"\ncrop = [1, 2, 3, 4]\noutput = [\"a.exr\", \"b.png\"]\nguiding = true\nfloat = true\n",
        );
        let found: Vec<_> = found.unwrap().into_iter().map(|s| format!("{}={} {}", s.key, s.values.join(";"), s.origin)).collect();
        let expected = [
            "spp=64 s.toml:2",
            "target-error=1e-3 s.toml:3",
            "size=64x32 s.toml:4",
            "crop=1,2,3,4 s.toml:5",
            "output=a.exr;b.png s.toml:6",
            "guiding=on s.toml:7",
            "float=true s.toml:8",
        ];
        assert_eq!(found, expected);
    }

    #[test]
    fn faults_have_their_line() {
        for (text, message) in [
            ("spp = 1\nsppp = 2", "s.toml:2: \"sppp\" is no option of render (did you mean \"spp\"?)"),
            ("\n\nspp = \"x\"", "s.toml:3: invalid value 'x' for '--spp <N>'"),
            ("spp = 1\nspp = 2", "s.toml:2: "),
            ("spp =", "s.toml:1: "),
            ("float = 3", "s.toml:1: float is true or false"),
            ("[render]\nspp = 2", "s.toml:1: "),
            ("frames = \"1-2\"", "s.toml:1: \"frames\" belongs to the command line"),
        ] {
            let error = parsed(text).unwrap_err();
            assert!(matches!(&error, Error::Usage(told) if told.starts_with(message)), "{error}");
        }
    }
}
