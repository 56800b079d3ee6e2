//! Lights of the scene file: measured, textured, inside objects, in groups; and the limit on indirect light.

use std::f64::consts::PI;

use serde_json::{Value, json};
use steradian::ErrorKind;
use steradian::internal::film::LayerKind;
use steradian::internal::id::{LightGroupId, LightId};

use crate::util::folder::{Folder, good_scene, set};
use crate::util::render::{AssertIs, Estimate, assert_irradiance, floor_probe, merge, pixels, probe, render};

/// 10 candela downwards; 8 (in the plane of horizontal angle 0) or 6 (in that of 90) at 45 degrees; nothing at 90.
const LAMP: &str = "IESNA:LM-63-2002\n[TEST] none\nTILT=NONE\n1 1000 2.0 3 2 1 2 0.1 0.1 0.0\n0.5 1.0 10\n0 45 90\n\
                    0 90\n10 8 0\n10 6 0\n";

#[test]
fn a_measured_light_has_the_intensity_of_its_file() {
    let folder = Folder::new();
    let file = folder.write("lamp.ies", LAMP);
    let lamp = |turned: f64| {
        json!([{
            "type": "ies", "file": file, "position": [0, 1, 0], "intensity": [0.5, 0.5, 0.5], "rotation_degrees": turned
        }])
    };
    let angle = 22.5f64.to_radians();
    let fall = 0.5 * angle.cos().powi(3);
    // Half of the way from 0 to 45 degrees.
    for (at, turned, candela) in
        [([1.0, 0.0, 0.0], 0.0, 9.0), ([0.0, 0.0, 1.0], 0.0, 8.0), ([0.0, 0.0, -1.0], 90.0, 9.0)]
    {
        let mut scene = floor_probe(at.map(|x| x * angle.tan()), json!([]));
        scene["lights"] = lamp(turned);
        assert_irradiance(&scene, candela * fall, &format!("{at:?}"));
    }
}

/// A checker of two pairs of squares along each side: 0.25 where both of u and v lie in the same halves of their
/// quarters, else 0.75.
#[test]
fn projectors_and_textured_spots_throw_pictures() {
    let textures = json!({
        "board": { "type": "checker", "color0": [0.25, 0.25, 0.25], "color1": [0.75, 0.75, 0.75], "scale": [2, 2] }
    });
    // Above the floor at height 1, looking down with -Z up: u grows with x and v against z, over 2 x 1 of the floor for
    // the projector.
    let lights = [
        json!({
            "type": "projector", "position": [0, 1, 0], "look_at": [0, 0, 0], "irradiance": [2, 2, 2],
            "texture": "board", "vertical_fov_degrees": 2.0 * 0.5f64.atan().to_degrees(), "aspect": 2
        }),
        json!({ "type": "spot", "position": [0, 1, 0], "look_at": [0, 0, 0], "intensity": [2, 2, 2], "texture": "board",
            "cutoff_angle_degrees": 45, "beam_angle_degrees": 45 }),
    ];
    for (x, z) in [(0.1, 0.1), (-0.3, 0.2), (0.4, -0.3), (-0.4, -0.1), (0.9, 0.2), (-0.7, -0.35)] {
        let squares = |half_v: f64| {
            let half = |t: f64| (4.0 * t).floor() as i32;
            if (half(0.5 + 0.5 * x) + half(0.5 - 0.5 * z / half_v)) % 2 == 0 { 0.25 } else { 0.75 }
        };
        // A projector's irradiance is that of its plane; a spot's falls with the square of the distance and the cosine.
        let fall = (1.0f64 + x * x + z * z).powf(-1.5);
        for (light, expected) in lights.iter().zip([2.0 * squares(0.5), 2.0 * squares(1.0) * fall]) {
            let mut scene = floor_probe([x, 0.0, z], json!([]));
            scene["textures"] = textures.clone();
            scene["lights"] = json!([light]);
            assert_irradiance(&scene, expected, &format!("{} at {x}, {z}", light["type"]));
        }
    }
    let mut beside = floor_probe([1.1, 0.0, 0.0], json!([]));
    (beside["textures"], beside["lights"]) = (textures.clone(), json!([lights[0]]));
    assert_irradiance(&beside, 0.0, "beside the picture");
}

#[test]
fn wrong_projectors_are_refused_with_their_place() {
    let folder = Folder::new();
    let light = json!({ "type": "projector", "position": [0, 1, 0], "look_at": [0, 0, 0], "vertical_fov_degrees": 40 });
    let spot = json!({
        "type": "spot", "position": [0, 1, 0], "look_at": [0, 0, 0], "intensity": [1, 1, 1], "texture": "tiles"
    });
    for (light, key, value) in [
        (&light, "vertical_fov_degrees", json!(180)),
        (&light, "aspect", json!(0)),
        (&light, "up", json!([0, 3, 0])),
        (&light, "look_at", json!([0, 1, 0])),
        (&light, "texture", json!("none")),
        (&light, "texture", json!("colors")),
        (&spot, "cutoff_angle_degrees", json!(90)),
        (&spot, "up", json!([0, -1, 0])),
    ] {
        let mut scene = good_scene();
        let mut light = light.clone();
        set(&mut light, key, value);
        set(&mut scene, "lights", json!([light]));
        set(&mut scene, "textures.colors", json!({ "type": "vertex_color" }));
        let error = folder.compile(&scene).unwrap_err();
        assert!(error.kind() == ErrorKind::Scene && error.to_string().contains(&format!("lights[0].{key}")), "{error}");
    }
}

#[test]
fn a_textured_light_shines_where_its_texture_is_bright() {
    // Above the corner of a square of side 2 at height 1, of whose four squares two are lit.
    let corner = |a: f64, b: f64| {
        let (ra, rb) = ((1.0 + a * a).sqrt(), (1.0 + b * b).sqrt());
        0.5 * (a / ra * (b / ra).atan() + b / rb * (a / rb).atan())
    };
    let expected = corner(1.0, 1.0) + (corner(2.0, 2.0) - 2.0 * corner(1.0, 2.0) + corner(1.0, 1.0));
    let emission = json!({ "radiance": [1, 1, 1], "texture": "board" });
    let quad = json!({
        "type": "quad", "material": "black", "origin": [0, 1, 0], "edge_u": [2, 0, 0], "edge_v": [0, 0, 2],
        "emission": emission
    });
    let mesh = json!({
        "type": "mesh", "material": "black", "emission": emission,
        "positions": [[0, 1, 0], [2, 1, 0], [2, 1, 2], [0, 1, 2]],
        "triangles": [[0, 1, 2], [0, 2, 3]], "uvs": [[0, 0], [1, 0], [1, 1], [0, 1]]
    });
    for (what, shape) in [("quad", quad), ("mesh", mesh)] {
        let mut scene = floor_probe([0.0; 3], json!([shape]));
        scene["textures"] = json!({ "board": { "type": "checker", "color0": [1, 1, 1], "color1": [0, 0, 0] } });
        assert_irradiance(&scene, expected, what);
    }
}

#[test]
fn lamps_inside_objects_light_from_every_place_they_are_put() {
    let mut scene = floor_probe([0.0; 3], json!([]));
    let ball = json!({ "type": "sphere", "material": "black", "radius": 0.25, "emission": { "radiance": [1, 1, 1] } });
    scene["objects"] = json!({ "lamp": { "shapes": [ball] }, "pair": { "instances": [
        { "object": "lamp", "transform": [{ "translate": [0, 2, 0] }] },
        { "object": "lamp", "transform": [{ "scale": 2 }, { "translate": [0, 1.6, 1.2] }] }
    ] } });
    scene["instances"] = json!([{ "object": "pair" }]);
    // pi (R / d)² cos of each.
    assert_irradiance(&scene, PI / 64.0 + PI / 16.0 * 0.8, "two lamps");
}

#[test]
fn a_flat_lamp_that_shines_on_both_sides_does_not_light_itself() {
    for (material, edge) in [
        (json!({ "type": "diffuse", "albedo": 0.9 }), [2.0, 0.0, 0.0]),
        (json!({ "type": "principled" }), [2.0, 0.3, 0.0]),
    ] {
        let quad = json!({
            "type": "quad", "material": "m", "edge_u": edge,
            "transform": [{ "rotate": { "axis": [1, 2, 3], "degrees": 40 } }, { "translate": [10.1, 20.7, -3.3] }],
            "emission": { "radiance": [1, 1, 1], "two_sided": true }
        });
        let camera = json!({ "position": [10.1, 20.7, 1.7], "look_at": [10.1, 20.7, -3.3], "vertical_fov_degrees": 5 });
        let scene = json!({
            "camera": camera, "film": { "width": 16, "height": 16 }, "sampler": { "spp": 64 },
            "materials": { "m": material }, "shapes": [quad]
        });
        for pixel in pixels(&Folder::new().render(&scene)) {
            assert_eq!(pixel, [1.0; 3]);
        }
    }
}

#[test]
fn groups_have_names_and_know_their_lights() {
    let folder = Folder::new();
    let mut scene = good_scene();
    assert!(folder.compile(&scene).unwrap().light_groups.names().is_empty());
    set(&mut scene, "objects.lamp.shapes[1].emission.group", json!("lamps"));
    set(&mut scene, "lights[1].group", json!("fill"));
    set(&mut scene, "lights[3].group", json!("lamps"));
    let scene = folder.compile(&scene).unwrap();
    assert_eq!(scene.light_groups.names(), ["lamps", "fill"]);
    let groups: Vec<_> = (0..scene.lights.lights().len()).map(|i| scene.light_groups.of(LightId::new(i))).collect();
    let (lamps, fill) = (Some(LightGroupId(0)), Some(LightGroupId(1)));
    // A triangle, two placed lamps, point, spot, directional, environment.
    assert_eq!(groups, [None, lamps, lamps, None, fill, None, lamps]);
}

#[test]
fn whitteds_direct_light_of_anything_with_an_extent_is_all_of_it() {
    let direct = |mut scene: Value, expected: f64, what: &str| {
        scene["integrator"] = json!({ "type": "whitted" });
        scene["sampler"]["spp"] = json!(128);
        Estimate::of(&render(&scene), 1).assert_is(expected, what);
    };
    // A white ball under a white sky is as bright as the sky on every side.
    let sky = json!({ "type": "environment", "radiance": [2, 2, 2] });
    for side in [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.6, -0.8], [0.0, -0.6, 0.8]] {
        let ball = json!({ "type": "sphere", "material": "white" });
        let materials = json!({ "white": { "type": "diffuse", "albedo": 1 } });
        let scene = json!({ "materials": materials, "shapes": [ball], "lights": [sky] });
        direct(probe(side.map(|x| 4.0 * x), side, scene), 2.0, &format!("{side:?}"));
    }
    // The same from an image; from a ball as a lamp, pi (R / d)² cos above a corner of the floor; from a wide sun.
    let folder = Folder::new();
    // Two texels of 128 / 256 * 2^(130 - 128).
    let image = folder.write(
        "sky.hdr",
        [&b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n"[..], &[128, 128, 128, 130].repeat(2)].concat(),
    );
    let mut scene = floor_probe([0.0; 3], json!([]));
    scene["lights"] = json!([{ "type": "environment", "file": image }]);
    direct(scene.clone(), 2.0, "image");
    let sun = json!({
        "type": "directional", "direction": [0.6, -0.8, 0], "irradiance": [1, 1, 1], "angular_diameter_degrees": 30
    });
    scene["lights"] = json!([sun]);
    direct(scene, 0.8 / PI, "sun");
    let lamp = json!({
        "type": "sphere", "material": "black", "radius": 0.5, "emission": { "radiance": [1, 1, 1] },
        "transform": [{ "translate": [1.2, 1.6, 0] }]
    });
    direct(floor_probe([0.0; 3], json!([lamp])), 0.8 / 16.0, "ball");
}

/// A corner with a lamp and a mirror ball.
fn corner(integrator: Value) -> Value {
    let mut scene = probe(
        [3.0, 2.0, 4.0],
        [0.0, 0.6, 0.0],
        json!({
            "materials": {
                "grey": { "type": "diffuse", "albedo": 0.7 },
                "metal": { "type": "conductor", "metal": "silver", "alpha": 0.1 }
            },
            "shapes": [
                { "type": "quad", "material": "grey", "origin": [-2, 0, 2], "edge_u": [4, 0, 0], "edge_v": [0, 0, -4] },
                { "type": "quad", "material": "grey", "origin": [-2, 0, -2], "edge_u": [4, 0, 0], "edge_v": [0, 4, 0] },
                { "type": "sphere", "material": "metal", "radius": 0.6, "transform": [{ "translate": [0, 0.6, 0] }] },
                {
                    "type": "sphere", "radius": 0.2, "emission": { "radiance": [20, 18, 15] },
                    "transform": [{ "translate": [-1, 2, 0.5] }]
                }
            ]
        }),
    );
    merge(
        &mut scene,
        json!({ "camera": { "vertical_fov_degrees": 40 }, "sampler": { "spp": 16 },
            "integrator": { "type": "path", "roulette": "throughput" } }),
    );
    merge(&mut scene["integrator"], integrator);
    scene
}

#[test]
fn clamping_takes_only_from_indirect_light_and_never_more_than_the_limit() {
    let picture = |integrator: Value| pixels(&render(&corner(integrator))).collect::<Vec<_>>();
    let direct = picture(json!({ "max_depth": 2 }));
    let free = picture(json!({ "max_depth": 6 }));
    // Direct light is left whole, however low the limit; a limit above everything takes nothing.
    let nothing_else = picture(json!({ "max_depth": 6, "clamp": 1e-20 }));
    let strays = nothing_else.iter().zip(&direct).filter(|(a, b)| (0..3).any(|c| (a[c] - b[c]).abs() > 1e-12));
    assert_eq!(strays.map(|(a, b)| format!("{a:?} {b:?}")).collect::<Vec<_>>(), [""; 0]);
    assert_eq!(picture(json!({ "max_depth": 6, "clamp": 1e30 })), free);
    let limited = picture(json!({ "max_depth": 6, "clamp": 0.05 }));
    let mut changed = 0;
    for ((d, l), f) in direct.iter().zip(&limited).zip(&free) {
        // Eight contributions at most of up to 0.05 each.
        assert!(
            (0..3).all(|c| l[c] <= f[c] * 1.000_01 && l[c] >= d[c] && l[c] <= d[c] + 8.0 * 0.05),
            "{d:?} {l:?} {f:?}"
        );
        changed += usize::from(l[1] < f[1] * 0.99);
    }
    assert!(changed > 20, "{changed} of {}", free.len());
}

#[test]
fn regularized_caustics_vary_less_and_keep_their_light() {
    let picture = |max_depth: u32, alpha: Option<f32>, seed: u32| {
        let mut scene = corner(json!({ "max_depth": max_depth, "regularize": alpha }));
        scene["materials"]["metal"]["alpha"] = json!(0.02);
        scene["shapes"][3] = json!({ "type": "sphere", "radius": 0.01, "material": "grey" });
        scene["lights"] = json!([{ "type": "directional", "direction": [1, -2, -1], "irradiance": [3, 3, 3] }]);
        scene["sampler"] = json!({ "type": "independent", "spp": 256, "seed": seed });
        pixels(&render(&scene)).collect::<Vec<_>>()
    };
    // What the camera sees at once and what is lit at once stays as it is.
    assert_eq!(picture(2, None, 1), picture(2, Some(0.3), 1));
    let [free, rougher] = [None, Some(0.3)].map(|alpha| [1, 2, 3, 4].map(|seed| picture(4, alpha, seed)));
    // Relative to the picture: the mirror image of the sun would outweigh all else.
    let shades: Vec<f64> = rougher[0].iter().map(|pixel| f64::from(pixel[1]).powi(2) + 0.01).collect();
    let noise = |[a, b, c, d]: &[Vec<[f32; 3]>; 4]| -> f64 {
        let pixels = a.iter().zip(b).chain(c.iter().zip(d)).zip(shades.iter().cycle());
        pixels.map(|((a, b), shade)| f64::from(a[1] - b[1]).powi(2) / shade).sum()
    };
    let light =
        |pictures: &[Vec<[f32; 3]>; 4]| -> f64 { pictures.iter().flatten().map(|pixel| f64::from(pixel[1])).sum() };
    assert!(noise(&rougher) < 0.2 * noise(&free), "{} {}", noise(&rougher), noise(&free));
    assert!((light(&rougher) / light(&free) - 1.0).abs() < 0.05, "{} {}", light(&rougher), light(&free));
}

/// The error of the good scene after a change.
#[track_caller]
fn assert_fault(folder: &Folder, path: &str, value: &Value, kind: ErrorKind, place: &str, word: &str) {
    let mut scene = good_scene();
    set(&mut scene, path, value.clone());
    let error = folder.compile(&scene).err().unwrap_or_else(|| panic!("{path} compiles with {value}"));
    let message = error.to_string();
    assert_eq!(error.kind(), kind, "{message}");
    assert!(
        message.contains(place) && message.contains(word) && message.contains("scene.json"),
        "{place}, {word}: {message}"
    );
}

#[test]
fn wrong_lights_are_refused_with_their_place() {
    let folder = Folder::new();
    folder.write("good.ies", LAMP);
    folder.write("bad.ies", LAMP.replace("10 8 0", "10 eight 0"));
    folder.write("type_b.ies", LAMP.replace("3 2 1 2", "3 2 2 2"));
    let ies = |file: &str| json!({ "type": "ies", "file": file, "position": [0, 2, 0] });
    let with = |key: &str, value: Value| {
        let mut light = ies("good.ies");
        light[key] = value;
        light
    };
    for (path, value, kind, place, word) in [
        ("lights[0]", ies("none.ies"), ErrorKind::AssetMissing, "lights[0].file", "none.ies"),
        ("lights[0]", ies("bad.ies"), ErrorKind::Scene, "lights[0].file", "\"eight\""),
        ("lights[0]", ies("type_b.ies"), ErrorKind::Scene, "lights[0].file", "type C"),
        ("lights[0]", with("look_at", json!([0, 2, 0])), ErrorKind::Scene, "lights[0].look_at", "own position"),
        ("lights[0]", with("intensity", json!([1, -1, 1])), ErrorKind::Scene, "lights[0].intensity", "-1"),
        ("lights[0]", with("candela", json!(1)), ErrorKind::Scene, "lights[0]", "candela"),
        ("lights[0].group", json!("key light"), ErrorKind::Scene, "lights[0].group", "key light"),
        ("lights[3].group", json!(""), ErrorKind::Scene, "lights[3].group", "letters"),
        ("shapes[1].emission.group", json!("a.b"), ErrorKind::Scene, "shapes[1].emission.group", "a.b"),
        (
            "shapes[1].emission.texture",
            json!("tile"),
            ErrorKind::Scene,
            "shapes[1].emission.texture",
            "did you mean \"tiles\"?",
        ),
        ("integrator.clamp", json!(0), ErrorKind::Scene, "integrator.clamp", "0"),
        ("integrator.clamp", json!(-2), ErrorKind::Scene, "integrator.clamp", "-2"),
    ] {
        assert_fault(&folder, path, &value, kind, place, word);
    }
}

#[test]
fn wrong_cameras_are_refused_with_their_place() {
    let folder = Folder::new();
    let place = json!({ "position": [0, 1, 5], "look_at": [0, 1, 0] });
    let camera = |rest: Value| {
        let mut camera = place.clone();
        merge(&mut camera, rest);
        camera
    };
    for (value, place, word) in [
        (json!({ "type": "fisheye" }), "camera", "fisheye"),
        (json!({ "type": "orthographic" }), "camera", "`view_height`"),
        (json!({ "type": "orthographic", "view_height": 0 }), "camera.view_height", "0"),
        (
            json!({ "type": "orthographic", "view_height": 1, "vertical_fov_degrees": 30 }),
            "camera.vertical_fov_degrees",
            "orthographic",
        ),
        (json!({ "type": "environment", "shift": [0, 1] }), "camera.shift", "environment"),
        (json!({ "type": "environment", "pixel_aspect": 1 }), "camera.pixel_aspect", "environment"),
        (json!({ "type": "environment", "lens": { "radius": 1, "focus_distance": 1 } }), "camera.lens", "environment"),
        (json!({ "view_height": 1 }), "camera.view_height", "perspective"),
        (json!({ "shift": [11, 0] }), "camera.shift", "11"),
        (json!({ "pixel_aspect": 0 }), "camera.pixel_aspect", "0"),
        (json!({ "near": -1 }), "camera.near", "-1"),
        (json!({ "shutter": [1, 0.5] }), "camera.shutter", "[1.0, 0.5]"),
        (json!({ "shutter": [-1e308, 1e308] }), "camera.shutter", "1e308"),
        (json!({ "motion": [{ "time": 0 }, { "time": 0 }] }), "camera.motion[1].time", "grow"),
        (
            json!({ "motion": [{ "time": 0 }, { "time": 1, "transform": [{ "scale": 2 }] }] }),
            "camera.motion[1].transform",
            "scaled",
        ),
        (
            json!({ "motion": [{ "time": 0, "transform": [{ "scale": [1, 1, -1] }] }] }),
            "camera.motion[0].transform",
            "rotation",
        ),
        (json!({ "motion": [{ "when": 0 }] }), "camera.motion[0]", "when"),
        (
            json!({ "lens": { "radius": 1, "focus_distance": 1, "blades": { "count": 2 } } }),
            "camera.lens.blades.count",
            "2",
        ),
        (
            json!({ "lens": { "radius": 1, "focal_length": 0.1, "sensor_distance": 0.05 } }),
            "camera.lens",
            "nothing is in focus",
        ),
        (
            json!({ "lens": { "radius": 1, "focal_length": 0.1, "sensor_distance": 0.2, "focus_distance": 1 } }),
            "camera.lens",
            "one too many",
        ),
        (
            json!({ "lens": { "radius": 1, "sensor_height": 0.1, "sensor_distance": 0.2, "focus_distance": 1 } }),
            "camera.lens",
            "either",
        ),
        (
            json!({ "lens": { "radius": 1, "focal_length": 0.1, "sensor_height": -1 } }),
            "camera.lens.sensor_height",
            "-1",
        ),
    ] {
        assert_fault(&folder, "camera", &camera(value), ErrorKind::Scene, place, word);
    }
}

#[test]
fn a_hidden_lamp_shows_what_is_behind_it() {
    // A lamp before a wall under a grey sky. With the lamp hidden the wall looks as through a near plane behind the
    // lamp, and there is no sky.
    for kind in ["path", "whitted"] {
        for turned in [false, true] {
            let picture_of = |hide: bool, near: f64, hidden: [bool; 2], transparent: bool| {
                let mut integrator = json!({ "type": kind, "hide_emitters": hide });
                if kind == "path" {
                    integrator["rr_depth"] = json!(5);
                }
                render(&json!({
                    "film": { "width": 24, "height": 24, "filter": { "type": "box" }, "transparent": transparent },
                    "camera": { "position": [0, 0, 5], "look_at": [0, 0, 0], "vertical_fov_degrees": 40, "near": near },
                    "sampler": { "spp": 16 },
                    "integrator": integrator,
                    "materials": { "white": { "type": "diffuse", "albedo": 0.8 } },
                    "shapes": [
                        {
                            "type": "quad", "material": "white", "origin": [-1.2, -1.2, 0], "edge_u": [2.4, 0, 0],
                            "edge_v": [0, 2.4, 0]
                        },
                        {
                            "type": "quad", "origin": [-0.5, -0.5, 1], "edge_u": [1, 0, 0], "edge_v": [0, 1, 0],
                            "reverse_normal": turned,
                            "emission": { "radiance": [5, 5, 5], "hidden": hidden[0] }
                        },
                        // Another lamp behind it.
                        {
                            "type": "sphere", "radius": 0.1, "transform": [{ "translate": [0, 0, 0.4] }],
                            "emission": { "radiance": [1, 1, 1], "hidden": hidden[1] }
                        }
                    ],
                    "lights": [{ "type": "environment", "radiance": [0.3, 0.3, 0.3] }]
                }))
            };
            let picture = |hide: bool, near: f64| picture_of(hide, near, [false; 2], near > 0.0);
            let (shown, hidden, beyond) = (picture(false, 0.0), picture(true, 0.0), picture(false, 4.8));
            let of = |image: &steradian::internal::film::Image, x: u32, y: u32| {
                image.pixel(LayerKind::Color, x, y).unwrap().to_vec()
            };
            assert_eq!((of(&shown, 12, 12)[0] >= 5.0, of(&shown, 12, 12)[3]), (!turned, 1.0), "{kind}");
            assert_eq!(
                [of(&shown, 0, 0), of(&hidden, 0, 0), of(&beyond, 0, 0)],
                [vec![0.3, 0.3, 0.3, 1.0], vec![0.0; 4], vec![0.0; 4]],
                "{kind}"
            );
            // Lamps that are hidden one by one.
            let each = picture_of(false, 0.0, [true; 2], true);
            assert_eq!(each.layers[0].data, hidden.layers[0].data, "{kind} {turned}");
            let under_sky = picture_of(false, 0.0, [true, false], false);
            assert_ne!(of(&under_sky, 12, 12), of(&hidden, 12, 12), "{kind} {turned}: the second lamp is shown");
            assert_eq!(of(&under_sky, 0, 0), [0.3, 0.3, 0.3, 1.0], "{kind} {turned}");
            let (mut sums, mut covered) = ([0.0; 2], 0);
            for (x, y) in (0..24).flat_map(|y| (0..24).map(move |x| (x, y))) {
                let (a, b) = (of(&hidden, x, y), of(&beyond, x, y));
                assert_eq!(a[3], b[3], "{kind} {x} {y}");
                if a[3] == 1.0 {
                    covered += 1;
                    sums[0] += a[1];
                    sums[1] += b[1];
                }
            }
            // The same paths, but for rounding: their roulette has no pilot.
            assert!((sums[0] - sums[1]).abs() < 1e-3 * sums[1] && covered > 100, "{kind} {turned}: {sums:?} {covered}");
        }
    }
}
