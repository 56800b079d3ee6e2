//! The bvh: one leaf with everything.

use super::inspect::{Item, NodeInfo};
use super::tree::{Counter, Items, Query, SlabRay, Tree};
use crate::math::Aabb;

/// How a BVH is built and traced.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BvhOptions {
    /// Triangles may be split between nodes.
    pub spatial_splits: bool,
    /// Two boxes a node, without SIMD.
    pub binary: bool,
}

/// The tree.
pub(super) struct Bvh {
    items: Vec<Item>,
    bounds: Aabb,
}

impl Tree for Bvh {
    type Options = BvhOptions;

    fn build(items: &Items<'_>, _: &Self::Options) -> Self {
        Self { items: items.list.clone(), bounds: items.all_bounds() }
    }

    fn traverse<C: Counter, const ANY: bool>(&self, query: &mut Query<'_, Self, C, ANY>) {
        query.counter.nodes(1);
        let slab = SlabRay::new(&query.ray, &self.bounds, query.slack());
        if slab.interval(&self.bounds, query.ray.t_min, query.t_max()).is_some() {
            let _ = self.items.iter().any(|&item| query.test(item));
        }
    }

    fn bounds(&self) -> Aabb {
        self.bounds
    }

    fn memory_bytes(&self) -> usize {
        size_of_val(self.items.as_slice())
    }

    fn visit_nodes(&self, visit: &mut dyn FnMut(&NodeInfo)) {
        visit(&NodeInfo { bounds: self.bounds, depth: 0, children: 0, items: &self.items });
    }

    fn description(&self) -> String {
        "bvh".into()
    }
}
