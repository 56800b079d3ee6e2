//! Splitting at smooth glass where its reflection probably shows an emitter.
//!
//! Choosing between reflection and refraction meets the emitter with the reflectance as the probability, a few in a
//! hundred, and then the path is as bright as the emitter. Here the path goes on through the glass, and a second path
//! follows the reflection. Only along paths that mirrors and glass alone have scattered, and in scenes with few
//! emitters. `docs/performance.md` has what it brings.

use super::block::{VertexRows, Vertices, vertex_flags};
use super::wave::{BsdfScratch, Path, Wave, path_flags};
use super::{Context, EmitterPrims};
use crate::color::Rgb;
use crate::geometry::SpawnPoint;
use crate::integrator::light_events::LobeWeights;
use crate::integrator::vertex::HemisphereTest;
use crate::math::compact::filter_lanes;
use crate::math::float::ONE_MINUS_EPSILON;
use crate::math::rows::{BATCH, WIDTH, soa, whole_vectors};
use crate::math::vectorize::vectorize;
use crate::math::{Frame, Ray, RayCone, Vec3, vec3};

/// The least throughput of both paths.
const MIN_THROUGHPUT: f32 = 0.01;

soa! {
    /// Reflections at the vertices of a block.
    pub(super) struct SplitRows {
        /// Whether the path was split, so that it does not choose the reflection: 0 or 1.
        is_split: u32,
        /// The probability with which sampling the BSDF chooses the reflection.
        pdf: f32,
        /// Its direction, in the shading frame.
        wi: Vec3,
        /// The throughput of the reflection.
        value: Rgb,
        /// Its direction outside the glass, in the shading frame.
        leaving: Vec3,
    }
}

impl SplitRows {
    /// The number that chooses a lobe, for a path that does not choose the reflection where it was split.
    #[inline]
    pub fn lobe_choice(&self, lane: usize, u_lobe: f32) -> f32 {
        let pdf = self.pdf[lane];
        if self.is_split[lane] == 0 { u_lobe } else { (pdf + u_lobe * (1.0 - pdf)).min(ONE_MINUS_EPSILON) }
    }

    /// The probability of what the path may choose at a vertex, for sampling the BSDF without regard to that.
    #[inline]
    pub fn remaining(&self, lane: usize) -> f32 {
        if self.is_split[lane] == 0 { 1.0 } else { 1.0 - self.pdf[lane] }
    }
}

/// A path that begins at a vertex of another, with the state of [`Wave`]'s optional columns.
pub(super) struct Branch {
    pub path: Path,
    pub ray: Ray,
    pub cone: Option<RayCone>,
    pub lobes: LobeWeights,
}

/// Splits the paths of a block.
pub(super) fn split(context: &Context, wave: &mut Wave, block: usize) {
    wave.vertices.splits.is_split = [0; BATCH];
    // Pilots attribute all that a sample finds later to each of its vertices.
    let is_pilot = wave.continuations.is_enabled() || context.pass.guidance.has_moments;
    let Some(emitters) = context.emitter_prims.filter(|_| context.config.splitting && !is_pilot) else { return };
    let Wave { vertices, bsdf_rows, branches, cones, light_aovs, .. } = wave;
    sample_reflections(context, vertices, bsdf_rows);
    if vertices.split_lanes.is_empty() {
        return;
    }
    vectorize!(keep_shown(emitters, vertices));
    for &lane in &vertices.split_lanes {
        let lane = usize::from(lane);
        if vertices.splits.is_split[lane] == 0 {
            continue;
        }
        let ray = ray_along(vertices, lane, vertices.splits.wi.get(lane));
        if !is_consistent(vertices, lane, &ray) {
            continue;
        }
        let path = block * BATCH + vertices.path(lane);
        branches.push(Branch {
            path: reflected(vertices, lane),
            ray,
            cone: cones
                .get(path)
                .map(|&cone| context.pass.render.scattered_cone(cone, vertices.rows.t[lane], f32::INFINITY)),
            lobes: light_aovs.lobes(path).unwrap_or(LobeWeights::Reflected { diffuse: Rgb::BLACK }),
        });
    }
}

/// Finds the reflections of the vertices where paths may be split.
fn sample_reflections(context: &Context, vertices: &mut Vertices, scratch: &mut BsdfScratch) {
    let Vertices { rows, non_diffuse, bsdfs, splits, split_lanes, .. } = vertices;
    filter_lanes(split_lanes, non_diffuse.iter().copied(), |lane| can_be_split(rows, lane));
    for lanes in bsdfs.groups(split_lanes) {
        // Reflection is the first lobe, what crosses the last.
        bsdfs.sample_group(context.scene, &rows.wo, lanes, |_| [0.0, 0.5, 0.5], scratch);
        for (i, &lane) in lanes.iter().enumerate() {
            let (lane, samples) = (usize::from(lane), &scratch.samples);
            let is_reflection = samples.is_valid[i] != 0 && samples.is_transmission[i] == 0;
            splits.is_split[lane] = 1;
            splits.pdf[lane] = if is_reflection { samples.pdf[i] } else { 0.0 };
            splits.wi.set(lane, samples.wi.get(i));
            splits.value.set(lane, samples.weight.get(i) * samples.pdf[i]);
            splits.leaving.set(lane, samples.wi.get(i));
        }
        let is_inside = |lane: usize| rows.wo.0[2][lane] < 0.0;
        if !lanes.iter().any(|&lane| is_inside(usize::from(lane))) {
            continue;
        }
        bsdfs.sample_group(context.scene, &rows.wo, lanes, |_| [ONE_MINUS_EPSILON, 0.5, 0.5], scratch);
        for (i, lane) in lanes.iter().map(|&lane| usize::from(lane)).enumerate().filter(|&(_, lane)| is_inside(lane)) {
            // What is reflected within a slab leaves it as the mirror image of what crosses.
            let crossing = scratch.samples.wi.get(i);
            splits.leaving.set(lane, vec3(crossing.x, crossing.y, -crossing.z));
        }
    }
}

/// Whether a vertex is on smooth glass and its path has met nothing but mirrors and such glass.
fn can_be_split(rows: &VertexRows, lane: usize) -> bool {
    const GLASS: u32 = vertex_flags::DELTA | vertex_flags::TRANSMITS;
    (rows.flags[lane] & GLASS == GLASS) & (rows.path_flags[lane] & path_flags::ANY_NON_SPECULAR == 0)
}

/// Keeps the vertices whose reflection may show an emitter, if all glass is in slabs with the directions of this one,
/// and where both paths carry enough.
#[inline(always)]
fn keep_shown(emitters: &EmitterPrims, vertices: &mut Vertices) {
    let Vertices { rows, points, splits, count, .. } = vertices;
    for first in (0..whole_vectors(*count)).step_by(WIDTH) {
        let mut is_any = 0;
        for i in first..first + WIDTH {
            let pdf = splits.pdf[i];
            let least = rows.throughput.get(i).max_channel() * pdf.min(1.0 - pdf);
            splits.is_split[i] &= u32::from(!(least < MIN_THROUGHPUT));
            is_any |= splits.is_split[i];
        }
        if is_any == 0 {
            continue;
        }
        let (mut origins, mut directions) = ([[0.0; WIDTH]; 3], [[0.0; WIDTH]; 3]);
        for k in 0..WIDTH {
            let i = first + k;
            let start = SpawnPoint { p: points.p.get(i), n: rows.n_g.get(i), error: rows.error[i] };
            let frame = Frame { x: rows.frame_x.get(i), y: rows.frame_y.get(i), z: rows.n.get(i) };
            let Ray { origin, direction, .. } = start.ray_along(frame.to_world(splits.leaving.get(i)));
            (origins[0][k], origins[1][k], origins[2][k]) = origin.into();
            (directions[0][k], directions[1][k], directions[2][k]) = direction.into();
        }
        let mut may_show = [0; WIDTH];
        for around in emitters.boxes() {
            for (k, may_show) in may_show.iter_mut().enumerate() {
                let [origin, direction] = [&origins, &directions].map(|rows| vec3(rows[0][k], rows[1][k], rows[2][k]));
                *may_show |= u32::from(around.may_be_met(origin, direction));
            }
        }
        for (is_split, may_show) in splits.is_split[first..].iter_mut().zip(may_show) {
            *is_split &= may_show;
        }
    }
}

fn ray_along(vertices: &Vertices, lane: usize, wi: Vec3) -> Ray {
    let rows = &vertices.rows;
    let start = SpawnPoint { p: vertices.points.p.get(lane), n: rows.n_g.get(lane), error: rows.error[lane] };
    Ray { time: rows.time[lane], ..start.ray_along(vertices.frame(lane).to_world(wi)) }
}

/// Whether a ray along the reflection is on the same side of both normals.
fn is_consistent(vertices: &Vertices, lane: usize, ray: &Ray) -> bool {
    let rows = &vertices.rows;
    let cos = ray.direction.dot(rows.n_g.get(lane));
    let cos_local = vertices.splits.wi.0[2][lane];
    HemisphereTest::new([rows.wo.0[2][lane], cos_local], [rows.cos_geometric[lane], cos]).agrees()
}

fn reflected(vertices: &Vertices, lane: usize) -> Path {
    let Vertices { rows, points, splits, .. } = vertices;
    Path {
        throughput: rows.throughput.get(lane) * splits.value.get(lane),
        pdf: splits.pdf[lane],
        rr_scale: rows.rr_scale[lane],
        flags: path_flags::SPECULAR,
        slot: rows.slot[lane],
        seed: rows.seed[lane],
        sample: rows.sample[lane],
        from_p: points.p.get(lane),
        from_n: rows.light_context_n.get(lane),
    }
}
