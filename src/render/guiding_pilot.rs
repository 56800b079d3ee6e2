//! The pilot of path guiding: samples of some pixels from all over the picture, with a guide that has learned from the
//! picture's first samples. They show how much more variance paths have without the guide, and are not part of the
//! picture: what is decided by them favours no sample of it.
//!
//! Unguided paths that are as few hardly ever find the light that a guide leads to, and seem to have little variance.
//! Guided paths find it, and the ratio of the densities gives what it would add to the variance without the guide.

use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

use super::TILE_SIZE;
use super::tile_renderer::{TileRenderer, TileWorkspace};
use crate::film::Crop;
use crate::guiding::Guide;
use crate::integrator::{Guidance, RayCounts};
use crate::math::random::hash64;

/// Pixels of the pilot, by pixel of the picture.
const PIXELS_PER_PIXEL: f64 = 1.0 / 128.0;

/// The fewest and the most of them.
const PIXELS: [f64; 2] = [512.0, 8192.0];

/// Samples of a pilot pixel with and without the guide; the latter give the brightness alone.
const SAMPLES: u32 = 16;
const UNGUIDED_SAMPLES: u32 = 2;

/// The index of the first sample of pilot pixels, beyond those of pictures.
const FIRST_SAMPLE: u32 = 1 << 31;

/// What relative variances are related to beside the square of the colour, over the square of the picture's mean.
const FLOOR: f64 = 0.01;

/// Parts of the pilot, each of which is left out once to find the deviation of its result.
const PARTS: usize = 16;

/// The least gain of a guide that may pay, and how many standard deviations it may have missed that by.
const LEAST_GAIN: f64 = 1.15;
const CONFIDENCE: f64 = 2.0;

/// What traces the pilot.
#[derive(Clone, Copy)]
pub(super) struct GuidingPilot<'a> {
    pub renderer: &'a TileRenderer<'a>,
    pub workspaces: &'a [Mutex<TileWorkspace>],
    /// The pixels of the picture, on the film's grid.
    pub crop: Crop,
}

/// Means over the samples of a pilot pixel, by channel.
#[derive(Clone, Copy, Debug, Default)]
struct PilotPixel {
    radiance: [f64; 3],
    square: [f64; 3],
    /// Second moment without the guide, less that with it.
    excess: [f64; 3],
}

/// The samples of the pilot.
#[derive(Clone, Debug, Default)]
pub(super) struct PilotSamples {
    /// Row by row.
    pixels: Vec<PilotPixel>,
    /// Pixels in a row.
    columns: usize,
    /// Samples of a pixel.
    samples: u32,
    pub counts: RayCounts,
}

/// What a guide gains.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct GuidingGain {
    /// The variance of a sample without the guide over that with it.
    pub variance: f64,
    /// The standard deviation of that.
    deviation: f64,
}

impl GuidingGain {
    /// Whether the guide may pay once it has learned more. After so few samples it seems to gain less than it will.
    pub fn may_pay(&self) -> bool {
        self.variance + CONFIDENCE * self.deviation > LEAST_GAIN
    }
}

impl GuidingPilot<'_> {
    /// Columns and rows of pixels.
    fn size(&self) -> [u32; 2] {
        let Crop { width, height, .. } = self.crop;
        let area = self.crop.area() as f64;
        let side = ((area * PIXELS_PER_PIXEL).clamp(PIXELS[0], PIXELS[1]) / area).min(1.0).sqrt();
        [width, height].map(|length| ((f64::from(length) * side) as u32).max(1))
    }

    /// The pixels: one from each cell of a grid over the picture.
    fn pixels(&self) -> Vec<[u32; 2]> {
        let (Crop { x, y, width, height }, [columns, rows]) = (self.crop, self.size());
        let within = |cell: u32, cells: u32, length: u32, bits: u32| {
            let bound = |cell: u32| (u64::from(cell) * u64::from(length) / u64::from(cells)) as u32;
            bound(cell) + bits % (bound(cell + 1) - bound(cell)).max(1)
        };
        let pixel = |cell: u32| {
            let bits = hash64(u64::from(cell));
            let column = within(cell % columns, columns, width, bits as u32);
            [x + column, y + within(cell / columns, rows, height, (bits >> 32) as u32)]
        };
        (0..columns * rows).map(pixel).collect()
    }

    /// Samples that `guide` guides.
    pub fn guided(&self, guide: &Guide) -> PilotSamples {
        self.trace(Some(guide), SAMPLES)
    }

    /// Samples without guide.
    pub fn unguided(&self) -> PilotSamples {
        self.trace(None, UNGUIDED_SAMPLES)
    }

    fn trace(&self, guide: Option<&Guide>, samples: u32) -> PilotSamples {
        let batch = (TILE_SIZE * TILE_SIZE / samples) as usize;
        let parts: Vec<PilotSamples> = self
            .pixels()
            .par_chunks(batch)
            .map(|pixels| {
                let thread = rayon::current_thread_index().unwrap_or(0) % self.workspaces.len();
                let mut workspace = self.workspaces[thread].lock().unwrap_or_else(PoisonError::into_inner);
                self.trace_batch(pixels, guide, samples, &mut workspace)
            })
            .collect();
        let columns = self.size()[0] as usize;
        let mut all = PilotSamples { columns, samples, ..PilotSamples::default() };
        for part in parts {
            all.pixels.extend(part.pixels);
            all.counts.add(&part.counts);
        }
        all
    }

    fn trace_batch(
        &self,
        pixels: &[[u32; 2]],
        guide: Option<&Guide>,
        samples: u32,
        workspace: &mut TileWorkspace,
    ) -> PilotSamples {
        let of_pixel = |&pixel: &[u32; 2]| (FIRST_SAMPLE..FIRST_SAMPLE + samples).map(move |i| (pixel, i));
        let guidance = Guidance { guide, learner: None, has_moments: guide.is_some() };
        self.renderer.render_samples(pixels.iter().flat_map(of_pixel), guidance, workspace);
        let moments = if guide.is_some() { workspace.integrator.second_moments() } else { Vec::new() };
        let mut means = vec![PilotPixel::default(); pixels.len()];
        for slot in 0..pixels.len() * samples as usize {
            let (radiance, moments) = (workspace.radiance(slot), moments.get(slot).copied().unwrap_or_default());
            let excess = [0, 1, 2].map(|k| moments.unguided[k] - moments.guided[k]);
            // What is not finite is dropped, as in pictures.
            if radiance.iter().chain(&excess).all(|value| value.is_finite()) {
                let mean = &mut means[slot / samples as usize];
                for k in 0..3 {
                    mean.radiance[k] += radiance[k] / f64::from(samples);
                    mean.square[k] += radiance[k] * radiance[k] / f64::from(samples);
                    mean.excess[k] += excess[k] / f64::from(samples);
                }
            }
        }
        PilotSamples { pixels: means, counts: std::mem::take(&mut workspace.integrator.counts), ..Default::default() }
    }
}

impl PilotSamples {
    /// The mean radiance.
    pub fn mean(&self) -> f64 {
        let sum: f64 = self.pixels.iter().flat_map(|pixel| pixel.radiance).map(|value| value.max(0.0)).sum();
        sum / (3 * self.pixels.len()).max(1) as f64
    }

    /// The mean radiance of a pixel and those around it.
    fn around(&self, index: usize) -> [f64; 3] {
        let rows = self.pixels.len() / self.columns;
        let range = |at: usize, count: usize| at.saturating_sub(1)..(at + 2).min(count);
        let (mut sum, mut count) = ([0.0; 3], 0.0);
        for y in range(index / self.columns, rows) {
            for x in range(index % self.columns, self.columns) {
                let radiance = self.pixels[y * self.columns + x].radiance;
                sum = [0, 1, 2].map(|k| sum[k] + radiance[k]);
                count += 1.0;
            }
        }
        sum.map(|sum| sum / count)
    }

    /// What the guide of these samples gains; `None` if they are black or all alike.
    pub fn gain(&self) -> Option<GuidingGain> {
        let floor = FLOOR * self.mean().powi(2);
        let count = f64::from(self.samples);
        // Relative variances: the guided one, and how much more it is without guide.
        let mut parts = [[0.0; 2]; PARTS];
        for (i, pixel) in self.pixels.iter().enumerate() {
            let part = &mut parts[hash64(i as u64) as usize % PARTS];
            for (k, color) in self.around(i).into_iter().enumerate() {
                let weight = 1.0 / (color * color + floor);
                let variance = (pixel.square[k] - pixel.radiance[k] * pixel.radiance[k]).max(0.0);
                part[0] += weight * variance * count / (count - 1.0);
                part[1] += weight * pixel.excess[k];
            }
        }
        let all = parts.iter().fold([0.0; 2], |sum, part| [sum[0] + part[0], sum[1] + part[1]]);
        let gain = |[variance, excess]: [f64; 2]| 1.0 + excess / variance;
        let without = parts.map(|part| gain([all[0] - part[0], all[1] - part[1]]));
        let mean = without.iter().sum::<f64>() / PARTS as f64;
        let spread = without.iter().map(|gain| (gain - mean).powi(2)).sum::<f64>();
        let deviation = (spread * (PARTS - 1) as f64 / PARTS as f64).sqrt();
        let found = GuidingGain { variance: gain(all), deviation };
        (found.variance.is_finite() && deviation.is_finite()).then_some(found)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pixels whose samples are 0 or 2, as often, with this excess.
    fn gain(excess: impl Fn(usize) -> f64) -> GuidingGain {
        let pixel = |i| PilotPixel { radiance: [1.0; 3], square: [2.0; 3], excess: [excess(i); 3] };
        let pixels = (0..400).map(pixel).collect();
        PilotSamples { pixels, columns: 20, samples: SAMPLES, counts: RayCounts::default() }.gain().unwrap()
    }

    #[test]
    fn gains_are_ratios_of_variances() {
        // The variance of a sample is 16 / 15.
        let found = gain(|_| 32.0 / 15.0);
        assert!((found.variance - 3.0).abs() < 1e-9 && found.deviation < 1e-9 && found.may_pay());
        let found = gain(|_| 1.0 / 15.0);
        assert!((found.variance - 1.0625).abs() < 1e-9 && found.deviation < 1e-9 && !found.may_pay());
        // Little, but by a few pixels alone: it may be more.
        let found = gain(|i| if i % 100 == 7 { 200.0 / 15.0 } else { 0.0 });
        assert!((found.variance - 1.125).abs() < 1e-9 && found.deviation > 0.03 && found.may_pay());
        let black = PilotSamples { pixels: vec![PilotPixel::default(); 400], columns: 20, ..PilotSamples::default() };
        assert_eq!(black.gain(), None);
    }
}
