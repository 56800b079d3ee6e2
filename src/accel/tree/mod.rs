//! What the octree, the kd-tree and the BVH have in common: the items they are built over, the query that visits them,
//! conservative slabs, and instances as a second level.

mod clip;
mod items;
mod query;
mod slab;
#[cfg(test)]
pub(super) mod testing;
mod two_level;

pub(super) use items::Items;
pub(super) use query::{Counter, NotCounted, Query, t_max_after};
pub(super) use slab::{SlabRay, SlabRows};
pub(super) use two_level::TwoLevel;

use super::inspect::NodeInfo;
use super::{Coherence, HitRows};
use crate::geometry::Hit;
use crate::math::rows::{BATCH, Row};
use crate::math::{Aabb, RayRows};

/// Where the answers to the rays of a batch go.
pub(super) trait Answers {
    /// The closest hit of a lane so far.
    fn get(&self, lane: usize) -> Option<Hit>;

    /// Sets the hit of a lane.
    fn set(&mut self, lane: usize, hit: Option<Hit>);
}

impl Answers for HitRows {
    #[inline(always)]
    fn get(&self, lane: usize) -> Option<Hit> {
        Self::get(self, lane)
    }

    #[inline(always)]
    fn set(&mut self, lane: usize, hit: Option<Hit>) {
        Self::set(self, lane, hit);
    }
}

/// Whether there are hits.
impl Answers for [bool; BATCH] {
    #[inline(always)]
    fn get(&self, _: usize) -> Option<Hit> {
        None
    }

    #[inline(always)]
    fn set(&mut self, lane: usize, hit: Option<Hit>) {
        self[lane] = hit.is_some();
    }
}

/// Rays to be traced.
pub(super) struct Batch<'r, 'a, T> {
    pub accel: &'r TwoLevel<'a, T>,
    pub rays: &'r RayRows,
    pub count: usize,
    /// As [`AnyHitRays::end_shapes`](super::AnyHitRays::end_shapes).
    pub end_shapes: Option<&'r Row<u32>>,
}

/// A tree over items.
pub(super) trait Tree: Send + Sync + Sized {
    /// What can be chosen.
    type Options: Sync;

    /// Builds the tree. It must end for any finite input, with a bounded depth and with memory of the order of the
    /// number of items.
    fn build(items: &Items<'_>, options: &Self::Options) -> Self;

    /// Visits every item that the query's ray may hit within its interval, nearer ones first as far as the bounds show,
    /// until a visit returns true. An item may be visited twice.
    fn traverse<C: Counter, const ANY: bool>(&self, query: &mut Query<'_, Self, C, ANY>);

    /// Whether [`trace_rows`](Self::trace_rows) skips [end shapes](super::AnyHitRays::end_shapes).
    const SKIPS_END_SHAPES: bool = false;

    /// Answers rays, or whether there are `ANY` hits.
    fn trace_rows<const ANY: bool>(batch: &Batch<'_, '_, Self>, answers: &mut impl Answers, _: Coherence) {
        batch.trace_one_by_one::<ANY>(answers);
    }

    /// Bounds of all items; empty if there is none.
    fn bounds(&self) -> Aabb;

    /// A few boxes that together hold all items, so that those around instances, which are turned, are small.
    fn cover(&self) -> Vec<Aabb> {
        vec![self.bounds()]
    }

    /// Bytes the tree holds.
    fn memory_bytes(&self) -> usize;

    /// Calls `visit` for every node, parents before children.
    fn visit_nodes(&self, visit: &mut dyn FnMut(&NodeInfo));

    /// Name with options and instruction set.
    fn description(&self) -> String;
}
