use super::*;
use crate::film::shared_weights::OFFSET_CELLS;

/// Integral of one axis over `[a, b]`.
fn integral(desc: &FilterDesc, a: f64, b: f64, f: impl Fn(f64) -> f64) -> f64 {
    let steps = 2000;
    let h = (b - a) / f64::from(steps);
    (0..steps).map(|i| a + (f64::from(i) + 0.5) * h).map(|x| f(evaluate(desc, x)) * h).sum()
}

/// The largest difference between the sampled distribution (weights included) and the filter's, over a grid of random
/// numbers.
#[test]
fn the_sampled_distribution_is_the_filters() {
    for desc in Filter::EXAMPLES {
        let r = f64::from(desc.radius());
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

/// First and second moments with weights: unbiased for the filter itself, negative lobes included.
#[test]
fn weighted_moments_match_the_filter() {
    for desc in Filter::EXAMPLES {
        let filter = Filter::new(&desc);
        let r = f64::from(filter.radius());
        let total = integral(&desc, -r, r, |f| f);
        let steps = 20_000;
        let h = 2.0 * r / f64::from(steps);
        let variance: f64 =
            (0..steps).map(|i| -r + (f64::from(i) + 0.5) * h).map(|x| evaluate(&desc, x) * x * x * h).sum::<f64>()
                / total;
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
    for desc in Filter::EXAMPLES {
        let filter = Filter::new(&desc);
        for u in ends {
            let sample = filter.sample([u, 1.0 - f32::EPSILON]);
            assert!(sample.offset.is_finite() && sample.weight.is_finite(), "{desc:?} {u}: {sample:?}");
            assert!(sample.offset.x.abs() <= filter.radius(), "{desc:?} {u}: {sample:?}");
            assert!(sample.weight.abs() < 4.0, "{desc:?} {u}: {sample:?}");
        }
    }
}

/// The first pixel that a sample at an offset reaches along an axis, and the weights from there.
fn taps(filter: &Filter, offset: f32) -> (i32, Vec<f32>) {
    fn counted<const N: usize>(shared: &SharedWeights, offset: f32) -> (i32, Vec<f32>) {
        let taps = shared.taps::<N>(offset);
        (taps.first, taps.weights[..taps.count].to_vec())
    }
    let shared = filter.shared_weights().unwrap();
    match shared.count() {
        2 => counted::<2>(shared, offset),
        3 => counted::<3>(shared, offset),
        4 => counted::<4>(shared, offset),
        _ => counted::<MAX_TAPS>(shared, offset),
    }
}

#[test]
fn weights_of_shared_samples_are_the_filters() {
    for desc in Filter::examples(FilterSamplesDesc::Shared) {
        let filter = Filter::new(&desc);
        if !filter.is_shared() {
            continue;
        }
        let (r, border) = (f64::from(desc.radius()), filter.border() as i32);
        let total = integral(&desc, -r, r, |f| f);
        let (count, mut sum) = (40_000, 0.0);
        for i in 0..count {
            let offset = (i as f32 + 0.5) / count as f32 - 0.5;
            let (first, weights) = taps(&filter, offset);
            assert!(
                first >= -border && first + weights.len() as i32 <= border + 1,
                "{desc:?} {offset}: {first} {weights:?}"
            );
            for pixel in -border..=border {
                let weight = weights.get((pixel - first) as usize).copied().unwrap_or(0.0);
                let x = (f64::from(pixel) - f64::from(offset)).abs();
                // Within a cell of the support's end, kinks are smoothed.
                if (x - r).abs() > 1.0 / OFFSET_CELLS as f64 {
                    assert!(
                        (f64::from(weight) - evaluate(&desc, x) / total).abs() < 3e-5,
                        "{desc:?} {offset} {pixel}: {weight}"
                    );
                }
                sum += f64::from(weight) / f64::from(count);
            }
        }
        // Both ends of a box are off by up to half of a cell.
        let tolerance = if matches!(desc, FilterDesc::Box { .. }) { 1.0 / OFFSET_CELLS as f64 } else { 1e-5 };
        assert!((sum - 1.0).abs() < tolerance, "{desc:?}: {sum}");
    }
}
