//! Accelerators: closest-hit and any-hit queries. They work on bounds, counts and ids, without materials.

mod bvh;
mod embree;
mod hybrid;
pub mod inspect;
mod kdtree;
mod kind;
mod linear;
mod octree;
mod packet;
mod rows;
mod tree;

pub use bvh::BvhOptions;
pub use embree::EmbreeReplay;
pub use embree::Registered;
pub use embree::{EmbreeAccel, EmbreeInfo, EmbreeOptions, EmbreeQuality, on_uncaught_exception};
pub use hybrid::{HybridAccel, HybridOptions};
pub use kdtree::KdTreeOptions;
pub use kind::{AccelKind, UnknownAccel, build};
pub use linear::LinearAccel;
pub use packet::PacketBvh;
pub use rows::{AnyHitRays, HitRows};

use crate::geometry::Hit;
use crate::id::ShapeId;
use crate::math::rows::BATCH;
use crate::math::{Aabb, Ray, RayRows};
use inspect::Inspect;

/// Which rays of a batch belong together, so that an accelerator may trace them side by side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coherence {
    /// Every run of 16 rays starts at nearly one point and points nearly one way: camera rays of a pixel block, or
    /// shadow rays from there to a small light. A wrong hint costs more than it saves.
    Coherent,
    /// Nothing is known.
    Incoherent,
}

/// Ray queries on a fixed geometry.
///
/// All entry points accept any ray: one that is not [valid](Ray::is_valid) hits nothing. The result for a ray of a
/// batch may depend, within rounding, on the other rays of its run of 16 (such as which of two triangles a ray through
/// their common edge hits); that of a single ray depends on nothing else.
pub trait Accelerator: Send + Sync {
    /// The closest hit within the ray's interval.
    fn intersect(&self, ray: &Ray) -> Option<Hit>;

    /// Whether there is any hit within the ray's interval.
    fn occluded(&self, ray: &Ray) -> bool;

    /// [`intersect`](Self::intersect) for the first `count` rays, at most [`BATCH`]. The distances to analytic shapes
    /// may be lower bounds, within 2^-10 of the distance of the ray's origin and the world's from the shape: a hit is
    /// resolved from the shape and the ray.
    fn intersect_rows(&self, rays: &RayRows, count: usize, hits: &mut HitRows, coherence: Coherence) {
        let _ = coherence;
        for lane in 0..count.min(BATCH) {
            hits.set(lane, self.intersect(&rays.get(lane)));
        }
    }

    /// [`occluded`](Self::occluded) for the rays of a batch.
    fn occluded_rows(&self, rays: AnyHitRays, occluded: &mut [bool; BATCH], coherence: Coherence) {
        let _ = coherence;
        for (lane, occluded) in occluded.iter_mut().enumerate().take(rays.count) {
            *occluded = self.occluded(&rays.rays.get(lane));
        }
    }

    /// Whether [`occluded_rows`](Self::occluded_rows) skips this shape as an [end shape](AnyHitRays::end_shapes).
    fn skips_end_shape(&self, shape: ShapeId) -> bool {
        let _ = shape;
        false
    }

    /// [`intersect`](Self::intersect) for each ray, in order, in rows. `hits` is as long as `rays`.
    fn intersect_batch(&self, rays: &[Ray], hits: &mut [Option<Hit>], coherence: Coherence) {
        intersect_in_rows(self, rays, hits, coherence);
    }

    /// [`occluded`](Self::occluded) for each ray, in order, in rows. `occluded` is as long as `rays`.
    fn occluded_batch(&self, rays: &[Ray], occluded: &mut [bool], coherence: Coherence) {
        let mut found = [false; BATCH];
        for (rays, occluded) in rays.chunks(BATCH).zip(occluded.chunks_mut(BATCH)) {
            self.occluded_rows(AnyHitRays::new(&RayRows::of(rays), rays.len()), &mut found, coherence);
            occluded.copy_from_slice(&found[..occluded.len()]);
        }
    }

    /// Bounds of all geometry; empty if there is none.
    fn bounds(&self) -> Aabb;

    /// Bytes the accelerator holds beside the geometry.
    fn memory_bytes(&self) -> usize;

    /// Name and version of what traces, with its instruction set, for statistics.
    fn description(&self) -> String;

    /// The structure and the work of single rays, where they are open.
    fn inspect(&self) -> Option<&dyn Inspect> {
        None
    }
}

/// [`Accelerator::intersect_rows`] for any number of rays.
fn intersect_in_rows<A: Accelerator + ?Sized>(accel: &A, rays: &[Ray], hits: &mut [Option<Hit>], coherence: Coherence) {
    let mut found = HitRows::default();
    for (rays, hits) in rays.chunks(BATCH).zip(hits.chunks_mut(BATCH)) {
        accel.intersect_rows(&RayRows::of(rays), rays.len(), &mut found, coherence);
        hits.iter_mut().enumerate().for_each(|(lane, hit)| *hit = found.get(lane));
    }
}
