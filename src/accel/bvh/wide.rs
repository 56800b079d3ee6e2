//! The wide hierarchy: eight boxes a node, triangles in blocks.

use super::build::{BLOCK, Binary};
use super::collapse::Collapse;
use crate::accel::inspect::Item;
use crate::accel::tree::Items;
use crate::math::Aabb;

/// Children of a node.
pub(super) const WIDTH: usize = 8;

/// The most entries that wait on the stack: seven a level.
pub(super) const STACK: usize = 256;

/// A reference to a child: an inner node, a run of triangle blocks, or a run of other items. On the stack of a ray also
/// the place where it leaves an instance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Child(u32);

/// A [`Child`] taken apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ChildKind {
    Node(u32),
    Blocks { first: u32, count: u32 },
    Items { first: u32, count: u32 },
    Leave,
}

impl Child {
    const INDEX_BITS: u32 = 27;
    const MAX_COUNT: u32 = 7;
    /// The first node.
    pub const ROOT: Self = Self(0);
    /// Behind an empty box, never opened.
    pub const NONE: Self = Self(u32::MAX);
    /// Where a ray leaves an instance.
    pub const LEAVE: Self = Self(3 << 30);

    /// Of each slot the number, in place of the child.
    pub const SLOTS: [Self; WIDTH] = [Self(0), Self(1), Self(2), Self(3), Self(4), Self(5), Self(6), Self(7)];

    fn node(index: usize) -> Self {
        Self(index as u32)
    }

    /// A run of triangle blocks.
    #[cfg(test)]
    pub fn blocks(first: usize, count: usize) -> Self {
        Self::run(1, first, count)
    }

    fn run(tag: u32, first: usize, count: usize) -> Self {
        debug_assert!(count as u32 <= Self::MAX_COUNT && first < 1 << Self::INDEX_BITS);
        Self(tag << 30 | (count as u32) << Self::INDEX_BITS | first as u32)
    }

    #[inline(always)]
    pub fn bits(self) -> u32 {
        self.0
    }

    #[inline(always)]
    pub fn is_node(self) -> bool {
        self.tag() == 0
    }

    /// 0 for a node, 1 for triangles, 2 for other items, 3 for [`LEAVE`](Self::LEAVE).
    #[inline(always)]
    pub fn tag(self) -> usize {
        (self.0 >> 30) as usize
    }

    /// The index of an inner node.
    #[inline(always)]
    pub fn node_index(self) -> usize {
        self.0 as usize
    }

    /// The first of a run.
    #[inline(always)]
    pub fn first(self) -> usize {
        (self.0 & ((1 << Self::INDEX_BITS) - 1)) as usize
    }

    /// The first block or item of a leaf, and how many it has.
    #[inline(always)]
    pub fn run_of_items(self) -> (usize, usize) {
        (self.first(), (self.0 >> Self::INDEX_BITS & Self::MAX_COUNT) as usize)
    }

    #[inline(always)]
    pub fn kind(self) -> ChildKind {
        let first = self.0 & ((1 << Self::INDEX_BITS) - 1);
        let count = self.0 >> Self::INDEX_BITS & Self::MAX_COUNT;
        match self.0 >> 30 {
            0 => ChildKind::Node(self.0),
            1 => ChildKind::Blocks { first, count },
            2 => ChildKind::Items { first, count },
            _ => ChildKind::Leave,
        }
    }
}

/// A child, and where a ray enters its box: in the low half the bits of the distance, in the high half the child.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(transparent)]
pub(super) struct Entry(pub u64);

impl Entry {
    pub const NONE: Self = Self::new(f32::INFINITY, Child::NONE);

    #[inline(always)]
    pub const fn new(near: f32, child: Child) -> Self {
        Self(near.to_bits() as u64 | (child.0 as u64) << 32)
    }

    #[inline(always)]
    pub fn near(self) -> f32 {
        f32::from_bits(self.0 as u32)
    }

    #[inline(always)]
    pub fn child(self) -> Child {
        Child((self.0 >> 32) as u32)
    }
}

/// Boxes of up to eight children. Unused ones are empty: no ray meets them.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct WideNode {
    /// For each axis the smallest, then the largest coordinates: row `2 axis + side`.
    pub planes: [[f32; WIDTH]; 6],
    pub children: [Child; WIDTH],
    /// Slots from far to near, three bits each, for rays of each octant: bit `axis` is set where they go down an axis.
    pub orders: [u32; 8],
}

impl WideNode {
    /// The order of the slots.
    pub const BY_SLOT: u32 = 0o76_543_210;

    pub const EMPTY: Self = {
        let (low, high) = ([f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]);
        Self { planes: [low, high, low, high, low, high], children: [Child::NONE; WIDTH], orders: [Self::BY_SLOT; 8] }
    };

    pub fn set(&mut self, slot: usize, bounds: &Aabb, child: Child) {
        for axis in 0..3 {
            self.planes[2 * axis][slot] = bounds.min[axis];
            self.planes[2 * axis + 1][slot] = bounds.max[axis];
        }
        self.children[slot] = child;
    }

    /// Sets the orders once all children are known: by the centers of their boxes.
    pub fn set_orders(&mut self) {
        for octant in 0..8 {
            let distance = |slot: &usize| -> f32 {
                let sign = |axis: usize| if octant >> axis & 1 != 0 { -1.0 } else { 1.0 };
                (0..3).map(|axis| sign(axis) * (self.planes[2 * axis][*slot] + self.planes[2 * axis + 1][*slot])).sum()
            };
            let mut slots = [0, 1, 2, 3, 4, 5, 6, 7];
            slots.sort_by(|a, b| distance(b).total_cmp(&distance(a)));
            self.orders[octant] = slots.iter().rev().fold(0, |order, slot| order << 3 | *slot as u32);
        }
    }

    /// The box and the child in a slot in use.
    pub fn get(&self, slot: usize) -> Option<(Aabb, Child)> {
        let side = |side: usize| [0, 1, 2].map(|axis| self.planes[2 * axis + side][slot]).into();
        (self.children[slot] != Child::NONE).then(|| (Aabb { min: side(0), max: side(1) }, self.children[slot]))
    }
}

/// Up to four triangles in lanes. Unused lanes repeat the first triangle under its own ids, which changes no result.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct Block {
    /// Coordinates by corner, then axis.
    pub corners: [[[f32; BLOCK]; 3]; 3],
    pub items: [Item; BLOCK],
    /// Lanes in use.
    pub count: u32,
}

/// The wide hierarchy.
pub(super) struct Wide {
    pub nodes: Vec<WideNode>,
    pub blocks: Vec<Block>,
    pub items: Vec<Item>,
    pub bounds: Aabb,
    /// Levels of nodes.
    pub depth: usize,
}

impl Wide {
    /// From a binary hierarchy.
    pub fn new(binary: &Binary, items: &Items<'_>) -> Self {
        let collapse = Collapse::new(binary, items);
        let mut wide =
            Self { nodes: Vec::new(), blocks: Vec::new(), items: Vec::new(), bounds: binary.nodes[0].bounds, depth: 0 };
        wide.nodes.reserve(binary.references.len() / 16 + 1);
        wide.blocks.reserve(binary.references.len() / 3 + 1);
        wide.nodes.push(WideNode::EMPTY);
        let mut open = vec![(0, 0, 1)];
        while let Some((source, target, depth)) = open.pop() {
            wide.depth = wide.depth.max(depth);
            for (slot, index) in collapse.children(source).into_iter().enumerate() {
                let child = if collapse.is_leaf(index) {
                    wide.leaf(&collapse.references(index), items)
                } else {
                    wide.nodes.push(WideNode::EMPTY);
                    open.push((index, wide.nodes.len() - 1, depth + 1));
                    Child::node(wide.nodes.len() - 1)
                };
                wide.nodes[target].set(slot, &binary.nodes[index].bounds, child);
            }
            wide.nodes[target].set_orders();
        }
        wide.nodes.shrink_to_fit();
        wide.blocks.shrink_to_fit();
        wide
    }

    fn leaf(&mut self, references: &[u32], items: &Items<'_>) -> Child {
        if items.triangle(references[0] as usize).is_none() {
            let first = self.items.len();
            self.items.extend(references.iter().map(|&item| items.list[item as usize]));
            return Child::run(2, first, references.len());
        }
        let first = self.blocks.len();
        for chunk in references.chunks(BLOCK) {
            let mut block = Block {
                corners: [[[0.0; BLOCK]; 3]; 3],
                items: [items.list[chunk[0] as usize]; BLOCK],
                count: chunk.len() as u32,
            };
            for lane in 0..BLOCK {
                let item = *chunk.get(lane).unwrap_or(&chunk[0]) as usize;
                let Some(points) = items.triangle(item) else { continue };
                block.items[lane] = items.list[item];
                for (corner, p) in [points.a, points.b, points.c].into_iter().enumerate() {
                    for axis in 0..3 {
                        block.corners[corner][axis][lane] = p[axis];
                    }
                }
            }
            self.blocks.push(block);
        }
        Child::run(1, first, self.blocks.len() - first)
    }

    /// The boxes of the root's grandchildren, and of leaves above them.
    pub fn cover(&self) -> Vec<Aabb> {
        let children = |node: usize| (0..WIDTH).filter_map(move |slot| self.nodes[node].get(slot));
        let mut cover = Vec::with_capacity(WIDTH * WIDTH);
        for (bounds, child) in children(0) {
            if child.is_node() {
                cover.extend(children(child.node_index()).map(|(bounds, _)| bounds));
            } else {
                cover.push(bounds);
            }
        }
        cover
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        size_of_val(self.nodes.as_slice()) + size_of_val(self.blocks.as_slice()) + size_of_val(self.items.as_slice())
    }
}
