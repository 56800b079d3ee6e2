//! Bidirectional path tracing: the same picture as paths from the camera alone, with less noise where light is
//! indirect, and the same bits however a render is split.

use serde_json::{Value, json};
use steradian::Error;
use steradian::desc::{AutoDesc, CausticsDesc};
use steradian::internal::accel::AccelKind;
use steradian::internal::film::{Image, LayerKind};
use steradian::internal::render::{self, Overrides};

use crate::checkpoints::assert_resumed_split_and_replayed;
use crate::layers::{assert_sums, full_of};
use crate::util::render::{assert_blocks_agree, block_means, prepare, render_with};

/// A corner of a room with these shapes and materials, lit by a lamp that shines at the wall.
fn scene_of(lamp: &Value, shapes: &Value, materials: &Value) -> Value {
    let mut scene = json!({
        "camera": { "position": [0, 1.6, 4], "look_at": [0, 0.6, 0], "vertical_fov_degrees": 40 },
        "film": { "width": 72, "height": 72, "filter": { "type": "box" } },
        "integrator": { "type": "path", "max_depth": 6, "rr_depth": 5 },
        "materials": { "white": { "type": "diffuse", "albedo": 0.7 } },
        "shapes": [
            { "type": "quad", "material": "white", "origin": [-3, 0, 3], "edge_u": [6, 0, 0], "edge_v": [0, 0, -6] },
            { "type": "quad", "material": "white", "origin": [-3, 0, -2], "edge_u": [6, 0, 0], "edge_v": [0, 3, 0] },
            { "type": "quad", "material": "white", "origin": [-2.5, 0, 3], "edge_u": [0, 0, -6], "edge_v": [0, 3, 0] }
        ]
    });
    scene["shapes"].as_array_mut().unwrap().push(lamp.clone());
    scene["shapes"].as_array_mut().unwrap().extend(shapes.as_array().unwrap().iter().cloned());
    scene["materials"].as_object_mut().unwrap().extend(materials.as_object().unwrap().clone());
    scene
}

/// A quad that shines at the wall alone.
fn wall_lamp() -> Value {
    json!({
        "type": "quad", "material": "white", "origin": [-0.5, 2, -1.2], "edge_u": [0, 0.5, 0], "edge_v": [1, 0, 0],
        "emission": { "radiance": [20, 18, 14] }
    })
}

/// Diffuse surfaces alone.
fn plain() -> Value {
    scene_of(&wall_lamp(), &json!([]), &json!({}))
}

/// A lamp hidden from the camera before the other: light from there does not pass it.
fn hidden_lamp() -> Value {
    let lamp = json!({
        "type": "quad", "material": "white", "origin": [-0.3, 2.1, -1.5], "edge_u": [0, 0.5, 0], "edge_v": [1, 0, 0],
        "emission": { "radiance": [1, 2, 3], "hidden": true }
    });
    scene_of(&wall_lamp(), &json!([lamp]), &json!({}))
}

/// Smooth normals on coarse facets, which light paths and paths from the camera see differently, lit by a sphere.
fn smooth_facets() -> Value {
    let corner = |x: f64, z: f64| json!([x, 0.65 - 0.5 * (x * x + z * z), z]);
    let at = |i: u32, j: u32| corner(0.4 * f64::from(i) - 0.6, 0.4 * f64::from(j) - 0.6);
    let vertices: Vec<Value> = (0..16).map(|k| at(k % 4, k / 4)).collect();
    let cells = (0..9).map(|k| k / 3 * 4 + k % 3);
    let indices: Vec<[u32; 3]> = cells.flat_map(|a| [[a, a + 4, a + 1], [a + 1, a + 4, a + 5]]).collect();
    scene_of(
        &json!({
            "type": "sphere", "material": "white", "radius": 0.2, "transform": [{ "translate": [1.4, 0.6, 0.4] }],
            "emission": { "radiance": [30, 27, 21] }
        }),
        &json!([
            { "type": "mesh", "material": "gold", "positions": vertices, "triangles": indices, "shading": "smooth" },
            { "type": "sphere", "material": "coat", "radius": 0.4, "transform": [{ "translate": [-1.3, 0.4, 0] }] }
        ]),
        &json!({
            "gold": { "type": "conductor", "metal": "gold", "roughness": 0.6 },
            "coat": { "type": "plastic", "albedo": [0.7, 0.2, 0.1] }
        }),
    )
}

/// Rough glass, which scales radiance but not flux, a mirror, and the principled model, lit from both sides of a mesh.
fn glossy() -> Value {
    scene_of(
        &json!({
            "type": "mesh", "material": "white", "triangles": [[0, 1, 2]],
            "positions": [[-0.4, 2.2, -0.9], [0.6, 2.2, -0.9], [0.1, 2.2, 0.1]],
            "emission": { "radiance": [20, 18, 14], "two_sided": true }
        }),
        &json!([
            { "type": "sphere", "material": "glass", "radius": 0.5, "transform": [{ "translate": [-0.8, 0.5, 0.3] }] },
            { "type": "cube", "material": "car", "transform": [{ "scale": 0.3 }, { "translate": [0.3, 0.3, 0.5] }] },
            { "type": "quad", "material": "mirror", "origin": [2, 0, -1.9], "edge_u": [0.6, 0, 1],
              "edge_v": [0, 1.5, 0] }
        ]),
        &json!({
            "glass": { "type": "dielectric", "roughness": 0.5 }, "mirror": { "type": "mirror" },
            "car": { "type": "principled", "base_color": [0.2, 0.4, 0.7], "roughness": 0.4, "clearcoat": 1.0 }
        }),
    )
}

fn quad(material: &str, origin: [f64; 3], edge_u: [f64; 3], edge_v: [f64; 3]) -> Value {
    json!({ "type": "quad", "material": material, "origin": origin, "edge_u": edge_u, "edge_v": edge_v })
}

/// A room that two suns and a sky light by a window, half of it glazed, with a mirror; with roulette of connections.
fn window() -> Value {
    json!({
        "camera": { "position": [1.2, 1.6, 3.5], "look_at": [-0.5, 1, 0], "vertical_fov_degrees": 50 },
        "film": { "width": 72, "height": 72, "filter": { "type": "box" } },
        "integrator": { "type": "path", "max_depth": 6, "roulette": "auto" },
        "materials": {
            "white": { "type": "diffuse", "albedo": 0.7 }, "mirror": { "type": "mirror" },
            "glass": { "type": "thin_dielectric" }, "car": { "type": "plastic", "albedo": [0.6, 0.3, 0.2] }
        },
        "lights": [
            { "type": "environment", "radiance": [1, 1.2, 1.6] },
            { "type": "directional", "direction": [1, -0.5, -0.2], "irradiance": [9, 8, 6] },
            { "type": "directional", "direction": [1, -1, 0.3], "irradiance": [3, 2, 2],
              "angular_diameter_degrees": 20 }
        ],
        "shapes": [
            quad("white", [-2.0, 0.0, 4.0], [4.0, 0.0, 0.0], [0.0, 0.0, -6.0]),
            quad("white", [-2.0, 3.0, 4.0], [4.0, 0.0, 0.0], [0.0, 0.0, -6.0]),
            quad("white", [-2.0, 0.0, -2.0], [4.0, 0.0, 0.0], [0.0, 3.0, 0.0]),
            quad("white", [-2.0, 0.0, 4.0], [4.0, 0.0, 0.0], [0.0, 3.0, 0.0]),
            quad("white", [2.0, 0.0, -2.0], [0.0, 0.0, 6.0], [0.0, 3.0, 0.0]),
            quad("white", [-2.0, 0.0, -2.0], [0.0, 0.0, 6.0], [0.0, 1.0, 0.0]),
            quad("white", [-2.0, 2.0, -2.0], [0.0, 0.0, 6.0], [0.0, 1.0, 0.0]),
            quad("white", [-2.0, 1.0, -2.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]),
            quad("white", [-2.0, 1.0, 0.5], [0.0, 0.0, 3.5], [0.0, 1.0, 0.0]),
            quad("glass", [-2.0, 1.0, -1.0], [0.0, 0.0, 0.7], [0.0, 1.0, 0.0]),
            quad("mirror", [-0.5, 1.0, -1.9], [1.0, 0.0, 0.2], [0.0, 1.0, 0.0]),
            { "type": "sphere", "material": "car", "radius": 0.5, "transform": [{ "translate": [-0.5, 0.5, 0.3] }] }
        ]
    })
}

fn of(scene: &Value, bidirectional: impl Into<AutoDesc>, overrides: &Overrides) -> Image {
    let overrides = Overrides { bidirectional: Some(bidirectional.into()), ..overrides.clone() };
    render_with(&prepare(scene, &overrides), AccelKind::EMBREE).image
}

fn of_seed(scene: &Value, bidirectional: impl Into<AutoDesc>, seed: u64, spp: u32) -> Image {
    of(scene, bidirectional, &Overrides { seed: Some(seed), spp: Some(spp), ..Overrides::default() })
}

/// By Welch's test on blocks of pixels: a wrong density or weight of any strategy would be seen.
#[test]
fn light_paths_and_paths_have_the_same_mean() {
    let scenes = [
        ("plain", plain()),
        ("hidden lamp", hidden_lamp()),
        ("smooth facets", smooth_facets()),
        ("glossy", glossy()),
        ("window", window()),
    ];
    for (what, scene) in scenes {
        let blocks = |bidirectional, first: u64, spp| -> Vec<Vec<f64>> {
            (first..first + 8).map(|seed| block_means(&of_seed(&scene, bidirectional, seed, spp))).collect()
        };
        assert_blocks_agree(&blocks(true, 0, 64), &blocks(false, 100, 256), what);
    }
}

/// Two renders differ by twice the variance of one.
#[test]
fn light_paths_lower_the_error_of_indirect_light() {
    let difference = |bidirectional| {
        let [a, b] = [1, 2].map(|seed| of_seed(&plain(), bidirectional, seed, 32));
        let (a, b) = (a.layer(LayerKind::Color).unwrap(), b.layer(LayerKind::Color).unwrap());
        a.data.iter().zip(&b.data).map(|(a, b)| f64::from(a - b).powi(2) / (f64::from(*b).powi(2) + 0.01)).sum::<f64>()
    };
    let (connected, paths) = (difference(true), difference(false));
    assert!(connected < 0.6 * paths, "{connected} {paths}");
}

/// Light that is scattered once comes by no connection, whatever the longest path.
#[test]
fn short_paths_are_those_of_paths() {
    let direct = |bidirectional| of(&plain(), bidirectional, &Overrides { max_depth: Some(2), ..Overrides::default() });
    assert_eq!(direct(true), direct(false));
}

/// Densities per area grow and shrink with the fourth power of the scale, weights do not.
#[test]
fn weights_do_not_depend_on_the_unit_of_length() {
    let mean = |unit: f64| {
        let mut scene = plain();
        let scale = |value: &mut Value| {
            for x in value.as_array_mut().unwrap() {
                *x = json!(x.as_f64().unwrap() * unit);
            }
        };
        ["position", "look_at"].into_iter().for_each(|key| scale(&mut scene["camera"][key]));
        for shape in scene["shapes"].as_array_mut().unwrap() {
            ["origin", "edge_u", "edge_v"].into_iter().for_each(|key| scale(&mut shape[key]));
        }
        let prepared =
            prepare(&scene, &Overrides { bidirectional: Some(AutoDesc::On), spp: Some(8), ..Overrides::default() });
        let result = render_with(&prepared, AccelKind::EMBREE);
        assert_eq!(result.stats.nan_samples, 0, "{unit}");
        let blocks = block_means(&result.image);
        blocks.iter().sum::<f64>() / blocks.len() as f64
    };
    let expected = mean(1.0);
    // Powers of two: the same paths, up to the distances that rays keep from surfaces.
    for unit in [2f64.powi(-20), 2f64.powi(20)] {
        let found = mean(unit);
        assert!((found / expected - 1.0).abs() < 1e-3, "{unit}: {found} for {expected}");
    }
}

#[test]
fn bidirectional_pictures_do_not_depend_on_threads() {
    let image =
        |threads| of(&glossy(), true, &Overrides { threads: Some(threads), spp: Some(12), ..Overrides::default() });
    let first = image(1);
    assert!([2, 3].into_iter().all(|threads| image(threads) == first));
    assert_ne!(first, of_seed(&glossy(), false, 0, 12));
}

#[test]
fn bidirectional_renders_are_resumed_split_and_replayed() {
    let overrides =
        Overrides { bidirectional: Some(AutoDesc::On), spp: Some(21), threads: Some(2), ..Overrides::default() };
    assert_resumed_split_and_replayed(&plain(), &overrides);
}

/// Light AOVs and light groups add up to the picture.
#[test]
fn layers_of_bidirectional_pictures_sum_to_them() {
    for (what, mut scene) in [("plain", plain()), ("glossy", glossy())] {
        scene["integrator"]["bidirectional"] = json!(true);
        assert_sums(&full_of(&scene), what);
    }
}

/// A square that faces a lamp: all light is direct.
fn without_indirect_light() -> Value {
    let mut scene = plain();
    scene["shapes"] = json!([
        { "type": "quad", "material": "white", "origin": [-3, 0, 3], "edge_u": [6, 0, 0], "edge_v": [0, 0, -6] },
        { "type": "quad", "material": "white", "origin": [-1, 3, -1], "edge_u": [2, 0, 0], "edge_v": [0, 0, 2],
          "emission": { "radiance": [20, 18, 14] } }
    ]);
    scene
}

/// Within a sphere that emits as much as it absorbs, where paths have no noise.
fn furnace() -> Value {
    let mut scene = plain();
    scene["materials"]["white"]["albedo"] = json!(0.5);
    scene["shapes"] = json!([{
        "type": "sphere", "radius": 5, "material": "white",
        "emission": { "radiance": [0.5, 0.5, 0.5], "two_sided": true }
    }]);
    scene["integrator"] = json!({ "type": "path", "max_depth": 3, "rr_depth": 100 });
    scene
}

#[test]
fn a_pilot_decides_where_light_paths_are_worth_their_time() {
    for (scene, is_worth_it) in [(plain(), true), (without_indirect_light(), false), (furnace(), false)] {
        let [auto, on, off] =
            [AutoDesc::Auto, AutoDesc::On, AutoDesc::Off].map(|choice| of_seed(&scene, choice, 0, 16));
        assert!(on != off);
        assert!(auto == if is_worth_it { on } else { off });
        // So few samples are not worth a pilot.
        let [auto, off] = [AutoDesc::Auto, AutoDesc::Off].map(|choice| of_seed(&scene, choice, 0, 15));
        assert!(auto == off);
    }
}

#[test]
fn renders_are_resumed_split_and_replayed_after_a_pilot() {
    let overrides = Overrides { bidirectional: Some(AutoDesc::Auto), spp: Some(21), ..Overrides::default() };
    assert_resumed_split_and_replayed(&plain(), &overrides);
}

#[test]
fn what_light_paths_cannot_do_is_refused() {
    let refusal = |scene: &Value, overrides: &Overrides| {
        let desc = serde_json::from_value(scene.clone()).unwrap();
        match render::Settings::new(&desc, overrides) {
            Err(Error::Setting { message, .. }) => message,
            other => panic!("{other:?}"),
        }
    };
    let on = Overrides { bidirectional: Some(AutoDesc::On), ..Overrides::default() };
    for (overrides, option) in [
        (Overrides { target_error: Some(0.01), ..on.clone() }, "`target_error`"),
        (Overrides { guiding: Some(AutoDesc::On), ..on.clone() }, "`guiding`"),
        (Overrides { regularize: Some(0.1), ..on.clone() }, "`regularize`"),
        (Overrides { caustics: Some(CausticsDesc::Photons), ..on.clone() }, "`caustics`"),
    ] {
        let desc = serde_json::from_value(plain()).unwrap();
        let auto = Overrides { bidirectional: Some(AutoDesc::Auto), ..overrides.clone() };
        assert!(render::Settings::new(&desc, &auto).is_ok(), "{option}");
        let message = refusal(&plain(), &overrides);
        assert!(message.starts_with("`bidirectional`") && message.contains(option), "{message}");
    }
    let mut normals = plain();
    normals["integrator"] = json!({ "type": "normal" });
    assert!(refusal(&normals, &on).starts_with("`bidirectional`"));
}
