//! Statistics of an accelerator: its structure, and the work per ray.

use crate::geometry::Hit;
use crate::id::{InstanceId, PrimId, ShapeId};
use crate::math::{Aabb, Ray};

/// What a tree is built over: a primitive, or in the world's tree an instance of an object.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Item {
    shape: u32,
    prim: u32,
}

/// An [`Item`] taken apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ItemKind {
    /// A triangle of a mesh, or an analytic surface.
    Prim(ShapeId, PrimId),
    /// A placement of an object.
    Instance(InstanceId),
}

impl Item {
    /// No shape has this id: tables as long are rejected at compile.
    const INSTANCE: u32 = u32::MAX;

    /// A primitive.
    pub fn prim(shape: ShapeId, prim: PrimId) -> Self {
        Self { shape: shape.0, prim: prim.0 }
    }

    /// An instance.
    pub fn instance(id: InstanceId) -> Self {
        Self { shape: Self::INSTANCE, prim: id.0 }
    }

    /// What it is.
    #[inline(always)]
    pub fn kind(self) -> ItemKind {
        if self.shape == Self::INSTANCE {
            ItemKind::Instance(InstanceId(self.prim))
        } else {
            ItemKind::Prim(ShapeId(self.shape), PrimId(self.prim))
        }
    }
}

/// One node of a tree.
#[derive(Clone, Copy, Debug)]
pub struct NodeInfo<'a> {
    /// Bounds as the tree keeps them.
    pub bounds: Aabb,
    /// Zero at the root of a tree; a two-level accelerator has the world's tree first, then one for each object.
    pub depth: u32,
    /// The number of children, zero on leaves.
    pub children: u32,
    /// What a leaf refers to, empty on inner nodes; an item may be in several leaves.
    pub items: &'a [Item],
}

/// The work that queries have cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TraversalCounts {
    /// Nodes opened, leaves included.
    pub nodes: u64,
    /// Primitive tests, each lane of a SIMD test that held a primitive counting one.
    pub prims: u64,
}

/// Accelerators whose structure is open: all but Embree.
pub trait Inspect {
    /// Calls `visit` for every node, parents before children, children of one node in order.
    fn visit_nodes(&self, visit: &mut dyn FnMut(&NodeInfo));

    /// [`intersect`](super::Accelerator::intersect) with the same result, adding its work to `counts`.
    fn intersect_counted(&self, ray: &Ray, counts: &mut TraversalCounts) -> Option<Hit>;

    /// [`occluded`](super::Accelerator::occluded) with the same result, adding its work to `counts`.
    fn occluded_counted(&self, ray: &Ray, counts: &mut TraversalCounts) -> bool;
}

/// The cost of opening a node, in the surface area heuristic's own unit.
pub const SAH_NODE_COST: f64 = 1.0;

/// The cost of one primitive test, in units of [`SAH_NODE_COST`].
pub const SAH_PRIM_COST: f64 = 1.0;

/// Figures of a structure.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StructureStats {
    /// Nodes, leaves included.
    pub nodes: u64,
    /// Leaves with at least one item.
    pub leaves: u64,
    /// Leaves without an item.
    pub empty_leaves: u64,
    /// The depth of the deepest node; a root has 0.
    pub max_depth: u32,
    /// Items in all leaves together; more than there are primitives if some are in several leaves.
    pub references: u64,
    /// The most items in one leaf.
    pub max_leaf: u64,
    /// Expected work of a random line that meets the first tree's root: the sum over its nodes of area over the root's
    /// area, times [`SAH_NODE_COST`], plus for each item of a leaf [`SAH_PRIM_COST`] (Goldsmith and Salmon, "Automatic
    /// Creation of Object Hierarchies for Ray Tracing").
    pub sah_cost: f64,
}

impl StructureStats {
    /// The figures of an accelerator.
    pub fn of(accel: &dyn Inspect) -> Self {
        let mut stats = Self::default();
        let (mut trees, mut root_area) = (0, 0.0);
        accel.visit_nodes(&mut |node| {
            if node.depth == 0 {
                trees += 1;
                if trees == 1 {
                    root_area = f64::from(node.bounds.area());
                }
            }
            let items = node.items.len() as u64;
            stats.nodes += 1;
            stats.max_depth = stats.max_depth.max(node.depth);
            stats.references += items;
            stats.max_leaf = stats.max_leaf.max(items);
            if node.children == 0 {
                if items == 0 { stats.empty_leaves += 1 } else { stats.leaves += 1 }
            }
            if trees == 1 && root_area > 0.0 {
                stats.sah_cost +=
                    f64::from(node.bounds.area()) / root_area * (SAH_NODE_COST + SAH_PRIM_COST * items as f64);
            }
        });
        stats
    }

    /// Mean number of items in the leaves that have any.
    pub fn mean_leaf(&self) -> f64 {
        if self.leaves == 0 { 0.0 } else { self.references as f64 / self.leaves as f64 }
    }
}
