//! Checkpoints on the way: when they are due, and what becomes of a render whose checkpoint cannot be written.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use super::{Header, RenderState, StateFile};
use crate::render::Progress;

/// Keeps the state of a render in a file.
#[derive(Debug)]
pub struct Checkpoints {
    file: StateFile,
    header: Header,
    every: Duration,
    requested: Arc<AtomicBool>,
    /// When the state in the file was taken, or the render began.
    last: Instant,
    /// How long the last one took to be written.
    cost: Duration,
    /// Whether the last one could not be written.
    failed: bool,
}

impl Checkpoints {
    /// At least this often (`every`), and between the next two passes whenever `requested` becomes true (it becomes
    /// false again).
    pub fn new(file: StateFile, header: Header, every: Duration, requested: Arc<AtomicBool>) -> Self {
        Self { file, header, every, requested, last: Instant::now(), cost: Duration::ZERO, failed: false }
    }

    /// The interval.
    pub(in crate::render) fn every(&self) -> Duration {
        self.every
    }

    /// A pass is done, `elapsed` after this run began, and the next one is expected to take `next`: writes the state if
    /// the interval would be over when that is in the file.
    pub(in crate::render) fn pass_done(
        &mut self,
        state: &RenderState,
        elapsed: Duration,
        next: Duration,
        progress: &dyn Progress,
    ) {
        let requested = self.requested.swap(false, Ordering::Relaxed);
        if requested || self.last.elapsed() + next + self.cost >= self.every {
            self.write_checkpoint(state, elapsed, progress);
        }
    }

    /// The last pass is done.
    pub(in crate::render) fn finish(&mut self, state: &RenderState, elapsed: Duration, progress: &dyn Progress) {
        self.write_checkpoint(state, elapsed, progress);
    }

    /// Writes the state. A failure is a warning and does not end the render: the earlier checkpoint is unchanged.
    fn write_checkpoint(&mut self, state: &RenderState, elapsed: Duration, progress: &dyn Progress) {
        let start = Instant::now();
        let seconds = state.seconds + elapsed.as_secs_f64();
        let written = self.file.replace(|out| state.write_with(&self.header, seconds, out));
        self.last = start;
        self.cost = start.elapsed();
        let failed = written.is_err();
        match written {
            Ok(()) if self.failed => progress.warn(&format!("{} could be written again", self.file.path().display())),
            Ok(()) => tracing::info!("{}: written in {:.3} s", self.file.path().display(), self.cost.as_secs_f64()),
            Err(error) if !self.failed => {
                progress.warn(&format!("{error}; the render goes on without a checkpoint of its present state"));
            }
            Err(_) => {}
        }
        self.failed = failed;
    }
}
