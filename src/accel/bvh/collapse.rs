//! Which nodes of a binary hierarchy become children of wide nodes: those with the least expected cost, by dynamic
//! programming (Ylitie, Karras, Laine, "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs").

use arrayvec::ArrayVec;

use super::build::{BLOCK, BLOCK_COST, Binary, BinaryKind};
use super::wide::WIDTH;

/// How the nodes of a binary hierarchy are put together.
pub(super) struct Collapse<'b> {
    binary: &'b Binary,
    plans: Vec<Plan>,
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
}

impl<'b> Collapse<'b> {
    /// Items that are alone may not share a leaf with others.
    pub fn new(binary: &'b Binary, is_alone: impl Fn(u32) -> bool) -> Self {
        let mut collapse = Self { binary, plans: vec![Plan::default(); binary.nodes.len()] };
        collapse.plan(0, &is_alone);
        collapse
    }

    fn plan(&mut self, index: usize, is_alone: &impl Fn(u32) -> bool) -> Costs {
        let node = &self.binary.nodes[index];
        let area = node.bounds.area();
        let children = match node.kind() {
            BinaryKind::Leaf(range) => {
                self.plans[index] = Plan::LEAF;
                let references = &self.binary.references[range];
                let shared = (!references.iter().any(|r| is_alone(r.item))).then_some(references.len());
                return Costs { forests: [area * BLOCK_COST; WIDTH - 1], shared };
            }
            BinaryKind::Inner(children) => children,
        };
        let [first, second] = children.map(|child| self.plan(child, is_alone));
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
        Costs { forests, shared }
    }

    /// Whether a child of a wide node is a leaf.
    pub fn is_leaf(&self, index: usize) -> bool {
        self.plans[index].0 & Plan::LEAF.0 != 0
    }

    /// The children of the wide node that a subtree becomes.
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
