//! An accelerator whose calls are observed.

use crate::accel::{Accelerator, Coherence};
use crate::geometry::Hit;
use crate::math::{Aabb, Ray};

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

    fn intersect_batch(&self, rays: &[Ray], hits: &mut [Option<Hit>], coherence: Coherence) {
        let call = Call { rays, any_hit: false, coherence: Some(coherence) };
        self.observer.observe(&call, &mut || self.inner.intersect_batch(rays, hits, coherence));
        self.observer.count(hits.iter().take(rays.len()).flatten().count());
    }

    fn occluded_batch(&self, rays: &[Ray], occluded: &mut [bool], coherence: Coherence) {
        let call = Call { rays, any_hit: true, coherence: Some(coherence) };
        self.observer.observe(&call, &mut || self.inner.occluded_batch(rays, occluded, coherence));
        self.observer.count(occluded.iter().take(rays.len()).filter(|hit| **hit).count());
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
