use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Output, Stdio};

use half::f16;
use serde_json::{Value, json};
use steradian::desc::{LayerKind, OutputDesc, PixelTypeDesc};
use steradian::internal::film::{Image, Layer};
use steradian::internal::output::flip::hdr_flip;
use steradian::internal::output::{RenderInfo, write_exr};

use crate::live_preview::{Client, address};
use crate::util::folder::Folder;
use crate::util::program::{Running, Signal};

const PROGRAM: &str = env!("CARGO_BIN_EXE_steradian");
const SIZE: [u32; 2] = [16, 8];

/// A colour that grows to the right, and perhaps depths.
fn write(path: &Path, size: [u32; 2], gain: f32, has_depth: bool) -> Image {
    let pixels = size[0] * size[1];
    let color = (0..4 * pixels).map(|i| gain * (i % 61) as f32 / 7.0).collect();
    let mut image = Image::of_color(size, color);
    let mut layers = Vec::new();
    if has_depth {
        image.layers.push(Layer::new(LayerKind::Z, (0..pixels).map(|i| i as f32 / 3.0).collect()));
        layers.push(LayerKind::Z);
    }
    let output = OutputDesc { pixel_type: PixelTypeDesc::Float, layers, ..OutputDesc::new("x.exr") };
    write_exr(path, &image, &output, &RenderInfo::default()).unwrap();
    image
}

fn run(arguments: &[&Path]) -> Output {
    Command::new(PROGRAM).arg("view").args(arguments).arg("--no-open").output().unwrap()
}

/// Starts the program, whose first line is the page's address.
fn start(files: &[&Path]) -> (Running, Client) {
    let mut command = Command::new(PROGRAM);
    let mut child = Running::start(command.arg("view").args(files).arg("--no-open").stdout(Stdio::piped()));
    let mut line = String::new();
    BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
    let address = address(line.trim());
    assert!(address.ip().is_loopback(), "{line}");
    (child, Client::new(address))
}

fn halves(body: &[u8]) -> (Vec<u32>, Vec<f32>) {
    let (head, data) = body.split_at(16);
    let word = |bytes: &[u8]| u32::from_le_bytes(bytes.try_into().unwrap());
    let half = |bytes: &[u8]| f16::from_le_bytes(bytes.try_into().unwrap()).to_f32();
    (head.chunks(4).map(word).collect(), data.chunks(2).map(half).collect())
}

#[test]
fn two_files_are_served_with_layers_values_and_differences() {
    let folder = Folder::new();
    let [a, b] = ["a.exr", "b.exr"].map(|name| folder.path(name));
    let (first, second) = (write(&a, SIZE, 1.0, true), write(&b, SIZE, 1.5, false));
    let (mut child, mut client) = start(&[&a, &b]);
    let page = String::from_utf8(client.get("/").body).unwrap();
    assert!(page.contains("FLIP") && !page.contains("http://"), "{page}");

    let state = client.get("/state").json();
    assert_eq!((&state["name"], &state["finished"]), (&json!("a.exr"), &json!(true)));
    assert!(state["statistics"].is_null() && state["picture_spp"].is_null(), "{state}");
    let color = json!({ "name": "color", "channels": ["R", "G", "B", "A"] });
    assert_eq!(state["layers"], json!([color, { "name": "Z", "channels": ["Z"] }]));
    assert_eq!(state["compared"], json!({ "name": "b.exr", "layers": [color] }));

    let as_halves = |data: &[f32]| data.iter().map(|v| f16::from_f32(*v).to_f32()).collect::<Vec<_>>();
    for (target, channels, data) in [
        ("/layer?index=0", 4, &first.layers[0].data),
        ("/layer?index=1", 1, &first.layers[1].data),
        ("/layer?index=0&picture=1", 4, &second.layers[0].data),
        ("/flip", 1, &hdr_flip(&first, &second).unwrap()),
    ] {
        let (head, found) = halves(&client.get(target).body);
        assert_eq!((&head[1..], found), (&[SIZE[0], SIZE[1], channels][..], as_halves(data)), "{target}");
    }
    assert_eq!(client.get("/layer?index=1&picture=1").status, 404);

    let pixel = client.get("/pixel?x=3&y=2").json();
    let values = |layers: &Value| -> Vec<f32> {
        layers[0]["values"].as_array().unwrap().iter().map(|v| v.to_string().parse().unwrap()).collect()
    };
    assert_eq!(values(&pixel["layers"]), first.pixel(LayerKind::Color, 3, 2).unwrap());
    assert_eq!(values(&pixel["compared"]), second.pixel(LayerKind::Color, 3, 2).unwrap());

    child.signal(Signal::INT);
    assert_eq!(child.wait().unwrap().code(), Some(0));
}

#[test]
fn one_file_is_compared_with_nothing() {
    let folder = Folder::new();
    let a = folder.path("a.exr");
    write(&a, SIZE, 1.0, false);
    let (child, mut client) = start(&[&a]);
    assert!(client.get("/state").json()["compared"].is_null());
    assert_eq!([client.get("/flip").status, client.get("/layer?index=0&picture=1").status], [404, 404]);
    drop(child);
}

#[test]
fn faults_end_the_program_as_they_end_check_exr() {
    let folder = Folder::new();
    let good = folder.path("good.exr");
    write(&good, SIZE, 1.0, true);
    let bytes = std::fs::read(&good).unwrap();
    let mut wrong_size = bytes.clone();
    // The data window's right edge, after its name, its type and the length of its value.
    let window = bytes.windows(11).position(|name| name == b"dataWindow\0").unwrap() + 11 + 6 + 4 + 8;
    wrong_size[window..window + 4].copy_from_slice(&0x7fff_ffffi32.to_le_bytes());
    let files = [
        folder.write("text.exr", "no picture"),
        folder.write("cut.exr", &bytes[..bytes.len() / 2]),
        folder.write("huge.exr", wrong_size),
        folder.path("missing.exr"),
    ];
    for file in &files {
        let check = Command::new(PROGRAM).arg("check-exr").arg(file).output().unwrap();
        for run in [run(&[file]), run(&[&good, file])] {
            let error = String::from_utf8(run.stderr).unwrap();
            assert_eq!(run.status.code(), check.status.code(), "{error}");
            assert!(error.lines().count() == 1 && error.contains(file.to_str().unwrap()), "{error}");
        }
    }
    let small = folder.path("small.exr");
    write(&small, [4, 4], 1.0, false);
    let mismatch = run(&[&good, &small]);
    let error = String::from_utf8(mismatch.stderr).unwrap();
    assert_eq!(mismatch.status.code(), Some(2));
    assert!(error.contains("4x4 pixels") && error.contains("16x8"), "{error}");
}
