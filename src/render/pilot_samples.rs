//! Samples of pixels from all over a picture, which show how much variance a method saves. They are not part of the
//! picture: what is decided by them favours no sample of it.
//!
//! As many samples without the method hardly ever find the light that it leads to, and seem to have little variance.
//! Those with it find that light, and the ratio of the densities gives what it would add to the variance without.

use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

use super::TILE_SIZE;
use super::tile_renderer::TileWorkspace;
use crate::film::Crop;
use crate::integrator::{PilotMoments, RayCounts};
use crate::math::random::hash64;

/// Pixels of a pilot, by pixel of the picture.
const PIXELS_PER_PIXEL: f64 = 1.0 / 128.0;

/// The fewest and the most of them.
const PIXELS: [f64; 2] = [512.0, 8192.0];

/// The index of the first sample of pilot pixels, beyond those of pictures.
pub(super) const FIRST_SAMPLE: u32 = 1 << 31;

/// What relative variances are related to beside the square of the colour, over the square of the picture's mean.
const FLOOR: f64 = 0.01;

/// Parts of a pilot, each of which is left out once to find the deviation of a result.
const PARTS: usize = 16;

/// The pixels of a pilot, row by row.
#[derive(Clone, Debug)]
struct PilotPixels {
    pixels: Vec<[u32; 2]>,
    columns: usize,
}

/// Means over the samples of a pilot pixel, by channel.
#[derive(Clone, Copy, Debug, Default)]
struct PilotPixel {
    radiance: [f64; 3],
    square: [f64; 3],
    /// Of the same samples without the method.
    radiance_without: [f64; 3],
    square_without: [f64; 3],
    excess: [f64; 3],
    shared: [f64; 3],
}

impl PilotPixel {
    /// The sums over the channels of the variances of one of so many samples with the method and without it, times
    /// these factors.
    fn weighted_variances(&self, factors: [f64; 3], samples: u32) -> [f64; 2] {
        let samples = f64::from(samples);
        let shown = |mean: f64, square: f64| (square - mean * mean).max(0.0) * samples / (samples - 1.0);
        let with = |k: usize| shown(self.radiance[k], self.square[k]) + self.shared[k];
        let without = |k: usize| shown(self.radiance_without[k], self.square_without[k]) + self.excess[k];
        [(0..3).map(|k| factors[k] * with(k)).sum(), (0..3).map(|k| factors[k] * without(k)).sum()]
    }
}

/// The samples of a pilot.
#[derive(Clone, Debug)]
pub(super) struct PilotSamples {
    pixels: PilotPixels,
    means: Vec<PilotPixel>,
    /// Samples of a pixel.
    samples: u32,
    pub counts: RayCounts,
}

/// A number with its standard deviation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Estimate {
    pub value: f64,
    pub deviation: f64,
}

impl PilotPixels {
    /// One from each cell of a grid over part of a film.
    fn new(crop: Crop) -> Self {
        let Crop { x, y, width, height } = crop;
        let area = crop.area() as f64;
        let side = ((area * PIXELS_PER_PIXEL).clamp(PIXELS[0], PIXELS[1]) / area).min(1.0).sqrt();
        let [columns, rows] = [width, height].map(|length| ((f64::from(length) * side) as u32).max(1));
        let within = |cell: u32, cells: u32, length: u32, bits: u32| {
            let bound = |cell: u32| (u64::from(cell) * u64::from(length) / u64::from(cells)) as u32;
            bound(cell) + bits % (bound(cell + 1) - bound(cell)).max(1)
        };
        let pixel = |cell: u32| {
            let bits = hash64(u64::from(cell));
            let column = within(cell % columns, columns, width, bits as u32);
            [x.wrapping_add(column), y.wrapping_add(within(cell / columns, rows, height, (bits >> 32) as u32))]
        };
        Self { pixels: (0..columns * rows).map(pixel).collect(), columns: columns as usize }
    }

    /// Factors that make variances relative to the square of the colour of a pixel and those around it, by channel.
    fn relative_to(&self, radiance: impl Fn(usize) -> [f64; 3]) -> Vec<[f64; 3]> {
        let mean = mean((0..self.pixels.len()).map(&radiance));
        let floor = FLOOR * mean * mean;
        (0..self.pixels.len()).map(|i| self.around(i, &radiance).map(|color| 1.0 / (color * color + floor))).collect()
    }

    /// The mean radiance of a pixel and those around it.
    fn around(&self, index: usize, radiance: impl Fn(usize) -> [f64; 3]) -> [f64; 3] {
        let rows = self.pixels.len() / self.columns;
        let range = |at: usize, count: usize| at.saturating_sub(1)..(at + 2).min(count);
        let (mut sum, mut count) = ([0.0; 3], 0.0);
        for y in range(index / self.columns, rows) {
            for x in range(index % self.columns, self.columns) {
                let radiance = radiance(y * self.columns + x);
                sum = [0, 1, 2].map(|k| sum[k] + radiance[k]);
                count += 1.0;
            }
        }
        sum.map(|sum| sum / count)
    }
}

impl PilotSamples {
    /// Samples that `render` gives for indices of samples of pixels, at most as many as a tile has pixels. `moments`
    /// finds those of a batch by sample; none for samples without the method.
    pub fn trace(
        crop: Crop,
        samples: u32,
        workspaces: &[Mutex<TileWorkspace>],
        render: impl Fn(&mut dyn Iterator<Item = ([u32; 2], u32)>, &mut TileWorkspace) + Sync,
        moments: impl Fn(&TileWorkspace) -> Vec<PilotMoments> + Sync,
    ) -> Self {
        let pixels = PilotPixels::new(crop);
        let parts: Vec<(Vec<PilotPixel>, RayCounts)> = pixels
            .pixels
            .par_chunks((TILE_SIZE * TILE_SIZE / samples) as usize)
            .map(|pixels| {
                let thread = rayon::current_thread_index().unwrap_or(0) % workspaces.len();
                let mut workspace = workspaces[thread].lock().unwrap_or_else(PoisonError::into_inner);
                let of_pixel = |&pixel: &[u32; 2]| samples_of_pixel(samples).map(move |i| (pixel, i));
                render(&mut pixels.iter().flat_map(of_pixel), &mut workspace);
                let means = means(&workspace, &moments(&workspace), samples);
                (means, std::mem::take(&mut workspace.integrator.counts))
            })
            .collect();
        let (mut means, mut counts) = (Vec::new(), RayCounts::default());
        for (part, rays) in parts {
            means.extend(part);
            counts.add(&rays);
        }
        Self { pixels, means, samples, counts }
    }

    /// Rays of a sample.
    pub fn rays(&self) -> f64 {
        self.counts.total() as f64 / (f64::from(self.samples) * self.means.len() as f64)
    }

    /// The mean radiance.
    pub fn mean(&self) -> f64 {
        mean(self.means.iter().map(|pixel| pixel.radiance))
    }

    /// The mean variance of a sample over the square of the colour, by pixel and channel.
    pub fn relative_variance(&self) -> f64 {
        let factors = self.pixels.relative_to(|i| self.means[i].radiance);
        let pixels = self.means.iter().zip(factors);
        pixels.map(|(pixel, factors)| pixel.weighted_variances(factors, self.samples)[0]).sum::<f64>()
            / (3 * self.means.len()) as f64
    }

    /// The variance of a sample without the method over that with it; `None` if the samples are black or all alike. A
    /// part of the pixels, those where that differs most, is left out.
    pub fn gain(&self, left_out: f64) -> Option<Estimate> {
        let factors = self.pixels.relative_to(|i| self.means[i].radiance);
        let pixels = self.means.iter().zip(factors);
        let mut pixels: Vec<_> =
            pixels.map(|(pixel, factors)| pixel.weighted_variances(factors, self.samples)).collect();
        if left_out > 0.0 {
            pixels.sort_unstable_by(|a, b| (a[1] - a[0]).total_cmp(&(b[1] - b[0])));
            pixels.truncate((pixels.len() as f64 * (1.0 - left_out)) as usize);
        }
        Estimate::of_sums(pixels.into_iter(), |[with, without]| without / with)
    }
}

/// The means of the pixels of a batch.
fn means(batch: &TileWorkspace, moments: &[PilotMoments], samples: u32) -> Vec<PilotPixel> {
    let mean = |first: usize| {
        let mut mean = PilotPixel::default();
        for slot in first..first + samples as usize {
            let (radiance, moments) = (batch.radiance(slot), moments.get(slot).copied().unwrap_or_default());
            let PilotMoments { without, excess, shared } = moments;
            // What is not finite is dropped, as in pictures.
            if [radiance, without, excess, shared].iter().flatten().all(|value| value.is_finite()) {
                for (k, value) in radiance.into_iter().enumerate() {
                    let without = value + without[k];
                    mean.radiance[k] += value / f64::from(samples);
                    mean.square[k] += value * value / f64::from(samples);
                    mean.radiance_without[k] += without / f64::from(samples);
                    mean.square_without[k] += without * without / f64::from(samples);
                    mean.excess[k] += excess[k] / f64::from(samples);
                    mean.shared[k] += shared[k] / f64::from(samples);
                }
            }
        }
        mean
    };
    (0..batch.sample_count()).step_by(samples as usize).map(mean).collect()
}

/// The indices of the samples of each pixel, of whole epochs.
fn samples_of_pixel(count: u32) -> Range<u32> {
    FIRST_SAMPLE..FIRST_SAMPLE + count
}

/// The mean of colours.
fn mean(colors: impl Iterator<Item = [f64; 3]>) -> f64 {
    let (sum, count) = colors.fold((0.0, 0.0), |(sum, count), color| {
        (sum + color.into_iter().map(|value| value.max(0.0)).sum::<f64>(), count + 3.0)
    });
    sum / f64::max(count, 1.0)
}

impl Estimate {
    /// What `result` makes of the sums of two numbers over pixels, with its deviation; `None` if it is not finite, as
    /// where all are zero.
    fn of_sums(numbers: impl Iterator<Item = [f64; 2]>, result: impl Fn([f64; 2]) -> f64) -> Option<Self> {
        let mut parts = [[0.0; 2]; PARTS];
        for (i, [a, b]) in numbers.enumerate() {
            let part = &mut parts[hash64(i as u64) as usize % PARTS];
            *part = [part[0] + a, part[1] + b];
        }
        let all = parts.iter().fold([0.0; 2], |sum, part| [sum[0] + part[0], sum[1] + part[1]]);
        let without = parts.map(|part| result([all[0] - part[0], all[1] - part[1]]));
        let mean = without.iter().sum::<f64>() / PARTS as f64;
        let spread = without.iter().map(|value| (value - mean).powi(2)).sum::<f64>();
        let deviation = (spread * (PARTS - 1) as f64 / PARTS as f64).sqrt();
        let found = Self { value: result(all), deviation };
        (found.value.is_finite() && deviation.is_finite()).then_some(found)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pixels whose samples are 0 or 2, as often, with this excess.
    fn gain(excess: impl Fn(usize) -> f64) -> Estimate {
        let pixel = |i| PilotPixel {
            radiance: [1.0; 3],
            square: [2.0; 3],
            radiance_without: [1.0; 3],
            square_without: [2.0; 3],
            excess: [excess(i); 3],
            shared: [0.0; 3],
        };
        of_means((0..400).map(pixel).collect()).gain(0.0).unwrap()
    }

    fn of_means(means: Vec<PilotPixel>) -> PilotSamples {
        let pixels = PilotPixels { pixels: vec![[0; 2]; 400], columns: 20 };
        PilotSamples { pixels, means, samples: 16, counts: RayCounts::default() }
    }

    #[test]
    fn gains_are_ratios_of_variances() {
        // The variance of a sample is 16 / 15.
        let found = gain(|_| 32.0 / 15.0);
        assert!((found.value - 3.0).abs() < 1e-9 && found.deviation < 1e-9);
        let found = gain(|_| 1.0 / 15.0);
        assert!((found.value - 1.0625).abs() < 1e-9 && found.deviation < 1e-9);
        // Little, but by a few pixels alone: it may be more.
        let found = gain(|i| if i % 100 == 7 { 200.0 / 15.0 } else { 0.0 });
        assert!((found.value - 1.125).abs() < 1e-9 && found.deviation > 0.03);
        assert_eq!(of_means(vec![PilotPixel::default(); 400]).gain(0.0), None);
    }
}
