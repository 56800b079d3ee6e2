//! Faults of principled materials and of those that consist of others.

use serde_json::{Value, json};
use steradian::ErrorKind;

use crate::bad_input::{assert_error, assert_faults};
use crate::util::folder::{Folder, good_scene, set};

#[test]
fn materials_of_materials_that_make_no_sense() {
    let mixed = "materials.mixed";
    let mix = |a: &str, b: &str| json!({ "type": "mix", "materials": [a, b] });
    let sides = |front: &str, back: &str| json!({ "type": "two_sided", "front": front, "back": back });
    assert_faults(&[
        (mixed, mix("gold", "glass"), "materials.mixed.materials[0]", "did you mean \"Gold\"?"),
        (mixed, mix("Gold", "wood"), "materials.mixed.materials[1]", "no material"),
        (mixed, mix("Gold", "mixed"), "materials.mixed.materials[1]", "consists of itself: mixed -> mixed"),
        (mixed, json!({ "type": "mix", "materials": ["Gold"] }), "materials.mixed.materials", "1"),
        (mixed, json!({ "type": "mix", "materials": ["Gold", "glass"], "amount": 2 }), "materials.mixed.amount", "2"),
        (mixed, json!({ "type": "coated", "base": "gold" }), "materials.mixed.base", "did you mean \"Gold\"?"),
        (mixed, json!({ "type": "coated", "base": "glass" }), "materials.mixed.base", "opaque"),
        (mixed, json!({ "type": "coated", "base": "mixed" }), "materials.mixed.base", "itself"),
        (mixed, json!({ "type": "coated" }), "materials.mixed", "base"),
        (mixed, json!({ "type": "coated", "base": "Gold", "ior": 0.75 }), "materials.mixed.ior", "0.75"),
        (mixed, json!({ "type": "coated", "base": "Gold", "roughness": 2 }), "materials.mixed.roughness", "2"),
        (mixed, json!({ "type": "coated", "base": "Gold", "alpha": 0.1, "roughness": 0.1 }), mixed, "`alpha`"),
        (mixed, json!({ "type": "coated", "base": "Gold", "tint": [1, 2, 1] }), "materials.mixed.tint", "2.0"),
        (mixed, sides("glass", "Gold"), "materials.mixed.front", "opaque"),
        (mixed, sides("Gold", "glass"), "materials.mixed.back", "opaque"),
        (mixed, sides("Gold", "mixed"), "materials.mixed.back", "itself"),
        (mixed, sides("Gold", "silver"), "materials.mixed.back", "no material"),
    ]);
    let folder = Folder::new();
    let mut scene = good_scene();
    set(&mut scene, "materials.a", mix("Gold", "b"));
    set(&mut scene, "materials.b", sides("a", "Gold"));
    assert_error(&folder, &scene, ErrorKind::Scene, &["materials.b.front: ", "a -> b -> a"]);
    // A part of a part lets light through.
    set(&mut scene, "materials.a", mix("Gold", "glass"));
    assert_error(&folder, &scene, ErrorKind::Scene, &["materials.b.front: ", "opaque"]);
    // Deep but sound, and too deep.
    let mut scene = good_scene();
    for i in 0..40 {
        let part = if i == 39 { "Gold".to_owned() } else { format!("m{:02}", i + 1) };
        set(&mut scene, &format!("materials.m{i:02}"), mix("Gold", &part));
    }
    assert_error(&folder, &scene, ErrorKind::Scene, &["nested more than 32 deep"]);
    for i in 0..15 {
        set(&mut scene, &format!("materials.m{i:02}"), mix("Gold", "glass"));
    }
    folder.compile(&scene).unwrap();
}

#[test]
fn principled_materials_out_of_range() {
    let with = |key: &str, value: Value| json!({ "type": "principled", key: value });
    let place = "materials.glass";
    let mut faults: Vec<(Value, String, &str)> = vec![
        (with("base_color", json!([0.5, 2, 0.5])), format!("{place}.base_color"), "2.0"),
        (with("base_color", json!({ "texture": "nowhere" })), format!("{place}.base_color"), "no texture"),
        (with("ior", json!(0.75)), format!("{place}.ior"), "0.75"),
        (with("ior", json!(11)), format!("{place}.ior"), "11"),
        (json!({ "type": "principled", "ior": 1.5, "specular": 0.5 }), place.to_owned(), "either `specular` or `ior`"),
        (with("diffuse_transmission", json!(0.5)), format!("{place}.diffuse_transmission"), "`thin`"),
        (with("ior", json!({ "texture": "tiles", "range": [0.5, 2] })), format!("{place}.ior.range[0]"), "0.5"),
        (
            json!({ "type": "principled", "transmission": 0.5, "ior": { "texture": "tiles", "range": [1.2, 2] } }),
            format!("{place}.ior"),
            "what is inside has one index",
        ),
        (
            json!({ "type": "principled", "transmission": { "texture": "tiles" }, "specular": { "texture": "tiles" } }),
            format!("{place}.specular"),
            "what is inside has one index",
        ),
        (with("thin", json!(1)), format!("{place}.thin"), "true or false"),
        (with("multiscatter", json!("no")), format!("{place}.multiscatter"), "true or false"),
        (with("metalic", json!(1)), place.to_owned(), "did you mean \"metallic\"?"),
        (with("metallic", json!([1, 2])), format!("{place}.metallic"), "expected a number"),
    ];
    let scalars = [
        "metallic",
        "roughness",
        "anisotropic",
        "specular",
        "specular_tint",
        "sheen",
        "sheen_tint",
        "clearcoat",
        "clearcoat_gloss",
        "subsurface",
        "transmission",
        "diffuse_transmission",
    ];
    for key in scalars {
        faults.push((with(key, json!(1.25)), format!("{place}.{key}"), "1.25"));
        faults.push((with(key, json!(-0.5)), format!("{place}.{key}"), "-0.5"));
        faults.push((with(key, json!({ "texture": "tile" })), format!("{place}.{key}"), "did you mean \"tiles\"?"));
    }
    let folder = Folder::new();
    for (value, place, word) in faults {
        let mut scene = good_scene();
        set(&mut scene, "materials.glass", value);
        assert_error(&folder, &scene, ErrorKind::Scene, &[&format!("{place}: "), word]);
    }
    // And without a fault, with a texture for a number.
    let mut scene = good_scene();
    set(
        &mut scene,
        "materials.glass",
        json!({ "type": "principled", "roughness": { "texture": "tiles" }, "metallic": { "texture": "grey" } }),
    );
    folder.compile(&scene).unwrap();
}
