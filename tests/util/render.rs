//! Scenes written as JSON values, rendered and judged.

use serde_json::{Value, json};
pub use steradian_bench::stability::render::*;

/// What an estimate is held to.
pub trait AssertIs {
    /// Asserts that the mean agrees with `expected`: 5.5 standard errors (two-sided false-alarm rate 4e-8 for a normal
    /// mean, below 1e-6 with 255 degrees of freedom), or the relative rounding bound where there is no noise.
    #[track_caller]
    fn assert_is(&self, expected: f64, what: &str);
}

impl AssertIs for Estimate {
    #[track_caller]
    fn assert_is(&self, expected: f64, what: &str) {
        let bound = 5.5 * self.error + 1e-5 * expected.abs();
        assert!((self.mean - expected).abs() <= bound, "{what}: {} +- {}, expected {expected}", self.mean, self.error);
    }
}

/// Asserts the irradiance on the floor of [`floor_probe`], by every strategy.
#[track_caller]
pub fn assert_irradiance(scene: &Value, expected: f64, what: &str) {
    for strategy in ["mis", "light", "bsdf"] {
        let mut scene = scene.clone();
        scene["integrator"]["strategy"] = json!(strategy);
        let estimate = Estimate::of(&render(&scene), 0);
        estimate.assert_is(expected / std::f64::consts::PI, &format!("{what}, {strategy}"));
    }
}

/// Welch's test for each block: t with about 14 degrees of freedom, |t| < 11 has a false-alarm rate below 1e-7.
#[track_caller]
pub fn assert_blocks_agree(a: &[Vec<f64>], b: &[Vec<f64>], what: &str) {
    let moments = |runs: &[Vec<f64>], block: usize| {
        let n = runs.len() as f64;
        let mean = runs.iter().map(|r| r[block]).sum::<f64>() / n;
        let variance = runs.iter().map(|r| (r[block] - mean).powi(2)).sum::<f64>() / (n - 1.0);
        (mean, variance / n)
    };
    for block in 0..a[0].len() {
        let ((ma, va), (mb, vb)) = (moments(a, block), moments(b, block));
        let t = (ma - mb) / (va + vb).sqrt();
        assert!(t.abs() < 11.0 && ma > 0.0, "{what}, block {block}: {ma} against {mb}, t = {t}");
    }
}
