//! Why a mesh is rejected.

/// Why a mesh is rejected; indices count from 0.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// No triangles at all.
    #[error("the mesh has no triangles")]
    Empty,
    /// A position that is not finite, or too large for `f32` ray tracing.
    #[error("vertex {0} is not finite or exceeds 1.8e18")]
    Position(usize),
    /// A normal that is not finite.
    #[error("the normal of vertex {0} is not finite")]
    Normal(usize),
    /// A uv that is not finite.
    #[error("the uv of vertex {0} is not finite")]
    Uv(usize),
    /// A corner that names no vertex.
    #[error("triangle {triangle} refers to vertex {index}, but there are only {count}")]
    Index {
        /// The triangle.
        triangle: usize,
        /// The vertex it names.
        index: u32,
        /// The number of vertices.
        count: usize,
    },
    /// Normals or uvs that do not match the positions in number.
    #[error("{what}: {count} for {vertices} vertices")]
    Count {
        /// Which attribute.
        what: &'static str,
        /// How many there are.
        count: usize,
        /// How many there must be.
        vertices: usize,
    },
}
