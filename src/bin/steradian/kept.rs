//! Renders whose state is kept in a checkpoint, or goes into a shard.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use steradian::film::Image;
use steradian::import::{Imported, scene_fingerprint};
use steradian::output::RenderInfo;
use steradian::render::{
    self, Checkpoints, Header, Overrides, Progress, RenderResult, RenderSession, RenderState, Settings, Shard,
    StateFile,
};
use steradian::scene::Scene;
use steradian::{Error, Result};

use crate::args::StateArgs;
use crate::interrupt::Interrupt;
use crate::progress::Reporter;
use crate::text::counted;

/// The extension of shards.
const EXTENSION: &str = "shard";

/// The command line's options for the state.
pub struct Resumable<'a> {
    arguments: &'a StateArgs,
    shard: Shard,
    /// Where the shard goes, if the render is of one.
    pub shard_file: Option<StateFile>,
    checkpoint: Option<StateFile>,
}

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

impl<'a> Resumable<'a> {
    /// Takes the files, so that nobody else writes them; `None` if nothing is kept.
    pub fn new(
        arguments: &'a StateArgs,
        settings: &Settings,
        shard_file: Option<&Path>,
        checkpoint: Option<&Path>,
    ) -> Result<Option<Self>> {
        if checkpoint.is_none() && shard_file.is_none() {
            return Ok(None);
        }
        let shard = arguments.shard.unwrap_or_default();
        render::check_resumable(settings, shard)?;
        if let Some(path) = checkpoint
            && path.exists()
            && !arguments.resume
        {
            let message = "the file exists: --resume continues it; remove it to start over";
            return Err(Error::Usage(format!("--checkpoint {}: {message}", path.display())));
        }
        let take = |path: Option<&Path>| path.map(StateFile::take).transpose();
        Ok(Some(Self { arguments, shard, shard_file: take(shard_file)?, checkpoint: take(checkpoint)? }))
    }

    /// The header of checkpoints and shards of this render.
    pub fn header(
        &self,
        imported: &Imported,
        file: &Path,
        scene: &Scene,
        settings: &Settings,
        info: RenderInfo,
    ) -> Result<Header> {
        let fingerprint = scene_fingerprint(imported, file)?;
        Ok(Header { info, ..Header::new(&file.to_string_lossy(), fingerprint, scene, settings, self.shard) })
    }

    /// Renders from where the checkpoint is, and writes the shard.
    pub fn render(
        mut self,
        session: &RenderSession,
        header: &Header,
        reporter: &Reporter,
        interrupt: &Interrupt,
    ) -> Result<RenderResult> {
        let RenderSession { scene, settings, .. } = *session;
        let state = match self.checkpoint.as_ref().filter(|_| self.arguments.resume) {
            Some(file) if file.path().exists() => {
                let state = RenderState::read(file.path(), header, scene, settings)?;
                reporter.say(&format!(
                    "{}: continuing after {} per pixel",
                    file.path().display(),
                    counted(u64::from(state.done), "sample")
                ));
                state
            }
            Some(file) => {
                reporter.say(&format!("{}: no checkpoint yet, starting from the first sample", file.path().display()));
                RenderState::new(scene, settings, self.shard)?
            }
            None => RenderState::new(scene, settings, self.shard)?,
        };
        let mut checkpoints = self.checkpoint.take().map(|file| {
            Checkpoints::new(file, header.clone(), self.arguments.every, Arc::clone(&interrupt.checkpoint))
        });
        let (state, stats) = session.render(state, checkpoints.as_mut())?;
        // What an interrupted shard has is in its checkpoint; a shard that is there is complete.
        let unfinished = stats.interrupted && checkpoints.is_some();
        if state.torn && self.shard_file.is_some() && !unfinished {
            let message = "the pass under way took too long and was cancelled";
            if !stats.interrupted {
                return Err(Error::Usage(format!("--time-limit: {message}, so there is no shard")));
            }
            reporter.warn(&format!("{message}: no shard is written"));
        } else if let Some(file) = self.shard_file.as_ref().filter(|_| !unfinished) {
            file.replace(|out| state.write(header, out))?;
        }
        // A shard has no picture.
        let image = if self.shard_file.is_some() { Image::default() } else { state.picture(settings) };
        Ok(RenderResult { image, stats })
    }
}

/// Warns where SIGUSR1 was sent without a checkpoint file.
pub fn warn_of_request(interrupt: &Interrupt, reporter: &Reporter) {
    if interrupt.checkpoint.load(std::sync::atomic::Ordering::Relaxed) {
        reporter.warn("SIGUSR1 requests a checkpoint, which needs --checkpoint FILE");
    }
}
