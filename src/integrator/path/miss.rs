//! Light from environments and distant lights, met by rays that leave the scene.

use super::Context;
use super::emission::{against, scattering_weight};
use super::radiance::Output;
use super::surface_aovs::write_miss;
use super::wave::{Wave, path_flags};
use crate::color::{Rgb, RgbRows};
use crate::integrator::Strategy;
use crate::integrator::light_events::LightEvent;
use crate::light::{EnvironmentScratch, InfiniteLightEvalRows};
use crate::math::Vec3;
use crate::math::compact::Compaction;
use crate::math::rows::{BATCH, Element, soa, whole_vectors};
use crate::math::vectorize::vectorize;

soa! {
    /// Paths that leave the scene.
    struct MissRows {
        throughput: Rgb,
        direction: Vec3,
        /// As in [`PathRows`](super::wave::PathRows).
        pdf: f32,
        flags: u32,
        /// Weight by MIS of one light.
        weight: f32,
        /// Radiance of all lights, weighted,
        radiance: Rgb,
        /// and weighted without regard to photons.
        radiance_without_photons: Rgb,
    }
}

/// Buffers of one block.
#[derive(Default)]
pub(super) struct MissScratch {
    rows: MissRows,
    evals: InfiniteLightEvalRows,
    environment: EnvironmentScratch,
    /// Weighted radiance by light at infinity.
    by_light: Vec<RgbRows>,
}

/// Adds the light that a block's paths meet which leave the scene.
pub(super) fn add(context: &Context, wave: &mut Wave, block: usize, out: &mut Output) {
    let lights = context.scene.lights.at_infinity();
    let needs_aovs = context.config.needs_light_aovs() || context.needs_surface_aovs();
    if wave.vertices.misses.is_empty() || (lights.is_empty() && context.bounce > 0 && !needs_aovs) {
        return;
    }
    let lanes = Compaction::of(&wave.vertices.misses);
    find_radiance(context, wave, block, &lanes);
    let Wave { paths, rays, light_aovs, miss, moments, continuations, .. } = wave;
    let (slots, rays, MissScratch { rows, by_light, .. }) = (&paths[block].slot, &rays[block], miss);
    let is_visible = context.bounce > 0 || (!context.config.hide_emitters && context.pass.render.shows_background);
    for (k, i) in lanes.lanes().enumerate() {
        let (slot, throughput, radiance) = (slots[i], rows.throughput.get(k), rows.radiance.get(k));
        if is_visible {
            if context.bounce == 0 {
                out.batch.pixels[slot as usize].alpha = context.pass.render.background_alpha();
            }
            let light = context.config.clamped(throughput * radiance, context.bounce);
            out.add(slot, light);
            if continuations.is_enabled() && context.bounce > 0 {
                for (&id, radiance) in lights.iter().zip(&*by_light) {
                    continuations.add_distant(id, &rays.get(i), throughput * radiance.get(k));
                }
            }
            if moments.needs_emission {
                moments.add_emission(slot, light, throughput * rows.radiance_without_photons.get(k));
            }
            if context.config.needs_light_aovs() {
                let event = light_aovs.event(context.bounce, block * BATCH + i, LightEvent::Environment);
                out.add_by_scattering(slot, light, event);
                add_to_groups(context, slot, light, by_light.iter().map(|radiance| throughput * radiance.get(k)), out);
            }
        }
        if context.needs_surface_aovs() {
            let shown = context.bounce > 0 || !context.config.hide_emitters;
            let features = light_aovs.feature_throughput(block * BATCH + i);
            let radiance = if shown { radiance } else { Rgb::BLACK };
            write_miss(context, features, rows.direction.get(k), radiance, &mut out.batch.surfaces[slot as usize]);
        }
    }
}

/// Divides the light that a path meets at infinity among the AOVs of light groups, as its lights shine there.
#[inline(never)]
fn add_to_groups(
    context: &Context,
    slot: u32,
    light: Rgb,
    of_lights: impl Iterator<Item = Rgb> + Clone,
    out: &mut Output,
) {
    let lights = context.scene.lights.at_infinity();
    if let [id] = lights {
        out.add_to_group_of(context, slot, light, *id);
        return;
    }
    let all = of_lights.clone().fold(Rgb::BLACK, |sum, light| sum + light);
    let scale = if all.max_channel() > 0.0 { light.max_channel() / all.max_channel() } else { 0.0 };
    for (&id, light) in lights.iter().zip(of_lights) {
        out.add_to_group_of(context, slot, light * scale, id);
    }
}

/// Finds the radiance from infinity, weighted by MIS.
fn find_radiance(context: &Context, wave: &mut Wave, block: usize, lanes: &Compaction) {
    let Wave { paths, rays, miss, caustics, connections, moments, .. } = wave;
    let (paths, rays, count) = (&paths[block], &rays[block], lanes.len());
    let MissScratch { rows, evals, environment, by_light } = miss;
    lanes.compact_3(&paths.throughput.0, &mut rows.throughput.0);
    lanes.compact_3(&rays.direction.0, &mut rows.direction.0);
    lanes.compact(&paths.pdf, &mut rows.pdf);
    lanes.compact(&paths.flags, &mut rows.flags);
    (rows.radiance, rows.radiance_without_photons) = (Rgb::ZERO, Rgb::ZERO);
    let lights = &context.scene.lights;
    by_light.resize_with(lights.at_infinity().len(), || Rgb::ZERO);
    for (&id, weighted) in lights.at_infinity().iter().zip(by_light) {
        match lights.environment_map() {
            Some((map, image)) if map == id => {
                // No density is needed of what the camera sees.
                let compensation = (context.bounce > 0).then_some(context.compensation);
                environment.eval(image, &rows.direction, count, compensation, evals);
            }
            _ => (0..count).for_each(|k| {
                let eval = lights.get(id).eval_infinite(rows.direction.get(k), context.compensation);
                evals.radiance.set(k, eval.radiance);
                evals.pdf[k] = eval.pdf;
            }),
        }
        let pmf = lights.pmf_by_power(id, context.compensation);
        let densities = LightDensities { pmf, samples: context.last_light_samples() as f32 };
        vectorize!(weigh(context.config.strategy, densities, evals, rows, count));
        if moments.needs_emission || !caustics.is_empty() || !connections.is_empty() {
            let has_radiance = |k: usize| !evals.radiance.get(k).is_black();
            for (k, path) in lanes.lanes().map(|i| block * BATCH + i).enumerate().filter(|&(k, _)| has_radiance(k)) {
                let (direction, from) = (rows.direction.get(k), paths.from(path % BATCH).p.as_vec3());
                let connection = connections.get(path).map(|state| state.of_miss(context, id, from, direction));
                let weighed = |weight: f32| connection.map_or(weight, |connection| against(weight, connection));
                let weight = rows.weight[k];
                let without_photons = rows.radiance_without_photons.get(k) + evals.radiance.get(k) * weighed(weight);
                rows.radiance_without_photons.set(k, without_photons);
                let photons = caustics.get(path).map(|state| state.of_emission(|| evals.pdf[k] * pmf));
                rows.weight[k] = weighed(photons.map_or(weight, |photons| against(weight, photons)));
            }
        }
        vectorize!(add_weighted(evals, rows, weighted, count));
    }
}

/// How light sampling finds a light.
#[derive(Clone, Copy)]
struct LightDensities {
    /// Probability with which the light is chosen.
    pmf: f32,
    /// How many lights are sampled.
    samples: f32,
}

#[inline(always)]
fn weigh(
    strategy: Strategy,
    densities: LightDensities,
    evals: &InfiniteLightEvalRows,
    rows: &mut MissRows,
    count: usize,
) {
    for k in 0..whole_vectors(count) {
        let is_specular = rows.flags[k] & path_flags::SPECULAR != 0;
        let light_pdf = densities.samples * (evals.pdf[k] * densities.pmf);
        rows.weight[k] = scattering_weight(strategy, is_specular, rows.pdf[k], || light_pdf);
    }
}

#[inline(always)]
fn add_weighted(evals: &InfiniteLightEvalRows, rows: &mut MissRows, weighted: &mut RgbRows, count: usize) {
    for k in 0..whole_vectors(count) {
        let radiance = evals.radiance.get(k);
        // Without radiance the density may be none.
        let weight = if radiance.is_black() { 0.0 } else { <f32 as Element>::get(&rows.weight, k) };
        weighted.set(k, radiance * weight);
        rows.radiance.set(k, rows.radiance.get(k) + radiance * weight);
    }
}
