//! The program `steradian`: results go to stdout, messages to stderr.

mod args;
mod bench;
mod bench_error;
mod bench_scale;
mod compare;
mod convert;
mod frames;
mod info;
mod interrupt;
mod log;
mod names;
mod progress;
mod render;
mod scene;
mod stats;
mod text;

use std::process::ExitCode;

use clap::{CommandFactory, Parser};
use steradian::{Error, ErrorKind, Result, import};

use args::{Cli, Command};
use log::Level;

/// Exit codes; the manual in `args` lists them too.
const INTERNAL: u8 = 1;

fn main() -> ExitCode {
    report_panics();
    let cli = Cli::parse();
    let started = log::start(&cli.log, cli.command.verbosity(), cli.command.log_format());
    match started.and_then(|()| run(cli)) {
        Ok(code) => ExitCode::from(code),
        Err(error) => {
            log::message(Level::Error, &chain(&error));
            ExitCode::from(exit_code(error.kind()))
        }
    }
}

/// Runs a command; the result is the exit code.
fn run(cli: Cli) -> Result<u8> {
    match cli.command {
        Command::Render(arguments) => frames::run(&arguments),
        Command::Info(arguments) => info::run(&arguments).map(|()| 0),
        Command::Bench(command) => bench::run(&command),
        Command::Convert(arguments) => convert::run(&arguments).map(|()| 0),
        Command::Schema => text::print(&import::schema()).map(|()| 0),
        Command::Compare(arguments) => compare::run(&arguments).map(|()| 0),
        Command::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(shell, &mut Cli::command(), "steradian", &mut script);
            text::print(String::from_utf8_lossy(&script).trim_end()).map(|()| 0)
        }
    }
}

fn exit_code(kind: ErrorKind) -> u8 {
    match kind {
        ErrorKind::Internal => INTERNAL,
        ErrorKind::Usage => 2,
        ErrorKind::Scene => 3,
        ErrorKind::AssetMissing => 4,
        ErrorKind::Output => 5,
        ErrorKind::OutOfMemory => 33,
    }
}

/// The error and what caused it, in one line.
fn chain(error: &Error) -> String {
    let mut line = error.to_string();
    let mut source = std::error::Error::source(error);
    while let Some(cause) = source {
        line.push_str(&format!(": {cause}"));
        source = cause.source();
    }
    line
}

/// A panic is a fault of the program, not of its input: it says so in one line and ends with the code of an internal failure.
fn report_panics() {
    std::panic::set_hook(Box::new(|panic| {
        let message = panic.payload_as_str().unwrap_or("unknown");
        let place = panic.location().map(ToString::to_string).unwrap_or_default();
        let version = env!("CARGO_PKG_VERSION");
        let text = format!("internal error in steradian {version} at {place}: {message} (this is a bug; please report it with the scene)");
        log::message(Level::Error, &text);
        std::process::exit(i32::from(INTERNAL));
    }));
}
