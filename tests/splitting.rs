//! Splitting at glass that reflects an emitter: it makes the same picture as choosing does, with less noise.

use serde_json::{Value, json};
use steradian::desc::StrategyDesc;
use steradian::internal::accel::AccelKind;
use steradian::internal::film::{Image, LayerKind};
use steradian::internal::render::Overrides;

use crate::layers::{assert_sums, full_of};
use crate::util::render::{assert_blocks_agree, block_means, prepare, render_with};

/// A slab, a pane and a ball of glass before a wall, which show a lamp behind the camera.
fn glass(wall: f64) -> Value {
    json!({
        "camera": { "position": [0, 0, 4], "look_at": [0, 0, 0], "vertical_fov_degrees": 34 },
        "film": { "width": 48, "height": 48, "filter": { "type": "box" } },
        "integrator": {
            "type": "path", "max_depth": 12, "roulette": "off", "bidirectional": "off", "caustics": "paths"
        },
        "materials": {
            "glass": { "type": "dielectric" }, "pane": { "type": "thin_dielectric" },
            "wall": { "type": "diffuse", "albedo": wall }, "black": { "type": "diffuse", "albedo": 0 }
        },
        "shapes": [
            { "type": "quad", "material": "wall", "origin": [-2, -2, -1], "edge_u": [4, 0, 0], "edge_v": [0, 4, 0] },
            { "type": "cube", "material": "glass",
              "transform": [{ "scale": [0.5, 0.4, 0.05] }, { "translate": [-0.6, 0.5, 0] }] },
            { "type": "quad", "material": "pane", "origin": [0.1, 0.1, 0], "edge_u": [0.9, 0, 0],
              "edge_v": [0, 0.8, 0.1] },
            { "type": "sphere", "material": "glass", "radius": 0.45, "transform": [{ "translate": [0, -0.5, 0.3] }] },
            { "type": "quad", "material": "black", "origin": [-2, -1, 5], "edge_u": [0, 3, 0], "edge_v": [4, 0, 0],
              "emission": { "radiance": [6, 5, 4] } }
        ]
    })
}

fn rendered(scene: &Value, strategy: StrategyDesc, seed: u64) -> Image {
    let overrides = Overrides { strategy: Some(strategy), seed: Some(seed), spp: Some(64), ..Overrides::default() };
    render_with(&prepare(scene, &overrides), AccelKind::EMBREE).image
}

/// By Welch's test on blocks of pixels. With the strategy `light` paths are not split.
#[test]
fn split_paths_and_those_that_choose_have_the_same_mean() {
    let blocks = |scene: &Value, strategy, first: u64| -> Vec<Vec<f64>> {
        (first..first + 8).map(|seed| block_means(&rendered(scene, strategy, seed))).collect()
    };
    let scene = glass(0.5);
    let chosen = blocks(&scene, StrategyDesc::Light, 100);
    assert_blocks_agree(&blocks(&scene, StrategyDesc::Mis, 0), &chosen, "paths");
    for (key, value) in [("caustics", "photons"), ("bidirectional", "on")] {
        let mut scene = glass(0.5);
        scene["integrator"][key] = json!(value);
        assert_blocks_agree(&blocks(&scene, StrategyDesc::Mis, 0), &chosen, key);
    }
}

/// Before a black wall all noise is that of choosing reflection or refraction. Two renders differ by twice the variance
/// of one.
#[test]
fn split_paths_have_less_noise() {
    let difference = |splitting: bool| -> f64 {
        let mut scene = glass(0.0);
        scene["integrator"]["splitting"] = json!(splitting);
        let [a, b] = [1, 2].map(|seed| rendered(&scene, StrategyDesc::Mis, seed));
        let [a, b] = [&a, &b].map(|image| image.layer(LayerKind::Color).unwrap());
        a.data.iter().zip(&b.data).map(|(a, b)| f64::from(a - b).powi(2)).sum()
    };
    let (split, chosen) = (difference(true), difference(false));
    assert!(split < 0.5 * chosen, "{split} {chosen}");
}

/// The layers of the light's parts, and what denoisers see through the glass.
#[test]
fn layers_of_split_paths_add_up() {
    let mut scene = glass(0.5);
    scene["sampler"] = json!({ "spp": 16 });
    assert_sums(&full_of(&scene), "split");
    scene["camera"]["vertical_fov_degrees"] = json!(1);
    scene["camera"]["look_at"] = json!([-0.6, 0.5, 0]);
    let albedo = full_of(&scene).layer(LayerKind::FeatureAlbedo).unwrap().clone();
    // What the lamp's reflection hides is the wall.
    assert!(albedo.data.iter().all(|value| (value - 0.5).abs() < 0.01));
}
