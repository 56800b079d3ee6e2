//! Meshes of triangles as pbrt understands them.

use crate::assets::MeshData;
use crate::math::{DAffine3, Vec3};

/// Turns triangles so that their fronts are where their normals point, as pbrt has it. Whether any had to be turned.
pub fn orient(mesh: &mut MeshData) -> bool {
    let Some(normals) = &mesh.normals else { return false };
    let mut any = false;
    for t in &mut mesh.triangles {
        let corners = t.map(|i| mesh.positions.get(i as usize).copied().map(Vec3::from));
        let [Some(a), Some(b), Some(c)] = corners else { continue };
        let around: Vec3 = t.iter().filter_map(|&i| normals.get(i as usize).copied().map(Vec3::from)).sum();
        if (b - a).cross(c - a).dot(around) < 0.0 {
            t.swap(1, 2);
            any = true;
        }
    }
    any
}

/// Gives each triangle the uv that pbrt gives it where a mesh has none.
pub fn give_uvs(mesh: &mut MeshData) {
    mesh.give_uvs([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]);
}

/// The area of a placed mesh.
pub fn area(mesh: &MeshData, map: &DAffine3) -> f64 {
    let corner = |i: u32| mesh.positions.get(i as usize).map(|p| map.transform_point3(mesh.position(*p)));
    let triangle = |t: &[u32; 3]| match t.map(corner) {
        [Some(a), Some(b), Some(c)] => 0.5 * (b - a).cross(c - a).length(),
        _ => 0.0,
    };
    mesh.triangles.iter().map(triangle).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle(normal: [f32; 3]) -> MeshData {
        MeshData {
            positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            triangles: vec![[0, 1, 2]],
            normals: Some(vec![normal; 3]),
            ..MeshData::default()
        }
    }

    #[test]
    fn normals_say_where_the_front_is() {
        let mut mesh = triangle([0.0, 0.0, 1.0]);
        assert!(!orient(&mut mesh));
        let mut mesh = triangle([0.1, 0.0, -1.0]);
        assert!(orient(&mut mesh));
        assert_eq!(mesh.triangles, [[0, 2, 1]]);
    }

    #[test]
    fn triangles_without_uv_get_their_own() {
        let mut mesh = triangle([0.0, 0.0, 1.0]);
        mesh.triangles.push([2, 1, 0]);
        give_uvs(&mut mesh);
        assert_eq!(mesh.positions[3..], [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0; 3]]);
        assert_eq!(mesh.uvs.unwrap()[3..], [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]);
        assert_eq!((mesh.triangles.len(), mesh.normals.unwrap().len()), (2, 6));
    }

    #[test]
    fn areas_are_those_in_the_world() {
        let doubled = DAffine3::from_scale(crate::math::DVec3::new(2.0, 3.0, 1.0));
        assert!((area(&triangle([0.0; 3]), &doubled) - 3.0).abs() < 1e-12);
    }
}
