//! The command line of EXR files: how they are written, checked and rendered again.

use std::path::PathBuf;

use clap::Args;
use steradian::desc::{CompressionDesc, CryptoManifestDesc, ExrProfileDesc};
use steradian::internal::render::ExrOverrides;

use super::denoise::OidnArgs;
use crate::names;

pub const CHECK_EXAMPLES: &str = "\
Examples:
  steradian check-exr shot.exr --profile nuke
      Whether Nuke reads the file as it is meant.
  steradian check-exr frames/*.exr --strict && echo clean
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

/// How EXR files are written.
#[derive(Clone, Debug, Default, Args)]
#[command(next_help_heading = "EXR files")]
pub struct ExrArgs {
    /// EXR profile: channel names, parts and compression for one application
    #[arg(long, value_name = "PROFILE", value_parser = names::plain::<ExrProfileDesc>())]
    pub exr_profile: Option<ExrProfileDesc>,
    /// EXR: compression. dwaa and dwab lose a little, and are only for colour
    #[arg(long, value_name = "NAME", value_parser = names::plain::<CompressionDesc>())]
    pub compression: Option<CompressionDesc>,
    /// EXR: how much dwaa and dwab lose; 45 unless given
    #[arg(long, value_name = "LEVEL")]
    pub dwa_level: Option<f32>,
    /// EXR: store the whole picture, black around the crop, for programs that ignore data windows
    #[arg(long)]
    pub uncropped: bool,
    /// EXR: Cryptomatte ranks, the number of objects stored per pixel. Default: 6
    #[arg(long, value_name = "N")]
    pub crypto_depth: Option<u32>,
    /// EXR: where Cryptomatte's names are stored: in the file or beside it
    #[arg(long, value_name = "PLACE", value_parser = names::plain::<CryptoManifestDesc>())]
    pub crypto_manifest: Option<CryptoManifestDesc>,
    /// EXR: the attribute owner
    #[arg(long, value_name = "TEXT")]
    pub owner: Option<String>,
    /// EXR: text to prepend to the attribute comments
    #[arg(long, value_name = "TEXT")]
    pub comments: Option<String>,
}

impl ExrArgs {
    /// What the settings need of it; `frames_per_second` is that of a sequence.
    pub fn overrides(&self, frames_per_second: Option<f64>) -> ExrOverrides {
        ExrOverrides {
            profile: self.exr_profile,
            compression: self.compression,
            dwa_level: self.dwa_level,
            uncropped: self.uncropped,
            crypto_depth: self.crypto_depth,
            crypto_manifest: self.crypto_manifest,
            owner: self.owner.clone(),
            comments: self.comments.clone(),
            frames_per_second,
        }
    }
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
    pub strict: bool,
    /// Name every place that breaks a rule, not only the first three
    #[arg(short, long)]
    pub verbose: bool,
    /// As JSON, with every place
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
    /// The checkpoint with the guide of a picture that was rendered with --guide
    #[arg(long, value_name = "FILE")]
    pub guide: Option<PathBuf>,
    /// Other samples per pixel
    #[arg(long, value_name = "N")]
    pub spp: Option<u32>,
    /// Number of threads; 0 means all
    #[arg(long, value_name = "N")]
    pub threads: Option<usize>,
    #[command(flatten)]
    pub oidn: OidnArgs,
    /// Print only errors
    #[arg(short, long)]
    pub quiet: bool,
}
