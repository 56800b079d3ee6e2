//! Spheres and other analytic shapes that many vertices sample at once, the same as each of them alone.

use super::{AreaLight, EmitterSample, EmitterShape, SphereEmitter};
use crate::geometry::{Geometry, Shape, WorldSampleRows};
use crate::id::LightId;
use crate::light::{Light, LightContext, LightQueries, LightSample};
use crate::math::DVec3;
use crate::math::compact::sort_lanes;
use crate::math::rows::{BATCH, Row, pair, soa, whole_vectors};
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

/// Vertices that sample spheres and other analytic shapes, at most [`BATCH`].
pub(in crate::light) struct EmitterQueue {
    lanes: Vec<u8>,
    /// Of each vertex, the light.
    lights: Row<u32>,
    rows: EmitterRows,
}

/// Vertices with one light, with its samples.
struct EmitterRows {
    u: [Row; 2],
    views: ViewRows,
    samples: WorldSampleRows,
}

impl Default for EmitterQueue {
    fn default() -> Self {
        let rows =
            EmitterRows { u: [[0.0; BATCH]; 2], views: ViewRows::default(), samples: WorldSampleRows::default() };
        Self { lanes: Vec::with_capacity(BATCH), lights: [0; BATCH], rows }
    }
}

/// Vertices with one light that are worth a vector.
const MIN_LANES: usize = 3;

impl EmitterQueue {
    /// Empties the queue.
    pub fn clear(&mut self) {
        self.lanes.clear();
    }

    /// Queues the sample of a light for the vertex `lane`; `false` if the light is not sampled here.
    #[inline(always)]
    pub fn push(&mut self, light: &AreaLight, id: LightId, lane: usize) -> bool {
        if !(light.emission.is_even()
            && matches!(light.form, EmitterShape::Sphere(_) | EmitterShape::TransformedShape { .. }))
        {
            return false;
        }
        self.lanes.push(lane as u8);
        self.lights[lane] = id.0;
        true
    }

    /// Samples all lights; `set` takes each sample with its vertex.
    pub fn sample(&mut self, context: &LightContext, queries: &LightQueries, mut set: impl FnMut(usize, &LightSample)) {
        let Self { lanes, lights, rows } = self;
        sort_lanes(lanes, lights);
        for group in lanes.chunk_by(|&a, &b| lights[usize::from(a)] == lights[usize::from(b)]) {
            let Light::Area(light) = context.lights.get(LightId(lights[usize::from(group[0])])) else { continue };
            let is_in_rows = group.len() >= MIN_LANES && {
                for (i, &lane) in group.iter().enumerate() {
                    let (p, [s, t]) = queries.get(usize::from(lane));
                    rows.views.p.set(i, p);
                    (rows.u[0][i], rows.u[1][i]) = (s, t);
                }
                rows.sample(light, context.geometry, group.len())
            };
            for (i, lane) in group.iter().map(|&lane| usize::from(lane)).enumerate() {
                let (_, u) = queries.get(lane);
                let sample = if is_in_rows {
                    sample_of_row(light, &rows.views, i)
                } else {
                    light.sample(context.geometry, context.textures, &queries.light_context(lane), u)
                };
                if let Some(sample) = sample {
                    set(lane, &sample);
                }
            }
        }
    }
}

impl EmitterRows {
    /// Samples a light for the first `count` vertices; `false` if it has to be sampled alone.
    fn sample(&mut self, light: &AreaLight, geometry: &Geometry, count: usize) -> bool {
        let Self { u, views, samples } = self;
        match (&light.form, geometry.shape(light.shape)) {
            (EmitterShape::Sphere(sphere), _)
                if !sphere.inward && (0..count.min(BATCH)).all(|i| sphere.sees_front(views.p.get(i))) =>
            {
                vectorize!(sample_sphere(sphere, u, views, count));
                true
            }
            (EmitterShape::TransformedShape { .. }, Shape::Analytic(placed)) if placed.samples_in_rows() => {
                placed.sample_area_rows(u, count, samples);
                vectorize!(see_samples(samples, views, count));
                true
            }
            _ => false,
        }
    }
}

/// The sample of one of the points.
fn sample_of_row(light: &AreaLight, views: &ViewRows, i: usize) -> Option<LightSample> {
    let (n, wi, pdf) = (views.n.get(i).as_vec3(), views.wi.get(i).as_vec3(), views.pdf[i] as f32);
    let sample = EmitterSample { p: views.q.get(i), n, wi, pdf }.if_valid()?;
    let is_seen = light.emission.two_sided || matches!(light.form, EmitterShape::Sphere(_)) || wi.dot(n) < 0.0;
    is_seen.then(|| sample.with_radiance(light.emission.radiance, 0.0))
}

#[inline(always)]
fn sample_sphere(sphere: &SphereEmitter, u: &[Row; 2], views: &mut ViewRows, count: usize) {
    for i in 0..whole_vectors(count) {
        let point = sphere.sample_from_outside(views.p.get(i), pair(u, i));
        views.q.set(i, point.q);
        views.n.set(i, point.n);
        views.wi.set(i, point.wi);
        views.pdf[i] = point.pdf;
    }
}

#[inline(always)]
fn see_samples(samples: &WorldSampleRows, views: &mut ViewRows, count: usize) {
    for i in 0..whole_vectors(count) {
        let (q, n) = (samples.p.get(i), samples.n.get(i));
        let (wi, pdf) = EmitterSample::direction_and_pdf(views.p.get(i), q, n, samples.pdf_area[i]);
        views.q.set(i, q);
        views.n.set(i, n);
        views.wi.set(i, wi);
        views.pdf[i] = pdf;
    }
}
