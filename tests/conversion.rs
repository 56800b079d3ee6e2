//! Scenes written again are the same scenes.

use std::path::Path;

use steradian::ErrorKind;
use steradian::internal::accel::AccelKind;
use steradian::internal::compile;
use steradian::internal::convert::{Originals, write_scene};
use steradian::internal::import::{ImportOptions, read_scene};
use steradian::internal::output::FileUses;
use steradian::internal::render::{Overrides, Settings};

use crate::util::render::{Prepared, pixels, render_with};
use crate::util::root;

fn picture(path: &Path) -> Vec<[u32; 3]> {
    let overrides = Overrides { spp: Some(2), size: Some([24, 16]), threads: Some(2), ..Overrides::default() };
    let imported = read_scene(path, &ImportOptions::default()).unwrap();
    let settings = Settings::new(&imported.desc, &overrides).unwrap();
    let scene = compile::compile_from(&imported.desc, imported.source(path)).unwrap();
    pixels(&render_with(&Prepared { scene, settings }, AccelKind::EMBREE).image)
        .map(|pixel| pixel.map(f32::to_bits))
        .collect()
}

fn convert(path: &Path, target: &Path, originals: Originals) -> steradian::Result<usize> {
    write_scene(&read_scene(path, &ImportOptions::default())?, path, target, originals, FileUses::default())
}

#[test]
fn converted_scenes_give_the_same_picture() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["glassware", "motion", "nee", "shapes", "textures", "tree"] {
        let path = root().join("scenes").join(name).with_extension("json");
        let expected = picture(&path);
        for (kind, originals) in [("copy", Originals::Copy), ("link", Originals::Link)] {
            let target = folder.path().join(kind).join(format!("{name}.json"));
            std::fs::create_dir_all(target.parent().unwrap()).unwrap();
            convert(&path, &target, originals).unwrap();
            assert!(picture(&target) == expected, "{name}, {kind}");
            // A second time changes nothing: what is there stays or is written over. The scene itself is not.
            assert!(matches!(convert(&target, &target, originals), Err(steradian::Error::Usage(_))));
            let moved = target.with_extension("moved.json");
            std::fs::rename(&target, &moved).unwrap();
            convert(&moved, &target, originals).unwrap();
            assert!(picture(&target) == expected, "{name}, {kind}, twice");
        }
    }
    assert!(!folder.path().join("link/textures_files").exists());
}

#[test]
fn colours_of_vertices_and_uv_that_a_file_lacks_are_converted() {
    let folder = tempfile::tempdir().unwrap();
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
               property uchar red\n\
               property uchar green\nproperty uchar blue\nelement face 1\nproperty list uchar int vertex_indices\n\
               end_header\n\
               -1 -1 -5 255 0 7\n1 -1 -5 0 130 99\n0 1 -5 3 200 255\n3 0 1 2\n";
    std::fs::write(folder.path().join("m.ply"), ply).unwrap();
    let texture =
        |kind: &str, name: &str, more: &str| format!("<texture type=\"{kind}\" name=\"{name}\">{more}</texture>");
    let colors = texture("mesh_attribute", "diffuse_reflectance", "<string name=\"name\" value=\"vertex_color\"/>");
    let path = folder.path().join("s.xml");
    let scene = format!(
        "<scene version=\"3.0.0\"><sensor type=\"perspective\"><transform name=\"to_world\"><scale x=\"-1\" \
         z=\"-1\"/></transform></sensor><emitter type=\"constant\"/><shape type=\"ply\"><string name=\"filename\" \
         value=\"m.ply\"/><bsdf type=\"twosided\"><bsdf type=\"roughplastic\">{colors}{}</bsdf></bsdf></shape></scene>",
        texture("checkerboard", "specular_reflectance", "")
    );
    std::fs::write(&path, scene).unwrap();
    let expected = picture(&path);
    assert!(expected.iter().any(|pixel| pixel[0] != pixel[1]));
    let target = folder.path().join("t.json");
    convert(&path, &target, Originals::Copy).unwrap();
    assert!(picture(&target) == expected);
}

#[test]
fn files_that_nothing_uses_need_not_be_there() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("s.json");
    let scene = r#"{ "camera": { "position": [0, 0, 5], "look_at": [0, 0, 0] },
        "lights": [{ "type": "environment", "radiance": [1, 1, 1] }],
        "shapes": [{ "type": "sphere" }], "textures": { "t": { "type": "image", "file": "gone.png" } },
        "objects": { "o": { "shapes": [{ "type": "mesh", "file": "gone.ply" }] } } }"#;
    std::fs::write(&path, scene).unwrap();
    let target = folder.path().join("t.json");
    assert_eq!(convert(&path, &target, Originals::Copy).unwrap(), 0);
    assert!(picture(&target) == picture(&path));
}

#[test]
fn what_cannot_be_written_leaves_nothing_behind() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("s.json");
    std::fs::write(&path, r#"{ "camera": {}, "shapes": [{ "type": "mesh", "file": "gone.ply" }] }"#).unwrap();
    let target = folder.path().join("t.json");
    let error = convert(&path, &target, Originals::Copy).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::AssetMissing);
    assert!(error.to_string().contains("gone.ply") && error.to_string().contains("shapes[0].file"), "{error}");
    assert!(!target.exists());
    let error = convert(&path, &folder.path().join("t.xml"), Originals::Copy).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Usage);
    let error = convert(&path, &folder.path().join("none/t.json"), Originals::Copy).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Output);
}

#[test]
fn errors_name_the_place_in_the_imported_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("s.xml");
    let message = |shape: &str| {
        let scene = format!(
            "<scene version=\"3.0.0\"><sensor type=\"perspective\"/>\n{shape}\n<emitter type=\"constant\"/></scene>"
        );
        std::fs::write(&path, scene).unwrap();
        let imported = read_scene(&path, &ImportOptions::default()).unwrap();
        compile::compile_from(&imported.desc, imported.source(&path)).err().unwrap().to_string()
    };
    let ply = |name: &str| format!("<shape type=\"ply\"><string name=\"filename\" value=\"{name}\"/></shape>");
    let gone = message(&ply("gone.ply"));
    assert!(gone.contains("gone.ply") && gone.contains("shapes[0].file (from") && gone.contains("s.xml:2:1"), "{gone}");
    std::fs::write(folder.path().join("bad.ply"), "ply\nformat").unwrap();
    let bad = message(&ply("bad.ply"));
    assert!(bad.contains("bad.ply") && bad.contains("s.xml:2:1"), "{bad}");
}
