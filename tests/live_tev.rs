//! A viewer of our own with tev's protocol, well behaved or not.

use std::collections::BTreeMap;
use std::io::{BufReader, Read};
use std::net::{TcpListener, TcpStream};
use std::process::Command;
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use exr::prelude::{FlatSamples, ReadChannels, ReadLayers};
use steradian::internal::film::{Crop, Image, Layer, LayerKind};
use steradian::internal::live::{Snapshot, Tev, TevOptions};

const HOUR: Duration = Duration::from_secs(3600);

/// A picture in the viewer: its size and its channels by name.
#[derive(Clone, Debug, Default, PartialEq)]
struct Picture {
    size: [usize; 2],
    channels: BTreeMap<String, Vec<u32>>,
}

/// What the viewer received, one word for each packet, and what it shows.
#[derive(Default)]
struct Viewer {
    packets: Vec<String>,
    pictures: BTreeMap<String, Picture>,
}

/// The payload of a packet.
struct Payload(std::vec::IntoIter<u8>);

impl Payload {
    fn bytes<const N: usize>(&mut self) -> [u8; N] {
        std::array::from_fn(|_| self.0.next().expect("the packet is too short"))
    }

    fn flag(&mut self) -> bool {
        let [flag] = self.bytes();
        assert!(flag <= 1);
        flag == 1
    }

    fn int(&mut self) -> usize {
        usize::try_from(i32::from_le_bytes(self.bytes())).unwrap()
    }

    fn long(&mut self) -> usize {
        usize::try_from(i64::from_le_bytes(self.bytes())).unwrap()
    }

    fn text(&mut self) -> String {
        String::from_utf8(self.0.by_ref().take_while(|byte| *byte != 0).collect()).unwrap()
    }

    fn texts(&mut self, count: usize) -> Vec<String> {
        (0..count).map(|_| self.text()).collect()
    }
}

impl Viewer {
    /// Takes the next packet; false at the end of the connection.
    fn take(&mut self, stream: &mut impl Read) -> bool {
        let mut head = [0; 4];
        if stream.read_exact(&mut head).is_err() {
            return false;
        }
        let length = u32::from_le_bytes(head) as usize - head.len();
        let mut payload = vec![0; length];
        if stream.read_exact(&mut payload).is_err() {
            return false;
        }
        self.apply(Payload(payload.into_iter()));
        true
    }

    fn apply(&mut self, mut payload: Payload) {
        let [kind] = payload.bytes();
        match kind {
            2 => {
                let name = payload.text();
                self.packets.push(format!("close {name}"));
                self.pictures.remove(&name);
            }
            4 => {
                let (grab, name) = (payload.flag(), payload.text());
                let size = [payload.int(), payload.int()];
                let count = payload.int();
                let channels =
                    payload.texts(count).into_iter().map(|name| (name, vec![0; size[0] * size[1]])).collect();
                self.packets.push(format!("create {name} {grab}"));
                let old = self.pictures.insert(name, Picture { size, channels });
                assert!(old.is_none(), "created twice");
            }
            6 => self.update(&mut payload),
            _ => panic!("packet of kind {kind}"),
        }
        assert_eq!(payload.0.len(), 0, "the packet is too long");
    }

    fn update(&mut self, payload: &mut Payload) {
        let (grab, name, count) = (payload.flag(), payload.text(), payload.int());
        let channels = payload.texts(count);
        let [x, y, width, height] = [(); 4].map(|()| payload.int());
        let offsets: Vec<usize> = (0..count).map(|_| payload.long()).collect();
        let strides: Vec<usize> = (0..count).map(|_| payload.long()).collect();
        let ends = offsets.iter().zip(&strides).map(|(offset, stride)| offset + (width * height - 1) * stride + 1);
        let data: Vec<u32> = (0..ends.max().unwrap()).map(|_| u32::from_le_bytes(payload.bytes())).collect();
        let picture = self.pictures.get_mut(&name).expect("no such picture");
        assert!(!grab && x + width <= picture.size[0] && y + height <= picture.size[1]);
        for ((channel, offset), stride) in channels.iter().zip(offsets).zip(strides) {
            let plane = picture.channels.get_mut(channel).expect("no such channel");
            for pixel in 0..width * height {
                plane[(y + pixel / width) * picture.size[0] + x + pixel % width] = data[offset + pixel * stride];
            }
        }
        self.packets.push("update".to_owned());
    }
}

/// A viewer that reads one connection to its end.
fn viewer(listener: TcpListener) -> thread::JoinHandle<Viewer> {
    thread::spawn(move || {
        let mut viewer = Viewer::default();
        let mut stream = BufReader::new(listener.accept().unwrap().0);
        while viewer.take(&mut stream) {}
        viewer
    })
}

/// A free port of an address that no other test uses.
fn listen() -> (TcpListener, String) {
    let listener = TcpListener::bind("127.0.83.7:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    (listener, address)
}

fn options(address: &str) -> TevOptions {
    TevOptions {
        address: address.to_owned(),
        connect_timeout: Duration::from_secs(60),
        retry_period: Duration::from_millis(10),
        write_timeout: HOUR,
        update_period: Duration::ZERO,
    }
}

/// A picture whose values depend on the seed.
fn image(size: [u32; 2], seed: u32) -> Image {
    let value = |i: u32| f32::from_bits((i + 1).wrapping_mul(2_654_435_761).wrapping_add(seed));
    let layer =
        |kind: LayerKind, channels: u32| Layer::new(kind, (0..size[0] * size[1] * channels).map(value).collect());
    Image {
        size,
        crop: Crop::full(size),
        layers: vec![layer(LayerKind::Color, 4), layer(LayerKind::N, 3)],
        ..Image::default()
    }
}

fn snapshot(image: &Image) -> Arc<Snapshot> {
    Arc::new(Snapshot::new(image, 1))
}

/// The picture as the viewer is to show it.
fn expected(image: &Image) -> Picture {
    let names = [&["R", "G", "B", "A"][..], &["N.X", "N.Y", "N.Z"]];
    let channels = image.layers.iter().zip(names).flat_map(|(layer, names)| {
        let plane = |channel: usize| {
            layer.data.iter().skip(channel).step_by(names.len()).map(|value| value.to_bits()).collect()
        };
        names.iter().enumerate().map(move |(channel, name)| ((*name).to_owned(), plane(channel))).collect::<Vec<_>>()
    });
    Picture { size: image.size.map(|side| side as usize), channels: channels.collect() }
}

/// Waits for a condition set by another thread.
fn eventually(what: &str, mut is_so: impl FnMut() -> bool) {
    let start = Instant::now();
    while !is_so() {
        assert!(start.elapsed() < Duration::from_secs(120), "{what}");
        thread::sleep(Duration::from_millis(1));
    }
}

fn deadline() -> Instant {
    Instant::now() + HOUR
}

#[test]
fn the_picture_in_the_viewer_is_the_one_in_the_file() {
    let scene = r#"{
        "film": { "width": 150, "height": 140 },
        "camera": { "position": [0, 0, 4], "look_at": [0, 0, 0] },
        "sampler": { "spp": 2 },
        "shapes": [{ "type": "sphere", "radius": 1 }],
        "lights": [{ "type": "environment", "radiance": [1, 0.5, 1] }]
    }"#;
    for crop in ["", "--crop 3,5,140,133"] {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("ball.json"), scene).unwrap();
        let (listener, address) = listen();
        let viewer = viewer(listener);
        let line = format!("render ball.json -q --float --layers Z,N,albedo,variance -o a.exr {crop} --tev {address}");
        let status = Command::new(env!("CARGO_BIN_EXE_steradian"))
            .current_dir(&folder)
            .args(line.split_whitespace())
            .status()
            .unwrap();
        assert!(status.success());
        let viewer = viewer.join().unwrap();
        assert_eq!(viewer.packets[..2], ["close ball", "create ball true"]);
        assert_eq!(viewer.pictures["ball"], of_file(&folder.path().join("a.exr")));
        assert_eq!(viewer.pictures["ball"].channels.len(), 4 + 1 + 3 + 3 + 3);
    }
}

/// The picture of an EXR file, read without our own code.
fn of_file(path: &std::path::Path) -> Picture {
    let reader = exr::prelude::read().no_deep_data().largest_resolution_level();
    let file = reader.all_channels().first_valid_layer().all_attributes().from_file(path).unwrap();
    let layer = file.layer_data;
    let plane = |samples: &FlatSamples| match samples {
        FlatSamples::F32(values) => values.iter().map(|value| value.to_bits()).collect(),
        other => panic!("{other:?}"),
    };
    let channels =
        layer.channel_data.list.iter().map(|channel| (channel.name.to_string(), plane(&channel.sample_data)));
    Picture { size: [layer.size.0, layer.size.1], channels: channels.collect() }
}

#[test]
fn only_what_has_changed_is_sent() {
    let (listener, address) = listen();
    let viewer = viewer(listener);
    let tev = Tev::new(options(&address), "a");
    // Tiles are 128 pixels wide: 3 x 2 of them.
    let first = image([300, 200], 1);
    let mut second = first.clone();
    let changed = (150 * 300 + 290) * 3;
    second.layers[1].data[changed] = -second.layers[1].data[changed];
    eventually("connected", || tev.needs_picture());
    tev.offer(&snapshot(&first));
    eventually("first", || tev.counters().sent == 1);
    tev.offer(&snapshot(&second));
    eventually("second", || tev.counters().sent == 2);
    assert_eq!((tev.counters().tiles_sent, tev.counters().tiles_unchanged), (6 + 1, 5));
    tev.offer_final(&snapshot(&second));
    assert!(tev.wait(deadline()));
    assert_eq!((tev.counters().tiles_sent, tev.counters().tiles_unchanged), (6 + 1, 5 + 6));
    let viewer = viewer.join().unwrap();
    assert_eq!((viewer.packets.len(), &viewer.pictures["a"]), (2 + 7, &expected(&second)));
}

#[test]
fn updates_keep_their_distance_and_the_newest_picture_wins() {
    assert_eq!(TevOptions::default().update_period, Duration::from_millis(250));
    let (listener, address) = listen();
    let viewer = viewer(listener);
    let tev = Tev::new(TevOptions { update_period: HOUR, ..options(&address) }, "a");
    eventually("connected", || tev.needs_picture());
    tev.offer(&snapshot(&image([40, 30], 0)));
    eventually("first", || tev.counters().sent == 1);
    // An hour is to pass before the second: it waits, and is replaced by the third.
    assert!(!tev.needs_picture());
    tev.offer(&snapshot(&image([40, 30], 1)));
    tev.offer(&snapshot(&image([40, 30], 2)));
    assert!(!tev.needs_picture());
    // The last picture waits for nothing.
    let last = image([40, 30], 3);
    tev.offer_final(&snapshot(&last));
    assert!(tev.wait(deadline()));
    let counters = tev.counters();
    assert_eq!((counters.offered, counters.taken, counters.replaced, counters.sent), (4, 2, 2, 2));
    assert_eq!(viewer.join().unwrap().pictures["a"], expected(&last));
}

#[test]
fn a_viewer_that_never_reads_holds_nothing_up() {
    let (listener, address) = listen();
    let tev = Tev::new(options(&address), "a");
    let silent = listener.accept().unwrap().0;
    // Far more than the buffers of a connection hold.
    let picture = snapshot(&image([2048, 1024], 0));
    tev.offer(&picture);
    eventually("taken", || tev.counters().taken == 1);
    for offered in 2..=100 {
        tev.offer(&picture);
        let counters = tev.counters();
        // The sender is stuck with the first; of the others one waits and the rest are gone.
        assert_eq!((counters.offered, counters.taken, counters.sent, counters.replaced), (offered, 1, 0, offered - 2));
        assert!(!tev.needs_picture());
    }
    tev.offer_final(&picture);
    assert!(!tev.wait(Instant::now()));
    drop(tev);
    // The end of the sender ends the connection, though it waits for an hour.
    let mut rest = BufReader::new(silent);
    eventually("closed", || {
        rest.read(&mut [0; 65536]).is_ok_and(|read| read == 0) || rest.get_ref().peer_addr().is_err()
    });
}

#[test]
fn a_viewer_that_dies_and_comes_back_gets_everything_again() {
    let (listener, address) = listen();
    let tev = Tev::new(options(&address), "a");
    let [first, second, last] = [0, 1, 2].map(|seed| image([512, 512], seed));
    tev.offer(&snapshot(&first));
    let mut stream = listener.accept().unwrap().0;
    stream.read_exact(&mut [0; 1000]).unwrap();
    drop((stream, listener));
    eventually("lost", || !tev.is_connected());
    tev.offer(&snapshot(&second));
    assert!(!tev.needs_picture());

    let listener = TcpListener::bind(&address).unwrap();
    let viewer = viewer(listener);
    eventually("back", || tev.counters().connections == 2);
    eventually("shown again", || tev.counters().sent >= 1);
    tev.offer_final(&snapshot(&last));
    assert!(tev.wait(deadline()));
    let viewer = viewer.join().unwrap();
    assert_eq!(viewer.packets[0], "close a");
    assert!(viewer.packets[1].starts_with("create a"), "{:?}", viewer.packets[1]);
    assert_eq!(viewer.pictures["a"], expected(&last));
}

#[test]
fn nobody_there_means_no_pictures_and_no_wait() {
    let (listener, address) = listen();
    drop(listener);
    let tev = Tev::new(options(&address), "a");
    assert!(!tev.needs_picture());
    tev.offer_final(&snapshot(&image([8, 8], 0)));
    // Returns at once: the deadline is an hour away.
    assert!(!tev.wait(deadline()));
    assert_eq!((tev.counters().connections, tev.counters().sent), (0, 0));
}

#[test]
fn a_stream_of_another_program_is_left_alone() {
    // Something else listens there and hangs up at once, again and again.
    let (listener, address) = listen();
    let rude = thread::spawn(move || (0..3).for_each(|_| drop::<TcpStream>(listener.accept().unwrap().0)));
    let tev = Tev::new(options(&address), "a");
    eventually("three times", || {
        tev.offer(&snapshot(&image([64, 64], 0)));
        tev.counters().connections >= 3
    });
    rude.join().unwrap();
    tev.offer_final(&snapshot(&image([64, 64], 0)));
    assert!(!tev.wait(deadline()));
}
