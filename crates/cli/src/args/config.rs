//! The command line of `config`.

use std::path::PathBuf;

use clap::{Args, Subcommand};

const SHOW_EXAMPLES: &str = "\
Options of render may be given, the strongest first, on the command line; in the environment (STERADIAN_SPP for --spp, \
STERADIAN_MAX_DEPTH for --max-depth); in steradian.toml in the scene's folder; in \
$XDG_CONFIG_HOME/steradian/config.toml (or ~/.config/...); in the scene. Keys of files are the options without dashes:

  spp = 256
  threads = 8
  layers = [\"Z\", \"albedo\"]
  float = true
  exr = { profile = \"nuke\", compression = \"piz\" }

steradian.toml sets what the picture is; what is loaded, written or connected to (output, oidn-library, log-file, tev, \
preview, ...) belongs to the other places. Files of other users than you and root are not read.

Examples:
  steradian config show --origin room.json       Also where each value comes from
  steradian config show --json room.json";

/// The settings of the environment and of configuration files.
#[derive(Debug, Subcommand)]
pub enum ConfigCommand {
    /// Print the options that render has for a scene without a command line
    #[command(after_help = SHOW_EXAMPLES)]
    Show(ConfigShowArgs),
}

/// Arguments of `config show`.
#[derive(Debug, Args)]
pub struct ConfigShowArgs {
    /// The scene file; without it, as for a scene in the working directory
    pub scene: Option<PathBuf>,
    /// Also where each value comes from
    #[arg(long)]
    pub origin: bool,
    /// Print JSON, with origins
    #[arg(long)]
    pub json: bool,
}
