//! Displacement of meshes by textures.

use rayon::iter::{IndexedParallelIterator, IntoParallelIterator, ParallelIterator};

use super::Builder;
use super::meshes::{self, LoadedMesh};
use super::normals::{first_of, shared_vertices, smooth_shared};
use super::subdivision::Sharing;
use super::textures::TextureUse;
use crate::desc::{DisplacementDesc, DisplacementSpaceDesc, MeshDesc, MeshShadingDesc, NormalWeightDesc};
use crate::error::Result;
use crate::geometry::corner_tangents;
use crate::math::{DVec3, Vec2, Vec3};
use crate::texture::Texture;

impl Builder {
    /// Moves the vertices of a mesh by a texture and computes their normals. `sharing` is that of a subdivision
    /// surface.
    pub(super) fn displace(
        &self,
        path: &str,
        mesh: &MeshDesc,
        loaded: &mut LoadedMesh,
        sharing: Option<Sharing>,
    ) -> Result<()> {
        let Some(desc) = &mesh.displacement else { return Ok(()) };
        let files = &self.files;
        let place = format!("{path}.displacement");
        let refuse = |message: String| meshes::refusal(files, path, mesh.file.as_deref(), message);
        let name = format!("{place}.texture");
        let id = self.materials.textures.find_by_uv(files, &name, &desc.texture, TextureUse::Data)?;
        let texture = self.materials.textures.get(id);
        for (key, value) in [("scale", Some(desc.scale)), ("midlevel", desc.midlevel)] {
            if value.is_some_and(|value| !value.is_finite()) {
                return Err(files.error(&format!("{place}.{key}"), "is not finite"));
            }
        }
        meshes::check_buffers(&loaded.data, &loaded.later).map_err(refuse)?;
        let needs_uv = texture.uses_uv() || desc.space == DisplacementSpaceDesc::Tangent;
        if needs_uv && loaded.data.uvs.is_none() {
            return Err(refuse("the displacement has a texture, but the mesh has no uv".into()));
        }
        let sharing = sharing.unwrap_or_else(|| plain_sharing(loaded, mesh));
        let LoadedMesh { data, later, .. } = loaded;
        let surface = Surface {
            triangles: &data.triangles,
            uvs: data.uvs.as_deref().unwrap_or_default(),
            sharing: &sharing,
            weight: mesh.normal_weight,
        };
        let own = Step { positions: &mut data.positions, normals: &mut data.normals };
        let later = later.iter_mut().map(|step| Step { positions: &mut step.positions, normals: &mut step.normals });
        for step in std::iter::once(own).chain(later) {
            let normals = step.normals.take().unwrap_or_else(|| surface.normals(step.positions, &sharing.points));
            surface.displace(step.positions, &normals, desc, texture);
            if mesh.shading != MeshShadingDesc::Flat {
                *step.normals = Some(surface.normals(step.positions, &sharing.normals));
            }
        }
        Ok(())
    }
}

/// A mesh at one time.
struct Step<'a> {
    positions: &'a mut Vec<[f32; 3]>,
    normals: &'a mut Option<Vec<[f32; 3]>>,
}

/// What a mesh has at all times.
struct Surface<'a> {
    triangles: &'a [[u32; 3]],
    uvs: &'a [[f32; 2]],
    sharing: &'a Sharing,
    weight: NormalWeightDesc,
}

/// The vertices of a mesh at one position are one point; they share a normal unless they have different ones.
fn plain_sharing(loaded: &LoadedMesh, mesh: &MeshDesc) -> Sharing {
    let steps: Vec<&[[f32; 3]]> = loaded.steps().map(|step| step.positions.as_slice()).collect();
    let points = shared_vertices(&steps, mesh.smooth_by);
    let Some(normals) = &loaded.data.normals else { return Sharing { normals: points.clone(), points } };
    let keys = points.iter().zip(normals).map(|(&point, normal)| (point, normal.map(f32::to_bits)));
    Sharing { normals: first_of(keys), points }
}

impl Surface<'_> {
    fn normals(&self, positions: &[[f32; 3]], shared: &[usize]) -> Vec<[f32; 3]> {
        smooth_shared(positions, self.triangles, self.weight, shared)
    }

    /// Moves each point by the mean of what its vertices are moved by, so that no cracks open.
    fn displace(&self, positions: &mut [[f32; 3]], normals: &[[f32; 3]], desc: &DisplacementDesc, texture: &Texture) {
        let points = &self.sharing.points;
        let mut outward = vec![DVec3::ZERO; positions.len()];
        for (&point, n) in points.iter().zip(normals) {
            outward[point] += DVec3::from(n.map(f64::from));
        }
        let tangents = match desc.space {
            DisplacementSpaceDesc::Tangent => self.tangents(positions, normals),
            _ => Vec::new(),
        };
        let offset = |vertex: usize| {
            let uv = self.uvs.get(vertex).map_or(Vec2::ZERO, |&uv| Vec2::from(uv));
            let n = outward[points[vertex]].normalize_or_zero();
            let above = |value: f32, midlevel: f64| desc.scale * (f64::from(value) - desc.midlevel.unwrap_or(midlevel));
            if desc.space == DisplacementSpaceDesc::Normal {
                return n * above(texture.scalar(uv), 0.5);
            }
            let color = texture.color(uv);
            let [r, g, b] = [color.r, color.g, color.b].map(|value| above(value, 0.0));
            match tangents.get(vertex) {
                Some(&(tangent, side)) => {
                    let t = (tangent - n * n.dot(tangent)).normalize_or_zero();
                    t * r + n.cross(t) * (side * g) + n * b
                }
                None => DVec3::new(r, g, b),
            }
        };
        let offsets: Vec<DVec3> = (0..positions.len()).into_par_iter().with_min_len(1024).map(offset).collect();
        let mut sums = vec![(DVec3::ZERO, 0.0); positions.len()];
        for (&point, offset) in points.iter().zip(offsets) {
            sums[point] = (sums[point].0 + offset, sums[point].1 + 1.0);
        }
        for (p, &point) in positions.iter_mut().zip(points) {
            let (sum, count) = sums[point];
            *p = (DVec3::from(p.map(f64::from)) + sum / count).as_vec3().to_array();
        }
    }

    /// The tangents of normal maps at the vertices, and the side of the bitangent.
    fn tangents(&self, positions: &[[f32; 3]], normals: &[[f32; 3]]) -> Vec<(DVec3, f64)> {
        let mut found = vec![(DVec3::ZERO, 1.0); positions.len()];
        let corners = corner_tangents(positions, Some(normals), self.uvs, self.triangles).unwrap_or_default();
        for (triangle, corners) in self.triangles.iter().zip(corners) {
            for (&vertex, [x, y, z, side]) in triangle.iter().zip(corners) {
                let known = &mut found[vertex as usize];
                *known = (known.0 + Vec3::new(x, y, z).as_dvec3(), f64::from(side));
            }
        }
        found
    }
}
