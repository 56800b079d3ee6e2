//! Light scattered on the way through a homogeneous medium, at a distance that is chosen for a light: combined with the
//! light at vertices, whose distances follow the extinction.

use super::Context;
use super::media::{Purpose, random};
use super::radiance::Output;
use super::wave::Wave;
use crate::color::Rgb;
use crate::geometry::SpawnPoint;
use crate::id::LightId;
use crate::integrator::light_events::LobeWeights;
use crate::integrator::media::MediaState;
use crate::integrator::participating::{FirstSegment, ShadowEnd};
use crate::integrator::{Strategy, dimensions};
use crate::light::{LightSample, LightSampleContext, ShadowTarget};
use crate::math::{Ray, Rng, Vec3};
use crate::medium::transmittance;
use crate::sampling::{PixelSeed, power_heuristic};

/// A vertex at a distance on the way through a medium on which another was chosen for a light.
#[derive(Clone, Copy, Debug)]
pub(in crate::integrator) struct SegmentVertex {
    pub segment: FirstSegment,
    pub distance: f32,
}

/// How else a direction towards a light may have been found at a vertex, by density per solid angle.
#[derive(Clone, Copy, Debug)]
pub(super) struct DirectionPdfs {
    /// By sampling the light that was chosen.
    pub light: f32,
    /// By the phase function; 0 of lights that it cannot find.
    pub phase: f32,
}

impl SegmentVertex {
    /// Share of the strategies at a vertex, against that of [`add`], in the light that arrives there.
    pub(super) fn share(&self, context: &Context, id: LightId, pdfs: DirectionPdfs) -> f32 {
        let p = self.segment.way.origin + self.segment.way.direction.as_dvec3() * f64::from(self.distance);
        let Some(equiangular_pdf) = equiangular_pdf(context, &self.segment, id, self.distance) else { return 1.0 };
        let pmf = context.scene.lights.pmf(id, &LightSampleContext::from_any_side(p), context.compensation);
        let at_vertex = self.segment.pdf(context.world, self.distance) * (pmf * pdfs.light + pdfs.phase);
        power_heuristic(at_vertex, equiangular_pdf * pdfs.light)
    }
}

/// The density with which [`add`] chooses a light and a distance.
fn equiangular_pdf(context: &Context, segment: &FirstSegment, id: LightId, distance: f32) -> Option<f32> {
    let by_angle = context.scene.lights.get(id).equiangular(&context.scene.geometry, &segment.way)?;
    Some(by_angle.pdf(distance) * context.scene.lights.pmf(id, &chooser(segment), context.compensation))
}

/// The point for which a light is chosen on a way.
fn chooser(segment: &FirstSegment) -> LightSampleContext {
    LightSampleContext::from_any_side(segment.way.origin)
}

/// Whether distances are chosen for lights.
pub(super) fn is_enabled(context: &Context) -> bool {
    !context.is_last && context.config.strategy != Strategy::Bsdf && !context.scene.lights.is_empty()
}

/// A path on its way through a medium.
pub(super) struct SegmentPath<'a> {
    /// Index in the wave.
    pub index: usize,
    pub slot: u32,
    pub seed: u32,
    pub sample: u32,
    /// Where it begins.
    pub throughput: Rgb,
    pub state: &'a MediaState,
    pub time: f32,
    /// For the distance, and the choice of a light.
    pub u: [f32; 2],
}

/// Adds the light that arrives at a chosen distance; the result is how many rays that took.
pub(super) fn add(context: &Context, wave: &Wave, path: &SegmentPath, segment: &FirstSegment, out: &mut Output) -> u64 {
    let scene = context.scene;
    let set = dimensions::equiangular(context.bounce);
    let u = context.config.sampler.sample_4d(PixelSeed(path.seed), path.sample, set);
    let Some(choice) = scene.lights.choose(&chooser(segment), [path.u[1], u[2]], context.compensation) else {
        return 0;
    };
    let light = scene.lights.get(choice.id);
    let Some(by_angle) = light.equiangular(&scene.geometry, &segment.way) else { return 0 };
    let distance = by_angle.sample(path.u[0]);
    let equiangular_pdf = by_angle.pdf(distance) * choice.pmf;
    let direction = segment.way.direction;
    let p = segment.way.origin + direction.as_dvec3() * f64::from(distance);
    let sample = light.sample(
        &scene.geometry,
        &scene.textures,
        &LightSampleContext::from_any_side(p),
        [u[0], u[1]],
        context.compensation,
    );
    let Some(sample) = sample.filter(|_| equiangular_pdf > 0.0 && distance.is_finite()) else { return 0 };
    let medium = scene.media.get(segment.medium);
    let phase = medium.phase.pdf(-direction, sample.wi);
    let is_mis = context.config.strategy == Strategy::Mis && !sample.is_delta;
    let pdfs = DirectionPdfs { light: sample.pdf, phase: if is_mis { phase } else { 0.0 } };
    let weight = 1.0 - SegmentVertex { segment: *segment, distance }.share(context, choice.id, pdfs);
    let scattered = transmittance(medium.extinction(), distance) * medium.scattering * phase;
    let factor = weight / (equiangular_pdf * sample.pdf);
    let contribution = path.throughput * scattered * sample.radiance * factor;
    if contribution.is_black() || !contribution.is_finite() {
        return 0;
    }
    let start = SpawnPoint { p, n: Vec3::ZERO, error: 0.0 };
    let shadow = Shadow {
        start,
        sample,
        time: path.time,
        random: random(context, path.seed, path.sample, Purpose::LightDistance),
    };
    let (left, traced) = shadow.trace(context, path.state);
    if left.is_black() {
        return traced;
    }
    let light = context.config.clamped(contribution * left, context.bounce + 1);
    out.add(path.slot, light);
    if context.config.needs_light_aovs() {
        let event = wave.light_aovs.shadow_event(context, path.index, 0, || LobeWeights::Volume);
        out.add_to_light_aovs(context, path.slot, light, event, choice.id);
    }
    traced
}

/// A shadow ray from a point of a medium.
struct Shadow {
    start: SpawnPoint,
    sample: LightSample,
    time: f32,
    random: Rng,
}

impl Shadow {
    fn trace(mut self, context: &Context, state: &MediaState) -> (Rgb, u64) {
        let (ray, end) = match &self.sample.target {
            ShadowTarget::Point(target) => (self.start.ray_to(target), ShadowEnd::Point(target)),
            ShadowTarget::Infinity => (self.start.ray_along(self.sample.wi), ShadowEnd::Infinity),
        };
        context.world.light_transmittance(&Ray { time: self.time, ..ray }, &end, *state, &mut self.random)
    }
}
