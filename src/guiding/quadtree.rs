//! Distributions of directions that are learned: quadtrees over the unit square, which an octahedron maps to the sphere.

use std::sync::atomic::{AtomicU64, Ordering};

use crate::math::float::ONE_MINUS_EPSILON;
use crate::math::{Vec3, vec3};

/// A quarter that holds more than this share of a tree's light is divided.
const DIVIDED_SHARE: f64 = 0.01;

/// Divisions in a row at most: a cell is then about 0.0005 radians wide.
const MAX_DEPTH: u32 = 12;

/// What stands for "not divided": no node has the root as child.
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

/// Four quarters with their shares of all light and their own nodes.
#[derive(Clone, Copy, Debug)]
struct Node {
    shares: [f32; 4],
    children: [u32; 4],
}

/// A distribution of directions, constant on each cell of a quadtree over the square.
#[derive(Clone, Debug)]
pub struct Directions {
    nodes: Vec<Node>,
}

impl Directions {
    /// A direction; `u` in `[0, 1)²`.
    #[inline]
    pub fn sample(&self, [mut u, mut v]: [f32; 2]) -> GuideSample {
        let (mut corner, mut size, mut density, mut index) = ([0.0; 2], 0.5, 1.0, 0);
        loop {
            let Node { shares, children } = self.nodes[index];
            let (upper, lower) = (shares[0] + shares[1], shares[2] + shares[3]);
            let total = upper + lower;
            let row = choose(&mut v, upper, lower);
            let pair = [shares[2 * row], shares[2 * row + 1]];
            let column = choose(&mut u, pair[0], pair[1]);
            density *= 4.0 * pair[column] / total;
            corner = [corner[0] + size * column as f32, corner[1] + size * row as f32];
            index = children[2 * row + column] as usize;
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
            let Node { shares, children } = &self.nodes[index];
            let (which, within) = quarter(at);
            density *= 4.0 * shares[which] / (shares[0] + shares[1] + (shares[2] + shares[3]));
            index = children[which] as usize;
            if index == LEAF as usize || density == 0.0 {
                return density;
            }
            at = within;
        }
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
    children: [u32; 4],
}

/// Light by direction as it is recorded. Sums are whole numbers, so they do not depend on the order in which threads add.
#[derive(Debug)]
pub struct Records {
    nodes: Vec<RecordNode>,
}

impl Default for Records {
    /// The whole sphere in quarters.
    fn default() -> Self {
        Self { nodes: vec![RecordNode::default()] }
    }
}

impl Records {
    /// Adds light from a direction, moved at random (`jitter` in `[0, 1)²`) by up to half a cell, for a cell tells of its neighbours too.
    #[inline]
    pub fn add(&self, direction: Vec3, jitter: [f32; 2], amount: u64) {
        let (at, _) = square_of(direction);
        let (index, which, size) = self.find(at);
        let moved = [0, 1].map(|k| at[k] + size * (jitter[k] - 0.5));
        let is_inside = moved.iter().all(|c| (0.0..1.0).contains(c));
        let (index, which, _) = if is_inside { self.find(moved) } else { (index, which, size) };
        self.nodes[index].sums[which].fetch_add(amount, Ordering::Relaxed);
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

    /// The sums of all quarters, by node. Children come after their parents.
    fn sums(&self, square: bool) -> Vec<[f64; 4]> {
        let mut sums: Vec<[f64; 4]> =
            self.nodes.iter().map(|node| [0, 1, 2, 3].map(|k| node.sums[k].load(Ordering::Relaxed) as f64)).collect();
        if square {
            let mut area = vec![0.25; sums.len()];
            for index in 0..sums.len() {
                for k in 0..4 {
                    sums[index][k] = (area[index] * sums[index][k]).sqrt();
                    let child = self.nodes[index].children[k];
                    if child != LEAF {
                        area[child as usize] = 0.25 * area[index];
                    }
                }
            }
        }
        for index in (0..self.nodes.len()).rev() {
            for k in 0..4 {
                let child = self.nodes[index].children[k];
                if child != LEAF {
                    sums[index][k] = sums[child as usize].iter().sum();
                }
            }
        }
        sums
    }

    /// The distribution of what was recorded; `None` of nothing.
    pub fn directions(&self, square: bool) -> Option<Directions> {
        let sums = self.sums(square);
        let total: f64 = sums[0].iter().sum();
        if total == 0.0 {
            return None;
        }
        let node = |(node, sums): (&RecordNode, &[f64; 4])| Node { shares: sums.map(|s| (s / total) as f32), children: node.children };
        let mut nodes: Vec<Node> = self.nodes.iter().zip(&sums).map(node).collect();
        // A quarter so dark that nothing is left of it in `f32` is a cell like any other without light.
        for node in &mut nodes {
            for k in 0..4 {
                if node.shares[k] == 0.0 {
                    node.children[k] = LEAF;
                }
            }
        }
        Some(Directions { nodes })
    }

    /// Empty records, divided where there was light: every quarter with more than a hundredth of it, as far as `most` nodes go.
    pub fn refined(&self, most: usize, square: bool, keep: f64) -> Self {
        let raw = self.sums(false);
        let sums = self.sums(square);
        let threshold = super::knob("GD", DIVIDED_SHARE) * sums[0].iter().sum::<f64>();
        let mut nodes = vec![RecordNode::default()];
        // Where each new node's sums come from: a node of old, or even parts of a cell.
        let mut sources = vec![(Some(0), sums[0], 1, raw[0])];
        let mut index = 0;
        while index < nodes.len() {
            let (old, quarters, depth, old_raw) = sources[index];
            nodes[index].sums = old_raw.map(|v| AtomicU64::new((v * keep) as u64));
            for (k, &sum) in quarters.iter().enumerate() {
                if sum > threshold && depth < MAX_DEPTH && nodes.len() < most {
                    let child = old.map_or(LEAF, |old: usize| self.nodes[old].children[k]);
                    let next = if child == LEAF { (None, [0.25 * sum; 4], [0.25 * old_raw[k]; 4]) } else { (Some(child as usize), sums[child as usize], raw[child as usize]) };
                    nodes[index].children[k] = nodes.len() as u32;
                    sources.push((next.0, next.1, depth + 1, next.2));
                    nodes[index].sums[k] = AtomicU64::new(0);
                    nodes.push(RecordNode::default());
                }
            }
            index += 1;
        }
        Self { nodes }
    }

    /// A copy without light.
    pub fn copied(&self) -> Self {
        Self { nodes: self.nodes.iter().map(|node| RecordNode { children: node.children, sums: [0,1,2,3].map(|k| AtomicU64::new(node.sums[k].load(Ordering::Relaxed))) }).collect() }
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
