//! The binary hierarchy: binned surface area heuristic (Wald, "On fast Construction of SAH-based Bounding Volume
//! Hierarchies"), built in parallel, the same for any number of threads.

use std::ops::Range;

use glam::Vec3A;

use crate::math::Aabb;

/// Bins along each axis.
const BINS: usize = 16;

/// Below this many references a subtree is built by one thread.
const PARALLEL: usize = 8_192;

/// Below this depth splits halve the references, so that the depth is bounded for any input.
const MAX_SAH_DEPTH: u32 = 48;

/// Cost of a leaf's test of up to [`BLOCK`] items, in units of the cost of a node.
pub(super) const BLOCK_COST: f32 = 1.2;

/// Items that are tested side by side.
pub(super) const BLOCK: usize = 4;

/// The most items in a leaf.
pub(in crate::accel) const MAX_LEAF: usize = 4;

/// An item to be sorted into the hierarchy.
#[derive(Clone, Copy, Debug)]
pub(in crate::accel) struct Reference {
    pub bounds: Aabb,
    pub item: u32,
}

/// A node of the binary hierarchy.
#[derive(Clone, Copy, Debug)]
pub(in crate::accel) struct BinaryNode {
    pub bounds: Aabb,
    /// Of a leaf, [`LEAF`] with its first reference, and how many it has; of an inner node, its children.
    links: [u32; 2],
}

/// What a [`BinaryNode`] has below it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in crate::accel) enum BinaryKind {
    /// The indices of two nodes.
    Inner([usize; 2]),
    /// References.
    Leaf(Range<usize>),
}

/// Marks the first link of a leaf.
const LEAF: u32 = 1 << 31;

impl BinaryNode {
    const UNUSED: Self = Self { bounds: Aabb::EMPTY, links: [LEAF, 0] };

    pub fn inner(bounds: Aabb, children: [usize; 2]) -> Self {
        Self { bounds, links: children.map(|child| child as u32) }
    }

    fn leaf(bounds: Aabb, first: usize, count: usize) -> Self {
        Self { bounds, links: [LEAF | first as u32, count as u32] }
    }

    #[inline(always)]
    pub fn kind(&self) -> BinaryKind {
        let [first, second] = self.links.map(|link| (link & !LEAF) as usize);
        if self.links[0] & LEAF == 0 {
            BinaryKind::Inner([first, second])
        } else {
            BinaryKind::Leaf(first..first + second)
        }
    }
}

/// A binary hierarchy; the root is the first node.
pub(in crate::accel) struct Binary {
    pub nodes: Vec<BinaryNode>,
    pub references: Vec<Reference>,
}

impl Binary {
    /// Builds the hierarchy; `references` must not be empty. `is_alone` is true for items that may not share a leaf
    /// with others.
    pub fn new(references: Vec<Reference>, is_alone: impl Fn(u32) -> bool + Sync) -> Self {
        Self::from_depth(references, is_alone, 0)
    }

    /// As [`new`](Self::new), but every split halves the references.
    pub fn halved(references: Vec<Reference>, is_alone: impl Fn(u32) -> bool + Sync) -> Self {
        Self::from_depth(references, is_alone, MAX_SAH_DEPTH)
    }

    fn from_depth(mut references: Vec<Reference>, is_alone: impl Fn(u32) -> bool + Sync, depth: u32) -> Self {
        let mut nodes = vec![BinaryNode::UNUSED; 2 * references.len() - 1];
        Builder { is_alone }.build(&mut nodes, &mut references, 0, 0, depth);
        Self { nodes: without_unused(&nodes), references }
    }
}

/// Without the nodes that the builder left free: it sets as many aside as the references of a subtree may need.
fn without_unused(nodes: &[BinaryNode]) -> Vec<BinaryNode> {
    let is_used = |node: &BinaryNode| node.kind() != BinaryNode::UNUSED.kind();
    let mut count = 0;
    let mut indices = Vec::with_capacity(nodes.len());
    for node in nodes {
        indices.push(count);
        count += u32::from(is_used(node));
    }
    let mut used = Vec::with_capacity(count as usize);
    for node in nodes.iter().filter(|node| is_used(node)) {
        used.push(match node.kind() {
            BinaryKind::Inner(children) => {
                BinaryNode::inner(node.bounds, children.map(|child| indices[child] as usize))
            }
            BinaryKind::Leaf(_) => *node,
        });
    }
    used
}

struct Builder<F> {
    is_alone: F,
}

/// Padded vectors take one instruction each.
#[derive(Clone, Copy)]
struct Bin {
    min: Vec3A,
    max: Vec3A,
    count: u32,
}

impl Bin {
    const EMPTY: Self = Self { min: Vec3A::INFINITY, max: Vec3A::NEG_INFINITY, count: 0 };

    /// One box.
    #[inline]
    fn of(bounds: &Aabb) -> Self {
        Self { min: bounds.min.into(), max: bounds.max.into(), count: 1 }
    }

    #[inline]
    fn union(&self, other: &Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max), count: self.count + other.count }
    }

    fn bounds(&self) -> Aabb {
        Aabb { min: self.min.into(), max: self.max.into() }
    }

    /// The cost of a leaf, by area.
    fn cost(&self) -> f32 {
        self.bounds().area() * blocks(self.count)
    }
}

impl<F: Fn(u32) -> bool + Sync> Builder<F> {
    /// Builds over `refs`, which start at `first`, into `nodes`, which start at `base`.
    fn build(&self, nodes: &mut [BinaryNode], refs: &mut [Reference], first: usize, base: usize, depth: u32) {
        let extent = Extent::of(refs);
        let split = if self.may_be_leaf(refs) && refs.len() <= 1 { None } else { self.split(refs, &extent, depth) };
        let Some(middle) = split else {
            nodes[0] = BinaryNode::leaf(extent.bounds, first, refs.len());
            return;
        };
        let second = 2 * middle;
        nodes[0] = BinaryNode::inner(extent.bounds, [base + 1, base + second]);
        let (left_nodes, right_nodes) = nodes[1..].split_at_mut(second - 1);
        let (left, right) = refs.split_at_mut(middle);
        let parallel = left.len() + right.len() > PARALLEL;
        let mut build_left = || self.build(left_nodes, left, first, base + 1, depth + 1);
        let mut build_right = || self.build(right_nodes, right, first + middle, base + second, depth + 1);
        if parallel {
            rayon::join(build_left, build_right);
        } else {
            build_left();
            build_right();
        }
    }

    fn may_be_leaf(&self, refs: &[Reference]) -> bool {
        refs.len() == 1 || (refs.len() <= MAX_LEAF && !refs.iter().any(|r| (self.is_alone)(r.item)))
    }

    /// Sorts the references into two parts and gives the size of the first; `None` if they are better left together.
    fn split(&self, refs: &mut [Reference], extent: &Extent, depth: u32) -> Option<usize> {
        let Extent { bounds, centers } = extent;
        let best = if depth < MAX_SAH_DEPTH { best_split(refs, centers) } else { None };
        let leaf_cost = bounds.area() * blocks(refs.len() as u32);
        match best {
            Some(split) if !self.may_be_leaf(refs) || bounds.area() + split.cost < leaf_cost => {
                let binning = Binning::new(centers, split.axis);
                let middle = partition(refs, |r| binning.bin(r) < split.bin);
                (middle > 0 && middle < refs.len()).then_some(middle).or_else(|| halve(refs))
            }
            _ if self.may_be_leaf(refs) => None,
            _ => halve(refs),
        }
    }
}

/// Halves in the present order: where centroids coincide no order is better than another.
#[allow(clippy::unnecessary_wraps)]
fn halve(refs: &mut [Reference]) -> Option<usize> {
    Some(refs.len() / 2)
}

/// Where references are.
struct Extent {
    bounds: Aabb,
    /// The bounds of the centers of their boxes.
    centers: Aabb,
}

impl Extent {
    fn of(refs: &[Reference]) -> Self {
        let (mut all, mut centers) = (Bin::EMPTY, Bin::EMPTY);
        for reference in refs {
            all = all.union(&Bin::of(&reference.bounds));
            let center = reference.bounds.center();
            centers = centers.union(&Bin::of(&Aabb { min: center, max: center }));
        }
        Self { bounds: all.bounds(), centers: centers.bounds() }
    }
}

fn blocks(count: u32) -> f32 {
    count.div_ceil(BLOCK as u32) as f32 * BLOCK_COST
}

struct Split {
    axis: usize,
    /// The first bin of the second part.
    bin: usize,
    cost: f32,
}

/// Maps centroids to bins along one axis.
struct Binning {
    axis: usize,
    min: f32,
    scale: f32,
}

impl Binning {
    fn new(centroids: &Aabb, axis: usize) -> Self {
        let size = centroids.max[axis] - centroids.min[axis];
        Self { axis, min: centroids.min[axis], scale: if size > 0.0 { BINS as f32 / size } else { 0.0 } }
    }

    #[inline]
    fn bin(&self, reference: &Reference) -> usize {
        let at = (reference.bounds.center()[self.axis] - self.min) * self.scale;
        // A NaN of infinity times zero becomes 0.
        (at as usize).min(BINS - 1)
    }
}

fn best_split(refs: &[Reference], centroids: &Aabb) -> Option<Split> {
    let binnings = [0, 1, 2].map(|axis| Binning::new(centroids, axis));
    let mut bins = [[Bin::EMPTY; BINS]; 3];
    for reference in refs {
        let one = Bin::of(&reference.bounds);
        for (bins, binning) in bins.iter_mut().zip(&binnings) {
            let bin = &mut bins[binning.bin(reference)];
            *bin = bin.union(&one);
        }
    }
    let mut best: Option<Split> = None;
    for (axis, bins) in bins.iter().enumerate() {
        if !(centroids.max[axis] > centroids.min[axis]) {
            continue;
        }
        let mut right_cost = [0.0; BINS];
        let mut right = Bin::EMPTY;
        for i in (1..BINS).rev() {
            right = right.union(&bins[i]);
            right_cost[i] = if right.count == 0 { f32::INFINITY } else { right.cost() };
        }
        let mut left = Bin::EMPTY;
        for i in 1..BINS {
            left = left.union(&bins[i - 1]);
            if left.count == 0 {
                continue;
            }
            let cost = left.cost() + right_cost[i];
            if cost < best.as_ref().map_or(f32::INFINITY, |b| b.cost) {
                best = Some(Split { axis, bin: i, cost });
            }
        }
    }
    best
}

/// Moves what belongs to the first part to the front and counts it.
fn partition(refs: &mut [Reference], is_first: impl Fn(&Reference) -> bool) -> usize {
    let (mut i, mut j) = (0, refs.len());
    while i < j {
        if is_first(&refs[i]) {
            i += 1;
        } else {
            j -= 1;
            refs.swap(i, j);
        }
    }
    i
}
