//! Cumulative distributions that are searched without branches.

use pulp::cast;
use pulp::x86::V4;

use crate::math::float::ONE_MINUS_EPSILON;

/// The whole of a distribution. Limits count in units of `1 / WHOLE`: the density is then exactly that of the sampling,
/// and an entry of positive weight never rounds to nothing.
const WHOLE: u32 = u32::MAX;

/// Keys of a node: a cache line of them.
const FANOUT: usize = 16;

/// Distributions of equal length, each a search tree of two levels whose nodes have [`FANOUT`] keys. The root is as
/// many nodes as it takes, which are searched side by side; a search waits for one node of it and for one leaf.
#[derive(Clone, Debug)]
pub struct Table {
    len: usize,
    /// Nodes of each root, and leaves of each tree.
    root_nodes: usize,
    leaf_nodes: usize,
    /// The upper limits of the last entries of each leaf.
    roots: Vec<Keys>,
    /// The upper limits of entries, within `[0, WHOLE]`. Unused keys, here as in roots, are [`WHOLE`].
    leaves: Vec<Keys>,
}

#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct Keys([u32; FANOUT]);

impl Keys {
    fn of(limits: &[u32]) -> Self {
        Self(std::array::from_fn(|i| limits.get(i).copied().unwrap_or(WHOLE)))
    }
}

/// Counts keys.
pub trait CountKeys: Copy {
    /// How many keys are not above a limit.
    fn count_up_to(self, keys: &[u32; FANOUT], limit: u32) -> u32;
}

/// On every processor.
#[derive(Clone, Copy)]
pub struct Portable;

impl CountKeys for Portable {
    #[inline(always)]
    fn count_up_to(self, keys: &[u32; FANOUT], limit: u32) -> u32 {
        keys.iter().map(|&key| u32::from(key <= limit)).sum()
    }
}

impl CountKeys for V4 {
    // One comparison gives a bit for each key, which the compiler does not find by itself.
    #[inline(always)]
    fn count_up_to(self, keys: &[u32; FANOUT], limit: u32) -> u32 {
        let limits = self.avx512f._mm512_set1_epi32(limit as i32);
        self.avx512f._mm512_cmple_epu32_mask(cast(*keys), limits).count_ones()
    }
}

/// Where in an entry a number is, in `[0, 1)`, and the entry's probability.
#[derive(Clone, Copy)]
pub struct Inverse {
    pub within: f32,
    pub pmf: f64,
}

/// `u` in units of `1 / WHOLE`.
#[inline(always)]
fn scaled(u: f32) -> f64 {
    f64::from(u) * f64::from(WHOLE)
}

/// Inverts a distribution at `u`, which is between the limits of an entry.
#[inline(always)]
pub fn invert(u: f32, [lower, upper]: [u32; 2]) -> Inverse {
    let mass = f64::from(upper - lower);
    let within = ((scaled(u) - f64::from(lower)) / mass) as f32;
    Inverse { within: within.min(ONE_MINUS_EPSILON), pmf: mass * (1.0 / f64::from(WHOLE)) }
}

impl Table {
    /// Room for `count` distributions of `len` entries.
    pub fn new(len: usize, count: usize) -> Self {
        let leaf_nodes = len.div_ceil(FANOUT);
        let root_nodes = leaf_nodes.div_ceil(FANOUT);
        let (roots, leaves) = (Vec::with_capacity(root_nodes * count), Vec::with_capacity(leaf_nodes * count));
        Self { len, root_nodes, leaf_nodes, roots, leaves }
    }

    /// Entries of each distribution.
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.len
    }

    /// Adds one distribution. Each positive weight has at least one unit; those and the rest, in proportion, fill the
    /// whole. Without any positive weight all is in the last entry.
    pub fn push(&mut self, weights: impl Iterator<Item = f64> + Clone) {
        let positive = weights.clone().filter(|w| *w > 0.0).count();
        let total: f64 = weights.clone().sum();
        let free = f64::from(WHOLE) - positive as f64;
        let (mut units, mut sum) = (0u64, 0.0);
        let limit = |w: f64| {
            if w > 0.0 {
                units += 1;
                sum += w;
            }
            let limit = if total > 0.0 { units + (sum / total * free).round() as u64 } else { 0 };
            limit.min(u64::from(WHOLE)) as u32
        };
        let mut limits: Vec<u32> = weights.map(limit).collect();
        if total <= 0.0 {
            limits[self.len - 1] = WHOLE;
        }
        self.leaves.extend(limits.chunks(FANOUT).map(Keys::of));
        let last: Vec<u32> = limits.chunks(FANOUT).filter_map(|limits| limits.last().copied()).collect();
        self.roots.extend(last.chunks(FANOUT).map(Keys::of));
    }

    /// The limits of an entry.
    #[inline(always)]
    fn limits(&self, which: usize, index: usize) -> [u32; 2] {
        let leaves = &self.leaves[which * self.leaf_nodes..][..self.leaf_nodes];
        let upper = |index: usize| leaves[index / FANOUT].0[index % FANOUT];
        [if index == 0 { 0 } else { upper(index - 1) }, upper(index)]
    }

    /// The probability of an entry.
    #[inline]
    pub fn pmf(&self, which: usize, index: usize) -> f64 {
        let [lower, upper] = self.limits(which, index);
        f64::from(upper - lower) * (1.0 / f64::from(WHOLE))
    }

    /// The entry of a distribution with `lower <= u < upper`, `u` in `[0, 1)`, and its limits.
    #[inline(always)]
    pub fn find(&self, by: impl CountKeys, which: usize, u: f32) -> (usize, [u32; 2]) {
        let unit = scaled(u) as u32;
        let root = &self.roots[which * self.root_nodes..][..self.root_nodes];
        let leaf: u32 = root.iter().map(|keys| by.count_up_to(&keys.0, unit)).sum();
        let before = by.count_up_to(&self.leaves[which * self.leaf_nodes + leaf as usize].0, unit);
        let index = leaf as usize * FANOUT + before as usize;
        (index, self.limits(which, index))
    }
}
