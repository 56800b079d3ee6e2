//! Materials as scenes use them: textures for parameters, mixes, two sides, switches.

use serde_json::{Value, json};

use crate::util::render::{Estimate, probe, render};

/// A square seen from the front or the back, under a white sky, with the material "m".
fn square(from_front: bool, rest: Value) -> Value {
    let mut scene = probe([0.3, 0.4, if from_front { 5.0 } else { -5.0 }], [0.01, 0.02, 0.0], rest);
    scene["shapes"] = json!([{ "type": "quad", "material": "m", "origin": [-1, -1, 0], "edge_u": [2, 0, 0], "edge_v": [0, 2, 0] }]);
    scene["lights"] = json!([{ "type": "environment", "radiance": [1, 1, 1] }]);
    scene["sampler"]["spp"] = json!(256);
    scene
}

fn look(from_front: bool, materials: Value) -> Estimate {
    Estimate::of(&render(&square(from_front, json!({ "materials": materials }))), 1)
}

#[test]
fn a_mix_is_the_mean_of_its_parts() {
    let parts = |amount: Value| {
        json!({
            "dark": { "type": "diffuse", "albedo": 0.2 }, "light": { "type": "mirror", "reflectance": 0.9 },
            "m": { "type": "mix", "materials": ["dark", "light"], "amount": amount }
        })
    };
    for (amount, expected) in [(json!(0.0), 0.2), (json!(0.25), 0.375), (json!(1.0), 0.9)] {
        let estimate = look(true, parts(amount.clone()));
        estimate.assert_is(expected, &format!("{amount}"));
        assert!(expected != 0.375 || estimate.error > 0.0);
    }
}

#[test]
fn a_mix_of_mixes_is_mixed_independently() {
    // A quarter of white: the choices within must not depend on the choices without.
    let materials = json!({
        "black": { "type": "diffuse", "albedo": 0.0 }, "white": { "type": "diffuse", "albedo": 1.0 },
        "half": { "type": "mix", "materials": ["black", "white"] }, "m": { "type": "mix", "materials": ["black", "half"] }
    });
    look(true, materials).assert_is(0.25, "nested mix");
}

#[test]
fn the_amount_of_a_mix_can_be_a_texture() {
    let mut scene = square(
        true,
        json!({
            "textures": { "tiles": { "type": "checker", "color0": [0, 0, 0], "color1": [1, 1, 1], "scale": [1, 1] } },
            "materials": {
                "dark": { "type": "diffuse", "albedo": 0.2 }, "light": { "type": "diffuse", "albedo": 0.6 },
                "m": { "type": "mix", "materials": ["dark", "light"], "amount": { "texture": "tiles" } }
            }
        }),
    );
    for (look_at, expected) in [([0.5, 0.5, 0.0], 0.2), ([-0.5, 0.5, 0.0], 0.6)] {
        scene["camera"]["look_at"] = json!(look_at);
        Estimate::of(&render(&scene), 0).assert_is(expected, "textured amount");
    }
}

#[test]
fn each_side_has_its_material() {
    let materials = json!({
        "front": { "type": "diffuse", "albedo": 0.7 }, "back": { "type": "diffuse", "albedo": 0.0 },
        "m": { "type": "two_sided", "front": "front", "back": "back" }
    });
    look(true, materials.clone()).assert_is(0.7, "front");
    look(false, materials).assert_is(0.0, "back");
}

#[test]
fn roughness_and_colours_can_be_textures() {
    // Every kind with a texture compiles and looks like the constant where the texture has its value.
    let kinds = [
        (json!({ "type": "diffuse", "albedo": 0.5, "roughness": 0.6 }), "roughness"),
        (json!({ "type": "mirror", "reflectance": 0.6 }), "reflectance"),
        (json!({ "type": "conductor", "metal": "gold", "roughness": 0.6 }), "roughness"),
        (json!({ "type": "conductor", "metal": "gold", "alpha": 0.3, "tint": 0.6 }), "tint"),
        (json!({ "type": "dielectric", "roughness": 0.6 }), "roughness"),
        (json!({ "type": "diffuse_transmission", "reflectance": 0.4, "transmittance": 0.6 }), "transmittance"),
        (json!({ "type": "phong", "diffuse": 0.6, "specular": 0.3 }), "diffuse"),
        (json!({ "type": "principled", "base_color": [0.6, 0.6, 0.6], "roughness": 0.4 }), "base_color"),
        (json!({ "type": "principled", "base_color": [0.9, 0.6, 0.3], "metallic": 0.6 }), "metallic"),
    ];
    for (constant, key) in kinds {
        let mut textured = constant.clone();
        textured[key] = json!({ "texture": "tiles" });
        let textures = json!({ "tiles": { "type": "checker", "color0": [0.6, 0.6, 0.6], "color1": [0, 0, 0], "scale": [1, 1] } });
        let see = |material: &Value| {
            let mut scene = square(true, json!({ "textures": textures, "materials": { "m": material } }));
            scene["camera"]["look_at"] = json!([0.5, 0.5, 0.0]);
            scene["sampler"]["spp"] = json!(64);
            Estimate::of(&render(&scene), 1)
        };
        let (a, b) = (see(&constant), see(&textured));
        assert!((a.mean - b.mean).abs() < 1e-4 * a.mean, "{constant} {key}: {a:?} {b:?}");
    }
}

#[test]
fn white_materials_vanish_in_a_white_environment_with_multiple_scattering_and_darken_without() {
    for (material, least) in [
        (json!({ "type": "conductor", "eta": [1e-6, 1e-6, 1e-6], "k": [1, 1, 1], "alpha": 0.8 }), 0.9),
        (json!({ "type": "principled", "base_color": 1, "metallic": 1, "roughness": 0.9 }), 0.9),
    ] {
        let with = look(true, json!({ "m": material }));
        assert!((with.mean - 1.0).abs() < 0.01, "{material}: {with:?}");
        let mut single = material.clone();
        single["multiscatter"] = json!(false);
        let without = look(true, json!({ "m": single }));
        assert!(without.mean < least, "{material}: {without:?}");
    }
}
