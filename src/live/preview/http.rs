//! As much of HTTP/1.1 as a page of one's own needs: GET, one request after the other.

use std::io::{self, ErrorKind, Read, Write};
use std::net::{IpAddr, Shutdown, TcpStream};
use std::time::{Duration, Instant};

/// The longest head of a request, in bytes.
const MAX_HEAD: usize = 8192;

/// The most header lines of a request.
const MAX_HEADERS: usize = 64;

/// How long readers are waited for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HttpTimeouts {
    /// A connection ends after this time without a request, or without a byte of a response taken.
    pub stall: Duration,
    /// Bytes a second that a reader has to take, after a first `stall`; at least 1.
    pub least_rate: u64,
}

impl Default for HttpTimeouts {
    /// Ten seconds, and 1 MiB a second.
    fn default() -> Self {
        Self { stall: Duration::from_secs(10), least_rate: 1 << 20 }
    }
}

/// How long what is left of a rejected request is read.
const LINGER: Duration = Duration::from_secs(1);

/// What the page may do: show what is in it, and send requests to its own server.
const POLICY: &str = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; connect-src 'self'; \
                      img-src data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// Why a request is rejected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum HttpError {
    /// Not HTTP, or without a host.
    Malformed,
    /// The head is too long.
    TooLong,
    /// Anything but GET.
    Method,
    /// A request for a foreign host or by a page of a foreign origin.
    Foreign,
    /// Too many connections.
    Busy,
}

impl HttpError {
    const fn status(self) -> &'static str {
        match self {
            Self::Malformed => "400 Bad Request",
            Self::TooLong => "431 Request Header Fields Too Large",
            Self::Method => "405 Method Not Allowed",
            Self::Foreign => "403 Forbidden",
            Self::Busy => "503 Service Unavailable",
        }
    }
}

/// The target of a request.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Request {
    path: String,
    query: String,
}

impl Request {
    /// The path, from the slash on.
    pub fn path(&self) -> &str {
        &self.path
    }

    /// A whole number of the query.
    pub fn number(&self, key: &str) -> Option<u64> {
        let mut pairs = self.query.split('&').filter_map(|pair| pair.split_once('='));
        pairs.find(|(name, _)| *name == key)?.1.parse().ok()
    }
}

/// A connection to a browser.
pub struct Connection {
    stream: TcpStream,
    timeouts: HttpTimeouts,
    /// When the present response has to be sent.
    deadline: Option<Instant>,
    /// What has been read and not yet been used.
    buffer: Vec<u8>,
}

impl Connection {
    pub fn new(stream: TcpStream, timeouts: HttpTimeouts) -> io::Result<Self> {
        stream.set_read_timeout(Some(timeouts.stall))?;
        stream.set_write_timeout(Some(timeouts.stall))?;
        stream.set_nodelay(true)?;
        Ok(Self { stream, timeouts, deadline: None, buffer: Vec::new() })
    }

    /// The next request; `None` if there is none. Its head must arrive in time, and its host must be this machine or
    /// `host`.
    pub fn request(&mut self, host: &str) -> io::Result<Option<Result<Request, HttpError>>> {
        let deadline = Instant::now() + self.timeouts.stall;
        loop {
            match parse(&self.buffer, host) {
                Some(Ok((request, length))) => {
                    self.buffer.drain(..length);
                    return Ok(Some(Ok(request)));
                }
                Some(Err(refusal)) => return Ok(Some(Err(refusal))),
                None if self.buffer.len() > MAX_HEAD => return Ok(Some(Err(HttpError::TooLong))),
                None => {}
            }
            let mut piece = [0; 2048];
            let read = match self.stream.read(&mut piece) {
                Err(error) if error.kind() == ErrorKind::Interrupted => continue,
                read => read?,
            };
            if read == 0 || Instant::now() > deadline {
                return Ok(None);
            }
            self.buffer.extend_from_slice(&piece[..read]);
        }
    }

    /// Responds with an error, the last response of the connection.
    pub fn refuse(&mut self, refusal: HttpError) -> io::Result<()> {
        let allow = if refusal == HttpError::Method { "Allow: GET\r\n" } else { "" };
        let (status, length) = (refusal.status(), refusal.status().len());
        let head = format!(
            "HTTP/1.1 {status}\r\n{allow}Content-Type: text/plain\r\nContent-Length: {length}\r\nConnection: close\r\n\
             \r\n"
        );
        self.stream.write_all(format!("{head}{status}").as_bytes())?;
        // A connection closed before all of the request is read would take the response with it.
        self.stream.shutdown(Shutdown::Write)?;
        self.stream.set_read_timeout(Some(LINGER))?;
        let (start, mut read) = (Instant::now(), 1);
        while read > 0 && start.elapsed() < LINGER {
            read = self.stream.read(&mut [0; 2048])?;
        }
        Ok(())
    }

    /// Starts a response; the body of `length` bytes follows by [`Connection::write`].
    pub fn start(&mut self, status: &str, kind: &str, length: u64) -> io::Result<()> {
        let head = format!(
            "HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {length}\r\nCache-Control: no-store\r\n\
             Content-Security-Policy: {POLICY}\r\nCross-Origin-Resource-Policy: same-origin\r\n\
             X-Content-Type-Options: nosniff\r\n\
             Referrer-Policy: no-referrer\r\n\r\n"
        );
        // The picture is held until then: who takes it byte by byte must not keep it for ever.
        self.deadline =
            Some(Instant::now() + self.timeouts.stall + Duration::from_secs(length / self.timeouts.least_rate.max(1)));
        self.write(head.as_bytes())
    }

    /// Some of the body.
    pub fn write(&mut self, mut bytes: &[u8]) -> io::Result<()> {
        while !bytes.is_empty() {
            if let Some(deadline) = self.deadline {
                let left = deadline.saturating_duration_since(Instant::now());
                if left.is_zero() {
                    return Err(ErrorKind::TimedOut.into());
                }
                self.stream.set_write_timeout(Some(left.min(self.timeouts.stall)))?;
            }
            match self.stream.write(bytes) {
                Ok(0) => return Err(ErrorKind::WriteZero.into()),
                Ok(count) => bytes = &bytes[count..],
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }

    /// A whole response.
    pub fn respond(&mut self, status: &str, kind: &str, body: &[u8]) -> io::Result<()> {
        self.start(status, kind, body.len() as u64)?;
        self.write(body)
    }
}

/// The request at the start of `bytes` and its length; `None` if it is not all there yet.
fn parse(bytes: &[u8], host: &str) -> Option<Result<(Request, usize), HttpError>> {
    let mut headers = [httparse::EMPTY_HEADER; MAX_HEADERS];
    let mut request = httparse::Request::new(&mut headers);
    let length = match request.parse(bytes) {
        Ok(httparse::Status::Partial) => return None,
        Ok(httparse::Status::Complete(length)) => length,
        Err(httparse::Error::TooManyHeaders) => return Some(Err(HttpError::TooLong)),
        Err(_) => return Some(Err(HttpError::Malformed)),
    };
    Some(check(&request, host).map(|request| (request, length)))
}

fn check(request: &httparse::Request, host: &str) -> Result<Request, HttpError> {
    let values =
        |name: &'static str| request.headers.iter().filter(move |h| h.name.eq_ignore_ascii_case(name)).map(|h| h.value);
    if request.method != Some("GET") {
        return Err(HttpError::Method);
    }
    // A request with a body would leave it where the next request is looked for.
    let has_body = values("Transfer-Encoding").next().is_some() || values("Content-Length").any(|value| value != b"0");
    let mut hosts = values("Host");
    let (Some(requested), None, false) = (hosts.next(), hosts.next(), has_body) else {
        return Err(HttpError::Malformed);
    };
    let requested = std::str::from_utf8(requested).map_err(|_| HttpError::Malformed)?;
    // Browsers send the origin of a request's page; other origins are rejected.
    let from_elsewhere = values("Sec-Fetch-Site").any(|site| site != b"same-origin" && site != b"none");
    if !is_own_host(requested, host) || from_elsewhere {
        return Err(HttpError::Foreign);
    }
    let target = request.path.filter(|path| path.starts_with('/')).ok_or(HttpError::Malformed)?;
    let (path, query) = target.split_once('?').unwrap_or((target, ""));
    Ok(Request { path: path.to_owned(), query: query.to_owned() })
}

/// Whether a Host header names this machine: by address, as localhost, or by the name given on the command line. A
/// foreign name that has been made to point here (DNS rebinding) is none of these. The port may be another, that of a
/// tunnel.
fn is_own_host(requested: &str, host: &str) -> bool {
    let requested = requested.to_ascii_lowercase();
    let (name, port) = match requested.strip_prefix('[').and_then(|rest| rest.split_once(']')) {
        Some(parts) => parts,
        None => requested.split_at(requested.find(':').unwrap_or(requested.len())),
    };
    let is_port = port.is_empty()
        || port.strip_prefix(':').is_some_and(|digits| digits.bytes().all(|byte| byte.is_ascii_digit()));
    is_port && (name == "localhost" || name == host || name.parse::<IpAddr>().is_ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn result(text: &str) -> Option<Result<Request, HttpError>> {
        parse(text.as_bytes(), "node7").map(|result| result.map(|(request, _)| request))
    }

    #[test]
    fn requests_are_read_whole() {
        let text = "GET /layer?index=3&page=12 HTTP/1.1\r\nHost: 127.0.0.1:8000\r\n\r\n";
        let request = result(text).unwrap().unwrap();
        assert_eq!((request.path(), request.number("index"), request.number("page")), ("/layer", Some(3), Some(12)));
        assert_eq!(
            (request.number("x"), parse(format!("{text}GET").as_bytes(), "").unwrap().unwrap().1),
            (None, text.len())
        );
        for end in 0..text.len() {
            assert_eq!(result(&text[..end]), None, "{end}");
        }
    }

    #[test]
    fn only_this_machine_is_a_valid_host() {
        for host in ["127.0.0.1:8000", "localhost", "LOCALHOST:1", "[::1]:8000", "192.168.1.7", "node7:80"] {
            assert!(is_own_host(host, "node7"), "{host}");
        }
        for host in [
            "",
            "example.com",
            "localhost.example.com:8000",
            "127.0.0.1.example.com",
            "node7.example.com",
            "[example.com]:80",
        ] {
            assert!(!is_own_host(host, "node7"), "{host}");
        }
        for host in [
            "[127.0.0.1]evil.com",
            "[::1].evil.com:80",
            "[::1]:80.evil.com",
            "127.0.0.1:evil.com",
            "localhost:80@evil.com",
            "[::1",
            "node7:1:2",
        ] {
            assert!(!is_own_host(host, "node7"), "{host}");
        }
    }

    #[test]
    fn anything_else_is_refused() {
        let of = |head: &str| result(&format!("{head}\r\n\r\n")).unwrap().unwrap_err();
        assert_eq!(of("POST / HTTP/1.1\r\nHost: localhost"), HttpError::Method);
        assert_eq!(of("HEAD / HTTP/1.1\r\nHost: localhost"), HttpError::Method);
        assert_eq!(of("GET / HTTP/1.1"), HttpError::Malformed);
        assert_eq!(of("GET / HTTP/1.1\r\nHost: localhost\r\nHost: localhost"), HttpError::Malformed);
        assert_eq!(of("GET / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 5"), HttpError::Malformed);
        assert_eq!(of("GET http://localhost/ HTTP/1.1\r\nHost: localhost"), HttpError::Malformed);
        assert_eq!(of("nonsense\u{1}"), HttpError::Malformed);
        assert_eq!(of("GET / HTTP/1.1\r\nHost: evil.example"), HttpError::Foreign);
        assert_eq!(of("GET / HTTP/1.1\r\nHost: localhost\r\nSec-Fetch-Site: cross-site"), HttpError::Foreign);
        assert_eq!(of(&format!("GET / HTTP/1.1{}", "\r\nA: b".repeat(MAX_HEADERS + 1))), HttpError::TooLong);
    }
}
