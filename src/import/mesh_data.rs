//! A mesh as a file gives it: buffers that nobody has checked.

/// Buffers of a triangle mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshData {
    /// Positions of the vertices.
    pub positions: Vec<[f32; 3]>,
    /// Corners of each triangle.
    pub triangles: Vec<[u32; 3]>,
    /// A normal for each vertex.
    pub normals: Option<Vec<[f32; 3]>>,
    /// A uv for each vertex, with the origin at the bottom left.
    pub uvs: Option<Vec<[f32; 2]>>,
}

impl MeshData {
    /// Adds a convex polygon as a fan around its first corner; fewer than three corners add nothing.
    pub fn push_polygon(&mut self, corners: &[u32]) {
        for pair in corners.windows(2).skip(1) {
            self.triangles.push([corners[0], pair[0], pair[1]]);
        }
    }
}
