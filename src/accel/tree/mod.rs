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
pub(super) use query::{Counter, NotCounted, Query};
pub(super) use slab::SlabRay;
pub(super) use two_level::TwoLevel;

use super::inspect::NodeInfo;
use crate::math::Aabb;

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

    /// Bounds of all items; empty if there is none.
    fn bounds(&self) -> Aabb;

    /// Bytes the tree holds.
    fn memory_bytes(&self) -> usize;

    /// Calls `visit` for every node, parents before children.
    fn visit_nodes(&self, visit: &mut dyn FnMut(&NodeInfo));

    /// Name with options and instruction set.
    fn description(&self) -> String;
}
