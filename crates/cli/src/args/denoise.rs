//! The command line of what denoises.

use std::path::PathBuf;

use clap::Args;
use steradian::desc::ViewDesc;

use crate::names;

pub const ABOUT: &str = "\
Denoise an EXR file with Intel Open Image Denoise

The colour of any renderer's EXR file is denoised, with the help of its layers of albedo and normals: Steradian's \
(feature_albedo, feature_normal), else those of Blender (Denoising Albedo, Denoising Normal), pbrt (Albedo, Ns, N), \
Mitsuba (albedo, sh_normal). Noisy ones are denoised first. Light groups (light_NAME) that add up to the colour still \
do so afterwards. All other layers and attributes stay as they are; the colour as it was becomes layer noisy.";

pub const EXAMPLES: &str = "\
Examples:
  steradian denoise noisy.exr clean.exr -o clean.png
      With the albedo and normals that the file has.
  steradian denoise noisy.exr clean.exr --albedo diffcolor --normal worldNormal
      With those of these layers.
  steradian denoise frame.####.exr clean.####.exr
      All frames of a sequence, each by itself.

The library is loaded when it is needed: `pip install pyoidn` installs it.";

/// Where the denoiser is.
#[derive(Clone, Debug, Default, Args)]
pub struct OidnArgs {
    /// Intel Open Image Denoise: its file libOpenImageDenoise.so.2, or a folder with it
    ///
    /// Else that of the environment variable STERADIAN_OIDN; else the system's; else that of Python's package pyoidn,
    /// in the active environment, that of python3, or ~/.local.
    #[arg(long, value_name = "PATH", help_heading = "Run")]
    pub oidn_library: Option<PathBuf>,
}

/// Denoising options of `render`.
#[derive(Clone, Debug, Default, Args)]
pub struct RenderDenoiseArgs {
    /// Denoise the picture with Intel Open Image Denoise; EXR files keep the original as layer noisy
    ///
    /// The render also makes the layers feature_albedo and feature_normal, which are stored only if --layers names
    /// them. Light groups are denoised so that they still sum to the picture. Shards are denoised when they are merged,
    /// by `steradian denoise`.
    #[arg(long, conflicts_with = "shard", help_heading = "Picture")]
    pub denoise: bool,
    #[command(flatten)]
    pub oidn: OidnArgs,
}

/// Arguments of `denoise`.
#[derive(Debug, Args)]
pub struct DenoiseArgs {
    /// The file to denoise; #### is replaced by the number of a frame
    pub input: PathBuf,
    /// The file to write, .exr; #### is replaced by the same number
    pub output: PathBuf,
    /// File to write, .png, besides; repeat for several
    #[arg(short = 'o', long = "output", value_name = "FILE.png")]
    pub also: Vec<PathBuf>,
    /// The layer that holds the albedo: its name before the dot
    #[arg(long, value_name = "LAYER")]
    pub albedo: Option<String>,
    /// The layer that holds the normals
    #[arg(long, value_name = "LAYER")]
    pub normal: Option<String>,
    /// Use neither albedo nor normals
    #[arg(long, conflicts_with_all = ["albedo", "normal"])]
    pub no_features: bool,
    /// PNG: exposure in stops; 1 is twice as bright
    #[arg(long, value_name = "STOPS", default_value_t = 0.0, allow_negative_numbers = true)]
    pub exposure: f32,
    /// PNG: how light becomes colours of the display
    #[
        arg(
            long, value_name = "NAME", default_value = ViewDesc::default().name(),
            value_parser = names::plain::<ViewDesc>()
        )
    ]
    pub view: ViewDesc,
    /// Number of threads; 0 means all
    #[arg(short = 't', long, value_name = "N", default_value_t = 0, help_heading = "Run")]
    pub threads: usize,
    #[command(flatten)]
    pub oidn: OidnArgs,
    /// Print JSON: what was done, an object a file
    #[arg(long, help_heading = "Run")]
    pub json: bool,
    /// Print only errors
    #[arg(short, long, help_heading = "Run")]
    pub quiet: bool,
}
