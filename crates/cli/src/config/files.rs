//! Options that configuration files set.

use std::path::Path;

use steradian::internal::config::{self, Entry, Trust};
use steradian::{Error, Result};

use super::{Options, Origin, Setting};

/// What a file sets, for a process of `user`; a warning if it is the file of somebody else, and not read.
///
/// # Errors
/// As [`config::read`], and [`Error::Usage`] with file and line for what is no option or no value of the option.
pub fn read(options: &Options, file: &Path, trust: Trust, user: u32) -> Result<Result<Vec<Setting>, String>> {
    match config::read(file, trust, user)? {
        Ok(entries) => settings(options, file, entries).map(Ok),
        Err(warning) => Ok(Err(warning)),
    }
}

fn settings(options: &Options, file: &Path, entries: Vec<Entry>) -> Result<Vec<Setting>> {
    let mut settings = Vec::new();
    for Entry { key, words, line } in entries {
        let found = options.settings(&key, words, Origin::File(file.to_owned(), line));
        settings.extend(found.map_err(|message| Error::Usage(format!("{}:{line}: {message}", file.display())))?);
    }
    Ok(settings)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::Cli;
    use clap::CommandFactory;

    fn parse(options: &Options, trust: Trust, text: &str) -> Result<Vec<Setting>> {
        let file = Path::new("s.toml");
        settings(options, file, config::parse(file, trust, text)?)
    }

    fn parsed(text: &str) -> Result<Vec<Setting>> {
        parse(&Options::new(&Cli::command()), Trust::User, text)
    }

    #[test]
    fn keys_are_options_and_values_what_they_take() {
        let found = parsed(
            "# project\nspp = 64\ntarget_error = 1e-3\nsize = \"64x32\"\ncrop = [1, 2, 3, 4]\n\
             output = [\"a.exr\", \"b.png\"]\nguiding = true\nfloat = true\n\
             [exr]\nprofile = \"nuke\"\ncrypto_depth = 4\n",
        );
        let found: Vec<_> =
            found.unwrap().into_iter().map(|s| format!("{}={} {}", s.key, s.values.join(";"), s.origin)).collect();
        let expected = [
            "spp=64 s.toml:2",
            "target-error=1e-3 s.toml:3",
            "size=64x32 s.toml:4",
            "crop=1,2,3,4 s.toml:5",
            "output=a.exr;b.png s.toml:6",
            "guiding=on s.toml:7",
            "float=true s.toml:8",
            "exr.crypto_depth=4 s.toml:9",
            "exr.profile=nuke s.toml:9",
        ];
        assert_eq!(found, expected);
    }

    #[test]
    fn projects_set_what_the_picture_is_and_nothing_else() {
        let options = Options::new(&Cli::command());
        for arg in options.render.iter().chain(&options.global) {
            let key = arg.get_long().unwrap();
            let value = match (key, arg.get_action()) {
                (_, clap::ArgAction::SetTrue) => "true".to_owned(),
                ("accel", _) => "\"bvh\"".to_owned(),
                ("layers", _) => "[\"Z\"]".to_owned(),
                ("define", _) => "[\"a=1\"]".to_owned(),
                ("exr", _) => "\"owner=a\"".to_owned(),
                ("size", _) => "\"8x8\"".to_owned(),
                ("crop", _) => "[0, 0, 1, 1]".to_owned(),
                ("tev", _) => "\"localhost:1\"".to_owned(),
                _ => {
                    let names: Vec<String> =
                        arg.get_possible_values().iter().map(|value| format!("\"{}\"", value.get_name())).collect();
                    names.first().cloned().unwrap_or_else(|| "1".to_owned())
                }
            };
            let text = format!("{key} = {value}");
            let by = |trust| parse(&options, trust, &text).map(|found| found.len()).map_err(|e| e.to_string());
            assert_eq!(by(Trust::User), Ok(1), "{text}");
            let expected = config::trust(key) == Some(Trust::Project);
            match by(Trust::Project) {
                Ok(1) => assert!(expected, "{text}"),
                refused => {
                    let message = refused.unwrap_err();
                    let variable = format!("STERADIAN_{}", key.to_uppercase().replace('-', "_"));
                    assert!(
                        !expected && message.starts_with(&format!("s.toml:1: \"{key}\" is not for a project's file")),
                        "{message}"
                    );
                    assert!(
                        [format!("--{key}"), variable, "config.toml".into()]
                            .iter()
                            .all(|place| message.contains(place)),
                        "{message}"
                    );
                }
            }
        }
    }

    #[test]
    fn faults_have_their_line() {
        for (text, message) in [
            ("spp = 1\nsppp = 2", "s.toml:2: \"sppp\" is no option of render (did you mean \"spp\"?)"),
            ("\n\nspp = \"x\"", "s.toml:3: invalid value 'x' for '--spp <N>'"),
            ("spp = 1\nspp = 2", "s.toml:2: "),
            ("spp =", "s.toml:1: "),
            ("float = 3", "s.toml:1: float is true or false"),
            ("spp = 1\nexr = { profil = 3 }", "s.toml:2: invalid value 'profil=3' for '--exr"),
            ("[render]\nspp = 2", "s.toml:1: "),
            ("frames = \"1-2\"", "s.toml:1: \"frames\" belongs to the command line"),
        ] {
            let error = parsed(text).unwrap_err();
            assert!(matches!(&error, Error::Usage(found) if found.starts_with(message)), "{error}");
        }
    }

    /// Whatever the bytes are, they are settings or an error with its line: damaged files, and those that fuzzing
    /// found.
    #[test]
    fn damaged_files_are_read_or_refused() {
        const TEXT: &str = "# a\nspp = 64\nlayers = [\"Z\", \"N\"]\nsize = \"8x8\"\nexposure = -1.5e1\nfloat = true\n\
                            seed = 0x10\nexr = 1979-05-27\n";
        let options = Options::new(&Cli::command());
        let check = |text: &str| {
            if let Err(error) = parse(&options, Trust::Project, text) {
                assert!(matches!(&error, Error::Usage(found) if found.starts_with("s.toml:")), "{text}: {error}");
            }
        };
        let mut rng = steradian::internal::math::Rng::new(5);
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
            check(&String::from_utf8_lossy(&bytes));
        }
        let archive = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus.tar.gz");
        let archive = flate2::read::GzDecoder::new(std::fs::File::open(archive).unwrap());
        let mut count = 0;
        for entry in tar::Archive::new(archive).entries().unwrap() {
            let mut entry = entry.unwrap();
            if entry.path().unwrap().starts_with("corpus/config") {
                let mut bytes = Vec::new();
                std::io::Read::read_to_end(&mut entry, &mut bytes).unwrap();
                check(&String::from_utf8_lossy(&bytes));
                count += 1;
            }
        }
        assert!(count > 50, "{count}");
    }
}
