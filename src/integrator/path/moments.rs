//! What pilots learn of the variance that samples would have without connections or photons.

use super::PassContext;
use crate::color::Rgb;
use crate::integrator::{EPOCH, PilotMoments};
use crate::math::rows::BATCH;

/// Moments of the samples of a batch.
#[derive(Default)]
pub(super) struct Moments {
    /// By sample; empty where they are not wanted.
    samples: Vec<PilotMoments>,
    /// By shadow ray, the mean of the square that a path without connections adds, over that which it adds; empty
    /// without connections.
    pub ratios: Vec<f32>,
    /// By vertex of the block, the factor of its light sample by MIS against photons; empty where that is not wanted.
    pub photon_factors: Vec<f32>,
    /// The same by shadow ray.
    pub shadow_factors: Vec<f32>,
    /// Whether the ratios are wanted.
    pub has_ratios: bool,
    /// Whether emission is wanted that is weighted against photons.
    pub needs_emission: bool,
}

impl Moments {
    pub fn start(&mut self, pass: &PassContext, samples: usize) {
        self.has_ratios = pass.light_paths.is_some_and(|light_paths| light_paths.has_moments);
        self.needs_emission = pass.caustics.is_some_and(|caustics| caustics.has_moments);
        self.photon_factors.clear();
        if self.needs_emission {
            self.photon_factors.resize(BATCH, 1.0);
        }
        self.samples.clear();
        if self.has_ratios || self.needs_emission {
            self.samples.resize(samples, PilotMoments::default());
        }
    }

    /// By sample; empty where they are not wanted.
    pub fn samples(&self) -> &[PilotMoments] {
        &self.samples
    }

    /// Adds the light of a shadow ray that nothing blocks.
    #[inline]
    pub fn add_shadow_ray(&mut self, ray: usize, slot: u32, light: Rgb) {
        if let (Some(sample), Some(&ratio)) = (self.samples.get_mut(slot as usize), self.ratios.get(ray)) {
            let more = f64::from(ratio) - 1.0;
            sample.add(light, |_, square| [0.0, square * more, 0.0]);
        }
        if let Some(&factor) = self.shadow_factors.get(ray)
            && factor > 0.0
        {
            self.add_emission(slot, light, light * (1.0 / factor));
        }
    }

    /// Adds the light of a photon with this weight by MIS, which BSDF sampling finds with `1 / ratio` of the density.
    #[inline]
    pub fn add_photon(&mut self, slot: u32, light: Rgb, weight: f32, ratio: f32) {
        if let Some(sample) = self.samples.get_mut(slot as usize) {
            // The square of what BSDF sampling finds is `(light / weight)^2`, found here with `ratio` of the density.
            let by_bsdf = f64::from(ratio) / f64::from(weight);
            if by_bsdf.is_finite() {
                // All samples of an epoch gather much the same photons.
                sample.add(light, |light, square| [-light, square * by_bsdf, square * f64::from(EPOCH)]);
            }
        }
    }

    /// Adds emission that a path has met, weighted against photons and not.
    #[inline]
    pub fn add_emission(&mut self, slot: u32, weighted: Rgb, unweighted: Rgb) {
        if let Some(sample) = self.samples.get_mut(slot as usize) {
            let weight = f64::from(weighted.max_channel()) / f64::from(unweighted.max_channel());
            if weight.is_finite() {
                // Photons account for this share of its square, which the samples without them show again.
                sample.add(unweighted, |light, square| [light * (1.0 - weight), -square * (1.0 - weight), 0.0]);
            }
        }
    }
}

impl PilotMoments {
    /// Adds to each channel what `terms` gives for its light and the square of that.
    fn add(&mut self, light: Rgb, terms: impl Fn(f64, f64) -> [f64; 3]) {
        for (k, value) in light.to_array().into_iter().enumerate() {
            let value = f64::from(value);
            let [without, excess, shared] = terms(value, value * value);
            self.without[k] += without;
            self.excess[k] += excess;
            self.shared[k] += shared;
        }
    }
}
