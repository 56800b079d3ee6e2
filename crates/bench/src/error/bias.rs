//! Whether a renderer is right in the mean.

use statrs::distribution::{ContinuousCDF, Normal};

use crate::film::{Image, LayerKind};

/// Side of a block of pixels. Neighbours may share noise through a filter; the means of blocks hardly do.
const BLOCK: usize = 8;

/// The probability that all intervals of a report hold what they estimate.
const CONFIDENCE: f64 = 0.95;

/// How many standard deviations each of `intervals` two-sided intervals reaches, so that all of them together hold with
/// [`CONFIDENCE`] (Bonferroni). By the normal distribution: a picture has hundreds of blocks.
fn quantile(intervals: usize) -> f64 {
    Normal::standard().inverse_cdf(1.0 - 0.5 * (1.0 - CONFIDENCE) / intervals.max(1) as f64)
}

/// Sums of the luminance and of its difference from the reference, block by block, over any number of pictures.
#[derive(Clone, Debug, Default)]
pub(super) struct Blocks {
    /// Test minus reference, by block.
    differences: Vec<f64>,
    /// Of the reference, over all blocks.
    reference: f64,
}

impl Blocks {
    /// Adds a picture of the same size as all before.
    pub(super) fn add(&mut self, reference: &Image, test: &Image) {
        let (Some(r), Some(t)) = (reference.layer(LayerKind::Color), test.layer(LayerKind::Color)) else { return };
        let (width, height) = (reference.crop.width as usize, reference.crop.height as usize);
        let across = width.div_ceil(BLOCK);
        self.differences.resize(across * height.div_ceil(BLOCK), 0.0);
        for (i, (r, t)) in r.pixels().zip(t.pixels()).enumerate() {
            let block = i / width / BLOCK * across + i % width / BLOCK;
            let [r, t] = [luminance(r), luminance(t)];
            self.reference += r;
            if let Some(difference) = self.differences.get_mut(block) {
                *difference += t - r;
            }
        }
    }

    /// The mean of the tests over that of the reference, and the ends of its confidence interval, one of `intervals`
    /// that hold together with 95 %; `None` for a black reference or a single block. Under the hypothesis of no bias
    /// the differences of blocks are independent and centred, so that the variance of their sum is the sum of their
    /// squares; it holds the reference's noise too.
    pub(super) fn ratio(&self, intervals: usize) -> Option<[f64; 3]> {
        let n = self.differences.len() as f64;
        if n < 2.0 || !(self.reference > 0.0) {
            return None;
        }
        let mean = self.differences.iter().sum::<f64>() / n;
        let squares: f64 = self.differences.iter().map(|d| (d - mean).powi(2)).sum();
        let deviation = (squares * n / (n - 1.0)).sqrt();
        let ratio = 1.0 + mean * n / self.reference;
        let half = quantile(intervals) * deviation / self.reference;
        Some([ratio, ratio - half, ratio + half])
    }
}

fn luminance(pixel: &[f32]) -> f64 {
    let finite = |i: usize| pixel.get(i).copied().filter(|x| x.is_finite()).map_or(0.0, f64::from);
    0.2126 * finite(0) + 0.7152 * finite(1) + 0.0722 * finite(2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rng;

    fn picture(value: impl FnMut(usize) -> f32) -> Image {
        let size = [64, 32];
        let values: Vec<f32> = (0..64 * 32).map(value).collect();
        let data = values.into_iter().flat_map(|v| [v, v, v, 1.0]).collect();
        Image::of_color(size, data)
    }

    #[test]
    fn a_brighter_picture_shows_and_noise_does_not() {
        let reference = picture(|_| 2.0);
        let mut random = Rng::new(1);
        let (mut centred, mut brighter) = (Blocks::default(), Blocks::default());
        for _ in 0..3 {
            let noise: Vec<f32> = (0..64 * 32).map(|_| random.unit_f32() - 0.5).collect();
            centred.add(&reference, &picture(|i| 2.0 + noise[i]));
            brighter.add(&reference, &picture(|i| 2.02 + noise[i]));
        }
        let [ratio, low, high] = centred.ratio(1).unwrap();
        // Uniform noise has a deviation of 12^-1/2; the ratio's is that over twice the root of the number of values.
        let half = quantile(1) * (1.0f64 / 12.0).sqrt() / 2.0 / (3.0 * 2048.0f64).sqrt();
        assert!(((high - low) / 2.0 / half - 1.0).abs() < 0.6, "{half} {low} {high}");
        assert!((ratio - 1.0).abs() < 5.0 * half / quantile(1) && low < ratio && ratio < high);
        let [ratio, low, _] = brighter.ratio(1).unwrap();
        assert!((ratio - 1.01).abs() < 5.0 * half / quantile(1) && low > 1.0, "{ratio} {low}");
    }

    #[test]
    fn many_intervals_are_wider() {
        assert!((quantile(1) - 1.959_964).abs() < 1e-6 && (quantile(20) - 3.023_341).abs() < 1e-6);
    }

    #[test]
    fn equal_pictures_have_a_ratio_of_one_and_black_ones_none() {
        let mut blocks = Blocks::default();
        blocks.add(&picture(|i| i as f32), &picture(|i| i as f32));
        assert_eq!(blocks.ratio(1), Some([1.0; 3]));
        let mut black = Blocks::default();
        black.add(&picture(|_| 0.0), &picture(|_| 1.0));
        assert_eq!(black.ratio(1), None);
    }
}
