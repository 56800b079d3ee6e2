//! Optimization by reinsertion: nodes of a binary hierarchy are removed and inserted where the surface area grows least
//! (Bittner, Hapala, Havran, "Fast Insertion-Based Optimization of Bounding Volume Hierarchies"; here in the order of
//! their areas).

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use super::build::{Binary, BinaryKind, BinaryNode};

/// How often the largest nodes are reinserted.
const PASSES: usize = 5;

/// How many nodes a pass reinserts.
const REINSERTED: usize = 4_000;

/// The largest nodes of the tree as it is built, from which each pass takes its own.
const CANDIDATES: usize = 4 * REINSERTED;

/// The most positions that are tried for a node; 30 to 40 are on average.
const MAX_POSITIONS: usize = 512;

/// Deeper trees are left as they were.
const MAX_DEPTH: usize = 64;

const ROOT: usize = 0;

/// Reinserts the largest nodes.
pub(super) fn optimize(binary: &mut Binary) {
    optimize_up_to(binary, MAX_DEPTH);
}

/// As [`optimize`]; a tree with more levels than `max_depth` stays as it was.
pub(super) fn optimize_up_to(binary: &mut Binary, max_depth: usize) {
    if !binary.nodes[ROOT].bounds.area().is_finite() {
        return;
    }
    let mut optimizer = Optimizer::new(&mut binary.nodes);
    let mut moves = Vec::new();
    let candidates = optimizer.largest(0..optimizer.nodes.len(), CANDIDATES);
    for _ in 0..PASSES {
        for node in optimizer.largest(candidates.iter().copied(), REINSERTED) {
            moves.extend(optimizer.reinsert(node).map(|sibling| (node, sibling)));
        }
    }
    if optimizer.depth() > max_depth {
        for (node, sibling) in moves.into_iter().rev() {
            optimizer.remove(node);
            optimizer.insert(node, sibling);
        }
    }
}

struct Optimizer<'b> {
    nodes: &'b mut [BinaryNode],
    /// Of each node but the root.
    parents: Vec<u32>,
    queue: BinaryHeap<Position>,
}

/// A subtree that a node may be inserted into.
struct Position {
    /// How much the areas of the boxes above it grow.
    growth: f32,
    index: usize,
}

/// The largest is the position with the least growth.
impl Ord for Position {
    fn cmp(&self, other: &Self) -> Ordering {
        other.growth.total_cmp(&self.growth).then(other.index.cmp(&self.index))
    }
}

impl PartialOrd for Position {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Position {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Position {}

impl<'b> Optimizer<'b> {
    fn new(nodes: &'b mut [BinaryNode]) -> Self {
        let mut parents = vec![ROOT as u32; nodes.len()];
        for (index, node) in nodes.iter().enumerate() {
            if let BinaryKind::Inner(children) = node.kind() {
                children.into_iter().for_each(|child| parents[child] = index as u32);
            }
        }
        Self { nodes, parents, queue: BinaryHeap::new() }
    }

    fn area(&self, index: usize) -> f32 {
        self.nodes[index].bounds.area()
    }

    fn parent(&self, index: usize) -> usize {
        self.parents[index] as usize
    }

    fn children(&self, index: usize) -> Option<[usize; 2]> {
        match self.nodes[index].kind() {
            BinaryKind::Inner(children) => Some(children),
            BinaryKind::Leaf(_) => None,
        }
    }

    /// The other child of a node's parent.
    fn sibling(&self, index: usize) -> usize {
        self.children(self.parent(index)).map_or(index, |[a, b]| if a == index { b } else { a })
    }

    /// Of the nodes that may be moved, those with the largest boxes, the largest first.
    fn largest(&self, nodes: impl Iterator<Item = usize>, count: usize) -> Vec<usize> {
        let may_move = |&index: &usize| self.parent(index) != ROOT;
        let by_area = |a: &usize, b: &usize| self.area(*b).total_cmp(&self.area(*a)).then(a.cmp(b));
        let mut largest: Vec<usize> = nodes.filter(may_move).collect();
        if largest.len() > count {
            largest.select_nth_unstable_by(count, by_area);
            largest.truncate(count);
        }
        largest.sort_unstable_by(by_area);
        largest
    }

    /// Reinserts a node; gives its former sibling if it has another one then.
    fn reinsert(&mut self, index: usize) -> Option<usize> {
        if self.parent(index) == ROOT || !self.area(index).is_finite() {
            return None;
        }
        let former = self.sibling(index);
        self.remove(index);
        let sibling = self.best_sibling(index).unwrap_or(former);
        self.insert(index, sibling);
        (sibling != former).then_some(former)
    }

    /// Removes a node and its parent.
    fn remove(&mut self, index: usize) {
        let (parent, sibling) = (self.parent(index), self.sibling(index));
        let above = self.parent(parent);
        self.replace(above, parent, sibling);
        self.refit(above);
    }

    /// Inserts a node that was removed, with its parent, beside another.
    fn insert(&mut self, index: usize, sibling: usize) {
        let (parent, above) = (self.parent(index), self.parent(sibling));
        self.replace(above, sibling, parent);
        self.nodes[parent] = BinaryNode::inner(self.nodes[parent].bounds, [sibling, index]);
        self.parents[sibling] = parent as u32;
        self.refit(parent);
    }

    /// Replaces one child by another.
    fn replace(&mut self, above: usize, old: usize, new: usize) {
        if let Some(children) = self.children(above) {
            let children = children.map(|child| if child == old { new } else { child });
            self.nodes[above] = BinaryNode::inner(self.nodes[above].bounds, children);
            self.parents[new] = above as u32;
        }
    }

    /// Refits the boxes of a node and of its ancestors.
    fn refit(&mut self, mut index: usize) {
        loop {
            if let Some([a, b]) = self.children(index) {
                self.nodes[index].bounds = self.nodes[a].bounds.union(&self.nodes[b].bounds);
            }
            if index == ROOT {
                return;
            }
            index = self.parent(index);
        }
    }

    /// The node beside which the surface area grows least; `None` if that is the root.
    fn best_sibling(&mut self, index: usize) -> Option<usize> {
        let bounds = self.nodes[index].bounds;
        let area = bounds.area();
        let (mut least, mut best) = (f32::INFINITY, ROOT);
        self.queue.clear();
        self.queue.push(Position { growth: 0.0, index: ROOT });
        for _ in 0..MAX_POSITIONS {
            // Below, at least the node's own box is added.
            let Some(position) = self.queue.pop().filter(|position| position.growth + area < least) else { break };
            let node = &self.nodes[position.index].bounds;
            let cost = position.growth + node.union(&bounds).area();
            if cost < least {
                (least, best) = (cost, position.index);
            }
            let growth = cost - node.area();
            if let Some(children) = self.children(position.index).filter(|_| growth + area < least) {
                self.queue.extend(children.map(|index| Position { growth, index }));
            }
        }
        (best != ROOT).then_some(best)
    }

    /// Levels of nodes.
    fn depth(&self) -> usize {
        let (mut deepest, mut open) = (0, vec![(ROOT, 1)]);
        while let Some((index, depth)) = open.pop() {
            deepest = deepest.max(depth);
            open.extend(self.children(index).into_iter().flatten().map(|child| (child, depth + 1)));
        }
        deepest
    }
}
