//! The octree: one leaf with everything.

use super::inspect::{Item, NodeInfo};
use super::tree::{Counter, Items, Query, SlabRay, Tree};
use crate::math::Aabb;

/// The tree.
pub(super) struct Octree {
    items: Vec<Item>,
    bounds: Aabb,
}

impl Tree for Octree {
    type Options = ();

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
        "octree".into()
    }
}
