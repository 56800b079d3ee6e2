//! Light samples for many vertices at once, the same as for each of them alone.

use super::area::{AreaQueue, EmitterQueue};
use super::{EnvironmentMap, FoundBy, Light, LightChoice, LightSample, LightSet};
use crate::geometry::Geometry;
use crate::math::DVec3;
use crate::math::rows::{BATCH, Row};
use crate::texture::Texture;

/// Vertices that sample lights, at most [`BATCH`]: area lights and the image around the scene are sampled for many of them at once.
#[derive(Default)]
pub struct LightQueue {
    area: AreaQueue,
    emitters: EmitterQueue,
    sky: SkyQueue,
}

/// What light sampling reads.
#[derive(Clone, Copy)]
pub struct LightContext<'a> {
    /// The scene's shapes.
    pub geometry: &'a Geometry,
    /// The scene's textures.
    pub textures: &'a [Texture],
    /// The scene's lights.
    pub lights: &'a LightSet,
    /// What else finds the lights.
    pub found_by: FoundBy,
}

impl LightQueue {
    /// Prepares for another scene.
    pub fn reset(&mut self) {
        self.area.reset();
    }

    /// Empties the queue.
    pub fn clear(&mut self) {
        self.area.clear();
        self.emitters.clear();
        self.sky.count = 0;
    }

    /// Samples a light, `u` in the unit square, for the vertex `lane` at `p`: now (the result), or with [`sample`](Self::sample).
    #[inline(always)]
    pub fn push(&mut self, context: &LightContext, choice: LightChoice, lane: usize, p: DVec3, u: [f32; 2]) -> Option<LightSample> {
        match context.lights.get(choice.id) {
            Light::Area(light) if self.area.push(light, choice, lane, p, u) || self.emitters.push(light, choice, lane, p, u) => None,
            _ if context.lights.image_at_infinity().is_some_and(|(id, _)| id == choice.id) => {
                self.sky.push(lane, choice.pmf, u);
                None
            }
            light => light.sample(context.geometry, context.textures, p, u, context.found_by),
        }
    }

    /// Samples what was queued; `set` takes each sample with its vertex and the probability with which the light was chosen.
    #[inline(always)]
    pub fn sample(&mut self, context: &LightContext, mut set: impl FnMut(usize, &LightSample, f32)) {
        self.area.sample(&mut set);
        let area = |id| match context.lights.get(id) {
            Light::Area(light) => Some(light),
            _ => None,
        };
        self.emitters.sample(area, context.geometry, &mut set);
        if let (Some((_, image)), true) = (context.lights.image_at_infinity(), self.sky.count > 0) {
            self.sky.sample(image, context.found_by, set);
        }
    }
}

/// Vertices that sample an image around the scene.
struct SkyQueue {
    count: usize,
    lanes: Row<u32>,
    pmfs: Row,
    u: [[f32; 2]; BATCH],
    samples: [Option<LightSample>; BATCH],
}

impl Default for SkyQueue {
    fn default() -> Self {
        Self { count: 0, lanes: [0; BATCH], pmfs: [0.0; BATCH], u: [[0.0; 2]; BATCH], samples: [None; BATCH] }
    }
}

impl SkyQueue {
    #[inline(always)]
    fn push(&mut self, lane: usize, pmf: f32, u: [f32; 2]) {
        let i = self.count;
        self.count += 1;
        (self.lanes[i], self.pmfs[i], self.u[i]) = (lane as u32, pmf, u);
    }

    #[inline(always)]
    fn sample(&mut self, image: &EnvironmentMap, found_by: FoundBy, mut set: impl FnMut(usize, &LightSample, f32)) {
        let Self { count, lanes, pmfs, u, samples } = self;
        image.sample_batch(&u[..*count], found_by, &mut samples[..*count]);
        for ((sample, &lane), &pmf) in samples[..*count].iter().zip(&*lanes).zip(&*pmfs) {
            if let Some(sample) = sample {
                set(lane as usize, sample, pmf);
            }
        }
    }
}
