//! Area lights that many vertices sample at once.

use super::AreaLight;
use super::parallelogram::{ParallelogramRows, ParallelogramSample};
use crate::color::Rgb;
use crate::geometry::SpawnPoint;
use crate::light::{LightChoice, LightSample, ShadowTarget};
use crate::math::rows::{BATCH, Element, Row, pair, soa};
use crate::math::vectorize::{Kernel, vectorize};
use crate::math::{DVec3, Vec3};

soa! {
    /// Points that sample lights, and the points sampled.
    struct PointRows of Point {
        p: DVec3,
        q: DVec3,
        wi: DVec3,
        pdf: f64,
        /// 1 where the sample is to be one by solid angle, else 0.
        is_near: f64,
    }
}

/// No light.
const NO_LIGHT: u32 = u32::MAX;

/// Vertices that sample parallelograms, at most [`BATCH`].
pub(in crate::light) struct AreaQueue {
    count: usize,
    lanes: Row<u32>,
    pmfs: Row,
    u: [Row; 2],
    radiance: [Rgb; BATCH],
    two_sided: Row<u32>,
    errors: Row,
    /// Ids of the lights in `shapes` and the rows before: most often they are there already.
    ids: Row<u32>,
    shapes: ParallelogramRows,
    points: PointRows,
    near: NearQueue,
}

/// Those of the vertices that sample by solid angle.
struct NearQueue {
    places: Row<u32>,
    u: [Row; 2],
    shapes: ParallelogramRows,
    points: PointRows,
}

impl Default for AreaQueue {
    fn default() -> Self {
        let row = [0.0; BATCH];
        Self {
            count: 0,
            lanes: [0; BATCH],
            pmfs: row,
            u: [row; 2],
            radiance: [Rgb::BLACK; BATCH],
            two_sided: [0; BATCH],
            errors: row,
            ids: [NO_LIGHT; BATCH],
            shapes: ParallelogramRows::default(),
            points: PointRows::default(),
            near: NearQueue { places: [0; BATCH], u: [row; 2], shapes: ParallelogramRows::default(), points: PointRows::default() },
        }
    }
}

impl NearQueue {
    /// Replaces the samples of those vertices.
    #[inline(always)]
    fn sample(&mut self, shapes: &ParallelogramRows, u: &[Row; 2], points: &mut PointRows, count: usize) {
        let mut near = 0;
        for place in (0..count.min(BATCH)).filter(|&place| points.is_near[place] != 0.0) {
            let i = near % BATCH;
            self.places[i] = place as u32;
            (self.u[0][i], self.u[1][i]) = (u[0][place], u[1][place]);
            self.shapes.set(i, &shapes.get(place));
            self.points.set(i, &points.get(place));
            near += 1;
        }
        if near > 0 {
            vectorize(SampleBySolidAngle { shapes: &self.shapes, u: &self.u, points: &mut self.points, count: near });
            for (i, &place) in self.places[..near].iter().enumerate() {
                points.set(place as usize % BATCH, &self.points.get(i));
            }
        }
    }
}

impl AreaQueue {
    /// Forgets the lights of another scene.
    pub fn reset(&mut self) {
        self.ids = [NO_LIGHT; BATCH];
    }

    /// Empties the queue.
    pub fn clear(&mut self) {
        self.count = 0;
    }

    /// Queues the sample of a light, for the vertex `lane` at `p`; `false` if the light is to be sampled alone.
    #[inline(always)]
    pub fn push(&mut self, light: &AreaLight, choice: LightChoice, lane: usize, p: DVec3, u: [f32; 2]) -> bool {
        let Some(quad) = light.even_parallelogram() else { return false };
        let i = self.count;
        self.count += 1;
        (self.lanes[i], self.pmfs[i]) = (lane as u32, choice.pmf);
        (self.u[0][i], self.u[1][i]) = (u[0], u[1]);
        if self.ids[i] != choice.id.0 {
            self.ids[i] = choice.id.0;
            (self.radiance[i], self.errors[i]) = (light.emission.radiance, quad.error);
            self.two_sided[i] = u32::from(light.emission.two_sided);
            self.shapes.set(i, &quad.shape);
        }
        self.points.p.set(i, p);
        true
    }

    /// Samples all lights; `set` takes each sample with its vertex and the probability of the choice.
    #[inline(always)]
    pub fn sample(&mut self, mut set: impl FnMut(usize, &LightSample, f32)) {
        let Self { count, lanes, pmfs, u, radiance, two_sided, errors, shapes, points, near, .. } = self;
        if *count == 0 {
            return;
        }
        vectorize(SampleByArea { shapes, two_sided, u, points, count: *count });
        near.sample(shapes, u, points, *count);
        for i in 0..*count {
            let pdf = points.pdf[i] as f32;
            if pdf > 0.0 {
                let n: Vec3 = shapes.normal.get(i).as_vec3();
                let target = ShadowTarget::Point(SpawnPoint { p: points.q.get(i), n, error: errors[i] });
                let sample = LightSample { wi: points.wi.get(i).as_vec3(), radiance: radiance[i], pdf, is_delta: false, target };
                set(lanes[i] as usize, &sample, pmfs[i]);
            }
        }
    }
}

struct SampleByArea<'a> {
    shapes: &'a ParallelogramRows,
    two_sided: &'a Row<u32>,
    u: &'a [Row; 2],
    points: &'a mut PointRows,
    count: usize,
}

impl Kernel for SampleByArea<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        sample_by_area(self.shapes, self.two_sided, self.u, self.points, self.count);
    }
}

// Whole vectors, here and below: what is computed for vertices beyond the count is not used.
#[inline(always)]
fn sample_by_area(shapes: &ParallelogramRows, two_sided: &Row<u32>, u: &[Row; 2], points: &mut PointRows, count: usize) {
    for i in 0..count.next_multiple_of(16).min(BATCH) {
        let (sample, is_near) = shapes.get(i).sample_by_area(points.p.get(i), pair(u, i), <u32 as Element>::get(two_sided, i) != 0);
        points.q.set(i, sample.q);
        points.wi.set(i, sample.wi);
        points.pdf[i] = sample.pdf;
        points.is_near[i] = if is_near { 1.0 } else { 0.0 };
    }
}

struct SampleBySolidAngle<'a> {
    shapes: &'a ParallelogramRows,
    u: &'a [Row; 2],
    points: &'a mut PointRows,
    count: usize,
}

impl Kernel for SampleBySolidAngle<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        sample_by_solid_angle(self.shapes, self.u, self.points, self.count);
    }
}

#[inline(always)]
fn sample_by_solid_angle(shapes: &ParallelogramRows, u: &[Row; 2], points: &mut PointRows, count: usize) {
    for i in 0..count.next_multiple_of(16).min(BATCH) {
        let Point { p, q, wi, pdf, .. } = points.get(i);
        let sample = shapes.get(i).sample_by_solid_angle(p, pair(u, i), &ParallelogramSample { q, wi, pdf });
        points.q.set(i, sample.q);
        points.wi.set(i, sample.wi);
        points.pdf[i] = sample.pdf;
    }
}
