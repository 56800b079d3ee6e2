//! Several lights sampled at the first vertex of a path: the same mean, the same bits for any threads and parts, and
//! less error for the rays where the pilot of roulette chooses it.

use serde_json::{Value, json};
use steradian::internal::accel::AccelKind;
use steradian::internal::film::LayerKind;
use steradian::internal::light::LightSelection;
use steradian::internal::render::{Overrides, RenderResult};

use crate::checkpoints::assert_resumed_split_and_replayed;
use crate::util::render::{assert_blocks_agree, block_means, prepare, render_with};

/// A floor with balls below slats, two lamps and a sky: half of the light samples are blocked.
fn yard(integrator: Value) -> Value {
    let shape = |kind: &str| json!({ "type": kind, "material": "white" });
    let quad = |origin: [f64; 3], u: [f64; 3], v: [f64; 3]| {
        let mut quad = shape("quad");
        (quad["origin"], quad["edge_u"], quad["edge_v"]) = (json!(origin), json!(u), json!(v));
        quad
    };
    let lamp = |x: f64, radiance: [f64; 3]| {
        let mut quad = quad([x, 3.0, -1.0], [1.5, 0.0, 0.0], [0.0, 0.0, 2.0]);
        quad["emission"] = json!({ "radiance": radiance });
        quad
    };
    let ball = |x: f64, z: f64| {
        let mut ball = shape("sphere");
        (ball["radius"], ball["transform"]) = (json!(0.5), json!([{ "translate": [x, 0.5, z] }]));
        ball
    };
    let slat = |i| quad([-2.0 + 0.5 * f64::from(i), 1.6, -2.0], [0.3, 0.0, 0.0], [0.0, 0.0, 4.0]);
    let mut shapes = vec![
        quad([-4.0, 0.0, 4.0], [8.0, 0.0, 0.0], [0.0, 0.0, -8.0]),
        ball(-0.9, 0.0),
        ball(0.9, 0.2),
        lamp(-2.0, [20.0, 15.0, 10.0]),
        lamp(1.0, [6.0, 8.0, 12.0]),
    ];
    shapes.extend((0..8).map(slat));
    json!({
        "camera": { "position": [0, 1.4, 3.0], "look_at": [0, 0, 0.8], "vertical_fov_degrees": 30 },
        "film": { "width": 72, "height": 72, "filter": { "type": "box" } },
        "integrator": integrator,
        "materials": { "white": { "type": "diffuse", "albedo": 0.1 } },
        "shapes": shapes,
        "lights": [{ "type": "environment", "radiance": [0.3, 0.35, 0.4] }]
    })
}

fn overrides(seed: u64, spp: u32) -> Overrides {
    Overrides { seed: Some(seed), spp: Some(spp), ..Overrides::default() }
}

fn rendered(integrator: Value, overrides: &Overrides) -> RenderResult {
    render_with(&prepare(&yard(integrator), overrides), AccelKind::EMBREE)
}

/// By Welch's test on blocks of pixels, whose false alarms are rarer than one in a million.
#[test]
fn the_mean_is_that_of_one_light() {
    let blocks = |integrator: Value, first: u64| -> Vec<Vec<f64>> {
        let seeds = first..first + 8;
        seeds.map(|seed| block_means(&rendered(integrator.clone(), &overrides(seed, 16)).image)).collect()
    };
    let one = blocks(json!({ "type": "path", "light_samples": 1, "roulette": "off" }), 0);
    for roulette in ["auto", "off"] {
        let four = blocks(json!({ "type": "path", "light_samples": 4, "roulette": roulette }), 100);
        assert_blocks_agree(&four, &one, roulette);
    }
    let chosen = blocks(json!({ "type": "path" }), 200);
    assert_blocks_agree(&chosen, &one, "chosen by the pilot");
}

/// By power a lamp is chosen as often wherever the point is; the pictures agree, and differ in noise.
#[test]
fn the_mean_is_that_of_lights_chosen_by_power() {
    let scene = |sampler: &str| {
        let mut scene = yard(json!({ "type": "path", "roulette": "off" }));
        scene["light_sampler"] = json!(sampler);
        scene
    };
    for sampler in ["tree", "power"] {
        let prepared = prepare(&scene(sampler), &overrides(0, 1));
        let expected = if sampler == "tree" { LightSelection::Tree } else { LightSelection::Power };
        assert_eq!(prepared.scene.lights.selection(), expected);
    }
    let render = |sampler: &str, seed: u64| {
        render_with(&prepare(&scene(sampler), &overrides(seed, 16)), AccelKind::EMBREE).image
    };
    assert_ne!(render("tree", 0), render("power", 0));
    let blocks = |sampler: &str, first: u64| -> Vec<Vec<f64>> {
        (first..first + 8).map(|seed| block_means(&render(sampler, seed))).collect()
    };
    assert_blocks_agree(&blocks("power", 100), &blocks("tree", 0), "by power");
}

/// First vertices are within the fog for about half of the paths, and others see the lamps through it.
#[test]
fn the_mean_in_a_medium_is_that_of_one_light() {
    let blocks = |light_samples: u32, seeds: std::ops::Range<u64>| -> Vec<Vec<f64>> {
        let integrator = json!({ "type": "path", "max_depth": 4, "light_samples": light_samples, "roulette": "off" });
        let mut scene = yard(integrator);
        scene["media"] = json!({ "fog": {
            "absorption": 0.02, "scattering": 0.2, "phase": { "type": "henyey_greenstein", "g": 0.5 }
        } });
        (scene["medium"], scene["lights"]) = (json!("fog"), json!([]));
        let render = |seed| render_with(&prepare(&scene, &overrides(seed, 16)), AccelKind::EMBREE);
        seeds.map(|seed| block_means(&render(seed).image)).collect()
    };
    assert_blocks_agree(&blocks(4, 100..108), &blocks(1, 0..8), "in fog");
}

/// Each vertex that the camera sees has as many shadow rays, and no other.
#[test]
fn first_vertices_alone_have_more_shadow_rays() {
    let rays = |depth: u32, lights: u32| {
        let integrator = json!({ "type": "path", "max_depth": depth, "light_samples": lights, "rr_depth": 64 });
        rendered(integrator, &overrides(1, 4)).stats.rays
    };
    let further = |depth| rays(depth, 3).shadow - rays(depth, 1).shadow;
    let first = rays(2, 1).shadow as f64;
    // What is chosen differs, and with it what is behind a surface.
    assert!((further(2) as f64 / first - 2.0).abs() < 0.05, "{} {first}", further(2));
    assert!((further(6) as f64 / first - 2.0).abs() < 0.05, "{} {first}", further(6));
    assert_eq!(rays(6, 3).indirect, rays(6, 1).indirect);
}

/// Two renders differ by twice the variance of one.
#[test]
fn the_pilot_chooses_more_lights_where_that_pays() {
    let cost = |integrator: Value| {
        let [a, b] = [1, 2].map(|seed| rendered(integrator.clone(), &overrides(seed, 64)));
        let [x, y] = [&a, &b].map(|rendered| &rendered.image.layer(LayerKind::Color).unwrap().data);
        let error = |(a, b): (&f32, &f32)| f64::from(a - b).powi(2) / (f64::from(*b).powi(2) + 1e-2);
        x.iter().zip(y).map(error).sum::<f64>() * a.stats.rays.total() as f64
    };
    let [chosen, one] = [json!({ "type": "path" }), json!({ "type": "path", "light_samples": 1 })].map(cost);
    assert!(chosen < 0.75 * one, "{chosen} {one}");
    // Where the lights are not sampled, there is one of them as before.
    let [chosen, one] = [
        json!({ "type": "path", "strategy": "bsdf" }),
        json!({ "type": "path", "strategy": "bsdf", "light_samples": 1 }),
    ]
    .map(|integrator| rendered(integrator, &overrides(1, 4)));
    assert!(chosen.image == one.image);
}

#[test]
fn the_bits_do_not_depend_on_threads_or_parts() {
    for integrator in [json!({ "type": "path" }), json!({ "type": "path", "light_samples": 3, "rr_depth": 5 })] {
        let of = |threads| rendered(integrator.clone(), &Overrides { threads: Some(threads), ..overrides(1, 5) }).image;
        assert!(of(1) == of(3));
        assert_resumed_split_and_replayed(&yard(integrator.clone()), &overrides(1, 21));
    }
}
