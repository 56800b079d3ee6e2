//! Materials as scenes use them: textures for parameters, mixes, two sides, switches.

use serde_json::{Value, json};

use crate::util::render::{AssertIs, Estimate, probe, render};

/// A square seen from the front or the back, under a white sky, with the material "m".
fn square(from_front: bool, rest: Value) -> Value {
    let mut scene = probe([0.3, 0.4, if from_front { 5.0 } else { -5.0 }], [0.01, 0.02, 0.0], rest);
    scene["shapes"] =
        json!([{ "type": "quad", "material": "m", "origin": [-1, -1, 0], "edge_u": [2, 0, 0], "edge_v": [0, 2, 0] }]);
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
        "half": { "type": "mix", "materials": ["black", "white"] },
        "m": { "type": "mix", "materials": ["black", "half"] }
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
        (json!({ "type": "phong", "diffuse": 0.5, "specular": 0.3, "exponent": 6 }), "exponent"),
        (json!({ "type": "phong", "diffuse": 0.5, "specular": 0.3, "exponent": 6, "lobe": "cosine" }), "exponent"),
        (json!({ "type": "cook_torrance", "m": 0.6 }), "m"),
        (json!({ "type": "cook_torrance", "d": 0.3, "s": 0.6 }), "s"),
        (json!({ "type": "cook_torrance", "d": 0.6, "s": 0.3 }), "d"),
        (json!({ "type": "cook_torrance", "f0": 0.6, "albedo": 0.2 }), "f0"),
        (json!({ "type": "cook_torrance", "albedo": 0.6 }), "albedo"),
        (json!({ "type": "coated", "base": "gold", "tint": 0.6, "roughness": 0.3 }), "tint"),
        (json!({ "type": "principled", "base_color": [0.6, 0.6, 0.6], "roughness": 0.4 }), "base_color"),
        (json!({ "type": "principled", "base_color": [0.9, 0.6, 0.3], "metallic": 0.6 }), "metallic"),
    ];
    for (constant, key) in kinds {
        let mut textured = constant.clone();
        let range = json!({ "texture": "tiles", "range": [0, 10] });
        textured[key] = if key == "exponent" { range } else { json!({ "texture": "tiles" }) };
        let textures =
            json!({ "tiles": { "type": "checker", "color0": [0.6, 0.6, 0.6], "color1": [0, 0, 0], "scale": [1, 1] } });
        let see = |material: &Value| {
            let mut scene = square(
                true,
                json!({
                    "textures": textures,
                    "materials": { "m": material, "gold": { "type": "conductor", "metal": "gold", "roughness": 0.5 } }
                }),
            );
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

/// What a material looks like where its texture `tiles` has the value 1/2, from one side.
fn see_tiled(material: &Value) -> Estimate {
    let mut scene = square(
        true,
        json!({
            "textures": {
                "tiles": { "type": "checker", "color0": [0.5, 0.5, 0.5], "color1": [0, 0, 0], "scale": [1, 1] }
            },
            "materials": { "m": material, "base": { "type": "diffuse", "albedo": [0.1, 0.7, 0.3] } }
        }),
    );
    scene["camera"]["look_at"] = json!([0.5, 0.5, 0.0]);
    Estimate::of(&render(&scene), 1)
}

#[test]
fn a_coat_with_textures_looks_as_the_constant_one() {
    // The constant coat is integrated, the other looked up in a table: their albedos agree to half a hundredth, as do
    // those of a smooth coat and of one whose index has changed.
    let half = json!({ "texture": "tiles" });
    let range = json!({ "texture": "tiles", "range": [1.2, 1.8] });
    for (kind, base) in [("plastic", json!({ "albedo": [0.1, 0.7, 0.3] })), ("coated", json!({ "base": "base" }))] {
        let material = |rest: Value| {
            let mut material = json!({ "type": kind });
            for (key, value) in base.as_object().unwrap().iter().chain(rest.as_object().unwrap()) {
                material[key] = value.clone();
            }
            see_tiled(&material)
        };
        for (constant, textured) in [
            (json!({ "roughness": 0.5 }), json!({ "roughness": half })),
            (json!({ "alpha": 0.5, "ior": 1.8 }), json!({ "alpha": half, "ior": 1.8 })),
            (json!({ "ior": 1.5 }), json!({ "ior": range })),
            (json!({ "ior": 1.5, "alpha": [0.1, 0.4] }), json!({ "ior": range, "alpha": [0.1, 0.4] })),
        ] {
            let (a, b) = (material(constant), material(textured.clone()));
            assert!((a.mean - b.mean).abs() < 0.005, "{kind} {textured}: {a:?} {b:?}");
        }
    }
}

#[test]
fn indices_of_refraction_can_be_textures() {
    let range = json!({ "texture": "tiles", "range": [1.2, 1.8] });
    for (constant, rest) in [
        (json!({ "type": "thin_dielectric", "ior": 1.5 }), json!({ "ior": range })),
        (json!({ "type": "principled", "ior": 1.5, "base_color": 0.2 }), json!({ "ior": range })),
        (
            json!({ "type": "principled", "ior": 1.5, "transmission": 1, "thin": true, "base_color": 0.2 }),
            json!({ "ior": range }),
        ),
    ] {
        let mut textured = constant.clone();
        textured["ior"] = rest["ior"].clone();
        let (a, b) = (see_tiled(&constant), see_tiled(&textured));
        assert!((a.mean - b.mean).abs() < 1e-4 * a.mean, "{textured}: {a:?} {b:?}");
    }
}

#[test]
fn a_coat_over_what_consists_of_others_coats_the_parts() {
    // Under a white sky the coat reflects its albedo, and what is left goes to the parts: the same as the mix of the
    // coated parts.
    let parts = json!({
        "dark": { "type": "diffuse", "albedo": 0.2 }, "light": { "type": "mirror", "reflectance": 0.9 },
        "mix": { "type": "mix", "materials": ["dark", "light"], "amount": 0.25 },
        "sides": { "type": "two_sided", "front": "mix", "back": "dark" },
        "m": { "type": "coated", "base": "sides", "ior": 1.5 }
    });
    let both = json!({
        "a": { "type": "diffuse", "albedo": 0.2 }, "b": { "type": "mirror", "reflectance": 0.9 },
        "dark": { "type": "coated", "base": "a", "ior": 1.5 }, "light": { "type": "coated", "base": "b", "ior": 1.5 },
        "mix": { "type": "mix", "materials": ["dark", "light"], "amount": 0.25 },
        "m": { "type": "two_sided", "front": "mix", "back": "dark" }
    });
    for from_front in [true, false] {
        let (a, b) = (look(from_front, parts.clone()), look(from_front, both.clone()));
        // Six standard errors of the difference: two-sided false-alarm rate 2e-9.
        assert!((a.mean - b.mean).abs() <= 6.0 * a.error.hypot(b.error), "{from_front}: {a:?} {b:?}");
        assert!(from_front == (a.mean > 0.3), "{a:?}");
    }
}

/// The square seen under a directional light from the right.
fn lit_from_the_right(material: &Value) -> f64 {
    let textures =
        json!({ "half": { "type": "checker", "color0": [0.5, 0.5, 0.5], "color1": [0, 0, 0], "scale": [1, 1] } });
    let mut scene = square(true, json!({ "textures": textures, "materials": { "m": material } }));
    scene["camera"]["look_at"] = json!([0.5, 0.5, 0.0]);
    scene["lights"] = json!([{ "type": "directional", "direction": [-0.5, 0, -1], "irradiance": [1, 1, 1] }]);
    scene["sampler"]["spp"] = json!(4);
    Estimate::of(&render(&scene), 0).mean
}

#[test]
fn each_axis_of_a_roughness_can_be_a_texture() {
    let half = json!({ "texture": "half" });
    for distribution in ["ggx", "beckmann"] {
        for key in ["alpha", "roughness"] {
            for kind in [json!({ "type": "conductor", "metal": "gold" }), json!({ "type": "plastic", "albedo": 0 })] {
                if kind["type"] == "plastic" && distribution != "ggx" {
                    continue;
                }
                let lit = |axes: Value| {
                    let mut material = kind.clone();
                    material[key] = axes;
                    if kind["type"] == "conductor" {
                        material["distribution"] = json!(distribution);
                    }
                    lit_from_the_right(&material)
                };
                let [along, across] = [lit(json!([0.5, 0.2])), lit(json!([0.2, 0.5]))];
                let close = |a: f64, b: f64| (a - b).abs() < 2e-3 * b;
                assert!(!close(along, across), "{key} {kind}: {along} {across}");
                assert!(
                    close(lit(json!({ "u": half, "v": 0.2 })), along)
                        && close(lit(json!({ "u": 0.2, "v": half })), across),
                    "{key} {kind}"
                );
                assert!(close(lit(json!({ "u": half, "v": half })), lit(json!(0.5))), "{key} {kind}");
            }
        }
    }
}

#[test]
fn a_metal_with_beckmanns_microfacets_has_their_density() {
    // Against GGX of the same alpha, the ratio of density and masking for the one half vector; Beckmann masks nothing
    // at these angles.
    let lit = |distribution: &str| {
        lit_from_the_right(&json!({
            "type": "conductor", "eta": [1e-6, 1e-6, 1e-6], "k": [1, 1, 1], "alpha": 0.3, "distribution": distribution,
            "multiscatter": false
        }))
    };
    let unit = |v: [f64; 3]| v.map(|x| x / v.iter().map(|x| x * x).sum::<f64>().sqrt());
    let (o, i) = (unit([-0.2, -0.1, 5.0]), unit([0.5, 0.0, 1.0]));
    let tan2 = |v: [f64; 3]| 0.09f64.recip() * (v[0] * v[0] + v[1] * v[1]) / (v[2] * v[2]);
    let slope2 = tan2([o[0] + i[0], o[1] + i[1], o[2] + i[2]]);
    let lambda = |v: [f64; 3]| 0.5 * ((1.0 + 0.09 * 0.09 * tan2(v)).sqrt() - 1.0);
    let expected = (-slope2).exp() * (1.0 + slope2).powi(2) * (1.0 + lambda(o) + lambda(i));
    let ratio = lit("beckmann") / lit("ggx");
    assert!((ratio - expected).abs() < 1e-3 * expected && (expected - 1.0).abs() > 0.05, "{ratio} {expected}");
}
