//! Multiple importance sampling against each of its strategies.

use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::{Effort, Estimate, Outcome, STRATEGIES, Tests, Value, json, mean, scene, with_strategy};

/// A plate of metal below a lamp in the direction of its mirror image, the camera at 45 degrees and so narrow that all
/// pixels see one point.
fn plate(spp: u32, side: u32, alpha: f64, radius: f64) -> Value {
    scene(
        spp,
        json!({
            "film": { "width": side, "height": side },
            "camera": { "position": [0, 3, 3], "look_at": [0, 0, 0], "vertical_fov_degrees": 0.01 },
            "integrator": { "type": "path", "max_depth": 2 },
            "materials": {
                "metal": { "type": "conductor", "metal": "silver", "alpha": alpha },
                "black": { "type": "diffuse", "albedo": 0 }
            },
            "shapes": [
                {
                    "type": "quad", "material": "metal", "origin": [-9, 0, 9], "edge_u": [18, 0, 0],
                    "edge_v": [0, 0, -18]
                },
                { "type": "sphere", "radius": radius, "material": "black", "emission": { "radiance": [1, 1, 1] },
                  "transform": [{ "translate": [0.1, 3, -3.2] }] }
            ]
        }),
    )
}

pub(super) fn i7_strategies(effort: Effort) -> Outcome {
    let (spp, side) = effort.pick((16, 32), (256, 64));
    let pixels = (side * side) as usize;
    let mut tests = Tests::new();
    let (mut worst, mut at) = (0f64, String::new());
    let (mut ratio, mut ratio_at) = (0f64, String::new());
    for alpha in [0.03, 0.1, 0.3, 0.7] {
        for radius in [0.1, 1.0] {
            let scene = plate(spp, side, alpha, radius);
            let found: Vec<Estimate> =
                STRATEGIES.iter().map(|strategy| mean(&with_strategy(&scene, strategy), 0)).collect();
            let name = format!("alpha {alpha}, lamp {radius}");
            let [mis, light, bsdf] = [found[0], found[1], found[2]];
            tests.same(&format!("{name}: both and light"), mis, light, pixels);
            // Rays that meet a small lamp one time in thousands have no normal mean.
            if bsdf.error < 0.05 * bsdf.mean {
                tests.same(&format!("{name}: both and scattering"), mis, bsdf, pixels);
            }
            // Two samples, one of each strategy, exceed the better strategy's variance by half of the squared mean at
            // most (Veach and Guibas, "Optimally Combining Sampling Techniques for Monte Carlo Rendering").
            let samples = pixels as f64 * f64::from(spp);
            let [mis, light, bsdf] = [mis, light, bsdf].map(|e| samples * (e.error / e.mean).powi(2));
            let lesser = light.min(bsdf);
            let bound = (1.1 * lesser).max(lesser + 0.5);
            if mis / lesser > ratio {
                (ratio, ratio_at) = (mis / lesser, name.clone());
            }
            if !(mis / bound <= worst) {
                (worst, at) = (mis / bound, name);
            }
        }
    }
    // The ratio of two sample variances has this much noise.
    let freedom = (pixels - 1) as f64;
    let noise = FisherSnedecor::new(freedom, freedom).map_or(f64::NAN, |law| law.inverse_cdf(1.0 - 1e-6));
    tests
        .judge(Outcome::new())
        .at_most(format!("variance of both over its bound ({at})"), worst, noise)
        .record(format!("variance of both over the lesser of one ({ratio_at})"), ratio)
        .short(
            "1.1 times the lesser variance is asked everywhere: a strategy that is good already is exceeded by more, \
             since light sampling gets its share of the weight where both densities are alike, as in the tail of a \
             sharp lobe within a large lamp",
        )
}
