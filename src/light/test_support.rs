//! The chi-squared test, for tests of sampling.

use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Asserts that counts follow probabilities, at a false-alarm rate of 1e-6. Cells of fewer than 5 expected counts are
/// pooled.
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
