//! What the page's server answers, and to whom; the page itself is tried by `tools/preview_test.py`.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::process::{ChildStderr, Command, Stdio};
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use half::f16;
use serde_json::{Value, json};
use steradian::internal::film::{Crop, Image, Layer, LayerKind};
use steradian::internal::live::{Fan, HttpTimeouts, Live, Options, Preview, PreviewOptions, Snapshot, Statistics};
use steradian::internal::render::Progress;

use crate::util::program::{Running, Signal};

/// An answer: status, head, body.
pub struct Answer {
    pub status: u16,
    head: String,
    pub body: Vec<u8>,
}

impl Answer {
    pub fn json(&self) -> Value {
        assert_eq!(self.status, 200);
        serde_json::from_slice(&self.body).unwrap()
    }
}

/// One connection, for any number of requests.
pub struct Client(BufReader<TcpStream>);

impl Client {
    pub fn new(address: SocketAddr) -> Self {
        Self(BufReader::new(TcpStream::connect(address).unwrap()))
    }

    fn send(&mut self, text: &str) -> Answer {
        self.0.get_mut().write_all(text.as_bytes()).unwrap();
        let mut head = String::new();
        while !head.ends_with("\r\n\r\n") {
            assert!(self.0.read_line(&mut head).unwrap() > 0, "{head}");
        }
        let length = head.lines().find_map(|line| line.strip_prefix("Content-Length: ")).unwrap().parse().unwrap();
        let mut body = vec![0; length];
        self.0.read_exact(&mut body).unwrap();
        Answer { status: head.split(' ').nth(1).unwrap().parse().unwrap(), head, body }
    }

    pub fn get(&mut self, target: &str) -> Answer {
        self.send(&format!("GET {target} HTTP/1.1\r\nHost: localhost\r\n\r\n"))
    }
}

fn get(address: SocketAddr, target: &str) -> Answer {
    Client::new(address).get(target)
}

pub fn address(url: &str) -> SocketAddr {
    url.trim_start_matches("http://").trim_end_matches('/').parse().unwrap()
}

/// 3 x 2 pixels with values that 16 bits do not hold, and some that JSON does not.
fn image() -> Image {
    let color = (0..24).map(|i| i as f32 / 7.0).collect();
    let depth = vec![1.5, 1e10, f32::NAN, f32::NEG_INFINITY, -0.1, 0.0];
    let layers = vec![Layer::new(LayerKind::Color, color), Layer::new(LayerKind::Z, depth)];
    Image { size: [10, 10], crop: Crop { x: 4, y: 5, width: 3, height: 2 }, layers, ..Image::default() }
}

fn preview() -> (Preview, SocketAddr) {
    let preview = Preview::new(&PreviewOptions::default(), "ball".to_owned(), Arc::new(Statistics::new(None))).unwrap();
    let address = address(&preview.url());
    (preview, address)
}

#[test]
fn layers_are_served_in_16_bits_and_pixels_exactly() {
    let (preview, address) = preview();
    let mut client = Client::new(address);
    assert_eq!(client.get("/state").json()["version"], 0);
    assert_eq!([client.get("/layer?index=0").status, client.get("/pixel?x=0&y=0").status], [404, 404]);
    let image = image();
    preview.show(&Arc::new(Snapshot::new(&image, 7)));

    let state = client.get("/state").json();
    assert_eq!((&state["name"], &state["version"], &state["finished"]), (&json!("ball"), &json!(1), &json!(false)));
    assert_eq!((&state["size"], &state["origin"], &state["picture_spp"]), (&json!([3, 2]), &json!([4, 5]), &json!(7)));
    let layers = json!([{ "name": "color", "channels": ["R", "G", "B", "A"] }, { "name": "Z", "channels": ["Z"] }]);
    assert_eq!(state["layers"], layers);

    for (index, channels) in [(0, 4), (1, 1)] {
        let body = client.get(&format!("/layer?index={index}")).body;
        let head: Vec<u8> = [1u32, 3, 2, channels].iter().flat_map(|word| word.to_le_bytes()).collect();
        let data: Vec<u8> =
            image.layers[index].data.iter().flat_map(|value| f16::from_f32(*value).to_le_bytes()).collect();
        assert_eq!(body, [head, data].concat(), "{index}");
    }

    let pixel = client.get("/pixel?x=2&y=1").json();
    let shown: Vec<f32> =
        pixel["layers"][0]["values"].as_array().unwrap().iter().map(|v| v.to_string().parse().unwrap()).collect();
    assert_eq!(
        (shown, &pixel["layers"][1]),
        (image.layers[0].data[20..].to_vec(), &json!({ "channels": ["Z"], "values": [0.0] }))
    );
    let depths: Vec<Value> = [(1, 0), (2, 0), (0, 1)]
        .map(|(x, y)| client.get(&format!("/pixel?x={x}&y={y}")).json()["layers"][1]["values"][0].clone())
        .into();
    assert_eq!(depths, [json!(1e10), json!("NaN"), json!("-inf")]);
    for wrong in [
        "/layer?index=2",
        "/layer",
        "/layer?index=-1",
        "/pixel?x=3&y=0",
        "/pixel?x=0&y=2",
        "/pixel?x=1",
        "/page.html",
        "/../x",
    ] {
        assert_eq!(client.get(wrong).status, 404, "{wrong}");
    }
}

#[test]
fn the_page_needs_nothing_from_elsewhere() {
    let (_preview, address) = preview();
    let page = get(address, "/");
    let text = String::from_utf8(page.body).unwrap();
    assert!(page.head.contains("text/html") && text.starts_with("<!doctype html>"));
    assert!(!text.contains("http://") && !text.contains("https://") && !text.contains("src="), "no external assets");
    for line in [
        "Content-Security-Policy: default-src 'none';",
        "connect-src 'self'",
        "frame-ancestors 'none'",
        "Cross-Origin-Resource-Policy: same-origin",
        "X-Content-Type-Options: nosniff",
        "Cache-Control: no-store",
    ] {
        assert!(page.head.contains(line), "{line}: {}", page.head);
    }
    assert!(!page.head.contains("Access-Control"), "{}", page.head);
}

#[test]
fn foreign_names_pages_and_methods_are_refused() {
    let (_preview, address) = preview();
    let status = |text: &str| Client::new(address).send(text).status;
    assert!(address.ip().is_loopback());
    for host in [address.to_string(), "localhost:1".to_owned(), "[::1]".to_owned()] {
        assert_eq!(status(&format!("GET /state HTTP/1.1\r\nHost: {host}\r\n\r\n")), 200, "{host}");
    }
    assert_eq!(status("GET /state HTTP/1.1\r\nHost: rebound.example\r\n\r\n"), 403);
    assert_eq!(status("GET /state HTTP/1.1\r\nHost: localhost\r\nSec-Fetch-Site: cross-site\r\n\r\n"), 403);
    assert_eq!(status("GET /state HTTP/1.1\r\nHost: localhost\r\nSec-Fetch-Site: same-origin\r\n\r\n"), 200);
    assert_eq!(status("GET /state HTTP/1.1\r\n\r\n"), 400);
    for method in ["POST", "PUT", "HEAD", "OPTIONS", "DELETE"] {
        let answer = Client::new(address).send(&format!("{method} / HTTP/1.1\r\nHost: localhost\r\n\r\n"));
        assert_eq!((answer.status, answer.head.contains("Allow: GET\r\n")), (405, true), "{method}");
    }
    assert_eq!(status("\u{1}\r\n\r\n"), 400);
    assert_eq!(status(&format!("GET /{} HTTP/1.1\r\nHost: localhost\r\n\r\n", "x".repeat(20_000))), 431);
}

#[test]
fn a_reader_that_takes_nothing_keeps_neither_the_render_nor_others_waiting() {
    let (preview, address) = preview();
    // Far more than the buffers of a connection hold.
    let layer = Layer::new(LayerKind::Color, vec![0.5; 2048 * 2048 * 4]);
    let large = Image { size: [2048, 2048], crop: Crop::full([2048, 2048]), layers: vec![layer], ..Image::default() };
    preview.show(&Arc::new(Snapshot::new(&large, 1)));
    let mut slow: Vec<TcpStream> = (0..8).map(|_| TcpStream::connect(address).unwrap()).collect();
    for stream in &mut slow {
        stream.write_all(b"GET /layer?index=0 HTTP/1.1\r\nHost: localhost\r\n\r\n").unwrap();
        // With the first byte of the answer the picture is chosen.
        stream.read_exact(&mut [0]).unwrap();
    }
    let mut others = Client::new(address);
    for version in 2..20 {
        preview.show(&Arc::new(Snapshot::new(&image(), version)));
        assert_eq!(others.get("/state?page=1&have=0").json()["version"], version);
    }
    // The slow ones are served what they requested.
    drop(others);
    let mut body = Vec::new();
    slow[0].set_read_timeout(Some(Duration::from_secs(60))).unwrap();
    let length = 2048 * 2048 * 4 * 2;
    Read::by_ref(&mut slow[0]).take(length).read_to_end(&mut body).unwrap();
    assert_eq!(body.len() as u64, length);
}

/// Neither one that takes a little now and then nor one that takes nothing.
#[test]
fn slow_readers_are_disconnected_and_keep_no_picture() {
    let timeouts = HttpTimeouts { stall: Duration::from_millis(300), least_rate: u64::MAX };
    let options = PreviewOptions { timeouts, ..PreviewOptions::default() };
    let preview = Preview::new(&options, "ball".to_owned(), Arc::new(Statistics::new(None))).unwrap();
    // Far more than the buffers of a connection hold.
    let layer = Layer::new(LayerKind::Color, vec![0.5; 2048 * 2048 * 4]);
    let large = Image { size: [2048, 2048], crop: Crop::full([2048, 2048]), layers: vec![layer], ..Image::default() };
    let old = Arc::new(Snapshot::new(&large, 1));
    preview.show(&old);
    let mut slow: Vec<TcpStream> = (0..2).map(|_| TcpStream::connect(address(&preview.url())).unwrap()).collect();
    for stream in &mut slow {
        stream.write_all(b"GET /layer?index=0 HTTP/1.1\r\nHost: localhost\r\n\r\n").unwrap();
        stream.read_exact(&mut [0]).unwrap();
    }
    preview.show(&Arc::new(Snapshot::new(&image(), 2)));
    let held = Arc::downgrade(&old);
    drop(old);
    let (start, mut taken, mut piece) = (Instant::now(), [1usize; 2], vec![0; 1 << 16]);
    while held.strong_count() > 0 {
        assert!(start.elapsed() < Duration::from_secs(60));
        // At this rate, all of it would take ten seconds.
        taken[0] += slow[0].read(&mut piece).unwrap_or(0);
        thread::sleep(Duration::from_millis(20));
    }
    for (stream, taken) in slow.iter_mut().zip(taken) {
        let mut rest = Vec::new();
        let _ = stream.read_to_end(&mut rest);
        assert!(taken + rest.len() < 2048 * 2048 * 4 * 2, "{taken} and {}", rest.len());
    }
    // Those in time are served as before.
    assert_eq!(get(address(&preview.url()), "/state").json()["picture_spp"], 2);
}

#[test]
fn connections_beyond_the_limit_are_turned_away() {
    let (_preview, address) = preview();
    let mut kept: Vec<Client> = (0..64).map(|_| Client::new(address)).collect();
    assert!(kept.iter_mut().all(|client| client.get("/state").status == 200));
    let mut beyond = BufReader::new(TcpStream::connect(address).unwrap());
    let mut line = String::new();
    beyond.read_line(&mut line).unwrap();
    assert_eq!(line, "HTTP/1.1 503 Service Unavailable\r\n");
    drop((beyond, kept));
    // With the others gone there is room again.
    let start = Instant::now();
    let has_room = || {
        let mut stream = TcpStream::connect(address).unwrap();
        let mut status = [0; 12];
        // One that is turned away may find the connection closed.
        let read = stream
            .write_all(b"GET /state HTTP/1.1\r\nHost: localhost\r\n\r\n")
            .and_then(|()| stream.read_exact(&mut status));
        read.is_ok() && status == *b"HTTP/1.1 200"
    };
    while !has_room() {
        assert!(start.elapsed() < Duration::from_secs(60));
        thread::sleep(Duration::from_millis(10));
    }
}

#[test]
fn pictures_are_made_only_for_those_who_look() {
    let options = Options { name: "a".to_owned(), preview: Some(PreviewOptions::default()), ..Options::default() };
    let live = Live::new(options).unwrap();
    let fan = Fan::new([&live as &dyn Progress]);
    let mut client = Client::new(address(&live.preview_url().unwrap()));
    let mut version = |target: &str| client.get(target).json()["version"].as_u64().unwrap();
    assert_eq!((fan.needs_picture(), version("/state")), (false, 0));
    // Somebody who only reads the numbers is no reason to make pictures.
    assert!(!fan.needs_picture());
    version("/state?page=5&have=0&idle=1");
    assert!(!fan.needs_picture());
    version("/state?page=5&have=0");
    assert!(fan.needs_picture());
    fan.picture(&image(), 1);
    assert_eq!((fan.needs_picture(), version("/state?page=5&have=0")), (false, 1));
    // Not requested, not shown.
    fan.picture(&image(), 2);
    assert_eq!(version("/state"), 1);
    let start = Instant::now();
    while !fan.needs_picture() {
        assert!(start.elapsed() < Duration::from_secs(60));
        version("/state?page=5&have=1");
        thread::sleep(Duration::from_millis(10));
    }
    // A page that is gone requests nothing.
    thread::sleep(Duration::from_secs(3));
    assert!(!fan.needs_picture());
    // And nobody waits for it at the end.
    live.show_final(&image(), 3);
    assert_eq!(version("/state"), 2);
}

/// A program that serves its page.
struct Watched {
    child: Running,
    stderr: BufReader<ChildStderr>,
    address: SocketAddr,
}

impl Watched {
    fn start(folder: &std::path::Path, arguments: &str) -> Self {
        let scene = r#"{
            "film": { "width": 24, "height": 16 },
            "camera": { "position": [0, 0, 4], "look_at": [0, 0, 0] },
            "shapes": [{ "type": "sphere", "radius": 1 }],
            "lights": [{ "type": "environment", "radiance": [1, 1, 1] }]
        }"#;
        std::fs::write(folder.join("ball.json"), scene).unwrap();
        let mut command = Command::new(env!("CARGO_BIN_EXE_steradian"));
        command
            .current_dir(folder)
            .args(["render", "ball.json", "-o", "a.exr", "--float"])
            .args(arguments.split_whitespace());
        let mut child = Running::start(command.stderr(Stdio::piped()));
        let mut stderr = BufReader::new(child.stderr.take().unwrap());
        let mut line = String::new();
        stderr.read_line(&mut line).unwrap();
        let url = line.strip_prefix("preview: ").unwrap_or_else(|| panic!("{line}")).trim();
        Self { child, stderr, address: address(url) }
    }

    fn end(mut self) -> Option<i32> {
        let mut rest = String::new();
        self.stderr.read_to_string(&mut rest).unwrap();
        self.child.wait().unwrap().code()
    }
}

#[test]
fn a_render_is_watched_until_it_is_interrupted() {
    let folder = tempfile::tempdir().unwrap();
    let running = Watched::start(folder.path(), "--preview 0 --spp 2000000000 --time-limit 100 --threads 1");
    let mut client = Client::new(running.address);
    let (mut have, start) = (0, Instant::now());
    while have < 3 {
        assert!(start.elapsed() < Duration::from_secs(90));
        let state = client.get(&format!("/state?page=1&have={have}")).json();
        let version = state["version"].as_u64().unwrap();
        assert!(version >= have && state["finished"] == false);
        if version > have {
            assert_eq!(client.get("/layer?index=0").body.len(), 16 + 24 * 16 * 4 * 2);
            let numbers = &state["statistics"];
            assert!(
                numbers["samples_per_second"].as_f64().unwrap() > 0.0 && numbers["left"].as_f64().unwrap() <= 100.0,
                "{numbers}"
            );
            assert!(state["picture_spp"].as_u64().unwrap() >= version, "{state}");
        }
        have = version;
        thread::sleep(Duration::from_millis(20));
    }
    running.child.signal(Signal::INT);
    assert_eq!(running.end(), Some(130));
}

#[test]
fn a_held_page_shows_the_picture_of_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let running = Watched::start(folder.path(), "--preview 0 --preview-hold --spp 4");
    let mut client = Client::new(running.address);
    let start = Instant::now();
    while client.get("/state").json()["finished"] == false {
        assert!(start.elapsed() < Duration::from_secs(90));
        thread::sleep(Duration::from_millis(20));
    }
    let image = steradian::internal::output::read_exr(&folder.path().join("a.exr")).unwrap();
    for (x, y) in [(0, 0), (12, 8), (23, 15)] {
        let pixel = client.get(&format!("/pixel?x={x}&y={y}")).json();
        let values = pixel["layers"][0]["values"].as_array().unwrap();
        let shown: Vec<f32> = values.iter().map(|value| value.to_string().parse().unwrap()).collect();
        assert_eq!(shown, image.pixel(LayerKind::Color, x, y).unwrap());
    }
    running.child.signal(Signal::INT);
    assert_eq!(running.end(), Some(0));
}

#[test]
fn a_port_in_use_ends_the_program_before_the_render() {
    let (_preview, address) = preview();
    let folder = tempfile::tempdir().unwrap();
    let line = format!("render missing.json --preview {}", address.port());
    assert_eq!(
        Command::new(env!("CARGO_BIN_EXE_steradian")).args(line.split_whitespace()).output().unwrap().status.code(),
        Some(4)
    );
    std::fs::write(
        folder.path().join("ball.json"),
        r#"{ "film": { "width": 8, "height": 8 }, "camera": { "position": [0, 0, 4], "look_at": [0, 0, 0] },
        "shapes": [{ "type": "sphere" }], "lights": [{ "type": "environment", "radiance": [1, 1, 1] }] }"#,
    )
    .unwrap();
    let line = format!("render ball.json --preview {}", address.port());
    let output = Command::new(env!("CARGO_BIN_EXE_steradian"))
        .current_dir(&folder)
        .args(line.split_whitespace())
        .output()
        .unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{stderr}");
    assert!(stderr.contains("--preview") && stderr.contains(&address.to_string()), "{stderr}");
}
