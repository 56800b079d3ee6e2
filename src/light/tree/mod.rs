//! A tree over lights that chooses one in proportion to what about arrives at a point (Conty Estevez and Kulla,
//! "Importance Sampling of Many Lights with Adaptive Tree Splitting").
//!
//! Nodes have eight children, whose bounds are compared side by side. Where the paper takes several lights from groups
//! that are near, one light is chosen from the *cut*: near groups are replaced by their children until what is left is
//! far enough for one estimate to stand for all of it. Against descending straight from the root, the error on a room
//! with 320 lights halves at a quarter more time. A tree of up to eight lights is one node, and its lights are weighed
//! for many points at once.

mod build;
mod node;
mod rows;
#[cfg(test)]
mod tests;

use crate::math::float::ONE_MINUS_EPSILON;
use crate::math::vectorize::vectorize;
use crate::math::{DVec3, Vec3};
use arrayvec::ArrayVec;
use node::{Node, WIDTH};

/// No node.
const NONE: u32 = u32::MAX;

/// Marks a child that is a light.
const LEAF: u32 = 1 << 31;

/// Nodes that a cut replaces by their children at most.
const MAX_OPEN: usize = 16;

/// Where light is to arrive.
#[derive(Clone, Copy, Debug)]
pub struct LightSampleContext {
    /// The point.
    pub p: DVec3,
    /// Unit normal of the side that light must reach; zero where it may come from either side.
    pub n: Vec3,
}

impl LightSampleContext {
    /// Light that may come from either side.
    pub fn from_any_side(p: DVec3) -> Self {
        Self { p, n: Vec3::ZERO }
    }
}

/// A light chosen by the tree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct TreeChoice {
    /// Index of the light.
    pub light: u32,
    /// Probability of the choice.
    pub pmf: f32,
}

/// Place of a light or a node: which child of which node it is.
#[derive(Clone, Copy, Debug)]
struct Place {
    node: u32,
    slot: u32,
}

/// The tree.
#[derive(Clone, Debug)]
pub(super) struct LightTree {
    nodes: Vec<Node>,
    /// By node; the root's is [`NONE`].
    node_places: Vec<Place>,
    /// By light; [`NONE`] for those that are not in the tree.
    light_places: Vec<Place>,
}

/// The root and near nodes below it, with the importance of those children that are not in the cut themselves.
#[derive(Default)]
struct Cut {
    nodes: ArrayVec<u32, MAX_OPEN>,
    importances: ArrayVec<[f32; WIDTH], MAX_OPEN>,
    sums: ArrayVec<f32, MAX_OPEN>,
    total: f32,
}

impl LightTree {
    /// Finds the cut for a point, in an empty one; false where nothing arrives.
    #[inline(always)]
    fn find_cut(&self, p: Vec3, n: Vec3, cut: &mut Cut) -> bool {
        cut.nodes.push(0);
        let mut i = 0;
        while i < cut.nodes.len() {
            let node = &self.nodes[cut.nodes[i] as usize];
            let mut found = node.importances(p, n);
            while found.near != 0 {
                let slot = found.near.trailing_zeros() as usize;
                found.near &= found.near - 1;
                let child = node.child(slot);
                if child & LEAF == 0 && found.of[slot] > 0.0 && cut.nodes.len() < MAX_OPEN {
                    found.of[slot] = 0.0;
                    cut.nodes.push(child);
                }
            }
            let sum = found.of.iter().sum();
            cut.importances.push(found.of);
            cut.sums.push(sum);
            cut.total += sum;
            i += 1;
        }
        cut.total > 0.0
    }

    /// A light, `u` in `[0, 1)`; `None` where nothing arrives.
    #[inline]
    pub fn choose(&self, from: &LightSampleContext, u: f64) -> Option<TreeChoice> {
        vectorize!(choose(self, from.p.as_vec3(), from.n, u))
    }

    /// The probability with which [`choose`](Self::choose) finds a light.
    pub fn pmf(&self, from: &LightSampleContext, light: u32) -> f32 {
        vectorize!(pmf(self, from.p.as_vec3(), from.n, light))
    }

    /// Bytes of the tables.
    #[cfg(test)]
    pub fn memory_bytes(&self) -> usize {
        size_of_val(self.nodes.as_slice())
            + size_of_val(self.node_places.as_slice())
            + size_of_val(self.light_places.as_slice())
    }
}

#[inline(always)]
fn choose(tree: &LightTree, p: Vec3, n: Vec3, u: f64) -> Option<TreeChoice> {
    let mut cut = Cut::default();
    if !tree.find_cut(p, n, &mut cut) {
        return None;
    }
    let open = pick(&cut.sums, u * f64::from(cut.total))?;
    let importances = &cut.importances[open.index];
    let mut picked = pick(importances, open.within)?;
    let mut pmf = importances[picked.index] / cut.total;
    let mut child = tree.nodes[cut.nodes[open.index] as usize].child(picked.index);
    while child & LEAF == 0 {
        let node = &tree.nodes[child as usize];
        let importances = node.importances(p, n).of;
        let total = total(&importances)?;
        picked = pick(&importances, picked.share() * f64::from(total))?;
        pmf *= importances[picked.index] / total;
        child = node.child(picked.index);
    }
    Some(TreeChoice { light: child & !LEAF, pmf })
}

#[inline(always)]
fn pmf(tree: &LightTree, p: Vec3, n: Vec3, light: u32) -> f32 {
    let mut place = tree.light_places[light as usize];
    if place.node == NONE {
        return 0.0;
    }
    let mut cut = Cut::default();
    if !tree.find_cut(p, n, &mut cut) {
        return 0.0;
    }
    let mut pmf = 1.0;
    // Up to the cut, which holds the root.
    loop {
        if let Some(open) = cut.nodes.iter().position(|&node| node == place.node) {
            return pmf * cut.importances[open][place.slot as usize] / cut.total;
        }
        let importances = tree.nodes[place.node as usize].importances(p, n).of;
        let Some(total) = total(&importances) else { return 0.0 };
        pmf *= importances[place.slot as usize] / total;
        place = tree.node_places[place.node as usize];
    }
}

/// The sum if something can be chosen in proportion to it.
#[inline(always)]
fn total(importances: &[f32; WIDTH]) -> Option<f32> {
    let total = importances.iter().sum();
    (total > 0.0).then_some(total)
}

/// An entry found by [`pick`].
#[derive(Clone, Copy)]
struct Picked {
    index: usize,
    /// How far into the entry, from 0 to below `size`.
    within: f64,
    size: f64,
}

impl Picked {
    /// How far into the entry, in `[0, 1)`.
    #[inline(always)]
    fn share(&self) -> f64 {
        self.within / self.size
    }
}

/// The entry in which `x` falls if all are laid end to end; never an entry of zero. `None` if all are.
#[inline(always)]
fn pick(entries: &[f32], x: f64) -> Option<Picked> {
    let mut lower = 0.0;
    let mut found = None;
    for (index, &entry) in entries.iter().enumerate() {
        let size = f64::from(entry);
        // Rounding of the sum may put x a little behind the last entry: it then keeps that.
        if size > 0.0 && (found.is_none() || x >= lower) {
            found = Some(Picked { index, within: (x - lower).min(size * f64::from(ONE_MINUS_EPSILON)), size });
        }
        lower += size;
    }
    found
}
