//! Distributions of directions that are learned: quadtrees over the unit square, which an octahedron maps to the
//! sphere.

use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};

use crate::bytes::{ByteReader, ByteWriter};
use crate::math::float::ONE_MINUS_EPSILON;
use crate::math::{Vec3, vec3};

/// A quarter that holds more than this share of a tree's light is divided.
const DIVIDED_SHARE: f64 = 0.01;

/// With fewer records it is not: they are too noisy.
const RECORDS_TO_DIVIDE: f64 = 16.0;

/// Divisions in a row at most: a cell is then about 0.0005 radians wide.
const MAX_DEPTH: u32 = 12;

/// Marks a leaf: no node has the root as child.
const LEAF: u32 = 0;

/// A direction with the density per solid angle with which it was chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GuideSample {
    /// The direction, unit, in the world.
    pub direction: Vec3,
    /// Density per solid angle.
    pub pdf: f32,
}

/// The direction of a point of the square, and density per solid angle over density per area of the square.
#[inline]
fn direction_of([u, v]: [f32; 2]) -> (Vec3, f32) {
    let (x, y) = (2.0 * u - 1.0, 2.0 * v - 1.0);
    let z = 1.0 - x.abs() - y.abs();
    // The lower half is folded out over the corners.
    let (x, y) = if z < 0.0 { ((1.0 - y.abs()).copysign(x), (1.0 - x.abs()).copysign(y)) } else { (x, y) };
    let p = vec3(x, y, z);
    let length = p.length();
    (p / length, 0.25 * length * length * length)
}

/// The point of the square of a unit direction; inverts [`direction_of`].
#[inline]
fn square_of(direction: Vec3) -> ([f32; 2], f32) {
    let scale = 1.0 / (direction.x.abs() + direction.y.abs() + direction.z.abs());
    let (x, y) = (direction.x * scale, direction.y * scale);
    let (x, y) = if direction.z < 0.0 { ((1.0 - y.abs()).copysign(x), (1.0 - x.abs()).copysign(y)) } else { (x, y) };
    ([0.5 * x + 0.5, 0.5 * y + 0.5].map(|c| c.clamp(0.0, ONE_MINUS_EPSILON)), 0.25 * scale * scale * scale)
}

/// The quarter that a point lies in, and where in it.
#[inline]
fn quarter([u, v]: [f32; 2]) -> (usize, [f32; 2]) {
    let (u, v) = (2.0 * u, 2.0 * v);
    let (right, lower) = (u >= 1.0, v >= 1.0);
    (usize::from(right) + 2 * usize::from(lower), [if right { u - 1.0 } else { u }, if lower { v - 1.0 } else { v }])
}

/// Four quarters with their shares of the node's light, in whole numbers, and their own nodes. Small, for all of them
/// are visited at random.
#[derive(Clone, Copy, Debug)]
struct Node {
    shares: [u16; 4],
    children: [u16; 4],
}

impl Node {
    /// With the light that each quarter holds. Light never rounds to nothing.
    fn new(light: [f64; 4], children: [u32; 4]) -> Self {
        let total: f64 = light.iter().sum();
        let share = |k: usize| if light[k] > 0.0 { (light[k] / total * 65_000.0).ceil() as u16 } else { 0 };
        let child = |k: usize| if light[k] > 0.0 { children[k] as u16 } else { LEAF as u16 };
        Self { shares: [0, 1, 2, 3].map(share), children: [0, 1, 2, 3].map(child) }
    }

    #[inline]
    fn shares(&self) -> [f32; 4] {
        self.shares.map(f32::from)
    }
}

/// Whether these are the children of the nodes of a forest in the order in which trees are refined: every child comes
/// after its parent and after the children before it.
fn is_forest(children: impl ExactSizeIterator<Item = [u32; 4]>) -> bool {
    let count = children.len() as u32;
    let mut last = 0;
    (0..count).zip(children).all(|(parent, children)| {
        children
            .into_iter()
            .filter(|&child| child != LEAF)
            .all(|child| child > std::mem::replace(&mut last, child).max(parent) && child < count)
    })
}

/// A distribution of directions, constant on each cell of a quadtree over the square.
#[derive(Clone, Debug)]
pub struct DTree {
    nodes: Vec<Node>,
}

impl DTree {
    /// A direction; `u` in `[0, 1)²`.
    #[inline]
    pub fn sample(&self, [mut u, mut v]: [f32; 2]) -> GuideSample {
        let (mut corner, mut size, mut density, mut index) = ([0.0; 2], 0.5, 1.0, 0);
        loop {
            let node = &self.nodes[index];
            let shares = node.shares();
            let (upper, lower) = (shares[0] + shares[1], shares[2] + shares[3]);
            let total = upper + lower;
            let row = choose(&mut v, upper, lower);
            let pair = [shares[2 * row], shares[2 * row + 1]];
            let column = choose(&mut u, pair[0], pair[1]);
            density *= 4.0 * pair[column] / total;
            corner = [corner[0] + size * column as f32, corner[1] + size * row as f32];
            index = usize::from(node.children[2 * row + column]);
            if index == LEAF as usize {
                break;
            }
            size *= 0.5;
        }
        let at = [corner[0] + size * u, corner[1] + size * v].map(|c| c.min(ONE_MINUS_EPSILON));
        let (direction, per_angle) = direction_of(at);
        GuideSample { direction, pdf: density * per_angle }
    }

    /// The density per solid angle with which [`sample`](Self::sample) chooses a direction.
    #[inline]
    pub fn pdf(&self, direction: Vec3) -> f32 {
        let (mut at, per_angle) = square_of(direction);
        let (mut density, mut index) = (per_angle, 0);
        loop {
            let node = &self.nodes[index];
            let shares = node.shares();
            let (which, within) = quarter(at);
            density *= 4.0 * shares[which] / (shares[0] + shares[1] + (shares[2] + shares[3]));
            index = usize::from(node.children[which]);
            if index == LEAF as usize || density == 0.0 {
                return density;
            }
            at = within;
        }
    }

    /// Writes the tree.
    pub(super) fn write(&self, out: &mut ByteWriter) {
        let words = |node: &Node| node.shares.into_iter().chain(node.children).map(u32::from).collect::<Vec<_>>();
        out.integers(&self.nodes.iter().flat_map(words).collect::<Vec<_>>());
    }

    /// Reads what [`write`](Self::write) gave; `None` if it is no distribution: a direction is then found by at most so
    /// many steps as there are nodes.
    pub(super) fn read(data: &mut ByteReader, max_nodes: usize) -> Option<Self> {
        let words = data.integers()?.into_iter().map(|word| u16::try_from(word).ok()).collect::<Option<Vec<u16>>>()?;
        let (words, rest) = words.as_chunks();
        let node = |&[a, b, c, d, e, f, g, h]: &[u16; 8]| Node { shares: [a, b, c, d], children: [e, f, g, h] };
        let nodes: Vec<Node> = words.iter().map(node).collect();
        let is_tree = rest.is_empty()
            && (1..=max_nodes).contains(&nodes.len())
            && is_forest(nodes.iter().map(|node| node.children.map(u32::from)));
        let has_light = |index: usize| nodes[index].shares != [0; 4];
        let enters_light = |node: &Node| {
            let mut quarters = node.shares.iter().zip(node.children).filter(|(_, child)| u32::from(*child) != LEAF);
            quarters.all(|(&share, child)| share > 0 && has_light(usize::from(child)))
        };
        (is_tree && has_light(0) && nodes.iter().all(enters_light)).then_some(Self { nodes })
    }

    /// Nodes of the tree.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Whether there are no nodes; never so.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }
}

/// 0 or 1 in proportion to two weights, one of which is positive; `u` becomes what is left of it.
#[inline]
fn choose(u: &mut f32, first: f32, second: f32) -> usize {
    let share = first / (first + second);
    let (chosen, rest) = if *u < share { (0, *u / share) } else { (1, (*u - share) / (1.0 - share)) };
    *u = rest.min(ONE_MINUS_EPSILON);
    chosen
}

/// Four quarters that light is recorded in.
#[derive(Debug, Default)]
struct RecordNode {
    sums: [AtomicU64; 4],
    counts: [AtomicU32; 4],
    children: [u32; 4],
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
pub struct DTreeBuilder {
    nodes: Vec<RecordNode>,
}

impl Default for DTreeBuilder {
    /// The whole sphere in quarters.
    fn default() -> Self {
        Self { nodes: vec![RecordNode::default()] }
    }
}

impl DTreeBuilder {
    /// Adds light from a direction, jittered (`jitter` in `[0, 1)²`) by up to half a cell: a stochastic box filter over
    /// directions.
    #[inline]
    pub fn add(&self, direction: Vec3, jitter: [f32; 2], amount: u64) {
        let (at, _) = square_of(direction);
        let (index, which, size) = self.find(at);
        let moved = [0, 1].map(|k| at[k] + size * (jitter[k] - 0.5));
        let is_inside = moved.iter().all(|c| (0.0..1.0).contains(c));
        let (index, which, _) = if is_inside { self.find(moved) } else { (index, which, size) };
        self.nodes[index].sums[which].fetch_add(amount, Ordering::Relaxed);
        self.nodes[index].counts[which].fetch_add(1, Ordering::Relaxed);
    }

    /// The node and the quarter of it that is the cell around a point, and the cell's size.
    #[inline]
    fn find(&self, mut at: [f32; 2]) -> (usize, usize, f32) {
        let (mut index, mut size) = (0, 0.5);
        loop {
            let (which, within) = quarter(at);
            let child = self.nodes[index].children[which];
            if child == LEAF {
                return (index, which, size);
            }
            (index, at, size) = (child as usize, within, 0.5 * size);
        }
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
    pub fn directions(&self) -> Option<DTree> {
        let sums = self.node_sums();
        let light = |sums: &[NodeSums; 4]| sums.map(|h| h.light);
        if light(&sums[0]).iter().sum::<f64>() == 0.0 {
            return None;
        }
        // What holds no light is never entered, so its shares do not matter.
        let nodes = self.nodes.iter().zip(&sums).map(|(node, sums)| Node::new(light(sums), node.children)).collect();
        Some(DTree { nodes })
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
        let is_tree = rest.is_empty()
            && (1..=max_nodes).contains(&nodes.len())
            && is_forest(nodes.iter().map(|node| node.children));
        is_tree.then_some(Self { nodes })
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
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Whether there are no nodes; never so.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }
}
