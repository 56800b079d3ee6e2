//! What files may do: scenes, EXR files and project configuration set what a picture is; they load, overwrite and
//! connect to nothing.

use std::collections::BTreeSet;
use std::net::TcpListener;
use std::path::Path;

use serde_json::{Value, json};
use steradian::desc::OutputDesc;
use steradian::internal::film::Image;
use steradian::internal::output::{self, RenderInfo};

use crate::util::program::{SCENE, run, stderr_of};

#[track_caller]
fn assert_code(folder: &Path, arguments: &str, code: i32, parts: &[&str]) {
    let output = run(folder, arguments);
    let text = stderr_of(&output);
    assert_eq!(output.status.code(), Some(code), "{arguments}: {text}");
    for part in parts {
        assert!(text.contains(part), "{arguments}: {part} is not in: {text}");
    }
}

fn names(folder: &Path) -> BTreeSet<String> {
    folder.read_dir().unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
}

fn pixels(path: &Path) -> Vec<u32> {
    let image = output::read_exr(path).unwrap();
    image.layers.iter().flat_map(|layer| layer.data.iter().map(|value| value.to_bits())).collect()
}

/// Writes an EXR file with this recipe.
fn with_recipe(path: &Path, provenance: Value) {
    let info = RenderInfo { settings: Some(provenance), ..RenderInfo::default() };
    output::write_exr(path, &Image::of_color([1, 1], vec![1.0; 4]), &OutputDesc::new("forged.exr"), &info).unwrap();
}

/// The command line that an EXR file keeps is never run again, whatever it holds.
#[test]
fn rerender_runs_no_option_of_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    assert_code(dir, "render scene.json -q -o a.exr --threads 1", 0, &[]);
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    listener.set_nonblocking(true).unwrap();
    let address = listener.local_addr().unwrap();
    let victims = ["report", "json", "log-file", "checkpoint", "shard"];
    let mut provenance = output::read_settings(&dir.join("a.exr")).unwrap();
    let line = "render scene.json --report report --stats json --log-file log-file --checkpoint checkpoint -o shard \
                --preview 0 --denoise";
    let mut arguments: Vec<String> = line.split(' ').map(str::to_owned).collect();
    arguments.extend([
        "--tev".to_owned(),
        address.to_string(),
        "--oidn-library".to_owned(),
        dir.join("evil.so").display().to_string(),
    ]);
    provenance["arguments"] = json!(arguments);
    with_recipe(&dir.join("forged.exr"), provenance);
    victims.iter().for_each(|name| std::fs::write(dir.join(name), "kept").unwrap());
    let before = names(dir);
    assert_code(dir, "rerender forged.exr -o again.exr", 0, &["wrote again.exr"]);
    assert_eq!(pixels(&dir.join("a.exr")), pixels(&dir.join("again.exr")));
    assert_eq!(names(dir).difference(&before).collect::<Vec<_>>(), ["again.exr"]);
    assert!(victims.iter().all(|name| std::fs::read(dir.join(name)).unwrap() == b"kept"));
    assert!(listener.accept().is_err());
}

/// A recipe has the keys of its version; those of others are errors with the file's name.
#[test]
fn forged_and_old_recipes_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    assert_code(dir, "render scene.json -q -o a.exr --threads 1", 0, &[]);
    let provenance = output::read_settings(&dir.join("a.exr")).unwrap();
    for key in ["json", "report", "log_file", "checkpoint", "oidn_library", "tev", "preview", "outputs", "threads"] {
        for place in ["", "/settings", "/import"] {
            let mut forged = provenance.clone();
            forged.pointer_mut(place).unwrap()[key] = json!("victim");
            with_recipe(&dir.join("forged.exr"), forged);
            assert_code(dir, "rerender forged.exr -o again.exr", 3, &["forged.exr", &format!("unknown field `{key}`")]);
        }
    }
    let mut old = provenance.clone();
    old.as_object_mut().unwrap().remove("version");
    with_recipe(&dir.join("old.exr"), old);
    assert_code(dir, "rerender old.exr -o again.exr", 3, &["old.exr", "no version"]);
    let mut wild = provenance;
    wild["settings"]["size"] = json!([4_000_000_000u32, 1]);
    with_recipe(&dir.join("wild.exr"), wild);
    assert_code(dir, "rerender wild.exr -o again.exr", 3, &["wild.exr", "film.width"]);
    assert!(!dir.join("again.exr").exists());
}

#[test]
fn rerender_writes_only_the_files_of_the_command_line() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    assert_code(dir, "render scene.json -q -o a.exr --threads 1", 0, &[]);
    let bytes = std::fs::read(dir.join("a.exr")).unwrap();
    assert_code(dir, "rerender a.exr", 2, &["--output <OUT>"]);
    assert_eq!(std::fs::read(dir.join("a.exr")).unwrap(), bytes);
    assert_code(dir, "rerender a.exr -o b.exr --spp 0", 2, &["--spp 0"]);
    // Even a denoiser comes from here.
    let mut provenance = output::read_settings(&dir.join("a.exr")).unwrap();
    provenance["denoise"] = json!(true);
    with_recipe(&dir.join("denoised.exr"), provenance);
    assert_code(dir, "rerender denoised.exr -o b.exr --oidn-library none.so", 4, &["none.so", "--oidn-library"]);
}

/// What else the picture depends on is in the recipe: definitions, and the frame of one scene or of a scene for each
/// frame.
#[test]
fn a_recipe_holds_how_the_scene_was_read() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let scene = SCENE.replace(
        "\"position\": [0, 0, 4], \"look_at\": [0, 0, 0]",
        "\"position\": [0, 0, 4], \"look_at\": [0, 0, 0], \"shutter\": [0, 1]",
    );
    let moving = r#""radius": 1, "motion": [{ "time": 0 }, { "time": 9, "transform": [{ "translate": [2, 0, 0] }] }]"#;
    std::fs::write(dir.join("moving.json"), scene.replace("\"radius\": 1", moving)).unwrap();
    for frame in [3, 4] {
        std::fs::write(
            dir.join(format!("each.{frame}.json")),
            SCENE.replace("\"radius\": 1", &format!("\"radius\": 0.{frame}")),
        )
        .unwrap();
    }
    std::fs::write(
        dir.join("defined.xml"),
        r#"<scene version="3.0.0"><default name="r" value="0.2"/><sensor type="perspective"><film type="hdrfilm">
        <integer name="width" value="16"/><integer name="height" value="8"/></film></sensor><emitter type="constant"/>
        <shape type="sphere"><float name="radius" value="$r"/><point name="center" x="0" y="0" z="3"/></shape>
        </scene>"#,
    )
    .unwrap();
    for (line, file) in [
        ("render moving.json --frames 5 --fps 30 -o m.#.exr", "m.5.exr"),
        ("render each.#.json --frames 3,4 -o e.#.exr", "e.4.exr"),
        ("render defined.xml -D r=0.9 -o d.exr", "d.exr"),
    ] {
        assert_code(dir, &format!("{line} -q --spp 2 --threads 1"), 0, &[]);
        assert_code(dir, &format!("rerender {file} -q -o again.exr"), 0, &[]);
        assert_eq!(pixels(&dir.join(file)), pixels(&dir.join("again.exr")), "{line}");
        // The second generation is as good as the first.
        assert_code(dir, "rerender again.exr -q -o third.exr", 0, &[]);
        assert_eq!(pixels(&dir.join(file)), pixels(&dir.join("third.exr")), "{line}");
    }
}

/// A project's file loads, writes and connects to nothing; the user's own may.
#[test]
fn a_project_cannot_say_what_is_loaded_written_or_connected_to() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    listener.set_nonblocking(true).unwrap();
    let address = format!("tev = \"{}\"", listener.local_addr().unwrap());
    let user = dir.join("config/steradian/config.toml");
    std::fs::create_dir_all(user.parent().unwrap()).unwrap();
    for line in [
        "oidn-library = \"evil.so\"",
        "log-file = \"log\"",
        "output = \"o.exr\"",
        &address,
        "preview = 0",
        "overwrite = true",
    ] {
        let key = line.split(' ').next().unwrap();
        std::fs::write(dir.join("steradian.toml"), format!("spp = 1\n{line}\n")).unwrap();
        let variable = format!("STERADIAN_{}", key.to_uppercase().replace('-', "_"));
        let parts = ["steradian.toml:2: ", key, &format!("--{key}"), &variable, user.to_str().unwrap()];
        assert_code(dir, "render scene.json -q --denoise", 2, &parts);
        assert_code(dir, "config show --origin scene.json", 2, &parts);
    }
    std::fs::remove_file(dir.join("steradian.toml")).unwrap();
    assert!(listener.accept().is_err());
    assert_eq!(names(dir), ["config", "scene.json"].map(str::to_owned).into());
    std::fs::write(&user, "output = \"mine.exr\"\nlog-file = \"log\"").unwrap();
    assert_code(dir, "render scene.json -q", 0, &[]);
    assert!(dir.join("mine.exr").exists() && dir.join("log").exists());
}
