//! The thread that sends to tev.

use std::io::{self, ErrorKind};
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::Arc;
use std::time::Instant;

use tev_client::{PacketCloseImage, PacketCreateImage, PacketUpdateImage, TevClient};

use super::queue::Queue;
use super::{Snapshot, TevOptions};
use crate::film::Crop;

/// Width and height of what is sent in one packet.
const TILE: u32 = 128;

/// Why a connection ended.
enum End {
    /// All is sent.
    Done,
    /// The viewer is gone.
    Lost,
}

pub(super) struct Sender {
    options: TevOptions,
    name: String,
    queue: Arc<Queue>,
    /// The newest picture taken from the queue.
    latest: Option<Arc<Snapshot>>,
    /// Whether the viewer has shown a picture before: only the first raises its window.
    was_shown: bool,
}

impl Sender {
    pub fn new(options: TevOptions, name: String, queue: Arc<Queue>) -> Self {
        Self { options, name, queue, latest: None, was_shown: false }
    }

    /// Connects and sends until the render has ended.
    pub fn run(mut self) {
        let mut is_last = false;
        loop {
            if let Some(stream) = self.connect() {
                self.queue.connected(stream.try_clone().ok());
                if matches!(self.serve(stream), End::Done) {
                    break;
                }
            }
            self.queue.disconnected();
            // A viewer that was there gets one more chance to take the last picture.
            let is_over = self.queue.pause(self.options.retry_period);
            if is_over && (is_last || self.queue.counters().connections == 0) {
                break;
            }
            is_last = is_over;
        }
        self.queue.ended();
    }

    fn connect(&self) -> Option<TcpStream> {
        let addresses = self.options.address.to_socket_addrs().ok()?;
        let stream = addresses
            .into_iter()
            .find_map(|address| TcpStream::connect_timeout(&address, self.options.connect_timeout).ok())?;
        stream.set_write_timeout(Some(self.options.write_timeout)).ok()?;
        stream.set_nodelay(true).ok()?;
        Some(stream)
    }

    fn serve(&mut self, stream: TcpStream) -> End {
        let Ok(watched) = stream.try_clone() else { return End::Lost };
        let mut client = TevClient::wrap(stream);
        let mut shown: Option<Arc<Snapshot>> = None;
        let mut earliest = Instant::now();
        loop {
            let unsent = self.latest.as_ref().filter(|_| shown.is_none());
            let Some(snapshot) = self.queue.next(earliest, unsent) else { return End::Done };
            self.latest = Some(Arc::clone(&snapshot));
            earliest = Instant::now() + self.options.update_period;
            if is_closed(&watched) || self.send(&mut client, &snapshot, shown.as_deref()).is_err() {
                return End::Lost;
            }
            shown = Some(snapshot);
        }
    }

    /// Sends what is different from what the viewer shows; everything if that is nothing.
    fn send(&mut self, client: &mut TevClient, snapshot: &Snapshot, shown: Option<&Snapshot>) -> io::Result<()> {
        let names: Vec<&str> = snapshot.all_names().collect();
        let [width, height] = snapshot.size();
        let shown = shown.filter(|shown| shown.is_shaped_like(snapshot));
        if shown.is_none() {
            // The viewer may have a picture of this name and another shape.
            client.send(PacketCloseImage { image_name: &self.name })?;
            let grab_focus = !self.was_shown;
            client.send(PacketCreateImage {
                image_name: &self.name,
                grab_focus,
                width,
                height,
                channel_names: &names,
            })?;
            self.was_shown = true;
        }
        let (mut sent, mut unchanged) = (0, 0);
        let mut data = Vec::new();
        for tile in tiles([width, height]) {
            if shown.is_some_and(|shown| is_same(snapshot, shown, tile)) {
                unchanged += 1;
                continue;
            }
            gather(snapshot, tile, &mut data);
            let offsets: Vec<u64> = (0..names.len() as u64).map(|channel| channel * tile.area()).collect();
            client.send(PacketUpdateImage {
                image_name: &self.name,
                grab_focus: false,
                channel_names: &names,
                channel_offsets: &offsets,
                channel_strides: &vec![1; names.len()],
                x: tile.x,
                y: tile.y,
                width: tile.width,
                height: tile.height,
                data: &data,
            })?;
            sent += 1;
        }
        self.queue.sent(sent, unchanged);
        Ok(())
    }
}

/// Whether the connection is closed: tev never sends anything, so whatever can be read is the end.
fn is_closed(stream: &TcpStream) -> bool {
    let peek = || {
        stream.set_nonblocking(true)?;
        let answer = stream.peek(&mut [0]);
        stream.set_nonblocking(false)?;
        answer
    };
    match peek() {
        Ok(read) => read == 0,
        Err(error) => error.kind() != ErrorKind::WouldBlock,
    }
}

/// The tiles of a picture, row by row.
fn tiles(size: [u32; 2]) -> impl Iterator<Item = Crop> {
    let full = Crop::full(size);
    let starts = |length: u32| (0..length).step_by(TILE as usize);
    let tile = |x, y| Crop { x, y, width: TILE, height: TILE };
    starts(size[1]).flat_map(move |y| starts(size[0]).map(move |x| tile(x, y).intersection(&full)))
}

/// The rows of a tile in the data of a layer with `channels` channels; `tile` counts from the corner of the part that
/// layers hold.
fn rows(data: &[f32], width: u32, channels: usize, tile: Crop) -> impl Iterator<Item = &[f32]> {
    let start = move |y: u32| (y as usize * width as usize + tile.x as usize) * channels;
    (tile.y..tile.y + tile.height).map(move |y| &data[start(y)..start(y) + tile.width as usize * channels])
}

/// Whether two pictures of one shape have the same bits in a tile.
fn is_same(a: &Snapshot, b: &Snapshot, tile: Crop) -> bool {
    let width = a.size()[0];
    let same_row = |(a, b): (&[f32], &[f32])| a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits());
    a.layers().zip(b.layers()).all(|(a, b)| {
        let names = &a.names;
        rows(&a.data, width, names.len(), tile).zip(rows(&b.data, width, names.len(), tile)).all(same_row)
    })
}

/// The values of a tile, channel by channel.
fn gather(snapshot: &Snapshot, tile: Crop, out: &mut Vec<f32>) {
    out.clear();
    let width = snapshot.size()[0];
    for layer in snapshot.layers() {
        let names = &layer.names;
        for channel in 0..names.len() {
            for row in rows(&layer.data, width, names.len(), tile) {
                out.extend(row.iter().skip(channel).step_by(names.len()));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::{Image, Layer, LayerKind};

    fn snapshot(size: [u32; 2]) -> Snapshot {
        let pixels = (size[0] * size[1]) as usize;
        let layer =
            |kind: LayerKind, channels: usize| Layer::new(kind, (0..pixels * channels).map(|i| i as f32).collect());
        let layers = vec![layer(LayerKind::Color, 4), layer(LayerKind::Z, 1)];
        Snapshot::new(&Image { size, crop: Crop::full(size), layers, ..Image::default() }, 1)
    }

    #[test]
    fn tiles_cover_every_pixel_once() {
        let size = [TILE * 2 + 3, TILE + 1];
        assert_eq!(tiles(size).map(|tile| tile.area()).sum::<u64>(), u64::from(size[0] * size[1]));
        assert_eq!(tiles(size).count(), 6);
        assert!(tiles(size).all(|tile| tile.fits(size)));
    }

    #[test]
    fn tiles_are_gathered_channel_by_channel() {
        let snapshot = snapshot([3, 2]);
        let mut data = Vec::new();
        gather(&snapshot, Crop { x: 1, y: 1, width: 2, height: 1 }, &mut data);
        assert_eq!(data, [16.0, 20.0, 17.0, 21.0, 18.0, 22.0, 19.0, 23.0, 4.0, 5.0]);
    }

    #[test]
    fn a_single_bit_makes_a_tile_different_and_others_not() {
        let (a, mut b) = (snapshot([300, 10]), snapshot([300, 10]));
        b.layers[1].data[299] = -0.0;
        let changed: Vec<bool> = tiles([300, 10]).map(|tile| !is_same(&a, &b, tile)).collect();
        assert_eq!(changed, [false, false, true]);
        b.layers[1].data[299] = f32::NAN;
        assert!(is_same(&b, &b.clone(), Crop::full([300, 10])));
    }
}
