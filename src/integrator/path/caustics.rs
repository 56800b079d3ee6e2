//! Photons gathered at vertices, and the weights of paths that find the same light by chance.

use super::Context;
use super::adjoint::{self, beam_ratio};
use super::block::{Vertices, spawn, vertex_flags};
use super::direct::shadowing;
use super::emission;
use super::radiance::Output;
use super::wave::Wave;
use crate::color::Rgb;
use crate::id::{InstanceId, LightId, ShapeId};
use crate::integrator::bidirectional::{bounded, squared};
use crate::integrator::light_events::LightEvent;
use crate::integrator::vertex::HemisphereTest;
use crate::integrator::{Caustics, Photon};
use crate::light::LightSampleContext;
use crate::math::Vec3;
use crate::math::rows::BATCH;
use crate::sampling::power_heuristic;

/// What is known of a path that was scattered by delta and near-specular lobes alone since it left a surface where
/// photons are gathered.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct CausticState {
    /// The density of photons there over that of the path's direction, without the density of photons at their start;
    /// 0 if there is no such surface.
    density_ratio: f32,
    /// The same with the density per area of choosing the last vertex as a start, and per solid angle of the light;
    /// 0 if photons do not start there.
    ratio_per_light_pdf: f32,
}

impl CausticState {
    /// The squared density of photons over that of light that the path has met, which `light_pdf` is the density of
    /// sampling from the last vertex, from both sides.
    #[inline]
    pub fn of_emission(&self, light_pdf: impl FnOnce() -> f32) -> f64 {
        if self.ratio_per_light_pdf > 0.0 { bounded(squared(self.ratio_per_light_pdf * light_pdf())) } else { 0.0 }
    }
}

/// The state of the path that goes on from a vertex.
pub(super) fn after(context: &Context, vertices: &Vertices, lane: usize, state: CausticState) -> CausticState {
    let Some(Caustics { casters, photons, .. }) = context.pass.caustics else { return state };
    let Vertices { rows, scatter, .. } = vertices;
    let cos = scatter.direction.get(lane).dot(rows.n_g.get(lane)).abs();
    if !adjoint::is_reversible(vertices, lane) {
        return CausticState::default();
    }
    let is_delta = scatter.is_delta[lane] != 0;
    if !is_delta && rows.flags[lane] & vertex_flags::NEAR_SPECULAR == 0 {
        let density_ratio = photons.gathered_area() * cos / scatter.pdf[lane];
        return CausticState { density_ratio, ratio_per_light_pdf: 0.0 };
    }
    if state.density_ratio == 0.0 {
        return state;
    }
    let factor = if is_delta {
        beam_ratio(vertices, lane)
    } else {
        let reversed = vertices.reversed_eval(context.scene, lane, scatter.wi.get(lane)).pdf;
        (reversed * cos / (scatter.pdf[lane] * rows.cos_geometric[lane])).abs()
    };
    let density_ratio = state.density_ratio * factor;
    let pdf_area = casters.pdf_area(ShapeId(rows.shape[lane]), InstanceId(rows.instance[lane]));
    let ratio = density_ratio * pdf_area / cos;
    CausticState { density_ratio, ratio_per_light_pdf: if ratio.is_finite() { ratio } else { 0.0 } }
}

/// Adds the light of the photons around a block's vertices.
pub(super) fn gather(context: &Context, wave: &mut Wave, block: usize, out: &mut Output) {
    let Some(Caustics { photons, .. }) = context.pass.caustics else { return };
    let Wave { vertices, light_aovs, moments, .. } = wave;
    let Vertices { rows, points, count, .. } = &*vertices;
    // All buckets are looked up before any is read, so that the processor waits for memory once.
    let mut candidates = [[].as_slice(); BATCH];
    for (lane, candidates) in candidates.iter_mut().enumerate().take(*count) {
        *candidates = photons.candidates(points.p.get(lane).as_vec3());
    }
    let scatters = |lane: usize| rows.flags[lane] & vertex_flags::UNGATHERED == 0;
    for lane in (0..(*count).min(BATCH)).filter(|&lane| !candidates[lane].is_empty() && scatters(lane)) {
        let (p, n) = (points.p.get(lane).as_vec3(), rows.n_g.get(lane));
        for (photon, kernel) in photons.near(candidates[lane], p, n) {
            let scatterings = context.bounce + 1 + photon.scatterings;
            let Some(scattered) = scattered(context, vertices, lane, photon) else { continue };
            if scatterings >= context.config.max_depth {
                continue;
            }
            let (slot, light) = (rows.slot[lane], rows.throughput.get(lane) * scattered.light * kernel);
            let light = context.config.clamped(light, scatterings);
            out.add(slot, light);
            moments.add_photon(slot, light, scattered.weight, scattered.density_ratio);
            if context.config.needs_light_aovs() {
                let event = if context.bounce == 0 && context.config.light_aovs.by_scattering {
                    let wi = vertices.frame(lane).to_local(photon.wi);
                    LightEvent::Indirect(vertices.lobes(context.scene, lane, wi))
                } else {
                    light_aovs.event(context.bounce + 2, block * BATCH + vertices.path(lane), LightEvent::Emission)
                };
                out.add_to_light_aovs(context, slot, light, event, photon.light);
            }
        }
    }
}

/// Weighs light samples at near-specular surfaces against photons too.
pub(super) fn reweigh_light_samples(context: &Context, wave: &mut Wave, block: usize) {
    let Some(Caustics { casters, .. }) = context.pass.caustics else { return };
    let Wave { vertices, caustics, moments, .. } = wave;
    let lights = &context.scene.lights;
    for lane in 0..vertices.count.min(BATCH) {
        let Vertices { rows, light_samples, light_evals, direct, .. } = &*vertices;
        let state = caustics[block * BATCH + vertices.path(lane)];
        let is_near_specular = rows.flags[lane] & vertex_flags::NEAR_SPECULAR != 0;
        if !is_near_specular || direct.status[lane] != spawn::SPAWNED || state.density_ratio == 0.0 {
            continue;
        }
        let pdf_area = casters.pdf_area(ShapeId(rows.shape[lane]), InstanceId(rows.instance[lane]));
        let reversed = vertices.reversed_eval(context.scene, lane, light_evals.wi.get(lane)).pdf;
        let (light, from) = (LightId(light_samples.light[lane]), vertices.light_context(lane));
        let [of_photons, of_paths] =
            [Vec3::ZERO, from.n].map(|n| lights.pmf(light, &LightSampleContext { n, ..from }, context.compensation));
        let density_ratio = state.density_ratio * pdf_area * reversed / rows.cos_geometric[lane].abs();
        let of_point = lights.get(light).side_factor(&from, vertices.points.target_p.get(lane));
        let squared_ratio = squared(density_ratio * of_photons / (of_paths * of_point));
        let pdf = light_samples.pdf[lane];
        let weight = if light_samples.is_delta[lane] != 0 { 1.0 } else { power_heuristic(pdf, light_evals.pdf[lane]) };
        let factor = emission::share_against(weight, squared_ratio) as f32;
        let contribution = direct.contribution.get(lane) * factor;
        vertices.direct.contribution.set(lane, contribution);
        if let Some(known) = moments.photon_factors.get_mut(lane) {
            *known = factor;
        }
    }
}

/// What a vertex scatters of a photon's light.
struct Scattered {
    /// Radiance, weighted by MIS against BSDF sampling.
    light: Rgb,
    /// That weight.
    weight: f32,
    /// The density of photons over that of BSDF sampling.
    density_ratio: f32,
}

/// What a vertex scatters of a photon's light, if anything.
#[inline]
fn scattered(context: &Context, vertices: &Vertices, lane: usize, photon: &Photon) -> Option<Scattered> {
    let area = context.pass.caustics?.photons.gathered_area();
    let rows = &vertices.rows;
    let wi = vertices.frame(lane).to_local(photon.wi);
    let cos = photon.wi.dot(rows.n_g.get(lane));
    let test = HemisphereTest::new([rows.wo.0[2][lane], wi.z], [rows.cos_geometric[lane], cos]);
    if !test.agrees() || cos.abs() < MIN_COS {
        return None;
    }
    let eval = vertices.eval(context.scene, lane, wi);
    let factor = if context.scene.features.normal_perturbations {
        shadowing::<true>(test, [cos, wi.z, rows.cos_normals[lane]])
    } else {
        1.0
    };
    let density = area * photon.density * cos.abs();
    let weight = if density.is_finite() { power_heuristic(density, eval.pdf) } else { 1.0 };
    let light = eval.value * photon.power * (factor * weight / (area * cos.abs()));
    (!light.is_black()).then_some(Scattered { light, weight, density_ratio: density / eval.pdf })
}

/// Photons are not gathered where they graze a surface: their density is not known there.
const MIN_COS: f32 = 1e-4;
