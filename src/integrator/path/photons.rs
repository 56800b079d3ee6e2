//! Photons: light traced from mirrors, metal and glass by delta and near-specular lobes, by the stages of paths.

use super::adjoint::{self, AdjointScattering, beam_ratio};
use super::block::{Vertices, spawn, vertex_flags};
use super::wave::Wave;
use super::{Context, PathBuffers, PathIntegrator, materials, media, scatter, specular_direct, trace, vertices};
use crate::color::Rgb;
use crate::geometry::Hit;
use crate::id::LightId;
use crate::integrator::{
    CameraBatch, CameraSample, CausticCasters, CausticPoint, PassContext, Photon, PhotonRange, RayCounts, Workspace,
    cancel, dimensions,
};
use crate::light::{LightSampleContext, ShadowTarget};
use crate::math::rows::BATCH;
use crate::math::{DVec3, Ray};

/// Where photons come from.
pub(super) struct Source<'a> {
    pub casters: &'a CausticCasters,
    pub range: &'a PhotonRange,
}

/// State of a photon on its way.
#[derive(Clone, Copy, Debug)]
pub(super) struct PhotonState {
    /// As in [`Photon`], but before the first scattering the density of light sampling.
    density: f32,
    light: LightId,
    /// The density with which the direction to the light was chosen.
    light_pdf: f32,
    /// The point of the light, or one beyond the scene.
    target: DVec3,
    /// Where its ray is to arrive first.
    start: CausticPoint,
}

/// A point counts as the start of a photon up to this part of its ray's length and of its distance from the origin.
const START_TOLERANCE: f64 = 1e-5;

/// Appends the photons that arrive.
pub(super) fn trace(
    config: &PathIntegrator,
    pass: &PassContext,
    source: &Source,
    workspace: &mut Workspace,
    photons: &mut Vec<Photon>,
) {
    // No roulette: what a photon loses at mirrors and glass is little.
    let (config, pass) = (&config.for_light_paths(), &pass.for_light_paths());
    let mut context = Context::new(config, pass);
    let Workspace { counts, paths: PathBuffers(wave), .. } = workspace;
    let mut traced = RayCounts::default();
    start(&context, source, wave);
    // The last segments are those to the surface that gathers, and to the camera.
    for bounce in 0..config.max_depth.saturating_sub(1) {
        if wave.count == 0 || (bounce % cancel::BOUNCES == 0 && pass.render.is_cancel_due()) {
            break;
        }
        context.bounce = bounce;
        trace::closest(&context, wave, &mut traced);
        if context.scene.features.media {
            traced.indirect += media::pass_boundaries(&context, wave);
        }
        let mut survivors = 0;
        for block in 0..wave.blocks() {
            vertices::find(&context, wave, block);
            if bounce == 0 {
                keep_starts(wave, block);
            }
            materials::evaluate(&context, wave, block);
            materials::replace_bsdfs(&context, wave, block);
            if bounce > 0 {
                store(wave, block, bounce, photons);
            } else {
                drop_evaluated(&context, wave, block);
            }
            materials::sort_by_bsdf(&mut wave.vertices);
            vertices::build_frames(&context, wave);
            wave.draw(&context);
            scatter::sample(&context, None, wave, block);
            scatter_light(&context, source, wave, block);
            survivors = wave.append(&context, block, survivors);
        }
        wave.finish_bounce(&context, survivors);
    }
    traced.add(&wave.counts);
    counts.indirect += traced.total();
}

/// Starts a photon with each index for which a light shines on the chosen point.
fn start(context: &Context, source: &Source, wave: &mut Wave) {
    let (mut samples, mut states, mut powers) = (CameraBatch::default(), Vec::new(), Vec::new());
    for index in source.range.indices.clone() {
        if let Some((sample, state, power)) = emitted(context, source, index) {
            samples.push(&sample);
            states.push(state);
            powers.push(power);
        }
    }
    wave.start(context, &samples);
    wave.photons = states;
    for (i, &power) in powers.iter().enumerate() {
        wave.paths[i / BATCH].throughput.set(i % BATCH, power);
    }
}

/// Light that shines on a chosen point of a caster, its state, and its power times the number of photons.
fn emitted(context: &Context, source: &Source, index: u32) -> Option<(CameraSample, PhotonState, Rgb)> {
    let (scene, sampler, seed) = (context.scene, &context.config.sampler, source.range.seed);
    let [a, b, c, _] = sampler.sample_4d(seed, index, dimensions::CAMERA);
    let start = source.casters.sample(&scene.geometry, [a, b, c]);
    let from = LightSampleContext::from_any_side(start.point.p);
    let [a, b, u, v] = sampler.sample_4d(seed, index, dimensions::light(0));
    let choice = scene.lights.choose(&from, [a, b], context.compensation)?;
    let light = scene.lights.get(choice.id);
    let sample = light.sample(&scene.geometry, &scene.textures, &from, [u, v], context.compensation)?;
    let cos = sample.wi.dot(start.point.n).abs();
    let light_pdf = choice.pmf * sample.pdf;
    let power = sample.radiance * (cos / (light_pdf * start.pdf_area as f32));
    let density = source.casters.pdf_area(start.shape, Hit::NO_INSTANCE) * light_pdf / cos;
    if power.is_black() || !power.is_finite() || !density.is_finite() {
        return None;
    }
    let (shadow_ray, target) = match sample.target {
        ShadowTarget::Point(target) => (start.point.ray_to(&target), target.p),
        ShadowTarget::Infinity => {
            let beyond = f64::from(context.world.accel.bounds().size().length());
            (start.point.ray_along(sample.wi), start.point.p + sample.wi.as_dvec3() * beyond)
        }
    };
    if context.world.accel.occluded(&shadow_ray) {
        return None;
    }
    // The ray starts half-way, where nothing is in between.
    let origin = 0.5 * (start.point.p + target);
    let ray = Ray::new(origin.as_vec3(), -sample.wi);
    let state = PhotonState { density, light: choice.id, light_pdf: sample.pdf, target, start };
    Some((CameraSample { ray, seed, sample: index }, state, power))
}

/// Ends the photons whose ray has met something else than its start.
fn keep_starts(wave: &mut Wave, block: usize) {
    let Wave { vertices, photons, rays, .. } = wave;
    for lane in 0..vertices.count {
        let path = vertices.path(lane);
        let CausticPoint { shape, point, .. } = photons[block * BATCH + path].start;
        let (rows, at) = (&mut vertices.rows, vertices.points.p.get(lane));
        let origin = rays[block].origin.get(path).as_dvec3();
        let tolerance = START_TOLERANCE * ((point.p - origin).length() + point.p.length());
        if rows.shape[lane] != shape.0 || (at - point.p).length() > tolerance {
            rows.flags[lane] |= vertex_flags::MISS;
            rows.throughput.set(lane, Rgb::BLACK);
        }
    }
}

/// Ends the photons whose light is evaluated along camera paths.
fn drop_evaluated(context: &Context, wave: &mut Wave, block: usize) {
    let Wave { vertices, photons, .. } = wave;
    for lane in 0..vertices.count {
        let light = photons[block * BATCH + vertices.path(lane)].light;
        if specular_direct::replaces_photon(context, vertices.rows.flags[lane], light) {
            vertices.rows.flags[lane] |= vertex_flags::MISS;
            vertices.rows.throughput.set(lane, Rgb::BLACK);
        }
    }
}

/// Stores the photons that have arrived at surfaces where they are gathered.
fn store(wave: &Wave, block: usize, scatterings: u32, photons: &mut Vec<Photon>) {
    let Vertices { rows, points, count, .. } = &wave.vertices;
    for lane in (0..*count).filter(|&lane| rows.flags[lane] & vertex_flags::UNGATHERED == 0) {
        let PhotonState { density, light, .. } = wave.photons[block * BATCH + wave.vertices.path(lane)];
        let (n, wi) = (rows.n_g.get(lane), -rows.direction.get(lane));
        photons.push(Photon {
            p: points.p.get(lane).as_vec3(),
            n: if wi.dot(n) < 0.0 { -n } else { n },
            wi,
            power: rows.throughput.get(lane),
            density,
            light,
            scatterings,
            height: 1.0,
        });
    }
}

/// Scatters photons, but for those by other lobes than deltas and near-specular ones, which end.
fn scatter_light(context: &Context, source: &Source, wave: &mut Wave, block: usize) {
    let Wave { vertices, photons, .. } = wave;
    for lane in 0..vertices.count {
        let state = &mut photons[block * BATCH + vertices.path(lane)];
        let is_near_specular = vertices.rows.flags[lane] & vertex_flags::NEAR_SPECULAR != 0;
        let is_kept = vertices.scatter.is_delta[lane] != 0 || is_near_specular;
        vertices.direct.status[lane] = spawn::NONE;
        if vertices.scatter.status[lane] != spawn::SPAWNED || !is_kept {
            vertices.scatter.status[lane] = spawn::NONE;
            continue;
        }
        let AdjointScattering { flux, reversed_pdf } = adjoint::scatter(context, vertices, lane);
        state.density *= density_factor(context, vertices, lane, state, reversed_pdf);
        let is_wanted = state.density < f32::INFINITY || source.casters.traces_delta_lights;
        if flux.is_black() || !flux.is_finite() || !(state.density > 0.0) || !is_wanted {
            vertices.scatter.status[lane] = spawn::NONE;
        }
        vertices.scatter.throughput.set(lane, flux);
    }
}

/// What scattering changes the density of photons by, over that of the paths from the camera that find the same light.
fn density_factor(context: &Context, vertices: &Vertices, lane: usize, state: &PhotonState, reversed_pdf: f32) -> f32 {
    let Vertices { rows, scatter, .. } = vertices;
    let lights = &context.scene.lights;
    // Paths never meet a delta light.
    let is_met = context.bounce > 0 || !lights.get(state.light).is_delta();
    if scatter.is_delta[lane] != 0 {
        return if is_met { 1.0 / beam_ratio(vertices, lane) } else { f32::INFINITY };
    }
    let met = if is_met { reversed_pdf } else { 0.0 };
    let sampled = if context.bounce == 0 && rows.flags[lane] & vertex_flags::ENCLOSED == 0 {
        let from = vertices.light_context(lane);
        let light_pdf = state.light_pdf * lights.get(state.light).side_factor(&from, state.target);
        light_pdf * lights.pmf(state.light, &from, context.compensation)
    } else {
        0.0
    };
    let cos_out = scatter.direction.get(lane).dot(rows.n_g.get(lane));
    (rows.cos_geometric[lane] * scatter.pdf[lane] / (cos_out * met.hypot(sampled))).abs()
}
