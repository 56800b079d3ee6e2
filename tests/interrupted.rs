//! Renders by the program that are killed or answer signals, and what is wrong with their checkpoints.

use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use serde_json::json;
use steradian::internal::math::Rng;
use steradian::internal::render::{Header, StateFile};

use crate::checkpoints::scene;
use crate::util::program::{Running, Signal};

const SLOW: &str = "render scene.json --checkpoint a.state --threads 2 --spp 64 --size 96x72 --layers \
                    Z,N,albedo,variance,samples --float -q -o a.exr";

fn command(folder: &Path, line: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_steradian"));
    command.current_dir(folder).args(line.split_whitespace()).stderr(Stdio::piped());
    command
}

fn run(folder: &Path, line: &str) -> Output {
    command(folder, line).output().unwrap()
}

#[track_caller]
fn assert_code(output: &Output, code: i32, part: &str) {
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code() == Some(code) && text.contains(part), "{:?}: {text}", output.status);
}

/// Waits until there is a file that is newer than `than`.
fn wait_for(path: &Path, than: Option<std::time::SystemTime>) {
    let start = Instant::now();
    while std::fs::metadata(path).ok().and_then(|m| m.modified().ok()) <= than {
        assert!(start.elapsed() < Duration::from_secs(60), "no new {}", path.display());
        std::thread::sleep(Duration::from_millis(5));
    }
}

fn folder_with_scene() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = scene("mitchell");
    scene["outputs"] =
        json!([{ "file": "x.exr", "layers": ["Z", "N", "albedo", "variance", "samples"], "pixel_type": "float" }]);
    std::fs::write(folder.path().join("scene.json"), scene.to_string()).unwrap();
    folder
}

/// The channels of an EXR file with the bits of their pixels.
pub fn channels(path: &Path) -> Vec<(String, Vec<u32>)> {
    let file = exr::prelude::read_all_flat_layers_from_file(path).unwrap();
    let channels = file.layer_data.iter().flat_map(|layer| &layer.channel_data.list);
    channels
        .map(|channel| (channel.name.to_string(), channel.sample_data.values_as_f32().map(f32::to_bits).collect()))
        .collect()
}

fn same_pictures(folder: &Path, a: &str, b: &str) -> bool {
    let [a, b] = [a, b].map(|name| channels(&folder.join(name)));
    assert!(a.len() > 10, "{}", a.len());
    a == b
}

#[test]
fn killed_renders_go_on_and_leave_no_trace() {
    let folder = folder_with_scene();
    let folder = folder.path();
    assert_code(&run(folder, &SLOW.replace("a.state", "b.state").replace("a.exr", "b.exr")), 0, "");
    let mut rng = Rng::new(11);
    for kill in 0..3 {
        let mut child = Running::start(&mut command(folder, &format!("{SLOW} --every 0.05 --resume")));
        let there = std::fs::metadata(folder.join("a.state")).ok().and_then(|m| m.modified().ok());
        wait_for(&folder.join("a.state"), there);
        std::thread::sleep(Duration::from_millis(rng.below(60) as u64));
        child.kill().unwrap();
        child.wait().unwrap();
        assert!(Header::read(&folder.join("a.state")).unwrap().done > kill, "no headway");
    }
    assert_code(&run(folder, &format!("{SLOW} --resume")), 0, "");
    assert!(same_pictures(folder, "a.exr", "b.exr"));
    let mut names: Vec<_> =
        std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    assert_eq!(names, ["a.exr", "a.state", "b.exr", "b.state", "scene.json"]);
    // More samples continue from what is there.
    assert_code(&run(folder, &format!("{} --resume", SLOW.replace("64 ", "80 "))), 0, "");
    assert_code(
        &run(folder, &SLOW.replace("64 ", "80 ").replace("a.state", "c.state").replace("a.exr", "c.exr")),
        0,
        "",
    );
    assert!(same_pictures(folder, "a.exr", "c.exr") && !same_pictures(folder, "b.exr", "c.exr"));
}

#[test]
fn signals_are_answered() {
    let folder = folder_with_scene();
    let folder = folder.path();
    let endless = "render scene.json --checkpoint a.state --resume --every 1000 --spp 2000000000 -q -o a.exr";
    let done = || Header::read(&folder.join("a.state")).unwrap().done;
    let mut before = 0;
    for (signal, code) in [(Signal::TERM, 143), (Signal::INT, 130)] {
        let there = std::fs::metadata(folder.join("a.state")).ok().and_then(|m| m.modified().ok());
        let child = Running::start(&mut command(folder, endless));
        // From its lock file on, the program listens to SIGUSR1; the signal is repeated, for it may come before that.
        wait_for(&folder.join(".a.state.lock"), None);
        child.signal(Signal::USR1);
        wait_for(&folder.join("a.state"), there);
        let requested = done();
        assert!(requested > before);
        child.signal(signal);
        assert_code(&child.output(), code, "");
        before = done();
        assert!(before >= requested && folder.join("a.exr").exists());
    }
}

#[test]
fn faults_of_checkpoints_have_their_codes() {
    let folder = folder_with_scene();
    let folder = folder.path();
    let line = "render scene.json --size 24x20 -q -o a.exr --checkpoint";
    assert_code(&run(folder, &format!("{line} a.state --spp 2")), 0, "");
    let whole = std::fs::read(folder.join("a.state")).unwrap();
    std::fs::write(folder.join("other"), "no checkpoint").unwrap();
    let cases = [
        ("a.state --spp 2", 2, "--resume continues it"),
        ("other", 2, "the file exists"),
        ("other --resume", 6, "this is not a checkpoint"),
        ("scene.json --resume", 2, "scene.json (the scene) and scene.json (--checkpoint)"),
        ("missing/a.state", 5, "no folder missing"),
        ("/proc/a.state", 5, "no file can be created"),
        ("a.state --resume --spp 2 --seed 4", 6, "seed: 0 in the checkpoint, 4 requested"),
        ("a.state --resume --spp 1", 6, "2 samples already"),
        ("a.state --every x", 2, "--every"),
    ];
    for (rest, code, part) in cases {
        assert_code(&run(folder, &format!("{line} {rest}")), code, part);
        assert!(std::fs::read(folder.join("a.state")).unwrap() == whole, "{rest}");
    }
    std::fs::write(folder.join("cut.state"), &whole[..whole.len() / 2]).unwrap();
    assert_code(&run(folder, &format!("{line} cut.state --resume")), 6, "cut.state: the file is cut short");
    let mut altered = whole.clone();
    altered[whole.len() / 2] ^= 4;
    std::fs::write(folder.join("altered.state"), &altered).unwrap();
    assert_code(&run(folder, &format!("{line} altered.state --resume")), 6, "altered.state: the file was altered");
    // Another writer.
    let file = StateFile::take(&folder.join("a.state")).unwrap();
    assert_code(&run(folder, &format!("{line} a.state --resume")), 5, "a.state: another process");
    drop(file);
    // Nothing is lost with the scene.
    std::fs::rename(folder.join("scene.json"), folder.join("gone.json")).unwrap();
    assert_code(&run(folder, &format!("{line} a.state --resume")), 4, "scene.json");
    assert!(std::fs::read(folder.join("a.state")).unwrap() == whole);
}
