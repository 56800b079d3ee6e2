//! Arguments of checkpoints, shards and `merge`.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use steradian::internal::render::Shard;

pub const MERGE_EXAMPLES: &str = "\
Examples:
  steradian merge cornell.*-of-8.shard -o cornell.exr
      The picture of all eight.
  steradian merge cornell.*-of-8.shard -o cornell.exr --partial
      The picture of the shards that exist.
  steradian merge cornell.state -o now.exr --partial
      The picture of a render so far, from its checkpoint.";

/// Where the state of a render is kept, and which samples belong to it.
#[derive(Clone, Debug, Args)]
pub struct StateArgs {
    /// Keep the state of the render in this file, for --resume
    ///
    /// It is replaced as a whole, so a render killed at any moment loses at most the samples of the last interval.
    /// SIGUSR1 writes it at once; Ctrl-C and SIGTERM write it before the picture. It stays when the picture is done:
    /// --resume with a larger --spp adds the missing samples (not with --guiding, where they depend on how many
    /// there are).
    #[arg(long, value_name = "FILE", help_heading = "State")]
    pub checkpoint: Option<PathBuf>,
    /// Write the checkpoint at least this often
    #[
        arg(
            long, value_name = "SECONDS", value_parser = parse_seconds, default_value = "60", requires = "checkpoint",
            help_heading = "State"
        )
    ]
    pub every: Duration,
    /// Continue an interrupted run: from the checkpoint, if there is one; the picture is the same bit for bit as
    /// without the interruption
    #[arg(long, requires = "checkpoint", help_heading = "State")]
    pub resume: bool,
    /// Render only part I of N of the samples of every pixel, counted from 1, into a file for `steradian merge`
    ///
    /// -o names the file, which ends with .shard; without it, that is SCENE.I-of-N.shard. All parts are to have the
    /// same options; merged, they are the same picture bit for bit as in one run. Not with --target-error or
    /// --guiding, but with --guide.
    #[arg(long, value_name = "I/N", help_heading = "State")]
    pub shard: Option<Shard>,
}

/// Arguments of `merge`.
#[derive(Clone, Debug, Args)]
pub struct MergeArgs {
    /// The shards, in any order; or one checkpoint
    #[arg(required = true)]
    pub shards: Vec<PathBuf>,
    /// File to write, .exr or .png; repeat for several. Without it, what the render would have written
    #[arg(short, long, value_name = "FILE")]
    pub output: Vec<String>,
    /// Merge even if shards or samples are missing; an EXR lists them in its attribute steradian/partial
    #[arg(long)]
    pub partial: bool,
    /// Print only errors
    #[arg(short, long)]
    pub quiet: bool,
}

fn parse_seconds(text: &str) -> Result<Duration, String> {
    let seconds = text.trim().parse().ok().and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
    seconds.ok_or_else(|| "expected a number of seconds".to_owned())
}
