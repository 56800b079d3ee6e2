//! What may end a render before all samples are done.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use super::{Settings, Stats};

/// The start of a render, its time limit, and whoever may ask for its end.
pub(super) struct Limits<'a> {
    start: Instant,
    time: Option<Duration>,
    stop: &'a AtomicBool,
}

impl<'a> Limits<'a> {
    /// From now on.
    pub fn new(settings: &Settings, stop: &'a AtomicBool) -> Self {
        Self { start: Instant::now(), time: settings.time_limit, stop }
    }

    /// Wall-clock time since the start.
    pub fn elapsed(&self) -> Duration {
        self.start.elapsed()
    }

    /// Time left, if it is limited.
    pub fn remaining(&self) -> Option<Duration> {
        self.time.map(|limit| limit.saturating_sub(self.elapsed()))
    }

    /// Whether the render is to end, and in the statistics why. Time runs out only where there is a picture.
    pub fn end(&self, stats: &mut Stats, has_picture: bool) -> bool {
        stats.interrupted = self.stop.load(Ordering::Relaxed);
        stats.time_limited = !stats.interrupted && has_picture && self.remaining().is_some_and(|left| left.is_zero());
        stats.interrupted || stats.time_limited
    }
}
