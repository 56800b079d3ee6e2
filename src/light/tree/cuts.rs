//! Cuts of the tree.

use std::ops::Range;

use super::node::{Node, WIDTH};
use super::pick::total;
use super::{LightTree, MAX_OPEN, NONE, ShadingPoint};
use crate::math::Vec3;
use crate::math::compact::ORDER_OF_8;
use crate::math::float::ONE_MINUS_EPSILON;

/// The cuts of up to `POINTS` points, of up to `NODES` less [`WIDTH`] nodes in all: for each point, the root and near
/// nodes below it, with the importances of those children that are not in the cut themselves.
pub(super) struct Cuts<const POINTS: usize, const NODES: usize> {
    pub count: usize,
    pub points: [ShadingPoint; POINTS],
    /// Random numbers in `[0, 1)`.
    pub u: [f64; POINTS],
    /// Sums of the importances.
    pub totals: [f64; POINTS],
    /// How many nodes a point has.
    open: [u32; POINTS],
    /// Nodes of all points: those of each in the order in which they are found.
    pub nodes: [u32; NODES],
    pub node_points: [u32; NODES],
    pub node_count: usize,
    pub importances: [[f32; WIDTH]; NODES],
    /// 1 for each child that is a near node, 0 for others.
    near: [[u8; WIDTH]; NODES],
    /// Sums of the importances of the nodes before, of the same point.
    pub starts: [f64; NODES],
}

/// The cut of one point.
pub(super) type OneCut = Cuts<1, { MAX_OPEN + WIDTH }>;

impl<const POINTS: usize, const NODES: usize> Default for Cuts<POINTS, NODES> {
    fn default() -> Self {
        Self {
            count: 0,
            points: [ShadingPoint { p: Vec3::ZERO, n: Vec3::ZERO }; POINTS],
            u: [0.0; POINTS],
            totals: [0.0; POINTS],
            open: [0; POINTS],
            nodes: [0; NODES],
            node_points: [0; NODES],
            node_count: 0,
            importances: [[0.0; WIDTH]; NODES],
            near: [[0; WIDTH]; NODES],
            starts: [0.0; NODES],
        }
    }
}

impl<const POINTS: usize, const NODES: usize> Cuts<POINTS, NODES> {
    /// Removes all points.
    #[inline(always)]
    pub fn clear(&mut self) {
        (self.count, self.node_count) = (0, 0);
    }

    /// Adds a point, with a number in `[0, 1)`.
    #[inline(always)]
    pub fn push(&mut self, at: ShadingPoint, u: f64) {
        let point = self.count;
        self.points[point] = at;
        self.u[point] = u;
        self.totals[point] = 0.0;
        self.open[point] = 1;
        self.nodes[point] = 0;
        self.node_points[point] = point as u32;
        self.count += 1;
        self.node_count = self.count;
    }

    /// The importances of a node, if it is in a cut.
    #[inline(always)]
    pub fn find(&self, node: u32) -> Option<&[f32; WIDTH]> {
        let i = self.nodes[..self.node_count].iter().position(|&of| of == node)?;
        Some(&self.importances[i])
    }

    /// Finds the cuts. Nodes of all points take turns: what one waits for, others do not.
    #[inline(always)]
    pub fn expand(&mut self, tree: &LightTree) {
        let mut level = 0..self.node_count;
        while !level.is_empty() {
            let end = level.end;
            self.weigh(tree, level.clone());
            self.open_near_nodes(tree, level);
            level = end..self.node_count;
        }
    }

    /// Finds the importances of nodes, as if all near children could be in the cut. Nothing here depends on the node
    /// before: several are computed at a time.
    #[inline(always)]
    fn weigh(&mut self, tree: &LightTree, nodes: Range<usize>) {
        for i in nodes.clone().step_by(2) {
            // Of an odd number the last is computed twice; the arrays have place for it.
            let two = [i, (i + 1).min(nodes.end - 1)];
            let points = two.map(|i| self.points[self.node_points[i] as usize]);
            let two = two.map(|i| &tree.nodes[self.nodes[i] as usize]);
            // Arrays of their own, which are known not to overlap.
            let (mut importances, mut near) = ([0.0; 2 * WIDTH], [0; 2 * WIDTH]);
            Node::weigh_two(
                two,
                points,
                #[inline(always)]
                |k, importance, is_near_node| {
                    importances[k] = if is_near_node { 0.0 } else { importance };
                    near[k] = u8::from(is_near_node);
                },
            );
            self.importances.as_flattened_mut()[i * WIDTH..][..2 * WIDTH].copy_from_slice(&importances);
            self.near.as_flattened_mut()[i * WIDTH..][..2 * WIDTH].copy_from_slice(&near);
        }
    }

    /// Adds near children of nodes to the cut, where there is room.
    #[inline(always)]
    fn open_near_nodes(&mut self, tree: &LightTree, nodes: Range<usize>) {
        let mut node_count = self.node_count;
        for i in nodes {
            let point = self.node_points[i] as usize;
            let node = &tree.nodes[self.nodes[i] as usize];
            if node.first_node() != NONE {
                // The product moves bit `8 i` to bit `56 + i`.
                let near = u64::from_le_bytes(self.near[i]).wrapping_mul(0x0102_0408_1020_4080) >> 56;
                let open = self.open[point] + near.count_ones();
                if open <= MAX_OPEN as u32 {
                    self.open[point] = open;
                    // All children's indices are written, those of near nodes first; the arrays have place for them.
                    let order = ORDER_OF_8[near as usize].to_le_bytes();
                    let nodes: &mut [u32; WIDTH] = self.nodes[node_count..].first_chunk_mut().unwrap();
                    for k in 0..WIDTH {
                        nodes[k] = node.first_node() + u32::from(order[k]);
                    }
                    let points: &mut [u32; WIDTH] = self.node_points[node_count..].first_chunk_mut().unwrap();
                    *points = [point as u32; WIDTH];
                    node_count += near.count_ones() as usize;
                } else {
                    self.importances[i] = node.importances(self.points[point]);
                }
            }
            self.starts[i] = self.totals[point];
            self.totals[point] += f64::from(total(&self.importances[i]));
        }
        self.node_count = node_count;
    }
}

impl OneCut {
    /// The node in which the point's number falls if all are laid end to end, and its index in the cut.
    #[inline(always)]
    pub fn pick(&self) -> (usize, PickedNode) {
        let x = self.u[0] * self.totals[0];
        let i = (1..self.node_count).rev().find(|&i| x >= self.starts[i]).unwrap_or(0);
        (i, PickedNode::new(x - self.starts[i], total(&self.importances[i]), self.totals[0]))
    }
}

/// A node of a cut in which a number falls.
#[derive(Clone, Copy)]
pub(super) struct PickedNode {
    /// How far into the node the number falls, in `[0, 1)`.
    pub share: f64,
    /// Probability of the node; 0 where nothing arrives.
    pub pmf: f32,
}

impl PickedNode {
    /// Of a distance into the node, and sums of the importances of the node and of all.
    #[inline(always)]
    pub fn new(distance: f64, total: f32, all: f64) -> Self {
        let (share, last) = (distance / f64::from(total), f64::from(ONE_MINUS_EPSILON));
        Self { share: if share < last { share } else { last }, pmf: node_pmf(total, all) }
    }
}

/// Probability of a node of a cut, by sums of the importances of the node and of all; 0 where nothing arrives.
#[inline(always)]
pub(super) fn node_pmf(total: f32, all: f64) -> f32 {
    if all > 0.0 { (f64::from(total) / all) as f32 } else { 0.0 }
}
