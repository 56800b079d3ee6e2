//! Light that surfaces emit, met by paths.

use super::Context;
use super::caustics::CausticState;
use super::connection_mis::ConnectionState;
use super::equiangular::{DirectionPdfs, SegmentVertex};
use super::radiance::Output;
use super::wave::{PathRows, Wave, path_flags};
use crate::color::Rgb;
use crate::geometry::SurfaceInteraction;
use crate::id::LightId;
use crate::integrator::Strategy;
use crate::integrator::bidirectional::bounded;
use crate::integrator::light_events::LightEvent;
use crate::light::{Light, LightSampleContext};
use crate::math::rows::BATCH;
use crate::math::{Ray, Vec3};
use crate::sampling::power_heuristic;

/// Weight of light that scattering has found, against finding it by sampling the light with density `light_pdf` from
/// the last vertex, and against photons, with the path's [`CausticState`].
#[inline(always)]
pub(super) fn bsdf_mis_weight(
    context: &Context,
    paths: &PathRows,
    i: usize,
    caustic: Option<&CausticState>,
    light_pdf: impl Fn(&LightSampleContext) -> f32,
) -> f32 {
    let from = paths.from(i);
    let weight = scattering_weight(context.config.strategy, paths.is_specular(i), paths.pdf[i], || {
        context.last_light_samples() as f32 * light_pdf(&from)
    });
    let Some(caustic) = caustic else { return weight };
    // Photons come from both sides.
    let from = LightSampleContext { n: Vec3::ZERO, ..from };
    against(weight, caustic.of_emission(|| light_pdf(&from)))
}

/// Weight of light that scattering has found with density `pdf`, against sampling the light with density `light_pdf`,
/// which counts all light samples.
#[inline(always)]
pub(super) fn scattering_weight(
    strategy: Strategy,
    is_specular: bool,
    pdf: f32,
    light_pdf: impl FnOnce() -> f32,
) -> f32 {
    match strategy {
        _ if is_specular => 1.0,
        Strategy::Mis => power_heuristic(pdf, light_pdf()),
        Strategy::Light => 0.0,
        Strategy::Bsdf => 1.0,
    }
}

/// A weight of the power heuristic against a further strategy too, whose squared density over the weighted one's is
/// given.
#[inline(always)]
pub(super) fn against(weight: f32, squared_ratio: f64) -> f32 {
    (f64::from(weight) * share_against(weight, squared_ratio)) as f32
}

/// What a further strategy leaves of a weight, as in [`against`].
#[inline(always)]
pub(super) fn share_against(weight: f32, squared_ratio: f64) -> f64 {
    1.0 / (1.0 + bounded(f64::from(weight) * squared_ratio))
}

/// Adds the light of emitters at a block's vertices.
pub(super) fn add(context: &Context, wave: &mut Wave, block: usize, out: &mut Output) {
    let Wave { vertices, paths, rays, light_aovs, caustics, connections, media, moments, .. } = wave;
    let (paths, rays) = (&paths[block], &rays[block]);
    for &lane in &vertices.emitters {
        let lane = usize::from(lane);
        let i = vertices.path(lane);
        if paths.flags[i] & path_flags::EMISSION_ADDED != 0 {
            continue;
        }
        let at = vertices.interaction(lane);
        let departure = media.get(block * BATCH + i).and_then(|state| state.departure.as_ref());
        let (caustic, connection) = (caustics.get(block * BATCH + i), connections.get(block * BATCH + i));
        let met = Met { paths, i, ray: rays.get(i), caustic, connection, departure };
        let Some((id, radiance)) = met.emitted(context, &at) else { continue };
        let light = context.config.clamped(paths.throughput.get(i) * radiance, context.bounce);
        if light.is_black() {
            continue;
        }
        out.add(paths.slot[i], light);
        if moments.needs_emission {
            let unweighted =
                Met { caustic: None, ..met }.emitted(context, &at).map_or(Rgb::BLACK, |(_, radiance)| radiance);
            moments.add_emission(paths.slot[i], light, paths.throughput.get(i) * unweighted);
        }
        if context.config.needs_light_aovs() {
            let event = light_aovs.event(context.bounce, block * BATCH + i, LightEvent::Emission);
            out.add_to_light_aovs(context, paths.slot[i], light, event, id);
        }
    }
}

/// A path that has met a surface.
struct Met<'a> {
    paths: &'a PathRows,
    i: usize,
    ray: Ray,
    caustic: Option<&'a CausticState>,
    connection: Option<&'a ConnectionState>,
    departure: Option<&'a SegmentVertex>,
}

impl Met<'_> {
    /// The light of the surface with what it emits against the ray, weighted by MIS; `None` if it is no emitter.
    fn emitted(&self, context: &Context, at: &SurfaceInteraction) -> Option<(LightId, Rgb)> {
        let Self { paths, i, ray, caustic, connection, departure } = self;
        let scene = context.scene;
        let id = scene.surface(at.shape).light(at.prim)?;
        let Light::Area(light) = scene.lights.get(id) else { return None };
        let radiance = light.radiance(&scene.geometry, &scene.textures, at, -ray.direction);
        if radiance.is_black() {
            return Some((id, radiance));
        }
        let light_pdf = |from: &LightSampleContext| {
            light.pdf(&scene.geometry, from, ray, at) * scene.lights.pmf(id, from, context.compensation)
        };
        let mut weight = bsdf_mis_weight(context, paths, *i, *caustic, light_pdf);
        if let Some(connection) = connection {
            let connections = connection.of_emission(context, id, at.n_g);
            weight = against(weight, connections);
        }
        if let Some(arrival) = departure {
            let light = light.pdf(&scene.geometry, &LightSampleContext::from_any_side(paths.from(*i).p), ray, at);
            weight *= arrival.share(context, id, DirectionPdfs { light, phase: paths.pdf[*i] });
        }
        Some((id, radiance * weight))
    }
}
