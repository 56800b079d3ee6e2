//! Rays through the binary hierarchy, one box at a time, as in textbooks.

use arrayvec::ArrayVec;

use super::Bvh;
use super::build::{Binary, BinaryKind, BinaryNode};
use crate::accel::inspect::{Item, NodeInfo};
use crate::accel::tree::{Counter, Items, Query, SlabRay};
use crate::math::Aabb;

/// More levels than the builder makes.
const STACK: usize = 128;

/// The binary hierarchy with its items.
pub(super) struct BinaryTree {
    nodes: Vec<BinaryNode>,
    items: Vec<Item>,
}

impl BinaryTree {
    pub fn new(binary: Binary, items: &Items<'_>) -> Self {
        let list = binary.references.iter().map(|r| items.list[r.item as usize]).collect();
        Self { nodes: binary.nodes, items: list }
    }

    pub fn bounds(&self) -> Aabb {
        self.nodes[0].bounds
    }

    pub fn memory_bytes(&self) -> usize {
        size_of_val(self.nodes.as_slice()) + size_of_val(self.items.as_slice())
    }

    pub fn traverse<C: Counter, const ANY: bool>(&self, query: &mut Query<'_, Bvh, C, ANY>) {
        let slab = SlabRay::new(&query.ray, &self.bounds(), query.slack());
        let t_min = query.ray.t_min;
        let enter =
            |index: usize, t_max: f32| slab.interval(&self.nodes[index].bounds, t_min, t_max).map(|(near, _)| near);
        let mut stack = ArrayVec::<(f32, usize), STACK>::new();
        let Some(near) = enter(0, query.t_max()) else { return };
        stack.push((near, 0));
        while let Some((near, index)) = stack.pop() {
            if near > query.t_max() {
                continue;
            }
            query.counter.nodes(1);
            let children = match self.nodes[index].kind() {
                BinaryKind::Leaf(range) => {
                    if self.items[range].iter().any(|&item| query.test(item)) {
                        return;
                    }
                    continue;
                }
                BinaryKind::Inner(children) => children.map(|child| (enter(child, query.t_max()), child)),
            };
            match children {
                [(Some(a), left), (Some(b), right)] if a <= b => stack.extend([(b, right), (a, left)]),
                [(Some(a), left), (Some(b), right)] => stack.extend([(a, left), (b, right)]),
                [(Some(near), child), _] | [_, (Some(near), child)] => stack.push((near, child)),
                [(None, _), (None, _)] => {}
            }
        }
    }

    pub fn visit_nodes(&self, visit: &mut dyn FnMut(&NodeInfo)) {
        let mut open = vec![(0, 0)];
        while let Some((index, depth)) = open.pop() {
            let node = &self.nodes[index];
            match node.kind() {
                BinaryKind::Leaf(range) => {
                    visit(&NodeInfo { bounds: node.bounds, depth, children: 0, items: &self.items[range] });
                }
                BinaryKind::Inner([first, second]) => {
                    visit(&NodeInfo { bounds: node.bounds, depth, children: 2, items: &[] });
                    open.extend([(second, depth + 1), (first, depth + 1)]);
                }
            }
        }
    }
}
