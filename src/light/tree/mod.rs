//! A tree over lights that chooses one in proportion to what about arrives at a point (Conty Estevez and Kulla,
//! "Importance Sampling of Many Lights with Adaptive Tree Splitting").
//!
//! Nodes have eight children, whose bounds are compared side by side. Where the paper takes several lights from groups
//! that are near, one light is chosen from the *cut*: near groups are replaced by their children until what is left is
//! far enough for one estimate to stand for all of it. Against descending straight from the root, the error on a room
//! with 320 lights halves at a quarter more time. Many points choose at once, and their nodes take turns. A tree of up
//! to eight lights is one node: its lights are weighed for a vector of points each.

mod batch;
mod build;
mod cuts;
mod node;
mod pick;
mod rows;
#[cfg(test)]
mod tests;

pub use rows::LightTreeScratch;

use crate::math::float::ONE_MINUS_EPSILON;
use crate::math::vectorize::vectorize;
use crate::math::{DVec3, Vec3};
use cuts::{OneCut, node_pmf};
use node::{Node, WIDTH};
use pick::{pick, total};

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

/// As [`LightSampleContext`], for the tree.
#[derive(Clone, Copy)]
struct ShadingPoint {
    p: Vec3,
    n: Vec3,
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

impl LightTree {
    /// A light, `u` in `[0, 1)`; `None` where nothing arrives.
    #[inline]
    pub fn choose(&self, from: &LightSampleContext, u: f64) -> Option<TreeChoice> {
        vectorize!(choose(self, ShadingPoint { p: from.p.as_vec3(), n: from.n }, u))
    }

    /// The probability with which [`choose`](Self::choose) finds a light.
    pub fn pmf(&self, from: &LightSampleContext, light: u32) -> f32 {
        vectorize!(pmf(self, ShadingPoint { p: from.p.as_vec3(), n: from.n }, light))
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
fn choose(tree: &LightTree, point: ShadingPoint, u: f64) -> Option<TreeChoice> {
    let u = u.min(f64::from(ONE_MINUS_EPSILON));
    let (mut node, mut importances, mut u, mut pmf) = if tree.nodes.len() == 1 {
        (0, tree.nodes[0].importances(point), u, 1.0)
    } else {
        let mut cut = OneCut::default();
        cut.push(point, u);
        cut.expand(tree);
        let (i, picked) = cut.pick();
        (cut.nodes[i], cut.importances[i], picked.share, picked.pmf)
    };
    loop {
        let picked = pick(&importances, u);
        pmf *= picked.pmf;
        if pmf <= 0.0 {
            return None;
        }
        node = tree.nodes[node as usize].child(picked.slot as usize);
        if node & LEAF != 0 {
            return Some(TreeChoice { light: node & !LEAF, pmf });
        }
        (importances, u) = (tree.nodes[node as usize].importances(point), picked.share);
    }
}

#[inline(always)]
fn pmf(tree: &LightTree, point: ShadingPoint, light: u32) -> f32 {
    let Place { mut node, mut slot } = tree.light_places[light as usize];
    if node == NONE {
        return 0.0;
    }
    if tree.nodes.len() == 1 {
        return pmf_of_child(&tree.nodes[0].importances(point), slot);
    }
    let mut cut = OneCut::default();
    cut.push(point, 0.0);
    cut.expand(tree);
    let mut pmf = 1.0;
    // Up to the cut, which holds the root.
    loop {
        if let Some(importances) = cut.find(node) {
            return pmf * pmf_of_child(importances, slot) * node_pmf(total(importances), cut.totals[0]);
        }
        pmf *= pmf_of_child(&tree.nodes[node as usize].importances(point), slot);
        Place { node, slot } = tree.node_places[node as usize];
    }
}

/// The probability with which [`pick()`] finds a child.
#[inline(always)]
fn pmf_of_child(importances: &[f32; WIDTH], slot: u32) -> f32 {
    let total = total(importances);
    if total > 0.0 { importances[slot as usize] / total } else { 0.0 }
}
