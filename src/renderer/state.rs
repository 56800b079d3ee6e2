//! Where the state of a render is kept, and which samples belong to it.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use crate::error::Result;
use crate::film::Image;
use crate::render::{
    Checkpoints, Header, RenderResult, RenderSession, RenderState, Settings, Shard, StateFile, check_resumable, refused,
};

/// Checkpoints and shards of a render.
#[derive(Clone, Debug)]
pub struct StateOptions {
    /// The file that keeps the state of the render.
    pub checkpoint: Option<PathBuf>,
    /// The checkpoint is written at least this often. Default: 60 s.
    pub every: Duration,
    /// Whether the render continues from the checkpoint if there is one.
    pub resume: bool,
    /// Which part of the samples is rendered. Default: all.
    pub shard: Shard,
    /// The file that the part is written to; it has no picture then.
    pub shard_file: Option<PathBuf>,
}

impl Default for StateOptions {
    fn default() -> Self {
        let every = Duration::from_secs(60);
        Self { checkpoint: None, every, resume: false, shard: Shard::WHOLE, shard_file: None }
    }
}

/// The files of a state, which nobody else writes as long as this lives.
pub struct StateFiles {
    options: StateOptions,
    shard_file: Option<StateFile>,
    checkpoint: Option<StateFile>,
}

impl StateFiles {
    /// Takes the files; `None` if nothing is kept.
    pub fn take(options: &StateOptions, settings: &Settings) -> Result<Option<Self>> {
        if options.checkpoint.is_none() && options.shard_file.is_none() {
            return Ok(None);
        }
        check_resumable(settings, options.shard)?;
        if let Some(path) = &options.checkpoint
            && path.exists()
            && !options.resume
        {
            let message = "the file exists: `resume` continues it; remove it to start over";
            return Err(refused("checkpoint", format!(" {}: {message}", path.display())));
        }
        let take = |path: Option<&Path>| path.map(StateFile::take).transpose();
        Ok(Some(Self {
            options: options.clone(),
            shard_file: take(options.shard_file.as_deref())?,
            checkpoint: take(options.checkpoint.as_deref())?,
        }))
    }

    pub fn shard(&self) -> Shard {
        self.options.shard
    }

    pub fn has_shard_file(&self) -> bool {
        self.shard_file.is_some()
    }

    /// Renders from where the checkpoint is, and writes the shard.
    pub fn render(
        mut self,
        session: &RenderSession,
        header: &Header,
        request: &Arc<AtomicBool>,
    ) -> Result<RenderResult> {
        let RenderSession { settings, progress, .. } = *session;
        let state = self.first_state(session, header)?;
        let every = self.options.every;
        let mut checkpoints =
            self.checkpoint.take().map(|file| Checkpoints::new(file, header.clone(), every, Arc::clone(request)));
        let (state, stats) = session.render(state, checkpoints.as_mut())?;
        // What an interrupted shard has is in its checkpoint; a shard that is there is complete.
        let unfinished = stats.interrupted && checkpoints.is_some();
        if state.is_uneven && self.shard_file.is_some() && !unfinished {
            let message = "the pass under way took too long and was cancelled";
            if !stats.interrupted {
                return Err(refused("time_limit", format!(": {message}, so there is no shard")));
            }
            progress.warn(&format!("{message}: no shard is written"));
        } else if let Some(file) = self.shard_file.as_ref().filter(|_| !unfinished) {
            file.replace(|out| state.write(header, out))?;
        }
        // A shard has no picture.
        let image = if self.shard_file.is_some() { Image::default() } else { state.picture(settings) };
        Ok(RenderResult { image, stats })
    }

    /// The state of the checkpoint that is to be continued, or one without samples.
    fn first_state(&self, session: &RenderSession, header: &Header) -> Result<RenderState> {
        let RenderSession { scene, settings, progress, .. } = *session;
        if let Some(file) = self.checkpoint.as_ref().filter(|_| self.options.resume) {
            let name = file.path().display();
            if file.path().exists() {
                let state = RenderState::read(file.path(), header, scene, settings)?;
                let noun = if state.done == 1 { "sample" } else { "samples" };
                progress.note(&format!("{name}: continuing after {} {noun} per pixel", state.done));
                return Ok(state);
            }
            progress.note(&format!("{name}: no checkpoint yet, starting from the first sample"));
        }
        RenderState::new(scene, settings, self.options.shard)
    }
}
