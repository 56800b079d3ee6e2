//! Layers of data, which are not averaged: what the nearest of a pixel's own samples shows.

use super::layer::channels_of;
use super::{Filtering, LayerSet, ShapeKey, Source, SurfaceSample};

/// Most channels of such layers.
const MAX_DATA: usize = channels_of(Filtering::Nearest);

/// By pixel, the sample that counts: of those that hit something the nearest, of samples equally near (and where
/// nothing was hit) the first.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Nearest {
    channels: usize,
    /// Distance along the view axis; infinite where nothing was hit, NaN without a sample.
    pub depths: Vec<f32>,
    /// Indices of the samples.
    pub samples: Vec<u32>,
    /// The channels of a pixel side by side.
    pub values: Vec<f32>,
}

impl Nearest {
    pub fn new(pixels: usize, channels: usize) -> Self {
        let count = if channels > 0 { pixels } else { 0 };
        Self { channels, depths: vec![f32::NAN; count], samples: vec![0; count], values: vec![0.0; count * channels] }
    }

    /// Takes a sample into account; `false` if a value of it is not finite.
    #[inline]
    pub fn add(&mut self, pixel: usize, sample: u32, surface: &SurfaceSample, set: LayerSet) -> bool {
        if self.channels == 0 {
            return true;
        }
        let mut values = [0.0; MAX_DATA];
        let mut start = 0;
        for info in set.surfaces(Filtering::Nearest) {
            if let Source::Surface(read, _) = info.source {
                read(surface, &mut values[start..start + info.channels.len()]);
            }
            start += info.channels.len();
        }
        let depth = if surface.shown != ShapeKey::NONE { surface.depth } else { f32::INFINITY };
        if depth.is_nan() || !values[..start].iter().all(|value| value.is_finite()) {
            return false;
        }
        self.set(pixel, depth, sample, &values[..start]);
        true
    }

    /// Adds all samples of another.
    pub fn merge(&mut self, other: &Self) {
        for pixel in 0..other.depths.len() {
            if !other.depths[pixel].is_nan() {
                let values = &other.values[pixel * self.channels..(pixel + 1) * self.channels];
                self.set(pixel, other.depths[pixel], other.samples[pixel], values);
            }
        }
    }

    #[inline]
    fn set(&mut self, pixel: usize, depth: f32, sample: u32, values: &[f32]) {
        let known = (self.depths[pixel], self.samples[pixel]);
        if known.0.is_nan() || (depth, sample) < known {
            (self.depths[pixel], self.samples[pixel]) = (depth, sample);
            self.values[pixel * self.channels..(pixel + 1) * self.channels].copy_from_slice(values);
        }
    }

    /// Whether a pixel's sample hit something.
    pub fn hit(&self, pixel: usize) -> bool {
        self.depths.get(pixel).is_some_and(|depth| *depth < f32::INFINITY)
    }

    /// A pixel's channels.
    pub fn of(&self, pixel: usize) -> &[f32] {
        &self.values[pixel * self.channels..(pixel + 1) * self.channels]
    }
}
