//! Direct light by specular reflection beside other lobes: evaluated, it makes the same picture as choosing lobes does,
//! with less noise, in the same layers.

use serde_json::{Value, json};
use steradian::desc::StrategyDesc;
use steradian::internal::accel::AccelKind;
use steradian::internal::film::{Image, LayerKind};
use steradian::internal::render::Overrides;

use crate::util::render::{assert_blocks_agree, block_means, prepare, render_with};

/// A floor of plastic that shows two lamps to the camera and to a wall, glass, and a cube of coated gold.
fn plastics() -> Value {
    json!({
        "camera": { "position": [0, 1.6, 4], "look_at": [0, 0.4, 0], "vertical_fov_degrees": 40 },
        "film": { "width": 48, "height": 48, "filter": { "type": "box" } },
        "outputs": [{ "file": "unused.exr", "layers": ["specular_direct", "diffuse_direct"] }],
        "integrator": { "type": "path", "max_depth": 6, "roulette": "throughput", "bidirectional": "off" },
        "materials": {
            "floor": { "type": "plastic", "albedo": [0.5, 0.4, 0.2] },
            "gold": { "type": "conductor", "metal": "gold", "roughness": 0.4 },
            "coat": { "type": "coated", "base": "gold" },
            "wall": { "type": "diffuse", "albedo": 0.6 },
            "glass": { "type": "dielectric" }
        },
        "shapes": [
            { "type": "quad", "material": "floor", "origin": [-3, 0, 3], "edge_u": [6, 0, 0], "edge_v": [0, 0, -6] },
            { "type": "quad", "material": "wall", "origin": [-3, 0, -2], "edge_u": [6, 0, 0], "edge_v": [0, 3, 0] },
            { "type": "quad", "material": "wall", "origin": [-0.4, 1.6, -1], "edge_u": [0.8, 0, 0],
              "edge_v": [0, 0, 0.8], "emission": { "radiance": [16, 15, 14] } },
            { "type": "sphere", "material": "wall", "radius": 0.15, "transform": [{ "translate": [1, 1, 0] }],
              "emission": { "radiance": [20, 30, 40] } },
            { "type": "sphere", "material": "glass", "radius": 0.4, "transform": [{ "translate": [-1, 0.4, 0.3] }] },
            { "type": "cube", "material": "coat", "transform": [{ "scale": 0.3 }, { "translate": [0.4, 0.3, 0.9] }] }
        ]
    })
}

fn of_seed(strategy: StrategyDesc, seed: u64, spp: u32) -> Image {
    rendered(&plastics(), strategy, seed, spp)
}

fn rendered(scene: &Value, strategy: StrategyDesc, seed: u64, spp: u32) -> Image {
    let overrides = Overrides { strategy: Some(strategy), seed: Some(seed), spp: Some(spp), ..Overrides::default() };
    render_with(&prepare(scene, &overrides), AccelKind::EMBREE).image
}

/// By Welch's test on blocks of pixels. The strategy `light` chooses specular reflections as it chooses other lobes;
/// connected paths evaluate them at the first vertex.
#[test]
fn evaluated_and_chosen_reflections_have_the_same_mean() {
    let blocks = |scene: &Value, strategy, first: u64| -> Vec<Vec<f64>> {
        (first..first + 8).map(|seed| block_means(&rendered(scene, strategy, seed, 64))).collect()
    };
    let mut connected = plastics();
    connected["integrator"]["bidirectional"] = json!("on");
    let chosen = blocks(&plastics(), StrategyDesc::Light, 100);
    assert_blocks_agree(&blocks(&plastics(), StrategyDesc::Mis, 0), &chosen, "paths");
    assert_blocks_agree(&blocks(&connected, StrategyDesc::Mis, 0), &chosen, "connected paths");
}

/// Two renders differ by twice the variance of one; the layers hold the same light.
#[test]
fn evaluated_reflections_have_less_noise_in_the_layer_of_direct_specular_light() {
    let layer = |image: &Image, kind| -> Vec<f64> {
        image.layer(kind).unwrap().data.iter().map(|&value| f64::from(value)).collect()
    };
    let of = |strategy, kind| {
        let [a, b] = [1, 2].map(|seed| layer(&of_seed(strategy, seed, 64), kind));
        let difference: f64 = a.iter().zip(&b).map(|(a, b)| (a - b).powi(2)).sum();
        (difference, a.iter().chain(&b).sum::<f64>())
    };
    let kind = LayerKind::SpecularDirect;
    let ((evaluated, sum), (chosen, expected)) = (of(StrategyDesc::Mis, kind), of(StrategyDesc::Light, kind));
    assert!(evaluated < 0.25 * chosen, "{evaluated} {chosen}");
    assert!((sum / expected - 1.0).abs() < 0.05, "{sum} {expected}");
    let [(_, sum), (_, expected)] =
        [StrategyDesc::Mis, StrategyDesc::Light].map(|strategy| of(strategy, LayerKind::DiffuseDirect));
    assert!((sum / expected - 1.0).abs() < 0.05, "{sum} {expected}");
}
