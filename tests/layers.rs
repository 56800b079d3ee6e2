//! Layers of the light's parts, of motion and for denoisers.

use std::f64::consts::PI;
use std::fs;
use std::path::PathBuf;

use serde_json::{Value, json};
use steradian::desc::SceneDesc;
use steradian::internal::accel::AccelKind;
use steradian::internal::film::{Image, Layer, LayerKind, LayerSet};
use steradian::internal::render::{Overrides, Settings};
use steradian::internal::{compile, import};

use crate::util::folder::set;
use crate::util::render::{
    AssertIs, Estimate, Prepared, assert_blocks_agree, block_means, merge, prepare, render_with,
};
use crate::util::root;

/// The parts of the light by how it came.
const PARTS: [LayerKind; 10] = [
    LayerKind::DiffuseDirect,
    LayerKind::DiffuseIndirect,
    LayerKind::SpecularDirect,
    LayerKind::SpecularIndirect,
    LayerKind::TransmissionDirect,
    LayerKind::TransmissionIndirect,
    LayerKind::VolumeDirect,
    LayerKind::VolumeIndirect,
    LayerKind::Emission,
    LayerKind::Background,
];

fn full(mut prepared: Prepared) -> Image {
    prepared.settings.layers = LayerSet::FULL;
    let result = render_with(&prepared, AccelKind::EMBREE);
    assert_eq!(result.stats.nan_samples, 0);
    result.image
}

pub fn full_of(scene: &Value) -> Image {
    full(prepare(scene, &Overrides { threads: Some(2), ..Overrides::default() }))
}

/// A channel of a part as a picture of its own.
fn as_color(layer: &Layer, size: [u32; 2]) -> Image {
    Image::of_color(size, layer.pixels().flat_map(|p| [p[0], p[1], p[2], 1.0]).collect())
}

fn part(image: &Image, kind: LayerKind, channel: usize) -> Estimate {
    Estimate::of(&as_color(image.layer(kind).unwrap(), image.size), channel)
}

fn groups(image: &Image) -> Vec<&Layer> {
    image.layers.iter().filter(|layer| layer.kind == LayerKind::LightGroups).collect()
}

/// Asserts that layers sum to the picture. A sample adds up its light and each of its parts in 32 bits, some dozens of
/// terms in different orders, each with a rounding of 6e-8 of what it has so far: 1e-5 of all that the pixel's parts
/// have is ten times what was found.
#[track_caller]
fn assert_sum(image: &Image, layers: &[&Layer], what: &str) {
    let color = image.layer(LayerKind::Color).unwrap();
    let mut lit = 0;
    for (i, pixel) in color.pixels().enumerate() {
        for (channel, &expected) in pixel[..3].iter().enumerate() {
            let terms = layers.iter().map(|layer| f64::from(layer.data[3 * i + channel]));
            let (sum, size) = terms.fold((0.0, 0.0), |(sum, size), term| (sum + term, size + f64::abs(term)));
            let expected = f64::from(expected);
            assert!(
                (sum - expected).abs() <= 1e-5 * size.max(expected.abs()) + 1e-9,
                "{what}, pixel {i}: {sum} for {expected}"
            );
            lit += usize::from(size > 0.0);
        }
    }
    assert!(lit > 100, "{what} is dark");
}

#[track_caller]
pub fn assert_sums(image: &Image, what: &str) {
    let parts: Vec<&Layer> = PARTS.iter().map(|&kind| image.layer(kind).unwrap()).collect();
    assert_sum(image, &parts, what);
    assert_sum(image, &groups(image), what);
}

fn gallery(name: &str) -> (SceneDesc, PathBuf) {
    let path = root().join("scenes").join(name).with_extension("json");
    (import::load_scene(&path).unwrap(), path)
}

fn small(spp: u32) -> Overrides {
    Overrides { spp: Some(spp), size: Some([40, 40]), threads: Some(2), ..Overrides::default() }
}

#[test]
fn parts_and_groups_sum_to_the_picture_in_every_scene() {
    let folder = root().join("scenes");
    let mut names: Vec<PathBuf> = fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    // The mesh of the scan is not part of the repository.
    names.retain(|path| path.extension().is_some_and(|e| e == "json") && !path.ends_with("scan.json"));
    for path in names {
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        let (desc, path) = gallery(&name);
        let settings = Settings::new(&desc, &small(2)).unwrap();
        let scene = compile::compile(&desc, &path).unwrap();
        assert_sums(&full(Prepared { scene, settings }), &name);
    }
}

#[test]
fn parts_and_groups_sum_to_the_picture_whatever_the_integrator_does() {
    let cases: [(&str, &[(&str, Value)]); 9] = [
        ("glassware", &[("integrator.clamp", json!(0.5))]),
        ("cornell", &[("integrator.guiding", json!(true)), ("integrator.clamp", json!(0.8))]),
        ("cornell", &[("integrator.strategy", json!("bsdf"))]),
        ("shapes", &[("integrator.strategy", json!("light"))]),
        ("classic", &[("integrator.hide_emitters", json!(true))]),
        ("principled", &[("integrator.rr_depth", json!(1)), ("integrator.clamp", json!(2.0))]),
        ("glass", &[("integrator.rr_depth", json!(1))]),
        ("classic", &[("integrator", json!({ "type": "whitted", "ambient": [0.2, 0.3, 0.4] }))]),
        ("textures", &[("integrator", json!({ "type": "ambient_occlusion" }))]),
    ];
    for (name, changes) in cases {
        let (desc, path) = gallery(name);
        let mut scene = serde_json::to_value(&desc).unwrap();
        for (key, value) in changes {
            // The shorthand of keys that are not of this integrator.
            if key.starts_with("integrator.") && scene["integrator"]["type"] != json!("path") {
                scene["integrator"] = json!({ "type": "path" });
            }
            set(&mut scene, key, value.clone());
        }
        // Two suns and a sky in groups of their own.
        let lights = json!([
            {
                "type": "directional", "direction": [0.2, -1, 0.3], "irradiance": [1, 2, 3],
                "angular_diameter_degrees": 20, "group": "sun"
            },
            {
                "type": "directional", "direction": [-0.2, -1, 0.3], "irradiance": [3, 2, 1],
                "angular_diameter_degrees": 30
            },
            { "type": "environment", "radiance": [0.2, 0.1, 0.3], "group": "sky" }
        ]);
        scene["lights"] = lights;
        let desc: SceneDesc = serde_json::from_value(scene).unwrap();
        let settings = Settings::new(&desc, &small(4)).unwrap();
        let image = full(Prepared { scene: compile::compile(&desc, &path).unwrap(), settings });
        let names: Vec<_> = groups(&image).iter().map(|layer| layer.group.clone().unwrap()).collect();
        assert!(names.len() >= 3 && names.last().unwrap() == "default", "{names:?}");
        assert_sums(&image, &format!("{name} with {changes:?}"));
    }
}

/// A view from the middle of a sphere that emits light, or of things before a sky.
fn room(rest: Value) -> Value {
    let mut scene = json!({
        "camera": { "position": [0, 0, 4], "look_at": [0, 0, 0], "vertical_fov_degrees": 10 },
        "film": { "width": 24, "height": 24, "filter": { "type": "box" } },
        "sampler": { "type": "independent", "spp": 256 },
        "integrator": { "type": "path", "max_depth": 4, "rr_depth": 100 },
        "materials": { "m": { "type": "diffuse", "albedo": [0.8, 0.5, 0.2] } }
    });
    merge(&mut scene, rest);
    scene
}

const ALBEDO: [f64; 3] = [0.8, 0.5, 0.2];

#[test]
fn a_furnace_parts_light_by_bounces() {
    // Within a sphere of albedo a and radiance 1: 1 is seen, a is scattered once, a² + a³ more often on at most 4
    // segments.
    let shapes = json!([{
        "type": "sphere", "radius": 10, "material": "m", "reverse_normal": true,
        "emission": { "radiance": [1, 1, 1], "group": "walls" }
    }]);
    for strategy in ["mis", "bsdf"] {
        let scene = room(json!({ "integrator": { "strategy": strategy }, "shapes": shapes }));
        let image = full_of(&scene);
        for (channel, a) in ALBEDO.into_iter().enumerate() {
            part(&image, LayerKind::Emission, channel).assert_is(1.0, "emission");
            part(&image, LayerKind::DiffuseDirect, channel).assert_is(a, strategy);
            part(&image, LayerKind::DiffuseIndirect, channel).assert_is(a * a + a * a * a, strategy);
            for kind in [LayerKind::SpecularDirect, LayerKind::TransmissionDirect, LayerKind::Background] {
                part(&image, kind, channel).assert_is(0.0, strategy);
            }
        }
        assert_eq!(
            groups(&image)[0].pixels().next(),
            image.layer(LayerKind::Color).unwrap().pixels().next().map(|p| &p[..3])
        );
        assert!(groups(&image)[1].data.iter().all(|value| *value == 0.0));
    }
}

#[test]
fn a_pane_parts_reflection_from_transmission() {
    // At right angles, R = 0.04 at each face, 2 R / (1 + R) = 1 / 13 with all reflections in between.
    let scene = room(json!({
        "camera": { "type": "orthographic", "view_height": 1 },
        "materials": { "pane": { "type": "thin_dielectric", "ior": 1.5 } },
        "shapes": [
            { "type": "quad", "material": "pane" },
            { "type": "quad", "material": "m", "transform": [{ "translate": [0, 0, -1] }] }
        ],
        "lights": [{ "type": "environment", "radiance": [0.5, 0.5, 0.5] }]
    }));
    let mut scene = scene;
    scene["camera"].as_object_mut().unwrap().remove("vertical_fov_degrees");
    let image = full_of(&scene);
    let reflected = 1.0 / 13.0;
    for (channel, a) in ALBEDO.into_iter().enumerate() {
        part(&image, LayerKind::SpecularDirect, channel).assert_is(0.5 * reflected, "specular");
        part(&image, LayerKind::TransmissionDirect, channel).assert_is(0.0, "nothing but the wall is behind");
        part(&image, LayerKind::DiffuseDirect, channel).assert_is(0.0, "the wall is not seen first");
        // Denoisers see the wall through the pane, and the sky in it, and on the average its normal.
        let albedo = (1.0 - reflected) * a + reflected * 0.5;
        part(&image, LayerKind::FeatureAlbedo, channel).assert_is(albedo, "feature albedo");
        let normal = [0.0, 0.0, 1.0 - reflected][channel];
        part(&image, LayerKind::FeatureNormal, channel).assert_is(normal, "feature normal");
        part(&image, LayerKind::Albedo, channel).assert_is(1.0, "albedo of the pane");
    }
    assert!(part(&image, LayerKind::TransmissionIndirect, 0).mean > 0.1);
}

#[test]
fn highlights_and_what_is_below_are_parted_by_their_lobes() {
    // A flat floor under a white sky: each lobe gives what it scatters of all directions, which the same floor without
    // base shows alone.
    for material in [
        json!({ "type": "plastic", "albedo": [0.8, 0.5, 0.2], "roughness": 0.4 }),
        json!({ "type": "phong", "diffuse": [0.6, 0.5, 0.2], "specular": [0.3, 0.3, 0.3], "exponent": 20 }),
        json!({
            "type": "phong", "diffuse": [0.6, 0.5, 0.2], "specular": [0.3, 0.3, 0.3], "exponent": 20, "lobe": "cosine"
        }),
        json!({ "type": "plastic", "albedo": [0.8, 0.5, 0.2] }),
    ] {
        let floor = |material: Value| {
            full_of(&room(json!({
                "camera": { "position": [0, 2, 4], "vertical_fov_degrees": 1 }, "materials": { "floor": material },
                "shapes": [{
                    "type": "quad", "material": "floor", "origin": [-9, 0, 9], "edge_u": [18, 0, 0],
                    "edge_v": [0, 0, -18]
                }],
                "lights": [{ "type": "environment", "radiance": [1, 1, 1] }]
            })))
        };
        let mut black = material.clone();
        let base = if material["type"] == "phong" { "diffuse" } else { "albedo" };
        black[base] = json!([0.0, 0.0, 0.0]);
        let (whole, specular) = (floor(material.clone()), floor(black));
        for channel in 0..3 {
            let alone = Estimate::of(&specular, channel);
            let split = part(&whole, LayerKind::SpecularDirect, channel);
            let difference = Estimate { mean: split.mean - alone.mean, error: split.error.hypot(alone.error) };
            difference.assert_is(0.0, &format!("{material}"));
            assert!(split.mean > 0.01 && part(&whole, LayerKind::DiffuseDirect, channel).mean > 0.1, "{material}");
            part(&whole, LayerKind::SpecularIndirect, channel).assert_is(0.0, "a flat floor");
        }
    }
}

/// A room with a mirror ball, lit by a lamp of each group that is given.
fn two_lamps(names: &[&str], integrator: Value) -> Value {
    let mut lights = Vec::new();
    let mut lamp = |name: &str, light: Value| {
        if names.contains(&name) {
            let mut light = light;
            light["group"] = json!(name);
            lights.push(light);
        }
    };
    lamp("key", json!({ "type": "point", "position": [3, 4, 2], "intensity": [20, 15, 10] }));
    lamp("fill", json!({ "type": "point", "position": [-4, 2, 3], "intensity": [3, 4, 8] }));
    room(json!({
        "camera": { "position": [0, 5, 4], "vertical_fov_degrees": 30 },
        "integrator": integrator,
        "materials": { "mirror": { "type": "mirror", "reflectance": [0.9, 0.8, 0.7] } },
        "shapes": [
            { "type": "quad", "material": "m", "origin": [-9, -1, 9], "edge_u": [18, 0, 0], "edge_v": [0, 0, -18] },
            { "type": "sphere", "material": "mirror", "radius": 0.8 }
        ],
        "lights": lights
    }))
}

#[test]
fn groups_show_what_their_lights_alone_give() {
    // Whitted's method samples every light: the very sums.
    let whitted = || json!({ "type": "whitted", "max_depth": 4, "rr_depth": null });
    let of = |names: &[&str]| {
        let mut scene = two_lamps(names, whitted());
        scene["integrator"].as_object_mut().unwrap().remove("rr_depth");
        full_of(&scene)
    };
    let both = of(&["key", "fill"]);
    for name in ["key", "fill"] {
        let alone = of(&[name]);
        let group = *groups(&both).iter().find(|layer| layer.group.as_deref() == Some(name)).unwrap();
        let pairs = group.pixels().zip(alone.layer(LayerKind::Color).unwrap().pixels());
        for (found, expected) in pairs {
            assert!(
                (0..3).all(|c| (found[c] - expected[c]).abs() <= 2e-6 * expected[c]),
                "{name}: {found:?} {expected:?}"
            );
        }
    }
    // Paths choose among lights: by Welch's test on blocks of pixels.
    let blocks = |names: &[&str], seed: u64, layer: Option<&str>| -> Vec<f64> {
        let mut scene = two_lamps(names, json!({}));
        merge(&mut scene, json!({ "sampler": { "spp": 32, "seed": seed } }));
        let image = full_of(&scene);
        match layer {
            None => block_means(&image),
            Some(name) => {
                let group = *groups(&image).iter().find(|layer| layer.group.as_deref() == Some(name)).unwrap();
                block_means(&as_color(group, image.size))
            }
        }
    };
    for name in ["key", "fill"] {
        let grouped: Vec<_> = (0..8).map(|seed| blocks(&["key", "fill"], seed, Some(name))).collect();
        let alone: Vec<_> = (0..8).map(|seed| blocks(&[name], 100 + seed, None)).collect();
        assert_blocks_agree(&grouped, &alone, name);
    }
}

#[test]
fn denoisers_see_what_is_in_mirrors() {
    let tint = [0.5, 0.8, 1.0];
    // A mirror at 45 degrees that shows a wall to the left, and nothing above it.
    let shapes = json!([
        { "type": "quad", "material": "mirror", "origin": [-2, -2, -2], "edge_u": [4, 0, 4], "edge_v": [0, 4, 0] },
        { "type": "quad", "material": "m", "origin": [-5, -5, -9], "edge_u": [0, 0, 18], "edge_v": [0, 5, 0] }
    ]);
    let scene = room(json!({
        "camera": { "position": [0, 0, 40], "vertical_fov_degrees": 1 },
        "materials": { "mirror": { "type": "mirror", "reflectance": tint } },
        "shapes": shapes,
        "lights": [{ "type": "environment", "radiance": [0.25, 3.0, 0.0] }]
    }));
    let image = full_of(&scene);
    let at =
        |kind: LayerKind, y: u32| image.pixel(kind, 12, y).unwrap().iter().map(|v| f64::from(*v)).collect::<Vec<_>>();
    let close = |found: Vec<f64>, expected: [f64; 3]| found.iter().zip(expected).all(|(f, e)| (f - e).abs() < 1e-5);
    // Below, the wall; above, the sky, as far as it is not brighter than white.
    assert!(
        close(at(LayerKind::FeatureAlbedo, 20), [0, 1, 2].map(|c| tint[c] * ALBEDO[c])),
        "{:?}",
        at(LayerKind::FeatureAlbedo, 20)
    );
    assert!(close(at(LayerKind::FeatureNormal, 20), [-1.0, 0.0, 0.0]), "{:?}", at(LayerKind::FeatureNormal, 20));
    assert!(close(at(LayerKind::FeatureAlbedo, 2), [0.125, 0.8, 0.0]), "{:?}", at(LayerKind::FeatureAlbedo, 2));
    assert!(close(at(LayerKind::FeatureNormal, 2), [0.0; 3]));
    assert!(close(at(LayerKind::Albedo, 20), tint) && at(LayerKind::N, 20)[0] < -0.7);
}

#[test]
fn motion_is_that_of_things_and_of_the_camera() {
    // 24 pixels for 2 units: 12 to the unit.
    let ahead = |camera: Value, shape: Value| {
        let mut scene = room(json!({ "camera": { "type": "orthographic", "view_height": 2 }, "shapes": [shape],
            "lights": [{ "type": "environment", "radiance": [1, 1, 1] }] }));
        scene["camera"].as_object_mut().unwrap().remove("vertical_fov_degrees");
        merge(&mut scene["camera"], camera);
        let image = full_of(&scene);
        image.layer(LayerKind::Motion).unwrap().pixels().map(|p| [p[0], p[1]]).collect::<Vec<_>>()
    };
    let is = |found: &[[f32; 2]], expected: [f32; 2]| {
        assert!(found.iter().all(|p| (0..2).all(|k| (p[k] - expected[k]).abs() < 1e-3)), "{found:?} for {expected:?}");
    };
    let large = |motion: Value| {
        json!({
            "type": "quad", "origin": [-9, -9, 0], "edge_u": [18, 0, 0], "edge_v": [0, 18, 0], "motion": motion
        })
    };
    let slide = json!([{ "time": 0 }, { "time": 1, "transform": [{ "translate": [0.5, 0.25, 0] }] }]);
    is(&ahead(json!({}), large(json!([]))), [0.0, 0.0]);
    is(&ahead(json!({}), large(slide.clone())), [6.0, -3.0]);
    // Half of the shutter is half of the way.
    is(&ahead(json!({ "shutter": [0.25, 0.75] }), large(slide.clone())), [3.0, -1.5]);
    is(&ahead(json!({ "motion": slide }), large(json!([]))), [-6.0, 3.0]);

    // What a camera that turns sees at infinity goes the other way.
    let mut scene = room(json!({
        "camera": {
            "motion": [{ "time": 0 }, { "time": 1, "transform": [{ "rotate": { "axis": [0, 1, 0], "degrees": 1 } }] }]
        },
        "lights": [{ "type": "environment", "radiance": [1, 1, 1] }]
    }));
    scene["camera"]["position"] = json!([0, 0, 0]);
    scene["camera"]["look_at"] = json!([0, 0, -1]);
    let image = full_of(&scene);
    let degrees_per_pixel = 2.0 * (5.0f64 * PI / 180.0).tan() / 24.0 * 180.0 / PI;
    let middle = image.pixel(LayerKind::Motion, 12, 12).unwrap();
    assert!((f64::from(middle[0]) * degrees_per_pixel - 1.0).abs() < 0.01 && middle[1].abs() < 0.01, "{middle:?}");
}

#[test]
fn uv_are_those_of_surfaces_without_textures_too() {
    for name in ["knot", "cornell", "motion", "textures"] {
        let (desc, path) = gallery(name);
        let scene = compile::compile(&desc, &path).unwrap();
        let view = |integrator| {
            let mut overrides = small(2);
            overrides.integrator = integrator;
            full(Prepared { scene: scene.clone(), settings: Settings::new(&desc, &overrides).unwrap() })
        };
        let view_of_uv = serde_json::from_value(json!({ "type": "uv" })).unwrap();
        let (paths, uv) = (view(None), view(Some(view_of_uv)));
        assert!(paths.layer(LayerKind::Uv) == uv.layer(LayerKind::Uv), "{name}");
        assert!(paths.layer(LayerKind::Uv).unwrap().data.iter().any(|value| *value > 0.0), "{name}");
    }
}

/// A group called as that of the lights in no group is theirs: no file could hold two layers of one name.
#[test]
fn a_group_called_default_is_that_of_the_rest() {
    let image = full_of(&json!({
        "film": { "width": 16, "height": 16 },
        "camera": { "position": [0, 0, 4], "look_at": [0, 0, 0] },
        "sampler": { "spp": 2 },
        "shapes": [{ "type": "sphere", "radius": 1 }],
        "lights": [
            { "type": "point", "position": [2, 2, 2], "intensity": [5, 5, 5], "group": "default" },
            { "type": "environment", "radiance": [0.1, 0.1, 0.1] }
        ]
    }));
    let groups = groups(&image);
    assert_eq!(groups.iter().map(|layer| layer.group.as_deref()).collect::<Vec<_>>(), [Some("default")]);
    assert_sum(&image, &groups, "the only group");
}
