//! Comparison of two pictures in linear light.

use serde::Serialize;

use crate::error::{Error, Result};
use crate::film::{Image, LayerKind};

/// Added to the squared reference in the relative error, so that black pixels count for something finite.
pub const RELATIVE_FLOOR: f64 = 0.01;

/// One pixel in this many, those of the largest relative error, is left out of the trimmed mean.
const TRIMMED: usize = 1000;

/// How a picture differs from its reference. Numbers that are not finite count as zero.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Mean of `(test - reference)²` over pixels and channels.
    pub mse: f64,
    /// Mean of `(test - reference)² / (reference² + 0.01)`.
    pub relmse: f64,
    /// `relmse` without the worst thousandth of the pixels: what single fireflies do not move.
    pub relmse_trimmed: f64,
    /// `10 log10(peak² / mse)` in decibels; `None` if the pictures are equal.
    pub psnr: Option<f64>,
    /// The reference's largest value, which `psnr` refers to.
    pub peak: f64,
    /// Mean of the test over that of the reference, for red, green and blue.
    pub mean_ratio: [f64; 3],
    /// Pixels of the test that hold a NaN.
    pub nan: u64,
    /// Pixels of the test that hold an infinity.
    pub inf: u64,
}

/// Compares the colour of `test` with that of `reference`.
///
/// # Errors
/// [`Error::Usage`] if their sizes differ.
pub fn compare(reference: &Image, test: &Image) -> Result<Comparison> {
    let (r, t) = (reference.crop, test.crop);
    if [r.width, r.height] != [t.width, t.height] {
        let message = format!(
            "the pictures differ in size: the reference has {}x{} pixels, the test {}x{}",
            r.width, r.height, t.width, t.height
        );
        return Err(Error::Usage(message));
    }
    let (Some(reference), Some(test)) = (reference.layer(LayerKind::Color), test.layer(LayerKind::Color)) else {
        return Err(Error::Usage("a picture to compare has no colour".to_owned()));
    };
    let mut sums = Sums::default();
    let relative: Vec<f64> =
        reference.pixels().zip(test.pixels()).map(|(reference, test)| sums.add(&reference[..3], &test[..3])).collect();
    let values = 3.0 * r.area() as f64;
    let mse = sums.squares / values;
    let peak = sums.peak.unwrap_or(0.0);
    let ratio = |i: usize| sums.test[i] / sums.reference[i].max(1e-12 * r.area() as f64);
    Ok(Comparison {
        width: r.width,
        height: r.height,
        mse,
        relmse: sums.relative_squares / values,
        relmse_trimmed: trimmed_mean(relative),
        psnr: (mse > 0.0).then(|| 10.0 * (peak * peak / mse).log10()).filter(|psnr| psnr.is_finite()),
        peak,
        mean_ratio: [ratio(0), ratio(1), ratio(2)],
        nan: sums.nan,
        inf: sums.inf,
    })
}

/// The mean without the largest thousandth, rounded up; without the largest value at least, if there are several.
fn trimmed_mean(mut values: Vec<f64>) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    values.truncate((values.len() - values.len().div_ceil(TRIMMED)).max(1));
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

#[derive(Default)]
struct Sums {
    squares: f64,
    relative_squares: f64,
    peak: Option<f64>,
    reference: [f64; 3],
    test: [f64; 3],
    nan: u64,
    inf: u64,
}

impl Sums {
    /// Adds a pixel; the result is its relative squared error.
    fn add(&mut self, reference: &[f32], test: &[f32]) -> f64 {
        let mut relative = 0.0;
        self.nan += u64::from(test.iter().any(|v| v.is_nan()));
        self.inf += u64::from(test.iter().any(|v| v.is_infinite()));
        for i in 0..3 {
            let [r, t] = [reference[i], test[i]].map(|v| if v.is_finite() { f64::from(v) } else { 0.0 });
            let square = (t - r) * (t - r);
            self.squares += square;
            relative += square / (r * r + RELATIVE_FLOOR);
            self.peak = Some(self.peak.map_or(r, |peak| peak.max(r)));
            self.reference[i] += r;
            self.test[i] += t;
        }
        self.relative_squares += relative;
        relative / 3.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(values: &[[f32; 3]]) -> Image {
        let size = [values.len() as u32, 1];
        let data = values.iter().flat_map(|[r, g, b]| [*r, *g, *b, 1.0]).collect();
        Image::of_color(size, data)
    }

    #[test]
    fn figures_match_a_calculation_by_hand() {
        let reference = picture(&[[1.0, 2.0, 0.0], [0.5, 0.0, 4.0]]);
        let test = picture(&[[1.5, 2.0, 0.1], [0.5, f32::NAN, f32::INFINITY]]);
        let c = compare(&reference, &test).unwrap();
        assert!((c.mse - (0.25 + 0.01 + 16.0) / 6.0).abs() < 1e-7);
        assert!((c.relmse - (0.25 / 1.01 + 0.01 / 0.01 + 16.0 / 16.01) / 6.0).abs() < 1e-6);
        assert!((c.psnr.unwrap() - 10.0 * (16.0 / c.mse).log10()).abs() < 1e-9);
        assert!((c.mean_ratio[0] - 2.0 / 1.5).abs() < 1e-7 && c.mean_ratio[1] == 1.0);
        assert_eq!((c.nan, c.inf, c.peak), (1, 1, 4.0));
    }

    #[test]
    fn the_worst_thousandth_of_the_pixels_is_trimmed() {
        let reference = picture(&[[1.0; 3]; 2000]);
        let mut values = [[1.1f32; 3]; 2000];
        values[7] = [101.0; 3];
        values[1999] = [51.0, 1.0, 1.0];
        let c = compare(&reference, &picture(&values)).unwrap();
        assert!((c.relmse_trimmed - 0.01 / 1.01).abs() < 1e-6, "{c:?}");
        assert!((c.relmse - (1998.0 * 0.01 + 10000.0 + 2500.0 / 3.0) / 1.01 / 2000.0).abs() < 1e-4, "{c:?}");
        // Of few pixels the worst one goes, but never the only one.
        let few = compare(&picture(&[[1.0; 3]; 2]), &picture(&[[1.0; 3], [2.0; 3]])).unwrap();
        assert_eq!(
            (few.relmse_trimmed, compare(&picture(&[[1.0; 3]]), &picture(&[[2.0; 3]])).unwrap().relmse_trimmed > 0.9),
            (0.0, true)
        );
    }

    #[test]
    fn equal_pictures_have_no_error_and_other_sizes_are_refused() {
        let a = picture(&[[1.0, 2.0, 0.0], [0.5, 0.0, 4.0]]);
        let c = compare(&a, &a).unwrap();
        assert_eq!((c.mse, c.relmse, c.psnr), (0.0, 0.0, None));
        assert!(serde_json::to_string(&c).unwrap().contains("\"psnr\":null"));
        assert!(matches!(compare(&a, &picture(&[[1.0; 3]])), Err(Error::Usage(_))));
        let black = compare(&picture(&[[0.0; 3]]), &picture(&[[1.0; 3]])).unwrap();
        assert_eq!(black.psnr, None);
    }
}
