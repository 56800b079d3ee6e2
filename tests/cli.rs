//! The program as its users and scripts see it.

use std::io::{BufRead, BufReader};
use std::process::Stdio;

use serde_json::Value;
use steradian::internal::output;

use crate::util::program::{Running, Signal, run, stderr_of, steradian};

#[test]
fn faults_have_their_exit_codes_and_one_line() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("broken.json"), "{").unwrap();
    let cases = [
        ("render scene.json --spp 0", 2),
        ("render scene.json --nonsense", 2),
        ("render scene.json -o a.jpg", 2),
        ("render broken.json", 3),
        ("render missing.json", 4),
        ("render scene.json -o missing/a.exr", 5),
        ("render scene.json --stats missing/a.json", 5),
        ("render scene.json --size 65536x65536", 33),
        ("compare a.exr b.exr", 4),
        ("--help", 0),
        ("render --help", 0),
    ];
    for (arguments, code) in cases {
        let output = run(folder.path(), arguments);
        assert_eq!(output.status.code(), Some(code), "{arguments}: {}", stderr_of(&output));
        assert_eq!(stderr_of(&output).matches("error:").count(), usize::from(code != 0), "{arguments}");
        assert_eq!(output.stdout.is_empty(), code != 0, "{arguments}");
    }
    // Nothing was left behind.
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2);
}

/// A scene that does not exist is named even if an option's value is wrong, too.
#[test]
fn a_missing_scene_and_a_wrong_value_are_both_reported() {
    let folder = tempfile::tempdir().unwrap();
    for (arguments, missing) in [
        ("render missing.json --layers Q", true),
        ("render --spp many missing.json", true),
        ("info missing.json --time x", true),
        ("render scene.json --layers Q", false),
        ("render shot.####.json --frames 1-2 --layers Q", false),
    ] {
        let output = run(folder.path(), arguments);
        let text = stderr_of(&output);
        assert_eq!(output.status.code(), Some(2), "{arguments}: {text}");
        assert_eq!(text.starts_with("error: missing.json: no such file\n"), missing, "{arguments}: {text}");
        assert!(text.contains("error: invalid value"), "{arguments}: {text}");
    }
    let old = stderr_of(&run(folder.path(), "render scene.json --owner me"));
    assert!(old.contains("In place of --owner: --exr owner=TEXT"), "{old}");
}

#[test]
fn without_outputs_the_files_are_named_after_the_scene() {
    let folder = tempfile::tempdir().unwrap();
    let output = run(folder.path(), "render scene.json --layers Z --stats stats.json --accel embree");
    assert_eq!(output.status.code(), Some(0), "{}", stderr_of(&output));
    let stderr = stderr_of(&output);
    assert!(
        stderr.contains("wrote scene.exr\n")
            && stderr.contains("wrote scene.png\n")
            && stderr.ends_with("Progress: 100%\n"),
        "{stderr}"
    );
    assert!(folder.path().join("scene.png").exists());
    let image = output::read_exr(&folder.path().join("scene.exr")).unwrap();
    assert_eq!(image.size, [24, 16]);

    let stats: Value =
        serde_json::from_str(&std::fs::read_to_string(folder.path().join("stats.json")).unwrap()).unwrap();
    assert_eq!(
        (&stats["samples"], &stats["spp"], &stats["interrupted"], &stats["light_tracing"]),
        (&Value::from(24 * 16 * 2), &Value::from(2), &Value::from(false), &Value::from("off"))
    );
    for key in [
        "load_seconds",
        "build_seconds",
        "first_pass_seconds",
        "render_seconds",
        "mrays_per_second",
        "msamples_per_second",
        "peak_memory_bytes",
        "nan_samples",
        "threads",
    ] {
        assert!(stats[key].is_number(), "{key}: {stats}");
    }
    assert!(stats["rays"]["camera"].as_u64().is_some_and(|rays| rays >= 24 * 16 * 2), "{stats}");
    assert!(stats["embree"]["version"].is_string() && stats["embree"]["isa"].is_string(), "{stats}");
}

#[test]
fn quiet_runs_say_nothing_and_statistics_go_to_stdout() {
    let folder = tempfile::tempdir().unwrap();
    let output = run(folder.path(), "render scene.json -q -o a.exr --stats -");
    assert_eq!((output.status.code(), stderr_of(&output).as_str()), (Some(0), ""));
    let stats: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(stats["outputs"], serde_json::json!(["a.exr"]));

    // The same scene again is the same picture; another seed is not.
    for (name, seed) in [("b.exr", 0), ("c.exr", 1)] {
        assert!(run(folder.path(), &format!("render scene.json -q -o {name} --seed {seed}")).status.success());
    }
    let compare = |name: &str| -> Value {
        serde_json::from_slice(&run(folder.path(), &format!("compare a.exr {name} --json")).stdout).unwrap()
    };
    assert_eq!((&compare("b.exr")["mse"], &compare("b.exr")["psnr"]), (&Value::from(0.0), &Value::Null));
    assert!(compare("c.exr")["mse"].as_f64().is_some_and(|mse| mse > 0.0));
}

#[test]
fn a_replay_prints_the_sample_and_writes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let output = run(folder.path(), "render scene.json --pixel 12,8 --sample 1");
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(
        text.starts_with("radiance  ") && text.contains("\nalpha     1\n") && text.contains("\ndepth     3"),
        "{text}"
    );
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    assert_eq!(run(folder.path(), "render scene.json --pixel 24,8 --sample 1").status.code(), Some(2));
}

/// The first signal finishes the samples under way, writes the picture and gives the signal's code.
#[test]
fn interrupted_renders_write_their_picture() {
    for (signal, code) in [(Signal::INT, 130), (Signal::TERM, 143)] {
        let folder = tempfile::tempdir().unwrap();
        let mut command =
            steradian(folder.path(), "render scene.json --spp 2000000000 --time-limit 60 -o a.exr --threads 1");
        let mut child = Running::start(command.stderr(Stdio::piped()));
        // With the first line of progress the program listens.
        let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
        let first = lines.next().unwrap().unwrap();
        assert!(first.starts_with("Progress: "), "{first}");
        child.signal(signal);
        let rest: Vec<String> = lines.map_while(Result::ok).collect();
        assert_eq!(child.wait().unwrap().code(), Some(code), "{rest:?}");
        assert!(rest.iter().any(|line| line == "wrote a.exr"), "{rest:?}");
        assert!(output::read_exr(&folder.path().join("a.exr")).is_ok());
    }
}

/// A box of mirrors, whose paths never end: neither does the first pass.
const MIRRORS: &str = r#"{
    "film": { "width": 8, "height": 8 }, "sampler": { "spp": 1 },
    "camera": { "position": [0, 0, 0], "look_at": [0.3, 0.2, -1] },
    "materials": { "m": { "type": "mirror" } },
    "shapes": [{ "type": "cube", "material": "m" }],
    "lights": [{ "type": "environment", "radiance": [1, 1, 1] }],
    "integrator": { "type": "path", "max_depth": 4294967295, "rr_depth": 4294967295 }
}"#;

#[test]
fn signals_and_time_limits_end_a_pass_that_does_not_end() {
    let folder = tempfile::tempdir().unwrap();
    let limited = |options: &str| {
        let mut command = steradian(folder.path(), &format!("render mirrors.json -o a.exr --threads 1 -v {options}"));
        std::fs::write(folder.path().join("mirrors.json"), MIRRORS).unwrap();
        Running::start(command.stderr(Stdio::piped()))
    };
    let output = limited("--time-limit 0.1").output();
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert!(message.contains("--time-limit 0.1: "), "{message}");

    for options in ["", "--guiding", "--target-error 0.1"] {
        let mut child = limited(options);
        // The program listens as soon as the accelerator is built.
        let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
        lines.by_ref().map_while(Result::ok).find(|line| line.contains("to build")).unwrap();
        std::thread::sleep(std::time::Duration::from_millis(300));
        child.signal(Signal::INT);
        let rest: Vec<String> = lines.map_while(Result::ok).collect();
        assert_eq!(child.wait().unwrap().code(), Some(130), "{options}: {rest:?}");
    }
    assert!(!folder.path().join("a.exr").exists());
}

/// A file that cannot be written in the end is an error, and the others are there.
#[test]
fn a_file_that_cannot_be_written_does_not_take_the_others_along() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("gone")).unwrap();
    let line = "render scene.json --spp 2000000000 --time-limit 60 -o gone/a.exr -o b.png -o c.exr --threads 1";
    let mut child = Running::start(steradian(folder.path(), line).stderr(Stdio::piped()));
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
    assert!(lines.next().unwrap().unwrap().starts_with("Progress: "));
    std::fs::remove_dir_all(folder.path().join("gone")).unwrap();
    child.signal(Signal::INT);
    let rest: Vec<String> = lines.map_while(Result::ok).collect();
    assert_eq!(child.wait().unwrap().code(), Some(5), "{rest:?}");
    assert!(rest.iter().any(|line| line.starts_with("error: cannot write gone/a.exr")), "{rest:?}");
    for file in ["b.png", "c.exr"] {
        assert!(rest.contains(&format!("wrote {file}")) && folder.path().join(file).exists(), "{rest:?}");
    }
}

#[test]
fn without_arguments_first_steps_are_printed() {
    let folder = tempfile::tempdir().unwrap();
    let output = run(folder.path(), "");
    assert_eq!((output.status.code(), output.stdout.len()), (Some(2), 0));
    let stderr = stderr_of(&output);
    assert!(stderr.lines().count() < 12 && stderr.contains("  steradian render scene.json -o picture.exr"), "{stderr}");

    let output = run(folder.path(), "scene.json");
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr_of(&output).ends_with("To render a scene: steradian render scene.json\n"), "{}", stderr_of(&output));
    let output = run(folder.path(), "render scene.json --samples 5");
    assert!(stderr_of(&output).ends_with("In place of --samples: --spp N\n"), "{}", stderr_of(&output));
}

#[test]
fn the_short_help_shows_the_common_options() {
    let folder = tempfile::tempdir().unwrap();
    let options = |arguments: &str| {
        let output = run(folder.path(), arguments);
        let text = String::from_utf8(output.stdout).unwrap();
        let names = text.lines().map(str::trim_start).filter(|line| line.starts_with('-'));
        names
            .filter_map(|line| line.split_whitespace().find(|word| word.starts_with("--")))
            .map(str::to_owned)
            .collect()
    };
    let [short, long]: [Vec<String>; 2] = [options("render -h"), options("render --help")];
    assert!((18..=24).contains(&short.len()), "{short:?}");
    assert!(long.len() > 50 && short.iter().all(|option| long.contains(option)), "{long:?}");
    for option in ["--output", "--spp", "--size", "--threads", "--time-limit", "--denoise", "--quiet"] {
        assert!(short.iter().any(|shown| shown.trim_end_matches(',') == option), "{option}: {short:?}");
    }
    assert!(!short.contains(&"--log-file".to_owned()) && long.contains(&"--log-file".to_owned()));

    let help = String::from_utf8(run(folder.path(), "render --help").stdout).unwrap();
    for value in ["- mis:", "- N:", "- agx:", "- whitted:", "zips           Deflate line by line"] {
        assert!(help.contains(value), "{value} has no description: {help}");
    }
    let help = String::from_utf8(run(folder.path(), "bench scale --help").stdout).unwrap();
    assert!(help.contains("- triangles:") && help.contains("triangles of a mesh"), "{help}");
}

#[test]
fn info_shows_the_picture_the_camera_and_the_cost() {
    let folder = tempfile::tempdir().unwrap();
    let output = run(folder.path(), "info scene.json");
    let text = String::from_utf8(output.stdout).unwrap();
    for part in ["24 x 16 pixels", "samples per pixel  2", "vertical fov degrees", "camera rays  768", " to ["] {
        assert!(text.contains(part), "{part}: {text}");
    }
    let output = run(folder.path(), "info scene.json --json");
    let value: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&value["picture"]["size"], &value["picture"]["samples_per_pixel"]), (&[24, 16].into(), &2.into()));
    assert_eq!(value["cost"]["camera_rays"], 24 * 16 * 2);
    assert!(value["cost"]["film_bytes"].as_u64().is_some_and(|bytes| bytes > 24 * 16 * 4), "{value}");
    assert!(value["camera"]["position"][2].is_number() && value["geometry_bytes"].is_number(), "{value}");
}

#[test]
fn one_sample_is_no_plural() {
    let folder = tempfile::tempdir().unwrap();
    let stderr = stderr_of(&run(folder.path(), "render scene.json -s 1 -t 1 -o a.exr"));
    assert!(stderr.contains("1 sample per pixel,") && stderr.contains(", 1 thread,"), "{stderr}");
}

#[test]
fn keys_of_the_scene_are_set_and_rerendered() {
    let folder = tempfile::tempdir().unwrap();
    let render = |arguments: &str| {
        let output = run(folder.path(), arguments);
        assert_eq!(output.status.code(), Some(0), "{arguments}: {}", stderr_of(&output));
        let name = arguments.split_whitespace().last().unwrap();
        output::read_exr(&folder.path().join(name)).unwrap()
    };
    let options = render("render scene.json -q --spp 3 --max-depth 2 --size 20x10 -o options.exr");
    let set = "--set sampler.spp=3 --set integrator.max_depth=2 --set film.width=20 --set film.height=10";
    let keys = render(&format!("render scene.json -q {set} -o keys.exr"));
    let again = render("rerender keys.exr -q -o again.exr");
    assert_eq!(keys.size, [20, 10]);
    assert!(keys.layers == options.layers && again.layers == keys.layers);
    let output = run(folder.path(), "render scene.json --set integrator.depth=3");
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr_of(&output).contains("did you mean \"max_depth\"?"), "{}", stderr_of(&output));
}

#[test]
fn one_sample_is_replayed_by_a_command_of_its_own() {
    let folder = tempfile::tempdir().unwrap();
    let [command, options] = ["replay scene.json 3,4 1 --seed 5", "render scene.json --seed 5 --pixel 3,4 --sample 1"]
        .map(|arguments| run(folder.path(), arguments));
    assert!(command.status.success() && command.stdout.starts_with(b"radiance "), "{}", stderr_of(&command));
    assert_eq!(command.stdout, options.stdout);
    let output = run(folder.path(), "replay scene.json");
    assert_eq!(output.status.code(), Some(2));
}
