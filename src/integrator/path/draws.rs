//! Random numbers of a batch.

use super::{Path, dimensions};
use crate::sampling::{Numbers, Requests, Sampler};

/// Random numbers for the vertices that are shaded next.
#[derive(Default)]
pub(super) struct Draws {
    requests: Requests,
    pub light: Numbers,
    pub bsdf: Numbers,
}

impl Draws {
    /// Draws for at most [`BATCH`](crate::math::rows::BATCH) paths; numbers for lights only `with_light`.
    pub fn draw(&mut self, sampler: &Sampler, paths: &[Path], bounce: u32, with_light: bool) {
        for (path, (pixel, sample)) in paths.iter().zip(self.requests.pixels.iter_mut().zip(&mut self.requests.samples)) {
            (*pixel, *sample) = (path.seed, path.sample);
        }
        if with_light {
            sampler.sample_4d_batch(&self.requests, paths.len(), dimensions::light(bounce), &mut self.light);
        }
        sampler.sample_4d_batch(&self.requests, paths.len(), dimensions::bsdf(bounce), &mut self.bsdf);
    }
}
