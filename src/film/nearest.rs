//! Layers of data, which are not averaged: what the nearest of a pixel's own samples shows.

use super::layer::SurfaceChannels;
use super::{ShapeKey, SurfaceSample};

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

    /// Takes a sample into account, whose values are finite.
    #[inline]
    pub fn add(&mut self, pixel: usize, sample: u32, surface: &SurfaceSample, layers: &SurfaceChannels) {
        if self.channels == 0 {
            return;
        }
        let depth = if surface.visible_shape != ShapeKey::NONE { surface.depth } else { f32::INFINITY };
        if let Some(values) = self.nearer(pixel, depth, sample) {
            layers.read(surface, values);
        }
    }

    /// Adds all samples of another.
    pub fn merge(&mut self, other: &Self) {
        for pixel in 0..other.depths.len() {
            if !other.depths[pixel].is_nan() {
                let values = &other.values[pixel * self.channels..(pixel + 1) * self.channels];
                if let Some(kept) = self.nearer(pixel, other.depths[pixel], other.samples[pixel]) {
                    kept.copy_from_slice(values);
                }
            }
        }
    }

    /// The channels of a pixel, if this sample is the one that counts so far.
    #[inline]
    fn nearer(&mut self, pixel: usize, depth: f32, sample: u32) -> Option<&mut [f32]> {
        let known = (self.depths[pixel], self.samples[pixel]);
        let counts = known.0.is_nan() || (depth, sample) < known;
        counts.then(|| {
            (self.depths[pixel], self.samples[pixel]) = (depth, sample);
            &mut self.values[pixel * self.channels..(pixel + 1) * self.channels]
        })
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
