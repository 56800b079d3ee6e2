//! The command line of messages, the same for every command.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

/// How messages are shown.
#[derive(Clone, Debug, Default, Args)]
pub struct LogArgs {
    /// Format of messages. Default: text; json with --progress json
    #[arg(long, global = true, hide_short_help = true, value_name = "FORMAT", help_heading = "Messages")]
    pub log_format: Option<LogFormat>,
    /// Append messages to this file, each with its time; those of -v too, even with --quiet
    #[arg(long, global = true, hide_short_help = true, value_name = "FILE", help_heading = "Messages")]
    pub log_file: Option<PathBuf>,
    /// When messages have colours
    #[arg(
        long,
        global = true,
        hide_short_help = true,
        value_name = "WHEN",
        default_value = "auto",
        help_heading = "Messages"
    )]
    pub color: ColorChoice,
}

/// The form of messages.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum LogFormat {
    /// Lines of text.
    #[default]
    Text,
    /// One JSON object a line.
    Json,
}

/// When there are colours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum ColorChoice {
    /// On a terminal, unless NO_COLOR is set or TERM is dumb; everywhere if CLICOLOR_FORCE is set.
    #[default]
    Auto,
    /// Everywhere, in files too.
    Always,
    /// Nowhere.
    Never,
}
