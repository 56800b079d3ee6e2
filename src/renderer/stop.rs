//! How a render is stopped from elsewhere.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Ends a render, from any thread. Clones are handles to the same render.
#[derive(Clone, Debug, Default)]
pub struct StopHandle {
    flag: Arc<AtomicBool>,
}

impl StopHandle {
    /// Ends the render under way, and those that begin before [`reset`](Self::reset), after the pass under way, at the
    /// latest after a second. The picture has the samples taken so far.
    pub fn stop(&self) {
        self.flag.store(true, Ordering::Relaxed);
    }

    /// Whether the render is to end.
    pub fn is_stopped(&self) -> bool {
        self.flag.load(Ordering::Relaxed)
    }

    /// Renders may begin again.
    pub fn reset(&self) {
        self.flag.store(false, Ordering::Relaxed);
    }

    /// What becomes true to end the render.
    pub fn flag(&self) -> &AtomicBool {
        &self.flag
    }
}

impl From<Arc<AtomicBool>> for StopHandle {
    fn from(flag: Arc<AtomicBool>) -> Self {
        Self { flag }
    }
}
