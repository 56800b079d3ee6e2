//! Pictures of tiny and huge spheres.

use serde_json::{Value, json};

use super::{Effort, Outcome};
use crate::stability::render::{pixels, render};

/// The smallest and the largest, as far as OSPRay's test goes, and one that has all digits of the smallest.
const RADII: [f64; 3] = [1e-3, 3e5, 1e-3 * (1 << 28) as f64];
/// In radii.
const DISTANCES: [f64; 3] = [3.0, 8e3, 2e5];

/// A camera that looks at a sphere.
#[derive(Clone, Copy)]
struct View {
    radius: f64,
    /// In radii.
    distance: f64,
    /// Whether the sphere is at the world's origin, not the camera.
    camera_moves: bool,
}

/// A white sphere that fills most of the picture. Either the camera or the sphere is at the world's origin.
fn scene(View { radius, distance, camera_moves }: View, samples: usize, light: Value, strategy: &str) -> Value {
    let far = distance * radius;
    let (camera, sphere) = if camera_moves {
        ([far * 0.6, far * 0.48, far * 0.64], [0.0; 3])
    } else {
        ([0.0; 3], [far * 0.6, far * 0.48, far * 0.64])
    };
    json!({
        "film": { "width": 24, "height": 24, "filter": { "type": "box" } },
        "camera": {
            "position": camera, "look_at": sphere, "up": [0, 0, 1],
            "vertical_fov_degrees": 2.1 * (1.0 / distance).asin().to_degrees()
        },
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
    let (mut off_white, mut lit) = (0f64, 1f64);
    // From the smallest radius to the others, by distance.
    let mut differences = [[0f64; 2]; DISTANCES.len()];
    for camera_moves in [false, true] {
        let nearby =
            picture(&scene(View { radius: 1.0, distance: DISTANCES[0], camera_moves }, samples, sun.clone(), "light"));
        for (distance, differences) in DISTANCES.into_iter().zip(&mut differences) {
            let pictures = RADII.map(|radius| {
                let view = View { radius, distance, camera_moves };
                // Directions are sampled by the material, so that each sample is 1; a false hit is black.
                let white = picture(&scene(view, samples, sky.clone(), "bsdf"));
                off_white = white.iter().map(|v| (v - 1.0).abs()).fold(off_white, f64::max);
                picture(&scene(view, samples, sun.clone(), "light"))
            });
            let count = |picture: &[f64]| picture.iter().filter(|&&v| v > 0.0).count() as f64;
            lit = pictures.iter().map(|picture| count(picture) / count(&nearby)).fold(lit, f64::min);
            for (difference, other) in differences.iter_mut().zip(&pictures[1..]) {
                *difference = difference.max(relative_rmse(&pictures[0], other));
            }
        }
    }
    let [near, far, farthest] = differences;
    Outcome::new()
        .at_most("under a sky: largest deviation of a pixel from white", off_white, 1e-5)
        .at_least("under a sun: lit pixels, of those from nearby", lit, 0.9)
        .at_most(
            "under a sun: relative RMSE between radii with the same digits",
            near[1].max(far[1]).max(farthest[1]),
            0.0,
        )
        .at_most("under a sun: relative RMSE between radii, 3 and 8000 radii away", near[0].max(far[0]), 0.01)
        // Half an ulp of each coordinate at 2e5 radii is up to 0.02 radii together, a quarter of a pixel: of the lit
        // rim, 36 of 576 pixels, a quarter comes or goes.
        .at_most("under a sun: relative RMSE between radii, 2e5 radii away", farthest[0], 0.1)
        .short(
            "at 2e5 radii the roundings of positions and directions to f32 move the sphere by up to a quarter of a \
             pixel; the catalogue requires 1 %",
        )
}
