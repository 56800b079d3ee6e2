//! Tangents of meshes as normal maps are baked for: MikkTSpace (Mikkelsen, "Simulation of Wrinkled Surfaces
//! Revisited").

use bevy_mikktspace::TangentSpace;

use super::mesh::Mesh;
use crate::math::Vec3;

/// A unit tangent for each corner of a triangle, with the side of the bitangent: `w (n x t)`. All zero where the uv
/// have no direction.
pub type CornerTangents = [[f32; 4]; 3];

/// What the algorithm reads and writes.
struct TangentSpaceInput<'a> {
    positions: &'a [[f32; 3]],
    normals: Option<&'a [[f32; 3]]>,
    uvs: &'a [[f32; 2]],
    triangles: &'a [[u32; 3]],
    tangents: Vec<CornerTangents>,
}

impl TangentSpaceInput<'_> {
    fn vertex(&self, face: usize, corner: usize) -> usize {
        self.triangles[face][corner] as usize
    }
}

impl bevy_mikktspace::Geometry for TangentSpaceInput<'_> {
    fn num_faces(&self) -> usize {
        self.triangles.len()
    }

    fn num_vertices_of_face(&self, _face: usize) -> usize {
        3
    }

    fn position(&self, face: usize, vert: usize) -> [f32; 3] {
        self.positions[self.vertex(face, vert)]
    }

    fn normal(&self, face: usize, vert: usize) -> [f32; 3] {
        match self.normals {
            Some(normals) => normals[self.vertex(face, vert)],
            None => {
                let [a, b, c] = [0, 1, 2].map(|k| Vec3::from(self.position(face, k)).as_dvec3());
                (b - a).cross(c - a).normalize_or_zero().as_vec3().to_array()
            }
        }
    }

    fn tex_coord(&self, face: usize, vert: usize) -> [f32; 2] {
        self.uvs[self.vertex(face, vert)]
    }

    fn set_tangent(&mut self, tangent_space: Option<TangentSpace>, face: usize, vert: usize) {
        self.tangents[face][vert] = tangent_space.map_or([0.0; 4], |space| space.tangent_encoded());
    }
}

/// The tangents of all corners; `None` where the algorithm finds none at all.
pub(crate) fn corner_tangents(
    positions: &[[f32; 3]],
    normals: Option<&[[f32; 3]]>,
    uvs: &[[f32; 2]],
    triangles: &[[u32; 3]],
) -> Option<Vec<CornerTangents>> {
    let mut source =
        TangentSpaceInput { positions, normals, uvs, triangles, tangents: vec![[[0.0; 4]; 3]; triangles.len()] };
    bevy_mikktspace::generate_tangents(&mut source).ok()?;
    Some(source.tangents)
}

/// The tangent interpolated over a triangle (not of unit length), and the side of the bitangent; `None` where there is
/// no direction.
#[inline]
pub(super) fn interpolate(corners: &CornerTangents, weights: [f32; 3]) -> Option<(Vec3, f32)> {
    let at = |k: usize| Vec3::new(corners[k][0], corners[k][1], corners[k][2]) * weights[k];
    let tangent = at(0) + at(1) + at(2);
    // The corners of a triangle have the same side.
    let side = corners[0][3];
    (tangent.length_squared() > 1e-12 && side != 0.0).then_some((tangent, side))
}

impl Mesh {
    /// Whether tangents are interpolated for normal maps.
    pub fn has_tangents(&self) -> bool {
        !self.tangents.is_empty()
    }

    /// This mesh with tangents for normal maps at each of its times; it has uvs, or stays as it is.
    #[must_use]
    pub fn with_tangents(mut self) -> Self {
        let Some(uvs) = &self.uvs else { return self };
        let at = |positions: &[[f32; 3]], normals: Option<&[[f32; 3]]>| {
            corner_tangents(positions, normals, uvs, &self.triangles)
        };
        let first = at(self.positions(), self.normals.as_deref());
        let later = self.later.iter().map(|step| at(&step.positions, step.normals.as_deref()));
        self.tangents = std::iter::once(first).chain(later).collect::<Option<Vec<_>>>().unwrap_or_default();
        self
    }
}

#[cfg(test)]
mod tests;
