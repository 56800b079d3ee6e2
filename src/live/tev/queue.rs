//! The place for one picture between the render and the thread that sends.

use std::net::{Shutdown, TcpStream};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use super::Snapshot;

/// What has happened between a render and tev.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TevCounters {
    /// Connections made.
    pub connections: u64,
    /// Pictures handed over by the render.
    pub offered: u64,
    /// Of them, those that a newer one replaced before they were sent.
    pub replaced: u64,
    /// Of them, those that the sender took.
    pub taken: u64,
    /// Pictures sent to their end.
    pub sent: u64,
    /// Tiles sent.
    pub tiles_sent: u64,
    /// Tiles not sent because the viewer had them.
    pub tiles_unchanged: u64,
}

/// Whether somebody is there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Viewer {
    /// The first attempt to connect is under way.
    Sought,
    Connected,
    /// There was somebody once.
    Lost,
    /// Nobody answered so far.
    Absent,
}

struct State {
    viewer: Viewer,
    waiting: Option<Arc<Snapshot>>,
    /// When the last picture was handed over.
    offered: Option<Instant>,
    /// The render has ended: what waits is the last picture.
    finishing: bool,
    /// The sender has ended.
    ended: bool,
    /// The last picture has been sent.
    delivered: bool,
    /// To end a write that takes too long.
    socket: Option<TcpStream>,
    counters: TevCounters,
}

/// Shared by the render and the sender; locked only for moments.
pub(super) struct Queue {
    state: Mutex<State>,
    changed: Condvar,
    period: Duration,
}

impl Queue {
    pub fn new(period: Duration) -> Self {
        let state = State {
            viewer: Viewer::Sought,
            waiting: None,
            offered: None,
            finishing: false,
            ended: false,
            delivered: false,
            socket: None,
            counters: TevCounters::default(),
        };
        Self { state: Mutex::new(state), changed: Condvar::new(), period }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub fn is_connected(&self) -> bool {
        self.lock().viewer == Viewer::Connected
    }

    pub fn needs_picture(&self) -> bool {
        let state = self.lock();
        let is_due = state.offered.is_none_or(|last| last.elapsed() >= self.period);
        state.viewer == Viewer::Connected && state.waiting.is_none() && is_due && !state.finishing
    }

    pub fn offer(&self, snapshot: &Arc<Snapshot>) {
        self.put(snapshot, false);
    }

    pub fn offer_final(&self, snapshot: &Arc<Snapshot>) {
        self.put(snapshot, true);
    }

    /// Under one lock, so that the last picture is not sent before it is known to be the last.
    fn put(&self, snapshot: &Arc<Snapshot>, is_last: bool) {
        let mut state = self.lock();
        state.finishing |= is_last;
        state.offered = Some(Instant::now());
        state.counters.offered += 1;
        if state.waiting.replace(Arc::clone(snapshot)).is_some() {
            state.counters.replaced += 1;
        }
        self.changed.notify_all();
    }

    pub fn wait(&self, deadline: Instant) -> bool {
        let state = self.lock();
        let left = deadline.saturating_duration_since(Instant::now());
        let open = |state: &mut State| !state.ended && state.viewer != Viewer::Absent;
        let (state, _) = self.changed.wait_timeout_while(state, left, open).unwrap_or_else(PoisonError::into_inner);
        state.delivered
    }

    pub fn close(&self) {
        let mut state = self.lock();
        state.finishing = true;
        if let Some(socket) = state.socket.take().filter(|_| !state.delivered) {
            // A write under way ends with an error, which is no longer reported.
            let _ = socket.shutdown(Shutdown::Both);
        }
        self.changed.notify_all();
    }

    pub fn counters(&self) -> TevCounters {
        self.lock().counters
    }

    /// The sender has a connection.
    pub fn connected(&self, socket: Option<TcpStream>) {
        let mut state = self.lock();
        (state.viewer, state.socket) = (Viewer::Connected, socket);
        state.counters.connections += 1;
        self.changed.notify_all();
    }

    /// The sender has no connection.
    pub fn disconnected(&self) {
        let mut state = self.lock();
        state.viewer = if state.counters.connections > 0 { Viewer::Lost } else { Viewer::Absent };
        state.socket = None;
        self.changed.notify_all();
    }

    /// The sender ends.
    pub fn ended(&self) {
        let mut state = self.lock();
        (state.ended, state.socket) = (true, None);
        self.changed.notify_all();
    }

    /// For the sender: waits for a picture and takes it, not before `earliest` unless the render has ended. If none
    /// waits, `unsent` is it. `None` when there is nothing left to send.
    pub fn next(&self, earliest: Instant, unsent: Option<&Arc<Snapshot>>) -> Option<Arc<Snapshot>> {
        let left = earliest.saturating_duration_since(Instant::now());
        let (mut state, _) = self
            .changed
            .wait_timeout_while(self.lock(), left, |state| !state.finishing)
            .unwrap_or_else(PoisonError::into_inner);
        loop {
            if let Some(snapshot) = state.waiting.take() {
                state.counters.taken += 1;
                return Some(snapshot);
            }
            if let Some(snapshot) = unsent {
                return Some(Arc::clone(snapshot));
            }
            if state.finishing {
                return None;
            }
            state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// For the sender: a picture is with the viewer.
    pub fn sent(&self, tiles_sent: u64, tiles_unchanged: u64) {
        let mut state = self.lock();
        state.counters.sent += 1;
        state.counters.tiles_sent += tiles_sent;
        state.counters.tiles_unchanged += tiles_unchanged;
        state.delivered = state.finishing && state.waiting.is_none();
    }

    /// For the sender: waits before the next attempt to connect; returns whether the render has ended, which ends the
    /// wait.
    pub fn pause(&self, period: Duration) -> bool {
        let waited = self.changed.wait_timeout_while(self.lock(), period, |state| !state.finishing);
        waited.unwrap_or_else(PoisonError::into_inner).0.finishing
    }
}
