//! Media that scatter and emit light, against closed forms and quadratures.

use std::f64::consts::PI;

use serde_json::{Value, json};
use steradian::ErrorKind;
use steradian::internal::accel::AccelKind;
use steradian::internal::film::{Image, LayerKind, LayerSet};
use steradian::internal::render::Overrides;

use crate::bad_input::{assert_error, assert_faults};
use crate::layers::assert_sums;
use crate::util::folder::{Folder, good_scene, set};
use crate::util::render::{
    AssertIs, Estimate, assert_blocks_agree, block_means, merge, pixels, prepare, probe, render, render_with,
};

fn henyey_greenstein(g: f64) -> Value {
    json!({ "type": "henyey_greenstein", "g": g })
}

/// A ball of a medium around the origin under a white sky, seen from far away.
pub fn ball(medium: &Value) -> Value {
    probe(
        [0.3, 0.2, 5.0],
        [0.3, 0.2, 0.0],
        json!({
            "integrator": { "type": "path", "max_depth": 100_000 },
            "sampler": { "spp": 64 },
            "media": { "cloud": medium },
            "materials": { "cloud": { "type": "dielectric", "ior": 1, "medium": "cloud" } },
            "shapes": [{ "type": "sphere", "material": "cloud" }],
            "lights": [{ "type": "environment", "radiance": [1, 1, 1] }]
        }),
    )
}

#[track_caller]
pub fn assert_means(image: &Image, expected: [f64; 3], what: &str) {
    for (channel, expected) in expected.into_iter().enumerate() {
        Estimate::of(image, channel).assert_is(expected, &format!("{what}, channel {channel}"));
    }
}

#[test]
fn a_white_furnace_shows_no_ball() {
    for (scattering, phase) in [
        (json!(0.3), henyey_greenstein(0.0)),
        (json!(3), henyey_greenstein(0.8)),
        (json!(3), henyey_greenstein(-0.6)),
        (json!(12), henyey_greenstein(0.3)),
        (json!(2), json!({ "type": "rayleigh" })),
        (json!([0.2, 1.5, 7]), henyey_greenstein(0.5)),
        (json!([0, 1, 4]), json!({ "type": "isotropic" })),
    ] {
        for strategy in ["mis", "light", "bsdf"] {
            let mut scene = ball(&json!({ "scattering": scattering, "phase": phase }));
            scene["integrator"]["strategy"] = json!(strategy);
            assert_means(&render(&scene), [1.0; 3], &format!("{scattering} {phase} {strategy}"));
        }
    }
}

#[test]
fn a_white_furnace_of_glass_around_a_medium_shows_no_ball() {
    // Light keeps its radiance over the squared index, in and out.
    for strategy in ["mis", "light", "bsdf"] {
        let mut scene = ball(&json!({ "scattering": [0.5, 1, 3], "phase": henyey_greenstein(0.4) }));
        scene["integrator"]["strategy"] = json!(strategy);
        scene["materials"]["cloud"]["ior"] = json!(1.4);
        assert_means(&render(&scene), [1.0; 3], &format!("smooth glass, {strategy}"));
        scene["materials"]["cloud"]["roughness"] = json!(0.5);
        assert_means(&render(&scene), [1.0; 3], &format!("rough glass, {strategy}"));
    }
}

/// The means of blocks, by seed.
pub fn runs(scene: &Value) -> Vec<Vec<f64>> {
    let run = |seed: u64| {
        let mut scene = scene.clone();
        scene["sampler"]["seed"] = json!(seed);
        let prepared = prepare(&scene, &Overrides { threads: Some(2), ..Overrides::default() });
        block_means(&render_with(&prepared, AccelKind::EMBREE).image)
    };
    (0..8).map(run).collect()
}

#[test]
fn light_is_not_sampled_where_glass_encloses_a_medium() {
    let body = |change: Value| {
        let mut body = json!({ "type": "sphere", "material": "cloud" });
        merge(&mut body, change);
        body
    };
    let lamp = |x: f64| {
        json!({
            "type": "sphere", "radius": 0.01, "transform": { "translate": [x, 0, 0] }, "emission": { "radiance": 1 }
        })
    };
    let shadow_rays = |shapes: Value, change: Value| {
        let mut scene = ball(&json!({ "scattering": 3 }));
        scene["materials"]["cloud"]["ior"] = json!(1.4);
        scene["sampler"]["spp"] = json!(4);
        // Nothing ends a path in an infinite medium that only scatters.
        scene["integrator"]["max_depth"] = json!(32);
        scene["shapes"] = shapes;
        merge(&mut scene, change);
        let prepared = prepare(&scene, &Overrides { threads: Some(2), ..Overrides::default() });
        render_with(&prepared, AccelKind::EMBREE).stats.rays.shadow
    };
    assert_eq!(shadow_rays(json!([body(json!({})), lamp(1.5)]), json!({})), 0);
    let clear = json!({ "materials": { "clear": { "type": "dielectric", "ior": 1.4, "priority": 0 } } });
    for (shapes, change, why) in [
        (json!([body(json!({})), lamp(0.5)]), json!({}), "a lamp within"),
        (json!([body(json!({})), lamp(1.5)]), json!({ "materials": { "cloud": { "ior": 1 } } }), "no refraction"),
        (json!([body(json!({ "opacity": 0.5 })), lamp(1.5)]), json!({}), "holes"),
        (json!([body(json!({})), lamp(1.5)]), json!({ "medium": "cloud" }), "the same medium all around"),
        (
            json!([body(json!({})), body(json!({ "material": "clear" })), lamp(1.5)]),
            clear,
            "another medium of the same index",
        ),
    ] {
        assert!(shadow_rays(shapes, change) > 0, "{why}");
    }
}

#[test]
fn glass_around_a_medium_is_the_same_with_light_samples() {
    // A lamp within that does not shine noticeably: light is sampled, and all shadow rays to the other lights end at
    // the glass.
    let scene = |radiance: Option<f64>| {
        let mut scene = foggy(8);
        let lamp = json!({
            "type": "sphere", "radius": 0.01, "transform": { "translate": [-0.6, 0.5, 0] },
            "emission": { "radiance": radiance.unwrap_or_default() }
        });
        let shapes = scene["shapes"].as_array_mut().unwrap();
        shapes[1] = json!({
            "type": "sphere", "material": "milk", "radius": 0.5, "transform": { "translate": [-0.6, 0.5, 0] }
        });
        shapes.extend(radiance.map(|_| lamp));
        scene["materials"]["milk"]["roughness"] = json!(0.3);
        scene["media"]["milk"]["emission"] = json!(0);
        scene
    };
    assert_blocks_agree(&runs(&scene(None)), &runs(&scene(Some(1e-6))), "lamp within");
}

/// A slab between z = 0 and z = 1.5, seen along the axis before a white sky.
fn slab(medium: Value) -> Value {
    let mut scene = probe(
        [0.1, 0.2, 4.0],
        [0.1, 0.2, 3.0],
        json!({
            "integrator": { "type": "path", "max_depth": 1 },
            "media": { "m": medium },
            "materials": { "m": { "type": "dielectric", "ior": 1, "medium": "m" } },
            "lights": [{ "type": "environment", "radiance": [1, 1, 1] }]
        }),
    );
    scene["shapes"] = json!([{
        "type": "cube", "material": "m", "transform": [{ "scale": [20, 20, 0.75] }, { "translate": [0, 0, 0.75] }]
    }]);
    scene
}

const THICKNESS: f64 = 1.5;
const ABSORPTION: [f64; 3] = [0.2, 0.7, 1.5];
const SCATTERING: [f64; 3] = [0.9, 0.3, 0.1];

#[test]
fn paths_change_their_medium_in_holes_of_its_boundary() {
    let picture = |ior: f64, opacity: f64| {
        let medium = json!({ "absorption": ABSORPTION, "scattering": SCATTERING, "emission": 0.3 });
        let mut scene = slab(medium);
        scene["integrator"]["max_depth"] = json!(8);
        scene["lights"] = json!([{ "type": "point", "position": [0, 0, 4], "intensity": 20 }]);
        scene["materials"]["m"]["ior"] = json!(ior);
        scene["shapes"][0]["opacity"] = json!(opacity);
        render(&scene)
    };
    let plain = picture(1.0, 1.0);
    assert!(pixels(&plain).all(|pixel| pixel[0] > 0.1));
    assert!(picture(1.0, 0.5) == plain);
    // Glass that is all hole refracts nothing.
    assert!(picture(1.5, 0.0) == plain);
}

#[test]
fn what_passes_straight_is_beer_and_lamberts() {
    let scene = slab(json!({ "absorption": ABSORPTION }));
    let image = render(&scene);
    for (channel, a) in ABSORPTION.into_iter().enumerate() {
        let expected = (-a * THICKNESS).exp();
        let off = pixels(&image).map(|p| (f64::from(p[channel]) / expected - 1.0).abs()).fold(0.0, f64::max);
        assert!(off < 1e-5, "channel {channel}: {off}");
    }
    // With scattering, by chance: what is scattered is not seen at this depth.
    let scene = slab(json!({ "absorption": ABSORPTION, "scattering": SCATTERING }));
    let expected = [0, 1, 2].map(|c| (-(ABSORPTION[c] + SCATTERING[c]) * THICKNESS).exp());
    assert_means(&render(&scene), expected, "extinction");
}

#[test]
fn what_a_slab_gives_off_is_its_integral() {
    for scattering in [[0.0; 3], SCATTERING] {
        let emission = [0.5, 2.0, 1.0];
        let mut scene = slab(json!({ "absorption": ABSORPTION, "scattering": scattering, "emission": emission }));
        scene["lights"] = json!([]);
        let expected = [0, 1, 2].map(|c| {
            let extinction = ABSORPTION[c] + scattering[c];
            emission[c] * (1.0 - (-extinction * THICKNESS).exp()) / extinction
        });
        assert_means(&render(&scene), expected, "emission");
    }
    let mut scene = slab(json!({ "emission": [0.5, 2, 1] }));
    scene["lights"] = json!([]);
    assert_means(&render(&scene), [0.75, 3.0, 1.5], "emission alone");
}

/// Integral over `[0, 1]` by Simpson's rule.
pub fn integral(f: impl Fn(f64) -> f64) -> f64 {
    let n = 20_000;
    let weight = |i: i32| if i == 0 || i == n { 1.0 } else { f64::from(2 + 2 * (i % 2)) };
    (0..=n).map(|i| weight(i) * f(f64::from(i) / f64::from(n))).sum::<f64>() / (3.0 * f64::from(n))
}

/// Henyey and Greenstein's function of the cosine of the deflection.
pub fn hg(g: f64, cos: f64) -> f64 {
    (1.0 - g * g) / (4.0 * PI * (1.0 + g * g - 2.0 * g * cos).powf(1.5))
}

fn rayleigh(cos: f64) -> f64 {
    3.0 / (16.0 * PI) * (1.0 + cos * cos)
}

#[test]
fn single_scattering_in_fog_is_the_quadrature() {
    // The camera in fog looks along -z past a point light 0.8 to the side and 2 ahead.
    let (side, ahead) = (0.8f64, 2.0f64);
    let cases: [(Value, &dyn Fn(f64) -> f64); 3] = [
        (henyey_greenstein(0.6), &|cos| hg(0.6, cos)),
        (henyey_greenstein(-0.4), &|cos| hg(-0.4, cos)),
        (json!({ "type": "rayleigh" }), &rayleigh),
    ];
    for (phase, value) in cases {
        let scene = probe(
            [0.0, 0.0, 0.0],
            [0.0, 0.0, -1.0],
            json!({
                "integrator": { "type": "path", "max_depth": 2 },
                "media": { "fog": { "absorption": ABSORPTION, "scattering": SCATTERING, "phase": phase } },
                "medium": "fog",
                "lights": [{ "type": "point", "position": [side, 0, -ahead], "intensity": [2, 2, 2] }]
            }),
        );
        let expected = [0, 1, 2].map(|c| {
            let extinction = ABSORPTION[c] + SCATTERING[c];
            // t = x / (1 - x).
            integral(|x| {
                if x >= 1.0 {
                    return 0.0;
                }
                let t = x / (1.0 - x);
                let (along, r) = (t - ahead, ((t - ahead).powi(2) + side * side).sqrt());
                // Light comes from the light to the point, and goes on towards the camera.
                let cos = -along / r;
                let light = 2.0 / (r * r) * (-extinction * (r + t)).exp();
                SCATTERING[c] * value(cos) * light / (1.0 - x).powi(2)
            })
        });
        assert_means(&render(&scene), expected, &format!("{phase}"));
    }
}

#[test]
fn single_scattering_in_a_slab_passes_its_boundaries() {
    // Light comes down through the slab's face, which bends nothing, and leaves it again; a distant light is a delta,
    // so only shadow rays through the boundary find it.
    let (g, cos) = (0.3, 0.8f64);
    let sin = (1.0 - cos * cos).sqrt();
    for angle in [0.0, 1.0] {
        let mut scene =
            slab(json!({ "absorption": ABSORPTION, "scattering": SCATTERING, "phase": henyey_greenstein(g) }));
        scene["integrator"]["max_depth"] = json!(2);
        scene["lights"] = json!([{
            "type": "directional", "direction": [sin, 0, -cos], "irradiance": [3, 3, 3],
            "angular_diameter_degrees": angle
        }]);
        let expected = [0, 1, 2].map(|c| {
            let extinction = ABSORPTION[c] + SCATTERING[c];
            // In at depth d / cos, deflected by the angle between (sin, 0, -cos) and (0, 0, 1), out at depth d.
            let rate = extinction * (1.0 + 1.0 / cos);
            SCATTERING[c] * hg(g, -cos) * 3.0 * (1.0 - (-rate * THICKNESS).exp()) / rate
        });
        let image = render(&scene);
        for (channel, expected) in expected.into_iter().enumerate() {
            let found = Estimate::of(&image, channel);
            // A disk of half a degree around is not quite its middle.
            let bound = 5.5 * found.error + if angle > 0.0 { 2e-4 } else { 1e-5 } * expected;
            assert!((found.mean - expected).abs() < bound, "{angle}, channel {channel}: {found:?} {expected}");
        }
    }
}

#[test]
fn the_point_of_highest_priority_decides_what_scatters() {
    // An empty ball within a ball of a medium, and one of another medium within it, of albedo 1: still a furnace; and
    // the layer of what passes straight knows the lengths.
    let mut scene = ball(&json!({ "scattering": [1, 2, 3] }));
    merge(
        &mut scene,
        json!({
            "camera": { "position": [0, 0, 5], "look_at": [0, 0, 0] },
            "media": { "inner": { "absorption": [0.5, 0.2, 0.1] } },
            "materials": { "inner": { "type": "dielectric", "ior": 1, "medium": "inner", "priority": 1 } }
        }),
    );
    scene["shapes"].as_array_mut().unwrap().push(json!({ "type": "sphere", "material": "inner", "radius": 0.5 }));
    scene["integrator"]["max_depth"] = json!(1);
    let absorption = [0.5, 0.2, 0.1];
    let expected = [0, 1, 2].map(|c| (-(c as f64 + 1.0) - absorption[c]).exp());
    assert_means(&render(&scene), expected, "straight");
}

/// Fog in a box with a lamp, a ball of milk in glass, smoke and a floor.
pub fn foggy(max_depth: u32) -> Value {
    json!({
        "film": { "width": 36, "height": 36, "filter": { "type": "box" } },
        "camera": { "position": [0, 1.2, 4], "look_at": [0, 0.6, 0] },
        "sampler": { "spp": 16 },
        "integrator": { "type": "path", "max_depth": max_depth },
        "media": {
            "fog": { "scattering": [0.1, 0.12, 0.15], "absorption": 0.01, "phase": henyey_greenstein(0.5) },
            "milk": { "scattering": [4, 3, 2], "absorption": [0.01, 0.05, 0.1], "emission": [0, 0, 0.2] },
            "smoke": {
                "scattering": [9, 7, 5], "absorption": 1, "emission": [0.3, 0.1, 0],
                "phase": {
                    "type": "mix", "phases": [henyey_greenstein(0.6), { "type": "rayleigh" }], "weights": [2, 1]
                },
                "volume": {
                    "density": { "type": "noise", "resolution": [16, 12, 9], "frequency": [2, 2, 2] },
                    "bounds": [[0.4, 0.1, -0.6], [1, 0.7, 0]]
                }
            }
        },
        "medium": "fog",
        "materials": {
            "grey": { "type": "diffuse" },
            "milk": { "type": "dielectric", "ior": 1.3, "medium": "milk" },
            "cloud": { "type": "dielectric", "ior": 1, "medium": "smoke", "priority": -1 }
        },
        "shapes": [
            { "type": "quad", "material": "grey", "origin": [-4, 0, 4], "edge_u": [8, 0, 0], "edge_v": [0, 0, -8] },
            { "type": "sphere", "material": "milk", "radius": 0.5, "transform": [{ "translate": [-0.6, 0.5, 0] }] },
            { "type": "cube", "material": "cloud", "transform": [{ "scale": 0.3 }, { "translate": [0.7, 0.4, -0.3] }] },
            { "type": "disk", "emission": { "radiance": [9, 8, 7], "group": "key" },
              "transform": [{ "rotate": { "axis": [1, 0, 0], "degrees": 90 } }, { "translate": [0, 3, 0] }] }
        ],
        "lights": [{ "type": "point", "position": [2, 3, 1], "intensity": [3, 2, 1], "group": "fill" }]
    })
}

fn full(scene: &Value, threads: u32, kind: AccelKind) -> Image {
    let mut prepared = prepare(scene, &Overrides { threads: Some(threads as usize), ..Overrides::default() });
    prepared.settings.layers = LayerSet::FULL;
    let result = render_with(&prepared, kind);
    assert_eq!(result.stats.nan_samples, 0);
    result.image
}

#[test]
fn any_number_of_threads_gives_the_same_bits_and_parts_sum_to_the_picture() {
    for change in [json!({}), json!({ "clamp": 0.5 }), json!({ "guiding": true }), json!({ "strategy": "bsdf" })] {
        let mut scene = foggy(12);
        merge(&mut scene["integrator"], change.clone());
        let image = full(&scene, 1, AccelKind::EMBREE);
        assert!(change["guiding"] == json!(true) || image == full(&scene, 3, AccelKind::EMBREE), "{change}");
        assert_sums(&image, &change.to_string());
        for kind in [LayerKind::VolumeDirect, LayerKind::VolumeIndirect, LayerKind::Emission] {
            assert!(image.layer(kind).unwrap().data.iter().any(|&x| x > 0.0), "{kind:?}");
        }
    }
}

#[test]
fn every_accelerator_gives_the_same_picture() {
    let runs = |kind: AccelKind| -> Vec<Vec<f64>> {
        let run = |seed: u64| {
            let mut scene = foggy(6);
            scene["sampler"]["seed"] = json!(seed);
            let prepared = prepare(&scene, &Overrides { threads: Some(2), ..Overrides::default() });
            block_means(&render_with(&prepared, kind).image)
        };
        (0..8).map(run).collect()
    };
    let embree = runs(AccelKind::EMBREE);
    for &(kind, _) in AccelKind::ALL.iter().filter(|(kind, _)| *kind != AccelKind::EMBREE) {
        assert_blocks_agree(&runs(kind), &embree, &format!("{kind:?}"));
    }
}

#[test]
fn light_scattered_once_by_fog_is_in_its_layer() {
    let mut scene = foggy(2);
    scene["shapes"] = json!([]);
    scene["lights"] = json!([{ "type": "point", "position": [2, 3, 1], "intensity": [3, 2, 1] }]);
    let image = full(&scene, 2, AccelKind::EMBREE);
    let color = image.layer(LayerKind::Color).unwrap();
    let volume = image.layer(LayerKind::VolumeDirect).unwrap();
    for (pixel, part) in color.pixels().zip(volume.pixels()) {
        assert!(pixel[0] > 0.0 && pixel[..3] == part[..3]);
    }
    // The camera sees a point of the fog in front of it, whose whole way is within 1e3.
    let depth = image.layer(LayerKind::Z).unwrap();
    assert!(depth.data.iter().all(|&z| z > 0.0 && z < 1e3));
    let coverage = image.coverage.as_ref().unwrap();
    let prepared = prepare(&scene, &Overrides::default());
    for pixel in 0..coverage.pixels() {
        let [(key, 1.0)] = coverage.of(pixel) else { panic!("{:?}", coverage.of(pixel)) };
        let identities = &prepared.scene.identities;
        assert_eq!([identities.object(*key), identities.material(*key).into(), identities.asset(*key)], ["fog"; 3]);
    }
    let alpha: Vec<f32> = color.pixels().map(|p| p[3]).collect();
    assert!(alpha.iter().all(|&a| a == 1.0));
}

#[test]
fn media_that_make_no_sense() {
    let medium = "media.fog";
    assert_faults(&[
        (medium, json!({ "scattering": -1 }), "media.fog.scattering", "-1"),
        (medium, json!({ "absorption": [1, 2, -0.5] }), "media.fog.absorption", "-0.5"),
        (medium, json!({ "emission": 1e30 }), "media.fog.emission", "1e30"),
        (medium, json!({ "phase": { "type": "henyey_greenstein", "g": 1 } }), "media.fog.phase.g", "0.99"),
        ("medium", json!("smoke"), "medium", "no medium named \"smoke\""),
        ("materials.glass.medium", json!("smoke"), "materials.glass.medium", "no medium named \"smoke\""),
    ]);
    let folder = Folder::new();
    let mut scene = good_scene();
    set(&mut scene, "media.fog", json!({ "scattering": 1 }));
    set(&mut scene, "medium", json!("fogg"));
    assert_error(&folder, &scene, ErrorKind::Scene, &["medium: ", "did you mean \"fog\"?"]);
    set(&mut scene, "medium", json!("fog"));
    folder.compile(&scene).unwrap();
    set(&mut scene, "integrator", json!({ "type": "path", "caustics": "photons" }));
    assert_error(&folder, &scene, ErrorKind::Scene, &["integrator.caustics: ", "scatter"]);
    set(&mut scene, "integrator", json!({ "type": "path" }));
    set(&mut scene, "media.fog", json!({ "scattering": [1, 0, 1], "emission": 1 }));
    assert_error(&folder, &scene, ErrorKind::Scene, &["medium: ", "emits light"]);
    set(&mut scene, "media.fog", json!({ "phase": { "type": "mie" } }));
    let error = folder.compile(&scene).err().unwrap().to_string();
    assert!(error.contains("media.fog.phase") && error.contains("mie"), "{error}");
    set(&mut scene, "media.fog", json!({ "scattering": 1 }));
    set(&mut scene, "materials.glass.absorption", json!({ "color": [0.5, 0.5, 0.5] }));
    set(&mut scene, "materials.glass.medium", json!("fog"));
    assert_error(&folder, &scene, ErrorKind::Scene, &["materials.glass.medium: ", "together"]);
}
