use super::*;
use crate::sampling::statistics::{MIN_P_VALUE, chi_squared_p_value};

const KINDS: [SamplerKind; 2] = [SamplerKind::Sobol, SamplerKind::Independent];

#[test]
fn every_elementary_interval_holds_one_sample() {
    for (pixel, set) in [(1, 0), (77, 3), (0xdead_beef, 40)] {
        for k in 2..=10u32 {
            // Also blocks that begin later, beyond the 16 bits of common tables too.
            for start in [0, 5 << k, 1 << 16, 3 << 20] {
                let points: Vec<_> = (start..start + (1 << k)).map(|i| sobol_4d(PixelSeed(pixel), i, set)).collect();
                for dimension in 0..4 {
                    assert_strata(&points, k, |p| u64::from(p[dimension] >> (32 - k)));
                }
                // The first two dimensions are a (0, 2)-sequence.
                for a in 0..=k {
                    assert_strata(&points, k, |p| (u64::from(p[0]) >> (32 - a)) << (k - a) | u64::from(p[1]) >> (32 - (k - a)));
                }
            }
        }
    }
}

fn assert_strata(points: &[[u32; 4]], k: u32, cell: impl Fn(&[u32; 4]) -> u64) {
    let mut seen = vec![false; 1 << k];
    for p in points {
        let cell = cell(p) as usize;
        assert!(!seen[cell]);
        seen[cell] = true;
    }
}

#[test]
fn sobols_first_dimensions_are_the_tabulated_ones() {
    // The first eight points of the sequence in Joe and Kuo's table, in eighths.
    let directions = sobol_directions();
    let point = |index: usize, dimension: usize| {
        let bits = (0..3).filter(|bit| index >> bit & 1 == 1).fold(0, |sum, bit| sum ^ directions[dimension][bit]);
        bits >> 29
    };
    let expected = [[0, 4, 2, 6, 1, 5, 3, 7], [0, 4, 6, 2, 5, 1, 3, 7], [0, 4, 6, 2, 3, 7, 5, 1], [0, 4, 6, 2, 1, 5, 7, 3]];
    for (dimension, row) in expected.into_iter().enumerate() {
        let column: Vec<_> = (0..8).map(|index| point(index, dimension)).collect();
        assert_eq!(column, row);
    }
}

#[test]
fn samples_do_not_depend_on_the_order() {
    for kind in KINDS {
        let sampler = Sampler::new(kind, 7);
        let pixel = sampler.pixel(10, 20);
        let forward: Vec<_> = (0..64).map(|i| sampler.sample_4d(pixel, i % 8, i / 8)).collect();
        for i in (0..64).rev() {
            assert_eq!(Sampler::new(kind, 7).sample_4d(sampler.pixel(10, 20), i % 8, i / 8), forward[i as usize]);
        }
        assert_ne!(Sampler::new(kind, 8).pixel(10, 20), pixel);
        assert_ne!(sampler.pixel(20, 10), pixel);
    }
}

#[test]
fn samples_stay_below_one() {
    for kind in KINDS {
        let sampler = Sampler::new(kind, 0);
        let pixel = sampler.pixel(0, 0);
        let (mut least, mut largest) = (1f32, 0f32);
        for i in 0..1 << 22 {
            for x in sampler.sample_4d(pixel, i, 1) {
                least = least.min(x);
                largest = largest.max(x);
            }
        }
        assert!(least >= 0.0 && largest < 1.0 && least < 1e-5 && largest > 1.0 - 1e-5, "{least} {largest}");
    }
}

#[test]
fn sobol_is_stratified_and_independent_is_uniform() {
    for set in [0, 1, 63, 64, 1000] {
        let sobol = Sampler::new(SamplerKind::Sobol, 3);
        let mut squares = vec![0u32; 256];
        for i in 0..1024 {
            let u = sobol.sample_4d(sobol.pixel(5, 6), i, set);
            squares[(u[0] * 16.0) as usize * 16 + (u[1] * 16.0) as usize] += 1;
        }
        assert!(squares.iter().all(|&n| n == 4));

        let independent = Sampler::new(SamplerKind::Independent, 3);
        for (a, b) in [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)] {
            let mut squares = vec![0u32; 256];
            for i in 0..100_000 {
                let u = independent.sample_4d(independent.pixel(5, 6), i, set);
                squares[(u[a] * 16.0) as usize * 16 + (u[b] * 16.0) as usize] += 1;
            }
            let p = chi_squared_p_value(&squares, &[100_000.0 / 256.0; 256]);
            assert!(p > MIN_P_VALUE, "{set} {a} {b}: {p}");
        }
    }
}

#[test]
fn first_samples_are_uniform_over_pixels_and_sets() {
    // The same sample across pixels, and across sets: hashing alone spreads it.
    for kind in KINDS {
        let sampler = Sampler::new(kind, 11);
        let mut over_pixels = vec![0u32; 256];
        let mut over_sets = vec![0u32; 256];
        for i in 0..65_536 {
            let u = sampler.sample_4d(sampler.pixel(i & 255, i >> 8), 0, 0);
            over_pixels[(u[1] * 16.0) as usize * 16 + (u[3] * 16.0) as usize] += 1;
            let u = sampler.sample_4d(sampler.pixel(0, 0), 1, i);
            over_sets[(u[0] * 16.0) as usize * 16 + (u[2] * 16.0) as usize] += 1;
        }
        for counts in [over_pixels, over_sets] {
            let p = chi_squared_p_value(&counts, &[256.0; 256]);
            assert!(p > MIN_P_VALUE, "{kind:?}: {p}");
        }
    }
}

#[test]
fn pixels_and_sets_are_not_correlated() {
    const COUNT: u32 = 16_384;
    for kind in KINDS {
        let sampler = Sampler::new(kind, 0);
        let correlate = |a: (PixelSeed, u32), b: (PixelSeed, u32), shift: usize| {
            let mut sums = [0f64; 4];
            for i in 0..COUNT {
                let (x, y) = (sampler.sample_4d(a.0, i, a.1), sampler.sample_4d(b.0, i, b.1));
                for lane in 0..4 {
                    sums[lane] += f64::from(x[lane] - 0.5) * f64::from(y[(lane + shift) % 4] - 0.5);
                }
            }
            for sum in sums {
                // Twelve times the mean product is the correlation; five standard deviations.
                let correlation = 12.0 * sum / f64::from(COUNT);
                assert!(correlation.abs() < 5.0 / f64::from(COUNT).sqrt(), "{kind:?} {a:?} {b:?} {shift}: {correlation}");
            }
        };
        let origin = sampler.pixel(0, 0);
        for set in 0..16 {
            for other in [sampler.pixel(1, 0), sampler.pixel(0, 1), sampler.pixel(16, 16)] {
                correlate((origin, set), (other, set), 0);
            }
            for shift in 0..4 {
                correlate((origin, set), (origin, set + 1), shift);
            }
        }
    }
}

#[test]
fn errors_fall_at_the_rates_of_their_kind() {
    // Owen scrambling reaches -3/2 for a smooth integrand and -3/4 for a disk; independent samples -1/2 for both.
    let smooth = |u: [f32; 4]| f64::from(u[0] * u[1]) * (-f64::from(u[0]) - 0.5 * f64::from(u[1])).exp();
    let disk = |u: [f32; 4]| if u[0] * u[0] + u[1] * u[1] < 0.8 { 1.0 } else { 0.0 };
    let disk_area = 0.8 * std::f64::consts::FRAC_PI_4;
    // ∫ u e^-u and ∫ v e^(-v/2) over the unit interval.
    let smooth_integral = (1.0 - 2.0 * (-1f64).exp()) * (4.0 - 6.0 * (-0.5f64).exp());

    assert!(slope(SamplerKind::Sobol, smooth, smooth_integral) < -1.3);
    assert!(slope(SamplerKind::Sobol, disk, disk_area) < -0.68);
    assert!((slope(SamplerKind::Independent, smooth, smooth_integral) + 0.5).abs() < 0.08);
    assert!((slope(SamplerKind::Independent, disk, disk_area) + 0.5).abs() < 0.08);
}

/// Slope of log error against log count between 16 and 4096 samples, over 128 scrambles.
fn slope(kind: SamplerKind, f: impl Fn([f32; 4]) -> f64, exact: f64) -> f64 {
    let sampler = Sampler::new(kind, 5);
    let points: Vec<_> = (4..=12)
        .map(|k| {
            let squared: f64 = (0..128)
                .map(|pixel| {
                    let sum: f64 = (0..1 << k).map(|i| f(sampler.sample_4d(sampler.pixel(pixel, k), i, 2))).sum();
                    (sum / f64::from(1u32 << k) - exact).powi(2)
                })
                .sum();
            (f64::from(k), 0.5 * (squared / 128.0).log2())
        })
        .collect();
    let n = points.len() as f64;
    let mean = points.iter().fold((0.0, 0.0), |m, p| (m.0 + p.0 / n, m.1 + p.1 / n));
    let covariance: f64 = points.iter().map(|p| (p.0 - mean.0) * (p.1 - mean.1)).sum();
    covariance / points.iter().map(|p| (p.0 - mean.0).powi(2)).sum::<f64>()
}
