//! Learning where light comes from while a picture is made ("Practical Path Guiding for Efficient Light-Transport
//! Simulation", 2017, and "'Practical Path Guiding' in Production", 2019).
//!
//! For surfaces that face each of six sides, a binary tree divides space; each of its leaves has a distribution of
//! directions, in proportion to the radiance that paths scattered there received from them. Paths record into sums of
//! whole numbers, so what is learned does not depend on threads. From time to time leaves with many records are
//! divided, and the directions of each where the light is.

mod directions;
mod lookups;
mod quadtree;
mod space;
mod state;
#[cfg(test)]
mod tests;

pub use directions::{DirectionDistribution, GuideSample};
pub use lookups::{DirectionLookups, Distributions, GuideSampleRows};
pub use space::TreePoint;

use std::sync::atomic::{AtomicI64, AtomicU64, Ordering};

use crate::math::float::ONE_MINUS_EPSILON;
use crate::math::prefetch::prefetch;
use crate::math::random::hash64;
use crate::math::rows::BATCH;
use crate::math::{Aabb, Vec3};
use directions::square_of;
use quadtree::{Descent, DirectionRecords};
use space::{MAX_DEPTH, Node, SpaceTrees};

/// Records of a leaf beyond which it is divided, after one sample per pixel; after `n` it is `sqrt(n)` times as many.
const RECORDS_TO_DIVIDE: f64 = 4000.0;

/// Leaves of all trees over space together at most.
const MAX_LEAVES: usize = 1 << 13;

/// Their nodes at most: each division makes two nodes of a leaf.
const MAX_SPATIAL_NODES: usize = 2 * MAX_LEAVES - ROOTS;

/// Nodes of all distributions together at most. One takes 80 bytes, with its part of the records: 80 MiB, and twice as
/// much while they are refined.
const MAX_NODES: usize = 1 << 20;

/// Nodes of a single distribution at most: each divides a cell in four.
const MAX_NODES_OF_LEAF: usize = (directions::MAX_CELLS - 1) / 3;

/// Whole numbers that a typical record is worth.
const UNITS: f32 = 65_536.0;

/// What a single record counts at most, in typical ones: 2^27 such fit into a sum.
const LARGEST: f32 = 1_048_576.0;

/// The BSDF sampling fraction of regions where none has been learned; the other directions are sampled from the guide.
const BSDF_SAMPLING_FRACTION: f32 = 0.5;

/// The fractions that are tried instead. With smaller ones, light that is not in the guide would get too large a weight
/// when a path meets it.
const OTHER_FRACTIONS: [f32; 4] = [0.3, 0.4, 0.7, 0.9];

/// Trees over space, one for each side that surfaces face.
const ROOTS: usize = 6;

/// What has been learned of a part of space. Apart from what is being learned: a thread that writes one would slow down
/// those that read the other.
#[derive(Clone, Debug)]
struct Region {
    directions: Option<DirectionDistribution>,
    bsdf_sampling_fraction: f32,
}

/// What is being learned of a part of space.
#[derive(Debug, Default)]
struct Leaf {
    records: DirectionRecords,
    count: AtomicU64,
    /// How much better each of [`OTHER_FRACTIONS`] is than half, as the mean logarithm of the density weighted by
    /// light.
    gains: [AtomicI64; 4],
}

impl Leaf {
    /// Adds light whose direction the BSDF and the guide choose with these densities.
    fn add_gains(&self, [bsdf, guide]: [f32; 2], amount: f32) {
        if !((bsdf + guide).is_finite() && bsdf + guide > 0.0) {
            return;
        }
        let usual = BSDF_SAMPLING_FRACTION * bsdf + (1.0 - BSDF_SAMPLING_FRACTION) * guide;
        for (sum, fraction) in self.gains.iter().zip(OTHER_FRACTIONS) {
            let gain = ((fraction * bsdf + (1.0 - fraction) * guide) / usual).ln();
            sum.fetch_add((amount * gain) as i64, Ordering::Relaxed);
        }
    }

    /// The best BSDF sampling fraction by the records.
    fn best_bsdf_sampling_fraction(&self) -> f32 {
        let best = self.gains.iter().zip(OTHER_FRACTIONS).max_by_key(|(gain, _)| gain.load(Ordering::Relaxed));
        best.filter(|(gain, _)| gain.load(Ordering::Relaxed) > 0)
            .map_or(BSDF_SAMPLING_FRACTION, |(_, fraction)| fraction)
    }
}

/// What paths have learned of the light at a surface.
#[derive(Clone, Copy, Debug)]
pub struct GuideRegion<'a> {
    /// Where it comes from.
    pub directions: &'a DirectionDistribution,
    /// Fraction of directions to be sampled from the BSDF.
    pub bsdf_sampling_fraction: f32,
}

/// Light that a path found.
#[derive(Clone, Copy, Debug)]
pub struct Record {
    /// Where it was scattered.
    pub p: Vec3,
    /// The normal there, on the side of the path.
    pub n: Vec3,
    /// The direction it came from.
    pub direction: Vec3,
    /// What was scattered towards the path, over the density with which the direction was chosen.
    pub light: f32,
    /// The densities with which the BSDF and the guide choose the direction, if the guide had a distribution.
    pub densities: Option<[f32; 2]>,
}

/// A record on its way to the cell that it belongs to.
#[derive(Clone, Copy, Debug, Default)]
struct PendingRecord {
    leaf: usize,
    /// As a point of the square.
    direction: [f32; 2],
    /// By which parts of a cell the direction is moved.
    jitter: [f32; 2],
    amount: u64,
    cell: Descent,
}

/// The learned distribution of incident radiance over a scene, and the records of the next one.
#[derive(Debug)]
pub struct Guide {
    /// Of the box around the scene, a cube.
    corner: Vec3,
    inverse_size: f32,
    trees: SpaceTrees,
    learned: Vec<Region>,
    leaves: Vec<Leaf>,
    /// From light to whole numbers.
    scale: f32,
}

impl Guide {
    /// An empty guide. `typical` is about the radiance of a typical record: records far below it are lost, far above
    /// are cut. Without it (zero), only places are learned, not light.
    pub fn new(bounds: Aabb, typical: f32) -> Self {
        let mut guide = Self {
            corner: Vec3::ZERO,
            inverse_size: 0.0,
            trees: SpaceTrees::undivided(),
            learned: vec![Region { directions: None, bsdf_sampling_fraction: BSDF_SAMPLING_FRACTION }; ROOTS],
            leaves: (0..ROOTS).map(|_| Leaf::default()).collect(),
            scale: scale_of(typical),
        };
        guide.set_bounds(bounds);
        guide
    }

    /// Sets the box around the scene, on which regions lie. Those of a guide that has learned keep their data.
    pub fn set_bounds(&mut self, bounds: Aabb) {
        let size = bounds.size().max_element();
        let is_known = size > 0.0 && size < f32::INFINITY && bounds.min.is_finite();
        (self.corner, self.inverse_size) = if is_known { (bounds.min, 1.0 / size) } else { (Vec3::ZERO, 0.0) };
    }

    /// Sets the [typical](Self::new) light.
    pub fn set_typical(&mut self, typical: f32) {
        self.scale = scale_of(typical);
    }

    /// Whether light is learned, not places alone.
    pub fn has_radiance_scale(&self) -> bool {
        self.scale > 0.0
    }

    /// The guide without its records, which takes no further ones.
    #[must_use]
    pub fn into_trained(self) -> Self {
        Self { leaves: Vec::new(), ..self }
    }

    /// What is known of the light at a surface whose normal, on the side of the path, is `n`; `None` if nothing.
    pub fn at(&self, p: Vec3, n: Vec3) -> Option<GuideRegion<'_>> {
        self.region(self.find_region(self.tree_point(p, n)))
    }

    /// Where a surface is in the trees over space.
    #[inline(always)]
    pub fn tree_point(&self, p: Vec3, n: Vec3) -> TreePoint {
        TreePoint::new(root(n), self.normalized(p))
    }

    /// The number of the [region](Self::region) around a surface; it is being loaded then.
    #[inline]
    pub fn find_region(&self, point: TreePoint) -> u32 {
        let region = self.trees.find(point);
        prefetch(&self.learned, region);
        region as u32
    }

    /// What is known of the light in a region; `None` if nothing.
    #[inline]
    pub fn region(&self, region: u32) -> Option<GuideRegion<'_>> {
        let learned = &self.learned[region as usize];
        let directions = learned.directions.as_ref()?;
        Some(GuideRegion { directions, bsdf_sampling_fraction: learned.bsdf_sampling_fraction })
    }

    /// Learns from light. What is not a finite number above zero counts as no light. Equal records are treated alike.
    pub fn record(&self, records: &[Record]) {
        // Each step loads what the next needs: the records of a chunk wait for memory together.
        for records in records.chunks(BATCH) {
            let mut leaves = [0; BATCH];
            for (record, leaf) in records.iter().zip(&mut leaves) {
                *leaf = self.trees.find(TreePoint::new(root(record.n), self.normalized(record.p)));
                prefetch(&self.leaves, *leaf);
            }
            let mut pending = [PendingRecord::default(); BATCH];
            let mut count = 0;
            for (record, &leaf) in records.iter().zip(&leaves) {
                if let Some(next) = self.count_record(record, leaf) {
                    prefetch(&self.leaves, next.leaf);
                    pending[count] = next;
                    count += 1;
                }
            }
            let pending = &mut pending[..count];
            pending.iter().for_each(|record| self.leaves[record.leaf].records.prefetch());
            self.descend(pending);
            for record in &mut *pending {
                record.cell = record.cell.jittered(record.direction, record.jitter);
            }
            self.descend(pending);
            for record in pending {
                self.leaves[record.leaf].records.add(&record.cell, record.amount);
            }
        }
    }

    /// Counts a record in the leaf around it; the result is where its light belongs, if it has any.
    fn count_record(&self, record: &Record, leaf: usize) -> Option<PendingRecord> {
        let Record { direction, light, densities, .. } = *record;
        self.leaves[leaf].count.fetch_add(1, Ordering::Relaxed);
        if !(light > 0.0 && light < f32::INFINITY && direction.is_finite()) {
            return None;
        }
        let at = self.normalized(record.p);
        let amount = (light * self.scale).min(LARGEST * UNITS);
        if let Some(densities) = densities {
            self.leaves[leaf].add_gains(densities, amount);
        }
        // Random numbers of the record itself.
        let bits = |a: f32, b: f32| u64::from(a.to_bits()) << 32 | u64::from(b.to_bits());
        let first = hash64(bits(at.x, direction.x) ^ hash64(bits(at.y, direction.y) ^ hash64(bits(at.z, light))));
        let second = hash64(first);
        let unit = |bits: u64| (bits & 0xf_ffff) as f32 * (1.0 / 1_048_576.0);

        // Moved by up to half a leaf: what leaves learn does not jump at their borders then.
        let depth = self.trees.depth(leaf);
        let size = |divisions: u32| f32::from_bits((127 - divisions) << 23);
        let jitter = |k: u32| size((depth + 2 - k) / 3) * (unit(first >> (20 * k)) - 0.5);
        let moved = at + Vec3::new(jitter(0), jitter(1), jitter(2));
        let is_inside = moved.min_element() >= 0.0 && moved.max_element() < 1.0;
        let leaf = if is_inside { self.trees.find(TreePoint::new(root(record.n), moved)) } else { leaf };
        let (direction, _) = square_of(direction);
        let jitter = [unit(second), unit(second >> 32)];
        Some(PendingRecord { leaf, direction, jitter, amount: amount as u64, cell: Descent::to(direction) })
    }

    /// Descends to the cells of all records, a step of each at a time.
    fn descend(&self, records: &mut [PendingRecord]) {
        let mut lanes: [u8; BATCH] = std::array::from_fn(|lane| lane as u8);
        let mut count = records.len();
        while count > 0 {
            let mut left = 0;
            for i in 0..count {
                let lane = lanes[i];
                let PendingRecord { leaf, cell, .. } = &mut records[usize::from(lane)];
                if self.leaves[*leaf].records.step(cell) {
                    lanes[left] = lane;
                    left += 1;
                }
            }
            count = left;
        }
    }

    /// The guide after training with this many samples per pixel.
    #[must_use]
    pub fn refined(&self, samples: u32) -> Self {
        let most_records = (RECORDS_TO_DIVIDE * f64::from(samples).sqrt()) as u64;
        let mut nodes = self.trees.nodes().to_vec();
        let (mut learned, mut next_leaves) = (Vec::new(), Vec::new());
        let mut plans = Vec::new();
        for (index, node) in self.trees.nodes().iter().enumerate() {
            let Some(number) = node.leaf() else { continue };
            let leaf = &self.leaves[number];
            let count = leaf.count.load(Ordering::Relaxed);
            plans.push((leaf, divide(&mut nodes, index, self.trees.depth(number), count, most_records)));
        }
        let leaves: usize = plans.iter().map(|(_, parts)| parts.len()).sum();
        let most_nodes = (MAX_NODES / leaves.max(1)).min(MAX_NODES_OF_LEAF);
        for (leaf, parts) in plans {
            let directions = leaf.records.directions();
            let records = leaf.records.refined(most_nodes, parts.len());
            let (count, bsdf_sampling_fraction) =
                (leaf.count.load(Ordering::Relaxed) / parts.len() as u64, leaf.best_bsdf_sampling_fraction());
            for &part in &parts {
                nodes[part] = Node::of_leaf(next_leaves.len());
                learned.push(Region { directions: directions.clone(), bsdf_sampling_fraction });
                next_leaves.push(Leaf {
                    records: records.copied(),
                    count: AtomicU64::new(count),
                    // What was better before need not be it for what is known now.
                    gains: [0, 1, 2, 3]
                        .map(|k| AtomicI64::new(leaf.gains[k].load(Ordering::Relaxed) / (2 * parts.len() as i64))),
                });
            }
        }
        Self { trees: SpaceTrees::of_nodes(nodes), learned, leaves: next_leaves, ..*self }
    }

    /// Parts of space that have their own distribution.
    pub fn leaves(&self) -> usize {
        self.leaves.len()
    }

    /// Nodes of all distributions.
    pub fn directional_nodes(&self) -> usize {
        self.leaves.iter().map(|leaf| leaf.records.node_count()).sum()
    }

    /// A point within the unit cube.
    #[inline(always)]
    fn normalized(&self, p: Vec3) -> Vec3 {
        let inside = |k: usize| {
            let x = (p[k] - self.corner[k]) * self.inverse_size;
            // NaN is not above zero either.
            if x > 0.0 { x.min(ONE_MINUS_EPSILON) } else { 0.0 }
        };
        Vec3::new(inside(0), inside(1), inside(2))
    }
}

/// Divides a leaf with `count` records until its parts have few enough; returns the nodes of the parts.
fn divide(nodes: &mut Vec<Node>, index: usize, depth: u32, count: u64, most: u64) -> Vec<usize> {
    if count <= most || depth >= MAX_DEPTH || nodes.len() >= MAX_SPATIAL_NODES {
        return vec![index];
    }
    let first = nodes.len();
    // Leaves until they are divided themselves.
    nodes.extend([Node::of_leaf(0); 2]);
    nodes[index] = Node(first as u32);
    let mut parts = divide(nodes, first, depth + 1, count / 2, most);
    parts.extend(divide(nodes, first + 1, depth + 1, count / 2, most));
    parts
}

/// Whole numbers per light; zero if nothing is known of the light.
fn scale_of(typical: f32) -> f32 {
    let scale = UNITS / typical;
    if scale > 0.0 && scale < f32::INFINITY { scale } else { 0.0 }
}

/// The tree for surfaces with this normal: walls have two sides, and light below a surface does not reach it.
#[inline(always)]
fn root(n: Vec3) -> u32 {
    let a = n.abs();
    let is_x = (a.x >= a.y) & (a.x >= a.z);
    let axis = if is_x { 0 } else { 1 + u32::from(a.y < a.z) };
    let component = if is_x {
        n.x
    } else if a.y < a.z {
        n.z
    } else {
        n.y
    };
    2 * axis + u32::from(component < 0.0)
}
