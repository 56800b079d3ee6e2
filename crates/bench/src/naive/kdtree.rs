//! The kd-tree of a course report: axes in turn, split at the median of the lower bounds, both children visited even
//! after a near hit.

use super::search::{Search, bounds_of, triangle_bounds};
use super::{Forest, MeshTree};
use crate::accel::Accelerator;
use crate::geometry::{Geometry, Hit, Mesh};
use crate::math::{Aabb, Ray};

/// A node with no more triangles is not divided.
const LEAF: usize = 4;

/// The kd-tree.
pub struct NaiveKdTree<'g>(Forest<'g, Node>);

struct Node {
    bounds: Aabb,
    content: Content,
}

enum Content {
    Leaf(Vec<u32>),
    /// The axis, and the children below and above the split.
    Inner(usize, [Box<Node>; 2]),
}

impl<'g> NaiveKdTree<'g> {
    /// Over the meshes of the world.
    pub fn new(geometry: &'g Geometry) -> Self {
        Self(Forest::new(geometry, "naive kd-tree", |mesh: &Mesh| {
            let bounds = triangle_bounds(mesh);
            let all: Vec<u32> = (0..bounds.len() as u32).collect();
            Node::new(&bounds, bounds_of(&bounds, &all), all, 0)
        }))
    }
}

impl Node {
    fn new(all: &[Aabb], bounds: Aabb, triangles: Vec<u32>, axis: usize) -> Self {
        let leaf = |triangles| Self { bounds, content: Content::Leaf(triangles) };
        if triangles.len() <= LEAF {
            return leaf(triangles);
        }
        let mut lower: Vec<f32> = triangles.iter().map(|prim| all[*prim as usize].min[axis]).collect();
        lower.sort_by(f32::total_cmp);
        let split = lower[lower.len() / 2];
        let pick = |keep: &dyn Fn(&Aabb) -> bool| -> Vec<u32> {
            triangles.iter().copied().filter(|prim| keep(&all[*prim as usize])).collect()
        };
        let (left, right) = (pick(&|b| b.min[axis] <= split), pick(&|b| b.max[axis] > split));
        // No progress along this axis ends it all.
        if left.len() == triangles.len() || right.len() == triangles.len() {
            return leaf(triangles);
        }
        let (mut below, mut above) = (bounds, bounds);
        below.max[axis] = split;
        above.min[axis] = split;
        let child = |bounds, triangles| Box::new(Self::new(all, bounds, triangles, (axis + 1) % 3));
        Self { bounds, content: Content::Inner(axis, [child(below, left), child(above, right)]) }
    }
}

impl MeshTree for Node {
    fn visit(&self, search: &mut Search) {
        if !search.meets(&self.bounds) {
            return;
        }
        match &self.content {
            Content::Leaf(triangles) => triangles.iter().for_each(|prim| search.test(*prim)),
            Content::Inner(axis, [below, above]) => {
                let downward = search.ray.direction[*axis] < 0.0;
                let (near, far) = if downward { (above, below) } else { (below, above) };
                near.visit(search);
                far.visit(search);
            }
        }
    }

    fn memory_bytes(&self) -> usize {
        size_of::<Self>()
            + match &self.content {
                Content::Leaf(triangles) => size_of_val(triangles.as_slice()),
                Content::Inner(_, children) => children.iter().map(|child| child.memory_bytes()).sum(),
            }
    }
}

super::delegate!(NaiveKdTree);
