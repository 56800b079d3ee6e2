//! The command line of `view`.

use std::path::PathBuf;

use clap::Args;

pub const EXAMPLES: &str = "\
Examples:
  steradian view shot.exr
      Opens the picture in the browser: every layer, exposure, exact values of pixels.
  steradian view reference.exr shot.exr
      Two pictures, side by side under a slider, and how much they seem to differ (FLIP).
  steradian view shot.exr --no-open --port 8080
      On a machine without a screen; ssh -L 8080:127.0.0.1:8080 HOST brings the page here.";

/// Arguments of `view`.
#[derive(Clone, Debug, Args)]
pub struct ViewArgs {
    /// The EXR file, of any program
    #[arg(value_name = "FILE.exr")]
    pub file: PathBuf,
    /// An EXR file of the same size to compare it with
    #[arg(value_name = "FILE2.exr")]
    pub other: Option<PathBuf>,
    /// Port of the page; 0 for any free port
    #[arg(long, value_name = "PORT", default_value_t = 0)]
    pub port: u16,
    /// Print the page's address only, without opening a browser
    #[arg(long)]
    pub no_open: bool,
}
