//! Media on the way of paths and shadow rays.

use super::Context;
use super::block::{Vertices, spawn};
use super::equiangular::{self, DirectionPdfs, SegmentPath, SegmentVertex};
use super::radiance::Output;
use super::wave::{PathRows, Wave, path_flags};
use crate::color::Rgb;
use crate::geometry::Hit;
use crate::id::LightId;
use crate::integrator::light_events::LightEvent;
use crate::integrator::media::MediaState;
use crate::integrator::participating::{DistanceSample, ShadowEnd};
use crate::integrator::{Strategy, dimensions};
use crate::light::light_target;
use crate::math::random::hash64;
use crate::math::rows::BATCH;
use crate::math::{Ray, RayCone, RayRows, Rng};
use crate::medium::RelativeIor;
use crate::sampling::PixelSeed;

/// Takes every path through media to the next surface that scatters it; the result is how many rays that took.
#[inline(never)]
pub(super) fn pass_boundaries(context: &Context, wave: &mut Wave) -> u64 {
    let mut passed = 0;
    for index in 0..wave.count {
        let (block, i) = (index / BATCH, index % BATCH);
        if skips_walk(wave, index) {
            continue;
        }
        let Wave { paths, rays, hits, media, cones, light_aovs, .. } = wave;
        let (paths, state) = (&mut paths[block], &mut media[index]);
        let mut ray = rays[block].get(i);
        let segment = context.world.trace_through_null_boundaries(&mut ray, hits[block].get(i), state);
        hits[block].set(i, segment.hit);
        paths.throughput.set(i, paths.throughput.get(i) * segment.transmittance);
        light_aovs.absorb(index, segment.transmittance);
        if segment.passed > 0 {
            // No shadow ray would have come so far.
            paths.flags[i] |= path_flags::SPECULAR;
            passed += u64::from(segment.passed);
            move_ray(&mut rays[block], cones, index, &ray);
        }
        arrive(context, paths, i, state, segment.ior);
    }
    passed
}

/// Whether a path was below a surface, where the media around that are not.
fn skips_walk(wave: &mut Wave, index: usize) -> bool {
    let is_below = wave.walks.get(index).is_some_and(Option::is_some);
    if is_below {
        wave.media[index] = MediaState { ior: None, arrival: None, departure: None, ..wave.media[index] };
    }
    is_below
}

/// Replaces the ray of a path by one that starts farther along it.
fn move_ray(rays: &mut RayRows, cones: &mut [RayCone], index: usize, ray: &Ray) {
    let lane = index % BATCH;
    if let Some(cone) = cones.get_mut(index) {
        *cone = cone.moved((ray.origin - rays.origin.get(lane)).length());
    }
    rays.set(lane, ray);
}

/// Arrives at a surface, of this relative index of refraction if it is a boundary between media.
fn arrive(context: &Context, paths: &mut PathRows, i: usize, state: &mut MediaState, ior: Option<RelativeIor>) {
    if matches!(ior, Some(RelativeIor::Dispersed(_))) {
        // The path follows one of the colours, which are refracted differently.
        let seed = PixelSeed(paths.seed[i]);
        let channel =
            ((3.0 * context.config.sampler.sample_4d(seed, paths.sample[i], dimensions::COLOR)[0]) as usize).min(2);
        let mut only = [0.0; 3];
        only[channel] = 3.0;
        paths.throughput.set(i, paths.throughput.get(i) * Rgb::from(only));
        state.channel = Some(channel);
    }
    state.ior = ior.map(|ior| ior.of(state.channel));
}

/// What random numbers beyond those of the sampler are for.
#[derive(Clone, Copy)]
pub(super) enum Purpose {
    Distance,
    Shadow,
    /// The random walk below a surface.
    Walk,
    /// The shadow ray from a distance that is chosen for a light.
    LightDistance,
}

/// Random numbers of a segment of a path.
pub(super) fn random(context: &Context, seed: u32, sample: u32, purpose: Purpose) -> Rng {
    let path = hash64(u64::from(seed) << 32 | u64::from(sample));
    Rng::new(hash64(path ^ (u64::from(context.bounce) << 8 | purpose as u64)))
}

/// Takes every path to the next point of a medium or surface that scatters it, and adds what media emit on the way;
/// the result is how many more rays that took.
#[inline(never)]
pub(super) fn scatter(context: &Context, wave: &mut Wave, out: &mut Output) -> u64 {
    let mut passed = 0;
    for index in 0..wave.count {
        let (block, i) = (index / BATCH, index % BATCH);
        if skips_walk(wave, index) {
            continue;
        }
        let Wave { paths, rays, hits, media, cones, light_aovs, .. } = wave;
        let (paths, state) = (&mut paths[block], &mut media[index]);
        let mut ray = rays[block].get(i);
        let throughput = paths.throughput.get(i);
        let u = context.config.sampler.sample_4d(
            PixelSeed(paths.seed[i]),
            paths.sample[i],
            dimensions::medium(context.bounce),
        );
        let random = random(context, paths.seed[i], paths.sample[i], Purpose::Distance);
        let sample = DistanceSample::new(throughput, [u[0], u[1]], random);
        let before = *state;
        let path = context.world.trace_through_media(&mut ray, hits[block].get(i), state, sample);
        hits[block].set(i, path.hit);
        let first = path.first.filter(|_| equiangular::is_enabled(context));
        let is_first = path.passed == 0 && path.hit.is_some_and(|hit| hit.instance == Hit::MEDIUM);
        state.arrival = first.filter(|_| is_first).map(|segment| {
            let t = path.hit.map_or(0.0, |hit| hit.t);
            SegmentVertex { segment, distance: (t - ray.t_min) * ray.direction.length() }
        });
        if !path.emitted.is_black() {
            let light = context.config.clamped(throughput * path.emitted, context.bounce);
            let event = light_aovs.event(context.bounce, index, LightEvent::Emission);
            out.add_without_light(context, paths.slot[i], light, event);
        }
        paths.throughput.set(i, throughput * path.weight);
        light_aovs.absorb(index, path.weight);
        if path.passed > 0 {
            passed += u64::from(path.passed);
            move_ray(&mut rays[block], cones, index, &ray);
        }
        arrive(context, paths, i, state, path.ior);
        if let Some(segment) = first {
            let on_segment = SegmentPath {
                index,
                slot: paths.slot[i],
                seed: paths.seed[i],
                sample: paths.sample[i],
                throughput,
                state: &before,
                time: ray.time,
                u: [u[2], u[3]],
            };
            wave.counts.shadow += equiangular::add(context, wave, &on_segment, &segment, out);
        }
    }
    passed
}

/// Follows the shadow rays of a block's vertices through media to their lights, and multiplies what they contribute by
/// what is left of it; the result is how many rays that took.
#[inline(never)]
pub(super) fn trace_shadow_rays(context: &Context, vertices: &mut Vertices, media: &[MediaState], block: usize) -> u64 {
    let mut traced = 0;
    for lane in 0..vertices.count {
        if vertices.direct.status[lane] != spawn::SPAWNED {
            continue;
        }
        let (ray, state) = shadow_ray(context, vertices, media, block, lane);
        let target = vertices.light_target(lane);
        let end = match vertices.light_samples.target[lane] {
            light_target::POINT => ShadowEnd::Point(&target),
            _ => ShadowEnd::Infinity,
        };
        let mut random = random(context, vertices.rows.seed[lane], vertices.rows.sample[lane], Purpose::Shadow);
        let (left, rays) = context.world.light_transmittance(&ray, &end, state, &mut random);
        traced += rays;
        let share = direct_share(context, vertices, lane, &state);
        let direct = &mut vertices.direct;
        direct.contribution.set(lane, direct.contribution.get(lane) * left * share);
        if left.is_black() {
            direct.status[lane] = spawn::NONE;
        }
    }
    traced
}

/// The share of a vertex's light sample in what arrives there, against that of distances chosen for lights.
fn direct_share(context: &Context, vertices: &Vertices, lane: usize, state: &MediaState) -> f32 {
    let (Some(arrival), true) = (&state.arrival, vertices.is_medium(lane)) else { return 1.0 };
    let lights = &vertices.light_samples;
    let id = LightId(lights.light[lane]);
    let pmf = context.scene.lights.pmf(id, &vertices.light_context(lane), context.compensation);
    let is_mis = context.config.strategy == Strategy::Mis && lights.is_delta[lane] == 0;
    let phase = if is_mis { vertices.light_evals.pdf[lane] } else { 0.0 };
    arrival.share(context, id, DirectionPdfs { light: lights.pdf[lane] / pmf, phase })
}

/// The shadow ray of a vertex, and the media at its start.
fn shadow_ray(
    context: &Context,
    vertices: &Vertices,
    media: &[MediaState],
    block: usize,
    lane: usize,
) -> (Ray, MediaState) {
    let direct = &vertices.direct;
    let ray = Ray {
        t_max: direct.shadow_end[lane],
        time: vertices.rows.time[lane],
        ..Ray::new(direct.shadow_origin.get(lane), direct.shadow_direction.get(lane))
    };
    let state = media[block * BATCH + vertices.path(lane)];
    let (at, from) = (vertices.interaction(lane), vertices.rows.direction.get(lane));
    let current = context.world.media_toward(&at, from, ray.direction, &state.current);
    (ray, MediaState { current, ..state })
}

/// Multiplies what the shadow rays of a block's vertices contribute by the transmittance of the media on their way.
pub(super) fn absorb_direct(context: &Context, vertices: &mut Vertices, media: &[MediaState], block: usize) {
    for lane in 0..vertices.count {
        if vertices.direct.status[lane] != spawn::SPAWNED {
            continue;
        }
        let (ray, MediaState { current, .. }) = shadow_ray(context, vertices, media, block, lane);
        let direct = &mut vertices.direct;
        direct.contribution.set(lane, direct.contribution.get(lane) * context.world.transmittance(&current, &ray));
    }
}

/// The media of the path that goes on from a vertex.
pub(super) fn after(context: &Context, vertices: &Vertices, lane: usize, state: &MediaState) -> MediaState {
    let at = vertices.interaction(lane);
    let to = vertices.scatter.direction.get(lane);
    MediaState {
        current: context.world.media_toward(&at, vertices.rows.direction.get(lane), to, &state.current),
        arrival: None,
        departure: state.arrival,
        ..*state
    }
}
