//! A mesh as a file gives it: buffers that nobody has checked.

use super::AssetError;

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
    /// A linear colour for each vertex.
    pub colors: Option<Vec<[f32; 3]>>,
}

impl MeshData {
    /// Adds another mesh with the same attributes.
    pub(super) fn append(&mut self, mut other: Self) -> Result<(), AssetError> {
        let first = u32::try_from(self.positions.len()).ok().filter(|&first| (u32::MAX - first) as usize >= other.positions.len());
        let first = first.ok_or_else(|| AssetError::Malformed("the file has more than 4,294,967,295 vertices".into()))?;
        self.positions.append(&mut other.positions);
        self.triangles.extend(other.triangles.iter().map(|triangle| triangle.map(|i| i + first)));
        if let (Some(normals), Some(others)) = (&mut self.normals, &mut other.normals) {
            normals.append(others);
        }
        if let (Some(uvs), Some(others)) = (&mut self.uvs, &mut other.uvs) {
            uvs.append(others);
        }
        if let (Some(colors), Some(others)) = (&mut self.colors, &mut other.colors) {
            colors.append(others);
        }
        Ok(())
    }

    /// Gives the corners of every triangle these uv if the mesh has none; then triangles share no vertices.
    pub fn give_uvs(&mut self, corners: [[f32; 2]; 3]) {
        if self.uvs.is_some() {
            return;
        }
        for values in [Some(&mut self.positions), self.normals.as_mut(), self.colors.as_mut()].into_iter().flatten() {
            *values = self.triangles.as_flattened().iter().map(|&i| values.get(i as usize).copied().unwrap_or_default()).collect();
        }
        self.uvs = Some(corners.repeat(self.triangles.len()));
        self.triangles = (0..self.triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    }

    /// Adds a convex polygon as a fan around its first corner; fewer than three corners add nothing.
    pub fn push_polygon(&mut self, corners: &[u32]) {
        for pair in corners.windows(2).skip(1) {
            self.triangles.push([corners[0], pair[0], pair[1]]);
        }
    }
}
