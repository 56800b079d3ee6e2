//! The viewer tev: a picture and its layers, sent over TCP as they grow.
//!
//! A thread of its own connects, quietly tries again while nobody is there, and sends what has changed. Between the
//! render and that thread is a place for one picture: a new one replaces one that still waits there, so the render
//! never waits for the viewer.

mod queue;
mod sender;

pub use queue::TevCounters;

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::{PICTURE_PERIOD, Snapshot};
use queue::Queue;
use sender::Sender;

/// The address of tev by default.
pub const DEFAULT_ADDRESS: &str = "127.0.0.1:14158";

/// The address of tev, and how long to wait for it.
#[derive(Clone, Debug)]
pub struct TevOptions {
    /// Host and port.
    pub address: String,
    /// After this time without an answer the viewer counts as absent.
    pub connect_timeout: Duration,
    /// Time between two attempts to connect.
    pub retry_period: Duration,
    /// A viewer that takes nothing for this time counts as dead.
    pub write_timeout: Duration,
    /// Least time between two updates.
    pub update_period: Duration,
}

impl Default for TevOptions {
    fn default() -> Self {
        Self {
            address: DEFAULT_ADDRESS.to_owned(),
            connect_timeout: Duration::from_millis(500),
            retry_period: Duration::from_secs(1),
            write_timeout: Duration::from_secs(2),
            update_period: PICTURE_PERIOD,
        }
    }
}

/// Sends pictures to tev.
pub struct Tev {
    queue: Arc<Queue>,
}

impl Tev {
    /// Starts the thread that sends, or sends nothing where no thread can be had; in the viewer the picture is called
    /// `name`.
    pub fn new(options: TevOptions, name: &str) -> Self {
        let queue = Arc::new(Queue::new(options.update_period));
        let sender = Sender::new(options, name.replace('\0', "_"), Arc::clone(&queue));
        let _ = std::thread::Builder::new().name("tev".to_owned()).spawn(move || sender.run());
        Self { queue }
    }

    /// Whether tev is there, as far as known.
    pub fn is_connected(&self) -> bool {
        self.queue.is_connected()
    }

    /// Whether tev is connected and could be sent a picture at once.
    pub fn needs_picture(&self) -> bool {
        self.queue.needs_picture()
    }

    /// Hands over a picture; one that still waits is replaced. Never blocks.
    pub fn offer(&self, snapshot: &Arc<Snapshot>) {
        self.queue.offer(snapshot);
    }

    /// Hands over the last picture.
    pub fn offer_final(&self, snapshot: &Arc<Snapshot>) {
        self.queue.offer_final(snapshot);
    }

    /// Waits until the last picture is sent, no longer than until `deadline`, and not at all without a connection;
    /// returns whether it was sent.
    pub fn wait(&self, deadline: Instant) -> bool {
        self.queue.wait(deadline)
    }

    /// What has happened so far.
    pub fn counters(&self) -> TevCounters {
        self.queue.counters()
    }
}

impl Drop for Tev {
    fn drop(&mut self) {
        self.queue.close();
    }
}
