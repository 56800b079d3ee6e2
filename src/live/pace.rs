//! How often pictures are made: never so often that they take much of the render's time.

use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Pictures take at most one part in this many of the render's time.
const SHARE: u32 = 20;

/// Measures what pictures cost, from the question to the copy.
#[derive(Debug, Default)]
pub(super) struct Pace {
    state: Mutex<State>,
}

#[derive(Debug, Default)]
struct State {
    /// When a picture was last requested.
    requested: Option<Instant>,
    /// No picture before this time.
    next: Option<Instant>,
}

impl Pace {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether the next picture may be made; if so, this is when it was requested.
    pub fn may_request(&self) -> bool {
        let (now, mut state) = (Instant::now(), self.lock());
        let is_due = state.next.is_none_or(|next| now >= next);
        if is_due {
            state.requested = Some(now);
        }
        is_due
    }

    /// The requested picture has been made and copied.
    pub fn made(&self) {
        let (now, mut state) = (Instant::now(), self.lock());
        let cost = state.requested.take().map_or(Duration::ZERO, |requested| now - requested);
        state.next = Some(now + cost * (SHARE - 1));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dear_pictures_are_rare() {
        let pace = Pace::default();
        assert!(pace.may_request());
        std::thread::sleep(Duration::from_millis(50));
        let end = Instant::now();
        pace.made();
        assert!(end.elapsed() > Duration::from_millis(900) || !pace.may_request());
        while !pace.may_request() {
            std::thread::sleep(Duration::from_millis(1));
        }
        assert!(end.elapsed() >= Duration::from_millis(50) * (SHARE - 1));
        // One without a request costs nothing.
        let pace = Pace::default();
        pace.made();
        assert!(pace.may_request());
    }
}
