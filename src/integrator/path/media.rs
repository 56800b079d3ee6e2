//! Media on the way of paths and shadow rays.

use super::Context;
use super::block::{Vertices, spawn};
use super::wave::{Wave, path_flags};
use crate::color::Rgb;
use crate::integrator::dimensions;
use crate::integrator::media::MediaState;
use crate::math::Ray;
use crate::math::rows::BATCH;
use crate::medium::RelativeIor;
use crate::sampling::PixelSeed;

/// Takes every path through media to the next surface that scatters it; the result is how many rays that took.
#[inline(never)]
pub(super) fn pass_boundaries(context: &Context, wave: &mut Wave) -> u64 {
    let mut passed = 0;
    for index in 0..wave.count {
        let (block, i) = (index / BATCH, index % BATCH);
        let Wave { paths, rays, hits, media, cones, light_aovs, .. } = wave;
        let (paths, state) = (&mut paths[block], &mut media[index]);
        let mut ray = rays[block].get(i);
        let start = ray.origin;
        let segment = context.world.trace_through_null_boundaries(&mut ray, hits[block].get(i), state);
        hits[block].set(i, segment.hit);
        paths.throughput.set(i, paths.throughput.get(i) * segment.transmittance);
        light_aovs.absorb(index, segment.transmittance);
        if segment.passed > 0 {
            // No shadow ray would have come so far.
            paths.flags[i] |= path_flags::SPECULAR;
            passed += u64::from(segment.passed);
            if let Some(cone) = cones.get_mut(index) {
                *cone = cone.moved((ray.origin - start).length());
            }
            rays[block].set(i, &ray);
        }
        if matches!(segment.ior, Some(RelativeIor::Dispersed(_))) {
            // The path follows one of the colours, which are refracted differently.
            let seed = PixelSeed(paths.seed[i]);
            let channel =
                ((3.0 * context.config.sampler.sample_4d(seed, paths.sample[i], dimensions::COLOR)[0]) as usize).min(2);
            let mut only = [0.0; 3];
            only[channel] = 3.0;
            paths.throughput.set(i, paths.throughput.get(i) * Rgb::from(only));
            state.channel = Some(channel);
        }
        state.ior = segment.ior.map(|ior| ior.of(state.channel));
    }
    passed
}

/// Multiplies what the shadow rays of a block's vertices contribute by the transmittance of the media on their way.
pub(super) fn absorb_direct(context: &Context, vertices: &mut Vertices, media: &[MediaState], block: usize) {
    for lane in 0..vertices.count {
        if vertices.direct.status[lane] != spawn::SPAWNED {
            continue;
        }
        let at = vertices.interaction(lane);
        let from = vertices.rows.direction.get(lane);
        let direct = &mut vertices.direct;
        let ray = Ray {
            t_max: direct.shadow_end[lane],
            ..Ray::new(direct.shadow_origin.get(lane), direct.shadow_direction.get(lane))
        };
        let inside = context.world.media_toward(
            &at,
            from,
            ray.direction,
            &media[block * BATCH + vertices.rows.path[lane] as usize].current,
        );
        direct.contribution.set(lane, direct.contribution.get(lane) * context.world.transmittance(&inside, &ray));
    }
}

/// The media of the path that goes on from a vertex.
pub(super) fn after(context: &Context, vertices: &Vertices, lane: usize, state: &MediaState) -> MediaState {
    let at = vertices.interaction(lane);
    let to = vertices.scatter.direction.get(lane);
    MediaState {
        current: context.world.media_toward(&at, vertices.rows.direction.get(lane), to, &state.current),
        ..*state
    }
}
