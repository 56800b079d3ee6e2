//! The densities of connections beside those of other strategies, along paths from the camera.

use super::Context;
use super::block::{EvalRows, VertexRows, Vertices, spawn};
use super::evals::Surfaces;
use super::wave::Wave;
use crate::id::LightId;
use crate::integrator::bidirectional::{CONNECTIONS_PER_VERTEX, LightPaths, PartialMis, bounded, squared};
use crate::integrator::vertex::HemisphereTest;
use crate::light::{LightSampleRows, light_target};
use crate::math::Vec3;
use crate::math::rows::{BATCH, Row, soa, whole_vectors};
use crate::math::vectorize::vectorize;

/// What a path from the camera remembers of other strategies.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ConnectionState {
    /// As of the last vertex.
    d_vc: f64,
    /// Whether the last vertex can be connected to this one.
    is_connectable: bool,
}

impl ConnectionState {
    /// What connections add to the sum of the squared densities over that of meeting the light of a surface by chance.
    #[inline]
    pub fn of_emission(&self, context: &Context, id: LightId, n: Vec3) -> f64 {
        let Some(LightPaths { emitters, .. }) = context.pass.light_paths else { return 0.0 };
        if self.d_vc == 0.0 {
            return 0.0;
        }
        self.against(emitters.pdf_per_cos(context.scene, id, n))
    }

    /// The same for the light of a light at infinity, from the last vertex `p` along the unit `direction`.
    #[inline]
    pub fn of_miss(&self, context: &Context, id: LightId, p: Vec3, direction: Vec3) -> f64 {
        let Some(LightPaths { emitters, .. }) = context.pass.light_paths else { return 0.0 };
        if self.d_vc == 0.0 {
            return 0.0;
        }
        self.against(emitters.pdf_from_infinity(context.scene, id, p, direction))
    }

    fn against(&self, emitted_pdf: f32) -> f64 {
        bounded(squared(emitted_pdf) * CONNECTIONS_PER_VERTEX * CONNECTIONS_PER_VERTEX * self.d_vc)
    }
}

soa! {
    /// [`PartialMis`] where the paths of a block arrive, and of what they connect to.
    pub(super) struct MisRows {
        d_vcm: f64,
        d_vc: f64,
        light_d_vcm: f64,
        light_d_vc: f64,
        /// The part of the last two that is not of connections.
        unconnected_d_vcm: f64,
        unconnected_d_vc: f64,
        /// Of the path that goes on.
        next_d_vc: f64,
    }
}

soa! {
    /// Densities at the vertices of a block.
    pub(super) struct DensityRows {
        /// Of the last direction, per solid angle, or infinite where the last vertex cannot be connected to this one.
        arrived: f32,
        /// With which scattering chooses the direction back from a direction chosen elsewhere.
        reversed: f32,
        /// Of rays from the sampled light, over their cosine.
        emitted: f32,
        /// The weight of a connection by MIS.
        weight: f32,
        /// The mean of the square that a path without connections adds, over that which a connection adds.
        moment_ratio: f32,
        /// Whether the path that goes on has a vertex that can be connected.
        is_connectable: u32,
    }
}

/// What connections need of the vertices of a block.
#[derive(Default)]
pub(super) struct ConnectionMis {
    pub mis: MisRows,
    pub densities: DensityRows,
}

impl ConnectionMis {
    /// The state of the path that goes on from a vertex.
    pub fn after(&self, lane: usize) -> ConnectionState {
        let is_connectable = self.densities.is_connectable[lane] != 0;
        ConnectionState { d_vc: self.mis.next_d_vc[lane], is_connectable }
    }
}

/// Finds the sums of other strategies where the paths of a block arrive.
pub(super) fn arrive(wave: &mut Wave, block: usize) {
    let Wave { vertices, paths, connections, connection_mis, .. } = wave;
    let ConnectionMis { mis, densities } = connection_mis;
    for lane in 0..vertices.count.min(BATCH) {
        let path = vertices.path(lane);
        let state = connections[block * BATCH + path];
        mis.d_vc[lane] = state.d_vc;
        densities.arrived[lane] = if state.is_connectable { paths[block].pdf[path] } else { f32::INFINITY };
    }
    vectorize!(find_arrived(&vertices.rows, densities, mis, vertices.count));
}

#[inline(always)]
fn find_arrived(rows: &VertexRows, densities: &DensityRows, mis: &mut MisRows, count: usize) {
    for i in 0..whole_vectors(count) {
        let cos = squared(rows.cos_geometric[i]);
        mis.d_vcm[i] = squared(rows.t[i] * rows.t[i] / densities.arrived[i]) / cos;
        mis.d_vc[i] /= cos;
    }
}

/// Finds the sums of other strategies along the paths that go on.
pub(super) fn leave(context: &Context, wave: &mut Wave) {
    let Wave { vertices, connection_mis: ConnectionMis { mis, densities }, bsdf_rows, .. } = wave;
    let Vertices { count, rows, scatter, bsdfs, non_diffuse, .. } = &*vertices;
    let is_wanted = |lane: usize| scatter.status[lane] == spawn::SPAWNED && scatter.is_delta[lane] == 0;
    let surfaces = Surfaces { scene: context.scene, count: *count, rows, bsdfs, non_diffuse };
    surfaces.reversed_pdfs(&scatter.wi, is_wanted, bsdf_rows, &mut densities.reversed);
    vectorize!(find_next(vertices, densities, mis));
}

#[inline(always)]
fn find_next(vertices: &Vertices, densities: &mut DensityRows, mis: &mut MisRows) {
    let Vertices { count, rows, scatter, .. } = vertices;
    for i in 0..whole_vectors(*count) {
        let cos = scatter.direction.get(i).dot(rows.n_g.get(i));
        let is_delta = scatter.is_delta[i] != 0;
        let test = HemisphereTest::new([rows.wo.0[2][i], scatter.wi.0[2][i]], [rows.cos_geometric[i], cos]);
        let partial = PartialMis { d_vcm: mis.d_vcm[i], d_vc: mis.d_vc[i] };
        let next = squared(cos / scatter.pdf[i]) * partial.sum(densities.reversed[i]);
        let next = if next.is_finite() { next } else { 0.0 };
        // Light paths do not go where the normals disagree.
        let next = if test.agrees() { next } else { 0.0 };
        mis.next_d_vc[i] = if is_delta { mis.d_vc[i] * squared(cos) } else { next };
        densities.is_connectable[i] = u32::from(!is_delta & test.agrees());
    }
}

/// Weighs light samples against connections too.
pub(super) fn reweigh_light_samples(context: &Context, wave: &mut Wave) {
    let Some(LightPaths { emitters, .. }) = context.pass.light_paths else { return };
    let Wave { vertices, connection_mis: ConnectionMis { mis, densities }, bsdf_rows, .. } = wave;
    let Vertices { count, rows, points, light_samples, light_evals, direct, bsdfs, non_diffuse, .. } = vertices;
    let is_weighed = |lane: usize| {
        let (target, is_delta) = (light_samples.target[lane], light_samples.is_delta[lane] != 0);
        direct.status[lane] == spawn::SPAWNED && (target == light_target::INFINITY || !is_delta)
    };
    for lane in 0..(*count).min(BATCH) {
        let light = LightId(light_samples.light[lane]);
        densities.emitted[lane] = match light_samples.target[lane] {
            _ if !is_weighed(lane) => 0.0,
            light_target::POINT => emitters.pdf_per_cos(context.scene, light, light_samples.target_n.get(lane)),
            _ => {
                let (p, wi) = (points.p.get(lane).as_vec3(), light_samples.direction.get(lane));
                emitters.pdf_from_infinity(context.scene, light, p, wi)
            }
        };
    }
    let surfaces = Surfaces { scene: context.scene, count: *count, rows, bsdfs, non_diffuse };
    surfaces.reversed_pdfs(&light_evals.wi, is_weighed, bsdf_rows, &mut densities.reversed);
    let samples = context.light_samples() as f32;
    let lights = LightWeights { rows, light_samples, light_evals, densities, mis, samples };
    vectorize!(reweigh(&lights, &mut direct.contribution.0, *count));
}

/// What light samples are weighed with.
struct LightWeights<'a> {
    rows: &'a VertexRows,
    light_samples: &'a LightSampleRows,
    light_evals: &'a EvalRows,
    densities: &'a DensityRows,
    mis: &'a MisRows,
    /// How many each vertex has.
    samples: f32,
}

#[inline(always)]
fn reweigh(lights: &LightWeights, contribution: &mut [Row; 3], count: usize) {
    let LightWeights { rows, light_samples, light_evals, densities, mis, samples } = *lights;
    for i in 0..whole_vectors(count) {
        let cos = light_samples.direction.get(i).dot(rows.n_g.get(i));
        let pdf = squared(light_samples.pdf[i] * samples);
        let partial = PartialMis { d_vcm: mis.d_vcm[i], d_vc: mis.d_vc[i] };
        let connections = squared(densities.emitted[i] * cos) * CONNECTIONS_PER_VERTEX * CONNECTIONS_PER_VERTEX / pdf
            * partial.sum(densities.reversed[i]);
        let by_bsdf = if light_samples.is_delta[i] == 0 { squared(light_evals.pdf[i]) } else { 0.0 };
        let others = 1.0 + by_bsdf / pdf;
        let factor = (1.0 / (1.0 + bounded(connections / others))) as f32;
        for row in contribution.iter_mut() {
            row[i] *= factor;
        }
    }
}
