//! What render loops have in common: passes, and what is done between them.

use std::sync::atomic::AtomicBool;
use std::time::Duration;

use super::limits::Limits;
use super::{Checkpoints, Job, Progress, RenderState, Settings, Stats};
use crate::integrator::Cancel;

/// A pass aims at this time: long enough to cost nothing, short enough that an interrupt is answered soon.
const PASS_TIME: Duration = Duration::from_millis(500);

/// Passes are not made shorter than this for the sake of checkpoints.
const LEAST_PASS_TIME: Duration = Duration::from_millis(50);

/// A render under way.
pub(super) struct Run<'a> {
    pub job: &'a Job<'a>,
    pub pool: &'a rayon::ThreadPool,
    pub settings: &'a Settings,
    pub progress: &'a dyn Progress,
    pub limits: Limits<'a>,
    cancel: &'a Cancel<'a>,
    checkpoints: Option<&'a mut Checkpoints>,
}

impl<'a> Run<'a> {
    /// Begins now.
    pub fn new(
        job: &'a Job<'a>,
        pool: &'a rayon::ThreadPool,
        settings: &'a Settings,
        progress: &'a dyn Progress,
        (stop, cancel): (&'a AtomicBool, &'a Cancel<'a>),
        checkpoints: Option<&'a mut Checkpoints>,
    ) -> Self {
        Self { job, pool, settings, progress, limits: Limits::new(settings, stop), cancel, checkpoints }
    }

    /// Notes that every pixel has a sample.
    pub fn has_picture(&self) {
        self.cancel.has_picture(self.settings.time_limit);
    }

    /// Whether the pass under way was given up, and in the statistics why: then tiles differ in their samples.
    pub fn has_given_up(&self, stats: &mut Stats) -> bool {
        self.cancel.given_up() && {
            self.limits.end(stats, true);
            true
        }
    }

    /// How long a pass may be, as far as checkpoints are due. Parts of a sample keep the processors less busy than all of it.
    pub fn longest_pass(&self) -> Option<Duration> {
        self.checkpoints.as_ref().map(|checkpoints| (checkpoints.every() / 4).max(LEAST_PASS_TIME))
    }

    /// Between two passes, the next of which is expected to take `next`: checkpoints, and pictures for whoever wants them.
    pub fn pass_done(&mut self, state: &mut RenderState, next: Duration) {
        if let Some(checkpoints) = &mut self.checkpoints {
            let (pool, progress, elapsed) = (self.pool, self.progress, self.limits.elapsed());
            pool.install(|| checkpoints.pass_done(state, elapsed, next, progress));
        }
        if self.progress.wants_picture() {
            self.progress.picture(&self.job.picture(&state.film), state.done);
        }
    }

    /// After the last pass.
    pub fn finish(&mut self, state: &mut RenderState) {
        let elapsed = self.limits.elapsed();
        if let Some(checkpoints) = self.checkpoints.as_mut().filter(|_| !state.torn) {
            let (pool, progress) = (self.pool, self.progress);
            pool.install(|| checkpoints.finish(state, elapsed, progress));
        }
        state.seconds += elapsed.as_secs_f64();
        self.progress.finish();
    }
}

/// How many samples the next pass should have, after one of `count` took `elapsed`.
pub(super) fn next_pass(count: u32, elapsed: Duration, remaining: Option<Duration>) -> u32 {
    let target = remaining.map_or(PASS_TIME, |r| r.min(PASS_TIME)).as_secs_f64();
    let fitting = f64::from(count) * target / elapsed.as_secs_f64().max(1e-6);
    (fitting as u32).clamp(1, count.saturating_mul(4))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passes_grow_towards_their_time_and_fit_what_remains() {
        assert_eq!(next_pass(1, Duration::from_millis(1), None), 4);
        assert_eq!(next_pass(8, Duration::from_secs(8), None), 1);
        assert_eq!(next_pass(8, Duration::from_millis(100), Some(Duration::from_millis(50))), 4);
    }
}
