//! Russian roulette by what paths are worth: the same mean as without roulette, less error for the same rays, the
//! same bits however a render is split.

use serde_json::{Value, json};
use steradian::desc::{IntegratorDesc, RouletteDesc};
use steradian::internal::accel::AccelKind;
use steradian::internal::film::{Image, LayerKind};
use steradian::internal::render::{Overrides, RenderResult, Settings};
use steradian::{Error, RayCounts};

use crate::checkpoints::assert_resumed_split_and_replayed;
use crate::util::render::{assert_blocks_agree, block_means, prepare, render_with};

fn wall(origin: [f32; 3], edge_u: [f32; 3], edge_v: [f32; 3]) -> Value {
    json!({ "type": "quad", "material": "white", "origin": origin, "edge_u": edge_u, "edge_v": edge_v })
}

/// A bright room that a lamp behind a partition lights, with a glass and a glossy ball.
fn room() -> Value {
    json!({
        "camera": { "position": [0, 1, 2.9], "look_at": [0, 0.9, 0], "vertical_fov_degrees": 60 },
        "film": { "width": 48, "height": 48, "filter": { "type": "box" } },
        "integrator": { "type": "path", "max_depth": 24, "rr_depth": 64 },
        "materials": {
            "white": { "type": "diffuse", "albedo": [0.8, 0.75, 0.7] }, "glass": { "type": "dielectric" },
            "coat": { "type": "plastic", "albedo": [0.2, 0.4, 0.7], "roughness": 0.3 }
        },
        "shapes": [
            wall([-2.0, 0.0, 3.0], [4.0, 0.0, 0.0], [0.0, 0.0, -6.0]),
            wall([-2.0, 2.0, 3.0], [4.0, 0.0, 0.0], [0.0, 0.0, -6.0]),
            wall([-2.0, 0.0, -3.0], [4.0, 0.0, 0.0], [0.0, 2.0, 0.0]),
            wall([-2.0, 0.0, 3.0], [4.0, 0.0, 0.0], [0.0, 2.0, 0.0]),
            wall([-2.0, 0.0, 3.0], [0.0, 0.0, -6.0], [0.0, 2.0, 0.0]),
            wall([2.0, 0.0, 3.0], [0.0, 0.0, -6.0], [0.0, 2.0, 0.0]),
            wall([-1.2, 0.0, -1.0], [3.2, 0.0, 0.0], [0.0, 2.0, 0.0]),
            { "type": "sphere", "material": "glass", "radius": 0.4, "transform": [{ "translate": [-0.7, 0.4, 0.5] }] },
            { "type": "sphere", "material": "coat", "radius": 0.4, "transform": [{ "translate": [0.6, 0.4, 0.3] }] },
            { "type": "quad", "material": "white", "origin": [0.4, 1.9, -2.6], "edge_u": [1, 0, 0],
              "edge_v": [0, 0, 1], "emission": { "radiance": [30, 28, 25], "two_sided": true } }
        ]
    })
}

fn overrides(roulette: RouletteDesc, seed: u64, spp: u32) -> Overrides {
    Overrides { roulette: Some(roulette), seed: Some(seed), spp: Some(spp), ..Overrides::default() }
}

fn image(scene: &Value, overrides: &Overrides) -> Image {
    render_with(&prepare(scene, overrides), AccelKind::EMBREE).image
}

/// By Welch's test on blocks of pixels.
#[test]
fn the_mean_is_that_without_roulette() {
    let blocks = |roulette, first: u64| -> Vec<Vec<f64>> {
        (first..first + 8).map(|seed| block_means(&image(&room(), &overrides(roulette, seed, 32)))).collect()
    };
    let off = blocks(RouletteDesc::Off, 0);
    assert_blocks_agree(&blocks(RouletteDesc::Auto, 100), &off, "auto");
    assert_blocks_agree(&blocks(RouletteDesc::Throughput, 200), &off, "throughput");
    assert_blocks_agree(&blocks(RouletteDesc::ShadowRays, 300), &off, "shadow rays");
}

/// Two renders differ by twice the variance of one.
#[test]
fn errors_times_rays_are_less_than_without_roulette() {
    let cost = |roulette| {
        let renders = [1, 2].map(|seed| {
            let rendered = render_with(&prepare(&room(), &overrides(roulette, seed, 64)), AccelKind::EMBREE);
            (rendered.image, rendered.stats.rays.total() as f64)
        });
        let [(a, rays), (b, _)] = &renders;
        let (a, b) = (a.layer(LayerKind::Color).unwrap(), b.layer(LayerKind::Color).unwrap());
        let error = |(a, b): (&f32, &f32)| f64::from(a - b).powi(2) / (f64::from(*b).powi(2) + 1e-4);
        a.data.iter().zip(&b.data).map(error).sum::<f64>() * rays
    };
    let (auto, off) = (cost(RouletteDesc::Auto), cost(RouletteDesc::Off));
    assert!(auto < 0.75 * off, "{auto} {off}");
}

/// A metal ball reflects walls; the lamp is mostly outside of its lobe, and what shadow rays would carry is little.
#[test]
fn shadow_rays_that_carry_little_are_traced_less_often() {
    let mut scene = room();
    scene["camera"] = json!({ "position": [0.6, 0.5, 1.5], "look_at": [0.6, 0.4, 0.3], "vertical_fov_degrees": 25 });
    scene["materials"]["coat"] = json!({ "type": "conductor", "metal": "gold", "roughness": 0.1 });
    scene["shapes"][9]["origin"] = json!([0.4, 1.9, 1.0]);
    let renders = |roulette, first: u64| -> Vec<RenderResult> {
        let render = |seed| render_with(&prepare(&scene, &overrides(roulette, seed, 32)), AccelKind::EMBREE);
        (first..first + 8).map(render).collect()
    };
    let sum = |renders: &[RenderResult], of: fn(&RayCounts) -> u64| {
        renders.iter().map(|r| of(&r.stats.rays)).sum::<u64>() as f64
    };
    let paths = |renders: &[RenderResult]| sum(renders, |rays| rays.camera + rays.indirect);
    let share = |renders: &[RenderResult]| sum(renders, |rays| rays.shadow) / paths(renders);
    let blocks =
        |rendered: &[RenderResult]| rendered.iter().map(|rendered| block_means(&rendered.image)).collect::<Vec<_>>();
    let (off, throughput) = (renders(RouletteDesc::Off, 0), renders(RouletteDesc::Throughput, 50));
    let (auto, shadow_rays) = (renders(RouletteDesc::Auto, 100), renders(RouletteDesc::ShadowRays, 150));
    for (without, with, name) in [(&throughput, &auto, "auto"), (&off, &shadow_rays, "shadow rays")] {
        assert!(share(with) < 0.8 * share(without), "{name}: {} {}", share(with), share(without));
        assert_blocks_agree(&blocks(with), &blocks(without), name);
    }
    // Paths are as long as without roulette.
    assert!((paths(&shadow_rays) / paths(&off) - 1.0).abs() < 0.01, "{} {}", paths(&shadow_rays), paths(&off));
}

#[test]
fn the_bits_do_not_depend_on_threads_or_parts() {
    let of_threads = |threads| {
        let overrides = Overrides { threads: Some(threads), ..overrides(RouletteDesc::Auto, 1, 8) };
        image(&room(), &overrides)
    };
    assert!(of_threads(1) == of_threads(3));
    assert!(of_threads(1) != image(&room(), &overrides(RouletteDesc::Off, 1, 8)));
    for roulette in [RouletteDesc::Auto, RouletteDesc::ShadowRays] {
        assert_resumed_split_and_replayed(&room(), &overrides(roulette, 1, 21));
    }
}

/// There is nothing to estimate; and no shape is the bound of a grid.
#[test]
fn dark_and_empty_scenes_are_rendered() {
    let mut dark = room();
    dark["integrator"]["max_depth"] = json!(1);
    let empty = json!({
        "camera": { "position": [0, 0, 1], "look_at": [0, 0, 0] },
        "lights": [{ "type": "environment", "radiance": [1, 2, 3] }]
    });
    for (scene, expected) in [(dark, 0.0), (empty, 1.0)] {
        let image = image(&scene, &overrides(RouletteDesc::Auto, 1, 2));
        assert_eq!(image.pixel(LayerKind::Color, 10, 10).unwrap()[0], expected);
    }
}

#[test]
fn the_option_replaces_what_the_scene_says() {
    let settings = |scene: &Value, roulette| {
        let desc = serde_json::from_value(scene.clone()).unwrap();
        Settings::new(&desc, &Overrides { roulette, ..Overrides::default() })
    };
    let of = |scene: &Value, chosen| {
        let integrator = settings(scene, chosen).unwrap().integrator;
        let IntegratorDesc::Path { rr_depth, .. } = integrator else { panic!("{integrator:?}") };
        (integrator.roulette().unwrap(), rr_depth)
    };
    let (auto, throughput, off) = (RouletteDesc::Auto, RouletteDesc::Throughput, RouletteDesc::Off);
    let shadow_rays = RouletteDesc::ShadowRays;
    assert_eq!(of(&room(), None), (shadow_rays, Some(64)));
    for (max_depth, rr_depth, expected) in
        [(24, 23, shadow_rays), (24, 22, throughput), (7, u32::MAX, shadow_rays), (6, 64, throughput)]
    {
        let mut room = room();
        room["integrator"] = json!({ "type": "path", "max_depth": max_depth, "rr_depth": rr_depth });
        assert_eq!(of(&room, None).0, expected, "{max_depth} {rr_depth}");
        room["integrator"]["roulette"] = json!("throughput");
        assert_eq!(of(&room, None).0, throughput);
    }
    assert_eq!(of(&room(), Some(shadow_rays)), (shadow_rays, Some(64)));
    assert_eq!(of(&room(), Some(throughput)), (throughput, Some(5)));
    assert_eq!(of(&room(), Some(auto)).0, auto);
    assert_eq!(of(&room(), Some(off)).0, off);
    let mut plain = room();
    plain["integrator"] = json!({ "type": "path" });
    assert_eq!(of(&plain, None), (auto, None));
    assert_eq!(of(&plain, Some(throughput)), (throughput, None));
    plain["integrator"] = json!({ "type": "path", "rr_depth": 3, "roulette": "auto" });
    assert_eq!(of(&plain, None).0, auto);
    let mut whitted = room();
    whitted["integrator"] = json!({ "type": "whitted" });
    assert!(matches!(settings(&whitted, Some(RouletteDesc::Auto)), Err(Error::Setting { message, .. })
        if message.starts_with("`roulette`")));
}
