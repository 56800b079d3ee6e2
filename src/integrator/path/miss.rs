//! Light from environments and distant lights, met by rays that leave the scene.

use super::Context;
use super::radiance::Output;
use super::wave::{PathRows, Wave};
use crate::color::Rgb;
use crate::id::LightId;
use crate::integrator::parts::LightEvent;
use crate::light::{EnvironmentScratch, InfinityEval, InfinityEvalRows};
use crate::math::Vec3;
use crate::math::rows::{BATCH, Vectors};

/// Buffers of one block.
#[derive(Default)]
pub(super) struct MissScratch {
    directions: Vectors,
    evals: InfinityEvalRows,
    environment: EnvironmentScratch,
}

/// Adds the light that a block's paths meet which leave the scene.
pub(super) fn add(context: &Context, wave: &mut Wave, block: usize, out: &mut Output) {
    let Wave { vertices, paths, rays, light_aovs, miss, .. } = wave;
    let (paths, rays, misses) = (&paths[block], &rays[block], &vertices.misses);
    if misses.is_empty() {
        return;
    }
    let world = context.world;
    let MissScratch { directions, evals, environment } = miss;
    let image = context.scene.lights.image_at_infinity();
    for (k, &path) in misses.iter().enumerate() {
        directions.set(k, rays.direction.get(usize::from(path)));
    }
    if let Some((_, image)) = image {
        // No density is needed of what the camera sees.
        let found_by = (context.bounce > 0).then_some(context.found_by);
        environment.eval(image, directions, misses.len(), found_by, evals);
    }
    let is_visible = context.bounce > 0 || (!context.config.hide_emitters && world.shows_background);
    for (k, &path) in misses.iter().enumerate() {
        let i = usize::from(path);
        let direction = directions.get(k);
        let known = image.map(|_| InfinityEval { radiance: evals.radiance.get(k), pdf: evals.pdf[k] });
        let slot = paths.slot[i];
        if is_visible {
            if context.bounce == 0 {
                out.batch.pixels[slot as usize].alpha = world.background_alpha();
            }
            let light = context.config.clamped(paths.throughput.get(i) * radiance(context, paths, i, direction, known), context.bounce);
            out.add(slot, light);
            if context.config.wants_light_aovs() {
                let event = light_aovs.event(context.bounce, block * BATCH + i, LightEvent::Environment);
                add_to_light_aovs(context, (paths, i), (direction, known), light, event, out);
            }
        }
        if context.wants_surfaces() {
            let shown = context.bounce > 0 || !context.config.hide_emitters;
            let radiance = || if shown { radiance(context, paths, i, direction, known) } else { Rgb::BLACK };
            super::surface_aovs::write_miss(context, slot, light_aovs.feature_throughput(block * BATCH + i), direction, radiance, out);
        }
    }
}

/// Radiance from infinity, weighted by MIS; `known` if it has been looked up already.
fn radiance(context: &Context, paths: &PathRows, i: usize, direction: Vec3, known: Option<InfinityEval>) -> Rgb {
    let lights = context.scene.lights.at_infinity();
    lights.iter().fold(Rgb::BLACK, |sum, &id| sum + radiance_of(context, paths, i, direction, id, known))
}

#[inline(always)]
fn radiance_of(context: &Context, paths: &PathRows, i: usize, direction: Vec3, id: LightId, known: Option<InfinityEval>) -> Rgb {
    let lights = &context.scene.lights;
    let InfinityEval { radiance, pdf } = known.unwrap_or_else(|| lights.get(id).eval_at_infinity(direction, context.found_by));
    if radiance.is_black() {
        return Rgb::BLACK;
    }
    radiance * super::emission::bsdf_mis_weight(context, paths, i, || pdf * lights.pmf(id, &paths.from(i), context.found_by))
}

#[inline(never)]
fn add_to_light_aovs(
    context: &Context,
    (paths, i): (&PathRows, usize),
    (direction, known): (Vec3, Option<InfinityEval>),
    light: Rgb,
    event: LightEvent,
    out: &mut Output,
) {
    let slot = paths.slot[i];
    out.add_by_scattering(slot, light, event);
    match context.scene.lights.at_infinity() {
        [] => {}
        [id] => out.add_to_group_of(context, slot, light, *id),
        lights => {
            let of = |id: LightId| paths.throughput.get(i) * radiance_of(context, paths, i, direction, id, known);
            let all = lights.iter().fold(Rgb::BLACK, |sum, &id| sum + of(id));
            let scale = if all.max_channel() > 0.0 { light.max_channel() / all.max_channel() } else { 0.0 };
            for &id in lights {
                out.add_to_group_of(context, slot, of(id) * scale, id);
            }
        }
    }
}
