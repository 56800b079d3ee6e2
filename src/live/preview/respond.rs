//! The resources of the server.
//!
//! | path | response |
//! |---|---|
//! | `/` | the page |
//! | `/state?page=P&have=V` | numbers, layers as JSON; page P has picture V; the next is requested without `idle=1` |
//! | `/layer?index=I&picture=P` | a layer: version, width, height, channels (little-endian u32), then 16-bit floats |
//! | `/pixel?x=X&y=Y` | every layer's exact values at a pixel as JSON |
//! | `/flip` | how much two pictures seem to differ, as a layer of one channel |
//!
//! Picture 1 is the one that another is compared with, 0 the other; without `picture` it is 0.

use std::io;

use half::f16;
use half::slice::HalfFloatSliceExt;
use serde_json::{Value, json};

use super::http::{Connection, Request};
use super::{Shared, Snapshot};
use crate::output::NamedLayer;

const PAGE: &str = include_str!("page.html");

/// Values converted at a time.
const PIECE: usize = 32768;

const OK: &str = "200 OK";
const JSON: &str = "application/json";

pub fn respond(connection: &mut Connection, request: &Request, shared: &Shared) -> io::Result<()> {
    match request.path() {
        "/" => connection.respond(OK, "text/html; charset=utf-8", PAGE.as_bytes()),
        "/state" => {
            if let (Some(page), Some(version)) = (request.number("page"), request.number("have")) {
                shared.board.visit(page, version, request.number("idle") == Some(1));
            }
            connection.respond(OK, JSON, state(shared).to_string().as_bytes())
        }
        "/layer" if request.number("picture") == Some(1) => {
            let index = request.number("index").and_then(|index| usize::try_from(index).ok());
            let layer = shared.compared.as_ref().and_then(|other| other.snapshot.layers().nth(index?));
            match (&shared.compared, layer) {
                (Some(other), Some(layer)) => send(connection, 1, other.snapshot.size(), layer),
                _ => not_found(connection),
            }
        }
        "/layer" => layer(connection, request, shared),
        "/flip" => match shared.compared.as_ref().zip(shared.board.current().snapshot) {
            Some((other, snapshot)) => send(connection, 1, snapshot.size(), other.flip(&snapshot)),
            None => not_found(connection),
        },
        "/pixel" => match pixel(request, shared) {
            Some(value) => connection.respond(OK, JSON, value.to_string().as_bytes()),
            None => not_found(connection),
        },
        _ => not_found(connection),
    }
}

fn not_found(connection: &mut Connection) -> io::Result<()> {
    connection.respond("404 Not Found", "text/plain", b"not found")
}

fn state(shared: &Shared) -> Value {
    let shown = shared.board.current();
    let snapshot = shown.snapshot.as_deref();
    let compared =
        shared.compared.as_ref().map(|other| json!({ "name": other.name, "layers": layers_of(&other.snapshot) }));
    json!({
        "name": shared.name,
        "view": shared.view.name(),
        "version": shown.version,
        "finished": shown.finished,
        "size": snapshot.map(Snapshot::size),
        "origin": snapshot.map(Snapshot::origin),
        "picture_spp": snapshot.and_then(|snapshot| snapshot.spp),
        "layers": snapshot.map(layers_of).unwrap_or_default(),
        "statistics": shared.statistics.as_ref().map(|statistics| statistics.numbers()),
        "compared": compared,
    })
}

fn layers_of(snapshot: &Snapshot) -> Vec<Value> {
    let layer = |layer: &NamedLayer| json!({ "name": Snapshot::title(&layer.names), "channels": layer.names });
    snapshot.layers().map(layer).collect()
}

/// The connection holds its picture while it sends.
fn layer(connection: &mut Connection, request: &Request, shared: &Shared) -> io::Result<()> {
    let Some(shown) = shared.board.take() else {
        return connection.respond("503 Service Unavailable", "text/plain", b"too many slow readers");
    };
    let index = request.number("index").and_then(|index| usize::try_from(index).ok());
    let (Some(snapshot), Some(index)) = (shown.snapshot, index) else { return not_found(connection) };
    match snapshot.layers().nth(index) {
        Some(layer) => send(connection, shown.version as u32, snapshot.size(), layer),
        None => not_found(connection),
    }
}

/// Sends a layer of a picture of this size.
fn send(connection: &mut Connection, version: u32, size: [u32; 2], layer: &NamedLayer) -> io::Result<()> {
    let head = [version, size[0], size[1], layer.names.len() as u32];
    connection.start(
        OK,
        "application/octet-stream",
        (size_of_val(&head) + layer.data.len() * size_of::<f16>()) as u64,
    )?;
    connection.write(&head.map(u32::to_le_bytes).concat())?;
    let (mut halves, mut bytes) = (vec![f16::ZERO; PIECE], Vec::with_capacity(PIECE * size_of::<f16>()));
    for piece in layer.data.chunks(PIECE) {
        let halves = &mut halves[..piece.len()];
        halves.convert_from_f32_slice(piece);
        bytes.clear();
        bytes.extend(halves.iter().flat_map(|half| half.to_le_bytes()));
        connection.write(&bytes)?;
    }
    Ok(())
}

fn pixel(request: &Request, shared: &Shared) -> Option<Value> {
    let shown = shared.board.current();
    let snapshot = shown.snapshot?;
    let [x, y] = [request.number("x")?, request.number("y")?];
    let [width, height] = snapshot.size().map(u64::from);
    if x >= width || y >= height {
        return None;
    }
    let index = usize::try_from(y * width + x).ok()?;
    let compared = shared.compared.as_ref().map(|other| values_of(&other.snapshot, index));
    let layers = values_of(&snapshot, index);
    Some(json!({ "version": shown.version, "x": x, "y": y, "layers": layers, "compared": compared }))
}

/// Every layer's values at a pixel.
fn values_of(snapshot: &Snapshot, index: usize) -> Vec<Value> {
    let values = |layer: &NamedLayer| -> Vec<Value> {
        let mut pixels = layer.data.chunks_exact(layer.names.len());
        pixels.nth(index).unwrap_or_default().iter().map(|value| number(*value)).collect()
    };
    snapshot.layers().map(|layer| json!({ "channels": layer.names, "values": values(layer) })).collect()
}

/// The shortest decimal that is this value; JSON has no others than finite ones, so the rest are texts.
fn number(value: f32) -> Value {
    if !value.is_finite() {
        return value.to_string().into();
    }
    value.to_string().parse::<f64>().map_or(Value::Null, Value::from)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_sent_exactly() {
        for value in [0.1f32, -1.5e-30, 16_777_217.0, f32::MAX, 1.0 / 3.0] {
            let printed = number(value).to_string();
            assert_eq!(printed.parse::<f32>().unwrap(), value, "{printed}");
        }
        assert_eq!(number(0.1), json!(0.1));
        assert_eq!(
            [number(f32::NAN), number(f32::INFINITY), number(f32::NEG_INFINITY)],
            [json!("NaN"), json!("inf"), json!("-inf")]
        );
    }
}
