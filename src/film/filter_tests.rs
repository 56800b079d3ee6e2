use super::*;

use statrs::distribution::{ChiSquared, ContinuousCDF};

fn filters() -> Vec<FilterDesc> {
    let mut filters = vec![
        FilterDesc::Box { radius: 0.5 },
        FilterDesc::Box { radius: 0.8 },
        FilterDesc::Tent { radius: 1.0 },
        FilterDesc::Gaussian { radius: 1.5, sigma: 0.5 },
        FilterDesc::Gaussian { radius: 2.0, sigma: 3.0 },
        FilterDesc::BlackmanHarris { radius: 1.5 },
    ];
    for (b, c) in [(1.0 / 3.0, 1.0 / 3.0), (1.0, 0.0), (0.0, 0.5), (0.0, 1.0)] {
        filters.push(FilterDesc::Mitchell { radius: 2.0, b, c });
    }
    filters
}

/// A small generator (PCG), enough for tests.
struct Rng(u64);

impl Rng {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let word = ((self.0 >> 18) ^ self.0) >> 27;
        let rotated = (word as u32).rotate_right((self.0 >> 59) as u32);
        (rotated >> 8) as f32 / 16_777_216.0
    }
}

/// Integral of one axis over `[a, b]`.
fn integral(desc: &FilterDesc, a: f64, b: f64, f: impl Fn(f64) -> f64) -> f64 {
    let steps = 2000;
    let h = (b - a) / f64::from(steps);
    (0..steps).map(|i| a + (f64::from(i) + 0.5) * h).map(|x| f(evaluate(desc, x)) * h).sum()
}

/// M1: the closed forms of the integrals; outside the radius the filters are zero.
#[test]
fn integrals_match_their_closed_forms() {
    for desc in filters() {
        let r = f64::from(radius(&desc));
        let expected = match desc {
            FilterDesc::Box { .. } => 2.0 * r,
            FilterDesc::Tent { .. } => r,
            FilterDesc::Gaussian { sigma, .. } => {
                let sigma = f64::from(sigma);
                let erf = statrs::function::erf::erf(r / (sigma * 2f64.sqrt()));
                sigma * TAU.sqrt() * erf - 2.0 * r * (-0.5 * (r / sigma).powi(2)).exp()
            }
            FilterDesc::BlackmanHarris { .. } => 0.358_75 * 2.0 * r,
            FilterDesc::Mitchell { .. } => 0.5 * r,
        };
        let measured = integral(&desc, -r, r, |f| f);
        assert!((measured - expected).abs() < 1e-5 * expected, "{desc:?}: {measured} {expected}");
        let filter = Filter::new(&desc);
        assert_eq!(filter.evaluate(Vec2::new(1.001 * filter.radius(), 0.0)), 0.0);
    }
}

/// The largest difference between the sampled distribution (weights included) and the filter's, over a grid of random numbers.
#[test]
fn the_sampled_distribution_is_the_filters() {
    for desc in filters() {
        let r = f64::from(radius(&desc));
        let filter = Filter::new(&desc);
        let n = 1 << 19;
        let total = integral(&desc, 0.0, r, |f| f);
        let (mut sum, mut last, mut inside, mut worst) = (0.0f64, 0.0f64, 0.0f64, 0.0f64);
        for i in 0..n {
            // The right half: distances grow with u. The other axis is fixed; its weight divides out.
            let u = 0.5 + 0.5 * (i as f32 + 0.5) / n as f32;
            let sample = filter.sample([u, 0.75]);
            let other = match &filter.kernel {
                Kernel::Table(table) => table.signed_integral.map_or(1.0, |s| table.sample_axis(0.75).weight(&desc, s)),
                _ => 1.0,
            };
            let x = f64::from(sample.offset.x);
            assert!(x >= last && x <= r, "{desc:?}: {x} after {last}");
            inside += (evaluate(&desc, x) + evaluate(&desc, last)) * 0.5 * (x - last);
            last = x;
            let weight = f64::from(sample.weight) / other;
            let before_half = sum + 0.5 * weight;
            sum += weight;
            worst = worst.max((before_half / f64::from(n) - inside / total).abs());
        }
        // Where the sign changes, the grid of random numbers is off by up to its step, 2e-6, times the jump.
        let tolerance = if filter.is_signed() { 6e-6 } else { 1e-6 };
        assert!(worst < tolerance, "{desc:?}: {worst:e}");
        assert!((sum / f64::from(n) - 1.0).abs() < tolerance, "{desc:?}: {}", sum / f64::from(n));
    }
}

/// χ² of 10^5 samples in 16 x 16 cells against the filter's absolute value.
#[test]
fn samples_pass_a_chi_square_test() {
    const SIDE: usize = 16;
    let mut rng = Rng(7);
    for desc in filters() {
        let filter = Filter::new(&desc);
        let r = f64::from(filter.radius());
        let edges = |i: usize| -r + 2.0 * r * i as f64 / SIDE as f64;
        let axis: Vec<f64> = (0..SIDE).map(|i| integral(&desc, edges(i), edges(i + 1), f64::abs)).collect();
        let total: f64 = axis.iter().sum();
        let n = 100_000;
        let mut counts = vec![0u32; SIDE * SIDE];
        for _ in 0..n {
            let offset = filter.sample([rng.next(), rng.next()]).offset;
            let cell = |x: f32| (((f64::from(x) / r + 1.0) * 0.5 * SIDE as f64) as usize).min(SIDE - 1);
            counts[cell(offset.y) * SIDE + cell(offset.x)] += 1;
        }
        let (mut statistic, mut cells, mut rest, mut rest_expected) = (0.0, 0, 0.0, 0.0);
        for (i, count) in counts.iter().enumerate() {
            let expected = f64::from(n) * axis[i / SIDE] * axis[i % SIDE] / (total * total);
            if expected < 8.0 {
                rest += f64::from(*count);
                rest_expected += expected;
            } else {
                statistic += (f64::from(*count) - expected).powi(2) / expected;
                cells += 1;
            }
        }
        if rest_expected > 8.0 {
            statistic += (rest - rest_expected).powi(2) / rest_expected;
            cells += 1;
        }
        let p = 1.0 - ChiSquared::new(f64::from(cells - 1)).unwrap().cdf(statistic);
        assert!(p > 1e-7, "{desc:?}: p = {p:e}");
    }
}

/// First and second moments with weights: unbiased for the filter itself, negative lobes included.
#[test]
fn weighted_moments_match_the_filter() {
    for desc in filters() {
        let filter = Filter::new(&desc);
        let r = f64::from(filter.radius());
        let total = integral(&desc, -r, r, |f| f);
        let steps = 20_000;
        let h = 2.0 * r / f64::from(steps);
        let variance: f64 = (0..steps).map(|i| -r + (f64::from(i) + 0.5) * h).map(|x| evaluate(&desc, x) * x * x * h).sum::<f64>() / total;
        let side = 1024;
        let (mut mean, mut second, mut weights) = (0.0, 0.0, 0.0);
        for i in 0..side {
            for j in 0..side {
                let sample = filter.sample([(i as f32 + 0.5) / side as f32, (j as f32 + 0.5) / side as f32]);
                let (x, w) = (f64::from(sample.offset.x), f64::from(sample.weight));
                mean += w * x;
                second += w * x * x;
                weights += w;
            }
        }
        let n = f64::from(side * side);
        // Where the sign changes, the grid is off by up to its step, 1e-3, times the jump.
        let tolerance = if filter.is_signed() { 4e-3 } else { 2e-4 };
        assert!((weights / n - 1.0).abs() < tolerance, "{desc:?}: {}", weights / n);
        assert!((mean / n).abs() < 1e-5, "{desc:?}: {}", mean / n);
        assert!((second / n - variance).abs() < tolerance * r * r, "{desc:?}: {} {variance}", second / n);
    }
}

#[test]
fn extreme_random_numbers_stay_within_the_radius() {
    let ends = [0.0, f32::MIN_POSITIVE, 0.5f32.next_down(), 0.5, 0.5f32.next_up(), 1.0f32.next_down()];
    for desc in filters() {
        let filter = Filter::new(&desc);
        for u in ends {
            let sample = filter.sample([u, 1.0 - f32::EPSILON]);
            assert!(sample.offset.is_finite() && sample.weight.is_finite(), "{desc:?} {u}: {sample:?}");
            assert!(sample.offset.x.abs() <= filter.radius(), "{desc:?} {u}: {sample:?}");
            assert!(sample.weight.abs() < 4.0, "{desc:?} {u}: {sample:?}");
        }
    }
}
