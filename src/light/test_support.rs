//! Random numbers and the chi-squared test, for tests of sampling.

use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::math::DVec3;

/// A small generator (SplitMix64).
pub struct Random(pub u64);

impl Random {
    /// Uniform in `[0, 1)`.
    pub fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / (1u32 << 24) as f32
    }

    /// Uniform in the unit square.
    pub fn pair(&mut self) -> [f32; 2] {
        [self.next(), self.next()]
    }

    /// Uniform on the unit sphere.
    pub fn direction(&mut self) -> DVec3 {
        let z = 1.0 - 2.0 * f64::from(self.next());
        let (sin, cos) = (std::f64::consts::TAU * f64::from(self.next())).sin_cos();
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * cos, r * sin, z)
    }
}

/// Asserts that counts follow probabilities, at a false-alarm rate of 1e-6. Cells of fewer than 5 expected counts are pooled.
pub fn assert_chi_squared(counts: &[u32], probabilities: &[f64], what: &str) {
    let n: f64 = counts.iter().map(|&c| f64::from(c)).sum();
    let (mut statistic, mut cells) = (0.0, 0u32);
    let (mut pooled_count, mut pooled) = (0.0, 0.0);
    for (&count, &probability) in counts.iter().zip(probabilities) {
        let expected = n * probability;
        assert!(expected > 0.0 || count == 0, "{what}: {count} samples where none can be");
        if expected < 5.0 {
            pooled_count += f64::from(count);
            pooled += expected;
        } else {
            statistic += (f64::from(count) - expected).powi(2) / expected;
            cells += 1;
        }
    }
    if pooled >= 5.0 {
        statistic += (pooled_count - pooled).powi(2) / pooled;
        cells += 1;
    }
    if cells < 2 {
        return;
    }
    let p = ChiSquared::new(f64::from(cells - 1)).unwrap().sf(statistic);
    assert!(p > 1e-6, "{what}: chi-squared {statistic} over {cells} cells, p = {p}");
}
