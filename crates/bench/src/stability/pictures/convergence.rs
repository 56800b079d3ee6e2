//! How the error falls with samples.

use super::{Effort, Outcome, json, pictures, prepared, room};
use crate::fitted_slope;
use crate::stability::Plot;

/// Relative squared error of a picture: over all pixels, and without the largest thousandth.
fn relative_errors(picture: &[f64], reference: &[f64]) -> [f64; 2] {
    let mean = reference.iter().sum::<f64>() / reference.len() as f64;
    let mut errors: Vec<f64> =
        picture.iter().zip(reference).map(|(x, r)| (x - r).powi(2) / (r * r + 1e-2 * mean * mean)).collect();
    errors.sort_by(f64::total_cmp);
    let kept = errors.len() - errors.len().div_ceil(1000);
    let over = |errors: &[f64]| errors.iter().sum::<f64>() / errors.len() as f64;
    [over(&errors), over(&errors[..kept])]
}

/// Errors by samples per pixel, each the mean over some seeds.
struct Curve {
    all: Vec<(f64, f64)>,
    without_largest: Vec<(f64, f64)>,
}

impl Curve {
    fn measure(sampler: &str, levels: u32, seeds: u64, reference: &[f64]) -> Self {
        let mut curve = Self { all: Vec::new(), without_largest: Vec::new() };
        for level in 0..levels {
            let spp = 1 << level;
            let mut scene = room();
            scene["sampler"]["type"] = json!(sampler);
            let renders = pictures(prepared(&scene, spp), (0..seeds).map(|seed| 5000 + 100 * u64::from(level) + seed));
            let sums = renders
                .iter()
                .map(|picture| relative_errors(picture, reference))
                .fold([0.0; 2], |a, b| [a[0] + b[0], a[1] + b[1]]);
            curve.all.push((f64::from(spp), sums[0] / seeds as f64));
            curve.without_largest.push((f64::from(spp), sums[1] / seeds as f64));
        }
        curve
    }
}

pub(super) fn r5_convergence(effort: Effort) -> Outcome {
    // Sixteen times the samples of the last level, and better ones: its own error adds less than 0.02 to the slope.
    let (levels, seeds, reference) = effort.pick((6, 4, 512), (9, 8, 8192));
    let reference = pictures(prepared(&room(), reference), 1..2).remove(0);
    let independent = Curve::measure("independent", levels, seeds, &reference);
    let sobol = Curve::measure("sobol", levels, seeds, &reference);
    let slope = |points: &[(f64, f64)]| fitted_slope(points).unwrap_or(f64::NAN);
    let outcome = Outcome::new()
        .within("slope of independent samples", slope(&independent.all), -1.05, -0.95)
        .within("slope without the largest thousandth of pixels", slope(&independent.without_largest), -1.05, -0.95)
        .record("slope of Sobol samples", slope(&sobol.all));
    outcome.plot(Plot {
        caption: "Relative squared error of a room with a metal ball".into(),
        x: "samples a pixel".into(),
        y: "relative MSE".into(),
        floor: 1e-9,
        curves: vec![
            ("independent".into(), independent.all),
            ("independent, without the largest thousandth".into(), independent.without_largest),
            ("Sobol".into(), sobol.all),
        ],
    })
}
