//! Small scenes for the unit tests of trees.

use super::Items;
use crate::geometry::{Geometry, Mesh, Shape, TrianglePoints};
use crate::id::ShapeId;

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
