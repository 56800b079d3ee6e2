//! Renders for which a pilot decides whether paths are guided.
//!
//! A guide learns from the first samples, which are those of a render without guiding. Then the pilot decides whether
//! it pays. Nothing here depends on the number of samples, so that more can be added to a picture.

use super::training_schedule::next_refinement;
use crate::bytes::{ByteReader, ByteWriter};
use crate::guiding::Guide;
use crate::math::Aabb;
use crate::render::pilot_samples::PilotSamples;

/// Samples per pixel before the decision.
pub(super) const LEARNED: u32 = 4;

/// A guide that learns before it is used, if it will be.
#[derive(Clone, Debug)]
pub(in crate::render) struct PilotPlanner {
    pub guide: Guide,
}

impl PilotPlanner {
    /// Of a render that begins.
    pub fn new() -> Self {
        Self { guide: Guide::new(Aabb::EMPTY, 0.0) }
    }

    /// How many samples per pixel after the first `done` are learned from alike.
    pub fn samples_with_this_guide(done: u32) -> u32 {
        next_refinement(done).min(LEARNED).saturating_sub(done)
    }

    /// Whether the guide knows how bright the scene is.
    pub fn has_begun(&self) -> bool {
        self.guide.has_radiance_scale()
    }

    /// Every pixel has `done` samples.
    pub fn complete_samples(&mut self, done: u32) {
        self.guide = self.guide.refined(done);
    }

    /// Sets how bright the scene is, by samples without guide.
    pub fn begin(&mut self, unguided: &PilotSamples) {
        self.guide.set_typical(unguided.mean() as f32);
    }

    /// The guide, to be used from now on.
    pub fn take_guide(&mut self) -> Guide {
        std::mem::replace(&mut self.guide, Guide::new(Aabb::EMPTY, 0.0))
    }

    /// As bytes.
    pub fn save(&self) -> Vec<u8> {
        let mut out = ByteWriter::default();
        self.guide.write(&mut out);
        out.into_bytes()
    }

    /// Takes what [`save`](Self::save) gave; `None` if it is something else.
    pub fn load(&mut self, bytes: &[u8]) -> Option<()> {
        let mut data = ByteReader::new(bytes);
        self.guide = Guide::read(&mut data)?;
        data.is_empty().then_some(())
    }
}
