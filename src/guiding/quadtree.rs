//! Light by direction as it is recorded, in quadtrees over the unit square.

use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};

use super::directions::{DirectionCell, DirectionDistribution, MAX_DEPTH};
use crate::bytes::{ByteReader, ByteWriter};
use crate::math::prefetch::prefetch;

/// A quarter that holds more than this share of a tree's light is divided.
const DIVIDED_SHARE: f64 = 0.01;

/// With fewer records it is not: they are too noisy.
const RECORDS_TO_DIVIDE: f64 = 16.0;

/// Marks a leaf: no node has the root as child.
const LEAF: u32 = 0;

/// The quarter that a point lies in, and where in it.
#[inline]
fn quarter([u, v]: [f32; 2]) -> (usize, [f32; 2]) {
    let (u, v) = (2.0 * u, 2.0 * v);
    let (right, lower) = (u >= 1.0, v >= 1.0);
    (usize::from(right) + 2 * usize::from(lower), [if right { u - 1.0 } else { u }, if lower { v - 1.0 } else { v }])
}

/// Whether these are the children of the nodes of a tree in the order in which trees are refined: every child comes
/// after its parent and after the children before it, and none is deeper than trees become.
fn is_tree(nodes: &[RecordNode]) -> bool {
    let mut depths = vec![1];
    for (parent, node) in nodes.iter().enumerate() {
        let Some(&depth) = depths.get(parent) else { return false };
        for &child in node.children.iter().filter(|&&child| child != LEAF) {
            if child as usize != depths.len() || depth == MAX_DEPTH {
                return false;
            }
            depths.push(depth + 1);
        }
    }
    depths.len() == nodes.len()
}

/// Four quarters that light is recorded in: a cache line.
#[derive(Debug, Default)]
#[repr(align(64))]
struct RecordNode {
    sums: [AtomicU64; 4],
    counts: [AtomicU32; 4],
    children: [u32; 4],
}

/// A descent to the cell of a tree around a point.
#[derive(Clone, Copy, Debug, Default)]
pub struct Descent {
    node: u32,
    /// Of the node, in the cell.
    quarter: usize,
    /// Of the quarters of the node.
    size: f32,
    /// In the node's square.
    at: [f32; 2],
}

impl Descent {
    /// To a point of the square.
    #[inline]
    pub fn to(at: [f32; 2]) -> Self {
        Self { node: 0, quarter: 0, size: 0.5, at }
    }

    /// To this point moved by up to half the cell that was reached: a stochastic box filter over directions. `jitter`
    /// in `[0, 1)²`. The cell itself if that is outside of the square.
    #[inline]
    pub fn jittered(&self, at: [f32; 2], jitter: [f32; 2]) -> Self {
        let moved = [0, 1].map(|k| at[k] + self.size * (jitter[k] - 0.5));
        let is_inside = moved.iter().all(|c| (0.0..1.0).contains(c));
        Self::to(if is_inside { moved } else { at })
    }
}

/// What quarters hold together with all below them.
#[derive(Clone, Copy, Debug, Default)]
struct NodeSums {
    light: f64,
    count: f64,
}

/// Light by direction as it is recorded. Sums are whole numbers, so they do not depend on the order in which threads
/// add.
#[derive(Debug)]
pub struct DirectionRecords {
    nodes: Vec<RecordNode>,
}

impl Default for DirectionRecords {
    /// The whole sphere in quarters.
    fn default() -> Self {
        Self { nodes: vec![RecordNode::default()] }
    }
}

impl DirectionRecords {
    /// Starts to load the root.
    #[inline]
    pub fn prefetch(&self) {
        prefetch(&self.nodes, 0);
    }

    /// One step towards the cell around a point, whose node is being loaded then; `false` in the cell.
    #[inline]
    pub fn step(&self, descent: &mut Descent) -> bool {
        let (which, within) = quarter(descent.at);
        let child = self.nodes[descent.node as usize].children[which];
        if child == LEAF {
            descent.quarter = which;
            return false;
        }
        prefetch(&self.nodes, child as usize);
        *descent = Descent { node: child, at: within, size: 0.5 * descent.size, quarter: 0 };
        true
    }

    /// Adds light to the cell that a descent has reached.
    #[inline]
    pub fn add(&self, cell: &Descent, amount: u64) {
        let node = &self.nodes[cell.node as usize];
        node.sums[cell.quarter].fetch_add(amount, Ordering::Relaxed);
        node.counts[cell.quarter].fetch_add(1, Ordering::Relaxed);
    }

    /// What all quarters hold, by node. Children come after their parents.
    fn node_sums(&self) -> Vec<[NodeSums; 4]> {
        let own = |node: &RecordNode| {
            [0, 1, 2, 3].map(|k| NodeSums {
                light: node.sums[k].load(Ordering::Relaxed) as f64,
                count: f64::from(node.counts[k].load(Ordering::Relaxed)),
            })
        };
        let mut sums: Vec<[NodeSums; 4]> = self.nodes.iter().map(own).collect();
        for index in (0..self.nodes.len()).rev() {
            for k in 0..4 {
                let child = self.nodes[index].children[k];
                if child != LEAF {
                    let below = sums[child as usize];
                    sums[index][k] = NodeSums {
                        light: below.iter().map(|h| h.light).sum(),
                        count: below.iter().map(|h| h.count).sum(),
                    };
                }
            }
        }
        sums
    }

    /// The distribution of what was recorded; `None` of nothing.
    pub fn directions(&self) -> Option<DirectionDistribution> {
        let sums = self.node_sums();
        let mut cells = Vec::new();
        self.append_cells(&sums, 0, 1, &mut cells);
        DirectionDistribution::new(&cells)
    }

    /// Appends the cells below a node, in order. What holds no light is one cell.
    fn append_cells(&self, sums: &[[NodeSums; 4]], node: usize, depth: u32, cells: &mut Vec<DirectionCell>) {
        for (sum, child) in sums[node].iter().zip(self.nodes[node].children) {
            if child != LEAF && sum.light > 0.0 {
                self.append_cells(sums, child as usize, depth + 1, cells);
            } else {
                cells.push(DirectionCell { depth, light: sum.light });
            }
        }
    }

    /// The same records, for each of `parts` parts of space, in a tree of at most `most` nodes that is divided where
    /// the light is: every quarter with more than a hundredth of it, if it has enough records.
    pub fn refined(&self, most: usize, parts: usize) -> Self {
        let sums = self.node_sums();
        let threshold = DIVIDED_SHARE * sums[0].iter().map(|h| h.light).sum::<f64>();
        let share = 1.0 / parts.max(1) as f64;
        let mut nodes = vec![RecordNode::default()];
        // The node of old that each new one continues, unless it is a part of a cell; what it holds; its depth.
        let mut sources = vec![(Some(0), sums[0], 1)];
        let mut index = 0;
        while index < nodes.len() {
            let (old, quarters, depth) = sources[index];
            for (k, &quarter) in quarters.iter().enumerate() {
                let divided = quarter.light > threshold
                    && quarter.count >= RECORDS_TO_DIVIDE
                    && depth < MAX_DEPTH
                    && nodes.len() < most;
                if !divided {
                    nodes[index].sums[k] = AtomicU64::new((share * quarter.light) as u64);
                    nodes[index].counts[k] = AtomicU32::new((share * quarter.count) as u32);
                    continue;
                }
                nodes[index].children[k] = nodes.len() as u32;
                let part = NodeSums { light: 0.25 * quarter.light, count: 0.25 * quarter.count };
                let child = old.map(|old: usize| self.nodes[old].children[k]).filter(|child| *child != LEAF);
                let below = child.map_or([part; 4], |child| sums[child as usize]);
                sources.push((child.map(|child| child as usize), below, depth + 1));
                nodes.push(RecordNode::default());
            }
            index += 1;
        }
        Self { nodes }
    }

    /// Writes the tree.
    pub(super) fn write(&self, out: &mut ByteWriter) {
        let words = |node: &RecordNode| {
            let sums = node.sums.each_ref().map(|sum| sum.load(Ordering::Relaxed));
            let sums = sums.into_iter().flat_map(|sum| [sum as u32, (sum >> 32) as u32]);
            let counts = node.counts.each_ref().map(|count| count.load(Ordering::Relaxed));
            sums.chain(counts).chain(node.children).collect::<Vec<_>>()
        };
        out.integers(&self.nodes.iter().flat_map(words).collect::<Vec<_>>());
    }

    /// Reads what [`write`](Self::write) gave; `None` if it is no tree.
    pub(super) fn read(data: &mut ByteReader, max_nodes: usize) -> Option<Self> {
        let words = data.integers()?;
        let (words, rest) = words.as_chunks::<16>();
        let node = |words: &[u32; 16]| RecordNode {
            sums: [0, 1, 2, 3].map(|k| AtomicU64::new(u64::from(words[2 * k]) | u64::from(words[2 * k + 1]) << 32)),
            counts: [8, 9, 10, 11].map(|k| AtomicU32::new(words[k])),
            children: [12, 13, 14, 15].map(|k| words[k]),
        };
        let nodes: Vec<RecordNode> = words.iter().map(node).collect();
        let is_whole = rest.is_empty() && (1..=max_nodes).contains(&nodes.len());
        (is_whole && is_tree(&nodes)).then_some(Self { nodes })
    }

    /// A copy.
    pub fn copied(&self) -> Self {
        let copy = |node: &RecordNode| RecordNode {
            sums: [0, 1, 2, 3].map(|k| AtomicU64::new(node.sums[k].load(Ordering::Relaxed))),
            counts: [0, 1, 2, 3].map(|k| AtomicU32::new(node.counts[k].load(Ordering::Relaxed))),
            children: node.children,
        };
        Self { nodes: self.nodes.iter().map(copy).collect() }
    }

    /// Nodes of the tree.
    pub fn node_count(&self) -> usize {
        self.nodes.len()
    }
}
