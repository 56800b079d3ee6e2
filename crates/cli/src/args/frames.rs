//! The command line of progress and of sequences of frames.

use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use steradian::internal::farm::{FORMATS, FrameList, ProgressFormat};

/// The format of progress, and which frames are rendered.
#[derive(Clone, Debug, Default, Args)]
pub struct SequenceArgs {
    /// The format of progress on stderr. Default: human on a terminal, plain elsewhere
    #[
        arg(
            long, value_name = "FORMAT", value_parser = formats(), long_help = progress_help(),
            help_heading = "Messages"
        )
    ]
    pub progress: Option<&'static ProgressFormat>,
    /// Render these frames: 1-100, 1-100x5 (every fifth), 3,7,9-12
    ///
    /// Names of files may hold a place for the number, #### or %04d (outputs without one get .#### before the
    /// extension). A scene with such a name is read for each frame. Any other scene is read once, and the shutter opens
    /// at frame F as much later as F is above 0: times of keyframes are frames. The animations of glTF files stand at
    /// --time plus F / --fps seconds. Each frame has noise of its own.
    #[arg(long, value_name = "FRAMES", allow_hyphen_values = true, help_heading = "Frames")]
    pub frames: Option<FrameList>,
    /// Frames in a second, for the animations of glTF files
    #[
        arg(
            long, value_name = "N", default_value_t = 24.0, value_parser = parse_fps, requires = "frames",
            help_heading = "Frames"
        )
    ]
    pub fps: f64,
    /// Overwrite existing frames; default: skip them
    #[arg(long, requires = "frames", help_heading = "Frames")]
    pub overwrite: bool,
    /// Continue after a frame that fails; the exit code is that of the first failure
    #[arg(long, requires = "frames", help_heading = "Frames")]
    pub keep_going: bool,
}

fn formats() -> impl TypedValueParser<Value = &'static ProgressFormat> {
    let names = FORMATS.iter().map(|format| format.name);
    PossibleValuesParser::new(names).try_map(|name| ProgressFormat::by_name(&name).ok_or("no such format"))
}

fn progress_help() -> String {
    let lines: Vec<_> = FORMATS.iter().map(|format| format!("  {:<10}{}", format.name, format.readers)).collect();
    format!("The format of progress on stderr. Default: human on a terminal, plain elsewhere\n\n{}", lines.join("\n"))
}

fn parse_fps(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|fps: &f64| *fps > 0.0 && fps.is_finite())
        .ok_or_else(|| "expected a number above 0".to_owned())
}
