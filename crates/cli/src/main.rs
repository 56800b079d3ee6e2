//! The program `steradian`: results go to stdout, messages to stderr.

mod args;
#[cfg(feature = "bench")]
mod bench;
#[cfg(feature = "bench")]
mod bench_error;
#[cfg(feature = "bench")]
mod bench_scale;
mod check_exr;
mod compare;
mod config;
mod convert;
mod denoise;
mod farm;
mod files;
mod frames;
mod info;
mod interrupt;
mod kept;
mod log;
mod manual;
mod memory;
mod merge;
mod names;
mod progress;
mod render;
mod rerender;
mod scene;
mod skipped;
mod text;
mod view;

use std::path::Path;
use std::process::ExitCode;

use clap::CommandFactory;
use steradian::desc::SceneDesc;
use steradian::internal::import;
use steradian::internal::output::FileUses;
use steradian::{Error, ErrorKind, Result};

use args::{Cli, Command, ConfigCommand};
use log::Level;

/// Exit codes; the manual in `args` lists them too.
const INTERNAL: u8 = 1;

fn main() -> ExitCode {
    memory::grow_stack();
    report_panics();
    memory::handle_library_failures();
    match config::parse().and_then(start) {
        Ok(code) => ExitCode::from(code),
        Err(error) => {
            error.parts().iter().for_each(|error| log::message(Level::Error, &chain(error)));
            ExitCode::from(exit_code(error.kind()))
        }
    }
}

/// Compares the names of files, starts to log, shows the settings of the configuration, and runs the command.
fn start(parsed: config::Parsed) -> Result<u8> {
    let cli = parsed.cli;
    let mut uses = FileUses::default();
    parsed.files.iter().try_for_each(|file| uses.read(file, "configuration"))?;
    cli.log.log_file.iter().try_for_each(|file| uses.write(file, "--log-file"))?;
    files::of_command(&cli, uses.clone())?;
    log::start(&cli.log, cli.command.verbosity(), cli.command.log_format())?;
    parsed.warnings.iter().for_each(|warning| log::message(Level::Warning, warning));
    for setting in &parsed.added {
        let value = if setting.values.is_empty() { "false".to_owned() } else { setting.values.join(",") };
        log::message(Level::Info, &format!("{} = {value} ({})", setting.key, setting.origin));
    }
    run(cli, uses)
}

/// Runs a command, with the files of every command; the result is the exit code.
fn run(cli: Cli, uses: FileUses) -> Result<u8> {
    interrupt::outlive_file_limits()?;
    start_threads()?;
    match cli.command {
        Command::Render(arguments) => frames::run(&arguments, uses),
        Command::Info(arguments) => info::run(&arguments).map(|()| 0),
        #[cfg(feature = "bench")]
        Command::Bench(command) => bench::run(&command),
        #[cfg(not(feature = "bench"))]
        Command::Bench { .. } => Err(Error::Usage(
            "this program was built without benchmarks; `cargo build --release` builds it with them".into(),
        )),
        Command::Convert(arguments) => convert::run(&arguments, uses).map(|()| 0),
        Command::Farm(command) => farm::run(&command, uses).map(|()| 0),
        Command::Config(ConfigCommand::Show(arguments)) => config::show(&arguments).map(|()| 0),
        Command::Man { markdown: Some(folder), .. } => {
            manual::write(&manual::command_pages(args::command_line()), &folder).map(|()| 0)
        }
        Command::Man { dir, markdown: None } => man(dir.as_deref()).map(|()| 0),
        Command::Schema { markdown: Some(folder) } => {
            manual::write(&manual::format_pages(schemars::schema_for!(SceneDesc).as_value()), &folder).map(|()| 0)
        }
        Command::Schema { markdown: None } => text::print_as_it_is(&import::schema()).map(|()| 0),
        Command::Merge(arguments) => merge::run(&arguments, uses).map(|()| 0),
        Command::CheckExr(arguments) => check_exr::run(&arguments),
        Command::Rerender(arguments) => rerender::run(&arguments, uses),
        Command::Replay(_) => Err(Error::Usage("replay: give the scene, the pixel and the sample first".into())),
        Command::Compare(arguments) => compare::run(&arguments).map(|()| 0),
        Command::Denoise(arguments) => denoise::run(&arguments, uses).map(|()| 0),
        Command::View(arguments) => view::run(&arguments).map(|()| 0),
        Command::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(shell, &mut args::command_line(), "steradian", &mut script);
            text::print_as_it_is(String::from_utf8_lossy(&script).trim_end()).map(|()| 0)
        }
    }
}

/// Starts the threads that files are read and written with: they would be started when first needed, and end the
/// program if that fails.
fn start_threads() -> Result<()> {
    let count = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let started = rayon::ThreadPoolBuilder::new().build_global();
    started.map_err(|e| Error::Threads { count, message: e.to_string() })
}

/// Prints the manual page of the program, or writes those of all its commands.
fn man(folder: Option<&Path>) -> Result<()> {
    let pages = manual::man_pages(args::command_line())?;
    match (folder, pages.first()) {
        (None, Some(page)) => text::print_as_it_is(page.text.trim_end()),
        (None, None) => Ok(()),
        (Some(folder), _) => manual::write(&pages, folder),
    }
}

fn exit_code(kind: ErrorKind) -> u8 {
    match kind {
        ErrorKind::Internal => INTERNAL,
        ErrorKind::Usage => 2,
        ErrorKind::Scene => 3,
        ErrorKind::AssetMissing => 4,
        ErrorKind::Output => 5,
        ErrorKind::Checkpoint => 6,
        ErrorKind::OutOfMemory => 33,
    }
}

/// The error and what caused it, in one line.
fn chain(error: &Error) -> String {
    let mut line = match error {
        // What follows is in the words of the scene format.
        Error::Setting { setting: "set", message } => message.replacen("`set`", "--set", 1),
        Error::Setting { message, .. } => with_options(message),
        _ => error.to_string(),
    };
    let mut source = std::error::Error::source(error);
    while let Some(cause) = source {
        line.push_str(&format!(": {cause}"));
        source = cause.source();
    }
    line
}

/// A message in which settings such as `` `max_depth` `` are the options that set them, such as `--max-depth`.
fn with_options(message: &str) -> String {
    let render = Cli::command().find_subcommand("render").cloned().unwrap_or_default();
    let mut line = message.to_owned();
    for option in render.get_arguments().filter_map(clap::Arg::get_long) {
        line = line.replace(&format!("`{}`", option.replace('-', "_")), &format!("--{option}"));
    }
    line
}

/// A panic is a fault of the program, not of its input: it is reported in one line and ends with the code of an
/// internal failure.
fn report_panics() {
    std::panic::set_hook(Box::new(|panic| {
        let message = panic.payload_as_str().unwrap_or("unknown");
        memory::end_if_out_of_memory(message);
        let place = panic.location().map(ToString::to_string).unwrap_or_default();
        let version = env!("CARGO_PKG_VERSION");
        let text = format!(
            "internal error in steradian {version} at {place}: {message} (this is a bug; please report it with the \
             scene)"
        );
        log::message(Level::Error, &text);
        std::process::exit(i32::from(INTERNAL));
    }));
}
