//! Media that overlap, absorb and part colours, against closed forms.

use serde_json::{Value, json};
use steradian::ErrorKind;

use crate::bad_input::{assert_error, assert_faults};
use crate::util::folder::{Folder, good_scene, set};
use crate::util::render::{AssertIs, Estimate, merge, pixels, probe, render};

/// Radiance for red, green and blue of the middle of a picture without noise.
fn exact(scene: &Value) -> [f64; 3] {
    let image = render(scene);
    let first = image.rgb(0, 0).unwrap().map(f64::from);
    let spread = pixels(&image).flat_map(|p| [0, 1, 2].map(|c| (f64::from(p[c]) / first[c] - 1.0).abs()));
    assert!(spread.fold(0.0, f64::max) < 1e-4, "{first:?} has noise");
    first
}

#[track_caller]
fn assert_close(found: [f64; 3], expected: [f64; 3], tolerance: f64, what: &str) {
    let agree = found.iter().zip(expected).all(|(f, e)| (f - e).abs() <= tolerance * e.abs());
    assert!(agree, "{what}: {found:?}, expected {expected:?}");
}

/// A block with its lower and upper z, 4 wide.
fn block(material: &str, z: [f64; 2]) -> Value {
    json!({
        "type": "cube", "material": material,
        "transform": [{ "scale": [2, 2, 0.5 * (z[1] - z[0])] }, { "translate": [0, 0, 0.5 * (z[0] + z[1])] }]
    })
}

/// A white sky seen through blocks along -z from `z`, along the axis or not.
fn through(z: f64, materials: Value, blocks: Value) -> Value {
    let mut scene = probe(
        [0.1, 0.2, z],
        [0.1, 0.2, z - 1.0],
        json!({
            "integrator": { "type": "path", "max_depth": 128, "rr_depth": 100 },
            "sampler": { "spp": 16 },
            "materials": materials,
            "lights": [{ "type": "environment", "radiance": [1, 1, 1] }]
        }),
    );
    scene["shapes"] = blocks;
    scene
}

/// What `distance` in a medium with this transmittance per unit leaves.
fn left(colors: [f64; 3], distance: f64) -> [f64; 3] {
    colors.map(|c| c.powf(distance))
}

fn times(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|i| a[i] * b[i])
}

const RED: [f64; 3] = [0.9, 0.4, 0.2];
const BLUE: [f64; 3] = [0.3, 0.5, 0.8];

#[test]
fn a_slab_of_absorbing_glass_gives_the_closed_form() {
    // R once at each face, T within: R + (1 - R)² R T² / (1 - R² T²) is reflected and (1 - R)² T / (1 - R² T²) passes.
    let n = 1.5f64;
    let r = ((n - 1.0) / (n + 1.0)).powi(2);
    let expected = left(RED, 0.7).map(|t| {
        let series = (1.0 - r).powi(2) / (1.0 - r * r * t * t);
        r + series * t * (1.0 + r * t)
    });
    let glass = json!({ "m": { "type": "dielectric", "ior": n, "absorption": { "color": RED } } });
    let mut scene = through(3.0, glass.clone(), json!([block("m", [0.0, 0.7])]));
    scene["sampler"]["spp"] = json!(1024);
    let image = render(&scene);
    for (c, expected) in expected.into_iter().enumerate() {
        Estimate::of(&image, c).assert_is(expected, &format!("channel {c}"));
    }
    // Whitted's integrator follows both lobes: no noise.
    scene["integrator"] = json!({ "type": "whitted", "max_depth": 14 });
    scene["sampler"]["spp"] = json!(1);
    assert_close(exact(&scene), expected, 1e-5, "whitted");
}

#[test]
fn color_and_distance_say_what_is_left() {
    for (distance, thickness) in [(1.0, 0.5), (0.25, 0.5), (8.0, 2.0)] {
        let medium =
            json!({ "m": { "type": "dielectric", "ior": 1, "absorption": { "color": RED, "distance": distance } } });
        let found = exact(&through(5.0, medium, json!([block("m", [0.0, thickness])])));
        assert_close(found, left(RED, thickness / distance), 1e-5, "thickness in distances");
    }
}

#[test]
fn where_media_overlap_the_highest_priority_absorbs() {
    // Indices of 1: what is left depends on the lengths within each medium alone. a is [0, 2], b is [1, 3.5].
    let media = |a: Value, b: Value| {
        let mut scene = json!({
            "a": { "type": "dielectric", "ior": 1, "absorption": { "color": RED } },
            "b": { "type": "dielectric", "ior": 1, "absorption": { "color": BLUE } }
        });
        merge(&mut scene["a"], a);
        merge(&mut scene["b"], b);
        scene
    };
    let blocks = json!([block("a", [0.0, 2.0]), block("b", [1.0, 3.5])]);
    let none = json!({});
    let a_first = times(left(RED, 2.0), left(BLUE, 1.5));
    let b_first = times(left(RED, 1.0), left(BLUE, 2.5));
    let cases = [
        (json!({ "priority": 1 }), none.clone(), a_first),
        (none.clone(), json!({ "priority": 1 }), b_first),
        (json!({ "priority": -1 }), none.clone(), b_first),
        (json!({ "priority": -7 }), json!({ "priority": -9 }), a_first),
        // At equal priorities the one that absorbs more red.
        (none.clone(), none.clone(), b_first),
        (json!({ "priority": 3 }), json!({ "priority": 3 }), b_first),
        // The higher index counts before that, of 1.0000001 here: nothing is bent or reflected that could be seen.
        (json!({ "ior": 1.0000001 }), none, a_first),
    ];
    for (a, b, expected) in cases {
        // From both sides.
        for z in [6.0, -6.0] {
            let mut scene = through(z, media(a.clone(), b.clone()), blocks.clone());
            scene["camera"]["look_at"] = json!([0.1, 0.2, 0.0]);
            assert_close(exact(&scene), expected, 1e-5, &format!("{a} {b} from {z}"));
        }
    }
}

#[test]
fn overlapping_parts_of_one_medium_are_one_body() {
    // Of two materials, one rough: they are one medium, with no boundary where they overlap.
    let materials = json!({
        "a": { "type": "dielectric", "ior": 1.5, "priority": 2 },
        "b": { "type": "dielectric", "ior": 1.5, "priority": 2, "roughness": 0.5 }
    });
    let of = |blocks: Value| exact_whitted(through(6.0, materials.clone(), blocks));
    let whole = of(json!([block("a", [0.0, 3.0])]));
    let two = of(json!([block("a", [0.0, 2.0]), block("a", [1.0, 3.0])]));
    let rough_within = of(json!([block("a", [0.0, 3.0]), block("b", [1.0, 2.0]), block("b", [1.5, 2.5])]));
    assert_close(two, whole, 1e-6, "two parts");
    assert_close(rough_within, whole, 1e-6, "rough parts within");
}

fn exact_whitted(mut scene: Value) -> [f64; 3] {
    scene["integrator"] = json!({ "type": "whitted", "max_depth": 12 });
    scene["sampler"]["spp"] = json!(1);
    exact(&scene)
}

#[test]
fn light_within_a_medium_is_absorbed_on_its_way_to_and_from_a_surface() {
    // A point lamp 1 above a white floor, a camera 2 away, all within a medium: I / pi times what is left after 3.
    let distance = 3.0;
    let mut scene = probe(
        [0.0, 2.0, 0.02],
        [0.0; 3],
        json!({
            "materials": {
                "white": { "type": "diffuse", "albedo": 1 },
                "m": { "type": "dielectric", "ior": 1.5, "absorption": { "color": RED } },
                "paper": { "type": "diffuse_transmission", "reflectance": 0.25, "transmittance": 0.75 }
            },
            "shapes": [
                {
                    "type": "quad", "material": "white", "origin": [-9, 0, 9], "edge_u": [18, 0, 0],
                    "edge_v": [0, 0, -18]
                },
                { "type": "sphere", "radius": 50, "material": "m" }
            ],
            "lights": [{ "type": "point", "position": [0, 1, 0], "intensity": [1, 1, 1] }]
        }),
    );
    scene["sampler"]["spp"] = json!(1);
    scene["integrator"] = json!({ "type": "path", "max_depth": 2 });
    let expected = left(RED, distance).map(|t| t / std::f64::consts::PI);
    assert_close(exact(&scene), expected, 3e-4, "path");
    let mut whitted = scene.clone();
    whitted["integrator"] = json!({ "type": "whitted", "max_depth": 2 });
    assert_close(exact(&whitted), expected, 3e-4, "whitted");
    // What is not seen absorbs nothing.
    let mut cut = scene.clone();
    cut["camera"]["near"] = json!(1.5);
    assert_close(exact(&cut), left(RED, 1.5).map(|t| t / std::f64::consts::PI), 3e-4, "near");
    // Light that crosses paper is in the same medium on both sides.
    scene["shapes"][0]["material"] = json!("paper");
    scene["lights"][0]["position"] = json!([0, -1, 0]);
    assert_close(exact(&scene), expected.map(|e| 0.75 * e), 3e-4, "through paper");
}

#[test]
fn a_lamp_in_a_medium_is_as_bright_by_every_strategy() {
    // Radiance pi (R / d)² / pi of a lamp above the floor, times what is left: the lamp's points are all about as far.
    let scene = |strategy: &str, absorbs: bool| {
        let mut medium = json!({ "type": "dielectric", "ior": 1.33, "priority": 1 });
        if absorbs {
            medium["absorption"] = json!({ "color": [0.5, 0.5, 0.5] });
        }
        probe(
            [0.6, 0.45, -0.3],
            [0.0; 3],
            json!({
                "sampler": { "spp": 256 },
                "integrator": { "type": "path", "max_depth": 2, "strategy": strategy },
                "materials": {
                    "white": { "type": "diffuse", "albedo": 1 }, "black": { "type": "diffuse", "albedo": 0 },
                    "m": medium
                },
                "shapes": [
                    {
                        "type": "quad", "material": "white", "origin": [-9, 0, 9], "edge_u": [18, 0, 0],
                        "edge_v": [0, 0, -18]
                    },
                    {
                        "type": "sphere", "radius": 0.02, "material": "black",
                        "emission": { "radiance": [1e4, 1e4, 1e4] }, "transform": [{ "translate": [0, 2, 0] }]
                    },
                    { "type": "sphere", "radius": 50, "material": "m" }
                ]
            }),
        )
    };
    let way = (0.6f64 * 0.6 + 0.45 * 0.45 + 0.3 * 0.3).sqrt() + 1.98;
    for absorbs in [false, true] {
        let expected = 1e4 * 1e-4 * if absorbs { 0.5f64.powf(way) } else { 1.0 };
        for strategy in ["mis", "light", "bsdf"] {
            let e = Estimate::of(&render(&scene(strategy, absorbs)), 0);
            assert!(
                (e.mean - expected).abs() < 5.5 * e.error + 0.01 * expected,
                "{strategy}, absorbs {absorbs}: {e:?}, expected {expected}"
            );
        }
    }
}

#[test]
fn a_camera_starts_in_the_media_around_it() {
    // Indices of 1: the sky is as bright as what is left on the way out. One sphere in another and a camera in both, in
    // a gap, in one.
    let materials = json!({
        "a": { "type": "dielectric", "ior": 1, "absorption": { "color": RED } },
        "b": { "type": "dielectric", "ior": 1, "absorption": { "color": BLUE }, "priority": 1 },
        "hollow": { "type": "dielectric", "ior": 1, "priority": 2 }
    });
    let sphere = |material: &str, radius: f64| json!({ "type": "sphere", "radius": radius, "material": material });
    let shapes = json!([sphere("a", 3.0), sphere("b", 2.0), sphere("hollow", 1.0)]);
    for (z, expected) in [
        (4.0, times(left(RED, 2.0), left(BLUE, 2.0))),
        (2.5, times(left(RED, 1.5), left(BLUE, 2.0))),
        (1.5, times(left(RED, 1.0), left(BLUE, 1.5))),
        (0.5, times(left(RED, 1.0), left(BLUE, 1.0))),
        (-1.5, times(left(RED, 1.0), left(BLUE, 0.5))),
        (-2.5, left(RED, 0.5)),
        (-4.0, [1.0; 3]),
    ] {
        let mut scene = through(z, materials.clone(), shapes.clone());
        // Along the diameter.
        scene["camera"]["position"] = json!([0, 0, z]);
        scene["camera"]["look_at"] = json!([0, 0, z - 1.0]);
        for integrator in ["path", "whitted"] {
            scene["integrator"] = json!({ "type": integrator, "max_depth": 8 });
            assert_close(exact(&scene), expected, 1e-4, &format!("{integrator} from {z}"));
        }
        // The same as parts of a moved instance.
        scene["objects"] = json!({ "balls": { "shapes": scene["shapes"] } });
        scene["shapes"] = json!([]);
        scene["instances"] =
            json!([{ "object": "balls", "transform": [{ "rotate": { "axis": [1, 2, 3], "degrees": 40 } }] }]);
        assert_close(exact(&scene), expected, 1e-4, &format!("instance from {z}"));
    }
}

#[test]
fn a_label_on_a_bottle_is_opaque_and_the_rest_of_the_surface_is_not() {
    // Half of the outer surface is black paper: a quarter of the ways that cross it twice get through.
    let materials = json!({
        "clear": { "type": "dielectric", "ior": 1, "absorption": { "color": RED } },
        "paper": { "type": "diffuse", "albedo": 0 },
        "m": { "type": "mix", "materials": ["clear", "paper"] }
    });
    let mut scene = through(6.0, materials, json!([block("m", [0.0, 2.0])]));
    scene["sampler"]["spp"] = json!(256);
    let image = render(&scene);
    for (c, left) in left(RED, 2.0).into_iter().enumerate() {
        Estimate::of(&image, c).assert_is(0.25 * left, &format!("channel {c}"));
    }
}

#[test]
fn a_relief_leaves_the_medium_within() {
    let materials = json!({
        "clear": { "type": "dielectric", "ior": 1, "absorption": { "color": RED } },
        "m": { "type": "relief", "material": "clear", "bump_map": { "texture": "flat" } }
    });
    let mut scene = through(6.0, materials, json!([block("m", [0.0, 2.0])]));
    scene["textures"] = json!({ "flat": { "type": "checker", "color0": [0.5, 0.5, 0.5], "color1": [0.5, 0.5, 0.5] } });
    assert_close(exact(&scene), left(RED, 2.0), 1e-5, "through a block with relief");
}

#[test]
fn a_prism_parts_colours_by_snells_law() {
    // A ray meets a wedge of 30 degrees: each colour leaves it by its own angle, and lamps wait where red and blue go.
    let (ior, abbe) = (1.6f64, 10.0f64);
    let inverse_square = |nm: f64| (1000.0 / nm).powi(2);
    let b = (ior - 1.0) / (abbe * (inverse_square(486.13) - inverse_square(656.27)));
    let tilt = 30f64.to_radians();
    for (channel, nm) in [(0, 650.0), (1, 550.0), (2, 450.0)] {
        let n = ior + b * (inverse_square(nm) - inverse_square(587.56));
        let turned = (n * tilt.sin()).asin() - tilt;
        // The ray goes along -z through the flat face at z = 1 and leaves the tilted one at the origin, bent towards
        // -x.
        let far = 50.0;
        let lamp = json!({ "type": "sphere", "radius": 0.25, "emission": { "radiance": [1, 1, 1] }, "material": "black",
            "transform": [{ "translate": [-far * turned.sin(), 0, -far * turned.cos()] }] });
        let (x0, x1) = (-2.0, 1.0);
        let at = |x: f64| x * tilt.tan();
        let wedge = json!({
            "type": "mesh", "material": "prism",
            "positions": [
                [x0, -1, 2], [x1, -1, 2], [x1, 1, 2], [x0, 1, 2], [x0, -1, at(x0)], [x1, -1, at(x1)], [x1, 1, at(x1)],
                [x0, 1, at(x0)]
            ],
            "triangles": [
                [0, 1, 2], [0, 2, 3], [4, 6, 5], [4, 7, 6], [0, 5, 1], [0, 4, 5], [3, 2, 6], [3, 6, 7], [1, 5, 6],
                [1, 6, 2], [0, 3, 7], [0, 7, 4]
            ]
        });
        let mut scene = probe(
            [0.0, 0.0, 5.0],
            [0.0; 3],
            json!({
                "integrator": { "type": "path", "max_depth": 3 },
                "materials": {
                    "black": { "type": "diffuse", "albedo": 0 },
                    "prism": { "type": "dielectric", "ior": ior, "abbe": abbe }
                }
            }),
        );
        scene["shapes"] = json!([lamp, wedge]);
        let image = render(&scene);
        // Fresnel's equations for both faces, the second one at an angle.
        let first = 1.0 - ((n - 1.0) / (n + 1.0)).powi(2);
        let (ci, ct) = (tilt.cos(), (turned + tilt).cos());
        let rs = ((n * ci - ct) / (n * ci + ct)).powi(2);
        let rp = ((ci - n * ct) / (ci + n * ct)).powi(2);
        let expected = first * (1.0 - 0.5 * (rs + rp));
        for c in 0..3 {
            let expected = if c == channel { expected } else { 0.0 };
            Estimate::of(&image, c).assert_is(expected, &format!("lamp at {nm} nm, channel {c}"));
        }
    }
}

#[test]
fn media_that_make_no_sense() {
    let absorption = |color: Value, distance: Value| json!({ "color": color, "distance": distance });
    let tint = json!([0.5, 0.5, 0.5]);
    assert_faults(&[
        ("materials.glass.priority", json!(1.5), "materials.glass.priority", "1.5"),
        ("materials.glass.priority", json!("high"), "materials.glass.priority", "\"high\""),
        ("materials.glass.priority", json!(3e9), "materials.glass.priority", "3000000000"),
        ("materials.glass.priorty", json!(1), "materials.glass", "did you mean \"priority\"?"),
        ("materials.glass.absorption", json!([1, 2, 3]), "materials.glass.absorption", "found a list of 3"),
        ("materials.glass.absorption", json!({ "distance": 1 }), "materials.glass.absorption", "`color`"),
        ("materials.glass.absorption", json!({ "color": tint, "depth": 1 }), "materials.glass.absorption", "\"depth\""),
        (
            "materials.glass.absorption",
            absorption(json!([0, 1, 1]), json!(1)),
            "materials.glass.absorption.color",
            "above 0 and at most 1",
        ),
        (
            "materials.glass.absorption",
            absorption(json!([-0.1, 1, 1]), json!(1)),
            "materials.glass.absorption.color",
            "-0.1",
        ),
        (
            "materials.glass.absorption",
            absorption(json!([1, 1, 1.01]), json!(1)),
            "materials.glass.absorption.color",
            "1.01",
        ),
        (
            "materials.glass.absorption",
            absorption(json!([1, 1e39, 1]), json!(1)),
            "materials.glass.absorption.color",
            "inf",
        ),
        ("materials.glass.absorption", absorption(tint.clone(), json!(0)), "materials.glass.absorption.distance", "0"),
        (
            "materials.glass.absorption",
            absorption(tint.clone(), json!(-2)),
            "materials.glass.absorption.distance",
            "-2",
        ),
        (
            "materials.glass.absorption",
            absorption(tint.clone(), json!(1e39)),
            "materials.glass.absorption.distance",
            "inf",
        ),
        (
            "materials.glass.absorption",
            absorption(tint, json!(1e-42)),
            "materials.glass.absorption.distance",
            "too small",
        ),
        ("materials.glass.abbe", json!(0), "materials.glass.abbe", "from 1 to 1000"),
        ("materials.glass.abbe", json!(1001), "materials.glass.abbe", "from 1 to 1000"),
        (
            "materials.glass",
            json!({ "type": "dielectric", "ior": 10, "abbe": 1 }),
            "materials.glass.abbe",
            "indices of refraction",
        ),
        ("materials.glass", json!({ "type": "dielectric", "ior": 11, "priority": 1 }), "materials.glass.ior", "11"),
    ]);
    let mut scene = good_scene();
    set(&mut scene, "materials.glass.priority", json!(1));
    let folder = Folder::new();
    folder.compile(&scene).unwrap();
    set(&mut scene, "materials.m", json!({ "type": "mix", "materials": ["glass", "Gold"] }));
    folder.compile(&scene).unwrap();
    for other in [
        json!({ "type": "dielectric", "priority": 2 }),
        json!({ "type": "thin_dielectric" }),
        json!({ "type": "diffuse_transmission" }),
    ] {
        set(&mut scene, "materials.other", other);
        set(&mut scene, "materials.m", json!({ "type": "mix", "materials": ["glass", "other"] }));
        assert_error(&folder, &scene, ErrorKind::Scene, &["materials.m: ", "same medium"]);
    }
    set(&mut scene, "materials.m", json!({ "type": "two_sided", "front": "glass", "back": "Gold" }));
    assert_error(&folder, &scene, ErrorKind::Scene, &["materials.m.front: ", "lets light through"]);
    set(&mut scene, "materials.m", Value::Null);
    set(
        &mut scene,
        "shapes[0]",
        json!({ "type": "sphere", "material": "glass", "emission": { "radiance": [1, 1, 1] } }),
    );
    assert_error(&folder, &scene, ErrorKind::Scene, &["shapes[0]: ", "medium", "light"]);
}
