//! Scattering: a direction for each vertex, Russian roulette, and the rays that go on.

use super::Context;
use super::block::{PointRows, ScatterRows, VertexRows, Vertices, spawn, vertex_flags};
use super::direct::{can_be_below, shadowing};
use super::guided::Regions;
use super::specular_direct;
use super::terminator;
use super::wave::{BsdfScratch, Wave, path_flags};
use crate::bsdf::Lambert;
use crate::geometry::SpawnPoint;
use crate::integrator::roulette::{Roulette, SurvivalRule};
use crate::integrator::vertex::HemisphereTest;
use crate::math::Frame;
use crate::math::rows::{BATCH, whole_vectors};
use crate::math::vectorize::vectorize;
use crate::sampling::SampleRows;

/// Samples a direction for each vertex of a block, and finds the rays along them.
pub(super) fn sample(context: &Context, regions: Option<&Regions>, wave: &mut Wave, block: usize) {
    let Wave { vertices, paths, guided, terminator_rays, bsdf_rows, .. } = wave;
    let count = vertices.count;
    if let Some(regions) = regions {
        guided.choose(regions, vertices);
    }
    let Vertices { rows, scatter, u_bsdf, .. } = &mut *vertices;
    vectorize!(sample_diffuse(rows, scatter, u_bsdf, count));
    sample_non_diffuse(context, vertices, bsdf_rows);
    if let Some(regions) = regions {
        guided.mix(context, regions, vertices, bsdf_rows);
    }
    let Vertices { rows, points, scatter, u_bsdf, .. } = &mut *vertices;
    let ends_paths = context.config.roulette != Roulette::ShadowRays;
    let continuations = context.pass.continuations.filter(|_| ends_paths);
    match continuations {
        Some(grid) => grid.find(&points.p, &rows.n, &rows.wo.0[2], &mut scatter.continuation, count),
        None => scatter.continuation = [1.0; BATCH],
    }
    let rule = SpawnRule {
        survival: context.config.roulette.rule(context.bounce, continuations.is_some()),
        no_lights: context.scene.lights.is_empty(),
        adds_reflections: specular_direct::is_enabled(context),
    };
    if context.scene.features.normal_perturbations {
        vectorize!(spawn_rays::<true>(rows, points, scatter, u_bsdf, rule, count));
    } else {
        vectorize!(spawn_rays::<false>(rows, points, scatter, u_bsdf, rule, count));
    }
    if context.scene.features.shading_normals {
        wave.counts.indirect += terminator::offset(
            context,
            vertices,
            terminator_rays,
            |vertices| &mut vertices.scatter.status,
            |vertices, lane, start| {
                let ray = start.spawn(vertices.scatter.direction.get(lane));
                vertices.scatter.origin.set(lane, ray.origin);
            },
        );
    }
    let guidance = &context.pass.guidance;
    if guidance.learner.is_some() || guidance.has_moments {
        guided.record(vertices, &paths[block], regions.is_some());
    }
    wave.continuations.record(&wave.vertices, &wave.paths[block]);
}

/// Samples the BSDFs that are not diffuse.
fn sample_non_diffuse(context: &Context, vertices: &mut Vertices, rows: &mut BsdfScratch) {
    let Vertices { rows: vertex, scatter, non_diffuse, bsdfs, splits, u_bsdf, .. } = vertices;
    for lanes in bsdfs.groups(non_diffuse) {
        let u = |lane: usize| {
            let [u_lobe, u, v, _] = u_bsdf.of(lane);
            [splits.lobe_choice(lane, u_lobe), u, v]
        };
        if !bsdfs.sample_group(context.scene, &vertex.wo, lanes, u, rows) {
            continue;
        }
        let samples = &rows.samples;
        for (i, &lane) in lanes.iter().enumerate() {
            let lane = usize::from(lane);
            scatter.wi.set(lane, samples.wi.get(i));
            scatter.weight.set(lane, samples.weight.get(i) * splits.remaining(lane));
            scatter.pdf[lane] = samples.pdf[i];
            scatter.rr_factor[lane] = samples.eta[i] * samples.eta[i];
            scatter.is_valid[lane] = samples.is_valid[i];
            scatter.is_delta[lane] = samples.is_delta[i];
            scatter.is_transmission[lane] = samples.is_transmission[i];
        }
    }
}

#[inline(always)]
fn sample_diffuse(rows: &VertexRows, scatter: &mut ScatterRows, u: &SampleRows, count: usize) {
    for i in 0..whole_vectors(count) {
        let lambert = Lambert { albedo: rows.albedo.get(i) };
        let [_, u, v, _] = u.of(i);
        let sample = lambert.direction(rows.wo.get(i), [u, v]);
        scatter.wi.set(i, sample.wi);
        scatter.weight.set(i, rows.albedo.get(i));
        scatter.pdf[i] = sample.pdf;
        scatter.rr_factor[i] = 1.0;
        scatter.is_valid[i] = u32::from(sample.is_valid);
        scatter.is_delta[i] = 0;
        scatter.is_transmission[i] = 0;
    }
}

/// Which of the sampled directions paths take.
#[derive(Clone, Copy)]
struct SpawnRule {
    survival: SurvivalRule,
    no_lights: bool,
    /// Whether the specular reflections of emitters have been added.
    adds_reflections: bool,
}

#[inline(always)]
fn spawn_rays<const PERTURBED: bool>(
    rows: &VertexRows,
    points: &PointRows,
    scatter: &mut ScatterRows,
    u: &SampleRows,
    rule: SpawnRule,
    count: usize,
) {
    for i in 0..whole_vectors(count) {
        let frame = Frame { x: rows.frame_x.get(i), y: rows.frame_y.get(i), z: rows.n.get(i) };
        let wi = scatter.wi.get(i);
        let direction = frame.to_world(wi);
        let cos = direction.dot(rows.n_g.get(i));
        let test = HemisphereTest::new([rows.wo.0[2][i], wi.z], [rows.cos_geometric[i], cos]);
        let factor = shadowing::<PERTURBED>(test, [cos, wi.z, rows.cos_normals[i]]);
        let factor = if scatter.is_delta[i] == 0 { factor } else { 1.0 };
        let weight = scatter.weight.get(i) * factor;
        scatter.weight.set(i, weight);

        let mut throughput = rows.throughput.get(i) * weight;
        let rr_scale = rows.rr_scale[i] * scatter.rr_factor[i];
        let value = throughput.max_channel() * rr_scale * scatter.continuation[i];
        let survival = rule.survival.probability(value, weight.max_channel() * scatter.rr_factor[i]);
        let goes_on = (scatter.is_valid[i] != 0) & ((survival >= 1.0) | (u.of(i)[3] < survival));
        throughput *= if survival < 1.0 { 1.0 / survival } else { 1.0 };
        let goes_on = goes_on & !throughput.is_black();
        scatter.throughput.set(i, throughput);
        scatter.rr_scale[i] = rr_scale;

        let start = SpawnPoint { p: points.p.get(i), n: rows.n_g.get(i), error: rows.error[i] };
        scatter.origin.set(i, start.ray_along(direction).origin);
        scatter.direction.set(i, direction);
        let is_delta = scatter.is_delta[i] != 0;
        let is_unsampled = is_delta | rule.no_lights | (rows.flags[i] & vertex_flags::ENCLOSED != 0);
        let specular = if is_unsampled { path_flags::SPECULAR } else { 0 };
        let non_specular =
            if is_delta { rows.path_flags[i] & path_flags::ANY_NON_SPECULAR } else { path_flags::ANY_NON_SPECULAR };
        let is_added = is_delta & rule.adds_reflections & (rows.flags[i] & vertex_flags::MIXED_SPECULAR != 0);
        let added = if is_added { path_flags::EMISSION_ADDED } else { 0 };
        scatter.path_flags[i] = specular | non_specular | added;
        scatter.status[i] = spawn::status(goes_on & test.agrees(), goes_on & can_be_below(rows, test, i));
    }
}
