//! Scenes written as JSON values, rendered, and statistics of the picture.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use super::Faults;
use crate::accel::{self, AccelKind};
use crate::desc::{AutoDesc, CausticsDesc};
use crate::film::Image;
use crate::render::{self, Overrides, RenderResult, Settings, Silent};
use crate::scene::Scene;
use crate::{compile, import};
use serde_json::{Value, json};

/// Scenes of checks are written here, not by users.
const VALID: &str = "scenes of checks are valid";

/// A compiled scene with its settings.
pub struct Prepared {
    /// What is rendered.
    pub scene: Scene,
    /// How.
    pub settings: Settings,
}

/// Compiles a scene given as JSON.
pub fn prepare(scene: &Value, overrides: &Overrides) -> Prepared {
    let path = Path::new("test.json");
    let desc = import::parse_scene(&scene.to_string(), path).expect(VALID);
    let settings = Settings::new(&desc, overrides).expect(VALID);
    let scene = compile::compile(&desc, path).expect(VALID);
    Prepared { scene, settings }
}

/// Renders a scene with two threads.
pub fn render_with(prepared: &Prepared, kind: AccelKind) -> RenderResult {
    let accel = accel::build(kind, &prepared.scene.geometry, 2).expect(VALID);
    render::render(&prepared.scene, &*accel, &prepared.settings, &Silent, &AtomicBool::new(false)).expect(VALID)
}

/// Renders a scene given as JSON through Embree.
pub fn render(scene: &Value) -> Image {
    // Estimates take pixels for independent of each other: those that share light paths or photons are not.
    let bidirectional = Some(AutoDesc::Off);
    let caustics = scene["integrator"].get("caustics").is_none().then_some(CausticsDesc::Paths);
    let overrides = Overrides { threads: Some(2), bidirectional, caustics, ..Overrides::default() };
    render_with(&prepare(scene, &overrides), AccelKind::EMBREE).image
}

/// A scene with a camera at `position` looking at `look_at` through a very narrow angle, so that all pixels see nearly
/// one point.
pub fn probe(position: [f64; 3], look_at: [f64; 3], rest: Value) -> Value {
    let mut scene = json!({
        "film": { "width": 16, "height": 16, "filter": { "type": "box" } },
        "camera": { "position": position, "look_at": look_at, "up": [0.1, 1.0, 0.2], "vertical_fov_degrees": 0.01 },
        "sampler": { "type": "independent", "spp": 1024 },
    });
    merge(&mut scene, rest);
    scene
}

/// Puts the keys of `from` into `into`, object by object.
pub fn merge(into: &mut Value, from: Value) {
    match (into, from) {
        (Value::Object(into), Value::Object(from)) => {
            for (key, value) in from {
                merge(into.entry(key).or_insert(Value::Null), value);
            }
        }
        (into, from) => *into = from,
    }
}

/// Mean over the pixels of a picture with the standard error of that mean.
#[derive(Clone, Copy, Debug)]
pub struct Estimate {
    /// The mean.
    pub mean: f64,
    /// Its standard error.
    pub error: f64,
}

impl Estimate {
    /// Of one colour channel.
    pub fn of(image: &Image, channel: usize) -> Self {
        let values: Vec<f64> = pixels(image).map(|p| f64::from(p[channel])).collect();
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let variance = values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / (n - 1.0);
        Self { mean, error: (variance / n).sqrt() }
    }
}

/// The colours of a picture, row by row.
pub fn pixels(image: &Image) -> impl Iterator<Item = [f32; 3]> + '_ {
    let [width, height] = image.size;
    (0..height).flat_map(move |y| (0..width).filter_map(move |x| image.rgb(x, y)))
}

/// The numbers of a picture that are not finite.
pub fn not_finite(image: &Image) -> Faults {
    let mut faults = Faults::NONE;
    for layer in &image.layers {
        for (i, value) in layer.data.iter().enumerate() {
            faults.require(value.is_finite(), || format!("number {i} of layer {:?} is {value}", layer.kind));
        }
    }
    faults
}

/// A white diffuse floor at y = 0 seen from above at `at`: its radiance times pi is the irradiance.
pub fn floor_probe(at: [f64; 3], lights: Value) -> Value {
    let mut scene = probe(
        [at[0] + 0.6, at[1] + 0.45, at[2] - 0.3],
        at,
        json!({
            "integrator": { "type": "path", "max_depth": 2 },
            "materials": {
                "white": { "type": "diffuse", "albedo": 1.0 }, "black": { "type": "diffuse", "albedo": 0.0 }
            },
            "shapes": [{
                "type": "quad", "material": "white", "origin": [-9, 0, 9], "edge_u": [18, 0, 0], "edge_v": [0, 0, -18]
            }]
        }),
    );
    for light in lights.as_array().into_iter().flatten() {
        scene["shapes"].as_array_mut().expect(VALID).push(light.clone());
    }
    scene
}

/// Means over 12 x 12 pixels of all channels together.
pub fn block_means(image: &Image) -> Vec<f64> {
    let [width, _] = image.size;
    let blocks = width as usize / 12;
    let mut sums = vec![0.0; blocks * blocks];
    for (i, p) in pixels(image).enumerate() {
        let (x, y) = (i % width as usize, i / width as usize);
        sums[y / 12 * blocks + x / 12] += p.iter().map(|&c| f64::from(c)).sum::<f64>() / 144.0;
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Small enough for an interpreter that looks for undefined behaviour and data races.
    #[test]
    fn a_small_picture_is_the_same_through_every_tree_and_without_embree() {
        let scene = json!({
            "film": { "width": 6, "height": 4 },
            "camera": { "position": [0, 1, 5], "look_at": [0, 0.5, 0], "vertical_fov_degrees": 40 },
            "sampler": { "spp": 1 },
            "integrator": { "type": "path", "max_depth": 3 },
            "materials": {
                "white": { "type": "diffuse", "albedo": 0.7 },
                "glass": { "type": "dielectric", "ior": 1.5, "roughness": 0.3 }
            },
            "shapes": [
                {
                    "type": "quad", "material": "white", "origin": [-3, 0, 3], "edge_u": [6, 0, 0], "edge_v": [0, 0, -6]
                },
                { "type": "sphere", "material": "glass", "radius": 0.6, "transform": [{ "translate": [0, 0.6, 0] }] },
                {
                    "type": "mesh", "material": "white", "positions": [[-1, 0, -1], [1, 0, -1], [0, 2, -1]],
                    "triangles": [[0, 1, 2]]
                },
                {
                    "type": "sphere", "material": "white", "radius": 0.3, "emission": { "radiance": [9, 9, 9] },
                    "transform": [{ "translate": [1, 3, 1] }]
                }
            ]
        });
        let prepared = prepare(&scene, &Overrides { threads: Some(2), ..Overrides::default() });
        let picture = |name: &str| render_with(&prepared, name.parse().expect("an accelerator")).image;
        let linear = picture("linear");
        assert!(pixels(&linear).any(|p| p[0] > 0.0));
        for name in ["bvh", "bvh:binary", "kdtree", "octree"] {
            assert_eq!(picture(name), linear, "{name}");
        }
    }
}
