//! Paths from the lights, by the stages of paths from the camera.

use super::adjoint::{self, AdjointScattering};
use super::block::{Vertices, spawn, vertex_flags};
use super::wave::{PathRows, Wave, path_flags};
use super::{Context, PathBuffers, PathIntegrator, materials, scatter, trace, vertices};
use crate::color::Rgb;
use crate::geometry::{Hit, SpawnPoint, SurfaceInteraction};
use crate::id::{LightId, PrimId};
use crate::integrator::bidirectional::{
    CONNECTIONS_PER_VERTEX, Emitters, LightVertex, PartialMis, Scattering, squared,
};
use crate::integrator::{
    CameraBatch, CameraSample, PassContext, PhotonRange, RayCounts, Workspace, cancel, dimensions,
};
use crate::light::{EmittedRay, Light};
use crate::math::rows::BATCH;
use crate::math::{Ray, Vec2, Vec3};

/// State of a light path on its way.
#[derive(Clone, Copy, Debug)]
pub(super) struct LightPathState {
    light: LightId,
    start: SpawnPoint,
    /// Density per area and solid angle of its first segment, over the cosine with the light's normal.
    pdf_per_cos: f32,
    /// Whether no path from the camera meets the light.
    is_delta: bool,
    /// As of the last vertex: [`PartialMis::d_vc`], and the part of it that is not of connections.
    d_vc: f64,
    unconnected_d_vc: f64,
}

/// Appends the vertices of light paths.
pub(super) fn trace(
    config: &PathIntegrator,
    pass: &PassContext,
    source: &Source,
    workspace: &mut Workspace,
    light_vertices: &mut Vec<LightVertex>,
) {
    let (config, pass) = (&config.for_light_paths(), &pass.for_light_paths());
    let mut context = Context::new(config, pass);
    let Workspace { counts, paths: PathBuffers(wave), .. } = workspace;
    let mut traced = RayCounts::default();
    start(&context, source, wave);
    // The last segments are the connection, and that to the camera.
    for bounce in 0..config.max_depth.saturating_sub(2) {
        if wave.count == 0 || (bounce % cancel::BOUNCES == 0 && pass.render.is_cancel_due()) {
            break;
        }
        context.bounce = bounce;
        trace::closest(&context, wave, &mut traced);
        let mut survivors = 0;
        for block in 0..wave.blocks() {
            vertices::find(&context, wave, block);
            materials::evaluate(&context, wave, block);
            materials::sort_by_bsdf(&mut wave.vertices);
            vertices::build_frames(&context, wave);
            wave.draw(&context);
            scatter::sample(&context, None, wave, block);
            advance(&context, wave, block, light_vertices);
            survivors = wave.append(&context, block, survivors);
        }
        wave.finish_bounce(&context, survivors);
    }
    traced.add(&wave.counts);
    counts.indirect += traced.total();
}

/// Which light paths are traced.
pub(super) struct Source<'a> {
    pub emitters: &'a Emitters,
    pub range: &'a PhotonRange,
}

/// Starts a light path with each index.
fn start(context: &Context, source: &Source, wave: &mut Wave) {
    let (mut samples, mut states, mut fluxes) = (CameraBatch::default(), Vec::new(), Vec::new());
    let sampler = &context.config.sampler;
    let seed = source.range.seed;
    for index in source.range.indices.clone() {
        let [choice, u0, u1, _] = sampler.sample_4d(seed, index, dimensions::CAMERA);
        let [v0, v1, ..] = sampler.sample_4d(seed, index, dimensions::light(0));
        let Some((light, emitted)) = source.emitters.sample(context.scene, choice, [u0, u1], [v0, v1]) else {
            continue;
        };
        let EmittedRay { point, direction, radiance, pdf_per_cos } = emitted;
        let flux = radiance * (1.0 / pdf_per_cos);
        if flux.is_black() || !flux.is_finite() {
            continue;
        }
        samples.push(&CameraSample { ray: point.ray_along(direction), seed, sample: index });
        let is_delta = context.scene.lights.get(light).is_delta();
        states.push(LightPathState { light, start: point, pdf_per_cos, is_delta, d_vc: 0.0, unconnected_d_vc: 0.0 });
        fluxes.push(flux);
    }
    wave.start(context, &samples);
    wave.light_paths = states;
    for (i, &flux) in fluxes.iter().enumerate() {
        wave.paths[i / BATCH].throughput.set(i % BATCH, flux);
    }
}

/// Stores the vertices of a block, and turns what paths from the camera carry on into what light paths carry.
fn advance(context: &Context, wave: &mut Wave, block: usize, light_vertices: &mut Vec<LightVertex>) {
    let Wave { vertices, paths, light_paths, .. } = wave;
    for lane in 0..vertices.count.min(BATCH) {
        vertices.direct.status[lane] = spawn::NONE;
        if vertices.is_miss(lane) || vertices.rows.cos_geometric[lane] == 0.0 {
            vertices.scatter.status[lane] = spawn::NONE;
            continue;
        }
        let path = vertices.path(lane);
        let state = &mut light_paths[block * BATCH + path];
        let arrived = arrived(context, vertices, lane, &paths[block], state);
        if vertices.rows.flags[lane] & vertex_flags::DELTA == 0 {
            light_vertices.push(light_vertex(context, vertices, lane, arrived, state.light));
        }
        scatter_light(context, vertices, lane, arrived, state);
    }
}

/// What is stored of a vertex of a light path.
fn light_vertex(context: &Context, vertices: &Vertices, lane: usize, arrived: Arrived, light: LightId) -> LightVertex {
    let rows = &vertices.rows;
    let (flux, frame, wi) = (rows.throughput.get(lane), vertices.frame(lane), rows.wo.get(lane));
    let bsdf = vertices.bsdfs.get(context.scene, lane);
    LightVertex {
        point: SpawnPoint { p: vertices.points.p.get(lane), n: rows.n_g.get(lane), error: rows.error[lane] },
        n: frame.z,
        cos_geometric: rows.cos_geometric[lane],
        cos_shading: wi.z,
        cos_normals: rows.cos_normals[lane],
        flux: if bsdf.is_some() { flux } else { flux * vertices.albedo(lane) },
        scattering: bsdf.map(|bsdf| Box::new(Scattering { frame, wi, bsdf: bsdf.clone() })),
        light,
        segments: context.bounce + 1,
        mis: arrived.mis,
        unconnected: arrived.unconnected,
    }
}

/// The sums of other strategies where a light path arrives, and of those without connections.
#[derive(Clone, Copy)]
struct Arrived {
    mis: PartialMis,
    unconnected: PartialMis,
}

/// The sums of other strategies where a light path arrives.
fn arrived(context: &Context, vertices: &Vertices, lane: usize, paths: &PathRows, state: &LightPathState) -> Arrived {
    let Vertices { rows, .. } = vertices;
    let path = vertices.path(lane);
    let cos = squared(rows.cos_geometric[lane]);
    if context.bounce > 0 {
        let d_vcm =
            if paths.is_specular(path) { 0.0 } else { squared(rows.t[lane] * rows.t[lane] / paths.pdf[path]) / cos };
        let unconnected = PartialMis { d_vcm: 0.0, d_vc: state.unconnected_d_vc / cos };
        return Arrived { mis: PartialMis { d_vcm, d_vc: state.d_vc / cos }, unconnected };
    }
    // The first vertex samples the light, or meets it by chance.
    let sampled = light_pdf(context, vertices, lane, state);
    let start = squared(state.pdf_per_cos) * cos * CONNECTIONS_PER_VERTEX * CONNECTIONS_PER_VERTEX;
    let mis = PartialMis { d_vcm: squared(sampled) / start, d_vc: if state.is_delta { 0.0 } else { 1.0 / start } };
    Arrived { mis, unconnected: mis }
}

/// The density per solid angle with which a path from the camera samples the light from the vertex.
fn light_pdf(context: &Context, vertices: &Vertices, lane: usize, state: &LightPathState) -> f32 {
    if vertices.rows.flags[lane] & vertex_flags::UNSAMPLED != 0 {
        return 0.0;
    }
    let from = vertices.light_context(lane);
    let pmf = context.scene.lights.pmf(state.light, &from, context.compensation);
    let direction = vertices.rows.direction.get(lane);
    let light = match context.scene.lights.get(state.light) {
        Light::Area(light) => light,
        light if light.is_delta() => return pmf,
        light => return pmf * light.eval_infinite(-direction, context.compensation).pdf,
    };
    let at = SurfaceInteraction {
        p: state.start.p,
        t: vertices.rows.t[lane],
        error: state.start.error,
        n_g: state.start.n,
        n_s: state.start.n,
        dp_du: Vec3::ZERO,
        uv: Vec2::ZERO,
        shape: light.shape,
        prim: PrimId(0),
        instance: Hit::NO_INSTANCE,
        time: 0.0,
    };
    let ray = Ray::new(from.p.as_vec3(), -direction);
    light.pdf(&context.scene.geometry, &from, &ray, &at) * pmf
}

/// Scatters a light path: its flux, roulette by what scattering leaves of it, and the sums of other strategies.
fn scatter_light(
    context: &Context,
    vertices: &mut Vertices,
    lane: usize,
    arrived: Arrived,
    state: &mut LightPathState,
) {
    let (rows, scatter) = (&vertices.rows, &vertices.scatter);
    let cos_out = scatter.direction.get(lane).dot(rows.n_g.get(lane));
    let flux = rows.throughput.get(lane);
    let is_delta = scatter.is_delta[lane] != 0;
    let AdjointScattering { flux: next, reversed_pdf } = adjoint::scatter(context, vertices, lane);
    [state.d_vc, state.unconnected_d_vc] = [arrived.mis, arrived.unconnected].map(|mis| {
        if is_delta {
            mis.d_vc * squared(cos_out)
        } else {
            squared(cos_out / scatter.pdf[lane]) * mis.sum(reversed_pdf)
        }
    });
    let survival = (next.max_channel() / flux.max_channel()).min(1.0);
    // Paths from the camera do not find the light of delta lights behind delta lobes.
    let is_found = !(state.is_delta && is_delta && context.bounce == 0);
    let goes_on = scatter.status[lane] == spawn::SPAWNED
        && vertices.u_bsdf.of(lane)[3] < survival
        && next.is_finite()
        && is_found;
    let scatter = &mut vertices.scatter;
    scatter.status[lane] = if goes_on { spawn::SPAWNED } else { spawn::NONE };
    scatter.throughput.set(lane, if goes_on { next * (1.0 / survival) } else { Rgb::BLACK });
    let specular = if is_delta { path_flags::SPECULAR } else { 0 };
    scatter.path_flags[lane] = (scatter.path_flags[lane] & !path_flags::SPECULAR) | specular;
}
