//! Spheres and other analytic shapes that many vertices sample at once, the same as each of them alone.

use super::{AreaLight, EmitterSample, EmitterShape, SphereEmitter};
use crate::geometry::{Geometry, Shape, WorldSampleRows};
use crate::id::LightId;
use crate::light::queue::LightSampleOutput;
use crate::light::{Light, LightContext, LightQueries, LightSampleRows, light_target};
use crate::math::DVec3;
use crate::math::compact::Compaction;
use crate::math::rows::{BATCH, Element, Row, pair, soa, whole_vectors};
use crate::math::vectorize::vectorize;

soa! {
    /// Points that sample a light, and the points sampled as seen from there.
    struct ViewRows {
        p: DVec3,
        q: DVec3,
        n: DVec3,
        wi: DVec3,
        /// Density per solid angle. Not positive where there is no sample.
        pdf: f64,
    }
}

soa! {
    /// Whole spheres that emit outwards.
    struct SphereRows {
        center: DVec3,
        radius: f64,
    }
}

/// Buffers for vertices that sample spheres and other analytic shapes, at most [`BATCH`].
pub(in crate::light) struct EmitterScratch {
    /// The spheres of the vertices that sample any.
    spheres: SphereRows,
    rows: EmitterRows,
}

/// Vertices that are sampled at once, with their samples.
struct EmitterRows {
    u: [Row; 2],
    views: ViewRows,
    points: WorldSampleRows,
    /// Probability with which each light was chosen.
    pmfs: Row,
    samples: LightSampleRows,
}

impl Default for EmitterScratch {
    fn default() -> Self {
        let rows = EmitterRows {
            u: [[0.0; BATCH]; 2],
            views: ViewRows::default(),
            points: WorldSampleRows::default(),
            pmfs: [0.0; BATCH],
            samples: LightSampleRows::default(),
        };
        Self { spheres: SphereRows::default(), rows }
    }
}

/// Vertices with one light that are worth a vector.
const MIN_LANES: usize = 3;

impl EmitterScratch {
    /// Samples the lights of vertices whose lights are all spheres.
    pub fn sample_spheres(
        &mut self,
        lanes: &[u8],
        lights: &Row<u32>,
        context: &LightContext,
        queries: &LightQueries,
        out: &mut LightSampleOutput,
    ) {
        let Self { spheres, rows } = self;
        for (i, &lane) in lanes.iter().enumerate() {
            if let Light::Area(light) = context.lights.get(LightId(lights[usize::from(lane)]))
                && let EmitterShape::Sphere(sphere) = &light.form
            {
                spheres.center.set(i, sphere.center);
                spheres.radius[i] = sphere.radius;
                rows.samples.radiance.set(i, light.emission.radiance);
            }
        }
        if !lanes.is_empty() {
            let lanes = Compaction::of(lanes);
            rows.gather(&lanes, queries, out.pmfs);
            vectorize!(sample_spheres(spheres, &rows.u, &mut rows.views, lanes.len()));
            rows.finish(&lanes, true, out);
        }
    }

    /// Samples the lights of vertices whose lights are all other analytic shapes.
    pub fn sample_shapes(
        &mut self,
        lanes: &[u8],
        lights: &Row<u32>,
        context: &LightContext,
        queries: &LightQueries,
        out: &mut LightSampleOutput,
    ) {
        let rows = &mut self.rows;
        for (id, lanes) in Compaction::of(lanes).groups(lights) {
            let Light::Area(light) = context.lights.get(LightId(id)) else { continue };
            if lanes.len() >= MIN_LANES {
                rows.gather(&lanes, queries, out.pmfs);
                if rows.sample_shape(light, context.geometry, lanes.len()) {
                    rows.finish(&lanes, light.emission.two_sided, out);
                    continue;
                }
            }
            for lane in lanes.lanes() {
                let (_, u) = queries.get(lane);
                if let Some(sample) = light.sample(context.geometry, context.textures, &queries.light_context(lane), u)
                {
                    out.set(lane, &sample);
                }
            }
        }
    }
}

impl EmitterRows {
    /// Copies what samples depend on.
    fn gather(&mut self, lanes: &Compaction, queries: &LightQueries, pmfs: &Row) {
        let [_, u, v, _] = queries.u.numbers();
        lanes.compact(u, &mut self.u[0]);
        lanes.compact(v, &mut self.u[1]);
        lanes.compact(pmfs, &mut self.pmfs);
        lanes.compact_3(&queries.points.0, &mut self.views.p.0);
    }

    /// Samples a light that is no sphere for the first `count` vertices; `false` if it has to be sampled alone.
    fn sample_shape(&mut self, light: &AreaLight, geometry: &Geometry, count: usize) -> bool {
        let Self { u, views, points, samples, .. } = self;
        let Shape::Analytic(placed) = geometry.shape(light.shape) else { return false };
        if !placed.samples_in_rows() {
            return false;
        }
        placed.sample_area_rows(u, count, points);
        vectorize!(see_points(points, views, count));
        for (row, value) in samples.radiance.0.iter_mut().zip(light.emission.radiance.to_array()) {
            row[..count].fill(value);
        }
        true
    }

    /// Writes the samples, whose radiance is set.
    fn finish(&mut self, lanes: &Compaction, is_any_side_seen: bool, out: &mut LightSampleOutput) {
        let Self { views, pmfs, samples, .. } = self;
        vectorize!(set_samples(views, pmfs, is_any_side_seen, samples, lanes.len()));
        out.expand(lanes, samples, &views.q);
    }
}

#[inline(always)]
fn set_samples(views: &ViewRows, pmfs: &Row, is_any_side_seen: bool, samples: &mut LightSampleRows, count: usize) {
    for i in 0..whole_vectors(count) {
        let (n, wi, pdf) = (views.n.get(i).as_vec3(), views.wi.get(i).as_vec3(), views.pdf[i] as f32);
        let is_sampled = EmitterSample::is_density(pdf) & (is_any_side_seen | (wi.dot(n) < 0.0));
        samples.target[i] = if is_sampled { light_target::POINT } else { light_target::NONE };
        samples.direction.set(i, wi);
        samples.pdf[i] = pdf * <f32 as Element>::get(pmfs, i);
        samples.target_n.set(i, n);
    }
}

#[inline(always)]
fn sample_spheres(spheres: &SphereRows, u: &[Row; 2], views: &mut ViewRows, count: usize) {
    for i in 0..whole_vectors(count) {
        let sphere = SphereEmitter { center: spheres.center.get(i), radius: spheres.radius[i], inward: false };
        let p = views.p.get(i);
        let point = sphere.sample_from_outside(p, pair(u, i));
        views.q.set(i, point.q);
        views.n.set(i, point.n);
        views.wi.set(i, point.wi);
        views.pdf[i] = if sphere.sees_front(p) { point.pdf } else { 0.0 };
    }
}

#[inline(always)]
fn see_points(points: &WorldSampleRows, views: &mut ViewRows, count: usize) {
    for i in 0..whole_vectors(count) {
        let (q, n) = (points.p.get(i), points.n.get(i));
        let (wi, pdf) = EmitterSample::direction_and_pdf(views.p.get(i), q, n, points.pdf_area[i]);
        views.q.set(i, q);
        views.n.set(i, n);
        views.wi.set(i, wi);
        views.pdf[i] = pdf;
    }
}
