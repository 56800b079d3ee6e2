//! Learning where light comes from while a picture is made ("Practical Path Guiding for Efficient Light-Transport Simulation", 2017, and
//! "'Practical Path Guiding' in Production", 2019).
//!
//! A binary tree divides space; each of its leaves has a distribution of directions, in proportion to the light that arrived from them in the
//! pass before. A pass records into sums of whole numbers, so what is learned does not depend on threads. Between passes, leaves that got many
//! records are divided and the directions of each are divided where the light is.

mod quadtree;
#[cfg(test)]
mod tests;

pub use quadtree::{Directions, GuideSample, Records};

use std::sync::Arc;
use std::sync::atomic::{AtomicI64, AtomicU64, Ordering};

use crate::math::float::ONE_MINUS_EPSILON;
use crate::math::random::mix;
use crate::math::{Aabb, Vec3};

/// Knob.
pub fn knob(name: &str, default: f64) -> f64 {
    std::env::var(name).ok().and_then(|v| v.parse().ok()).unwrap_or(default)
}

/// Records of a leaf beyond which it is divided, in a pass of one sample per pixel; in one of `n` it is `sqrt(n)` times as many.
const RECORDS_TO_DIVIDE: f64 = 4000.0;

/// Leaves at most.
const MAX_LEAVES: usize = 1 << 13;

/// Nodes of all distributions together at most, about. One takes 80 bytes, with its part of the records.
const MAX_NODES: usize = 1 << 20;

/// Divisions of space in a row at most.
const MAX_DEPTH: u32 = 48;

/// Whole numbers that a typical record is worth.
const UNITS: f32 = 65_536.0;

/// What a single record counts at most, in typical ones: 2^27 such fit into a sum.
const LARGEST: f32 = 1_048_576.0;

/// What stands for "a leaf" in the tree over space: no node has the root as child.
const LEAF: u32 = 0;

/// A node of the tree over space: two children, or none and the index of a leaf.
#[derive(Clone, Copy, Debug)]
struct Node {
    children: [u32; 2],
    leaf: u32,
}

/// A part of space.
#[derive(Debug)]
struct Leaf {
    /// What the passes before have taught.
    directions: Option<Arc<Directions>>,
    records: Records,
    count: AtomicU64,
    lit: AtomicU64,
    share: f32,
    gains: [AtomicI64; 4],
}

static SHARES: std::sync::LazyLock<[f32; 4]> = std::sync::LazyLock::new(|| [knob("S0", 0.15), knob("S1", 0.3), knob("S2", 0.7), knob("S3", 0.9)].map(|s| s as f32));

/// What is known of the light that arrives at the points of a scene, and what is being learned of it.
#[derive(Debug)]
pub struct Guide {
    /// Of the box around the scene, a cube.
    corner: Vec3,
    inverse_size: f32,
    nodes: Vec<Node>,
    leaves: Vec<Leaf>,
    /// From light to whole numbers; zero while nothing is learned.
    scale: f32,
    pub normals: bool,
    pub mode: u32,
}

impl Guide {
    /// Knows nothing yet. `typical` is how much light a typical record has, about: records far below it are lost, far above are cut.
    pub fn new(bounds: Aabb, typical: f32) -> Self {
        let size = bounds.size().max_element();
        let known = size > 0.0 && size < f32::INFINITY && bounds.min.is_finite();
        let (corner, inverse_size) = if known { (bounds.min, 1.0 / size) } else { (Vec3::ZERO, 0.0) };
        let scale = UNITS / typical;
        Self {
            corner,
            inverse_size,
            nodes: (0..6).map(|leaf| Node { children: [LEAF; 2], leaf }).collect(),
            leaves: (0..6).map(|_| Leaf { directions: None, records: Records::default(), count: AtomicU64::new(0), lit: AtomicU64::new(0), share: 0.5, gains: Default::default() }).collect(),
            normals: knob("GN", 1.0) > 0.0,
            mode: knob("GT", 1.0) as u32,
            scale: if scale > 0.0 && scale < f32::INFINITY { scale } else { 0.0 },
        }
    }

    /// Whether records are taken.
    pub fn learns(&self) -> bool {
        self.scale > 0.0
    }

    /// Takes no more records.
    #[must_use]
    pub fn finished(self) -> Self {
        Self { scale: 0.0, ..self }
    }

    /// What is known of the light at a point; `None` if nothing.
    #[inline]
    pub fn at(&self, p: Vec3, n: Vec3) -> Option<(&Directions, f32)> {
        let (leaf, _) = self.find(self.normalized(p), self.root(n));
        let leaf = &self.leaves[leaf];
        leaf.directions.as_deref().map(|d| (d, leaf.share))
    }

    /// Records `light` that arrived at a point from a direction, an estimate over its density. Light that is not a finite number above zero counts
    /// as none. Equal records are treated alike.
    #[inline]
    pub fn record(&self, p: Vec3, n: Vec3, direction: Vec3, light: f32, pdfs: [f32; 2]) {
        let at = self.normalized(p);
        let root = self.root(n);
        let (mut leaf, depth) = self.find(at, root);
        self.leaves[leaf].count.fetch_add(1, Ordering::Relaxed);
        if !(light > 0.0 && light < f32::INFINITY) {
            return;
        }
        let amount = if self.mode == 2 { (light * self.scale * self.scale * (1.0 / 65536.0)).min(281474976710656.0) } else { (light * self.scale).min(LARGEST * UNITS) } as u64;
        self.leaves[leaf].lit.fetch_add(1, Ordering::Relaxed);
        if pdfs[1] >= 0.0 {
            let middle = 0.5 * (pdfs[0] + pdfs[1]);
            for (sum, share) in self.leaves[leaf].gains.iter().zip(*SHARES) {
                let gain = ((share * pdfs[0] + (1.0 - share) * pdfs[1]) / middle).ln();
                sum.fetch_add((amount as f32 * gain) as i64, Ordering::Relaxed);
            }
        }
        // Random numbers of the record itself.
        let bits = |a: f32, b: f32| u64::from(a.to_bits()) << 32 | u64::from(b.to_bits());
        let first = mix(bits(at.x, direction.x) ^ mix(bits(at.y, direction.y) ^ mix(bits(at.z, light))));
        let second = mix(first);
        let unit = |bits: u64| (bits & 0xff_ffff) as f32 * (1.0 / 16_777_216.0);
        // Moved by up to half a leaf: what leaves learn does not jump at their borders then.
        let moved = at + Vec3::from_array([0, 1, 2].map(|k| {
            let size = 0.5f32.powi(((depth + 2 - k) / 3) as i32);
            size * (unit(first >> (20 * k)) - 0.5)
        }));
        if moved.min_element() >= 0.0 && moved.max_element() < 1.0 {
            leaf = self.find(moved, root).0;
        }
        self.leaves[leaf].records.add(direction, [unit(second), unit(second >> 32)], amount);
    }

    /// Learns from what a pass of so many samples per pixel recorded: the guide for the next pass.
    #[must_use]
    pub fn refined(&self, samples: u32) -> Self {
        let most_records = (knob("GC", RECORDS_TO_DIVIDE) * f64::from(samples).sqrt()) as u64;
        let mut next =
            Self { corner: self.corner, inverse_size: self.inverse_size, nodes: self.nodes.clone(), leaves: Vec::new(), scale: self.scale, normals: self.normals, mode: self.mode };
        let old_leaves = self.nodes.iter().enumerate().filter(|(_, node)| node.children[0] == LEAF);
        let depths = self.depths();
        let mut free = MAX_LEAVES.saturating_sub(self.leaves.len());
        let mut plans = Vec::new();
        for (index, node) in old_leaves {
            let leaf = &self.leaves[node.leaf as usize];
            let parts = next.divide(index, depths[index], leaf.count.load(Ordering::Relaxed), most_records, &mut free);
            plans.push((leaf, parts));
        }
        let leaves: usize = plans.iter().map(|(_, parts)| parts.len()).sum();
        let most_nodes = (MAX_NODES / leaves.max(1)).clamp(64, 1024);
        for (leaf, parts) in plans {
            let directions = leaf.records.directions(self.mode == 2).map(Arc::new).or_else(|| leaf.directions.clone());
            let best = leaf.gains.iter().map(|g| g.load(Ordering::Relaxed)).enumerate().max_by_key(|(_, g)| *g);
            let share = match best {
                Some((i, g)) if g > 0 && knob("GL", 1.0) > 0.0 => SHARES[i],
                _ => knob("GS", 0.5) as f32,
            };
            let lit = leaf.lit.load(Ordering::Relaxed) as f64;
            let most_nodes = most_nodes.min((lit / knob("GM", 8.0)) as usize + 1);
            let records = leaf.records.refined(most_nodes, self.mode == 2, knob("GA", 0.0) / parts.len() as f64);
            for part in parts {
                next.nodes[part].leaf = next.leaves.len() as u32;
                next.leaves.push(Leaf { directions: directions.clone(), records: records.copied(), count: AtomicU64::new(0), lit: AtomicU64::new(0), share, gains: Default::default() });
            }
        }
        next
    }

    /// Divides a leaf with so many records until its parts have few enough; gives the nodes of the parts.
    fn divide(&mut self, index: usize, depth: u32, count: u64, most: u64, free: &mut usize) -> Vec<usize> {
        if count <= most || depth >= MAX_DEPTH || *free == 0 {
            return vec![index];
        }
        *free -= 1;
        let first = self.nodes.len();
        self.nodes.extend([Node { children: [LEAF; 2], leaf: 0 }; 2]);
        self.nodes[index].children = [first as u32, first as u32 + 1];
        let mut parts = self.divide(first, depth + 1, count / 2, most, free);
        parts.extend(self.divide(first + 1, depth + 1, count / 2, most, free));
        parts
    }

    /// The depth of every node. Children come after their parents.
    fn depths(&self) -> Vec<u32> {
        let mut depths = vec![0; self.nodes.len()];
        for (index, node) in self.nodes.iter().enumerate() {
            if node.children[0] != LEAF {
                for child in node.children {
                    depths[child as usize] = depths[index] + 1;
                }
            }
        }
        depths
    }

    /// Parts of space that have their own distribution.
    pub fn leaves(&self) -> usize {
        self.leaves.len()
    }

    /// Nodes of all distributions, records included.
    pub fn directional_nodes(&self) -> usize {
        self.leaves.iter().map(|leaf| leaf.records.len()).sum()
    }

    #[inline]
    fn root(&self, n: Vec3) -> usize {
        if !self.normals {
            return 0;
        }
        let a = n.abs();
        let axis = if a.x >= a.y && a.x >= a.z { 0 } else if a.y >= a.z { 1 } else { 2 };
        2 * axis + usize::from(n[axis] < 0.0)
    }

    /// A point within the unit cube.
    #[inline]
    fn normalized(&self, p: Vec3) -> Vec3 {
        // The order of the comparisons makes a NaN zero.
        ((p - self.corner) * self.inverse_size).max(Vec3::ZERO).min(Vec3::splat(ONE_MINUS_EPSILON))
    }

    /// The leaf around a point of the unit cube, and its depth.
    #[inline]
    fn find(&self, at: Vec3, root: usize) -> (usize, u32) {
        let mut at = at.to_array();
        let (mut index, mut depth, mut axis) = (root, 0, 0);
        loop {
            let node = &self.nodes[index];
            if node.children[0] == LEAF {
                return (node.leaf as usize, depth);
            }
            let x = 2.0 * at[axis];
            let upper = x >= 1.0;
            at[axis] = if upper { x - 1.0 } else { x };
            index = node.children[usize::from(upper)] as usize;
            axis = if axis == 2 { 0 } else { axis + 1 };
            depth += 1;
        }
    }
}
