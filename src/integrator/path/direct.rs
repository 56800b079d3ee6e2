//! Direct light: a light and a point of it for each vertex, weighted by MIS, and the shadow rays.

use super::Context;
use super::block::{DirectRows, EvalRows, PointRows, VertexRows, Vertices, spawn, vertex_flags};
use super::evals::Surfaces;
use super::guided::Regions;
use super::terminator::{self, TerminatorRays};
use super::wave::Wave;
use crate::geometry::SpawnPoint;
use crate::integrator::shading::terminator_factor;
use crate::integrator::vertex::HemisphereTest;
use crate::integrator::{ContinuationGrid, Strategy};
use crate::light::{LightContext, LightQueries, LightQueue, LightSampleRows, light_target};
use crate::math::Vec3;
use crate::math::rows::{BATCH, whole_vectors};
use crate::math::vectorize::vectorize;
use crate::sampling::{SampleRows, power_heuristic};

/// Samples light for the vertices of a block, and finds the shadow rays.
pub(super) fn sample(context: &Context, regions: Option<&Regions>, wave: &mut Wave, block: usize) {
    let count = wave.vertices.count;
    if context.scene.lights.is_empty() {
        wave.vertices.direct.status[..count].fill(spawn::NONE);
        return;
    }
    let samples = context.light_samples();
    for k in 0..samples {
        wave.draw_light(context, k, samples);
        sample_once(context, regions, wave, block);
        if samples > 1 {
            vectorize!(scale(&mut wave.vertices.direct, 1.0 / samples as f32));
        }
        if k + 1 < samples {
            let first = wave.shadows.count;
            wave.queue_shadow_rays(context, block, 0);
            wave.continuations.mark_first_lights(first..wave.shadows.count);
        }
    }
}

#[inline(always)]
fn scale(direct: &mut DirectRows, factor: f32) {
    for row in &mut direct.contribution.0 {
        row.iter_mut().for_each(|value| *value *= factor);
    }
}

/// Samples a light for each vertex of a block.
fn sample_once(context: &Context, regions: Option<&Regions>, wave: &mut Wave, block: usize) {
    let Wave { vertices, light_queue, bsdf_rows, guided, .. } = wave;
    let count = vertices.count;
    choose_lights(context, vertices, light_queue);
    let Vertices { rows, light_samples: lights, light_evals, bsdfs, non_diffuse, .. } = &mut *vertices;
    let surfaces = Surfaces { scene: context.scene, count, rows, bsdfs, non_diffuse };
    let is_wanted = |lane: usize| lights.target[lane] != light_target::NONE;
    surfaces.eval(&lights.direction, is_wanted, bsdf_rows, light_evals);
    if let Some(regions) = regions {
        guided.mix_light_pdfs(regions, vertices);
    }
    let mis = context.config.strategy == Strategy::Mis;
    let weighting = Weighting { mis, light_samples: context.light_samples() as f32, darkens_bumps: true };
    weigh(context, vertices, weighting);
    if context.pass.light_paths.is_some() {
        if let Some(grid) = context.pass.continuations {
            drop_untraced(grid, &mut wave.vertices);
        }
        super::connection_mis::reweigh_light_samples(context, wave);
    }
    super::caustics::reweigh_light_samples(context, wave, block);
    finish_shadow_rays(context, wave, block);
}

/// Weighs light samples for which the BSDFs have been evaluated, and finds the shadow rays.
pub(super) fn weigh(context: &Context, vertices: &mut Vertices, weighting: Weighting) {
    let Vertices { count, rows, points, light_samples: lights, light_evals: evals, direct, .. } = vertices;
    let count = *count;
    if weighting.darkens_bumps && context.scene.features.normal_perturbations {
        vectorize!(illuminate::<true>(rows, points, lights, evals, direct, weighting, count));
    } else {
        vectorize!(illuminate::<false>(rows, points, lights, evals, direct, weighting, count));
    }
}

/// Russian roulette of a block's shadow rays, and what else may keep light from arriving.
pub(super) fn finish_shadow_rays(context: &Context, wave: &mut Wave, block: usize) {
    if let Some(grid) = context.pass.continuations {
        roulette(grid, &mut wave.vertices);
    }
    let Wave { vertices, media, terminator_rays, .. } = wave;
    wave.continuations.count_shadow_rays(vertices);
    if context.scene.features.shading_normals {
        wave.counts.shadow += offset_below_facets(context, vertices, terminator_rays);
    }
    if context.scene.features.participating_media {
        wave.counts.shadow += super::media::trace_shadow_rays(context, vertices, media, block);
    } else if context.scene.features.media {
        super::media::absorb_direct(context, vertices, media, block);
    }
}

/// Russian roulette of a block's shadow rays.
pub(super) fn roulette(grid: &ContinuationGrid, vertices: &mut Vertices) {
    let Vertices { rows, direct, u_bsdf, count, .. } = vertices;
    vectorize!(play_roulette(grid, rows, direct, u_bsdf, *count));
}

/// Samples a light for each vertex that is not all mirror.
fn choose_lights(context: &Context, vertices: &mut Vertices, queue: &mut LightQueue) {
    let (scene, lights) = (context.scene, &context.scene.lights);
    let light_context = LightContext {
        geometry: &scene.geometry,
        textures: &scene.textures,
        lights,
        compensation: context.compensation,
    };
    let Vertices { count, rows, points, u_light, light_samples, .. } = vertices;
    let queries = LightQueries { count: *count, points: &points.p, normals: &rows.light_context_n, u: u_light };
    let is_wanted = |lane: usize| rows.flags[lane] & vertex_flags::UNSAMPLED == 0;
    queue.choose(&light_context, &queries, is_wanted, light_samples);
    queue.sample(&light_context, &queries, light_samples, &mut points.target_p);
    if context.config.strategy == Strategy::Bsdf {
        for lane in (0..BATCH).filter(|&lane| light_samples.is_delta[lane] == 0) {
            light_samples.target[lane] = light_target::NONE;
        }
    }
}

/// How light samples are weighted.
#[derive(Clone, Copy)]
pub(super) struct Weighting {
    /// Against the density of the BSDF.
    pub mis: bool,
    /// How many each vertex has.
    pub light_samples: f32,
    /// Whether light grazing a normal or bump map is darkened.
    pub darkens_bumps: bool,
}

#[inline(always)]
fn illuminate<const PERTURBED: bool>(
    rows: &VertexRows,
    points: &PointRows,
    lights: &LightSampleRows,
    evals: &EvalRows,
    direct: &mut DirectRows,
    weighting: Weighting,
    count: usize,
) {
    for i in 0..whole_vectors(count) {
        let direction = lights.direction.get(i);
        let cos = direction.dot(rows.n_g.get(i));
        let cos_local = evals.wi.0[2][i];
        let test = HemisphereTest::new([rows.wo.0[2][i], cos_local], [rows.cos_geometric[i], cos]);
        let factor = shadowing::<PERTURBED>(test, [cos, cos_local, rows.cos_normals[i]]);
        let pdf = lights.pdf[i];
        let is_weighted = weighting.mis & (lights.is_delta[i] == 0);
        let weight = if is_weighted { power_heuristic(weighting.light_samples * pdf, evals.pdf[i]) } else { 1.0 };
        let value = evals.value.get(i) * factor;
        let contribution = rows.throughput.get(i) * value * lights.radiance.get(i) * (weight / pdf);
        direct.contribution.set(i, contribution);
        let is_lit = (lights.target[i] != light_target::NONE) & !contribution.is_black();
        direct.status[i] = spawn::status(is_lit & test.agrees(), is_lit & can_be_below(rows, test, i));

        let start = SpawnPoint { p: points.p.get(i), n: rows.n_g.get(i), error: rows.error[i] };
        let end = SpawnPoint { p: points.target_p.get(i), n: lights.target_n.get(i), error: lights.target_error[i] };
        let (near, far) = (start.ray_to(&end), start.ray_along(direction));
        let is_near = lights.target[i] == light_target::POINT;
        let choose = |a: f32, b: f32| if is_near { a } else { b };
        let choose_vector = |a: Vec3, b: Vec3| Vec3::new(choose(a.x, b.x), choose(a.y, b.y), choose(a.z, b.z));
        direct.shadow_origin.set(i, choose_vector(near.origin, far.origin));
        direct.shadow_direction.set(i, choose_vector(near.direction, far.direction));
        direct.shadow_end[i] = choose(near.t_max, far.t_max);
    }
}

/// Drops the shadow rays that [`play_roulette`] will drop whatever their weight against connections.
fn drop_untraced(grid: &ContinuationGrid, vertices: &mut Vertices) {
    let Vertices { rows, direct, u_bsdf, count, .. } = vertices;
    for i in 0..(*count).min(BATCH) {
        let largest = direct.contribution.get(i).max_channel();
        if 1.0 - u_bsdf.of(i)[3] > grid.shadow_ray_probability(largest, rows.rr_scale[i]) {
            direct.status[i] = spawn::NONE;
        }
    }
}

/// Russian roulette of shadow rays, by what they carry.
#[inline(always)]
fn play_roulette(
    grid: &ContinuationGrid,
    rows: &VertexRows,
    direct: &mut DirectRows,
    u_bsdf: &SampleRows,
    count: usize,
) {
    for i in 0..whole_vectors(count) {
        let contribution = direct.contribution.get(i);
        let probability = grid.shadow_ray_probability(contribution.max_channel(), rows.rr_scale[i]);
        // The number of the path's own roulette, reversed: the two decisions are anticorrelated.
        let is_traced = 1.0 - u_bsdf.of(i)[3] <= probability;
        direct.contribution.set(i, contribution * (1.0 / probability));
        direct.status[i] = if is_traced { direct.status[i] } else { spawn::NONE };
    }
}

/// The factor on light from a direction under a normal or bump map, for the cosines of the direction with the geometric
/// and the shading normal and of these.
#[inline(always)]
pub(super) fn shadowing<const PERTURBED: bool>(test: HemisphereTest, [cos, cos_local, cos_normals]: [f32; 3]) -> f32 {
    if PERTURBED & test.in_frame & test.in_geometry & (cos_normals != 0.0) {
        terminator_factor(cos, cos_local, cos_normals)
    } else {
        1.0
    }
}

/// Whether a ray may start above the facet that hides its direction. Under a normal or bump map the factor has darkened
/// what comes near; where light passes, the side of the facet determines the medium.
#[inline(always)]
pub(super) fn can_be_below(rows: &VertexRows, test: HemisphereTest, i: usize) -> bool {
    test.is_below_facet() & (rows.flags[i] & vertex_flags::TRANSMITS == 0) & (rows.cos_normals[i] == 0.0)
}

/// Starts shadow rays above the facets that hide their lights.
fn offset_below_facets(context: &Context, vertices: &mut Vertices, buffers: &mut TerminatorRays) -> u64 {
    terminator::offset(
        context,
        vertices,
        buffers,
        |vertices| &mut vertices.direct.status,
        |vertices, lane, start| {
            let ray = match vertices.light_samples.target[lane] {
                light_target::POINT => start.spawn_to(&vertices.light_target(lane)),
                _ => start.spawn(vertices.light_samples.direction.get(lane)),
            };
            terminator::set_shadow_ray(vertices, lane, &ray);
        },
    )
}
