//! Which nodes of a binary hierarchy become children of wide nodes: those with the least expected cost, by dynamic
//! programming (Ylitie, Karras, Laine, "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs").

use arrayvec::ArrayVec;

use super::build::{BLOCK, BLOCK_COST, Binary, BinaryKind, MAX_LEAF, Reference};
use super::wide::WIDTH;
use crate::accel::tree::Items;

// A leaf fills one block at most.
const _: () = assert!(MAX_LEAF <= BLOCK);

/// How the nodes of a binary hierarchy are put together.
pub(super) struct Collapse<'b> {
    binary: &'b Binary,
    items: &'b Items<'b>,
    plans: Vec<Plan>,
    /// How likely rays that enter the box of each node are to be occluded, over the cost of the test.
    occlusion: Vec<f32>,
}

/// How the subtree below a node is split into up to `i` children of a wide node, for `i` from 2 to [`WIDTH`]: how many
/// of them its first child becomes, or 0 if `i - 1` children cost no more.
#[derive(Clone, Copy, Default)]
struct Plan(u32);

impl Plan {
    /// The subtree is a leaf where it is one child.
    const LEAF: Self = Self(1 << 31);

    fn set(&mut self, children: usize, first: usize) {
        self.0 |= (first as u32) << (3 * (children - 2));
    }

    fn get(self, children: usize) -> usize {
        (self.0 >> (3 * (children - 2)) & 7) as usize
    }
}

/// What a subtree costs.
struct Costs {
    /// As at most `i + 1` children of a wide node.
    forests: [f32; WIDTH - 1],
    /// References, if they may share a leaf.
    shared: Option<usize>,
    /// The area of the surfaces, of both sides.
    surface: f32,
}

impl<'b> Collapse<'b> {
    pub fn new(binary: &'b Binary, items: &'b Items<'b>) -> Self {
        let count = binary.nodes.len();
        let mut collapse = Self { binary, items, plans: vec![Plan::default(); count], occlusion: vec![0.0; count] };
        collapse.plan(0);
        collapse
    }

    fn plan(&mut self, index: usize) -> Costs {
        let costs = self.costs(index);
        self.occlusion[index] = costs.surface / costs.forests[0];
        costs
    }

    fn costs(&mut self, index: usize) -> Costs {
        let node = &self.binary.nodes[index];
        let area = node.bounds.area();
        let children = match node.kind() {
            BinaryKind::Leaf(range) => {
                self.plans[index] = Plan::LEAF;
                return self.leaf(&self.binary.references[range], area * BLOCK_COST);
            }
            BinaryKind::Inner(children) => children,
        };
        let [first, second] = children.map(|child| self.plan(child));
        let mut plan = Plan::default();
        let split = |children: usize| -> (f32, usize) {
            let mut best = (f32::INFINITY, 1);
            for of_first in children.saturating_sub(WIDTH - 1).max(1)..children.min(WIDTH) {
                let cost = first.forests[of_first - 1] + second.forests[children - of_first - 1];
                best = if cost < best.0 { (cost, of_first) } else { best };
            }
            best
        };
        let (below, of_first) = split(WIDTH);
        plan.set(WIDTH, of_first);
        let mut forests = [area + below; WIDTH - 1];
        let shared = first.shared.zip(second.shared).map(|(a, b)| a + b).filter(|&count| count <= BLOCK);
        if shared.is_some() && area * BLOCK_COST <= forests[0] {
            plan.0 |= Plan::LEAF.0;
            forests[0] = area * BLOCK_COST;
        }
        for children in 2..WIDTH {
            let (cost, of_first) = split(children);
            forests[children - 1] = forests[children - 2];
            if cost < forests[children - 1] {
                plan.set(children, of_first);
                forests[children - 1] = cost;
            }
        }
        self.plans[index] = plan;
        Costs { forests, shared, surface: first.surface + second.surface }
    }

    fn leaf(&self, references: &[Reference], cost: f32) -> Costs {
        let (mut surface, mut is_shared) = (0.0, true);
        for reference in references {
            let triangle = self.items.triangle(reference.item as usize);
            is_shared &= triangle.is_some();
            surface += triangle.map_or_else(|| reference.bounds.area(), |triangle| 2.0 * triangle.area() as f32);
        }
        Costs { forests: [cost; WIDTH - 1], shared: is_shared.then_some(references.len()), surface }
    }

    /// Whether a child of a wide node is a leaf.
    pub fn is_leaf(&self, index: usize) -> bool {
        self.plans[index].0 & Plan::LEAF.0 != 0
    }

    /// The children of the wide node that a subtree becomes, those last that occlude most rays for what they cost
    /// (Ogaki, Derouet-Jourdan, "An N-ary BVH Child Node Sorting Technique for Occlusion Tests").
    pub fn children(&self, index: usize) -> ArrayVec<usize, WIDTH> {
        let mut children = ArrayVec::new();
        match self.binary.nodes[index].kind() {
            BinaryKind::Leaf(_) => children.push(index),
            BinaryKind::Inner([first, second]) => {
                let of_first = self.plans[index].get(WIDTH);
                self.collect(first, of_first, &mut children);
                self.collect(second, WIDTH - of_first, &mut children);
            }
        }
        children.sort_by(|&a, &b| self.occlusion[a].total_cmp(&self.occlusion[b]));
        children
    }

    /// Splits a subtree into at most `count` children.
    fn collect(&self, index: usize, count: usize, children: &mut ArrayVec<usize, WIDTH>) {
        let of_first = (2..=count).rev().find_map(|count| match self.plans[index].get(count) {
            0 => None,
            of_first => Some((count, of_first)),
        });
        match (of_first, self.binary.nodes[index].kind()) {
            (Some((count, of_first)), BinaryKind::Inner([first, second])) => {
                self.collect(first, of_first, children);
                self.collect(second, count - of_first, children);
            }
            _ => children.push(index),
        }
    }

    /// The items of a leaf.
    pub fn references(&self, index: usize) -> ArrayVec<u32, BLOCK> {
        let (mut items, mut open) = (ArrayVec::new(), vec![index]);
        while let Some(index) = open.pop() {
            match self.binary.nodes[index].kind() {
                BinaryKind::Leaf(range) => items.extend(self.binary.references[range].iter().map(|r| r.item)),
                BinaryKind::Inner([first, second]) => open.extend([second, first]),
            }
        }
        items
    }
}
