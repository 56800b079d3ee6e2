//! Giving up a batch under way, so that a render ends soon even where a pass would take hours.
//!
//! Passes are short, and a render that is to end finishes the one under way. Only where that takes long are batches
//! cancelled: their samples are not added to the film.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// A pass under way may go on for so long after the render is to end.
pub const GRACE: Duration = Duration::from_secs(1);

/// Bounces of a wave of paths between two looks.
pub(super) const BOUNCES: u32 = 16;

/// Not yet, in milliseconds since the start.
const NEVER: u64 = u64::MAX;

/// Whether batches under way are to be cancelled. Once they are, that does not change.
#[derive(Debug)]
pub struct Cancel<'a> {
    stop: &'a AtomicBool,
    start: Instant,
    /// When the time is up, and when `stop` was first seen raised; in milliseconds since the start.
    deadline: AtomicU64,
    stopped: AtomicU64,
    is_cancelled: AtomicBool,
}

impl<'a> Cancel<'a> {
    /// From now on: when `stop` has been up for a second. With a time limit also when twice that limit is over; see
    /// [`has_picture`](Self::has_picture).
    pub fn new(stop: &'a AtomicBool, time_limit: Option<Duration>) -> Self {
        let cancel = Self {
            stop,
            start: Instant::now(),
            deadline: AtomicU64::new(NEVER),
            stopped: AtomicU64::new(NEVER),
            is_cancelled: AtomicBool::new(false),
        };
        cancel.set_deadline(time_limit.map(|limit| limit.saturating_mul(2)));
        cancel
    }

    /// There is a picture: from now on the time limit is for the rest.
    pub fn has_picture(&self, time_limit: Option<Duration>) {
        self.set_deadline(time_limit);
    }

    fn set_deadline(&self, limit: Option<Duration>) {
        let milliseconds = |limit: Duration| u64::try_from(limit.saturating_add(GRACE).as_millis()).unwrap_or(NEVER);
        self.deadline.store(limit.map_or(NEVER, milliseconds), Ordering::Relaxed);
    }

    /// Whether batches are to be cancelled; reads the clock only if the render has a limit or a stop flag.
    #[inline]
    pub(super) fn is_due(&self) -> bool {
        let stop = self.stop.load(Ordering::Relaxed);
        (stop || self.deadline.load(Ordering::Relaxed) != NEVER) && self.check(stop)
    }

    #[cold]
    fn check(&self, stop: bool) -> bool {
        let elapsed = u64::try_from(self.start.elapsed().as_millis()).unwrap_or(NEVER - 1);
        if stop {
            self.stopped.fetch_min(elapsed, Ordering::Relaxed);
        }
        let stopped = self.stopped.load(Ordering::Relaxed);
        let waited = stopped != NEVER && elapsed.saturating_sub(stopped) >= GRACE.as_millis() as u64;
        if waited || elapsed >= self.deadline.load(Ordering::Relaxed) {
            self.is_cancelled.store(true, Ordering::Relaxed);
        }
        self.is_cancelled()
    }

    /// Whether some batch was cancelled; those of the pass under way that have ended since may not be whole.
    pub fn is_cancelled(&self) -> bool {
        self.is_cancelled.load(Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn batches_are_given_up_a_while_after_the_signal_and_for_good() {
        let stop = AtomicBool::new(false);
        let cancel =
            Cancel { start: Instant::now().checked_sub(Duration::from_secs(60)).unwrap(), ..Cancel::new(&stop, None) };
        assert!(!cancel.is_due());
        stop.store(true, Ordering::Relaxed);
        assert!(!cancel.is_due());
        cancel.stopped.store(58_000, Ordering::Relaxed);
        assert!(cancel.is_due() && cancel.is_cancelled());
        stop.store(false, Ordering::Relaxed);
        assert!(cancel.is_cancelled());
    }

    #[test]
    fn a_first_picture_gets_twice_the_time() {
        let stop = AtomicBool::new(false);
        let minute = Some(Duration::from_secs(60));
        let after = |seconds: u64| Cancel {
            start: Instant::now().checked_sub(Duration::from_secs(seconds)).unwrap(),
            ..Cancel::new(&stop, minute)
        };
        assert!(!after(115).is_due() && after(122).is_due());
        let cancel = after(90);
        cancel.has_picture(minute);
        assert!(cancel.is_due());
    }
}
