//! The command line of messages, the same for every command.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

/// How messages are shown.
#[derive(Clone, Debug, Default, Args)]
pub struct LogArgs {
    /// Messages as text, or as one JSON object a line. Default: text; json with --progress json
    #[arg(long, global = true, value_name = "FORMAT", help_heading = "Messages")]
    pub log_format: Option<LogFormat>,
    /// Also add messages to this file, those of -v too and regardless of --quiet, each with its time
    #[arg(long, global = true, value_name = "FILE", help_heading = "Messages")]
    pub log_file: Option<PathBuf>,
    /// Colours: auto means on a terminal, unless NO_COLOR is set or TERM is dumb, and wherever CLICOLOR_FORCE is set
    #[arg(long, global = true, value_name = "WHEN", default_value = "auto", help_heading = "Messages")]
    pub color: ColorChoice,
}

/// The form of messages.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum LogFormat {
    /// Lines for people.
    #[default]
    Text,
    /// One JSON object a line.
    Json,
}

/// When there are colours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum ColorChoice {
    /// Where they are seen as such.
    #[default]
    Auto,
    /// Even into files.
    Always,
    /// Nowhere.
    Never,
}
