//! Multiple importance sampling against each of its strategies.

use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::{Effort, Estimate, Outcome, STRATEGIES, Tests, Value, json, mean, scene, with_strategy};

/// Relative variance of a sample below which a strategy counts as all but exact: both together may then exceed it by far, since what is
/// proven (Veach and Guibas, "Optimally Combining Sampling Techniques for Monte Carlo Rendering") bounds the excess by a part of the squared
/// mean. They must only stay below this too.
const ALL_BUT_EXACT: f64 = 0.01;

/// A plate of metal below a lamp in the direction of its mirror image, the camera at 45 degrees and so narrow that all pixels see one point.
fn plate(spp: u32, side: u32, alpha: f64, radius: f64) -> Value {
    scene(
        spp,
        json!({
            "film": { "width": side, "height": side },
            "camera": { "position": [0, 3, 3], "look_at": [0, 0, 0], "vertical_fov_degrees": 0.01 },
            "integrator": { "type": "path", "max_depth": 2 },
            "materials": { "metal": { "type": "conductor", "metal": "silver", "alpha": alpha }, "black": { "type": "diffuse", "albedo": 0 } },
            "shapes": [
                { "type": "quad", "material": "metal", "origin": [-9, 0, 9], "edge_u": [18, 0, 0], "edge_v": [0, 0, -18] },
                { "type": "sphere", "radius": radius, "material": "black", "emission": { "radiance": [1, 1, 1] },
                  "transform": [{ "translate": [0.1, 3, -3.2] }] }
            ]
        }),
    )
}

pub(super) fn i7_strategies(effort: Effort) -> Outcome {
    let (spp, side) = effort.pick((16, 32), (256, 128));
    let pixels = (side * side) as usize;
    let mut tests = Tests::new();
    let (mut worst, mut at, mut exact) = (0f64, String::new(), 0f64);
    for alpha in [0.03, 0.1, 0.3, 0.7] {
        for radius in [0.1, 1.0] {
            let scene = plate(spp, side, alpha, radius);
            let found: Vec<Estimate> = STRATEGIES.iter().map(|strategy| mean(&with_strategy(&scene, strategy), 0)).collect();
            let name = format!("alpha {alpha}, lamp {radius}");
            let [mis, light, bsdf] = [found[0], found[1], found[2]];
            tests.same(&format!("{name}: both and light"), mis, light, pixels);
            // Rays that meet a small lamp one time in thousands have no normal mean.
            if bsdf.error < 0.05 * bsdf.mean {
                tests.same(&format!("{name}: both and scattering"), mis, bsdf, pixels);
            }
            let samples = pixels as f64 * f64::from(spp);
            let [mis, light, bsdf] = [mis, light, bsdf].map(|e| samples * (e.error / e.mean).powi(2));
            let lesser = light.min(bsdf);
            if lesser < ALL_BUT_EXACT {
                exact = exact.max(mis);
            } else if !(mis / lesser <= worst) {
                (worst, at) = (mis / lesser, name);
            }
        }
    }
    // The ratio of two sample variances has this much noise.
    let freedom = (pixels - 1) as f64;
    let noise = FisherSnedecor::new(freedom, freedom).map_or(f64::NAN, |law| law.inverse_cdf(1.0 - 1e-6));
    tests.judge(Outcome::new()).at_most(format!("variance of both over the lesser of one ({at})"), worst, 1.1 * noise).at_most(
        "relative variance of a sample of both where one strategy is all but exact",
        exact,
        ALL_BUT_EXACT,
    )
}
