//! Connections of a block's vertices to vertices of light paths.

use std::f32::consts::FRAC_1_PI;

use super::Context;
use super::block::{DirectRows, EvalRows, PointRows, VertexRows, Vertices, spawn, vertex_flags};
use super::connection_mis::{ConnectionMis, DensityRows, MisRows};
use super::direct::{self, shadowing};
use super::evals::Surfaces;
use super::wave::Wave;
use crate::color::Rgb;
use crate::geometry::SpawnPoint;
use crate::integrator::bidirectional::{
    ChosenVertex, ConnectionTables, LightPaths, PartialMis, Scattering, bounded, squared,
};
use crate::integrator::dimensions;
use crate::integrator::vertex::HemisphereTest;
use crate::light::LightSampleRows;
use crate::math::Vec3;
use crate::math::prefetch::prefetch;
use crate::math::rows::{BATCH, soa, whole_vectors};
use crate::math::vectorize::vectorize;

soa! {
    /// Vertices of light paths, one for each vertex of a block.
    pub(super) struct LightVertexRows {
        /// Whether the vertices can be connected.
        is_chosen: u32,
        /// With which probability there is a connection at all; 0 if there is none.
        probability: f32,
        /// One over that times the probability of the choice.
        inverse_probability: f32,
        /// The next seven as in [`LightVertex`](crate::integrator::LightVertex).
        n: Vec3,
        error: f32,
        n_s: Vec3,
        cos_geometric: f32,
        cos_shading: f32,
        cos_normals: f32,
        flux: Rgb,
        light: u32,
        segments: u32,
        /// Cosine of the direction to the block's vertex with the shading normal.
        cos_out: f32,
        distance_squared: f32,
        /// The BSDF, for light towards the block's vertex.
        value: Rgb,
        /// The densities with which scattering chooses the direction to the light, and that to the block's vertex.
        pdf_to_light: f32,
        pdf_to_vertex: f32,
    }
}

/// Connects each vertex of a block to one of a light path, and queues the shadow rays between them.
pub(super) fn sample(context: &Context, wave: &mut Wave, block: usize) {
    let Some(light_paths) = context.pass.light_paths else { return };
    if context.bounce + 3 > context.config.max_depth || light_paths.vertices.is_empty() {
        return;
    }
    draw(context, wave);
    let scatterings = choose(context, wave, light_paths);
    let Wave { vertices, connection_ends: ends, connection_mis, bsdf_rows, .. } = wave;
    let Vertices { count, rows, points, light_samples, light_evals, direct, bsdfs, non_diffuse, .. } = vertices;
    vectorize!(find_directions(points, light_samples, ends, *count));
    for (lane, scattering) in scatterings.iter().enumerate().take(*count) {
        if let Some(scattering) = scattering {
            scatter_light(scattering, -light_samples.direction.get(lane), ends, lane);
        }
    }
    let surfaces = Surfaces { scene: context.scene, count: *count, rows, bsdfs, non_diffuse };
    let is_wanted = |lane: usize| ends.is_chosen[lane] != 0;
    surfaces.eval(&light_samples.direction, is_wanted, bsdf_rows, light_evals);
    let ConnectionMis { mis, densities } = connection_mis;
    surfaces.reversed_pdfs(&light_evals.wi, is_wanted, bsdf_rows, &mut densities.reversed);
    let per_path = 1.0 / light_paths.traced as f32;
    let pairs = Pairs { rows, points, lights: light_samples, evals: light_evals, ends, mis, per_path };
    if context.scene.features.normal_perturbations {
        vectorize!(connect::<true>(&pairs, densities, direct, *count));
    } else {
        vectorize!(connect::<false>(&pairs, densities, direct, *count));
    }
    if light_paths.has_moments {
        vectorize!(find_moments(&pairs, densities, direct, *count));
    }
    light_samples.light = ends.light;
    if context.config.clamp.is_finite() {
        for lane in 0..(*count).min(BATCH) {
            let scatterings = context.bounce + 1 + ends.segments[lane];
            let contribution = context.config.clamped(direct.contribution.get(lane), scatterings);
            direct.contribution.set(lane, contribution);
        }
    }
    if let Some(grid) = context.pass.continuations {
        direct::roulette(grid, vertices);
    }
    if light_paths.has_moments {
        vectorize!(divide_moments(densities, &vertices.direct, vertices.count));
    }
    // Once or more: the classes of light are the same.
    wave.queue_shadow_rays(context, block, 1);
}

/// Connections are made with this many times the probability of their shadow rays, as far as that is expected: what
/// they add varies.
const EXPECTED_SCALE: f32 = 2.0;

/// The least probability of a connection: the pilot may have missed all light that arrives in a cell.
const LEAST_CONNECTED: f32 = 1.0 / 16.0;

/// Draws the numbers that choose light vertices.
fn draw(context: &Context, wave: &mut Wave) {
    let Vertices { requests, count, u_light, .. } = &mut wave.vertices;
    context.config.sampler.sample_4d_batch(requests, *count, dimensions::connection(context.bounce), u_light);
}

/// Chooses a vertex of a light path for each vertex, if they can be connected; the result is how those that are not
/// diffuse scatter light.
fn choose<'a>(context: &Context, wave: &mut Wave, light_paths: &LightPaths<'a>) -> [Option<&'a Scattering>; BATCH] {
    let LightPaths { vertices: all, tables, clustered, .. } = *light_paths;
    let Wave { vertices, connection_ends: ends, connection_mis: ConnectionMis { mis, .. }, .. } = wave;
    let mut indices = [0; BATCH];
    let mut table_indices = [0; BATCH];
    for (lane, table) in table_indices.iter_mut().enumerate().take(vertices.count) {
        *table = tables.table(vertices.points.p.get(lane).as_vec3(), vertices.facing_normal(lane));
    }
    choose_connected(context, vertices, tables, &table_indices, ends);
    for (lane, index) in indices.iter_mut().enumerate().take(vertices.count) {
        if ends.probability[lane] == 0.0 {
            ends.inverse_probability[lane] = 0.0;
            continue;
        }
        let [u, digits, ..] = vertices.u_light.of(lane);
        // Random numbers are multiples of 2^-24.
        let u = f64::from(u) + f64::from(digits) * (1.0 / 16_777_216.0);
        let choice = tables.choose(table_indices[lane], clustered, u);
        // In an empty cluster there is nothing to connect to.
        let ChosenVertex { index: chosen, inverse_probability } =
            choice.unwrap_or(ChosenVertex { index: 0, inverse_probability: 0.0 });
        (*index, ends.inverse_probability[lane]) = (chosen, inverse_probability / ends.probability[lane]);
        prefetch(all, *index);
    }
    let mut scatterings = [None; BATCH];
    for (lane, scattering) in scatterings.iter_mut().enumerate().take(vertices.count) {
        if ends.inverse_probability[lane] == 0.0 {
            ends.is_chosen[lane] = 0;
            continue;
        }
        let vertex = &all[indices[lane]];
        let is_short = context.bounce + 2 + vertex.segments <= context.config.max_depth;
        let is_chosen = is_short && vertices.rows.flags[lane] & vertex_flags::UNSAMPLED == 0;
        ends.is_chosen[lane] = u32::from(is_chosen);
        *scattering = vertex.scattering.as_deref().filter(|_| is_chosen);
        if let Some(scattering) = scattering {
            prefetch(std::slice::from_ref(*scattering), 0);
        }
        vertices.points.target_p.set(lane, vertex.point.p);
        ends.n.set(lane, vertex.point.n);
        ends.error[lane] = vertex.point.error;
        ends.n_s.set(lane, vertex.n);
        (ends.cos_geometric[lane], ends.cos_shading[lane]) = (vertex.cos_geometric, vertex.cos_shading);
        ends.cos_normals[lane] = vertex.cos_normals;
        ends.flux.set(lane, vertex.flux);
        (ends.light[lane], ends.segments[lane]) = (vertex.light.0, vertex.segments);
        (mis.light_d_vcm[lane], mis.light_d_vc[lane]) = (vertex.mis.d_vcm, vertex.mis.d_vc);
        (mis.unconnected_d_vcm[lane], mis.unconnected_d_vc[lane]) = (vertex.unconnected.d_vcm, vertex.unconnected.d_vc);
    }
    scatterings
}

/// Russian roulette of connections, before anything is found out of the vertices of light paths.
fn choose_connected(
    context: &Context,
    vertices: &Vertices,
    tables: &ConnectionTables,
    table_indices: &[usize; BATCH],
    ends: &mut LightVertexRows,
) {
    for (lane, &table) in table_indices.iter().enumerate().take(vertices.count) {
        let probability = context.pass.continuations.map_or(1.0, |grid| {
            let expected = vertices.rows.throughput.get(lane).max_channel() * tables.radiance(table);
            let probability = grid.shadow_ray_probability(EXPECTED_SCALE * expected, vertices.rows.rr_scale[lane]);
            probability.max(LEAST_CONNECTED)
        });
        let [.., u] = vertices.u_light.of(lane);
        ends.probability[lane] = if u < probability { probability } else { 0.0 };
        if u < probability {
            tables.prefetch(table);
        }
    }
}

/// Finds the directions to the chosen vertices, and how these scatter light if they are diffuse.
#[inline(always)]
fn find_directions(points: &PointRows, lights: &mut LightSampleRows, ends: &mut LightVertexRows, count: usize) {
    for i in 0..whole_vectors(count) {
        let toward = (points.target_p.get(i) - points.p.get(i)).as_vec3();
        let distance_squared = toward.length_squared();
        let is_apart = distance_squared > 0.0;
        ends.is_chosen[i] &= u32::from(is_apart);
        let direction = if is_apart { toward * (1.0 / distance_squared.sqrt()) } else { Vec3::Z };
        lights.direction.set(i, direction);
        ends.distance_squared[i] = distance_squared;
        let cos_out = -direction.dot(ends.n_s.get(i));
        ends.cos_out[i] = cos_out;
        let is_same_side = cos_out * ends.cos_shading[i] > 0.0;
        let cos = if is_same_side { ends.cos_shading[i].abs() } else { 0.0 };
        ends.pdf_to_light[i] = FRAC_1_PI * cos;
        ends.pdf_to_vertex[i] = if is_same_side { FRAC_1_PI * cos_out.abs() } else { 0.0 };
        ends.value.set(i, Rgb::splat(FRAC_1_PI * cos));
    }
}

/// Finds how a vertex that is not diffuse scatters light in a direction.
fn scatter_light(scattering: &Scattering, direction: Vec3, ends: &mut LightVertexRows, lane: usize) {
    let Scattering { frame, wi, bsdf } = scattering;
    let out = frame.to_local(direction);
    let toward_light = bsdf.eval(out, *wi);
    ends.value.set(lane, toward_light.value);
    ends.pdf_to_light[lane] = toward_light.pdf;
    ends.pdf_to_vertex[lane] = bsdf.eval(*wi, out).pdf;
}

/// Vertices of a block, and the vertices of light paths that they are connected to.
struct Pairs<'a> {
    rows: &'a VertexRows,
    points: &'a PointRows,
    lights: &'a LightSampleRows,
    evals: &'a EvalRows,
    ends: &'a LightVertexRows,
    mis: &'a MisRows,
    /// One over the number of light paths.
    per_path: f32,
}

/// Finds the light that reaches the camera if nothing is between the vertices, weighted by MIS, and the rays between
/// them.
#[inline(always)]
fn connect<const PERTURBED: bool>(pairs: &Pairs, densities: &mut DensityRows, direct: &mut DirectRows, count: usize) {
    let Pairs { rows, points, lights, evals, ends, mis, per_path } = *pairs;
    for i in 0..whole_vectors(count) {
        let direction = lights.direction.get(i);
        let cos_local = evals.wi.0[2][i];
        let cos = direction.dot(rows.n_g.get(i));
        let test = HemisphereTest::new([rows.wo.0[2][i], cos_local], [rows.cos_geometric[i], cos]);
        let cos_light = -direction.dot(ends.n.get(i));
        let light_test =
            HemisphereTest::new([ends.cos_shading[i], ends.cos_out[i]], [ends.cos_geometric[i], cos_light]);
        let factor = shadowing::<PERTURBED>(test, [cos, cos_local, rows.cos_normals[i]])
            * shadowing::<PERTURBED>(light_test, [ends.cos_geometric[i], ends.cos_shading[i], ends.cos_normals[i]]);
        let distance_squared = ends.distance_squared[i];
        let geometry = factor * cos_light.abs() / (distance_squared * ends.cos_geometric[i].abs());
        let light = rows.throughput.get(i) * evals.value.get(i) * ends.value.get(i) * ends.flux.get(i) * geometry;

        let of_light = PartialMis { d_vcm: mis.light_d_vcm[i], d_vc: mis.light_d_vc[i] };
        let of_camera = PartialMis { d_vcm: mis.d_vcm[i], d_vc: mis.d_vc[i] };
        let by_camera = squared(evals.pdf[i] * cos_light / distance_squared) * of_light.sum(ends.pdf_to_light[i]);
        let by_light = squared(ends.pdf_to_vertex[i] * cos / distance_squared) * of_camera.sum(densities.reversed[i]);
        let weight = (1.0 / (1.0 + bounded(by_camera + by_light))) as f32;
        densities.weight[i] = weight;
        let contribution = light * (weight * per_path * ends.inverse_probability[i]);
        direct.contribution.set(i, contribution);
        let is_lit = (ends.is_chosen[i] != 0) & !contribution.is_black() & contribution.is_finite();
        direct.status[i] = spawn::status(is_lit & test.agrees() & light_test.agrees(), false);

        let start = SpawnPoint { p: points.p.get(i), n: rows.n_g.get(i), error: rows.error[i] };
        let end = SpawnPoint { p: points.target_p.get(i), n: ends.n.get(i), error: ends.error[i] };
        let ray = start.ray_to(&end);
        direct.shadow_origin.set(i, ray.origin);
        direct.shadow_direction.set(i, ray.direction);
        direct.shadow_end[i] = ray.t_max;
    }
}

/// Finds how the squares of what connections add would grow without connections, over the squares of these: a path that
/// light and BSDF sampling find with a density `r` times less adds `r` times more, where it is found.
#[inline(always)]
fn find_moments(pairs: &Pairs, densities: &mut DensityRows, direct: &DirectRows, count: usize) {
    let Pairs { evals, ends, mis, lights, .. } = *pairs;
    for i in 0..whole_vectors(count) {
        let cos_light = lights.direction.get(i).dot(ends.n.get(i));
        let unconnected = PartialMis { d_vcm: mis.unconnected_d_vcm[i], d_vc: mis.unconnected_d_vc[i] };
        let density =
            squared(evals.pdf[i] * cos_light / ends.distance_squared[i]) * unconnected.sum(ends.pdf_to_light[i]);
        let ratio = (1.0 / (density.sqrt() * f64::from(densities.weight[i]))) as f32;
        // Times the light before roulette, which is divided by that after it.
        densities.moment_ratio[i] = if ratio < f32::INFINITY { ratio } else { 1.0 }
            * direct.contribution.get(i).max_channel()
            * ends.probability[i];
    }
}

/// Takes what roulette has multiplied squares by out of their ratios.
#[inline(always)]
fn divide_moments(densities: &mut DensityRows, direct: &DirectRows, count: usize) {
    for i in 0..whole_vectors(count) {
        densities.moment_ratio[i] /= direct.contribution.get(i).max_channel();
    }
}
