//! Area lights that many vertices sample at once.

use super::parallelogram::{ParallelogramRows, ParallelogramSample};
use super::{AreaLight, EmitterShape};
use crate::color::Rgb;
use crate::id::LightId;
use crate::light::{Light, LightQueries, LightSampleRows, LightSet, light_target};
use crate::math::DVec3;
use crate::math::rows::{BATCH, DVec3Rows, Element, Row, pair, soa, whole_vectors};
use crate::math::vectorize::vectorize;

soa! {
    /// Points of lights as seen from vertices.
    struct ViewRows of View {
        wi: DVec3,
        pdf: f64,
        /// 1 where the sample is to be one by solid angle, else 0.
        is_near: f64,
    }
}

soa! {
    /// What samples have of their lights.
    struct EmissionRows {
        radiance: Rgb,
        error: f32,
        two_sided: u32,
        /// 1 where the vertex samples the light now, else 0.
        is_queued: u32,
    }
}

/// No light.
const NO_LIGHT: u32 = u32::MAX;

/// Vertices that sample parallelograms, at most [`BATCH`], by lane.
pub(in crate::light) struct AreaQueue {
    count: usize,
    /// Ids of the lights in `shapes` and `emissions`: most often they are there already.
    ids: Row<u32>,
    shapes: ParallelogramRows,
    emissions: EmissionRows,
    views: ViewRows,
    near: NearQueue,
}

/// Those of the vertices that sample by solid angle.
struct NearQueue {
    lanes: Row<u32>,
    u: [Row; 2],
    shapes: ParallelogramRows,
    points: NearRows,
    views: ViewRows,
}

soa! {
    /// Points of vertices and of lights.
    struct NearRows {
        p: DVec3,
        q: DVec3,
    }
}

impl Default for AreaQueue {
    fn default() -> Self {
        let row = [0.0; BATCH];
        Self {
            count: 0,
            ids: [NO_LIGHT; BATCH],
            shapes: ParallelogramRows::default(),
            emissions: EmissionRows::default(),
            views: ViewRows::default(),
            near: NearQueue {
                lanes: [0; BATCH],
                u: [row; 2],
                shapes: ParallelogramRows::default(),
                points: NearRows::default(),
                views: ViewRows::default(),
            },
        }
    }
}

impl NearQueue {
    /// Replaces the samples of those vertices.
    fn sample(
        &mut self,
        shapes: &ParallelogramRows,
        queries: &LightQueries,
        views: &mut ViewRows,
        target_p: &mut DVec3Rows,
    ) {
        let Self { lanes, u, shapes: near_shapes, points, views: near_views } = self;
        let mut near = 0;
        for lane in (0..queries.count.min(BATCH)).filter(|&lane| views.is_near[lane] != 0.0) {
            let i = near % BATCH;
            let (p, [s, t]) = queries.get(lane);
            lanes[i] = lane as u32;
            (u[0][i], u[1][i]) = (s, t);
            near_shapes.set(i, &shapes.get(lane));
            points.p.set(i, p);
            points.q.set(i, target_p.get(lane));
            near_views.set(i, &views.get(lane));
            near += 1;
        }
        if near > 0 {
            vectorize!(sample_by_solid_angle(near_shapes, u, points, near_views, near));
            for (i, &lane) in lanes[..near].iter().enumerate() {
                let lane = lane as usize % BATCH;
                target_p.set(lane, points.q.get(i));
                views.set(lane, &near_views.get(i));
            }
        }
    }
}

impl AreaQueue {
    /// Forgets the lights of another scene.
    pub fn reset(&mut self) {
        self.ids = [NO_LIGHT; BATCH];
    }

    /// Queues the samples of parallelograms for vertices, in place of those before.
    pub fn queue(&mut self, lights: &LightSet, lanes: &[u8], ids: &Row<u32>) {
        self.count = lanes.len();
        self.emissions.is_queued = [0; BATCH];
        for lane in lanes.iter().map(|&lane| usize::from(lane)) {
            self.emissions.is_queued[lane] = 1;
            let id = ids[lane];
            if self.ids[lane] == id {
                continue;
            }
            if let Light::Area(AreaLight { emission, form: EmitterShape::Parallelogram(quad), .. }) =
                lights.get(LightId(id))
            {
                self.ids[lane] = id;
                self.emissions.radiance.set(lane, emission.radiance);
                (self.emissions.error[lane], self.emissions.two_sided[lane]) =
                    (quad.error, u32::from(emission.two_sided));
                self.shapes.set(lane, &quad.shape);
            }
        }
    }

    /// Samples all lights. Samples and targets of vertices that are not queued are overwritten, with no sample.
    pub fn sample(
        &mut self,
        queries: &LightQueries,
        pmfs: &Row,
        samples: &mut LightSampleRows,
        target_p: &mut DVec3Rows,
    ) {
        let Self { count, shapes, emissions, views, near, .. } = self;
        if *count == 0 {
            samples.target = [light_target::NONE; BATCH];
            return;
        }
        vectorize!(sample_by_area(shapes, emissions, queries, views, target_p));
        near.sample(shapes, queries, views, target_p);
        vectorize!(set_samples(shapes, emissions, views, pmfs, samples, queries.count));
    }
}

#[inline(always)]
fn sample_by_area(
    shapes: &ParallelogramRows,
    emissions: &EmissionRows,
    queries: &LightQueries,
    views: &mut ViewRows,
    target_p: &mut DVec3Rows,
) {
    for i in 0..whole_vectors(queries.count) {
        let [_, s, t, _] = queries.u.of(i);
        let (sample, is_near) =
            shapes.get(i).sample_by_area(&queries.light_context(i), [s, t], emissions.two_sided[i] != 0);
        target_p.set(i, sample.q);
        views.wi.set(i, sample.wi);
        views.pdf[i] = sample.pdf;
        views.is_near[i] = if is_near & (emissions.is_queued[i] != 0) { 1.0 } else { 0.0 };
    }
}

#[inline(always)]
fn sample_by_solid_angle(
    shapes: &ParallelogramRows,
    u: &[Row; 2],
    points: &mut NearRows,
    views: &mut ViewRows,
    count: usize,
) {
    for i in 0..whole_vectors(count) {
        let (p, q) = (points.p.get(i), points.q.get(i));
        let View { wi, pdf, .. } = views.get(i);
        let sample = shapes.get(i).sample_by_solid_angle(p, pair(u, i), &ParallelogramSample { q, wi, pdf });
        points.q.set(i, sample.q);
        views.wi.set(i, sample.wi);
        views.pdf[i] = sample.pdf;
    }
}

#[inline(always)]
fn set_samples(
    shapes: &ParallelogramRows,
    emissions: &EmissionRows,
    views: &ViewRows,
    pmfs: &Row,
    samples: &mut LightSampleRows,
    count: usize,
) {
    for i in 0..whole_vectors(count) {
        let pdf = views.pdf[i] as f32;
        let is_sampled = (emissions.is_queued[i] != 0) & (pdf > 0.0);
        samples.target[i] = if is_sampled { light_target::POINT } else { light_target::NONE };
        samples.is_delta[i] = 0;
        samples.direction.set(i, views.wi.get(i).as_vec3());
        samples.radiance.set(i, emissions.radiance.get(i));
        samples.pdf[i] = pdf * <f32 as Element>::get(pmfs, i);
        samples.target_n.set(i, shapes.normal.get(i).as_vec3());
        samples.target_error[i] = emissions.error[i];
    }
}
