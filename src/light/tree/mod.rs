//! A tree over lights that chooses one in proportion to what about arrives at a point (Conty Estevez and Kulla,
//! "Importance Sampling of Many Lights with Adaptive Tree Splitting").
//!
//! Nodes have eight children, whose bounds are compared side by side. Where the paper takes several lights from groups
//! that are near, one light is chosen from the *cut*: near groups are replaced by their children until what is left is
//! far enough for one estimate to stand for all of it. Against descending straight from the root, the error on a room
//! with 320 lights halves at a quarter more time. Many points choose at once, and their nodes take turns. A tree of up
//! to eight lights is one node: its lights are weighed for a vector of points each.

mod build;
mod cuts;
mod node;
mod pick;
mod rows;
#[cfg(test)]
mod tests;

pub use rows::LightTreeScratch;

use crate::math::vectorize::vectorize;
use crate::math::{DVec3, Vec3};
use cuts::OneCut;
use node::Node;
use pick::total;

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

impl LightTree {
    /// A light, `u` in `[0, 1)`; `None` where nothing arrives.
    #[inline]
    pub fn choose(&self, from: &LightSampleContext, u: f64) -> Option<TreeChoice> {
        let mut cut = OneCut::default();
        cut.push(from.p.as_vec3(), from.n, u);
        let mut found = TreeChoice { light: 0, pmf: 0.0 };
        vectorize!(cut.choose(self, |_, choice| found = choice));
        (found.pmf > 0.0).then_some(found)
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
fn pmf(tree: &LightTree, p: Vec3, n: Vec3, light: u32) -> f32 {
    let mut place = tree.light_places[light as usize];
    if place.node == NONE {
        return 0.0;
    }
    let mut cut = OneCut::default();
    cut.push(p, n, 0.0);
    cut.expand(tree);
    let all = cut.total(0);
    if all <= 0.0 {
        return 0.0;
    }
    let mut pmf = 1.0;
    // Up to the cut, which holds the root.
    loop {
        let in_cut = cut.find(place.node);
        let importances = in_cut.copied().unwrap_or_else(|| tree.nodes[place.node as usize].importances(p, n).of);
        let total = total(&importances);
        if total <= 0.0 {
            return 0.0;
        }
        pmf *= importances[place.slot as usize] / total;
        if in_cut.is_some() {
            return pmf * (f64::from(total) / all) as f32;
        }
        place = tree.node_places[place.node as usize];
    }
}
