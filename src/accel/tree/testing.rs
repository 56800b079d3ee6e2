//! Small scenes for the unit tests of trees.

use super::Items;
use crate::geometry::{Geometry, Mesh, Shape, TrianglePoints};
use crate::id::ShapeId;
use crate::math::Vec3;

/// A fixed sequence in place of random numbers.
pub struct Sequence(pub u64);

impl Sequence {
    /// Within `[-1, 1)`.
    pub fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1 << 23) as f32 - 1.0
    }

    pub fn vec(&mut self) -> Vec3 {
        Vec3::new(self.next(), self.next(), self.next())
    }

    pub fn below(&mut self, n: usize) -> usize {
        ((self.next() * 0.5 + 0.5) * n as f32) as usize % n
    }
}

/// One mesh of these triangles, in the world.
pub fn mesh_geometry(triangles: &[TrianglePoints]) -> Geometry {
    let positions = triangles.iter().flat_map(|t| [t.a, t.b, t.c]).map(|p| p.to_array()).collect();
    let indices = (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let mesh = Mesh::new(positions, indices, None, None).expect("test meshes are valid");
    Geometry { shapes: vec![Shape::Mesh(mesh)], world: vec![ShapeId(0)], ..Geometry::default() }
}

/// What the world's tree is built over, if there are no instances.
pub fn items_of(geometry: &Geometry) -> Items<'_> {
    Items::of_world(geometry, &geometry.world, &[])
}
