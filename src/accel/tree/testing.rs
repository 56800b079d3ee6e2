//! Random numbers and small scenes for the unit tests of trees.

use super::Items;
use crate::geometry::{Geometry, Mesh, Shape, TrianglePoints};
use crate::id::ShapeId;
use crate::math::{DVec3, dvec3};

/// SplitMix64 (Steele, Lea, Flood, "Fast Splittable Pseudorandom Number Generators").
pub struct Rng(u64);

impl Rng {
    /// A generator with its own sequence.
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// Uniform in `[0, 1)`.
    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform in the cube `[-1, 1)³`.
    pub fn cube(&mut self) -> DVec3 {
        2.0 * dvec3(self.unit(), self.unit(), self.unit()) - 1.0
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
    Items::of_world(geometry, &[])
}
