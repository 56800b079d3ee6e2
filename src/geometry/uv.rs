//! Surface parameters of triangles.

use crate::math::{Vec2, Vec3};

/// The uv where the corners' uv have these weights but the first one's.
#[inline(always)]
pub(crate) fn interpolated_uv([uv_a, uv_b, uv_c]: [Vec2; 3], [u, v]: [f32; 2]) -> Vec2 {
    uv_a * (1.0 - u - v) + uv_b * u + uv_c * v
}

/// Twice the signed area of a triangle in uv.
#[inline(always)]
pub(crate) fn uv_area([a, b, c]: [Vec2; 3]) -> f32 {
    (b - a).perp_dot(c - a)
}

/// Changes of the point with u and v on a triangle with these edges from its first corner, and with these uv.
#[inline]
pub(super) fn derivatives([edge_b, edge_c]: [Vec3; 2], uvs: [Vec2; 3]) -> [Vec3; 2] {
    let (d1, d2) = (uvs[1] - uvs[0], uvs[2] - uvs[0]);
    let inverse = 1.0 / uv_area(uvs);
    [(edge_b * d2.y - edge_c * d1.y) * inverse, (edge_c * d1.x - edge_b * d2.x) * inverse]
}

/// Area in uv per area of the surface, from those of one part of it.
#[inline(always)]
pub(crate) fn uv_density(uv_area: f32, area: f64) -> f32 {
    (f64::from(uv_area.abs()) / area) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Geometry, Hit, Instance, Mesh, Object, Shape};
    use crate::id::{InstanceId, ObjectId, PrimId, ShapeId};
    use crate::math::{DAffine3, DMat3, DVec3, Ray, Transform};

    /// uv that stretch the right-angled unit triangle twice and fourfold, and shear it.
    fn triangle() -> Mesh {
        let uvs = vec![[0.5, 0.5], [2.5, 0.5], [3.5, 4.5]];
        Mesh::new(vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], vec![[0, 1, 2]], None, Some(uvs)).unwrap()
    }

    fn density(mesh: Mesh, map: Option<DAffine3>) -> f32 {
        let mut geometry = Geometry { shapes: vec![Shape::Mesh(mesh)], ..Geometry::default() };
        let mut hit = Hit { t: 1.0, u: 0.25, v: 0.25, shape: ShapeId(0), prim: PrimId(0), instance: Hit::NO_INSTANCE };
        if let Some(map) = map {
            geometry.objects.push(Object { shapes: vec![ShapeId(0)] });
            geometry.instances.push(Instance::new(ObjectId(0), Transform::new(map).unwrap()));
            hit.instance = InstanceId(0);
        }
        geometry.uv_density(&Ray::new(Vec3::new(0.25, 0.25, 1.0), -Vec3::Z), &hit)
    }

    #[test]
    fn the_density_of_uv_is_their_area_over_that_of_the_surface() {
        assert_eq!(density(triangle(), None), 8.0);
        // Four times the area in the world.
        let wide = DAffine3::from_mat3(DMat3::from_diagonal(DVec3::new(1.0, 4.0, 7.0)));
        assert_eq!(density(triangle(), Some(wide)), 2.0);
        // Without uv, barycentric coordinates.
        let bare =
            Mesh::new(vec![[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]], vec![[0, 1, 2]], None, None).unwrap();
        assert_eq!(density(bare, None), 0.25);
    }
}
