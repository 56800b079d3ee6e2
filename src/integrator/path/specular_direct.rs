//! Direct light by specular reflection where a BSDF has other lobes too: emitters that coats and plastic show.
//!
//! A path that samples such a lobe finds the emitter with the probability of the lobe, a few in a hundred, and then is
//! as bright as the emitter. In scenes with few emitters the lobe is evaluated in place of being chosen: its direction
//! is known, so it is intersected with the emitters, and a shadow ray is traced to the closest one. Paths that do
//! sample the lobe then leave out the emission they meet. [`splitting`](super::splitting) is for dielectrics.
//! `docs/performance.md` has what it brings.

use super::block::{VertexRows, Vertices, vertex_flags};
use super::direct::{self, Weighting};
use super::wave::{BsdfScratch, Wave};
use super::{Context, EmitterPrims, PassContext, PathIntegrator, Strategy};
use crate::color::Rgb;
use crate::geometry::{SpawnPoint, SurfaceInteraction};
use crate::id::LightId;
use crate::light::{Light, light_target};
use crate::math::rows::{Row, soa, whole_vectors};
use crate::math::vectorize::vectorize;
use crate::math::{Frame, Ray, Vec3};

soa! {
    /// Specular reflections at the vertices of a block.
    pub(super) struct SpecularRows {
        /// 0 or 1.
        has_reflection: u32,
        /// Unit direction of the reflection.
        direction: Vec3,
        /// A bit for each emitter that it may meet.
        candidates: u32,
    }
}

/// The emitters for which this is done: all of a scene, or none.
pub(super) fn emitters<'a>(config: &PathIntegrator, pass: &PassContext<'a>) -> Option<&'a EmitterPrims> {
    // Paths also pass boundaries of media by delta lobes, which have other rules.
    let is_plain = config.strategy == Strategy::Mis && !pass.world.scene.features.media;
    pass.world.emitter_prims.as_ref().filter(|_| is_plain)
}

/// Whether this is done at the vertices of this bounce. After the first scattering light paths have weights against
/// finding emitters by reflection.
pub(super) fn is_enabled(context: &Context) -> bool {
    context.emitter_prims.is_some() && (context.bounce == 0 || context.pass.light_paths.is_none())
}

/// Whether the light of a photon that starts at a vertex with these flags is evaluated along camera paths.
pub(super) fn replaces_photon(context: &Context, flags: u32, light: LightId) -> bool {
    let is_evaluated = context.emitter_prims.is_some() && flags & vertex_flags::MIXED_SPECULAR != 0;
    is_evaluated && matches!(context.scene.lights.get(light), Light::Area(_))
}

/// Queues the shadow rays of a block's vertices along specular reflections.
pub(super) fn add(context: &Context, wave: &mut Wave, block: usize) {
    let Some(emitters) = context.emitter_prims.filter(|_| is_enabled(context)) else { return };
    if !find_emitters(context, emitters, wave) {
        return;
    }
    let first = wave.shadows.count;
    wave.vertices.is_direct_specular = true;
    let weighting = Weighting { mis: false, light_samples: 1.0, darkens_bumps: false };
    direct::weigh(context, &mut wave.vertices, weighting);
    direct::finish_shadow_rays(context, wave, block);
    wave.queue_shadow_rays(context, block, 0);
    wave.vertices.is_direct_specular = false;
    if context.bounce == 0 {
        wave.continuations.mark_specular(first..wave.shadows.count);
    }
}

/// Sets light samples and evaluations for vertices whose specular reflection meets an emitter; false if there are none.
fn find_emitters(context: &Context, emitters: &EmitterPrims, wave: &mut Wave) -> bool {
    let Wave { vertices, bsdf_rows, specular_rows: found, .. } = wave;
    let count = vertices.count;
    if !sample_reflections(context, vertices, bsdf_rows, &mut found.has_reflection) {
        return false;
    }
    vectorize!(aim(emitters, vertices, found, count));
    let mut is_any = false;
    vertices.light_samples.target[..count].fill(light_target::NONE);
    for lane in (0..count).filter(|&lane| found.candidates[lane] != 0) {
        is_any |= set_light(context, emitters, vertices, lane, found);
    }
    is_any
}

/// Samples the specular reflection of all vertices that have it beside other lobes; false if there are none.
fn sample_reflections(
    context: &Context,
    vertices: &mut Vertices,
    scratch: &mut BsdfScratch,
    has_reflection: &mut Row<u32>,
) -> bool {
    has_reflection[..vertices.count].fill(0);
    let mut is_any = false;
    let Vertices { rows, light_evals: evals, non_diffuse, bsdfs, .. } = vertices;
    let is_mixed = |&lane: &u8| rows.flags[usize::from(lane)] & vertex_flags::MIXED_SPECULAR != 0;
    for lanes in bsdfs.groups(non_diffuse).filter(|lanes| lanes.iter().any(is_mixed)) {
        // The specular lobe is the first.
        bsdfs.sample_group(context.scene, &rows.wo, lanes, |_| [0.0, 0.5, 0.5], scratch);
        let samples = &scratch.samples;
        for (i, &lane) in lanes.iter().enumerate() {
            if samples.is_valid[i] & samples.is_delta[i] != 0 && is_mixed(&lane) {
                let lane = usize::from(lane);
                has_reflection[lane] = 1;
                evals.wi.set(lane, samples.wi.get(i));
                evals.value.set(lane, samples.weight.get(i) * samples.pdf[i]);
                is_any = true;
            }
        }
    }
    is_any
}

/// Finds the directions of reflections in world space, and the emitters that they may meet.
#[inline(always)]
fn aim(emitters: &EmitterPrims, vertices: &Vertices, found: &mut SpecularRows, count: usize) {
    let Vertices { rows, points, light_evals: evals, .. } = vertices;
    for i in 0..whole_vectors(count) {
        let frame = Frame { x: rows.frame_x.get(i), y: rows.frame_y.get(i), z: rows.n.get(i) };
        found.direction.set(i, frame.to_world(evals.wi.get(i)));
        found.candidates[i] = 0;
    }
    for (bit, around) in emitters.boxes().enumerate() {
        for i in 0..whole_vectors(count) {
            let is_near = around.may_be_met(points.p.get(i).as_vec3(), found.direction.get(i));
            found.candidates[i] |= (u32::from(is_near) & found.has_reflection[i]) << bit;
        }
    }
}

/// Sets the light sample of a vertex to what its reflection meets of the emitters that it may meet, if it does.
fn set_light(
    context: &Context,
    emitters: &EmitterPrims,
    vertices: &mut Vertices,
    lane: usize,
    found: &SpecularRows,
) -> bool {
    let direction = found.direction.get(lane);
    let VertexRows { n_g, error, time, .. } = &vertices.rows;
    let start = SpawnPoint { p: vertices.points.p.get(lane), n: n_g.get(lane), error: error[lane] };
    let ray = Ray { time: time[lane], ..start.ray_along(direction) };
    let Some((id, radiance, at)) = emitted(context, emitters, &ray, found.candidates[lane]) else { return false };
    let Vertices { light_samples: lights, light_evals: evals, points, .. } = vertices;
    lights.light[lane] = id.0;
    lights.target[lane] = light_target::POINT;
    lights.is_delta[lane] = 1;
    lights.direction.set(lane, direction);
    lights.radiance.set(lane, radiance);
    lights.pdf[lane] = 1.0;
    points.target_p.set(lane, at.p);
    lights.target_n.set(lane, at.n_g);
    lights.target_error[lane] = at.error;
    evals.pdf[lane] = 0.0;
    true
}

/// The closest emitter along a ray, without regard to occlusion, with the radiance it emits against the ray.
fn emitted(
    context: &Context,
    emitters: &EmitterPrims,
    ray: &Ray,
    candidates: u32,
) -> Option<(LightId, Rgb, SurfaceInteraction)> {
    let scene = context.scene;
    let at = emitters.closest(context.world, ray, candidates)?;
    let id = scene.surface(at.shape).light(at.prim)?;
    let Light::Area(light) = scene.lights.get(id) else { return None };
    let radiance = light.radiance(&scene.geometry, &scene.textures, &at, -ray.direction);
    (!radiance.is_black()).then_some((id, radiance, at))
}
