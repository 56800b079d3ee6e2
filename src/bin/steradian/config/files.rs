//! Configuration files: `steradian.toml` of a project and `config.toml` of a user, whose keys are the options of `render`.

use std::io::Read;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use steradian::{Error, Result};
use toml::de::{DeTable, DeValue};

use super::{Options, Origin, PREFIX, Setting, Trust, Words};

/// Root's number: who can write such a file can do anything.
const ROOT: u32 = 0;

/// The project's file, in the scene's folder.
const PROJECT: &str = "steradian.toml";

/// No configuration is longer, in bytes.
const MAX_LENGTH: u64 = 1 << 20;

/// The files for a scene, the stronger first, with what they may set.
pub fn for_scene(scene: &Path) -> Vec<(PathBuf, Trust)> {
    let project = scene.parent().map(|folder| (folder.join(PROJECT), Trust::Project));
    let user = user_file().map(|file| (file, Trust::User));
    project.into_iter().chain(user).filter(|(file, _)| file.is_file()).collect()
}

/// The user's own file, whether it is there or not.
fn user_file() -> Option<PathBuf> {
    let variable = |name: &str| std::env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let folder = variable("XDG_CONFIG_HOME").or_else(|| variable("HOME").map(|home| home.join(".config")));
    folder.map(|folder| folder.join("steradian").join("config.toml"))
}

/// What a file sets, for a process of `user`; a warning if it is the file of somebody else, who is neither the user nor root, and not read.
///
/// # Errors
/// [`Error::Usage`] with file and line for what is no TOML, no option, no value of the option, or not for such a file to set.
pub fn read(options: &Options, file: &Path, trust: Trust, user: u32) -> Result<Result<Vec<Setting>, String>> {
    let fault = |message: String| Error::Usage(format!("{}: {message}", file.display()));
    let opened = steradian::file::open(file).map_err(|e| fault(e.to_string()))?;
    // That of the open file: the name may belong to another one meanwhile.
    let owner = opened.get_ref().metadata().map_err(|e| fault(e.to_string()))?.uid();
    if owner != user && owner != ROOT {
        return Ok(Err(format!("{} belongs to another user (uid {owner}): it is not read", file.display())));
    }
    let mut text = String::new();
    opened.take(MAX_LENGTH + 1).read_to_string(&mut text).map_err(|e| fault(e.to_string()))?;
    if text.len() as u64 > MAX_LENGTH {
        return Err(fault(format!("longer than {MAX_LENGTH} bytes")));
    }
    parse(options, file, trust, &text).map(Ok)
}

/// What the file of somebody cannot set, with where it can be set.
fn not_for_projects(key: &str) -> String {
    let variable = format!("{PREFIX}{}", key.to_uppercase().replace('-', "_"));
    let file = user_file().map_or_else(|| "~/.config/steradian/config.toml".to_owned(), |file| file.display().to_string());
    format!(
        "\"{key}\" is not for a project's file, which sets what the picture is, not what is loaded, written or connected to; use --{key}, \
         {variable} or {file}"
    )
}

fn parse(options: &Options, file: &Path, trust: Trust, text: &str) -> Result<Vec<Setting>> {
    let line_of = |offset: usize| text.as_bytes().iter().take(offset).filter(|byte| **byte == b'\n').count() + 1;
    let fault = |offset: usize, message: &str| Error::Usage(format!("{}:{}: {message}", file.display(), line_of(offset)));
    let table = DeTable::parse(text).map_err(|e| fault(e.span().map_or(0, |span| span.start), e.message()))?;
    let mut found = Vec::new();
    for (key, value) in table.get_ref() {
        let start = key.span().start;
        let setting = words(value.get_ref()).and_then(|words| {
            let origin = Origin::File(file.to_owned(), line_of(start));
            let setting = options.setting(key.get_ref(), words, origin)?;
            let may = super::trust(&setting.key).is_some_and(|needed| needed <= trust);
            if may { Ok(setting) } else { Err(not_for_projects(&setting.key)) }
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
        parse(&Options::new(&Cli::command()), Path::new("s.toml"), Trust::User, text)
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
    fn projects_set_what_the_picture_is_and_nothing_else() {
        let options = Options::new(&Cli::command());
        for arg in options.render.iter().chain(&options.global) {
            let key = arg.get_long().unwrap();
            let value = match (key, arg.get_action()) {
                ("guiding", _) | (_, clap::ArgAction::SetTrue) => "true".to_owned(),
                ("accel", _) => "\"bvh\"".to_owned(),
                ("layers", _) => "[\"Z\"]".to_owned(),
                ("define", _) => "[\"a=1\"]".to_owned(),
                ("size", _) => "\"8x8\"".to_owned(),
                ("crop", _) => "[0, 0, 1, 1]".to_owned(),
                ("tev", _) => "\"localhost:1\"".to_owned(),
                _ => {
                    let names: Vec<String> = arg.get_possible_values().iter().map(|value| format!("\"{}\"", value.get_name())).collect();
                    names.first().cloned().unwrap_or_else(|| "1".to_owned())
                }
            };
            let text = format!("{key} = {value}");
            let by = |trust| parse(&options, Path::new("s.toml"), trust, &text).map(|found| found.len()).map_err(|e| e.to_string());
            assert_eq!(by(Trust::User), Ok(1), "{text}");
            let expected = crate::config::trust(key) == Some(Trust::Project);
            match by(Trust::Project) {
                Ok(1) => assert!(expected, "{text}"),
                refused => {
                    let message = refused.unwrap_err();
                    let variable = format!("STERADIAN_{}", key.to_uppercase().replace('-', "_"));
                    assert!(!expected && message.starts_with(&format!("s.toml:1: \"{key}\" is not for a project's file")), "{message}");
                    assert!([format!("--{key}"), variable, "config.toml".into()].iter().all(|place| message.contains(place)), "{message}");
                }
            }
        }
    }

    #[test]
    fn files_of_others_are_not_read() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("s.toml");
        std::fs::write(&file, "spp = 3").unwrap();
        let options = Options::new(&Cli::command());
        if std::fs::metadata(&file).unwrap().uid() == ROOT {
            assert!(read(&options, &file, Trust::Project, 7).unwrap().is_ok());
            std::os::unix::fs::chown(&file, Some(1), None).unwrap();
        }
        let owner = std::fs::metadata(&file).unwrap().uid();
        assert_eq!(read(&options, &file, Trust::Project, owner).unwrap().unwrap().len(), 1);
        for user in [owner + 1, ROOT] {
            let warning = read(&options, &file, Trust::User, user).unwrap().unwrap_err();
            assert!(warning.contains("s.toml belongs to another user"), "{warning}");
        }
        std::fs::write(&file, "#".repeat(2 << 20)).unwrap();
        assert!(read(&options, &file, Trust::Project, owner).unwrap_err().to_string().contains("longer than"));
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

    /// Whatever the bytes are, they are settings or an error with its line.
    #[test]
    fn damaged_files_are_read_or_refused() {
        const TEXT: &str =
            "# a\nspp = 64\nlayers = [\"Z\", \"N\"]\nsize = \"8x8\"\nexposure = -1.5e1\nfloat = true\nseed = 0x10\ncomments = 1979-05-27\n";
        let options = Options::new(&Cli::command());
        let mut rng = steradian::math::Rng::new(5);
        for _ in 0..100 {
            let mut bytes = TEXT.as_bytes().to_vec();
            for _ in 0..=rng.below(4) {
                let at = rng.below(bytes.len());
                match rng.below(4) {
                    0 => bytes.truncate(at + 1),
                    1 if bytes.len() > 1 => drop(bytes.remove(at)),
                    _ => bytes.insert(at, (rng.bits() & 0x7f) as u8),
                }
            }
            let text = String::from_utf8_lossy(&bytes);
            if let Err(error) = parse(&options, Path::new("s.toml"), Trust::Project, &text) {
                assert!(matches!(&error, Error::Usage(told) if told.starts_with("s.toml:")), "{text}: {error}");
            }
        }
    }
}
