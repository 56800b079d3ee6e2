//! Media within media, against boundaries modelled one by one.

use serde_json::{Value, json};

use crate::util::render::{Estimate, merge, pixels, render};

/// A ball of glass with a smaller one of water in it, between two coloured lamps and a mirror. The strategy `light`
/// does not split paths, as no render with media does.
fn balls(materials: Value, balls: Value) -> Value {
    let mut scene = json!({
        "film": { "width": 32, "height": 32, "filter": { "type": "box" } },
        "camera": { "position": [0, 0.3, 6], "look_at": [0, 0, 0], "vertical_fov_degrees": 24 },
        "sampler": { "type": "independent", "spp": 16 },
        "integrator": { "type": "path", "max_depth": 24, "rr_depth": 6, "strategy": "light" },
        "materials": { "black": { "type": "diffuse", "albedo": 0 }, "white": { "type": "diffuse", "albedo": 0.9 } },
        "lights": [{ "type": "environment", "radiance": [0.2, 0.3, 0.5] }]
    });
    merge(&mut scene["materials"], materials);
    let mut shapes = vec![
        json!({
            "type": "quad", "origin": [-3, -3, -4], "edge_u": [3, 0, 0], "edge_v": [0, 6, 0],
            "emission": { "radiance": [3, 1, 0.2] }, "material": "black"
        }),
        json!({
            "type": "quad", "origin": [-3, -1.2, 3], "edge_u": [6, 0, 0], "edge_v": [0, 0, -7], "material": "white"
        }),
    ];
    shapes.extend(balls.as_array().unwrap().iter().cloned());
    scene["shapes"] = json!(shapes);
    scene
}

/// Asserts that nearly all pixels are equal: paths are the same but for roundings, which now and then change a choice.
#[track_caller]
fn assert_same_picture(a: &Value, b: &Value, what: &str) {
    let (a, b) = (render(a), render(b));
    let differ = pixels(&a).zip(pixels(&b)).filter(|(p, q)| (0..3).any(|c| (p[c] - q[c]).abs() > 1e-3 * (p[c] + q[c])));
    let share = differ.count() as f64 / pixels(&a).count() as f64;
    assert!(share < 0.01, "{what}: {share} of the pixels differ");
}

#[test]
fn overlapping_media_look_like_boundaries_modelled_one_by_one() {
    let sphere = |material: &str, radius: f64, reverse: bool| {
        json!({
            "type": "sphere", "radius": radius, "material": material, "reverse_normal": reverse
        })
    };
    for roughness in [0.0, 0.3] {
        // Every boundary by itself: the outer one of glass in air, the inner one of water in glass.
        let boundary = |ior: f64| json!({ "type": "dielectric", "ior": ior, "roughness": roughness });
        let apart = balls(
            json!({ "outer": boundary(1.5), "inner": boundary(1.33 / 1.5) }),
            json!([sphere("outer", 1.0, false), sphere("inner", 0.8, false)]),
        );
        // Media: solid glass that water of a higher priority displaces.
        let medium = |ior: f64, priority: i32| {
            json!({
                "type": "dielectric", "ior": ior, "roughness": roughness, "priority": priority
            })
        };
        let solid = balls(
            json!({ "glass": medium(1.5, 1), "water": medium(1.33, 2) }),
            json!([sphere("glass", 1.0, false), sphere("water", 0.8, false)]),
        );
        assert_same_picture(&apart, &solid, &format!("solid glass, roughness {roughness}"));
        if roughness > 0.0 {
            continue;
        }
        // Hollow glass: water reaches into the wall of hollow glass, which counts there. (With the other side as its
        // front a rough surface takes other samples.)
        let hollow = balls(
            json!({ "glass": medium(1.5, 2), "water": medium(1.33, 1) }),
            json!([sphere("glass", 1.0, false), sphere("glass", 0.8, true), sphere("water", 0.9, false)]),
        );
        assert_same_picture(&apart, &hollow, &format!("hollow glass, roughness {roughness}"));
        // A gap, which wrong priorities or no overlap leave, looks different.
        let mut gap = hollow.clone();
        gap["shapes"][4]["radius"] = json!(0.7);
        let differ =
            pixels(&render(&gap)).zip(pixels(&render(&apart))).filter(|(p, q)| (p[0] - q[0]).abs() > 0.05).count();
        assert!(differ > 50, "{differ}");
    }
}

#[test]
fn clear_nested_media_vanish_in_a_white_environment() {
    let sphere = |material: &str, radius: f64, x: f64, reverse: bool| {
        json!({
            "type": "sphere", "radius": radius, "material": material, "reverse_normal": reverse,
            "transform": [{ "translate": [x, 0, 0] }]
        })
    };
    let mut scene = json!({
        "film": { "width": 24, "height": 24, "filter": { "type": "box" } },
        "camera": { "position": [0, 0, 6], "look_at": [0, 0, 0], "vertical_fov_degrees": 18 },
        "sampler": { "type": "independent", "spp": 256 },
        "integrator": { "type": "path", "max_depth": 1024, "rr_depth": 1000 },
        "materials": {
            "glass": { "type": "dielectric", "ior": 1.5, "priority": 2 },
            "water": { "type": "dielectric", "ior": 1.33, "priority": 1 },
            "ice": { "type": "dielectric", "ior": 1.31, "priority": 3 },
            "prism": { "type": "dielectric", "ior": 1.6, "abbe": 20, "priority": 4 },
            "bubble": { "type": "dielectric", "ior": 1, "priority": 5 }
        },
        "lights": [{ "type": "environment", "radiance": [1, 1, 1] }]
    });
    // A glass of water with ice that sticks out through the wall, a prism in it and a bubble in all of them.
    scene["shapes"] = json!([
        sphere("glass", 1.0, 0.0, false),
        sphere("glass", 0.8, 0.0, true),
        sphere("water", 0.9, 0.0, false),
        sphere("ice", 0.4, 0.7, false),
        sphere("prism", 0.3, 0.2, false),
        sphere("bubble", 0.2, 0.4, false)
    ]);
    let image = render(&scene);
    for c in 0..3 {
        // Total reflection holds few paths for ever: 1024 segments are nearly always enough.
        let e = Estimate::of(&image, c);
        assert!((e.mean - 1.0).abs() <= 5.5 * e.error + 1e-4, "channel {c}: {e:?}");
    }
    // Without dispersion nothing is left to chance.
    scene["materials"]["prism"]["abbe"] = Value::Null;
    scene["materials"]["prism"].as_object_mut().unwrap().remove("abbe");
    scene["sampler"]["spp"] = json!(64);
    let worst = pixels(&render(&scene)).map(|p| (p[1] - 1.0).abs()).fold(0.0, f32::max);
    assert!(worst < 0.05, "{worst}");
}
