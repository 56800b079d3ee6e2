//! FLIP: how much two pictures seem to differ when they are shown in turn, from 0 to 1 by pixel.
//!
//! Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström and Fairchild, "FLIP: A Difference Evaluator for Alternating
//! Images" (2020), for what a screen shows; Andersson, Nilsson, Shirley and Akenine-Möller, "Visualizing Errors in
//! Rendered High Dynamic Range Images" (2021), for what a renderer makes: the largest such difference over exposures
//! from where the brightest pixel is not blown out to where the median is bright. Seen from 0.7 m on a screen of 3840
//! pixels and 0.7 m, as the authors do by default.

mod color;
mod filter;

use rayon::prelude::*;

use self::color::{Plane, Planes};
use self::filter::{DETECTORS, Kernel};
use crate::error::{Error, Result};
use crate::film::{Image, LayerKind};

/// Pixels per degree of the visual angle.
const PIXELS_PER_DEGREE: f64 = 0.7 * 3840.0 / 0.7 * std::f64::consts::PI / 180.0;

/// Exponents of the colour difference and of the feature difference.
const COLOR_EXPONENT: f32 = 0.7;
const FEATURE_EXPONENT: f32 = 0.5;

/// Colour differences up to this share of the largest one are spread over this share of the range.
const BEND: f32 = 0.4;
const BEND_TO: f32 = 0.95;

/// The brightness after tone mapping that the ends of the exposures give to the brightest pixel and to the median.
const SHOWN: f64 = 0.85;

/// Coefficients of the tone mapper `(k0 x² + k1 x) / (k3 x² + k4 x + k5)`, an approximation of the curve of ACES
/// (Narkowicz) without its exposure.
const TONE: [f64; 5] = [0.36 * 2.51, 0.6 * 0.03, 0.36 * 2.43, 0.6 * 0.59, 0.14];

/// The difference by pixel of two pictures in linear light, row by row from the top; what is negative or not finite
/// counts as black.
///
/// # Errors
/// [`Error::Usage`] if they differ in size or have no colour.
pub fn hdr_flip(reference: &Image, test: &Image) -> Result<Vec<f32>> {
    let [reference, test] = [planes(reference)?, planes(test)?];
    if reference.size != test.size {
        return Err(Error::Usage("FLIP compares pictures of one size".into()));
    }
    let mut largest = vec![0.0f32; reference.len()];
    for exposure in exposures(&reference) {
        let factor = exposure.exp2();
        let found = difference(&reference.map(|x| tone_map(factor, x)), &test.map(|x| tone_map(factor, x)));
        for (largest, found) in largest.iter_mut().zip(found) {
            *largest = largest.max(found);
        }
    }
    Ok(largest)
}

/// The mean over pixels.
pub fn mean(differences: &[f32]) -> f64 {
    differences.iter().copied().map(f64::from).sum::<f64>() / differences.len().max(1) as f64
}

fn planes(image: &Image) -> Result<Planes> {
    let layer =
        image.layer(LayerKind::Color).ok_or_else(|| Error::Usage("a picture to compare has no colour".into()))?;
    let plane = |c: usize| layer.channel(c).map(|x| if x.is_finite() { x.max(0.0) } else { 0.0 }).collect();
    Ok(Planes { size: [image.crop.width as usize, image.crop.height as usize], planes: [plane(0), plane(1), plane(2)] })
}

/// Exposures in stops, evenly spaced, a stop or less apart; none for a black picture.
fn exposures(reference: &Planes) -> Vec<f64> {
    let mut luminance: Vec<f64> = (0..reference.len())
        .map(|i| {
            let [r, g, b] = reference.pixel(i).map(f64::from);
            0.2126 * r + 0.7152 * g + 0.0722 * b
        })
        .collect();
    luminance.sort_unstable_by(f64::total_cmp);
    let n = luminance.len();
    let Some(&brightest) = luminance.last().filter(|brightest| **brightest > 0.0) else { return Vec::new() };
    let median = (0.5 * (luminance[(n - 1) / 2] + luminance[n / 2])).max(f64::from(f32::EPSILON));
    let shown = inverse_tone(SHOWN);
    let (start, stop) = ((shown / brightest).log2(), (shown / median).log2());
    let count = ((stop - start).ceil() as usize).max(2);
    (0..count).map(|i| start + (stop - start).max(0.0) * i as f64 / (count - 1) as f64).collect()
}

fn tone_map(factor: f64, x: f32) -> f32 {
    let [k0, k1, k3, k4, k5] = TONE;
    let x = factor * f64::from(x);
    ((k0 * x + k1) * x / ((k3 * x + k4) * x + k5)).clamp(0.0, 1.0) as f32
}

/// The brightness that the tone mapper maps to `y`.
fn inverse_tone(y: f64) -> f64 {
    let [k0, k1, k3, k4, k5] = TONE;
    let half = 0.5 * (k1 - k4 * y) / (k0 - k3 * y);
    -half + (half * half + k5 * y / (k0 - k3 * y)).sqrt()
}

/// The difference by pixel of what a screen shows, linear from 0 to 1.
fn difference(reference: &Planes, test: &Planes) -> Vec<f32> {
    let [reference, test] = [reference, test].map(|picture| Seen::new(&picture.to_opponent()));
    let largest = color::distance([0.0, 1.0, 0.0], [0.0, 0.0, 1.0]).powf(COLOR_EXPONENT);
    let pixel = |i: usize| {
        let of_color =
            spread(color::distance(reference.colors.pixel(i), test.colors.pixel(i)).powf(COLOR_EXPONENT), largest);
        let features = (0..2).map(|k| (reference.features[k][i] - test.features[k][i]).abs()).fold(0.0, f32::max);
        of_color.powf(1.0 - (features * std::f32::consts::FRAC_1_SQRT_2).powf(FEATURE_EXPONENT))
    };
    (0..reference.colors.len()).into_par_iter().with_min_len(1024).map(pixel).collect()
}

/// Small differences, which are most, get most of the range.
fn spread(difference: f32, largest: f32) -> f32 {
    let bend = BEND * largest;
    if difference < bend {
        BEND_TO / bend * difference
    } else {
        BEND_TO + (difference - bend) / (largest - bend) * (1.0 - BEND_TO)
    }
}

/// What the eye makes of a picture at a distance.
struct Seen {
    /// Linear colours without the detail that is too fine.
    colors: Planes,
    /// Strength of edges and of points.
    features: [Plane; 2],
}

impl Seen {
    fn new(opponent: &Planes) -> Self {
        let size = opponent.size;
        let sensitivities = filter::sensitivities(PIXELS_PER_DEGREE);
        let mut filtered = opponent.clone();
        for (plane, gaussians) in filtered.planes.iter_mut().zip(&sensitivities) {
            let source = std::mem::take(plane);
            *plane = vec![0.0; source.len()];
            for Kernel { across, down } in gaussians {
                let part = filter::convolve(&source, size, across, down);
                plane.iter_mut().zip(part).for_each(|(sum, part)| *sum += part);
            }
        }
        let lightness: Plane = opponent.planes[0].iter().map(|y| (y + 16.0) / 116.0).collect();
        let features = DETECTORS.map(|detector| {
            let Kernel { across, down } = detector(PIXELS_PER_DEGREE);
            let horizontal = filter::convolve(&lightness, size, &across, &down);
            let vertical = filter::convolve(&lightness, size, &down, &across);
            horizontal.iter().zip(vertical).map(|(x, y)| x.hypot(y)).collect()
        });
        Self { colors: filtered.to_screen(), features }
    }
}

#[cfg(test)]
mod tests;
