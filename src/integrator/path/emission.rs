//! Light that surfaces emit, met by paths.

use super::Context;
use super::radiance::Output;
use super::wave::{PathRows, Wave};
use crate::color::Rgb;
use crate::geometry::SurfaceInteraction;
use crate::id::LightId;
use crate::integrator::Strategy;
use crate::integrator::light_events::LightEvent;
use crate::light::Light;
use crate::math::Ray;
use crate::math::rows::BATCH;
use crate::sampling::power_heuristic;

/// Weight of light that scattering has found, against finding it by sampling the light with density `light_pdf`.
#[inline(always)]
pub(super) fn bsdf_mis_weight(context: &Context, paths: &PathRows, i: usize, light_pdf: impl FnOnce() -> f32) -> f32 {
    if paths.is_specular(i) {
        return 1.0;
    }
    match context.config.strategy {
        Strategy::Mis => power_heuristic(paths.pdf[i], light_pdf()),
        Strategy::Light => 0.0,
        Strategy::Bsdf => 1.0,
    }
}

/// Adds the light of emitters at a block's vertices.
pub(super) fn add(context: &Context, wave: &mut Wave, block: usize, out: &mut Output) {
    let Wave { vertices, paths, rays, light_aovs, .. } = &*wave;
    let (paths, rays) = (&paths[block], &rays[block]);
    for &lane in &vertices.emitters {
        let lane = usize::from(lane);
        let i = vertices.path(lane);
        let at = vertices.interaction(lane);
        let Some((id, radiance)) = emitted(context, paths, i, &rays.get(i), &at) else { continue };
        let light = context.config.clamped(paths.throughput.get(i) * radiance, context.bounce);
        if light.is_black() {
            continue;
        }
        out.add(paths.slot[i], light);
        if context.config.needs_light_aovs() {
            let event = light_aovs.event(context.bounce, block * BATCH + i, LightEvent::Emission);
            out.add_to_light_aovs(context, paths.slot[i], light, event, id);
        }
    }
}

/// The light of a surface with what it emits against `ray`, weighted by MIS; `None` if it is no emitter.
fn emitted(
    context: &Context,
    paths: &PathRows,
    i: usize,
    ray: &Ray,
    at: &SurfaceInteraction,
) -> Option<(LightId, Rgb)> {
    let scene = context.scene;
    let id = scene.surface(at.shape).light(at.prim)?;
    let Light::Area(light) = scene.lights.get(id) else { return None };
    let radiance = light.radiance(&scene.geometry, &scene.textures, at, -ray.direction);
    if radiance.is_black() {
        return Some((id, radiance));
    }
    let from = paths.from(i);
    let light_pdf = || light.pdf(&scene.geometry, from.p, ray, at) * scene.lights.pmf(id, &from, context.compensation);
    Some((id, radiance * bsdf_mis_weight(context, paths, i, light_pdf)))
}
