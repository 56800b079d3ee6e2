//! No command overwrites a file that it reads, or writes two things to one file: usage errors that name both uses,
//! before anything is written.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use steradian::internal::film::Image;
use steradian::internal::output;

use crate::util::program::{SCENE, run, stderr_of};

/// Every file below a folder with what it holds.
fn contents(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in folder.read_dir().unwrap().map(Result::unwrap) {
        let path = entry.path();
        if path.is_dir() {
            found.extend(contents(&path));
        } else {
            found.insert(path.clone(), std::fs::read(&path).unwrap());
        }
    }
    found
}

fn picture(path: &Path) {
    output::write_exr(
        path,
        &Image::of_color([2, 1], vec![0.5; 8]),
        &steradian::desc::OutputDesc::new("x.exr"),
        &Default::default(),
    )
    .unwrap();
}

/// A folder with scenes of three formats, all of their assets, pictures and a link to a scene.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let write = |name: &str, text: &str| std::fs::write(dir.join(name), text).unwrap();
    let sky = SCENE.replace("\"radiance\": [1, 1, 1]", "\"file\": \"studio.exr\"");
    write(
        "studio.json",
        &sky.replace("{ \"type\": \"sphere\"", "{ \"type\": \"mesh\", \"file\": \"m.obj\" }, { \"type\": \"sphere\""),
    );
    write("m.obj", "mtllib m.mtl\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    write("m.mtl", "newmtl a\nKd 0.5 0.5 0.5\n");
    write("scene.json", SCENE);
    write(
        "s.xml",
        r#"<scene version="3.0.0"><include filename="part.xml"/><sensor type="perspective"><film type="hdrfilm">
        <integer name="width" value="8"/><integer name="height" value="8"/></film></sensor></scene>"#,
    );
    write(
        "part.xml",
        r#"<scene version="3.0.0"><emitter type="envmap"><string name="filename" value="sky.exr"/></emitter></scene>"#,
    );
    write(
        "s.pbrt",
        "Film \"rgb\" \"integer xresolution\" 8 \"integer yresolution\" 8\nWorldBegin\nInclude \"part.pbrt\"\n\
         Shape \"sphere\"\n",
    );
    write("part.pbrt", "LightSource \"infinite\" \"string filename\" \"sky.exr\"\n");
    for name in ["studio.exr", "sky.exr", "noisy.exr", "ref.exr"] {
        picture(&dir.join(name));
    }
    std::os::unix::fs::symlink("scene.json", dir.join("link.json")).unwrap();
    std::fs::hard_link(dir.join("studio.exr"), dir.join("hard.exr")).unwrap();
    std::fs::create_dir(dir.join("sub")).unwrap();
    folder
}

/// The command is refused with both uses named, and changes nothing.
#[track_caller]
fn assert_refused(dir: &Path, arguments: &str, uses: [&str; 2]) {
    // The helper writes scene.json first.
    let before = contents(dir);
    let output = run(dir, arguments);
    let text = stderr_of(&output);
    assert_eq!(output.status.code(), Some(2), "{arguments}: {text}");
    assert!(uses.iter().all(|part| text.contains(part)) && text.contains("choose another name"), "{arguments}: {text}");
    let changed: Vec<_> = contents(dir)
        .into_iter()
        .filter(|(path, bytes)| before.get(path) != Some(bytes))
        .map(|(path, _)| path)
        .collect();
    assert!(changed.is_empty(), "{arguments}: {changed:?}");
}

#[test]
fn renders_overwrite_nothing_that_they_read() {
    let folder = folder();
    let dir = folder.path();
    for (arguments, uses) in [
        ("render studio.json", ["studio.exr (lights[0].file)", "studio.exr (output)"]),
        ("render studio.json -o hard.exr", ["studio.exr (lights[0].file)", "hard.exr (output)"]),
        ("render studio.json -o a.exr --stats m.obj", ["m.obj (shapes[0].file)", "m.obj (--stats)"]),
        ("render studio.json -o a.exr --stats m.mtl", ["m.mtl (named by shapes[0].file)", "m.mtl (--stats)"]),
        ("render studio.json -o a.exr --report m.obj", ["m.obj (shapes[0].file)", "m.obj (--report)"]),
        ("render scene.json -o a.exr --report scene.json", ["scene.json (the scene)", "scene.json (--report)"]),
        ("render scene.json -o a.exr --stats link.json", ["scene.json (the scene)", "link.json (--stats)"]),
        (
            "render link.json -o a.exr --stats sub/../scene.json",
            ["link.json (the scene)", "sub/../scene.json (--stats)"],
        ),
        ("render scene.json -o a.exr --log-file scene.json", ["scene.json (the scene)", "scene.json (--log-file)"]),
        (
            "render scene.json -o a.exr --checkpoint scene.json --resume",
            ["scene.json (the scene)", "scene.json (--checkpoint)"],
        ),
        ("render s.xml -o sky.exr", ["sky.exr", "(output)"]),
        ("render s.xml -o a.exr --stats part.xml", ["part.xml (a file of the scene)", "(--stats)"]),
        ("render s.pbrt -o sky.exr", ["sky.exr", "(output)"]),
        ("render s.pbrt -o a.exr --stats part.pbrt", ["part.pbrt (a file of the scene)", "(--stats)"]),
        ("info scene.json --report scene.json", ["(the scene)", "(--report)"]),
        ("info studio.json --report studio.exr", ["studio.exr (lights[0].file)", "(--report)"]),
    ] {
        assert_refused(dir, arguments, uses);
    }
    // What is written is at its place all the same.
    let output = run(dir, "render studio.json -q -o sub/studio.exr --stats sub/m.obj");
    assert!(output.status.success(), "{}", stderr_of(&output));
}

#[test]
fn no_two_things_are_written_to_one_file() {
    let folder = folder();
    let dir = folder.path();
    for (arguments, uses) in [
        ("render scene.json -o o.exr -o o.exr", ["o.exr (--output)", "o.exr (--output)"]),
        ("render scene.json -o o.exr -o ./o.exr", ["o.exr (--output)", "./o.exr (--output)"]),
        ("render scene.json -o o.exr --stats o.exr", ["(--output)", "(--stats)"]),
        ("render scene.json -o o.exr --report o.exr", ["(--output)", "(--report)"]),
        ("render scene.json -o o.exr --log-file sub/../o.exr", ["o.exr (--output)", "(--log-file)"]),
        ("render scene.json -o o.exr --stats s.json --report ./s.json", ["(--stats)", "(--report)"]),
        ("render scene.json -o c.exr --checkpoint c.exr", ["(--output)", "(--checkpoint)"]),
        ("render scene.json --shard 1/2 -o c.shard --checkpoint ./c.shard", ["(--output)", "(--checkpoint)"]),
        ("render scene.json --stats scene.png", ["scene.png (output)", "scene.png (--stats)"]),
        (
            "render scene.json -o o.exr --layers crypto_object --exr crypto_manifest=sidecar \
             --stats o.CryptoObject.json",
            ["o.CryptoObject.json (output)", "(--stats)"],
        ),
    ] {
        assert_refused(dir, arguments, uses);
    }
    // One standard output or device may take several.
    assert!(run(dir, "render scene.json -q -o n.exr --stats - --report - --log-file /dev/null").status.success());
}

#[test]
fn sequences_are_checked_before_their_first_frame() {
    let folder = folder();
    let dir = folder.path();
    std::fs::rename(dir.join("studio.exr"), dir.join("s.0003.exr")).unwrap();
    let scene = std::fs::read_to_string(dir.join("studio.json")).unwrap().replace("studio.exr", "s.0003.exr");
    std::fs::write(dir.join("studio.json"), scene).unwrap();
    for number in 1..4 {
        std::fs::write(dir.join(format!("each.{number}.json")), SCENE).unwrap();
    }
    for (arguments, uses) in [
        (
            "render studio.json --frames 1-3 -o s.####.exr --overwrite",
            ["s.0003.exr (lights[0].file)", "s.0003.exr (output)"],
        ),
        (
            "render scene.json --frames 1-3 -o s.exr -o s.%04d.exr --overwrite",
            ["s.0001.exr (output)", "s.0001.exr (output)"],
        ),
        (
            "render each.#.json --frames 1-3 -o a.####.exr --stats each.3.json",
            ["each.3.json (the scene)", "each.3.json (--stats)"],
        ),
        ("render scene.json --frames 1-3 -o s.####.exr --overwrite --checkpoint s.exr", ["(output)", "(--checkpoint)"]),
    ] {
        assert_refused(dir, arguments, uses);
    }
    let output = run(dir, "render scene.json -q --frames 1-2 --spp 1 -o a.####.exr --stats one.json");
    assert!(output.status.success(), "{}", stderr_of(&output));
}

#[test]
fn other_commands_overwrite_nothing_that_they_read() {
    let folder = folder();
    let dir = folder.path();
    assert!(run(dir, "render scene.json -q -o kept.exr --spp 2").status.success());
    for part in ["1/2", "2/2"] {
        assert!(run(dir, &format!("render scene.json -q --spp 2 --shard {part}")).status.success());
    }
    let shards = "scene.1-of-2.shard scene.2-of-2.shard";
    for (arguments, uses) in [
        ("rerender kept.exr -o kept.exr".to_owned(), ["(the picture to render again)", "(--output)"]),
        (
            "rerender kept.exr -o o.exr --scene scene.json --log-file scene.json".to_owned(),
            ["(the scene)", "(--log-file)"],
        ),
        (
            "rerender noisy.exr -o studio.exr --log-file noisy.exr".to_owned(),
            ["(the picture to render again)", "(--log-file)"],
        ),
        ("convert scene.json scene.json".to_owned(), ["(the scene)", "(the converted scene)"]),
        ("convert scene.json link.json".to_owned(), ["scene.json (the scene)", "link.json (the converted scene)"]),
        ("convert s.xml o.json --report o.json".to_owned(), ["(the converted scene)", "(--report)"]),
        (format!("merge {shards} -o o.exr -o ./o.exr"), ["o.exr (--output)", "./o.exr (--output)"]),
        (format!("merge {shards} -o o.exr --log-file scene.1-of-2.shard"), ["(a shard)", "(--log-file)"]),
        ("denoise noisy.exr noisy.exr".to_owned(), ["(the noisy picture)", "(the denoised picture)"]),
        ("denoise noisy.exr o.exr -o o.png -o ./o.png".to_owned(), ["o.png (--output)", "./o.png (--output)"]),
        ("compare ref.exr noisy.exr --log-file ref.exr".to_owned(), ["(the reference)", "(--log-file)"]),
        ("check-exr ref.exr --log-file ref.exr".to_owned(), ["(a file to check)", "(--log-file)"]),
        ("info scene.json --log-file scene.json".to_owned(), ["(the scene)", "(--log-file)"]),
    ] {
        assert_refused(dir, &arguments, uses);
    }
    std::fs::copy(dir.join("scene.json"), dir.join("accel.json")).unwrap();
    std::fs::copy(dir.join("scene.json"), dir.join("error.json")).unwrap();
    assert_refused(dir, "bench accel accel.json --out .", ["accel.json (the scene)", "accel.json (--out)"]);
    assert_refused(dir, "bench error error.json --out .", ["error.json (the scene)", "error.json (--out)"]);
    std::fs::copy(dir.join("scene.json"), dir.join("submit.sh")).unwrap();
    assert_refused(
        dir,
        "farm slurm submit.sh --shards 2 -o o.exr --dir .",
        ["submit.sh (the scene)", "(a script of the job)"],
    );
    // The frames of a sequence are compared by their numbers.
    std::fs::copy(dir.join("noisy.exr"), dir.join("f.0001.exr")).unwrap();
    assert_refused(dir, "denoise f.####.exr f.####.exr", ["(the noisy picture)", "(the denoised picture)"]);
    assert_refused(
        dir,
        "denoise f.####.exr f.0###.exr",
        ["f.0001.exr (a noisy picture)", "f.0001.exr (a denoised picture)"],
    );
}

/// Files that a conversion copies beside the scene are compared before the first is written.
#[test]
fn conversions_overwrite_no_file_that_they_copy() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    std::fs::create_dir(dir.join("a_files")).unwrap();
    std::fs::write(dir.join("scene.json"), SCENE).unwrap();
    for (name, byte) in [("a_files/t.png", 10), ("t.png", 200)] {
        image::GrayImage::from_pixel(2, 2, image::Luma([byte])).save(dir.join(name)).unwrap();
    }
    let textures = r#""textures": { "a": { "type": "image", "file": "t.png" },
        "b": { "type": "image", "file": "a_files/t.png" } },"#;
    std::fs::write(dir.join("src.json"), SCENE.replacen('{', &format!("{{ {textures}"), 1)).unwrap();
    assert_refused(
        dir,
        "convert src.json a.json",
        ["a_files/t.png (textures.b.file)", "a_files/t.png (a copy of textures.a.file)"],
    );
    // Under another name all are copied, and what lies at its place stays.
    assert!(run(dir, "convert src.json b.json").status.success());
    let [a, b] = ["b_files/t.png", "b_files/t_2.png"].map(|name| std::fs::read(dir.join(name)).unwrap());
    assert_eq!([a, b], ["t.png", "a_files/t.png"].map(|name| std::fs::read(dir.join(name)).unwrap()));
    assert!(run(dir, "convert b.json sub_b.json --link").status.success());
    std::fs::rename(dir.join("b.json"), dir.join("c.json")).unwrap();
    assert!(run(dir, "convert c.json b.json").status.success());
    assert!(dir.join("b_files/t.png").exists() && dir.join("b_files/t_2.png").exists());
}

/// A log is added to: any other file keeps what it holds.
#[test]
fn messages_are_added_to_logs_alone() {
    let folder = folder();
    let dir = folder.path();
    for name in ["m.obj", "studio.exr", "part.xml"] {
        let before = contents(dir);
        let output = run(dir, &format!("render studio.json -o a.exr --log-file {name}"));
        assert_eq!(output.status.code(), Some(2), "{name}");
        assert!(
            stderr_of(&output).contains("--log-file") && stderr_of(&output).contains(name),
            "{}",
            stderr_of(&output)
        );
        assert_eq!(contents(dir)[&dir.join(name)], before[&dir.join(name)]);
    }
    for format in ["text", "json"] {
        for _ in 0..3 {
            let output =
                run(dir, &format!("render scene.json -q -o n.exr --log-file {format}.log --log-format {format}"));
            assert!(output.status.success(), "{}", stderr_of(&output));
        }
    }
}
