//! Light samples for many vertices at once, the same as for each of them alone.

use super::area::{AreaQueue, EmitterScratch};
use super::environment::{EnvironmentScratch, InfiniteLightSampleRows};
use super::set::LightChoiceRows;
use super::tree::LightTreeScratch;
use super::{EnvironmentMap, Light, LightSample, LightSampleContext, LightSet, MisCompensation, ShadowTarget};
use crate::color::Rgb;
use crate::geometry::{Geometry, SpawnPoint};
use crate::id::LightId;
use crate::math::compact::Compaction;
use crate::math::rows::{BATCH, DVec3Rows, Row, Vec3Rows, soa};
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

/// Where light samples are written to.
pub(super) struct LightSampleOutput<'a> {
    /// Probabilities with which the lights were chosen.
    pub pmfs: &'a Row,
    /// Samples and
    pub samples: &'a mut LightSampleRows,
    /// the points they end at.
    pub target_p: &'a mut DVec3Rows,
}

impl LightSampleOutput<'_> {
    /// Sets the sample of a vertex.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, sample: &LightSample) {
        let Self { pmfs, samples, target_p } = self;
        samples.is_delta[lane] = u32::from(sample.is_delta);
        samples.direction.set(lane, sample.wi);
        samples.radiance.set(lane, sample.radiance);
        samples.pdf[lane] = sample.pdf * pmfs[lane];
        match &sample.target {
            ShadowTarget::Point(SpawnPoint { p, n, error }) => {
                samples.target[lane] = light_target::POINT;
                target_p.set(lane, *p);
                samples.target_n.set(lane, *n);
                samples.target_error[lane] = *error;
            }
            ShadowTarget::Infinity => samples.target[lane] = light_target::INFINITY,
        }
    }

    /// Sets the samples of vertices with the first ones of `from`, which end at the points `target_p`.
    pub fn expand(&mut self, lanes: &Compaction, from: &LightSampleRows, target_p: &DVec3Rows) {
        let to = &mut *self.samples;
        lanes.expand(&from.target, &mut to.target);
        lanes.expand(&from.is_delta, &mut to.is_delta);
        lanes.expand_3(&from.direction.0, &mut to.direction.0);
        lanes.expand_3(&from.radiance.0, &mut to.radiance.0);
        lanes.expand(&from.pdf, &mut to.pdf);
        lanes.expand_3(&from.target_n.0, &mut to.target_n.0);
        lanes.expand(&from.target_error, &mut to.target_error);
        lanes.expand_3(&target_p.0, &mut self.target_p.0);
    }
}

/// Which lights are sampled together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SampleGroup {
    /// Parallelograms that emit evenly.
    Parallelograms,
    /// Spheres that emit evenly, and outwards.
    Spheres,
    /// Other analytic shapes that emit evenly.
    Shapes,
    /// The image around the scene.
    EnvironmentMap,
    /// Lights that are sampled for one vertex after another.
    Alone,
    /// No light.
    None,
}

impl SampleGroup {
    /// The group of a light; `is_map`: it is the first image around the scene.
    pub fn of(light: &Light, is_map: bool) -> Self {
        match light {
            Light::Area(light) => light.sample_group(),
            _ if is_map => Self::EnvironmentMap,
            _ => Self::Alone,
        }
    }
}

/// Vertices by the groups of their lights, in ascending order.
struct GroupedLanes {
    lanes: [[u8; BATCH]; GROUPS],
    counts: [usize; GROUPS],
}

const GROUPS: usize = SampleGroup::None as usize + 1;

impl GroupedLanes {
    /// Without branches: which light a vertex chooses is not to be predicted.
    #[inline(always)]
    fn push(&mut self, group: SampleGroup, lane: usize) {
        let group = group as usize;
        let count = &mut self.counts[group];
        self.lanes[group][*count % BATCH] = lane as u8;
        *count += 1;
    }

    fn of(&self, group: SampleGroup) -> &[u8] {
        &self.lanes[group as usize][..self.counts[group as usize]]
    }
}

/// Samples lights for vertices, at most [`BATCH`]: area lights and the image around the scene for many of them at once.
pub struct LightQueue {
    choices: LightChoiceRows,
    tree_scratch: LightTreeScratch,
    lanes: GroupedLanes,
    area: AreaQueue,
    emitters: EmitterScratch,
    sky: SkyScratch,
}

impl Default for LightQueue {
    fn default() -> Self {
        Self {
            choices: LightChoiceRows::default(),
            tree_scratch: LightTreeScratch::default(),
            lanes: GroupedLanes { lanes: [[0; BATCH]; GROUPS], counts: [0; GROUPS] },
            area: AreaQueue::default(),
            emitters: EmitterScratch::default(),
            sky: SkyScratch::default(),
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

    /// Chooses a light for each vertex that is wanted.
    #[inline(always)]
    pub fn choose(
        &mut self,
        context: &LightContext,
        queries: &LightQueries,
        is_wanted: impl Fn(usize) -> bool,
        samples: &mut LightSampleRows,
    ) {
        let Self { choices, tree_scratch, lanes, .. } = self;
        context.lights.choose_rows(queries, &is_wanted, context.compensation, tree_scratch, choices);
        samples.light = choices.light;
        lanes.counts = [0; GROUPS];
        for lane in 0..queries.count.min(BATCH) {
            let is_chosen = is_wanted(lane) & (choices.pmf[lane] > 0.0);
            let group = context.lights.sample_group(LightId(choices.light[lane]));
            lanes.push(if is_chosen { group } else { SampleGroup::None }, lane);
        }
    }

    /// Samples the chosen lights, and sets the targets of all vertices.
    pub fn sample(
        &mut self,
        context: &LightContext,
        queries: &LightQueries,
        samples: &mut LightSampleRows,
        target_p: &mut DVec3Rows,
    ) {
        let Self { choices: LightChoiceRows { light: ids, pmf: pmfs }, lanes, area, emitters, sky, .. } = self;
        area.queue(context.lights, lanes.of(SampleGroup::Parallelograms), ids);
        area.sample(queries, pmfs, samples, target_p);
        let out = &mut LightSampleOutput { pmfs, samples, target_p };
        emitters.sample_spheres(lanes.of(SampleGroup::Spheres), ids, context, queries, out);
        emitters.sample_shapes(lanes.of(SampleGroup::Shapes), ids, context, queries, out);
        if let Some((_, image)) = context.lights.environment_map() {
            sky.sample(lanes.of(SampleGroup::EnvironmentMap), image, context.compensation, queries, out);
        }
        for lane in lanes.of(SampleGroup::Alone).iter().map(|&lane| usize::from(lane)) {
            let (_, u) = queries.get(lane);
            if let Some(sample) = context.lights.get(LightId(ids[lane])).sample(
                context.geometry,
                context.textures,
                &queries.light_context(lane),
                u,
                context.compensation,
            ) {
                out.set(lane, &sample);
            }
        }
    }
}

/// Buffers for vertices that sample the image around the scene.
struct SkyScratch {
    u: [[f32; 2]; BATCH],
    scratch: EnvironmentScratch,
    samples: InfiniteLightSampleRows,
}

impl Default for SkyScratch {
    fn default() -> Self {
        Self {
            u: [[0.0; 2]; BATCH],
            scratch: EnvironmentScratch::default(),
            samples: InfiniteLightSampleRows::default(),
        }
    }
}

impl SkyScratch {
    fn sample(
        &mut self,
        lanes: &[u8],
        image: &EnvironmentMap,
        compensation: MisCompensation,
        queries: &LightQueries,
        out: &mut LightSampleOutput,
    ) {
        let Self { u, scratch, samples } = self;
        for (u, &lane) in u.iter_mut().zip(lanes) {
            *u = queries.get(usize::from(lane)).1;
        }
        if lanes.is_empty() || !scratch.sample(image, u, lanes.len(), compensation, samples) {
            return;
        }
        for (&lane, pdf) in lanes.iter().zip(&samples.pdf) {
            let lane = usize::from(lane);
            (out.samples.target[lane], out.samples.is_delta[lane]) = (light_target::INFINITY, 0);
            out.samples.pdf[lane] = pdf * out.pmfs[lane];
        }
        let lanes = Compaction::of(lanes);
        lanes.expand_3(&samples.wi.0, &mut out.samples.direction.0);
        lanes.expand_3(&samples.radiance.0, &mut out.samples.radiance.0);
    }
}
