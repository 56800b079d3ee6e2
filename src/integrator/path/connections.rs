//! Connections of a block's vertices to vertices of light paths, and the weights of other strategies beside them.

use super::Context;
use super::block::{VertexRows, Vertices, spawn, vertex_flags};
use super::direct::{self, shadowing};
use super::evals::Surfaces;
use super::wave::{PathRows, Wave};
use crate::color::Rgb;
use crate::geometry::SpawnPoint;
use crate::id::LightId;
use crate::integrator::bidirectional::{CONNECTIONS_PER_VERTEX, LightPaths, LightVertex, PartialMis, bounded, squared};
use crate::integrator::dimensions;
use crate::integrator::vertex::HemisphereTest;
use crate::light::light_target;
use crate::math::Vec3;
use crate::math::rows::BATCH;

/// What a path from the camera remembers of other strategies.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ConnectionState {
    /// As of the last vertex.
    d_vc: f64,
    /// Whether the last vertex can be connected to this one.
    is_connectable: bool,
}

impl ConnectionState {
    /// The sums of other strategies where the path arrives.
    fn arrived(self, rows: &VertexRows, lane: usize, paths: &PathRows, path: usize) -> PartialMis {
        let cos = squared(rows.cos_geometric[lane]);
        let d_vcm =
            if self.is_connectable { squared(rows.t[lane] * rows.t[lane] / paths.pdf[path]) / cos } else { 0.0 };
        PartialMis { d_vcm, d_vc: self.d_vc / cos }
    }

    /// What connections add to the sum of the squared densities over that of meeting the light of a surface by chance.
    #[inline]
    pub fn of_emission(&self, context: &Context, id: LightId, n: Vec3) -> f64 {
        let Some(LightPaths { emitters, .. }) = context.pass.light_paths else { return 0.0 };
        if self.d_vc == 0.0 {
            return 0.0;
        }
        let pdf = squared(emitters.pdf_per_cos(context.scene, id, n));
        bounded(pdf * CONNECTIONS_PER_VERTEX * CONNECTIONS_PER_VERTEX * self.d_vc)
    }
}

/// The state of the path that goes on from a vertex.
pub(super) fn after(
    context: &Context,
    vertices: &Vertices,
    lane: usize,
    paths: &PathRows,
    state: ConnectionState,
) -> ConnectionState {
    let Vertices { rows, scatter, .. } = vertices;
    let cos = scatter.direction.get(lane).dot(rows.n_g.get(lane));
    let mis = state.arrived(rows, lane, paths, vertices.path(lane));
    if scatter.is_delta[lane] != 0 {
        return ConnectionState { d_vc: mis.d_vc * squared(cos), is_connectable: false };
    }
    let wi = scatter.wi.get(lane);
    let test = HemisphereTest::new([rows.wo.0[2][lane], wi.z], [rows.cos_geometric[lane], cos]);
    if !test.agrees() {
        // Light paths do not take this way.
        return ConnectionState::default();
    }
    let back = vertices.reversed_eval(context.scene, lane, wi).pdf;
    let d_vc = squared(cos / scatter.pdf[lane]) * (mis.d_vc * squared(back) + mis.d_vcm);
    let d_vc = if d_vc.is_finite() { d_vc } else { 0.0 };
    ConnectionState { d_vc, is_connectable: true }
}

/// Connects each vertex of a block to one of a light path, and queues the shadow rays between them.
pub(super) fn sample(context: &Context, wave: &mut Wave, block: usize) {
    let Some(light_paths) = context.pass.light_paths else { return };
    if context.bounce + 3 > context.config.max_depth || light_paths.vertices.is_empty() {
        return;
    }
    draw(context, wave);
    let Wave { vertices, paths, connections, bsdf_rows, .. } = wave;
    let count = vertices.count.min(BATCH);
    let all = light_paths.vertices;
    let chosen = choose(context, vertices, all);
    let Vertices { rows, light_samples, light_evals, bsdfs, non_diffuse, .. } = &mut *vertices;
    let surfaces = Surfaces { scene: context.scene, count, rows, bsdfs, non_diffuse };
    surfaces.eval(&light_samples.direction, |lane| chosen[lane].is_some(), bsdf_rows, light_evals);
    let per_path = all.len() as f32 / light_paths.traced as f32;
    for (lane, &vertex) in chosen.iter().enumerate().take(count) {
        let path = vertices.path(lane);
        let light = vertex.and_then(|vertex| {
            let mis = connections[block * BATCH + path].arrived(&vertices.rows, lane, &paths[block], path);
            Connection { context, vertices, lane, mis, vertex }.contribution()
        });
        let (Some(vertex), Some(light)) = (vertex, light) else {
            vertices.direct.status[lane] = spawn::NONE;
            continue;
        };
        let light = context.config.clamped(light * per_path, context.bounce + 1 + vertex.segments);
        let (p, n) = (vertices.points.p.get(lane), vertices.rows.n_g.get(lane));
        let ray = SpawnPoint { p, n, error: vertices.rows.error[lane] }.ray_to(&vertex.point);
        let direct = &mut vertices.direct;
        direct.status[lane] = spawn::SPAWNED;
        direct.contribution.set(lane, light);
        direct.shadow_origin.set(lane, ray.origin);
        direct.shadow_direction.set(lane, ray.direction);
        direct.shadow_end[lane] = ray.t_max;
        vertices.light_samples.light[lane] = vertex.light.0;
    }
    if let Some(grid) = context.pass.continuations {
        direct::roulette(grid, vertices);
    }
    // Once or more: the classes of light are the same.
    wave.queue_shadow_rays(context, block, 1);
}

/// A vertex of a light path for each vertex, if they can be connected, and the directions to them.
fn choose<'a>(context: &Context, vertices: &mut Vertices, all: &'a [LightVertex]) -> [Option<&'a LightVertex>; BATCH] {
    let mut chosen = [None; BATCH];
    for (lane, chosen) in chosen.iter_mut().enumerate().take(vertices.count) {
        let [u, digits, ..] = vertices.u_light.of(lane);
        // Random numbers are multiples of 2^-24.
        let u = f64::from(u) + f64::from(digits) * (1.0 / 16_777_216.0);
        let vertex = &all[((u * all.len() as f64) as usize).min(all.len() - 1)];
        let is_short = context.bounce + 2 + vertex.segments <= context.config.max_depth;
        let toward = (vertex.point.p - vertices.points.p.get(lane)).as_vec3();
        let is_apart = toward.length_squared() > 0.0;
        let is_wanted = is_short && is_apart && vertices.rows.flags[lane] & vertex_flags::UNSAMPLED == 0;
        vertices.light_samples.direction.set(lane, if is_wanted { toward.normalize() } else { Vec3::Z });
        *chosen = is_wanted.then_some(vertex);
    }
    chosen
}

/// Draws the numbers that choose light vertices.
fn draw(context: &Context, wave: &mut Wave) {
    let Vertices { requests, count, u_light, .. } = &mut wave.vertices;
    context.config.sampler.sample_4d_batch(requests, *count, dimensions::connection(context.bounce), u_light);
}

/// A vertex of a camera path, and one of a light path.
struct Connection<'a> {
    context: &'a Context<'a>,
    vertices: &'a Vertices,
    lane: usize,
    /// Of the camera path.
    mis: PartialMis,
    vertex: &'a LightVertex,
}

impl Connection<'_> {
    /// The light of the light path that reaches the camera if nothing is between the vertices, weighted by MIS, times
    /// the number of light paths over that of vertices; `None` without any.
    fn contribution(&self) -> Option<Rgb> {
        let Self { context, vertices, lane, mis, vertex } = *self;
        let Vertices { rows, light_samples, light_evals, .. } = vertices;
        let (direction, wi) = (light_samples.direction.get(lane), light_evals.wi.get(lane));
        let cos = direction.dot(rows.n_g.get(lane));
        let test = HemisphereTest::new([rows.wo.0[2][lane], wi.z], [rows.cos_geometric[lane], cos]);
        let out = vertex.frame.to_local(-direction);
        let cos_light = -direction.dot(vertex.point.n);
        let light_test = HemisphereTest::new([vertex.wi.z, out.z], [vertex.cos_geometric, cos_light]);
        let value = light_evals.value.get(lane);
        if !test.agrees() || !light_test.agrees() || value.is_black() {
            return None;
        }
        let toward_light = vertex.bsdf.eval(out, vertex.wi);
        let factor = shadowing::<true>(test, [cos, wi.z, rows.cos_normals[lane]])
            * shadowing::<true>(light_test, [vertex.cos_geometric, vertex.wi.z, vertex.cos_normals]);
        let distance_squared = (vertex.point.p - vertices.points.p.get(lane)).length_squared() as f32;
        let geometry = factor * cos_light.abs() / (distance_squared * vertex.cos_geometric.abs());
        let light = rows.throughput.get(lane) * value * toward_light.value * vertex.flux * geometry;
        if light.is_black() || !light.is_finite() {
            return None;
        }
        let toward_vertex = vertex.bsdf.eval(vertex.wi, out).pdf;
        let back = vertices.reversed_eval(context.scene, lane, wi).pdf;
        let by_camera = squared(light_evals.pdf[lane] * cos_light / distance_squared)
            * (vertex.mis.d_vcm + vertex.mis.d_vc * squared(toward_light.pdf));
        let by_light = squared(toward_vertex * cos / distance_squared) * (mis.d_vcm + mis.d_vc * squared(back));
        Some(light * (1.0 / (1.0 + bounded(by_camera + by_light))) as f32)
    }
}

/// Weighs light samples against connections too.
pub(super) fn reweigh_light_samples(context: &Context, wave: &mut Wave, block: usize) {
    let Some(LightPaths { emitters, .. }) = context.pass.light_paths else { return };
    let samples = f64::from(context.light_samples());
    let Wave { vertices, paths, connections, .. } = wave;
    for lane in 0..vertices.count.min(BATCH) {
        let Vertices { rows, light_samples: lights, light_evals: evals, direct, .. } = &*vertices;
        if direct.status[lane] != spawn::SPAWNED || lights.target[lane] != light_target::POINT {
            continue;
        }
        let path = vertices.path(lane);
        let mis = connections[block * BATCH + path].arrived(rows, lane, &paths[block], path);
        if lights.is_delta[lane] != 0 || (mis.d_vcm == 0.0 && mis.d_vc == 0.0) {
            continue;
        }
        let wi = evals.wi.get(lane);
        let cos = lights.direction.get(lane).dot(rows.n_g.get(lane));
        let start = emitters.pdf_per_cos(context.scene, LightId(lights.light[lane]), lights.target_n.get(lane));
        let back = vertices.reversed_eval(context.scene, lane, wi).pdf;
        let pdf = f64::from(lights.pdf[lane]) * samples;
        let connections = squared(start * cos) * CONNECTIONS_PER_VERTEX * CONNECTIONS_PER_VERTEX / (pdf * pdf)
            * (mis.d_vcm + mis.d_vc * squared(back));
        let others = 1.0 + squared(evals.pdf[lane]) / (pdf * pdf);
        let factor = (1.0 / (1.0 + bounded(connections / others))) as f32;
        let contribution = direct.contribution.get(lane) * factor;
        vertices.direct.contribution.set(lane, contribution);
    }
}
