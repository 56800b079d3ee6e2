use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt;
use std::path::Path;

use serde_json::{Value, json};

use crate::util::program::{SCENE, run, stderr_of, steradian};

/// A small scene with changes.
fn scene(change: impl FnOnce(&mut Value)) -> String {
    let mut scene: Value =
        serde_json::from_str(&SCENE.lines().filter(|line| !line.contains("//")).collect::<String>()).unwrap();
    change(&mut scene);
    scene.to_string()
}

/// Whether some line could be taken for one of the farm's, or a character for one that steers a terminal.
fn is_harmless(text: &str) -> bool {
    let ours = |line: &str| {
        line.starts_with("openjd_fail: ") || line.starts_with("openjd_status: rendering") || line.starts_with("Error: ")
    };
    let rest = |line: &str| if ours(line) { line.split_once(' ').unwrap().1.to_owned() } else { line.to_owned() };
    text.lines().all(|line| ["openjd_", "Progress: 100", "Error:"].iter().all(|word| !rest(line).contains(word)))
        && !text.contains(|c: char| c.is_control() && c != '\n')
}

#[test]
fn names_steer_neither_farms_nor_terminals() {
    let folder = tempfile::tempdir().unwrap();
    let name = "x\nopenjd_env: LD_PRELOAD=/x\nProgress: 100%\nError: \u{1b}[2J\u{9b}31m\u{202e}\r";
    let unknown = scene(|scene| scene["shapes"][0]["material"] = json!(name));
    let named = scene(|scene| {
        scene["shapes"][0]["name"] = json!(name);
        scene["materials"][name] = json!({ "type": "mirror" });
    });
    let missing = scene(|scene| scene["shapes"][0] = json!({ "type": "mesh", "file": format!("{name}.obj") }));
    let xml = "<scene version=\"3.0.0\"><sensor type=\"perspective\"/><shape type=\"sphere\"><string \
               name=\"a&#10;openjd_env: x&#27;[2J\" value=\"b\"/></shape></scene>";
    for (file, text) in
        [("unknown.json", &*unknown), ("named.json", &named), ("missing.json", &missing), ("import.xml", xml)]
    {
        std::fs::write(folder.path().join(file), text).unwrap();
        for command in [
            "render FILE -o a.exr --spp 1 --progress openjd",
            "render FILE -o a.exr --spp 1 --progress deadline -v",
            "info FILE",
            "info FILE --json",
            "config show FILE",
        ] {
            let command = format!("{} --log-file log.txt", command.replace("FILE", file));
            let output = run(folder.path(), &command);
            let printed = format!("{}{}", String::from_utf8_lossy(&output.stdout), stderr_of(&output));
            let progress = |line: &&str| !line.starts_with("openjd_progress: ") && !line.starts_with("Progress: ");
            let printed: String = printed.lines().filter(progress).flat_map(|line| [line, "\n"]).collect();
            assert!(is_harmless(&printed), "{command}: {printed:?}");
        }
    }
    let log = std::fs::read_to_string(folder.path().join("log.txt")).unwrap();
    assert!(log.lines().count() > 3 && log.lines().all(|line| line.starts_with("20")) && is_harmless(&log), "{log}");
    // On the command line and in a file of a project, too.
    std::fs::write(folder.path().join("steradian.toml"), "\"a\\u001b[2J\" = 1\n").unwrap();
    assert!(is_harmless(&stderr_of(&run(folder.path(), "render scene.json -o a.exr"))));
    std::fs::remove_file(folder.path().join("steradian.toml")).unwrap();
    let mut command = steradian(folder.path(), "render scene.json");
    let output = command.args(["--spp", "\u{1b}[2J\nopenjd_env: a"]).output().unwrap();
    assert!(output.status.code() == Some(2) && is_harmless(&stderr_of(&output)), "{}", stderr_of(&output));
}

/// A light in a group whose name has a number of letters.
fn grouped(letters: usize) -> String {
    scene(|scene| {
        scene["lights"] =
            json!([{ "type": "point", "position": [0, 0, 4], "intensity": [9, 9, 9], "group": "g".repeat(letters) }]);
        scene["outputs"] = json!([{ "file": "a.exr", "layers": ["light_groups"] }]);
    })
}

#[test]
fn long_names_are_marked_in_files_or_refused() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    for (letters, is_long) in [(3, false), (30, true), (240, true)] {
        std::fs::write(at("s.json"), grouped(letters)).unwrap();
        for (profile, is_long) in [("nuke", is_long), ("multipart", is_long), ("blender", is_long)] {
            let output = run(folder.path(), &format!("render s.json -q --exr profile={profile}"));
            assert_eq!(output.status.code(), Some(0), "{}", stderr_of(&output));
            let bytes = std::fs::read(at("a.exr")).unwrap();
            assert_eq!(bytes[5] & 4 != 0, is_long, "{letters} {profile}");
            assert_eq!(steradian::internal::output::read_exr(&at("a.exr")).unwrap().size, [24, 16]);
        }
    }
    std::fs::write(at("s.json"), grouped(249)).unwrap();
    for command in ["render s.json", "info s.json"] {
        let output = run(folder.path(), command);
        assert!(
            output.status.code() == Some(3) && stderr_of(&output).contains("s.json: lights[0].group: "),
            "{}",
            stderr_of(&output)
        );
    }
}

#[test]
fn places_for_frame_numbers_need_frames() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["y.####.exr", "y.%04d.png"] {
        let output = run(folder.path(), &format!("render scene.json -o {name}"));
        assert!(output.status.code() == Some(2) && stderr_of(&output).contains("--frames"), "{}", stderr_of(&output));
    }
    std::fs::create_dir(folder.path().join("shot#3")).unwrap();
    let output = run(folder.path(), "render scene.json -q -o shot#3/y.exr --frames 7");
    assert!(output.status.success() && folder.path().join("shot#3/y.0007.exr").exists(), "{}", stderr_of(&output));
    assert!(run(folder.path(), "render scene.json -q -o shot#3/y#.exr").status.success());
}

#[test]
fn names_that_are_not_utf8_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join(OsStr::from_bytes(b"a\xff.json")), SCENE).unwrap();
    for arguments in [["render", "A"], ["info", "A"], ["check-exr", "A"]] {
        let mut command = steradian(folder.path(), arguments[0]);
        let output = command.arg(OsStr::from_bytes(b"a\xff.json")).output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{}", stderr_of(&output));
        assert!(
            stderr_of(&output).contains("is not UTF-8") && stderr_of(&output).lines().count() == 1,
            "{}",
            stderr_of(&output)
        );
    }
}

#[test]
fn only_files_of_their_kind_are_copied() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("secret"), "root:x:0:0:root:/root:/bin/bash\n").unwrap();
    std::fs::create_dir(at("out")).unwrap();
    let obj = |library: &str| format!("mtllib {library}\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    std::fs::write(at("a.mtl"), "newmtl a\nmap_Kd secret\n").unwrap();
    let convert = |shape: Value| {
        std::fs::write(at("s.json"), scene(|scene| scene["shapes"][0] = shape)).unwrap();
        run(folder.path(), "convert s.json out/s.json")
    };
    for library in ["secret", "a.mtl", "/etc/passwd"] {
        std::fs::write(at("m.obj"), obj(library)).unwrap();
        let output = convert(json!({ "type": "mesh", "file": "m.obj" }));
        assert!(
            output.status.code() == Some(3) && stderr_of(&output).contains("is not copied"),
            "{library}: {}",
            stderr_of(&output)
        );
    }
    let output = convert(json!({ "type": "mesh", "file": "secret" }));
    assert_eq!(output.status.code(), Some(3), "{}", stderr_of(&output));
    let has_secret = |path: &Path| std::fs::read(path).is_ok_and(|bytes| bytes.starts_with(b"root:"));
    let mut folders = vec![at("out")];
    while let Some(folder) = folders.pop() {
        for path in std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
            assert!(!has_secret(&path), "{}", path.display());
            folders.extend(path.is_dir().then_some(path));
        }
    }
    std::fs::write(at("a.mtl"), "# a\nnewmtl a\nKd 1 0 0\n").unwrap();
    std::fs::write(at("m.obj"), obj("a.mtl")).unwrap();
    let output = convert(json!({ "type": "mesh", "file": "m.obj" }));
    assert!(output.status.success() && at("out/s_files/m/a.mtl").exists(), "{}", stderr_of(&output));
}
