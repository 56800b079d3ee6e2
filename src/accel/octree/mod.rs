//! An octree: cells halved along all three axes, items in every cell that they touch.
//!
//! Nodes keep the bounds of what lies in their cell rather than the cell, and are visited in the order in which the ray
//! meets the cells, so that a hit ends the search as soon as no nearer node is left.

use arrayvec::ArrayVec;

use super::inspect::{Item, NodeInfo};
use super::tree::{Counter, Items, Query, SlabRay, Tree};
use crate::math::{Aabb, Vec3};

/// A cell with no more items is a leaf.
const LEAF: usize = 8;

/// Cells are not split deeper.
const MAX_DEPTH: u32 = 20;

/// The references that a tree may have for each item, on average.
const BUDGET: f64 = 16.0;

/// Seven siblings wait on each level.
const STACK: usize = 8 * (MAX_DEPTH as usize + 1);

#[derive(Clone, Copy, Debug)]
struct Node {
    bounds: Aabb,
    /// Of a leaf its first reference, of an inner node its first child.
    first: u32,
    /// Of a leaf how many references it has; of an inner node which octants exist, in the highest eight bits.
    link: u32,
}

const INNER: u32 = 1 << 31;

impl Node {
    fn is_inner(&self) -> bool {
        self.link & INNER != 0
    }

    /// Bit `i` for octant `i`, whose bit `axis` is set on the upper side.
    fn octants(&self) -> u32 {
        self.link & 0xff
    }
}

/// The tree.
pub(super) struct Octree {
    nodes: Vec<Node>,
    items: Vec<Item>,
}

/// A cell on its way into the tree.
struct Cell {
    /// Where its node is.
    node: usize,
    bounds: Aabb,
    /// Indices of items, with the bounds of their parts in the cell.
    parts: Vec<(u32, Aabb)>,
    depth: u32,
    /// References that it may end up with.
    budget: f64,
}

impl Tree for Octree {
    type Options = ();

    fn build(items: &Items<'_>, (): &()) -> Self {
        let bounds = items.all_bounds();
        let mut tree = Self { nodes: vec![Node { bounds, first: 0, link: 0 }], items: Vec::new() };
        let parts = items.bounds.iter().zip(0..).map(|(&bounds, index)| (index, bounds)).collect();
        let mut open = vec![Cell { node: 0, bounds, parts, depth: 0, budget: BUDGET * items.len() as f64 }];
        while let Some(cell) = open.pop() {
            tree.add(items, cell, &mut open);
        }
        tree.nodes.shrink_to_fit();
        tree.items.shrink_to_fit();
        tree
    }

    #[inline]
    fn traverse<C: Counter, const ANY: bool>(&self, query: &mut Query<'_, Self, C, ANY>) {
        let slab = SlabRay::new(&query.ray, &self.nodes[0].bounds, query.slack());
        let t_min = query.ray.t_min;
        // The octant that a ray meets first has its bit set on the axes along which the ray runs down.
        let first_octant = slab.negative;
        let mut stack = ArrayVec::<(f32, u32), STACK>::new();
        if slab.interval(&self.nodes[0].bounds, t_min, query.t_max()).is_some() {
            stack.push((t_min, 0));
        }
        while let Some((near, index)) = stack.pop() {
            if near > query.t_max() {
                continue;
            }
            query.counter.nodes(1);
            let node = &self.nodes[index as usize];
            if !node.is_inner() {
                let items = &self.items[node.first as usize..(node.first + node.link) as usize];
                if items.iter().any(|&item| query.test(item)) {
                    return;
                }
                continue;
            }
            // Farthest first onto the stack: octants in the order of the ray, backwards.
            let octants = node.octants();
            for k in (0..8).rev() {
                let octant = k ^ first_octant;
                if octants >> octant & 1 == 0 {
                    continue;
                }
                let child = node.first + (octants & ((1 << octant) - 1)).count_ones();
                if let Some((near, _)) = slab.interval(&self.nodes[child as usize].bounds, t_min, query.t_max()) {
                    stack.push((near, child));
                }
            }
        }
    }

    fn bounds(&self) -> Aabb {
        self.nodes[0].bounds
    }

    fn memory_bytes(&self) -> usize {
        size_of_val(self.nodes.as_slice()) + size_of_val(self.items.as_slice())
    }

    fn visit_nodes(&self, visit: &mut dyn FnMut(&NodeInfo)) {
        let mut open = vec![(0, 0)];
        while let Some((index, depth)) = open.pop() {
            let node: &Node = &self.nodes[index as usize];
            if node.is_inner() {
                let children = node.octants().count_ones();
                visit(&NodeInfo { bounds: node.bounds, depth, children, items: &[] });
                open.extend((0..children).rev().map(|i| (node.first + i, depth + 1)));
            } else {
                let items = &self.items[node.first as usize..(node.first + node.link) as usize];
                visit(&NodeInfo { bounds: node.bounds, depth, children: 0, items });
            }
        }
    }

    fn description(&self) -> String {
        "octree, scalar".into()
    }
}

impl Octree {
    /// Makes the cell a leaf, or splits it and leaves its children to be done.
    fn add(&mut self, items: &Items<'_>, cell: Cell, open: &mut Vec<Cell>) {
        let Some(children) = split(items, &cell) else {
            let first = self.items.len() as u32;
            self.items.extend(cell.parts.iter().map(|(index, _)| items.list[*index as usize]));
            (self.nodes[cell.node].first, self.nodes[cell.node].link) = (first, cell.parts.len() as u32);
            return;
        };
        let total: usize = children.iter().map(|(_, child)| child.parts.len()).sum();
        let first = self.nodes.len();
        let mut octants = 0;
        for (octant, mut child) in children {
            octants |= 1 << octant;
            child.budget = cell.budget * child.parts.len() as f64 / total as f64;
            child.node = self.nodes.len();
            let bounds = child.parts.iter().fold(Aabb::EMPTY, |all, (_, b)| all.union(b));
            self.nodes.push(Node { bounds, first: 0, link: 0 });
            open.push(child);
        }
        (self.nodes[cell.node].first, self.nodes[cell.node].link) = (first as u32, INNER | octants);
    }
}

/// The octants that hold something; `None` if the cell is better a leaf.
fn split(items: &Items<'_>, cell: &Cell) -> Option<Vec<(u32, Cell)>> {
    if cell.parts.len() <= LEAF || cell.depth >= MAX_DEPTH {
        return None;
    }
    let middle = cell.bounds.center();
    // Between some numbers there is no other.
    let halves = middle.cmpgt(cell.bounds.min).any() && middle.cmplt(cell.bounds.max).any();
    if !halves {
        return None;
    }
    let mut children = Vec::new();
    let mut total = 0;
    for octant in 0..8u32 {
        let upper = glam::BVec3::new(octant & 1 != 0, octant & 2 != 0, octant & 4 != 0);
        let bounds = Aabb {
            min: Vec3::select(upper, middle, cell.bounds.min),
            max: Vec3::select(upper, cell.bounds.max, middle),
        };
        let part = |(index, part): &(u32, Aabb)| {
            // Most parts lie on one side; of the others, many only in the corner of their box.
            let near = part.min.cmple(bounds.max).all() && bounds.min.cmple(part.max).all();
            if !near || !items.overlaps(*index as usize, &bounds) {
                return None;
            }
            let part = items.clipped_bounds(*index as usize, &bounds);
            (!part.is_empty()).then_some((*index, part))
        };
        let parts: Vec<_> = cell.parts.iter().filter_map(part).collect();
        total += parts.len();
        if !parts.is_empty() {
            children.push((octant, Cell { node: 0, bounds, parts, depth: cell.depth + 1, budget: 0.0 }));
        }
    }
    // A split is useless if all octants hold nearly everything.
    let pays = total as f64 <= cell.budget && (children.len() == 1 || total < 6 * cell.parts.len());
    pays.then_some(children)
}
