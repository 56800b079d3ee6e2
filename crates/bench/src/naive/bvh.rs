//! The bounding volume hierarchy of a course report: halved along the longest axis by centre, both children visited in
//! no order.

use super::search::{Search, bounds_of, center, triangle_bounds};
use super::{Forest, MeshTree};
use crate::accel::Accelerator;
use crate::geometry::{Geometry, Hit, Mesh};
use crate::math::{Aabb, Ray};

/// A node with no more triangles is not divided.
const LEAF: usize = 8;

/// The hierarchy.
pub struct NaiveBvh<'g>(Forest<'g, Tree>);

struct Tree {
    /// Triangles in the order of the leaves.
    order: Vec<u32>,
    root: Node,
    wrong_leaves: bool,
}

struct Node {
    bounds: Aabb,
    content: Content,
}

enum Content {
    /// The place of the first triangle, and their number.
    Leaf(usize, usize),
    Inner([Box<Node>; 2]),
}

impl<'g> NaiveBvh<'g> {
    /// Over the meshes of the world.
    pub fn new(geometry: &'g Geometry) -> Self {
        Self(Forest::new(geometry, "naive BVH", |mesh: &Mesh| Tree::new(mesh, false)))
    }

    /// The same with the slip of a report: a leaf of n triangles from place i on tests i triangles from place n on.
    /// Those are its own and most of the others; only the first leaf is lost.
    pub fn with_wrong_leaves(geometry: &'g Geometry) -> Self {
        Self(Forest::new(geometry, "naive BVH, wrong leaves", |mesh: &Mesh| Tree::new(mesh, true)))
    }
}

impl Tree {
    fn new(mesh: &Mesh, wrong_leaves: bool) -> Self {
        let bounds = triangle_bounds(mesh);
        let mut order: Vec<u32> = (0..bounds.len() as u32).collect();
        let root = Node::new(&bounds, &mut order, 0);
        Self { order, root, wrong_leaves }
    }

    fn visit_node(&self, node: &Node, search: &mut Search) {
        if !search.meets(&node.bounds) {
            return;
        }
        match &node.content {
            Content::Leaf(first, count) => {
                let (first, count) = if self.wrong_leaves { (*count, *first) } else { (*first, *count) };
                self.order[first..first + count].iter().for_each(|prim| search.test(*prim));
            }
            Content::Inner(children) => children.iter().for_each(|child| self.visit_node(child, search)),
        }
    }
}

impl Node {
    fn new(all: &[Aabb], order: &mut [u32], first: usize) -> Self {
        let bounds = bounds_of(all, order);
        if order.len() <= LEAF {
            return Self { bounds, content: Content::Leaf(first, order.len()) };
        }
        let size = bounds.size();
        let axis = (0..3).max_by(|a, b| size[*a].total_cmp(&size[*b])).unwrap_or(0);
        order.sort_by(|a, b| center(&all[*a as usize])[axis].total_cmp(&center(&all[*b as usize])[axis]));
        let middle = order.len() / 2;
        let (left, right) = order.split_at_mut(middle);
        let children = [Box::new(Self::new(all, left, first)), Box::new(Self::new(all, right, first + middle))];
        Self { bounds, content: Content::Inner(children) }
    }

    fn memory_bytes(&self) -> usize {
        let children = match &self.content {
            Content::Leaf(..) => 0,
            Content::Inner(children) => children.iter().map(|child| child.memory_bytes()).sum(),
        };
        size_of::<Self>() + children
    }
}

impl MeshTree for Tree {
    fn visit(&self, search: &mut Search) {
        self.visit_node(&self.root, search);
    }

    fn memory_bytes(&self) -> usize {
        self.root.memory_bytes() + size_of_val(self.order.as_slice())
    }
}

super::delegate!(NaiveBvh);
