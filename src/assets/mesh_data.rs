//! A mesh as a file gives it: buffers that nobody has checked.

use std::collections::BTreeMap;

use super::AssetError;
use crate::attribute::{AttributeValues, VERTEX_COLOR, is_of_faces};
use crate::math::{Bounds, DVec3};

/// Buffers of a triangle mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshData {
    /// Positions of the vertices, from `origin`.
    pub positions: Vec<[f32; 3]>,
    /// Corners of each triangle.
    pub triangles: Vec<[u32; 3]>,
    /// A normal for each vertex.
    pub normals: Option<Vec<[f32; 3]>>,
    /// A uv for each vertex, with the origin at the bottom left.
    pub uvs: Option<Vec<[f32; 2]>>,
    /// Values for each vertex or each triangle, by name; colours of vertices are [`VERTEX_COLOR`].
    pub attributes: BTreeMap<String, AttributeValues>,
    /// What all positions are relative to: zero, unless they were given so far away that `f32` would spoil them.
    pub origin: [f64; 3],
}

/// Positions that reach this many times as far as they extend are kept relative to an origin.
const FAR: f64 = 4096.0;

impl MeshData {
    /// Positions of the vertices as `f32`, and the origin that they are relative to.
    pub fn rounded(positions: &[[f64; 3]]) -> (Vec<[f32; 3]>, [f64; 3]) {
        let bounds = positions.iter().fold(Bounds::EMPTY, |b, p| b.extended(DVec3::from(*p)));
        let origin = Self::origin_for(&bounds, positions.first());
        let round = |p: &[f64; 3]| [0, 1, 2].map(|i| (p[i] - origin[i]) as f32);
        (positions.iter().map(round).collect(), origin)
    }

    /// The origin for vertices with these bounds, of which this is the first.
    pub(super) fn origin_for(bounds: &Bounds, first: Option<&[f64; 3]>) -> [f64; 3] {
        let extent = (bounds.max - bounds.min).max_element();
        let is_far = extent > 0.0 && bounds.min.abs().max(bounds.max.abs()).max_element() > FAR * extent;
        first.copied().filter(|p| is_far && p.iter().all(|x| x.is_finite())).unwrap_or_default()
    }

    /// Gives every vertex a linear colour.
    #[must_use]
    pub fn with_colors(mut self, colors: Option<Vec<[f32; 3]>>) -> Self {
        self.attributes.extend(colors.map(|colors| (VERTEX_COLOR.to_owned(), AttributeValues::Colors(colors))));
        self
    }

    /// The linear colours of the vertices, if they have any.
    pub fn colors(&self) -> Option<&[[f32; 3]]> {
        match self.attributes.get(VERTEX_COLOR) {
            Some(AttributeValues::Colors(colors)) => Some(colors),
            _ => None,
        }
    }

    /// The position of a vertex.
    #[inline]
    #[doc(hidden)]
    pub fn position(&self, relative: [f32; 3]) -> DVec3 {
        DVec3::from(relative.map(f64::from)) + DVec3::from(self.origin)
    }

    /// The positions as a scene file has them: of the numbers that round to those of the mesh, the shortest.
    pub fn written_positions(&self) -> Vec<[f64; 3]> {
        let shortest = |x: f32| x.to_string().parse().unwrap_or(f64::from(x));
        let written =
            |p: &[f32; 3]| if self.origin == [0.0; 3] { p.map(shortest) } else { self.position(*p).to_array() };
        self.positions.iter().map(written).collect()
    }

    /// Bounds of the vertices, those of NaN left out.
    #[doc(hidden)]
    pub fn bounds(&self) -> Bounds {
        self.positions.iter().fold(Bounds::EMPTY, |b, &p| b.extended(self.position(p)))
    }

    /// Adds another mesh with the same attributes.
    pub(super) fn append(&mut self, mut other: Self) -> Result<(), AssetError> {
        debug_assert_eq!(self.origin, other.origin);
        let first = u32::try_from(self.positions.len())
            .ok()
            .filter(|&first| (u32::MAX - first) as usize >= other.positions.len());
        let first =
            first.ok_or_else(|| AssetError::Malformed("the file has more than 4,294,967,295 vertices".into()))?;
        self.positions.append(&mut other.positions);
        self.triangles.extend(other.triangles.iter().map(|triangle| triangle.map(|i| i + first)));
        if let (Some(normals), Some(others)) = (&mut self.normals, &mut other.normals) {
            normals.append(others);
        }
        if let (Some(uvs), Some(others)) = (&mut self.uvs, &mut other.uvs) {
            uvs.append(others);
        }
        for (name, values) in other.attributes {
            if let Some(own) = self.attributes.get_mut(&name) {
                own.append(values);
            }
        }
        Ok(())
    }

    /// Gives the corners of every triangle these uv if the mesh has none; then triangles share no vertices.
    pub fn give_uvs(&mut self, corners: [[f32; 2]; 3]) {
        if self.uvs.is_some() {
            return;
        }
        for (_, values) in self.attributes.iter_mut().filter(|(name, _)| is_of_faces(name) == Some(false)) {
            *values = values.gathered(self.triangles.as_flattened().iter().copied());
        }
        for values in [Some(&mut self.positions), self.normals.as_mut()].into_iter().flatten() {
            *values = self
                .triangles
                .as_flattened()
                .iter()
                .map(|&i| values.get(i as usize).copied().unwrap_or_default())
                .collect();
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
