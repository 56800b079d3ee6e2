//! Bilinear patches: two triangles where they are flat, a grid of them where they are not.

use crate::assets::MeshData;
use crate::math::Vec3;

/// Quads along a side of a curved patch, where there are few.
const GRID: u32 = 16;

/// Triangles of all curved patches together, above which each has fewer.
const MANY: usize = 1 << 18;

/// A patch counts as flat if no corner is further from the plane of the others than this share of its size.
const FLATNESS: f32 = 1e-4;

/// Patches of four vertices, at (u, v) = (0, 0), (1, 0), (0, 1) and (1, 1).
#[derive(Clone, Debug)]
pub struct Patches {
    /// Positions of the vertices.
    pub positions: Vec<[f32; 3]>,
    /// Corners of each patch.
    pub corners: Vec<[u32; 4]>,
    /// A normal for each vertex.
    pub normals: Option<Vec<[f32; 3]>>,
    /// A uv for each vertex.
    pub uvs: Option<Vec<[f32; 2]>>,
}

impl Patches {
    /// Whether a patch lies in a plane and has parallel sides, so that two triangles have its uv too.
    fn is_flat(&self, corners: [u32; 4]) -> bool {
        let [a, b, c, d] = self.corner_points(corners);
        let size = (d - a).length().max((c - b).length());
        let height = (b - a).cross(c - a).normalize_or_zero().dot(d - a).abs();
        height <= FLATNESS * size
    }

    fn corner_points(&self, corners: [u32; 4]) -> [Vec3; 4] {
        corners.map(|i| self.positions.get(i as usize).copied().map_or(Vec3::ZERO, Vec3::from))
    }

    /// As triangles, and how many patches are curved.
    pub fn triangulate(&self) -> (MeshData, usize) {
        let mut mesh = MeshData {
            normals: self.normals.as_ref().map(|_| Vec::new()),
            uvs: Some(Vec::new()),
            ..MeshData::default()
        };
        let curved = self.corners.iter().filter(|corners| !self.is_flat(**corners)).count();
        let grid = ((MANY / 2 / curved.max(1)) as f64).sqrt().clamp(2.0, f64::from(GRID)) as u32;
        for &corners in &self.corners {
            let n = if self.is_flat(corners) { 1 } else { grid };
            let first = mesh.positions.len() as u32;
            for j in 0..=n {
                for i in 0..=n {
                    self.push_vertex(&mut mesh, corners, [i as f32 / n as f32, j as f32 / n as f32]);
                }
            }
            for j in 0..n {
                for i in 0..n {
                    let at = |i: u32, j: u32| first + j * (n + 1) + i;
                    mesh.triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
                    mesh.triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
                }
            }
        }
        (mesh, curved)
    }

    fn push_vertex(&self, mesh: &mut MeshData, corners: [u32; 4], [u, v]: [f32; 2]) {
        let weights = [(1.0 - u) * (1.0 - v), u * (1.0 - v), (1.0 - u) * v, u * v];
        let [a, b, c, d] = self.corner_points(corners);
        let p = a * weights[0] + b * weights[1] + c * weights[2] + d * weights[3];
        mesh.positions.push(p.to_array());
        if let (Some(out), Some(normals)) = (&mut mesh.normals, &self.normals) {
            let at = |k: usize| normals.get(corners[k] as usize).copied().map_or(Vec3::ZERO, Vec3::from);
            let n = (0..4).map(|k| at(k) * weights[k]).sum::<Vec3>();
            out.push(n.normalize_or_zero().to_array());
        }
        let uv = self.uvs.as_ref().map_or([u, v], |uvs| {
            let at = |k: usize| uvs.get(corners[k] as usize).copied().unwrap_or_default();
            std::array::from_fn(|axis| (0..4).map(|k| at(k)[axis] * weights[k]).sum())
        });
        mesh.uvs.get_or_insert_default().push(uv);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn patch(d: [f32; 3]) -> Patches {
        let positions = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], d];
        Patches { positions, corners: vec![[0, 1, 2, 3]], normals: None, uvs: None }
    }

    #[test]
    fn a_flat_patch_is_two_triangles_whose_front_is_u_cross_v() {
        let (mesh, curved) = patch([1.0, 1.0, 0.0]).triangulate();
        assert_eq!((mesh.triangles.len(), curved), (2, 0));
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|i| Vec3::from(mesh.positions[i as usize]));
            assert!((b - a).cross(c - a).z > 0.0);
        }
        assert_eq!(mesh.uvs.unwrap(), [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]);
    }

    #[test]
    fn a_curved_patch_follows_the_surface() {
        let (mesh, curved) = patch([1.0, 1.0, 1.0]).triangulate();
        assert_eq!((mesh.triangles.len(), curved), (512, 1));
        // z = u v on this one.
        assert!(mesh.positions.iter().all(|[x, y, z]| (x * y - z).abs() < 1e-6));
    }
}
