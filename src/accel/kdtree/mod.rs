//! A kd-tree: planes that separate space, items in every cell that they touch.

mod build;

use arrayvec::ArrayVec;

use super::inspect::{Item, NodeInfo};
use super::tree::{Counter, Items, Query, SlabRay, Tree};
use crate::math::Aabb;
use build::MAX_DEPTH;

/// How a kd-tree is built.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct KdTreeOptions {
    /// Split in the middle of the longest axis in place of the surface area heuristic.
    pub median: bool,
}

/// A node in eight bytes.
#[derive(Clone, Copy, Debug)]
struct Node {
    /// Of an inner node the plane; of a leaf the number of references, as bits.
    split: f32,
    /// In the lowest two bits the axis, 3 on a leaf; above them the upper child of an inner node (the lower one follows
    /// it), or the first reference of a leaf.
    link: u32,
}

const LEAF: u32 = 3;

impl Node {
    fn inner(axis: usize, split: f32, upper: usize) -> Self {
        Self { split, link: (upper as u32) << 2 | axis as u32 }
    }

    fn leaf(first: usize, count: usize) -> Self {
        Self { split: f32::from_bits(count as u32), link: (first as u32) << 2 | LEAF }
    }

    #[inline(always)]
    fn axis(&self) -> u32 {
        self.link & 3
    }

    #[inline(always)]
    fn index(&self) -> u32 {
        self.link >> 2
    }
}

/// The tree.
pub(super) struct KdTree {
    nodes: Vec<Node>,
    items: Vec<Item>,
    bounds: Aabb,
    options: KdTreeOptions,
}

impl KdTree {
    fn leaf_items(&self, node: &Node) -> &[Item] {
        &self.items[node.index() as usize..][..node.split.to_bits() as usize]
    }
}

impl Tree for KdTree {
    type Options = KdTreeOptions;

    fn build(items: &Items<'_>, options: &KdTreeOptions) -> Self {
        let bounds = items.all_bounds();
        let (nodes, items) = build::build(items, &bounds, *options);
        Self { nodes, items, bounds, options: *options }
    }

    #[inline]
    fn traverse<C: Counter, const ANY: bool>(&self, query: &mut Query<'_, Self, C, ANY>) {
        let slab = SlabRay::new(&query.ray, &self.bounds, query.slack());
        let Some((mut enter, mut leave)) = slab.interval(&self.bounds, query.ray.t_min, query.t_max()) else { return };
        let mut stack = ArrayVec::<(u32, f32, f32), { MAX_DEPTH as usize + 1 }>::new();
        let mut index = 0;
        loop {
            query.counter.nodes(1);
            let node = &self.nodes[index as usize];
            let axis = node.axis();
            if axis != LEAF {
                // Beyond the plane begins at the near distance at the earliest; before it ends at the far distance at
                // the latest. A far distance that is not a number belongs to a ray within the plane, which sees both
                // sides.
                let axis = axis as usize;
                let begin = (node.split - slab.near_origin[axis]) * slab.near_reciprocal[axis];
                let end = (node.split - slab.far_origin[axis]) * slab.far_reciprocal[axis];
                let (lower, upper) = (index + 1, node.index());
                let (first, second) = if slab.is_negative(axis) { (upper, lower) } else { (lower, upper) };
                if begin > leave {
                    index = first;
                } else if end < enter {
                    index = second;
                } else {
                    stack.push((second, if begin > enter { begin } else { enter }, leave));
                    leave = if end < leave { end } else { leave };
                    index = first;
                }
                continue;
            }
            if self.leaf_items(node).iter().any(|&item| query.test(item)) {
                return;
            }
            loop {
                let Some(next) = stack.pop() else { return };
                (index, enter, leave) = next;
                // A hit may lie beyond its cell, so the interval is cut here, not at the leaf.
                if enter <= query.t_max() {
                    break;
                }
            }
        }
    }

    fn bounds(&self) -> Aabb {
        self.bounds
    }

    fn memory_bytes(&self) -> usize {
        size_of_val(self.nodes.as_slice()) + size_of_val(self.items.as_slice())
    }

    fn visit_nodes(&self, visit: &mut dyn FnMut(&NodeInfo)) {
        let mut open = vec![(0u32, self.bounds, 0)];
        while let Some((index, bounds, depth)) = open.pop() {
            let node = &self.nodes[index as usize];
            if node.axis() == LEAF {
                visit(&NodeInfo { bounds, depth, children: 0, items: self.leaf_items(node) });
                continue;
            }
            visit(&NodeInfo { bounds, depth, children: 2, items: &[] });
            let (mut lower, mut upper) = (bounds, bounds);
            lower.max[node.axis() as usize] = node.split;
            upper.min[node.axis() as usize] = node.split;
            open.extend([(node.index(), upper, depth + 1), (index + 1, lower, depth + 1)]);
        }
    }

    fn description(&self) -> String {
        let how = if self.options.median { "split in the middle" } else { "surface area heuristic" };
        format!("kd-tree, {how}, scalar")
    }
}
