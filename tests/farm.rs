//! Jobs for farms: their scripts are run here with stand-ins for Slurm's commands and for the render, and a shard's
//! options are checked.

use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Command, Output};
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::util::program::{Running, Signal};

/// A render that does what is in the file `behaviour`: `sleep`, or an exit code; 0 writes the shard that `-o` names.
const RENDER: &str = r#"#!/bin/bash
echo "$@" >>calls
trap 'echo terminated >>calls; kill "$sleeper"; exit 143' TERM
behaviour=$(cat behaviour)
if [ "$behaviour" = sleep ]; then sleep 60 & sleeper=$!; touch sleeping; wait "$sleeper"; exit 0; fi
if [ "$1" = render ] && [ "$behaviour" = 0 ]; then
    while [ $# -gt 0 ]; do if [ "$1" = -o ]; then touch "${2//#/7}"; fi; shift; done
fi
exit "$behaviour"
"#;

struct Farm(tempfile::TempDir);

impl Farm {
    /// A folder with a scene, and stand-ins first in the path.
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("room.json"), r#"{ "camera": {} }"#).unwrap();
        for (name, text) in [
            ("render", RENDER),
            ("sbatch", "#!/bin/bash\necho \"sbatch $*\" >>calls\necho $((40 + $(wc -l <calls)))\n"),
            ("scontrol", "#!/bin/bash\necho \"scontrol $*\" >>calls\n"),
            ("squeue", "#!/bin/bash\ncat state\n"),
        ] {
            let path = folder.path().join(name);
            std::fs::write(&path, text).unwrap();
            std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).unwrap();
        }
        let farm = Self(folder);
        farm.write("state", "RUNNING");
        farm.write("behaviour", "0");
        farm
    }

    fn path(&self) -> &Path {
        self.0.path()
    }

    fn write(&self, name: &str, text: &str) {
        std::fs::write(self.path().join(name), text).unwrap();
    }

    fn command(&self, program: &str) -> Command {
        let mut command = Command::new(program);
        let path = format!("{}:{}", self.path().display(), std::env::var("PATH").unwrap());
        command.current_dir(self.path()).env("PATH", path).env("XDG_CONFIG_HOME", self.path());
        command
    }

    fn steradian(&self, arguments: &str) -> Output {
        self.command(env!("CARGO_BIN_EXE_steradian")).args(arguments.split_whitespace()).output().unwrap()
    }

    fn job(&self, arguments: &str) -> String {
        let output = self.steradian(&format!("farm slurm room.json --program ./render {arguments}"));
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    }

    /// Task 2 of the array 9, of frame 7 if there are frames.
    fn task(&self, frame: &str) -> Command {
        let mut command = self.command("bash");
        command.args(["room.farm/render.sh"].into_iter().chain((!frame.is_empty()).then_some(frame)));
        command.env("SLURM_ARRAY_JOB_ID", "9").env("SLURM_ARRAY_TASK_ID", "2");
        command
    }

    /// What the stand-ins were called with since the last time.
    fn calls(&self) -> String {
        let calls = std::fs::read_to_string(self.path().join("calls")).unwrap_or_default();
        let _ = std::fs::remove_file(self.path().join("calls"));
        calls
    }
}

#[test]
fn a_job_is_submitted_as_arrays_and_the_merges_that_wait_for_them() {
    let farm = Farm::new();
    let printed = farm.job("--shards 3 --frames 7-8 -o out.exr --submit -- --spp 5");
    assert_eq!(printed, "frame 7: array 41, merge 42\nframe 8: array 43, merge 44\n");
    let (folder, calls) = (farm.path().display().to_string(), farm.calls());
    let lines: Vec<&str> = calls.lines().collect();
    assert_eq!(lines[0], format!("sbatch --parsable --array=1-3 {folder}/room.farm/render.sh 7"));
    assert_eq!(
        lines[1],
        format!(
            "sbatch --parsable --dependency=afterok:41 --kill-on-invalid-dep=yes {folder}/room.farm/merge.sh 7 \
             {folder}/out.0007.exr"
        )
    );
    // What is there is not submitted again.
    farm.write("out.0007.exr", "");
    let output = farm.command("bash").arg("room.farm/submit.sh").output().unwrap();
    assert_eq!(String::from_utf8_lossy(&output.stdout), "frame 7: there already\nframe 8: array 41, merge 42\n");
}

#[test]
fn a_task_renders_its_shard_and_the_merge_takes_all_of_them() {
    let farm = Farm::new();
    farm.job("--shards 2 --frames 7 -o out.exr --every 5 -- --layers Z,N");
    assert!(farm.task("7").status().unwrap().success());
    let part = format!("{}/room.farm/shards/frame7.2-of-2", farm.path().display());
    let folder = farm.path().display();
    let calls = farm.calls();
    assert_eq!(
        calls,
        format!(
            "render {folder}/room.json --frames=7 --layers Z,N --shard 2/2 -o \
             {folder}/room.farm/shards/frame#.2-of-2.shard --checkpoint \
             {folder}/room.farm/shards/frame#.2-of-2.checkpoint --every 5 --resume --progress plain\n"
        )
    );
    // Such options exist: all but those of shards, which the render has in its own words.
    let parts: Vec<&str> =
        calls.split_whitespace().filter(|word| ["--frames=7", "--progress", "plain"].contains(word)).collect();
    assert_eq!(parts.len(), 3);
    // Complete already: nothing to do.
    assert!(farm.task("7").status().unwrap().success());
    assert_eq!(farm.calls(), "");

    farm.write("room.farm/shards/frame7.1-of-2.shard", "");
    let merge = || farm.command("bash").args(["room.farm/merge.sh", "7", "/a b/out.exr"]).status().unwrap();
    assert!(merge().success());
    assert_eq!(
        farm.calls(),
        format!("merge {folder}/room.farm/shards/frame7.1-of-2.shard {part}.shard -o /a b/out.exr\n")
    );
    assert!(!Path::new(&format!("{part}.shard")).exists());
    // Started again after it was done.
    assert!(merge().success());
    assert_eq!(farm.calls(), "");
}

#[test]
fn a_failure_is_tried_again_if_that_may_help_and_not_for_ever() {
    let farm = Farm::new();
    farm.job("--shards 2 --retries 2");
    let requeued = |code: &str| {
        farm.write("behaviour", code);
        let status = farm.task("").stdout(std::process::Stdio::null()).status().unwrap();
        assert_eq!(status.code(), Some(code.parse().unwrap()));
        farm.calls().contains("scontrol requeue 9_2")
    };
    assert!(!requeued("3") && !requeued("4") && !requeued("2"));
    assert_eq!([requeued("1"), requeued("33"), requeued("1"), requeued("1")], [true, true, false, false]);
}

#[test]
fn a_task_that_must_leave_keeps_its_state_and_comes_back() {
    for (state, signal, back) in
        [("RUNNING", Signal::USR1, true), ("PREEMPTED", Signal::TERM, true), ("CANCELLED", Signal::TERM, false)]
    {
        let farm = Farm::new();
        farm.job("--shards 2");
        farm.write("behaviour", "sleep");
        farm.write("state", state);
        let mut task = Running::start(farm.task("").stdout(std::process::Stdio::null()));
        let start = Instant::now();
        while !farm.path().join("sleeping").exists() {
            assert!(start.elapsed() < Duration::from_secs(60));
            std::thread::sleep(Duration::from_millis(20));
        }
        task.signal(signal);
        assert_eq!(task.wait().unwrap().code(), Some(143));
        let calls = farm.calls();
        assert!(calls.contains("terminated") && calls.contains("scontrol requeue 9_2") == back, "{state}: {calls}");
        assert!(start.elapsed() < Duration::from_secs(50));
    }
}

#[test]
fn what_would_fail_on_every_node_is_refused_at_once() {
    let farm = Farm::new();
    for (arguments, code) in [
        ("room.json --shards 2 -- --nonsense", 2),
        ("room.json --shards 2 -- --spp x", 2),
        ("room.json --shards 2 -- --shard 1/2", 2),
        ("room.json --shards 2 -- --checkpoint=a", 2),
        ("room.json --shards 2 -o a.jpg", 2),
        ("room.json --shards 0", 2),
        ("missing.json --shards 2", 4),
        ("room.json --shards 2 --dir /proc/farm", 5),
    ] {
        for kind in ["slurm", "openjd"] {
            let output = farm.steradian(&format!("farm {kind} {arguments}"));
            let expected = if kind == "openjd" && code == 5 { 0 } else { code };
            assert_eq!(
                output.status.code(),
                Some(expected),
                "{kind} {arguments}: {}",
                String::from_utf8_lossy(&output.stderr)
            );
        }
    }
}

/// The template's own scripts, with the parameters filled in as a worker does.
#[test]
fn an_openjd_template_renders_shards_and_merges_them() {
    let farm = Farm::new();
    farm.write("room.0007.json", r#"{ "camera": {} }"#);
    let render = farm.path().join("render");
    let arguments = format!(
        "farm openjd room.####.json --program {} --shards 2 --frames 7-11x2,20 -o out/a.####.exr -o b.%02d.png",
        render.display()
    );
    let output = farm.steradian(&arguments);
    let template: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(template["specificationVersion"], "jobtemplate-2023-09");
    assert_eq!(
        (&template["steps"][1]["dependencies"][0]["dependsOn"], &template["steps"][0]["name"]),
        (&"Render".into(), &"Render".into())
    );

    assert_eq!(parameter(&template, "Frames"), "7-11:2,20");
    let run = |step: usize| run_step(&farm, &template, step);
    let folder = farm.path().display();
    let shards = format!("{folder}/room.farm/shards");
    let called = run(0);
    assert!(
        called.contains(&format!(
            "render {folder}/room.####.json --frames=7 --shard 1/2 -o {shards}/frame#.1-of-2.shard"
        )),
        "{called}"
    );
    assert!(called.contains("--resume --progress openjd"));
    let called = run(1);
    let expected = format!(
        "merge {shards}/frame7.1-of-2.shard {shards}/frame7.2-of-2.shard -o {folder}/out/a.0007.exr -o \
         {folder}/b.07.png\n"
    );
    assert_eq!(called, expected);
}

/// The default of a template's parameter; empty if there is none.
fn parameter(template: &Value, name: &str) -> String {
    let parameters = template["parameterDefinitions"].as_array().unwrap();
    let default = parameters.iter().find(|parameter| parameter["name"] == name).map(|parameter| &parameter["default"]);
    default.map_or(String::new(), |default| default.as_str().map_or_else(|| default.to_string(), str::to_owned))
}

/// Runs a step of a template for shard 1 and frame 7, as a worker does; the result is what was called.
fn run_step(farm: &Farm, template: &Value, step: usize) -> String {
    let script = &template["steps"][step]["script"];
    let filled = |text: &Value| {
        let mut text = text.as_str().unwrap().replace("{{Task.File.Run}}", "run.sh");
        text = text.replace("{{Task.Param.Shard}}", "1").replace("{{Task.Param.Frame}}", "7");
        for name in ["Scene", "Work", "Program", "Shards", "Output1", "Output2"] {
            text = text.replace(&format!("{{{{Param.{name}}}}}"), &parameter(template, name));
        }
        assert!(!text.contains("{{"), "{text}");
        text
    };
    farm.write("run.sh", &filled(&script["embeddedFiles"][0]["data"]));
    let arguments = script["actions"]["onRun"]["args"].as_array().unwrap().iter().map(filled);
    assert!(farm.command("bash").args(arguments).status().unwrap().success(), "{script}");
    farm.calls()
}

#[test]
fn names_are_no_commands() {
    let farm = Farm::new();
    let scene = "it's\ntouch owned\n$(touch owned)`touch owned`\"; touch owned; \\ \u{1b}[2J.json";
    farm.write(scene, r#"{ "camera": {} }"#);
    let job = |kind: &str| {
        let mut command = farm.command(env!("CARGO_BIN_EXE_steradian"));
        command
            .args(["farm", kind, scene, "--shards", "1", "-o", "a.exr", "--program"])
            .arg(farm.path().join("render"));
        let output = command.args(["--", "--define", "a=$(touch owned){{b}}"]).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        output.stdout
    };
    job("slurm");
    let folder = std::fs::read_dir(farm.path()).unwrap().map(|entry| entry.unwrap().path());
    let folder = folder.into_iter().find(|path| path.extension().is_some_and(|e| e == "farm")).unwrap();
    assert!(farm.command("bash").arg(folder.join("submit.sh")).status().unwrap().success());
    let mut task = farm.command("bash");
    task.arg(folder.join("render.sh")).envs([("SLURM_ARRAY_TASK_ID", "1"), ("SLURM_ARRAY_JOB_ID", "9")]);
    assert!(task.status().unwrap().success());
    assert!(farm.command("bash").arg(folder.join("merge.sh")).args(["", "a.exr"]).status().unwrap().success());
    let called = farm.calls();
    let rendered = format!("render {}/{scene} --define a=$(touch owned){{{{b}}}} --shard 1/1", farm.path().display());
    assert!(called.contains(&rendered) && called.contains("merge "), "{called}");

    let template: Value = serde_json::from_slice(&job("openjd")).unwrap();
    assert!(!template["name"].as_str().unwrap().contains(['\n', '\u{1b}']));
    assert!(run_step(&farm, &template, 0).contains(&rendered));
    assert!(run_step(&farm, &template, 1).contains("merge "));
    assert!(!farm.path().join("owned").exists());

    let output = farm.steradian("farm slurm room.json --shards 1 --partition a\u{7}b");
    assert_eq!(output.status.code(), Some(2), "{}", String::from_utf8_lossy(&output.stderr));
}
