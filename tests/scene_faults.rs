//! All faults of a scene file are reported at once, in plain words.

use std::path::Path;

use serde_json::json;
use steradian::ErrorKind;
use steradian::internal::import::{self, ImportOptions};

use crate::util::folder::{Folder, good_scene, set};

/// The messages of all faults of a scene's text, without the file's name.
fn messages(text: &str) -> Vec<String> {
    let error = import::parse_scene(text, Path::new("s.json")).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Scene);
    error.parts().iter().map(|error| error.to_string().strip_prefix("s.json:").unwrap().to_owned()).collect()
}

#[test]
fn all_faults_of_a_text_are_reported_with_the_words_of_other_programs() {
    let text = r#"{
        "camera": { "position": [0, 1, 5], "look_at": [0, 0], "fov": 40 },
        "sampler": { "samples": 16 },
        "materials": {
            "a": { "type": "glass" },
            "b": { "type": "diffuse", "color": [1, 0, 0] },
            "c": { "type": "plastic", "roughness": "smooth" },
        },
        "shapes": [
            { "type": "rectangle" },
            { "type": "sphere", "center": [0, 1, 2], "radius": "1" },
            { "type": "quad", "transform": [{ "translate": 2 }, { "rotate": { "axis": [0, 1, 0] } }] },
            { "type": "disk", "emission": { "radiance": [1, 1, 1, 1] } },
        ],
        "lights": [{ "type": "envmap" }, { "type": "point" }],
        "outputs": { "layers": ["depth"] },
    }"#;
    let expected = [
        "2:55: camera.look_at: expected a list of three numbers, found two",
        "2:63: camera: unknown key \"fov\" (did you mean \"vertical_fov_degrees\"?)",
        "3:22: sampler: unknown key \"samples\" (did you mean \"spp\"?)",
        "5:28: materials.a.type: unknown type \"glass\" (did you mean \"dielectric\"?)",
        "6:39: materials.b: unknown key \"color\" (did you mean \"albedo\"?)",
        "7:52: materials.c.roughness: expected a number, [along u, along v], { \"texture\": name }, or { \"u\": ..., \
         \"v\": ... } of numbers and textures, found the text \"smooth\"",
        "10:23: shapes[0].type: unknown type \"rectangle\" (did you mean \"quad\"?)",
        "11:33: shapes[1]: unknown key \"center\" (did you mean \"transform\"?)",
        "11:64: shapes[1].radius: expected a number, found the text \"1\"",
        "12:60: shapes[2].transform[0].translate: expected a list of three numbers, found 2",
        "12:77: shapes[2].transform[1].rotate: `degrees` is missing",
        "13:57: shapes[3].emission.radiance: expected a list of three numbers, found four",
        "15:30: lights[0].type: unknown type \"envmap\" (did you mean \"environment\"?)",
        "15:42: lights[1]: `position` is missing",
        "15:42: lights[1]: `intensity` is missing",
        "16:20: outputs: `file` is missing",
        "16:33: outputs.layers[0]: unknown value \"depth\" (did you mean \"Z\"?)",
    ];
    assert_eq!(messages(text), expected);
    for (fault, message) in [
        ("[1]", "1:1: expected an object {...}, found a list of 1"),
        ("{ \"camera\": {}, \"shapes\": 3 }", "1:27: shapes: expected a list, found 3"),
        ("{ \"camera\": {} ", "1:15: the file ends too early: a bracket or a quote is not closed"),
        ("{ camera: {} }", "1:3: a key must stand in double quotes"),
    ] {
        assert_eq!(messages(fault), [message], "{fault}");
    }
}

#[test]
fn lights_with_an_area_and_metals_are_found_by_their_usual_names() {
    let text = r#"{
        "camera": {},
        "lights": [{ "type": "area" }],
        "materials": { "a": { "type": "gold" }, "b": { "type": "diffuse", "emission": 1 } },
        "shapes": [{ "type": "cube", "min": [0, 0, 0] }, { "type": "quad", "u": [1, 0, 0] }],
    }"#;
    let expected = [
        "3:30: lights[0].type: unknown type \"area\": a shape is a light by its key `emission`",
        "4:39: materials.a.type: unknown type \"gold\" (did you mean \"conductor\"?)",
        "4:75: materials.b: unknown key \"emission\": a shape is a light by its key `emission`",
        "5:38: shapes[0]: unknown key \"min\" (did you mean \"transform\"?)",
        "5:76: shapes[1]: unknown key \"u\" (did you mean \"edge_u\"?)",
    ];
    assert_eq!(messages(text), expected);
}

#[test]
fn objects_are_not_read_from_lists() {
    let text = r#"{ "camera": {}, "film": [64, 48], "shapes": { "type": "quad", "emission": [9, 9, 9] } }"#;
    let expected = [
        "1:25: film: expected an object {...}, found a list of 2",
        "1:75: shapes.emission: expected an object {...}, found a list of 3",
    ];
    assert_eq!(messages(text), expected);
}

#[test]
fn files_that_are_no_scenes_are_named_by_their_kind() {
    let folder = Folder::new();
    for (name, message) in [
        ("a.obj", "a mesh, not a scene: a scene names it as `file` of a shape of type `mesh`"),
        ("a.exr", "an image, not a scene"),
        ("a.blend", "scenes of this kind cannot be read: export it as glTF (.glb), which Blender does"),
    ] {
        let path = folder.path(name);
        let read = || import::read_scene(&path, &ImportOptions::default()).err().unwrap();
        assert_eq!(read().to_string(), format!("{}: No such file or directory", path.display()));
        std::fs::write(&path, "v 0 0 0").unwrap();
        assert_eq!(read().to_string(), format!("{}: {message}", path.display()));
    }
}

#[test]
fn names_that_do_not_exist_are_reported_together() {
    let mut scene = good_scene();
    for (path, value) in [
        ("materials.Gold.metal", json!("unobtainium")),
        ("materials.tiled.albedo.texture", json!("tile")),
        ("shapes[0].material", json!("upholstery")),
        ("instances[0].object", json!("pear")),
    ] {
        set(&mut scene, path, value);
    }
    let error = Folder::new().compile(&scene).err().unwrap();
    let messages: Vec<String> = error.parts().iter().map(ToString::to_string).collect();
    assert_eq!((error.kind(), messages.len()), (ErrorKind::Scene, 4), "{messages:#?}");
    for (message, part) in messages.iter().zip([
        "materials.Gold.metal: no metal named \"unobtainium\": use one of aluminium, brass, chromium, copper, gold, \
         iron, silver, titanium, tungsten, or `eta` and `k`",
        "materials.tiled.albedo: no texture named \"tile\"",
        "shapes[0].material: no material named \"upholstery\": use one of ",
        "instances[0].object: no object named \"pear\"",
    ]) {
        assert!(message.contains(part), "{message} lacks {part}");
    }
}
