//! A small web page that shows the picture as it grows.
//!
//! The page and everything it needs are in the program. It requests the numbers a few times a second, fetches the layer
//! it shows when there is a newer picture, and thereby requests the next one; without an open page no pictures are
//! made, at no cost.

mod board;
mod http;
mod respond;

use std::net::{IpAddr, Ipv4Addr, SocketAddr, TcpListener, TcpStream, ToSocketAddrs};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use super::{Snapshot, Statistics};
use crate::desc::ViewDesc;
use crate::error::Result;
use crate::output::NamedLayer;
use crate::output::flip::hdr_flip;
use crate::render::refused;
use board::Board;
pub use http::HttpTimeouts;
use http::{Connection, HttpError};

/// More connections than this are turned away.
const MAX_CONNECTIONS: usize = 64;

/// The wait before the next attempt after a failure to accept a connection (too many open files, for example).
const ACCEPT_PAUSE: Duration = Duration::from_millis(100);

/// Where the page is served.
#[derive(Clone, Debug)]
pub struct PreviewOptions {
    /// Host name or address to listen at; only those who reach it can look.
    pub host: String,
    /// The port; 0 means any that is free.
    pub port: u16,
    /// How light is shown until the page's user chooses.
    pub view: ViewDesc,
    /// When slow readers are disconnected, so that they do not keep pictures in memory.
    pub timeouts: HttpTimeouts,
}

impl Default for PreviewOptions {
    /// Only this machine, any port.
    fn default() -> Self {
        Self {
            host: Ipv4Addr::LOCALHOST.to_string(),
            port: 0,
            view: ViewDesc::default(),
            timeouts: HttpTimeouts::default(),
        }
    }
}

/// A picture that another one is compared with.
pub struct Compared {
    name: String,
    snapshot: Snapshot,
    flip: OnceLock<NamedLayer>,
}

impl Compared {
    /// A picture with its name.
    pub fn new(name: String, snapshot: Snapshot) -> Self {
        Self { name, snapshot, flip: OnceLock::new() }
    }

    /// How much the picture shown seems to differ from this one, by FLIP, computed at the first request; of pictures of
    /// different sizes nothing.
    fn flip(&self, shown: &Snapshot) -> &NamedLayer {
        self.flip.get_or_init(|| NamedLayer {
            names: vec!["FLIP".to_owned()],
            data: hdr_flip(&shown.color(), &self.snapshot.color()).unwrap_or_default(),
        })
    }
}

/// What all connections share.
struct Shared {
    board: Board,
    /// Of a render.
    statistics: Option<Arc<Statistics>>,
    compared: Option<Compared>,
    name: String,
    view: ViewDesc,
    /// The host given: requests may name it.
    host: String,
    timeouts: HttpTimeouts,
    connections: AtomicUsize,
    closing: AtomicBool,
}

/// Serves the page.
pub struct Preview {
    shared: Arc<Shared>,
    address: SocketAddr,
}

impl Preview {
    /// Starts to serve; the picture is called `name`.
    ///
    /// # Errors
    /// [`Error::Setting`](crate::Error::Setting) if the address and port are not to be had.
    pub fn new(options: &PreviewOptions, name: String, statistics: Arc<Statistics>) -> Result<Self> {
        Self::start(options, name, Some(statistics), None)
    }

    /// Starts to serve a finished picture, which may be compared with another of the same size.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn of_picture(
        options: &PreviewOptions,
        name: String,
        snapshot: Snapshot,
        compared: Option<Compared>,
    ) -> Result<Self> {
        let preview = Self::start(options, name, None, compared)?;
        preview.show_final(&Arc::new(snapshot));
        Ok(preview)
    }

    fn start(
        options: &PreviewOptions,
        name: String,
        statistics: Option<Arc<Statistics>>,
        compared: Option<Compared>,
    ) -> Result<Self> {
        let unusable = |e: &dyn std::fmt::Display| {
            refused("preview", format!(": cannot listen at {}:{}: {e}", options.host, options.port))
        };
        let host = options.host.trim_start_matches('[').trim_end_matches(']');
        let addresses: Vec<_> = (host, options.port).to_socket_addrs().map_err(|e| unusable(&e))?.collect();
        let listener = TcpListener::bind(&addresses[..]).map_err(|e| unusable(&e))?;
        let address = listener.local_addr().map_err(|e| unusable(&e))?;
        let shared = Arc::new(Shared {
            board: Board::default(),
            statistics,
            compared,
            name,
            view: options.view,
            host: host.to_ascii_lowercase(),
            timeouts: options.timeouts,
            connections: AtomicUsize::new(0),
            closing: AtomicBool::new(false),
        });
        let of_thread = Arc::clone(&shared);
        std::thread::Builder::new()
            .name("preview".to_owned())
            .spawn(move || accept(&listener, &of_thread))
            .map_err(|e| unusable(&e))?;
        Ok(Self { shared, address })
    }

    /// The page's address.
    pub fn url(&self) -> String {
        format!("http://{}/", self.address)
    }

    /// Whether a page that shows the newest picture waits for a newer one.
    pub fn needs_picture(&self) -> bool {
        self.shared.board.needs_picture()
    }

    /// Shows a picture from now on. Never blocks.
    pub fn show(&self, snapshot: &Arc<Snapshot>) {
        self.shared.board.show(snapshot, false);
    }

    /// Shows the finished picture.
    pub fn show_final(&self, snapshot: &Arc<Snapshot>) {
        self.shared.board.show(snapshot, true);
    }

    /// Waits until every page open has fetched the finished picture, no longer than until `deadline`; returns whether
    /// they have.
    pub fn wait(&self, deadline: Instant) -> bool {
        self.shared.board.wait(deadline)
    }
}

impl Drop for Preview {
    fn drop(&mut self) {
        self.shared.closing.store(true, Ordering::Relaxed);
        let ip = match self.address.ip() {
            IpAddr::V4(ip) if ip.is_unspecified() => Ipv4Addr::LOCALHOST.into(),
            IpAddr::V6(ip) if ip.is_unspecified() => std::net::Ipv6Addr::LOCALHOST.into(),
            ip => ip,
        };
        // Wakes the thread that accepts.
        let _ = TcpStream::connect_timeout(&SocketAddr::new(ip, self.address.port()), ACCEPT_PAUSE);
    }
}

/// Gives every connection a thread of its own: a slow one keeps nobody waiting.
fn accept(listener: &TcpListener, shared: &Arc<Shared>) {
    for stream in listener.incoming() {
        if shared.closing.load(Ordering::Relaxed) {
            return;
        }
        let Ok(stream) = stream else {
            std::thread::sleep(ACCEPT_PAUSE);
            continue;
        };
        let shared = Arc::clone(shared);
        let serve = move || {
            let count = shared.connections.fetch_add(1, Ordering::Relaxed);
            // The other side may hang up at any time; that is no fault.
            let _ = serve(stream, &shared, count < MAX_CONNECTIONS);
            shared.connections.fetch_sub(1, Ordering::Relaxed);
        };
        // Without a thread to be had, the connection closes.
        let _ = std::thread::Builder::new().name("preview".to_owned()).spawn(serve);
    }
}

/// Responds to the requests of a connection, one after the other.
fn serve(stream: TcpStream, shared: &Shared, has_room: bool) -> std::io::Result<()> {
    let mut connection = Connection::new(stream, shared.timeouts)?;
    if !has_room {
        return connection.refuse(HttpError::Busy);
    }
    while !shared.closing.load(Ordering::Relaxed) {
        match connection.request(&shared.host)? {
            None => break,
            Some(Err(refusal)) => return connection.refuse(refusal),
            Some(Ok(request)) => respond::respond(&mut connection, &request, shared)?,
        }
    }
    Ok(())
}
