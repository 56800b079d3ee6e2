//! Scenes beyond what can be rendered or written: an error with its place, in bounded time and memory.

use serde_json::{Value, json};
use steradian::ErrorKind;

use crate::bad_input::{assert_error, assert_faults};
use crate::util::folder::{Folder, good_scene, set};

/// What `render` refuses of a scene alone, `info` refuses too: compiling finds it, with its place.
#[test]
fn outputs_and_films_that_cannot_be_written() {
    let out = |more: Value| {
        let mut output = json!({ "file": "o.exr" });
        output.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
        json!([output])
    };
    assert_faults(&[
        (
            "outputs",
            out(json!({ "layers": ["crypto_object"], "crypto_depth": 7 })),
            "outputs[0].crypto_depth",
            "even number from 2",
        ),
        ("outputs", out(json!({ "frames_per_second": 0 })), "outputs[0].frames_per_second", "above 0"),
        ("outputs", out(json!({ "dwa_level": 45 })), "outputs[0].dwa_level", "without the compression"),
        ("outputs", out(json!({ "compression": "dwaa", "dwa_level": -1 })), "outputs[0].dwa_level", "from 0 to 100000"),
        ("outputs", out(json!({ "compression": "dwaa", "layers": ["Z"] })), "outputs[0].compression", "would spoil"),
        (
            "outputs",
            out(json!({ "layers": ["Z"], "pixel_types": { "Z": "half" } })),
            "outputs[0].pixel_types",
            "32 bits",
        ),
        (
            "outputs",
            json!([{ "file": "o.exr" }, { "file": "p.png" }, { "file": "o.exr" }]),
            "outputs[2].file",
            "outputs[0]",
        ),
        (
            "film",
            json!({ "width": 64, "height": 32, "overscan": 33 }),
            "film.overscan",
            "at most the picture's shorter side, 32",
        ),
        ("film.overscan", json!(1), "film.overscan", "crop"),
    ]);
}

#[test]
fn meshes_with_more_times_than_embree_has() {
    let mesh = |times: usize| {
        let positions = json!([[-1, -1, 0], [1, -1, 0], [0, 1, 0]]);
        json!({
            "type": "mesh", "positions": positions, "triangles": [[0, 1, 2]],
            "deform_positions": vec![positions.clone(); times]
        })
    };
    assert_faults(&[("shapes[0]", mesh(129), "shapes[0].deform_positions", "129 further times: there can be 128")]);
    let mut scene = good_scene();
    set(&mut scene, "shapes[0]", mesh(128));
    let scene = Folder::new().compile(&scene).unwrap();
    steradian::internal::accel::build(steradian::internal::accel::AccelKind::EMBREE, &scene.geometry, 1).unwrap();
}

/// Time and memory of nested products do not grow with the number of ways through them.
#[test]
fn nested_products_of_textures_are_bounded() {
    let chain = |levels: usize, factors: usize| {
        let mut textures = serde_json::Map::new();
        textures.insert("t0".into(), json!({ "type": "checker" }));
        for i in 1..=levels {
            let factor = json!({ "texture": format!("t{}", i - 1) });
            textures.insert(format!("t{i}"), json!({ "type": "product", "factors": vec![factor; factors] }));
        }
        Value::Object(textures)
    };
    let folder = Folder::new();
    let compiled = |textures: Value| {
        let mut scene = json!({
            "camera": { "position": [0, 0, 4], "look_at": [0, 0, 0] },
            "shapes": [{ "type": "sphere" }], "lights": [{ "type": "environment", "radiance": [1, 1, 1] }]
        });
        scene["textures"] = textures;
        folder.compile(&scene).map(|_| ()).map_err(|e| e.to_string())
    };
    assert_eq!(compiled(chain(64, 1)), Ok(()));
    assert_eq!(compiled(chain(8, 2)), Ok(()));
    for (levels, factors, words) in
        [(65, 1, "more than 64 deep"), (15_000, 1, "more than 64 deep"), (30, 2, "more than 256")]
    {
        let error = compiled(chain(levels, factors)).unwrap_err();
        assert!(error.contains("textures.t") && error.contains(words), "{error}");
    }
}

/// Names of 100,000 letters, and many of them.
#[test]
fn long_names_cost_no_more_than_short_ones() {
    let long = "x".repeat(100_000);
    let mut scene = good_scene();
    set(&mut scene, "shapes[0].material", json!(format!("{long}y")));
    for i in 0..20 {
        scene["materials"][format!("{long}{i}")] = json!({ "type": "mirror" });
    }
    assert_error(&Folder::new(), &scene, ErrorKind::Scene, &["shapes[0].material", "no material named"]);
}
