//! Names of shards, and requests for checkpoints.

use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use steradian::internal::render::{Overrides, Progress};
use steradian::{Error, Result};

use crate::args::StateArgs;
use crate::interrupt::Interrupt;
use crate::progress::Reporter;

/// The extension of shards.
const EXTENSION: &str = "shard";

/// Takes the name of the shard out of the outputs; the others determine the layers of pictures.
pub fn take_shard_name(arguments: &StateArgs, scene: &Path, overrides: &mut Overrides) -> Result<Option<PathBuf>> {
    let is_shard = |name: &String| Path::new(name).extension().is_some_and(|e| e.eq_ignore_ascii_case(EXTENSION));
    let Some(shard) = arguments.shard else { return Ok(None) };
    let names = std::mem::take(&mut overrides.outputs);
    match names.as_slice() {
        [] => {
            let stem = scene.file_stem().map_or("picture".into(), |stem| stem.to_string_lossy().into_owned());
            Ok(Some(format!("{stem}.{}-of-{}.{EXTENSION}", shard.index, shard.count).into()))
        }
        [name] if is_shard(name) => Ok(Some(name.into())),
        _ => Err(Error::Usage(format!(
            "-o {}: with --shard, one file whose name ends with .{EXTENSION}",
            names.join(" -o ")
        ))),
    }
}

/// Warns where SIGUSR1 was sent without a checkpoint file.
pub fn warn_of_request(interrupt: &Interrupt, reporter: &Reporter) {
    if interrupt.checkpoint.load(Ordering::Relaxed) {
        reporter.warn("SIGUSR1 requests a checkpoint, which needs --checkpoint FILE");
    }
}
