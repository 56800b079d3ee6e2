//! The command line of EXR files: how they are written, checked and rendered again.

use std::path::PathBuf;

use clap::{ArgAction, Args};
use steradian::desc::{ExrProfileDesc, OutputDesc};
use steradian::internal::render::ExrOverrides;

use super::denoise::OidnArgs;
use crate::names;

pub const CHECK_EXAMPLES: &str = "\
Examples:
  steradian check-exr shot.exr --profile nuke
      Whether Nuke reads the file as it is meant.
  steradian check-exr frames/*.exr --fail-on-warning && echo clean
      Exit code 1 for warnings, too.

Exit codes: 0 no errors, 1 rules are broken, 3 no EXR file, 4 missing.";

pub const RERENDER_EXAMPLES: &str = "\
Examples:
  steradian rerender shot.exr -o again.exr
      The same picture bit for bit, from the scene and the settings that the file names.
  steradian rerender shot.exr -o fine.exr --spp 4096
      The same with more samples.
  steradian rerender shot.exr -o now.exr --allow-changed
      With the scene as it is today.";

/// The help of `--exr`: every key with its meaning and its values.
pub fn exr_help() -> String {
    let mut help =
        "EXR files: set keys of the scene's outputs, such as profile=nuke,compression=piz; repeat for more\n\n\
                    A comma in the text of owner or comments is a part of it. In configuration files these are keys of \
                    the table exr.\n"
            .to_owned();
    for (key, about, values) in names::keys::<OutputDesc, ExrOverrides>() {
        help.push_str(&format!("\n  {key:<17}{about}"));
        values.iter().for_each(|(value, about)| help.push_str(&format!("\n    {value:<15}{about}")));
    }
    help
}

/// Arguments of `check-exr`.
#[derive(Clone, Debug, Args)]
pub struct CheckExrArgs {
    /// The files to check, of any program
    #[arg(required = true, value_name = "FILE")]
    pub files: Vec<PathBuf>,
    /// Check against the rules of this profile
    #[arg(long, value_name = "PROFILE", value_parser = names::plain::<ExrProfileDesc>(), default_value = "default")]
    pub profile: ExrProfileDesc,
    /// Warnings count as errors
    #[arg(long)]
    pub fail_on_warning: bool,
    /// Print more messages: every place that breaks a rule, not only the first three
    #[arg(short, long, action = ArgAction::Count)]
    pub verbose: u8,
    /// Print JSON, with every place
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `rerender`.
#[derive(Clone, Debug, Args)]
pub struct RerenderArgs {
    /// The EXR file to render again
    #[arg(value_name = "FILE.exr")]
    pub file: PathBuf,
    /// File to write, .exr or .png
    #[arg(short, long, value_name = "OUT")]
    pub output: String,
    /// The scene file, if it was moved
    #[arg(long, value_name = "SCENE")]
    pub scene: Option<PathBuf>,
    /// Render even if the scene or its files have changed
    #[arg(long)]
    pub allow_changed: bool,
    /// Guide paths by what another render has learned: its --checkpoint, for a picture that was rendered with --guide
    #[arg(long, value_name = "FILE")]
    pub guide: Option<PathBuf>,
    /// Samples per pixel, in place of those of the picture
    #[arg(short = 's', long, value_name = "N")]
    pub spp: Option<u32>,
    /// Number of threads; 0 means all
    #[arg(short = 't', long, value_name = "N")]
    pub threads: Option<usize>,
    #[command(flatten)]
    pub oidn: OidnArgs,
    /// Print only errors
    #[arg(short, long)]
    pub quiet: bool,
}
