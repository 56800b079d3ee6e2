//! Hints for command lines of other programs, and of those who forget a word.

use std::ffi::OsString;
use std::path::Path;

use clap::error::{ContextKind, ContextValue, ErrorKind};

/// Options of other renderers, and what they are here.
const OPTIONS: [(&str, &str); 27] = [
    ("--samples", "--spp N"),
    ("--samples-per-pixel", "--spp N"),
    ("--quality", "--spp N, or --target-error"),
    ("--noise", "--target-error"),
    ("--noise-threshold", "--target-error"),
    ("--resolution", "--size WxH"),
    ("--res", "--size WxH"),
    ("--width", "--size WxH"),
    ("--height", "--size WxH"),
    ("--scale", "--size WxH"),
    ("--outfile", "-o FILE"),
    ("--out", "-o FILE"),
    ("--render-output", "-o FILE"),
    ("--format", "the extension of -o FILE: .exr or .png"),
    ("--nthreads", "--threads N"),
    ("--jobs", "--threads N"),
    ("--cores", "--threads N"),
    ("--bounces", "--max-depth N"),
    ("--depth", "--max-depth N"),
    ("--cropwindow", "--crop X,Y,W,H, in pixels"),
    ("--region", "--crop X,Y,W,H, in pixels"),
    ("--aov", "--layers LAYERS"),
    ("--aovs", "--layers LAYERS"),
    ("--timeout", "--time-limit SECONDS"),
    ("--max-time", "--time-limit SECONDS"),
    ("--force", "--overwrite, with --frames; single files are always overwritten"),
    ("--spectral", "unsupported: Steradian renders in linear RGB"),
];

/// Commands of other programs, and what they are here.
const COMMANDS: [(&str, &str); 10] = [
    ("preview", "steradian render SCENE --preview PORT"),
    ("display", "steradian view FILE.exr"),
    ("show", "steradian view FILE.exr"),
    ("open", "steradian view FILE.exr"),
    ("diff", "steradian compare REFERENCE.exr TEST.exr"),
    ("import", "steradian convert SCENE OUTPUT.json"),
    ("export", "steradian convert SCENE OUTPUT.json"),
    ("check", "steradian info SCENE"),
    ("validate", "steradian info SCENE"),
    ("benchmark", "steradian bench"),
];

/// Options of earlier versions: the command, the option, and what replaces it.
const RENAMED: [(&str, &str, &str); 11] = [
    ("render", "--exr-profile", "--exr profile=NAME"),
    ("render", "--compression", "--exr compression=NAME"),
    ("render", "--dwa-level", "--exr dwa_level=LEVEL"),
    ("render", "--uncropped", "--exr uncropped=true"),
    ("render", "--crypto-depth", "--exr crypto_depth=N"),
    ("render", "--crypto-manifest", "--exr crypto_manifest=PLACE"),
    ("render", "--owner", "--exr owner=TEXT"),
    ("render", "--comments", "--exr comments=TEXT"),
    ("error", "--no-guiding", "--guiding off, or --guiding on,off for both"),
    ("slurm", "--time", "--walltime TIME"),
    ("check-exr", "--strict", "--fail-on-warning"),
];

/// What a faulty command line may have been meant to be.
pub fn hint(error: &clap::Error, line: &[OsString]) -> Option<String> {
    let given = |kind: ContextKind| match error.get(kind)? {
        ContextValue::String(text) => Some(text.as_str()),
        _ => None,
    };
    match error.kind() {
        ErrorKind::InvalidSubcommand => {
            let word = given(ContextKind::InvalidSubcommand)?;
            if let Some((_, here)) = COMMANDS.iter().find(|(other, _)| *other == word) {
                return Some(format!("In place of {word}: {here}"));
            }
            let extension = Path::new(word).extension()?.to_str()?.to_lowercase();
            match extension.as_str() {
                "json" | "xml" | "pbrt" | "gltf" | "glb" => Some(format!("To render a scene: steradian render {word}")),
                "exr" => Some(format!("To render the picture of an EXR file again: steradian rerender {word} -o OUT")),
                "shard" => Some(format!("To merge shards: steradian merge {word} ... -o OUT")),
                _ => None,
            }
        }
        ErrorKind::UnknownArgument => {
            let option = given(ContextKind::InvalidArg)?;
            let renamed = || {
                let mut renamed = RENAMED.iter().filter(|(command, ..)| line.iter().any(|word| word == command));
                renamed.find(|(_, old, _)| *old == option).map(|(.., new)| new)
            };
            let other = || OPTIONS.iter().find(|(other, _)| *other == option).map(|(_, here)| here);
            let here = renamed().or_else(other)?;
            Some(format!("In place of {option}: {here}"))
        }
        _ => None,
    }
}

/// Removes the parser's guesses, and the usage with them, from an error that has a hint.
pub fn remove_tips(error: &mut clap::Error) {
    for kind in
        [ContextKind::SuggestedArg, ContextKind::SuggestedSubcommand, ContextKind::Suggested, ContextKind::Usage]
    {
        error.remove(kind);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hint_for(line: &str) -> Option<String> {
        let line: Vec<OsString> =
            ["steradian"].into_iter().chain(line.split_whitespace()).map(OsString::from).collect();
        hint(&crate::args::command_line().try_get_matches_from(&line).unwrap_err(), &line)
    }

    #[test]
    fn a_scene_without_a_command_is_to_be_rendered() {
        assert_eq!(hint_for("a/room.json").unwrap(), "To render a scene: steradian render a/room.json");
        assert!(hint_for("a.exr").unwrap().contains("rerender a.exr"));
        assert_eq!(hint_for("rendr"), None);
    }

    #[test]
    fn commands_of_other_programs_lead_to_those_here() {
        for (other, here) in COMMANDS {
            assert_eq!(hint_for(other).unwrap(), format!("In place of {other}: {here}"));
            let name = here.split(' ').nth(1).unwrap();
            assert!(crate::args::command_line().find_subcommand(name).is_some(), "{name}");
        }
    }

    #[test]
    fn a_hint_takes_the_place_of_the_parsers_guess() {
        let error = || crate::args::command_line().try_get_matches_from(["steradian", "nofile.json"]).unwrap_err();
        assert!(error().to_string().contains("tip"));
        let mut without = error();
        remove_tips(&mut without);
        assert!(!without.to_string().contains("tip"), "{without}");
    }

    #[test]
    fn options_of_other_renderers_lead_to_those_here() {
        let render = clap::Command::find_subcommand(&crate::args::command_line(), "render").unwrap().clone();
        for (other, here) in OPTIONS {
            assert_eq!(hint_for(&format!("render a.json {other}")).unwrap(), format!("In place of {other}: {here}"));
            if let Some(option) = here.strip_prefix("--") {
                let name: String = option.chars().take_while(|c| c.is_ascii_lowercase() || *c == '-').collect();
                assert!(render.get_arguments().any(|arg| arg.get_long() == Some(name.as_str())), "{name}");
            }
        }
        assert_eq!(hint_for("render a.json --nonsense"), None);
    }

    #[test]
    fn renamed_options_lead_to_their_new_names() {
        for (command, old, new) in RENAMED {
            let line = match command {
                "error" => format!("bench error a.json {old}"),
                "slurm" => format!("farm slurm a.json --shards 2 {old} 1:00"),
                _ => format!("{command} a.json {old}"),
            };
            assert_eq!(hint_for(&line).unwrap(), format!("In place of {old}: {new}"));
        }
        assert_eq!(hint_for("info a.json --compression"), None);
    }
}
