//! The octree of a course report: eight equal cells, triangles in every cell that their box overlaps, a queue, no
//! order.

use std::collections::VecDeque;

use super::search::{Search, bounds_of, overlap, triangle_bounds};
use super::{Forest, MeshTree};
use crate::accel::Accelerator;
use crate::geometry::{Geometry, Hit, Mesh};
use crate::math::{Aabb, Ray, Vec3};

/// A cell with no more triangles is not divided.
const LEAF: usize = 64;

/// Nor is one at this depth: where many triangles share a corner, no division parts them.
const MAX_DEPTH: u32 = 16;

/// The octree.
pub struct NaiveOctree<'g>(Forest<'g, Cell>);

struct Cell {
    bounds: Aabb,
    triangles: Vec<u32>,
    children: [Option<Box<Cell>>; 8],
}

impl<'g> NaiveOctree<'g> {
    /// Over the meshes of the world.
    pub fn new(geometry: &'g Geometry) -> Self {
        Self(Forest::new(geometry, "naive octree", |mesh: &Mesh| {
            let bounds = triangle_bounds(mesh);
            let all: Vec<u32> = (0..bounds.len() as u32).collect();
            Cell::new(&bounds, bounds_of(&bounds, &all), all, 0)
        }))
    }
}

impl Cell {
    fn new(all: &[Aabb], bounds: Aabb, triangles: Vec<u32>, depth: u32) -> Self {
        if triangles.len() <= LEAF || depth == MAX_DEPTH {
            return Self { bounds, triangles, children: [const { None }; 8] };
        }
        let center = bounds.center();
        let child = |octant: usize| {
            let upper = [1, 2, 4].map(|bit| octant & bit != 0);
            let pick = |axis: usize| {
                if upper[axis] { [center[axis], bounds.max[axis]] } else { [bounds.min[axis], center[axis]] }
            };
            let sides = [pick(0), pick(1), pick(2)];
            let cell = Aabb { min: Vec3::from(sides.map(|s| s[0])), max: Vec3::from(sides.map(|s| s[1])) };
            let inside: Vec<u32> =
                triangles.iter().copied().filter(|prim| overlap(&all[*prim as usize], &cell)).collect();
            (!inside.is_empty()).then(|| Box::new(Self::new(all, cell, inside, depth + 1)))
        };
        Self { bounds, triangles: Vec::new(), children: std::array::from_fn(child) }
    }
}

impl MeshTree for Cell {
    fn visit(&self, search: &mut Search) {
        let mut queue = VecDeque::from([self]);
        while let Some(cell) = queue.pop_front() {
            if search.meets(&cell.bounds) {
                cell.triangles.iter().for_each(|prim| search.test(*prim));
                queue.extend(cell.children.iter().flatten().map(|child| &**child));
            }
        }
    }

    fn memory_bytes(&self) -> usize {
        let children: usize = self.children.iter().flatten().map(|child| child.memory_bytes()).sum();
        size_of::<Self>() + size_of_val(self.triangles.as_slice()) + children
    }
}

super::delegate!(NaiveOctree);
