//! An accelerator whose calls are observed.

use crate::accel::{Accelerator, AnyHitRays, Coherence, HitRows};
use crate::geometry::Hit;
use crate::id::ShapeId;
use crate::math::rows::BATCH;
use crate::math::{Aabb, Ray, RayRows};

/// The rays of one call.
pub struct Call<'a> {
    pub rays: &'a [Ray],
    /// Whether the query is for any hit, not for the closest.
    pub any_hit: bool,
    /// How coherent a batch is; `None` for a single ray.
    pub coherence: Option<Coherence>,
}

/// What is done about calls.
pub trait Observer: Send + Sync {
    /// Calls `trace` once, which traces the rays.
    fn observe(&self, call: &Call, trace: &mut dyn FnMut());

    /// Takes the number of hits of a call.
    fn count(&self, _hits: usize) {}
}

/// An accelerator and what observes it.
pub struct Observed<'a, O> {
    pub inner: &'a dyn Accelerator,
    pub observer: O,
}

impl<O: Observer> Accelerator for Observed<'_, O> {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        let mut hit = None;
        let call = Call { rays: std::slice::from_ref(ray), any_hit: false, coherence: None };
        self.observer.observe(&call, &mut || hit = self.inner.intersect(ray));
        self.observer.count(usize::from(hit.is_some()));
        hit
    }

    fn occluded(&self, ray: &Ray) -> bool {
        let mut hit = false;
        let call = Call { rays: std::slice::from_ref(ray), any_hit: true, coherence: None };
        self.observer.observe(&call, &mut || hit = self.inner.occluded(ray));
        self.observer.count(usize::from(hit));
        hit
    }

    fn intersect_rows(&self, rays: &RayRows, count: usize, hits: &mut HitRows, coherence: Coherence) {
        let listed: Vec<Ray> = (0..count).map(|lane| rays.get(lane)).collect();
        let call = Call { rays: &listed, any_hit: false, coherence: Some(coherence) };
        self.observer.observe(&call, &mut || self.inner.intersect_rows(rays, count, hits, coherence));
        self.observer.count(hits.shape[..count].iter().filter(|shape| **shape != HitRows::MISS).count());
    }

    fn occluded_rows(&self, rays: AnyHitRays, occluded: &mut [bool; BATCH], coherence: Coherence) {
        let listed: Vec<Ray> = (0..rays.count).map(|lane| rays.rays.get(lane)).collect();
        let call = Call { rays: &listed, any_hit: true, coherence: Some(coherence) };
        self.observer.observe(&call, &mut || self.inner.occluded_rows(rays, occluded, coherence));
        self.observer.count(occluded[..rays.count].iter().filter(|hit| **hit).count());
    }

    fn skips_end_shape(&self, shape: ShapeId) -> bool {
        self.inner.skips_end_shape(shape)
    }

    fn bounds(&self) -> Aabb {
        self.inner.bounds()
    }

    fn memory_bytes(&self) -> usize {
        self.inner.memory_bytes()
    }

    fn description(&self) -> String {
        self.inner.description()
    }
}
