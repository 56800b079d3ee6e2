//! Files of a scene that are missing or malformed, and those that nothing uses.

use serde_json::{Value, json};
use steradian::ErrorKind;
use steradian::internal::import;

use crate::bad_input::assert_error;
use crate::util::folder::{Folder, good_scene};

#[test]
fn assets_that_are_missing() {
    let folder = Folder::new();
    let mut scene = good_scene();
    scene["shapes"][1] = json!({ "type": "mesh", "file": "gone.ply" });
    assert_error(&folder, &scene, ErrorKind::AssetMissing, &["gone.ply", "shapes[1].file"]);
    scene["shapes"][1]["file"] = json!("gone.obj");
    assert_error(&folder, &scene, ErrorKind::AssetMissing, &["gone.obj", "shapes[1].file"]);
    folder.write("here.obj", "mtllib gone.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    scene["shapes"][1]["file"] = json!("here.obj");
    assert!(folder.compile(&scene).is_ok(), "an MTL is not needed");
    scene["lights"][3] = json!({ "type": "environment", "file": "gone.exr" });
    assert_error(&folder, &scene, ErrorKind::AssetMissing, &["gone.exr", "lights[3].file"]);
}

#[test]
fn files_that_nothing_uses_are_not_read() {
    let folder = Folder::new();
    folder.write("bad.png", "not an image");
    folder.write("bad.ply", "not a mesh");
    let mut scene = good_scene();
    for (kind, file) in [("gone", "gone.png"), ("bad", "bad.png")] {
        scene["textures"][kind] = json!({ "type": "image", "file": file });
        scene["textures"][format!("{kind}_part")] = json!({ "type": "product", "factors": [{ "texture": kind }, 0.5] });
        scene["materials"][kind] = json!({ "type": "diffuse", "albedo": { "texture": format!("{kind}_part") } });
        scene["materials"][format!("{kind}_relief")] =
            json!({ "type": "relief", "material": kind, "normal_map": { "texture": kind }});
    }
    let mesh = |file: &str| json!({ "type": "mesh", "file": file, "material": "gone_relief" });
    scene["objects"]["idle"] =
        json!({ "shapes": [mesh("gone.ply"), mesh("bad.ply"), mesh("gone.obj")], "instances": [{ "object": "lamp" }] });
    let textures = |scene: &Value| folder.compile(scene).unwrap().textures.len();
    assert!(textures(&scene) > 0);
    // What is not used is checked all the same.
    let mut wrong = scene.clone();
    wrong["textures"]["gone"]["scale"] = json!([1e39, 1]);
    assert_error(&folder, &wrong, ErrorKind::Scene, &["textures.gone.scale"]);
    let mut wrong = scene.clone();
    wrong["objects"]["idle"]["shapes"][0]["material"] = json!("none");
    assert_error(&folder, &wrong, ErrorKind::Scene, &["objects.idle.shapes[0].material", "none"]);
    // Each use by the world, and by an object that is used, is one.
    let quad = |material: &str| json!({ "type": "quad", "material": material });
    for (pointer, use_, kind, file) in [
        ("/shapes/2", quad("gone"), ErrorKind::AssetMissing, "gone.png"),
        ("/shapes/2", quad("bad_relief"), ErrorKind::Scene, "bad.png"),
        ("/shapes/2", json!({ "type": "quad", "opacity": { "texture": "gone" } }), ErrorKind::AssetMissing, "gone.png"),
        (
            "/shapes/2",
            json!({ "type": "quad", "emission": { "radiance": [1, 1, 1], "texture": "bad_part" } }),
            ErrorKind::Scene,
            "bad.png",
        ),
        ("/objects/lamp/shapes/0", quad("gone_relief"), ErrorKind::AssetMissing, "gone.png"),
    ] {
        let mut scene = scene.clone();
        *scene.pointer_mut(pointer).unwrap() = use_;
        assert_error(&folder, &scene, kind, &[file]);
    }
    scene["instances"][0]["object"] = json!("idle");
    let error = folder.compile(&scene).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::AssetMissing, "{error}");
    for (part, file) in error.parts().iter().zip(["gone.png", "gone.ply", "bad.ply", "gone.obj"]) {
        assert!(part.to_string().contains(file), "{file}: {error}");
    }
    assert_eq!(error.parts().len(), 4, "{error}");
}

#[test]
fn assets_that_are_malformed() {
    let folder = Folder::new();
    let vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    folder.write("bad.mtl", "newmtl m\nKd 1 2 3\n");
    folder.write("short.mtl", "newmtl m\nKd 1 2\n");
    let header = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
                  element face 1\n\
                  property list uchar int vertex_indices\nend_header\n";
    let files: &[(&str, String, &str)] = &[
        ("a.obj", format!("{vertices}f 1 2 4\n"), "line 4: a face refers to vertex 4"),
        ("a.obj", "# nothing\n".into(), "no faces"),
        ("a.obj", "v 0 0 zero\n".into(), "line 1"),
        ("a.obj", "v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n".into(), "vertex 0 is not finite"),
        ("a.obj", format!("mtllib bad.mtl\n{vertices}usemtl m\nf 1 2 3\n"), "material \"m\": Kd"),
        ("a.obj", format!("mtllib short.mtl\n{vertices}usemtl m\nf 1 2 3\n"), "short.mtl"),
        ("a.obj", format!("mtllib bad.mtl\n{vertices}usemtl n\nf 1 2 3\n"), "line 5: no material named \"n\""),
        ("a.ply", "not a ply".into(), "PLY"),
        ("a.ply", format!("{header}0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n"), "vertex 3"),
        ("a.ply", format!("{header}0 0 0\n1 0 0\n0 1 0\n3 0 1\n"), "Line 13"),
        ("a.ply", format!("{header}0 0 0\n1 0 0\n"), "PLY"),
        ("a.ply", format!("{header}0 0 0\n1 0 nan\n0 1 0\n3 0 1 2\n"), "PLY"),
        ("a.stl", "solid".into(), ".obj or .ply"),
    ];
    for (name, content, word) in files {
        folder.write(name, content);
        let mut scene = good_scene();
        scene["shapes"][1] = json!({ "type": "mesh", "file": name });
        assert_error(&folder, &scene, ErrorKind::Scene, &["shapes[1].file", name, word]);
    }

    folder.write("sky.exr", "not an image");
    folder.write("sky.hdr", "not an image");
    folder.write("sky.png", "not an image");
    for name in ["sky.exr", "sky.hdr", "sky.png"] {
        let mut scene = good_scene();
        scene["lights"][3] = json!({ "type": "environment", "file": name });
        assert_error(&folder, &scene, ErrorKind::Scene, &["lights[3].file", name]);
    }
}

#[test]
fn scene_files_that_are_no_scenes() {
    let folder = Folder::new();
    let load = |content: &[u8]| {
        let error = import::load_scene(&folder.write("scene.json", content)).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Scene);
        error.to_string()
    };
    assert!(load(b"").contains("empty"));
    assert!(load(b"{}").contains("camera"));
    assert!(load(b"{ \"camera\": {},\n  \"comment\": \"\xff\" }").contains(":2:15: the file is not UTF-8"));
    assert!(load(b"{ /* ").contains(":1:3: the comment is never closed"));
    let whole = good_scene().to_string();
    for end in (0..whole.len()).step_by(37) {
        assert!(load(&whole.as_bytes()[..end]).contains("scene.json:1:"), "{end}");
    }
    let deep = format!("{{ \"shapes\": {}", "[{\"a\":".repeat(200_000));
    assert!(load(deep.as_bytes()).contains("nested too deep"));

    let missing = import::load_scene(&folder.write("x", "").with_file_name("none.json")).unwrap_err();
    assert_eq!(missing.kind(), ErrorKind::AssetMissing);
    assert!(missing.to_string().contains("none.json"));
}
