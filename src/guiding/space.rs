//! Binary trees that divide the unit cube along each axis in turn, and tables that skip several divisions at once.

use super::ROOTS;
use crate::math::Vec3;

/// Divisions in a row at most.
pub const MAX_DEPTH: u32 = 48;

/// Divisions that the table of each root skips.
const ROOT_DIVISIONS: u32 = 12;

/// Divisions that every further table skips.
const DIVISIONS: u32 = 6;

/// A node of a tree, or an entry of a table: where the two children or the next table begin or, with [`IS_LEAF`], the
/// index of a leaf.
#[derive(Clone, Copy, Debug)]
pub struct Node(pub u32);

const IS_LEAF: u32 = 1 << 31;

impl Node {
    /// The node of a leaf.
    pub fn of_leaf(leaf: usize) -> Self {
        Self(leaf as u32 | IS_LEAF)
    }

    /// The leaf, if it is one.
    #[inline(always)]
    pub fn leaf(self) -> Option<usize> {
        (self.0 & IS_LEAF != 0).then_some((self.0 & !IS_LEAF) as usize)
    }
}

/// A point in one of the trees.
#[derive(Clone, Copy, Debug, Default)]
pub struct TreePoint {
    /// The tree.
    pub root: u32,
    /// The divisions that lead to the point, the first in the highest of 48 bits.
    pub path: u64,
}

impl TreePoint {
    /// Of a point of the unit cube.
    #[inline(always)]
    pub fn new(root: u32, at: Vec3) -> Self {
        // Every third bit.
        let spread = |x: f32| {
            let x = (x * 65_536.0) as i32 as u64 & 0xffff;
            let x = (x | x << 16) & 0xff00_00ff;
            let x = (x | x << 8) & 0x00f0_0f00_f00f;
            let x = (x | x << 4) & 0x0c30_c30c_30c3;
            (x | x << 2) & 0x2492_4924_9249
        };
        Self { root, path: spread(at.x) << 2 | spread(at.y) << 1 | spread(at.z) }
    }
}

/// One tree for each root.
#[derive(Clone, Debug)]
pub struct SpaceTrees {
    /// The first are the roots; every child comes after its parent.
    nodes: Vec<Node>,
    /// The tables of the roots, and those after them.
    tables: Vec<Node>,
    /// By leaf.
    depths: Vec<u32>,
}

impl SpaceTrees {
    /// Every root is a leaf.
    pub fn undivided() -> Self {
        Self::of_nodes((0..ROOTS).map(Node::of_leaf).collect())
    }

    /// From the nodes of binary trees: every child after its parent, every leaf once, at most [`MAX_DEPTH`] divisions.
    pub fn of_nodes(nodes: Vec<Node>) -> Self {
        let (mut depths, mut leaf_depths) = (vec![0; nodes.len()], vec![0; nodes.len()]);
        for (index, node) in nodes.iter().enumerate() {
            if let Some(leaf) = node.leaf() {
                leaf_depths[leaf] = depths[index];
            } else {
                let first = node.0 as usize;
                let depth = depths[index] + 1;
                depths[first..first + 2].fill(depth);
            }
        }
        let tables = tables(&nodes);
        Self { nodes, tables, depths: leaf_depths }
    }

    /// The nodes that [`of_nodes`](Self::of_nodes) takes.
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// Divisions that lead to a leaf.
    #[inline]
    pub fn depth(&self, leaf: usize) -> u32 {
        self.depths[leaf]
    }

    /// The leaf around a point.
    #[inline(always)]
    pub fn find(&self, point: TreePoint) -> usize {
        let mut left = MAX_DEPTH - ROOT_DIVISIONS;
        let mut entry = self.tables[(point.root as usize) << ROOT_DIVISIONS | (point.path >> left) as usize];
        loop {
            if let Some(leaf) = entry.leaf() {
                return leaf;
            }
            left -= DIVISIONS;
            entry = self.tables[entry.0 as usize + (point.path >> left & ((1 << DIVISIONS) - 1)) as usize];
        }
    }
}

/// The tables of all trees.
fn tables(nodes: &[Node]) -> Vec<Node> {
    let mut tables = Vec::new();
    // Entries that lead to further tables, with the nodes these start at.
    let mut open = Vec::new();
    for root in 0..ROOTS {
        append_table(nodes, root, ROOT_DIVISIONS, &mut tables, &mut open);
    }
    let mut next = 0;
    while next < open.len() {
        let (entry, node) = open[next];
        tables[entry] = Node(tables.len() as u32);
        append_table(nodes, node, DIVISIONS, &mut tables, &mut open);
        next += 1;
    }
    tables
}

fn append_table(nodes: &[Node], start: usize, divisions: u32, tables: &mut Vec<Node>, open: &mut Vec<(usize, usize)>) {
    let mut stack = vec![(start, 0)];
    while let Some((index, depth)) = stack.pop() {
        let node = nodes[index];
        if node.leaf().is_some() {
            tables.extend(std::iter::repeat_n(node, 1 << (divisions - depth)));
        } else if depth == divisions {
            open.push((tables.len(), index));
            tables.push(node);
        } else {
            let first = node.0 as usize;
            stack.extend([(first + 1, depth + 1), (first, depth + 1)]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rng;

    /// Divides a random node `count` times.
    fn divided(rng: &mut Rng, count: usize) -> Vec<Node> {
        let mut nodes: Vec<Node> = (0..ROOTS).map(Node::of_leaf).collect();
        let mut depths = vec![0; ROOTS];
        // Mostly near one corner, so that it becomes deep.
        let mut last = 0;
        for _ in 0..count {
            let index = if rng.unit() < 0.7 { last } else { rng.below(nodes.len()) };
            let Some(leaf) = nodes[index].leaf().filter(|_| depths[index] < MAX_DEPTH) else { continue };
            last = nodes.len();
            nodes[index] = Node(nodes.len() as u32);
            let leaves = nodes.iter().filter(|node| node.leaf().is_some()).count();
            nodes.extend([Node::of_leaf(leaf), Node::of_leaf(leaves + 1)]);
            depths.extend([depths[index] + 1; 2]);
        }
        nodes
    }

    /// Down the tree, one division after the other.
    fn walk(nodes: &[Node], root: usize, mut at: Vec3) -> (usize, u32) {
        let (mut index, mut depth) = (root, 0);
        loop {
            if let Some(leaf) = nodes[index].leaf() {
                return (leaf, depth);
            }
            let axis = depth as usize % 3;
            let x = 2.0 * at[axis];
            at[axis] = x.fract();
            index = nodes[index].0 as usize + x as usize;
            depth += 1;
        }
    }

    #[test]
    fn tables_lead_to_the_leaves_of_the_trees() {
        let mut rng = Rng::new(1);
        let mut deepest = 0;
        for round in 0..40 {
            let nodes = divided(&mut rng, round * 10);
            let trees = SpaceTrees::of_nodes(nodes.clone());
            for _ in 0..2000 {
                let root = rng.below(ROOTS);
                let scale = 0.5f32.powi(rng.below(17) as i32);
                let at = Vec3::new(rng.unit_f32(), rng.unit_f32(), rng.unit_f32()) * scale;
                let (leaf, depth) = walk(&nodes, root, at);
                assert_eq!(trees.find(TreePoint::new(root as u32, at)), leaf);
                assert_eq!(trees.depth(leaf), depth);
                deepest = deepest.max(depth);
            }
        }
        assert!(deepest > 20, "{deepest}");
    }
}
