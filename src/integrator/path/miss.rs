//! Light from environments and distant lights, met by rays that leave the scene.

use super::Context;
use super::caustics::CausticState;
use super::connection_mis::ConnectionState;
use super::radiance::Output;
use super::surface_aovs::write_miss;
use super::wave::{PathRows, Wave};
use crate::color::Rgb;
use crate::id::LightId;
use crate::integrator::light_events::LightEvent;
use crate::light::{EnvironmentScratch, InfiniteLightEval, InfiniteLightEvalRows};
use crate::math::Vec3;
use crate::math::rows::{BATCH, Vec3Rows};

/// Buffers of one block.
#[derive(Default)]
pub(super) struct MissScratch {
    directions: Vec3Rows,
    evals: InfiniteLightEvalRows,
    environment: EnvironmentScratch,
}

/// Adds the light that a block's paths meet which leave the scene.
pub(super) fn add(context: &Context, wave: &mut Wave, block: usize, out: &mut Output) {
    let Wave { vertices, paths, rays, light_aovs, miss, caustics, connections, moments, continuations, .. } = wave;
    let (paths, rays, misses) = (&paths[block], &rays[block], &vertices.misses);
    let is_black = context.scene.lights.at_infinity().is_empty();
    let needs_aovs = context.config.needs_light_aovs() || context.needs_surface_aovs();
    if misses.is_empty() || (is_black && context.bounce > 0 && !needs_aovs) {
        return;
    }
    let MissScratch { directions, evals, environment } = miss;
    let image = context.scene.lights.environment_map();
    for (k, &path) in misses.iter().enumerate() {
        directions.set(k, rays.direction.get(usize::from(path)));
    }
    if let Some((_, image)) = image {
        // No density is needed of what the camera sees.
        let compensation = (context.bounce > 0).then_some(context.compensation);
        environment.eval(image, directions, misses.len(), compensation, evals);
    }
    let is_visible = context.bounce > 0 || (!context.config.hide_emitters && context.pass.render.shows_background);
    for (k, &path) in misses.iter().enumerate() {
        let i = usize::from(path);
        let direction = directions.get(k);
        let known = image.map(|(id, _)| (id, InfiniteLightEval { radiance: evals.radiance.get(k), pdf: evals.pdf[k] }));
        let (caustic, connection) = (caustics.get(block * BATCH + i), connections.get(block * BATCH + i));
        let miss = Miss { paths, i, direction, known, caustic, connection };
        let slot = paths.slot[i];
        if is_visible {
            if context.bounce == 0 {
                out.batch.pixels[slot as usize].alpha = context.pass.render.background_alpha();
            }
            let light = context.config.clamped(paths.throughput.get(i) * miss.radiance(context), context.bounce);
            out.add(slot, light);
            if continuations.is_enabled() && context.bounce > 0 {
                for &id in context.scene.lights.at_infinity() {
                    continuations.add_distant(
                        id,
                        &rays.get(i),
                        paths.throughput.get(i) * miss.radiance_of(context, id),
                    );
                }
            }
            if moments.needs_emission {
                let unweighted = Miss { caustic: None, ..miss }.radiance(context);
                moments.add_emission(slot, light, paths.throughput.get(i) * unweighted);
            }
            if context.config.needs_light_aovs() {
                let event = light_aovs.event(context.bounce, block * BATCH + i, LightEvent::Environment);
                miss.add_to_light_aovs(context, light, event, out);
            }
        }
        if context.needs_surface_aovs() {
            let shown = context.bounce > 0 || !context.config.hide_emitters;
            let radiance = || if shown { miss.radiance(context) } else { Rgb::BLACK };
            let features = light_aovs.feature_throughput(block * BATCH + i);
            write_miss(context, features, direction, radiance, &mut out.batch.surfaces[slot as usize]);
        }
    }
}

/// A path that leaves the scene.
struct Miss<'a> {
    paths: &'a PathRows,
    i: usize,
    direction: Vec3,
    /// An environment and what it emits there, if that has been looked up already.
    known: Option<(LightId, InfiniteLightEval)>,
    caustic: Option<&'a CausticState>,
    connection: Option<&'a ConnectionState>,
}

impl Miss<'_> {
    /// Radiance from infinity, weighted by MIS.
    fn radiance(&self, context: &Context) -> Rgb {
        let lights = context.scene.lights.at_infinity();
        lights.iter().fold(Rgb::BLACK, |sum, &id| sum + self.radiance_of(context, id))
    }

    #[inline(always)]
    fn radiance_of(&self, context: &Context, id: LightId) -> Rgb {
        let Self { paths, i, direction, known, caustic, connection } = *self;
        let lights = &context.scene.lights;
        let InfiniteLightEval { radiance, pdf } = match known {
            Some((known, eval)) if known == id => eval,
            _ => lights.get(id).eval_infinite(direction, context.compensation),
        };
        if radiance.is_black() {
            return Rgb::BLACK;
        }
        let mut weight = super::emission::bsdf_mis_weight(context, paths, i, caustic, |from| {
            pdf * lights.pmf(id, from, context.compensation)
        });
        if let Some(connection) = connection {
            let connections = connection.of_miss(context, id, paths.from(i).p.as_vec3(), direction);
            weight = super::emission::against(weight, connections);
        }
        radiance * weight
    }

    #[inline(never)]
    fn add_to_light_aovs(&self, context: &Context, light: Rgb, event: LightEvent, out: &mut Output) {
        let slot = self.paths.slot[self.i];
        out.add_by_scattering(slot, light, event);
        match context.scene.lights.at_infinity() {
            [] => {}
            [id] => out.add_to_group_of(context, slot, light, *id),
            lights => {
                let of = |id: LightId| self.paths.throughput.get(self.i) * self.radiance_of(context, id);
                let all = lights.iter().fold(Rgb::BLACK, |sum, &id| sum + of(id));
                let scale = if all.max_channel() > 0.0 { light.max_channel() / all.max_channel() } else { 0.0 };
                for &id in lights {
                    out.add_to_group_of(context, slot, of(id) * scale, id);
                }
            }
        }
    }
}
