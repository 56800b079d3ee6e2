//! The newest picture, and the pages that show it.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError, Weak};
use std::time::{Duration, Instant};

use super::Snapshot;
use crate::live::PICTURE_PERIOD;

/// A page without a request for this time counts as closed.
const PAGE_LIFE: Duration = Duration::from_secs(3);

/// Most pages that are waited for.
const MAX_PAGES: usize = 64;

/// Most pictures in responses at a time.
const MOST_SENT: usize = 4;

/// A page open somewhere.
struct Page {
    id: u64,
    /// When its last request came.
    seen: Instant,
    /// The picture that it has.
    version: u64,
    /// Whether nobody looks at it.
    idle: bool,
}

#[derive(Default)]
struct State {
    snapshot: Option<Arc<Snapshot>>,
    /// Number of the picture; 0 means none.
    version: u64,
    shown: Option<Instant>,
    finished: bool,
    pages: Vec<Page>,
    /// Pictures that responses hold while they are sent.
    sent: Vec<Weak<Snapshot>>,
}

impl State {
    fn open_pages(&self) -> impl Iterator<Item = &Page> {
        self.pages.iter().filter(|page| page.seen.elapsed() < PAGE_LIFE)
    }

    /// The page of this number; a new one if there is room.
    fn page(&mut self, id: u64) -> Option<&mut Page> {
        self.pages.retain(|page| page.id == id || page.seen.elapsed() < PAGE_LIFE);
        if !self.pages.iter().any(|page| page.id == id) && self.pages.len() < MAX_PAGES {
            self.pages.push(Page { id, seen: Instant::now(), version: 0, idle: false });
        }
        self.pages.iter_mut().find(|page| page.id == id)
    }
}

/// A picture with its number.
pub struct Shown {
    /// The picture; `None` before the first.
    pub snapshot: Option<Arc<Snapshot>>,
    /// Counts pictures.
    pub version: u64,
    /// Whether it is the last.
    pub finished: bool,
}

/// Where the render puts pictures and connections find them; locked only for moments.
#[derive(Default)]
pub struct Board {
    state: Mutex<State>,
    changed: Condvar,
}

impl Board {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether a page that has the newest picture is open, and that picture is not too young.
    pub fn needs_picture(&self) -> bool {
        let state = self.lock();
        let is_due = state.shown.is_none_or(|shown| shown.elapsed() >= PICTURE_PERIOD);
        is_due && !state.finished && state.open_pages().any(|page| page.version >= state.version && !page.idle)
    }

    /// Puts up a picture in place of the one before.
    pub fn show(&self, snapshot: &Arc<Snapshot>, is_final: bool) {
        let mut state = self.lock();
        // The old picture is given back without the lock.
        let old = state.snapshot.replace(Arc::clone(snapshot));
        state.version += 1;
        state.shown = Some(Instant::now());
        state.finished |= is_final;
        self.changed.notify_all();
        drop(state);
        drop(old);
    }

    /// What there is to see.
    pub fn current(&self) -> Shown {
        let state = self.lock();
        Shown { snapshot: state.snapshot.clone(), version: state.version, finished: state.finished }
    }

    /// What there is to see, to be sent, which may take long; `None` if slow readers hold [`MOST_SENT`] older pictures
    /// already.
    pub fn take(&self) -> Option<Shown> {
        let shown = self.current();
        let mut state = self.lock();
        state.sent.retain(|sent| sent.strong_count() > 0);
        if let Some(snapshot) = shown.snapshot.as_ref().map(Arc::downgrade)
            && !state.sent.iter().any(|sent| sent.ptr_eq(&snapshot))
        {
            if state.sent.len() >= MOST_SENT {
                return None;
            }
            state.sent.push(snapshot);
        }
        drop(state);
        Some(shown)
    }

    /// A page is open, has the picture of this number, and waits for the next one unless it is `idle`.
    pub fn visit(&self, page: u64, version: u64, idle: bool) {
        let mut state = self.lock();
        if let Some(page) = state.page(page) {
            page.seen = Instant::now();
            page.version = page.version.max(version);
            page.idle = idle;
        }
        self.changed.notify_all();
    }

    /// Waits until every page open has the newest picture, no longer than until `deadline`; returns whether they have.
    pub fn wait(&self, deadline: Instant) -> bool {
        let mut state = self.lock();
        loop {
            if state.open_pages().all(|page| page.version >= state.version) {
                return true;
            }
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return false;
            }
            // Pages close without a notification: check again now and then.
            state =
                self.changed.wait_timeout(state, left.min(PICTURE_PERIOD)).unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::{Crop, Image};

    #[test]
    fn pictures_are_wanted_only_while_somebody_waits_for_one() {
        let picture = Arc::new(Snapshot::new(&Image { size: [1, 1], crop: Crop::full([1, 1]), ..Image::default() }, 1));
        let board = Board::default();
        assert!(!board.needs_picture());
        board.visit(7, 0, true);
        assert!(!board.needs_picture());
        board.visit(7, 0, false);
        assert!(board.needs_picture());
        board.show(&picture, false);
        assert!(!board.needs_picture() && !board.wait(Instant::now()));
        // One of two pages has fetched it.
        board.visit(8, 0, false);
        board.visit(7, 1, false);
        std::thread::sleep(PICTURE_PERIOD);
        assert!(board.needs_picture());
        assert!(!board.wait(Instant::now()));
        board.visit(8, 1, false);
        assert!(board.wait(Instant::now()));
        board.show(&picture, true);
        board.visit(8, 2, false);
        std::thread::sleep(PICTURE_PERIOD);
        assert!(!board.needs_picture() && board.current().finished && board.current().version == 2);
    }

    #[test]
    fn slow_readers_hold_few_pictures() {
        let board = Board::default();
        let show = || {
            let image = Image { size: [1, 1], crop: Crop::full([1, 1]), ..Image::default() };
            board.show(&Arc::new(Snapshot::new(&image, 1)), false);
        };
        assert!(board.take().is_some_and(|shown| shown.snapshot.is_none()));
        let mut held = Vec::new();
        for _ in 0..MOST_SENT {
            show();
            held.push(board.take().unwrap());
            held.push(board.take().unwrap());
        }
        show();
        assert!(board.take().is_none() && board.current().version == MOST_SENT as u64 + 1);
        held.drain(..2);
        assert!(board.take().is_some());
    }

    #[test]
    fn there_is_room_for_so_many_pages_only() {
        let board = Board::default();
        (0..MAX_PAGES as u64 + 5).for_each(|page| board.visit(page, 0, false));
        assert_eq!(board.lock().pages.len(), MAX_PAGES);
    }
}
