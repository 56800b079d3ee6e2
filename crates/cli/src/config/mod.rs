//! Where the options of `render` come from: the command line, the environment, files of the project and of the user,
//! the machine's limits.

mod files;
mod hints;
mod show;

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use clap::error::ErrorKind;
use clap::parser::ValueSource;
use clap::{Arg, ArgAction, ArgMatches, Command, CommandFactory, FromArgMatches};
use steradian::internal::config::{PREFIX, Trust, Words, trust};
use steradian::internal::farm::{is_scene_per_frame, message_lines};
use steradian::internal::suggestion::did_you_mean;
use steradian::{Error, ExrChanges, Result};

use crate::args::{self, Cli, FIRST_STEPS, command_line, opposite};
use crate::log::{self, Level};
pub use show::run as show;

/// What the names of settings begin with that are keys of `exr`.
pub const EXR_KEYS: &str = "exr.";

/// Variables in which farms store how many processors a task may use.
const FARM_THREADS: [&str; 2] = ["SLURM_CPUS_PER_TASK", "CUE_THREADS"];

/// Where a value comes from, the strongest first.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Origin {
    /// A variable of the environment.
    Environment(String),
    /// A line of a file.
    File(PathBuf, usize),
}

impl std::fmt::Display for Origin {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Environment(name) => write!(f, "environment: {name}"),
            Self::File(file, line) => write!(f, "{}:{line}", file.display()),
        }
    }
}

/// What is given for an option.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Setting {
    /// The option's name without its dashes.
    pub key: String,
    /// Its values, as the command line would have them; empty for a switch that is off.
    pub values: Vec<String>,
    /// The origin of the setting.
    pub origin: Origin,
}

/// The command line with what the environment and the files add to `render`; and messages about that.
pub struct Parsed {
    /// The command line.
    pub cli: Cli,
    /// Warnings.
    pub warnings: Vec<String>,
    /// What was added.
    pub added: Vec<Setting>,
    /// The files that were read for it.
    pub files: Vec<PathBuf>,
}

/// The folder of example scenes that a package installs with a program.
fn installed_scenes(program: &Path) -> Option<PathBuf> {
    let scenes = program.parent()?.parent()?.join("share/steradian/scenes");
    scenes.is_dir().then_some(scenes)
}

/// Reads the command line, and what is to be added to it. A faulty command line ends the program with exit code 2, help
/// with 0.
pub fn parse() -> Result<Parsed> {
    let line: Vec<OsString> = std::env::args_os().collect();
    check_utf8(&line)?;
    let line = with_replay(line);
    if line.len() == 1 {
        log::line(FIRST_STEPS);
        if let Some(scenes) = std::env::current_exe().ok().and_then(|program| installed_scenes(&program)) {
            log::line(&format!("Scenes to start with: {}", scenes.display()));
        }
        std::process::exit(2);
    }
    let command = color(command_line(), &line);
    let matches = command.clone().try_get_matches_from(&line).unwrap_or_else(|error| {
        if let Some(scene) = missing_scene(&command, &line, &error) {
            log::message(Level::Error, &format!("{}: no such file", scene.display()));
        }
        exit(error, &line)
    });
    let Some(("render", render)) = matches.subcommand() else {
        return Ok(Parsed { cli: typed(&matches, &line), warnings: Vec::new(), added: Vec::new(), files: Vec::new() });
    };
    let scene = render.get_one::<PathBuf>("scene").cloned().unwrap_or_default();
    let options = Options::new(&command);
    let Found { settings, files, warnings } = settings(&options, &scene)?;
    let given = |key: &str| [key, &opposite(key)].iter().any(|name| is_given(render, &matches, name));
    // --verbose on the command line overrides `quiet` in a file.
    let opposed = |key: &str| (key == "quiet" && given("verbose")) || (key == "verbose" && given("quiet"));
    let added: Vec<Setting> =
        settings.into_iter().filter(|setting| !given(&setting.key) && !opposed(&setting.key)).collect();
    let command = added.iter().fold(command, |command, setting| options.with_default(command, setting));
    let matches = command.try_get_matches_from(&line).unwrap_or_else(|error| exit(error, &line));
    let mut cli = typed(&matches, &line);
    if let args::Command::Render(arguments) = &mut cli.command {
        // Those of the command line come later and count.
        for setting in &added {
            let Some(key) = setting.key.strip_prefix(EXR_KEYS) else { continue };
            let change: Result<ExrChanges, String> = format!("{key}={}", setting.values.join(",")).parse();
            arguments.exr.insert(0, change.map_err(|message| Error::Usage(format!("{}: {message}", setting.origin)))?);
        }
    }
    Ok(Parsed { cli, warnings, added, files })
}

/// The scene, if it does not exist, of a command line with a faulty value: both are to be reported.
fn missing_scene(command: &Command, line: &[OsString], error: &clap::Error) -> Option<PathBuf> {
    if ![ErrorKind::InvalidValue, ErrorKind::ValueValidation].contains(&error.kind()) {
        return None;
    }
    let any_value = |arg: Arg| {
        let takes_path = arg.get_id() == "scene" || !arg.get_action().takes_values();
        if takes_path { arg } else { arg.value_parser(clap::value_parser!(OsString)) }
    };
    let lenient = ["render", "info"]
        .into_iter()
        .fold(command.clone(), |command, name| command.mut_subcommand(name, |command| command.mut_args(any_value)));
    let matches = lenient.try_get_matches_from(line).ok()?;
    let scene = matches.subcommand()?.1.try_get_one::<PathBuf>("scene").ok()??;
    (!scene.exists() && !is_scene_per_frame(scene)).then(|| scene.clone())
}

/// Ends the program with what is wrong with the command line, or with help. Words of the line steer neither terminals
/// nor farms.
fn exit(mut error: clap::Error, line: &[OsString]) -> ! {
    let hint = hints::hint(&error, line);
    if hint.is_some() {
        hints::remove_tips(&mut error);
    }
    let text = error.to_string();
    let harmless = message_lines(&text);
    if !error.use_stderr() {
        error.exit();
    }
    if harmless == text {
        // Stderr may be gone; that is no reason to stop.
        let _ = error.print();
    } else {
        log::line(harmless.trim_end());
    }
    if let Some(hint) = hint {
        log::line(&message_lines(&format!("\n{hint}")));
    }
    std::process::exit(error.exit_code());
}

/// `replay SCENE X,Y I` as `render SCENE --pixel X,Y --sample I`, with the same options.
fn with_replay(line: Vec<OsString>) -> Vec<OsString> {
    let words: Vec<&str> = line.iter().filter_map(|word| word.to_str()).collect();
    let [program, "replay", scene, pixel, sample, options @ ..] = &words[..] else { return line };
    if [scene, pixel, sample].iter().any(|word| word.starts_with('-')) {
        return line;
    }
    let render = [program, "render", scene, "--pixel", pixel, "--sample", sample];
    render.iter().chain(options).map(OsString::from).collect()
}

/// Names go into files whose text is UTF-8: pictures, statistics, states.
fn check_utf8(line: &[OsString]) -> Result<()> {
    match line.iter().skip(1).find(|word| word.to_str().is_none()) {
        Some(word) => Err(Error::Usage(format!("{word:?} is not UTF-8; give the file a name that is"))),
        None => Ok(()),
    }
}

fn typed(matches: &ArgMatches, line: &[OsString]) -> Cli {
    Cli::from_arg_matches(matches).unwrap_or_else(|error| exit(error, line))
}

/// Help and complaints about the command line follow `--color`, which is not parsed yet.
fn color(command: Command, line: &[OsString]) -> Command {
    let words: Vec<&str> = line.iter().filter_map(|word| word.to_str()).collect();
    let after = words.windows(2).find(|pair| pair[0] == "--color").map(|pair| pair[1]);
    let choice = words.iter().find_map(|word| word.strip_prefix("--color=")).or(after);
    command.color(match choice {
        Some("always") => clap::ColorChoice::Always,
        Some("never") => clap::ColorChoice::Never,
        _ => clap::ColorChoice::Auto,
    })
}

fn is_given(render: &ArgMatches, root: &ArgMatches, name: &str) -> bool {
    let id = name.replace('-', "_");
    let source = |matches: &ArgMatches| matches.try_contains_id(&id).ok().and_then(|_| matches.value_source(&id));
    [render, root].into_iter().any(|matches| source(matches) == Some(ValueSource::CommandLine))
}

/// The options of `render` that may be given elsewhere.
pub struct Options {
    render: Vec<Arg>,
    global: Vec<Arg>,
}

impl Options {
    /// Those that the command line's definition has.
    pub fn new(command: &Command) -> Self {
        let known =
            |arg: &&Arg| arg.get_long().is_some_and(|long| trust(long).is_some_and(|trust| trust < Trust::CommandLine));
        let of = |command: &Command| command.get_arguments().filter(known).cloned().collect::<Vec<_>>();
        Self { render: command.find_subcommand("render").map(of).unwrap_or_default(), global: of(command) }
    }

    /// Their names, without dashes.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.render.iter().chain(&self.global).filter_map(Arg::get_long)
    }

    fn find(&self, key: &str) -> Option<&Arg> {
        self.render.iter().chain(&self.global).find(|arg| arg.get_long() == Some(key))
    }

    /// The built-in value of an option that has one of its own.
    fn default_of(&self, key: &str) -> Option<String> {
        let values = self.find(key)?.get_default_values();
        (!values.is_empty()).then(|| values.iter().map(|value| value.to_string_lossy()).collect::<Vec<_>>().join(","))
    }

    /// A hint for a name that is not known.
    fn unknown(&self, key: &str) -> String {
        let hint = did_you_mean(key, self.names(), ["\"", "\""]);
        let why = if trust(key) == Some(Trust::CommandLine) {
            "belongs to the command line"
        } else {
            "is no option of render"
        };
        format!("\"{key}\" {why}{hint}")
    }

    /// The command with a setting's values as the option's default; of a switch that is off, its opposite is on.
    fn with_default(&self, command: Command, setting: &Setting) -> Command {
        let Some(arg) = self.find(&setting.key) else { return command };
        let is_off = setting.values.is_empty();
        let id = if is_off { opposite(&setting.key).replace('-', "_") } else { arg.get_id().as_str().to_owned() };
        let values = if is_off { vec!["true".to_owned()] } else { setting.values.clone() };
        let set = move |arg: Arg| arg.default_values(values);
        if self.global.iter().any(|global| global.get_id() == arg.get_id()) {
            command.mut_arg(id, set)
        } else {
            command.mut_subcommand("render", |render| render.mut_arg(id, set))
        }
    }

    /// The setting of which the words are those of a variable or a file, one for each key of `exr`; `Err` is the
    /// message.
    fn settings(&self, key: &str, words: Words, origin: Origin) -> Result<Vec<Setting>, String> {
        let key = key.replace('_', "-");
        let arg = self.find(&key).ok_or_else(|| self.unknown(&key))?;
        let values = values_of(words, arg)?;
        if arg.get_action().takes_values() {
            let line = ["steradian".to_owned(), "render".to_owned(), "scene".to_owned()].into_iter();
            let line = line.chain(values.iter().map(|value| format!("--{key}={value}")));
            use clap::error::ErrorKind::{
                InvalidValue, NoEquals, TooFewValues, TooManyValues, ValueValidation, WrongNumberOfValues,
            };
            match Cli::command().try_get_matches_from(line) {
                Err(e)
                    if [InvalidValue, NoEquals, TooFewValues, TooManyValues, ValueValidation, WrongNumberOfValues]
                        .contains(&e.kind()) =>
                {
                    let text = e.to_string();
                    return Err(text.lines().next().unwrap_or_default().trim_start_matches("error: ").to_owned());
                }
                _ => {}
            }
        }
        if key != "exr" {
            return Ok(vec![Setting { key, values, origin }]);
        }
        let mut settings = Vec::new();
        for changes in values {
            settings.extend(changes.parse::<ExrChanges>()?.pairs().map(|(key, value)| Setting {
                key: format!("{EXR_KEYS}{key}"),
                values: vec![value.to_owned()],
                origin: origin.clone(),
            }));
        }
        Ok(settings)
    }
}

/// The value of an option as the command line would have it.
fn values_of(words: Words, arg: &Arg) -> Result<Vec<String>, String> {
    let name = arg.get_long().unwrap_or_default();
    match (arg.get_action(), words) {
        (ArgAction::SetTrue, Words::Switch(on)) => Ok(if on { vec!["true".to_owned()] } else { Vec::new() }),
        (ArgAction::SetTrue, _) => Err(format!("{name} is true or false")),
        (ArgAction::Count, Words::One(number)) if number.parse::<u8>().is_ok() => Ok(vec![number]),
        (ArgAction::Count, Words::Switch(on)) => Ok(vec![u8::from(on).to_string()]),
        (ArgAction::Count, _) => Err(format!("{name} is a number")),
        (_, Words::Switch(on)) => Ok(vec![if on { "on" } else { "off" }.to_owned()]),
        (ArgAction::Append, Words::Many(words)) => Ok(words),
        (_, Words::Many(words)) => Ok(vec![words.join(",")]),
        (_, Words::One(word)) => Ok(vec![word]),
    }
}

/// What is set outside the command line.
pub struct Found {
    /// Each option once, from the strongest place.
    pub settings: Vec<Setting>,
    /// The files that were read.
    pub files: Vec<PathBuf>,
    /// Warnings.
    pub warnings: Vec<String>,
}

/// Everything that is set outside the command line for rendering `scene`.
pub fn settings(options: &Options, scene: &Path) -> Result<Found> {
    let mut warnings = Vec::new();
    let mut found = environment(options, std::env::vars_os(), &mut warnings)?;
    let mut files = Vec::new();
    let user = rustix::process::geteuid().as_raw();
    for (file, trust) in steradian::internal::config::for_scene(scene) {
        match files::read(options, &file, trust, user)? {
            Ok(settings) => {
                found.extend(settings);
                files.push(file);
            }
            Err(warning) => warnings.push(warning),
        }
    }
    let limits =
        |name: &str| std::env::var(name).is_ok_and(|value| value.parse::<usize>().is_ok_and(|threads| threads > 0));
    if let Some(name) = FARM_THREADS.iter().find(|name| limits(name)) {
        let values = std::env::var(name).into_iter().collect();
        found.push(Setting { key: "threads".to_owned(), values, origin: Origin::Environment((*name).to_owned()) });
    }
    let mut kept: Vec<Setting> = Vec::new();
    for setting in found {
        if !kept.iter().any(|other| other.key == setting.key) {
            kept.push(setting);
        }
    }
    Ok(Found { settings: kept, files, warnings })
}

/// The values of variables such as `STERADIAN_SPP`; an empty one counts as unset.
fn environment(
    options: &Options,
    variables: impl Iterator<Item = (OsString, OsString)>,
    warnings: &mut Vec<String>,
) -> Result<Vec<Setting>> {
    let mut found = Vec::new();
    for (name, value) in variables {
        let (Some(name), Some(value)) = (name.to_str(), value.to_str()) else { continue };
        let Some(rest) = name.strip_prefix(PREFIX).filter(|_| !value.is_empty()) else { continue };
        let key = rest.to_lowercase().replace('_', "-");
        let Some(arg) = options.find(&key) else {
            warnings.push(format!("{name}: {}", options.unknown(&key)));
            continue;
        };
        let words = match (arg.get_action(), value.to_lowercase().as_str()) {
            (ArgAction::SetTrue, "1" | "true" | "yes" | "on") => Words::Switch(true),
            (ArgAction::SetTrue, "0" | "false" | "no" | "off") => Words::Switch(false),
            (ArgAction::Append, _) if key != "exr" => Words::Many(value.split(',').map(str::to_owned).collect()),
            _ => Words::One(value.to_owned()),
        };
        let settings = options.settings(&key, words, Origin::Environment(name.to_owned()));
        found.extend(settings.map_err(|message| Error::Usage(format!("{name}: {message}")))?);
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn from_environment(variables: &[(&str, &str)]) -> (Result<Vec<Setting>>, Vec<String>) {
        let mut warnings = Vec::new();
        let variables = variables.iter().map(|(name, value)| (OsString::from(name), OsString::from(value)));
        let found = environment(&Options::new(&Cli::command()), variables, &mut warnings);
        (found, warnings)
    }

    #[test]
    fn scenes_of_a_package_are_found_beside_the_program() {
        let folder = tempfile::tempdir().unwrap();
        let program = folder.path().join("bin/steradian");
        assert_eq!(installed_scenes(&program), None);
        let scenes = folder.path().join("share/steradian/scenes");
        std::fs::create_dir_all(&scenes).unwrap();
        assert_eq!(installed_scenes(&program), Some(scenes));
    }

    #[test]
    fn variables_are_named_after_options() {
        let (found, warnings) = from_environment(&[
            ("STERADIAN_TARGET_ERROR", "0.1"),
            ("STERADIAN_FLOAT", "yes"),
            ("STERADIAN_OVERWRITE", "0"),
            ("STERADIAN_OUTPUT", "a.exr,b.png"),
            ("STERADIAN_EXR", "profile=nuke,comments=a, b"),
            ("STERADIAN_SEED", ""),
            ("HOME", "/"),
        ]);
        let found: Vec<_> = found.unwrap().into_iter().map(|s| (s.key, s.values)).collect();
        let expected = [
            ("target-error", vec!["0.1"]),
            ("float", vec!["true"]),
            ("overwrite", vec![]),
            ("output", vec!["a.exr", "b.png"]),
            ("exr.profile", vec!["nuke"]),
            ("exr.comments", vec!["a, b"]),
        ];
        assert_eq!(
            found,
            expected.map(|(key, values)| (key.to_owned(), values.into_iter().map(str::to_owned).collect::<Vec<_>>()))
        );
        assert!(warnings.is_empty());
    }

    #[test]
    fn faults_of_variables_name_them() {
        let (found, _) = from_environment(&[("STERADIAN_SPP", "many")]);
        let message = found.unwrap_err().to_string();
        assert!(message.starts_with("STERADIAN_SPP: invalid value 'many' for '--spp <N>'"), "{message}");
        let (found, warnings) = from_environment(&[("STERADIAN_THREAD", "2"), ("STERADIAN_PIXEL", "1,2")]);
        assert!(found.unwrap().is_empty());
        assert!(
            warnings[0].contains("did you mean \"threads\"") && warnings[1].contains("belongs to the command line"),
            "{warnings:?}"
        );
    }

    #[test]
    fn every_option_of_render_has_its_class() {
        let mut command = Cli::command();
        command.build();
        let render = command.find_subcommand("render").unwrap();
        let is_opposite = |name: &&str| name.strip_prefix("no-").is_some_and(|name| trust(name).is_some());
        let mut options: Vec<&str> =
            render.get_arguments().filter_map(Arg::get_long).filter(|name| !is_opposite(name)).collect();
        let mut classified: Vec<&str> =
            steradian::internal::config::options().filter(|name| *name != "version").collect();
        options.sort_unstable();
        classified.sort_unstable();
        assert_eq!(options, classified);
        assert_eq!(trust("no-such-option"), None);
    }
}
