use std::os::unix::fs::FileTypeExt;
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::util::program::{Running, SCENE, Signal, run, stderr_of, steradian};

/// Runs a line of shell with the program's path in `$0`.
fn shell(folder: &Path, line: &str) -> Output {
    std::fs::write(folder.join("scene.json"), SCENE).unwrap();
    let mut command = Command::new("bash");
    command.current_dir(folder).args(["-c", line, env!("CARGO_BIN_EXE_steradian")]);
    command.env("XDG_CONFIG_HOME", folder.join("config")).stdin(Stdio::null()).output().unwrap()
}

/// Names in a folder that begin with a dot.
fn hidden(folder: &Path) -> Vec<String> {
    let names = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
    names.filter(|name| name.starts_with('.')).collect()
}

fn make_pipe(path: &Path) {
    assert!(Command::new("mkfifo").arg(path).status().unwrap().success());
}

#[test]
fn statistics_go_to_devices_pipes_and_open_files() {
    let folder = tempfile::tempdir().unwrap();
    let is_statistics = |bytes: &[u8]| serde_json::from_slice::<Value>(bytes).is_ok_and(|value| value["spp"] == 2);
    for (json, after) in
        [("/dev/stdout", "| cat"), ("/dev/stdout", ""), ("/dev/fd/3", "3>&1"), ("/proc/self/fd/3", "3>&1 | cat")]
    {
        let output = shell(folder.path(), &format!("\"$0\" render scene.json -q -o a.exr --stats {json} {after}"));
        assert!(is_statistics(&output.stdout), "{json} {after}: {}", stderr_of(&output));
    }
    let output = shell(folder.path(), "\"$0\" render scene.json -q -o a.exr --stats /dev/stderr");
    assert!(is_statistics(&output.stderr), "{}", stderr_of(&output));
    // What is redirected to a file comes between what else goes there.
    let output = shell(
        folder.path(),
        "{ echo before; \"$0\" render scene.json -q -o a.exr --stats /dev/stdout; echo after; } >out.txt",
    );
    assert!(output.status.success(), "{}", stderr_of(&output));
    let text = std::fs::read_to_string(folder.path().join("out.txt")).unwrap();
    assert!(text.starts_with("before\n{") && text.ends_with("}\nafter\n"), "{text}");
    let output = shell(
        folder.path(),
        "mkfifo p.exr p.json; cat p.exr >b.exr & cat p.json >b.json & \"$0\" render scene.json -q -o p.exr --stats \
         p.json && wait",
    );
    assert!(output.status.success(), "{}", stderr_of(&output));
    assert!(is_statistics(&std::fs::read(folder.path().join("b.json")).unwrap()));
    assert_eq!(steradian::internal::output::read_exr(&folder.path().join("b.exr")).unwrap().size, [24, 16]);
    for device in ["--stats /dev/null", "--log-file /dev/null", "--report /dev/null"] {
        let output = run(folder.path(), &format!("render scene.json -q -o a.exr {device}"));
        assert_eq!(output.status.code(), Some(0), "{}", stderr_of(&output));
    }
    assert!(std::fs::symlink_metadata("/dev/null").unwrap().file_type().is_char_device());
    let output = run(folder.path(), "render scene.json -q -o a.exr --stats /dev/full");
    assert_eq!(output.status.code(), Some(5), "{}", stderr_of(&output));
    assert!(hidden(folder.path()).is_empty());
}

#[test]
fn what_never_ends_is_not_read() {
    let folder = tempfile::tempdir().unwrap();
    for extension in ["", ".shard"] {
        make_pipe(&folder.path().join(format!("pipe{extension}")));
        std::os::unix::fs::symlink("/dev/zero", folder.path().join(format!("endless{extension}"))).unwrap();
    }
    let scenes = [
        r#""shapes": [{ "type": "mesh", "file": "FILE" }]"#,
        r#""shapes": [{ "type": "mesh", "file": "named.obj" }]"#,
        r#""textures": { "t": { "type": "image", "file": "FILE" } },
           "materials": { "m": { "type": "diffuse", "albedo": { "texture": "t" } } },
           "shapes": [{ "type": "sphere", "material": "m" }]"#,
        r#""lights": [{ "type": "environment", "file": "FILE" }]"#,
    ];
    let commands = [
        ("render scene.json -o a.exr --checkpoint FILE --resume", 5),
        ("render scene.json --shard 1/2 -o FILE.shard", 5),
        ("merge FILE.shard -o a.exr", 4),
        ("compare FILE FILE", 4),
        ("check-exr FILE", 4),
        ("rerender FILE -o b.exr", 4),
    ];
    for file in ["endless", "pipe"] {
        let obj = format!("mtllib {file}\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n");
        std::fs::write(folder.path().join("named.obj"), obj).unwrap();
        for scene in scenes {
            std::fs::write(
                folder.path().join("s.json"),
                format!("{{ \"camera\": {{}}, {} }}", scene.replace("FILE", file)),
            )
            .unwrap();
            let output = run(folder.path(), "render s.json -o a.exr");
            assert!(matches!(output.status.code(), Some(3 | 4)), "{scene}: {:?} {}", output.status, stderr_of(&output));
        }
        for (command, code) in commands {
            let output = run(folder.path(), &command.replace("FILE", file));
            assert_eq!(output.status.code(), Some(code), "{command} {file}: {}", stderr_of(&output));
        }
    }
    assert_eq!(run(folder.path(), "render /dev/zero -o a.exr").status.code(), Some(4));
    // But a scene may come through a pipe.
    let output =
        shell(folder.path(), "cat scene.json | \"$0\" render /dev/stdin -q -o a.exr && \"$0\" info <(cat scene.json)");
    assert!(output.status.success() && folder.path().join("a.exr").exists(), "{}", stderr_of(&output));
}

#[test]
fn killed_writers_leave_nothing_behind() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = "render scene.json -q --size 256x192 --spp 8000 --layers Z,N,P --checkpoint a.state --every 0 \
                     --resume -o a.exr --stats a.json";
    let left = || hidden(folder.path()).into_iter().filter(|name| name != ".a.state.lock").collect::<Vec<_>>();
    let mut killed = 0;
    for i in 0..8 {
        let mut child = steradian(folder.path(), arguments).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(150 + 37 * i));
        child.kill().unwrap();
        killed += u32::from(child.wait().unwrap().signal() == Some(9));
        // Between the moments when a file gets a name and its place: the next writer removes it.
        assert!(left().len() <= 1, "{:?}", left());
    }
    let next = Running::start(&mut steradian(folder.path(), arguments));
    std::thread::sleep(Duration::from_millis(500));
    next.signal(Signal::INT);
    next.output();
    assert!(left().is_empty(), "{:?}", left());
    assert!(killed > 4, "{killed}");
    let output = run(
        folder.path(),
        &arguments.replace("--spp 8000", "--spp 2 --seed 9").replace("--resume", "").replace("a.state", "b.state"),
    );
    assert_eq!(output.status.code(), Some(0), "{}", stderr_of(&output));
}

#[test]
fn files_beyond_the_limit_are_errors_of_writing() {
    let folder = tempfile::tempdir().unwrap();
    for output in ["-o a.exr --float", "-o a.png", "--shard 1/2"] {
        let output = shell(
            folder.path(),
            &format!("ulimit -f 1; exec \"$0\" render scene.json -q --size 128x128 --spp 2 {output}"),
        );
        assert_eq!(output.status.code(), Some(5), "{:?} {}", output.status, stderr_of(&output));
        assert_eq!(
            (stderr_of(&output).matches("error: cannot write").count(), stderr_of(&output).lines().count()),
            (1, 1),
            "{}",
            stderr_of(&output)
        );
    }
    // A checkpoint that cannot be written is no reason to lose the picture.
    let output = shell(
        folder.path(),
        "ulimit -f 100; exec \"$0\" render scene.json --size 128x128 --spp 2 -o a.png --checkpoint a.state",
    );
    assert!(
        output.status.success() && stderr_of(&output).contains("warning: cannot write a.state: "),
        "{}",
        stderr_of(&output)
    );
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2);
}

#[test]
fn memory_that_runs_out_is_one_error() {
    let folder = tempfile::tempdir().unwrap();
    let wave = |i: usize, j: usize| 0.1 * (i as f64 * 0.1).sin() * (j as f64 * 0.1).cos();
    let n = 150;
    let vertices = (0..n * n).map(|k| format!("v {} {} {}\n", k % n, k / n, wave(k % n, k / n)));
    let quads = (0..n * (n - 1))
        .filter(|k| k % n + 1 < n)
        .map(|k| format!("f {} {} {} {}\n", k + 1, k + 2, k + n + 2, k + n + 1));
    std::fs::write(folder.path().join("m.obj"), vertices.chain(quads).collect::<String>()).unwrap();
    let scene = SCENE.replace(r#"{ "type": "sphere", "radius": 1 }"#, r#"{ "type": "mesh", "file": "m.obj" }"#);
    std::fs::write(folder.path().join("m.json"), scene).unwrap();
    let mut codes = Vec::new();
    // Below this, the libraries find no room before the program begins.
    let starts = |megabytes: &i32| {
        shell(folder.path(), &format!("ulimit -c 0; ulimit -v {megabytes}000; exec \"$0\" --version")).status.success()
    };
    let least = (40..400).step_by(10).find(starts).unwrap();
    for accel in ["embree", "bvh"] {
        for megabytes in [20, 30, 40, 50, 90, 150, 210, 250, 265, 280, 320].map(|more| least + more) {
            let line = format!(
                "ulimit -c 0; ulimit -v {megabytes}000; exec \"$0\" render m.json -q -o a.png --accel {accel} \
                 --threads 3"
            );
            let start = Instant::now();
            let output = shell(folder.path(), &line);
            let (code, text) = (output.status.code(), stderr_of(&output));
            assert!(matches!(code, Some(0 | 33)), "{accel} {megabytes} MB: {:?} {text}", output.status);
            if code == Some(33) {
                // glibc has a line of its own where it cannot register the destructor of a thread's variable.
                let text = text
                    .lines()
                    .filter(|line| !line.is_empty() && !line.starts_with("Fatal glibc error: "))
                    .collect::<Vec<_>>();
                assert!(matches!(text[..], [line] if line.starts_with("error: ")), "{accel} {megabytes} MB: {text:?}");
            }
            assert!(start.elapsed() < Duration::from_secs(60), "{accel} {megabytes} MB");
            codes.push(code);
        }
    }
    assert!(codes.iter().filter(|code| **code == Some(33)).count() >= 5, "{codes:?}");
    let output = shell(
        folder.path(),
        "ulimit -v 300000; exec \"$0\" render scene.json --size 8000x8000 -o a.png --log-format json",
    );
    assert_eq!(output.status.code(), Some(33), "{}", stderr_of(&output));
    assert!(
        serde_json::from_str::<Value>(stderr_of(&output).trim()).is_ok_and(|line| line["level"] == "error"),
        "{}",
        stderr_of(&output)
    );
}

/// Only aborts without memory are errors of memory.
#[test]
fn other_aborts_stay_aborts() {
    let folder = tempfile::tempdir().unwrap();
    let child =
        Running::start(&mut steradian(folder.path(), "render scene.json -q -o a.exr --spp 1000000 --size 256x256"));
    std::thread::sleep(Duration::from_secs(1));
    child.signal(Signal::ABORT);
    assert_eq!(child.output().status.signal(), Some(6));
}

#[test]
fn threads_that_cannot_be_started_are_one_error() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    std::fs::set_permissions(folder.path(), std::fs::Permissions::from_mode(0o777)).unwrap();
    // The limit does not hold for root, and other users may not reach the program where it was built. The copy is made
    // by another process: a file that this one had open for writing could be inherited by the child of another test,
    // and would not start ("text file busy").
    let user = "[ $(id -u) != 0 ] || user='setpriv --reuid 64321 --regid 64321 --clear-groups'; $user true";
    let line = format!("cp \"$0\" steradian && {user} && $user ./steradian --version");
    let output = shell(folder.path(), &line);
    assert!(output.status.success(), "{:?} {}", output.status, stderr_of(&output));
    for (accel, limit) in [("embree", 1), ("embree", 2), ("embree", 3), ("embree", 4), ("bvh", 3), ("bvh", 5)] {
        let line = format!(
            "ulimit -c 0; {user} >/dev/null; exec $user bash -c 'ulimit -u {limit}; exec ./steradian render scene.json \
             -q -o a.png --threads 7 --accel {accel}'"
        );
        let output = shell(folder.path(), &line);
        let text = stderr_of(&output);
        assert_eq!(output.status.code(), Some(33), "{accel} {limit}: {:?} {text}", output.status);
        assert!(
            text.starts_with("error: ") && text.lines().count() == 1 && !text.contains("bug"),
            "{accel} {limit}: {text}"
        );
    }
}

/// Of a picture of many layers no more is held than the channels looked at.
#[test]
fn large_exr_files_are_read_channel_by_channel() {
    use exr::prelude::{
        AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image, Layer, LayerAttributes, LineOrder,
        Vec2,
    };
    use exr::prelude::{ImageAttributes, WritableImage};
    let folder = tempfile::tempdir().unwrap();
    let size = Vec2(512, 128);
    let channel = |i: usize| {
        let name = format!("layer{:02}.{}", i / 4, ["A", "B", "G", "R"][i % 4]);
        AnyChannel::new(name.as_str(), FlatSamples::F32(vec![1.0 + i as f32; size.area()]))
    };
    let encoding =
        Encoding { compression: Compression::ZIP1, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
    let layer =
        Layer::new(size, LayerAttributes::default(), encoding, AnyChannels::sort((0..160).map(channel).collect()));
    let image = Image::new(ImageAttributes::with_size(size), layer);
    image.write().to_file(folder.path().join("large.exr")).unwrap();
    drop(image);
    let starts = |megabytes: &i32| {
        shell(folder.path(), &format!("ulimit -c 0; ulimit -v {megabytes}000; exec \"$0\" --version")).status.success()
    };
    let least = (40..400).step_by(10).find(starts).unwrap();
    // All of it would be 42 MB; one thread, for others take address space of their own.
    for (command, part) in [("compare large.exr large.exr", "512x128"), ("check-exr large.exr", "large.exr: ")] {
        let line = format!("ulimit -c 0; ulimit -v {}000; exec taskset -c 0 \"$0\" {command}", least + 25);
        let output = shell(folder.path(), &line);
        assert!(
            String::from_utf8_lossy(&output.stdout).contains(part),
            "{command}: {:?} {}",
            output.status,
            stderr_of(&output)
        );
    }
}
