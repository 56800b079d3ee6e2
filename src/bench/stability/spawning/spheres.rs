//! Pictures of tiny and huge spheres.

use serde_json::{Value, json};

use super::{Effort, Outcome};
use crate::bench::stability::render::{pixels, render};

/// Of the radii, as far as OSPRay's test goes.
const RADII: [f64; 2] = [1e-3, 3e5];
const DISTANCES: [f64; 3] = [3.0, 8e3, 2e5];

/// A white sphere that fills most of the picture. Either the camera or the sphere is at the world's origin.
fn scene(radius: f64, distance: f64, camera_moves: bool, samples: usize, light: Value, strategy: &str) -> Value {
    let far = distance * radius;
    let (camera, sphere) =
        if camera_moves { ([far * 0.6, far * 0.48, far * 0.64], [0.0; 3]) } else { ([0.0; 3], [far * 0.6, far * 0.48, far * 0.64]) };
    json!({
        "film": { "width": 24, "height": 24, "filter": { "type": "box" } },
        "camera": { "position": camera, "look_at": sphere, "up": [0, 0, 1], "vertical_fov_degrees": 2.1 * (1.0 / distance).asin().to_degrees() },
        "sampler": { "type": "independent", "spp": samples },
        "integrator": { "type": "path", "max_depth": 2, "strategy": strategy },
        "materials": { "white": { "type": "diffuse", "albedo": 1.0 } },
        "shapes": [{ "type": "sphere", "radius": radius, "material": "white", "transform": [{ "translate": sphere }] }],
        "lights": [light],
    })
}

fn picture(scene: &Value) -> Vec<f64> {
    pixels(&render(scene)).map(|p| f64::from(p[1])).collect()
}

/// Root mean square of the difference over the mean.
fn relative_rmse(a: &[f64], b: &[f64]) -> f64 {
    let n = a.len() as f64;
    let square = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>() / n;
    square.sqrt() / (b.iter().sum::<f64>() / n)
}

pub(super) fn b10_spheres(effort: Effort) -> Outcome {
    let samples = effort.pick(16, 1_024);
    let sky = json!({ "type": "environment", "radiance": [1, 1, 1] });
    let sun = json!({ "type": "directional", "direction": [0.3, -1, 0.2], "irradiance": [3, 3, 3] });
    let (mut off_white, mut difference, mut dark) = (0f64, 0f64, 1f64);
    for camera_moves in [false, true] {
        let reference = picture(&scene(1.0, DISTANCES[0], camera_moves, samples, sun.clone(), "light"));
        for distance in DISTANCES {
            let [small, large] = RADII.map(|radius| {
                // Directions are sampled by the material, so that each sample is 1; a false hit is black.
                let white = picture(&scene(radius, distance, camera_moves, samples, sky.clone(), "bsdf"));
                off_white = white.iter().map(|v| (v - 1.0).abs()).fold(off_white, f64::max);
                picture(&scene(radius, distance, camera_moves, samples, sun.clone(), "light"))
            });
            difference = difference.max(relative_rmse(&small, &large));
            // How much of the lit side is there, beside the nearest camera's larger perspective.
            let lit = |picture: &[f64]| picture.iter().filter(|&&v| v > 0.0).count() as f64;
            dark = dark.min(lit(&small).min(lit(&large)) / lit(&reference));
        }
    }
    Outcome::new()
        .at_most("under a sky: largest deviation of a pixel from white", off_white, 1e-5)
        .at_most("under a sun: relative RMSE between radii", difference, 0.01)
        .at_least("under a sun: lit pixels, of those from nearby", dark, 0.9)
}
