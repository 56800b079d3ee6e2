//! Light samples for many vertices at once, the same as for each of them alone.

use super::area::{AreaQueue, EmitterQueue};
use super::environment::{EnvironmentScratch, InfiniteLightSampleRows};
use super::set::LightChoiceRows;
use super::tree::LightTreeScratch;
use super::{EnvironmentMap, Light, LightSample, LightSampleContext, LightSet, MisCompensation, ShadowTarget};
use crate::color::Rgb;
use crate::geometry::{Geometry, SpawnPoint};
use crate::id::LightId;
use crate::math::rows::{BATCH, DVec3Rows, Vec3Rows, soa};
use crate::math::{DVec3, Vec3};
use crate::sampling::SampleRows;
use crate::texture::Texture;

/// Where light samples end.
pub mod light_target {
    /// There is no sample.
    pub const NONE: u32 = 0;
    /// At a point.
    pub const POINT: u32 = 1;
    /// At infinity.
    pub const INFINITY: u32 = 2;
}

soa! {
    /// Samples as [`LightSample`] has them, without the point they end at.
    pub struct LightSampleRows {
        /// Id of the light; only where one was chosen.
        light: u32,
        /// See [`light_target`]. All others are only set where there is a sample.
        target: u32,
        /// Whether nothing else can find the direction.
        is_delta: u32,
        /// Unit direction to the light.
        direction: Vec3,
        /// Radiance that arrives.
        radiance: Rgb,
        /// Density per solid angle, times the probability with which the light was chosen.
        pdf: f32,
        /// Of an end at a point: the normal there,
        target_n: Vec3,
        /// and the error of the position.
        target_error: f32,
    }
}

impl LightSampleRows {
    /// Sets the sample of a vertex, whose light was chosen with probability `pmf`.
    #[inline(always)]
    fn set(&mut self, lane: usize, sample: &LightSample, pmf: f32, target_p: &mut DVec3Rows) {
        self.is_delta[lane] = u32::from(sample.is_delta);
        self.direction.set(lane, sample.wi);
        self.radiance.set(lane, sample.radiance);
        self.pdf[lane] = sample.pdf * pmf;
        match &sample.target {
            ShadowTarget::Point(SpawnPoint { p, n, error }) => {
                self.target[lane] = light_target::POINT;
                target_p.set(lane, *p);
                self.target_n.set(lane, *n);
                self.target_error[lane] = *error;
            }
            ShadowTarget::Infinity => self.target[lane] = light_target::INFINITY,
        }
    }
}

/// Vertices that sample lights, at most [`BATCH`]: area lights and the image around the scene are sampled for many of
/// them at once.
pub struct LightQueue {
    choices: LightChoiceRows,
    tree_scratch: LightTreeScratch,
    area: AreaQueue,
    emitters: EmitterQueue,
    sky: SkyQueue,
    /// Vertices whose lights are sampled one by one.
    alone: Vec<(usize, LightId)>,
}

impl Default for LightQueue {
    fn default() -> Self {
        Self {
            choices: LightChoiceRows::default(),
            tree_scratch: LightTreeScratch::default(),
            area: AreaQueue::default(),
            emitters: EmitterQueue::default(),
            sky: SkyQueue::default(),
            alone: Vec::with_capacity(BATCH),
        }
    }
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
    pub compensation: MisCompensation,
}

/// What light sampling reads of vertices.
#[derive(Clone, Copy)]
pub struct LightQueries<'a> {
    /// How many vertices there are.
    pub count: usize,
    /// Their points.
    pub points: &'a DVec3Rows,
    /// The side that light must reach, as in [`LightSampleContext`].
    pub normals: &'a Vec3Rows,
    /// Numbers in `[0, 1)`: the first and the last choose a light, the others a point of it.
    pub u: &'a SampleRows,
}

impl LightQueries<'_> {
    /// The point of a vertex, and the numbers for a point of its light.
    #[inline(always)]
    pub(super) fn get(&self, lane: usize) -> (DVec3, [f32; 2]) {
        let [_, u, v, _] = self.u.of(lane);
        (self.points.get(lane), [u, v])
    }

    /// Where light is to arrive.
    #[inline(always)]
    pub(super) fn light_context(&self, lane: usize) -> LightSampleContext {
        LightSampleContext { p: self.points.get(lane), n: self.normals.get(lane) }
    }
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
        self.sky.lanes.clear();
        self.alone.clear();
    }

    /// Chooses a light for each vertex that is wanted, and queues its sample.
    #[inline(always)]
    pub fn choose(
        &mut self,
        context: &LightContext,
        queries: &LightQueries,
        is_wanted: impl Fn(usize) -> bool,
        samples: &mut LightSampleRows,
    ) {
        let Self { choices, tree_scratch, .. } = self;
        context.lights.choose_rows(queries, &is_wanted, context.compensation, tree_scratch, choices);
        samples.light = self.choices.light;
        for lane in (0..queries.count.min(BATCH)).filter(|&lane| is_wanted(lane)) {
            if self.choices.pmf[lane] > 0.0 {
                self.push(context, lane, LightId(self.choices.light[lane]));
            }
        }
    }

    /// Queues a sample of a light for the vertex `lane`.
    #[inline(always)]
    fn push(&mut self, context: &LightContext, lane: usize, id: LightId) {
        match context.lights.get(id) {
            Light::Area(light) if self.area.push(light, id, lane) || self.emitters.push(light, id, lane) => {}
            _ if context.lights.environment_map().is_some_and(|(map, _)| map == id) => self.sky.lanes.push(lane),
            _ => self.alone.push((lane, id)),
        }
    }

    /// Samples what was queued, and sets the targets of all vertices.
    pub fn sample(
        &mut self,
        context: &LightContext,
        queries: &LightQueries,
        samples: &mut LightSampleRows,
        target_p: &mut DVec3Rows,
    ) {
        let Self { choices, area, emitters, sky, alone, .. } = self;
        let pmfs = &choices.pmf;
        area.sample(queries, pmfs, samples, target_p);
        let mut set = |lane: usize, sample: &LightSample| samples.set(lane, sample, pmfs[lane], target_p);
        emitters.sample(context, queries, &mut set);
        if let Some((_, image)) = context.lights.environment_map() {
            sky.sample(image, context.compensation, queries, &mut set);
        }
        for &(lane, id) in &*alone {
            let (_, u) = queries.get(lane);
            if let Some(sample) = context.lights.get(id).sample(
                context.geometry,
                context.textures,
                &queries.light_context(lane),
                u,
                context.compensation,
            ) {
                set(lane, &sample);
            }
        }
    }
}

/// Vertices that sample an image around the scene.
struct SkyQueue {
    lanes: Vec<usize>,
    u: [[f32; 2]; BATCH],
    scratch: EnvironmentScratch,
    samples: InfiniteLightSampleRows,
}

impl Default for SkyQueue {
    fn default() -> Self {
        Self {
            lanes: Vec::with_capacity(BATCH),
            u: [[0.0; 2]; BATCH],
            scratch: EnvironmentScratch::default(),
            samples: InfiniteLightSampleRows::default(),
        }
    }
}

impl SkyQueue {
    fn sample(
        &mut self,
        image: &EnvironmentMap,
        compensation: MisCompensation,
        queries: &LightQueries,
        mut set: impl FnMut(usize, &LightSample),
    ) {
        let Self { lanes, u, scratch, samples } = self;
        for (u, &lane) in u.iter_mut().zip(&*lanes) {
            *u = queries.get(lane).1;
        }
        if !lanes.is_empty() && scratch.sample(image, u, lanes.len(), compensation, samples) {
            for (i, &lane) in lanes.iter().enumerate() {
                set(lane, &LightSample::infinite_sample(samples.wi.get(i), samples.radiance.get(i), samples.pdf[i]));
            }
        }
    }
}
