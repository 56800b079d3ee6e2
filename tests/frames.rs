//! Sequences of frames from the command line.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Output, Stdio};

use serde_json::{Value, json};
use steradian::internal::output;

use crate::util::program::{Running, Signal};

/// A sphere that crosses the picture in four frames.
fn scene() -> Value {
    json!({
        "film": { "width": 24, "height": 16 },
        "camera": { "position": [0, 0, 4], "look_at": [0, 0, 0], "shutter": [0, 0.5] },
        "sampler": { "spp": 4 },
        "shapes": [{ "type": "sphere", "radius": 0.5, "motion": [
            { "time": 0, "transform": [{ "translate": [-1, 0, 0] }] },
            { "time": 4, "transform": [{ "translate": [1, 0, 0] }] },
        ] }],
        "lights": [{ "type": "environment", "radiance": [1, 1, 1] }],
    })
}

fn steradian(folder: &Path, arguments: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_steradian"));
    command.current_dir(folder).args(arguments.split_whitespace()).env("XDG_CONFIG_HOME", folder);
    command
}

fn run(folder: &Path, arguments: &str) -> Output {
    steradian(folder, arguments).output().unwrap()
}

fn stderr_of(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn folder_with(scenes: &[(&str, Value)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, scene) in scenes {
        std::fs::write(folder.path().join(name), scene.to_string()).unwrap();
    }
    folder
}

/// The header of a file and its pixels.
fn pixels(path: &Path) -> Vec<u32> {
    let image = output::read_exr(path).unwrap();
    image.layers.iter().flat_map(|layer| layer.data.iter().map(|value| value.to_bits())).collect()
}

#[test]
fn a_frame_is_the_scene_with_its_shutter_moved() {
    let mut later = scene();
    later["camera"]["shutter"] = json!([2, 2.5]);
    let folder = folder_with(&[("a.json", scene()), ("later.json", later)]);
    let output = run(folder.path(), "render a.json --frames 0-2 -o a.####.exr -o small_%02d.png --float --layers Z");
    assert_eq!(output.status.code(), Some(0), "{}", stderr_of(&output));
    for (arguments, frame) in [("render a.json", "a.0000.exr"), ("render later.json --seed 2", "a.0002.exr")] {
        assert!(run(folder.path(), &format!("{arguments} -o single.exr --float --layers Z")).status.success());
        assert_eq!(pixels(&folder.path().join("single.exr")), pixels(&folder.path().join(frame)), "{frame}");
    }
    assert_ne!(pixels(&folder.path().join("a.0000.exr")), pixels(&folder.path().join("a.0001.exr")));
    assert!(folder.path().join("small_02.png").exists());
}

#[test]
fn frames_that_are_there_are_skipped_unless_they_are_to_be_overwritten() {
    let folder = folder_with(&[("a.json", scene())]);
    // Without a place for the number there is one before the extension; of a half-finished frame the other half is
    // rendered.
    std::fs::write(folder.path().join("a.0002.exr"), "stays").unwrap();
    std::fs::write(folder.path().join("a.0002.png"), "stays").unwrap();
    std::fs::write(folder.path().join("a.0003.exr"), "goes").unwrap();
    let output = run(folder.path(), "render a.json --frames 1-3 -o a.exr -o a.png");
    assert_eq!(output.status.code(), Some(0), "{}", stderr_of(&output));
    assert!(stderr_of(&output).contains("1 frame exists and is skipped"), "{}", stderr_of(&output));
    let size = |name: &str| std::fs::metadata(folder.path().join(name)).unwrap().len();
    assert!(size("a.0001.exr") > 5 && size("a.0002.exr") == 5 && size("a.0003.exr") > 5);
    let again = run(folder.path(), "render a.json --frames 1-3 -o a.exr -o a.png");
    assert!(
        stderr_of(&again).contains("3 frames exist") && stderr_of(&again).ends_with("Progress: 100%\n"),
        "{}",
        stderr_of(&again)
    );
    assert!(run(folder.path(), "render a.json --frames 2 -o a.exr -o a.png --overwrite").status.success());
    assert!(size("a.0002.exr") > 5);
}

#[test]
fn frames_that_are_skipped_are_compared_with_this_render() {
    let folder = folder_with(&[("a.json", scene())]);
    let render = |arguments: &str| stderr_of(&run(folder.path(), &format!("render a.json -o a.exr {arguments}")));
    assert!(!render("--frames 1-3").contains("warning"));
    // The same again is no mixture, whatever frame comes first.
    let same = render("--frames 2-4");
    assert!(same.contains("2 frames exist") && !same.contains("warning"), "{same}");
    let other = render("--frames 1-5 --spp 8 --exr compression=piz");
    let warning = other.lines().find(|line| line.contains("warning")).unwrap_or_default().to_owned();
    for part in ["frames 1-4: ", "spp: 4 in the file, 8 for the rest", "output.compression", "--overwrite"] {
        assert!(warning.contains(part), "{part}: {other}");
    }
    assert!(!warning.contains("seed") && !warning.contains("scene"), "{other}");
    // Another scene, and files without settings.
    let mut changed = scene();
    changed["lights"][0]["radiance"] = json!([2, 2, 2]);
    std::fs::write(folder.path().join("a.json"), changed.to_string()).unwrap();
    std::fs::write(folder.path().join("a.0002.exr"), "by others").unwrap();
    let other = render("--frames 1-3");
    assert!(other.contains("frames 1,3: ") && other.contains("another scene: the scene's description"), "{other}");
    assert!(other.contains("the files of 1 of the frames have no settings"), "{other}");
    // Names that the scene has.
    changed["outputs"] = json!([{ "file": "a.exr" }]);
    std::fs::write(folder.path().join("b.json"), changed.to_string()).unwrap();
    let other = stderr_of(&run(folder.path(), "render b.json --frames 5"));
    assert!(other.contains("frame 5: ") && other.contains("spp: 8 in the file, 4 for the rest"), "{other}");
    assert!(!stderr_of(&run(folder.path(), "render a.json -o a.exr --frames 1-3 --overwrite")).contains("warning"));
}

#[test]
fn a_scene_for_each_frame_is_read_for_each_and_a_failure_stops_by_default() {
    let mut bright = scene();
    bright["lights"][0]["radiance"] = json!([4, 4, 4]);
    let folder = folder_with(&[("s.0001.json", scene()), ("s.0003.json", bright)]);
    let output = run(folder.path(), "render s.####.json --frames 1-3 -o o.exr");
    assert_eq!(output.status.code(), Some(4), "{}", stderr_of(&output));
    assert!(stderr_of(&output).contains("error: frame 2: s.0002.json"), "{}", stderr_of(&output));
    assert!(folder.path().join("o.0001.exr").exists() && !folder.path().join("o.0003.exr").exists());

    let output = run(folder.path(), "render s.####.json --frames 1-3 -o o.exr --keep-going");
    assert_eq!(output.status.code(), Some(4));
    let sum = |name: &str| output::read_exr(&folder.path().join(name)).unwrap().layers[0].data.iter().sum::<f32>();
    assert!(sum("o.0003.exr") > 2.0 * sum("o.0001.exr"));
}

#[test]
fn progress_is_that_of_the_sequence_and_complete_only_at_its_end() {
    let folder = folder_with(&[("a.json", scene())]);
    let output = run(folder.path(), "render a.json --frames 1-4 -o a.exr --progress alf -q");
    let lines: Vec<String> = stderr_of(&output).lines().map(str::to_owned).collect();
    let percents: Vec<u32> = lines
        .iter()
        .map(|l| l.strip_prefix("ALF_PROGRESS ").unwrap().strip_suffix('%').unwrap().parse().unwrap())
        .collect();
    assert!(percents.is_sorted() && percents.last() == Some(&100), "{lines:?}");
    assert_eq!(percents.iter().filter(|percent| **percent == 100).count(), 1);

    let output = run(folder.path(), "render a.json --frames 7,9 -o b.exr --progress afanasy -q");
    let stderr = stderr_of(&output);
    let counted: Vec<&str> = stderr.lines().filter(|line| line.starts_with("FRAME: ")).collect();
    assert_eq!(counted, ["FRAME: 7", "FRAME: 9"]);
    assert!(stderr.ends_with("PROGRESS: 100%\n[ PARSER FINISHED SUCCESS ]\n"), "{stderr}");
}

#[test]
fn an_interrupt_ends_the_sequence() {
    let folder = folder_with(&[("a.json", scene())]);
    let mut command =
        steradian(folder.path(), "render a.json --frames 1-100000 -o a.exr --spp 4000 --progress afanasy");
    let mut child = Running::start(command.stderr(Stdio::piped()));
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines().map_while(Result::ok);
    assert!(lines.any(|line| line == "FRAME: 2"));
    child.signal(Signal::INT);
    let rest: Vec<String> = lines.collect();
    assert_eq!(child.wait().unwrap().code(), Some(130), "{rest:?}");
    assert!(!rest.iter().any(|line| line.contains("SUCCESS")));
    // Whatever is there counts as complete: of the frame under way there is nothing.
    let is_frame =
        |entry: std::io::Result<std::fs::DirEntry>| entry.unwrap().path().extension().is_some_and(|e| e == "exr");
    let written = std::fs::read_dir(folder.path()).unwrap().filter_map(|entry| is_frame(entry).then_some(())).count();
    let complete = 1 + rest.iter().filter(|line| line.starts_with("wrote a.")).count();
    assert!(written == complete && !rest.iter().any(|line| line.contains("(interrupted)")), "{written} {rest:?}");
}

#[test]
fn wrong_frames_are_refused() {
    let folder = folder_with(&[("a.json", scene())]);
    for arguments in
        ["--frames 1-", "--frames x", "--overwrite", "--frames 1 --fps 0", "--frames 1-2 --preview 0 --preview-hold"]
    {
        assert_eq!(run(folder.path(), &format!("render a.json {arguments}")).status.code(), Some(2), "{arguments}");
    }
}
