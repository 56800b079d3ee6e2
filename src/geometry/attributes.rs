//! Attributes of meshes at points of their surfaces.

use super::mesh::Mesh;
use super::{Geometry, Shape, SurfaceInteraction};
use crate::attribute::{Attribute, AttributePoint};
use crate::id::PrimId;
use crate::math::DVec3;

impl Mesh {
    /// This mesh with attributes: as many values as vertices or triangles.
    #[must_use]
    pub fn with_attributes(mut self, attributes: Vec<Attribute>) -> Self {
        debug_assert!(attributes.iter().all(|attribute| {
            attribute.values.len() == if attribute.of_faces { self.triangles.len() } else { self.positions().len() }
        }));
        self.attributes = attributes.into();
        self
    }

    /// Whether there are any.
    pub fn has_attributes(&self) -> bool {
        !self.attributes.is_empty()
    }

    /// The attributes at barycentric coordinates `u`, `v` of a triangle's second and third vertex; `None` if there are
    /// none.
    pub fn attributes_at(&self, prim: PrimId, u: f32, v: f32) -> Option<AttributePoint<'_>> {
        self.has_attributes().then(|| self.attribute_point(prim, [1.0 - u - v, u, v]))
    }

    fn attribute_point(&self, prim: PrimId, weights: [f32; 3]) -> AttributePoint<'_> {
        AttributePoint { attributes: &self.attributes, prim, corners: self.triangles()[prim.index()], weights }
    }
}

impl Geometry {
    /// The attributes of the surface at a point; `None` if it has none.
    #[inline(never)]
    pub fn attributes(&self, at: &SurfaceInteraction) -> Option<AttributePoint<'_>> {
        let mesh = match self.shape(at.shape) {
            Shape::Mesh(mesh) => mesh,
            Shape::Curves(curves) => return curves.attributes_at(at.prim, self.local_point(at)),
            Shape::Analytic(_) | Shape::Points(_) => return None,
        };
        if !mesh.has_attributes() {
            return None;
        }
        let p = self.local_point(at);
        Some(mesh.attribute_point(at.prim, mesh.weights_at(at.prim, p, at.time).map(|weight| weight as f32)))
    }

    /// A point of a surface in the space that its shape is placed in.
    fn local_point(&self, at: &SurfaceInteraction) -> DVec3 {
        if at.is_instanced() { self.instance(at.instance).transform_at(at.time).inverse_point(at.p) } else { at.p }
    }
}

/// The barycentric coordinates of a point of a triangle, none below 0, from the vectors to it from the corners.
#[inline]
pub(super) fn weights([a, b, c]: [DVec3; 3]) -> [f64; 3] {
    let cross = (b - a).cross(c - a);
    [b.cross(c), c.cross(a), a.cross(b)].map(|area| area.dot(cross).max(0.0) / cross.length_squared())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attribute::AttributeValues;
    use crate::geometry::{Hit, Instance, MeshStep, Object};
    use crate::id::{AttributeId, InstanceId, ObjectId, ShapeId};
    use crate::math::{DAffine3, Ray, Rng, Transform, Vec3};

    const CORNERS: [[f32; 3]; 3] = [[1.0, 0.5, 0.0], [4.0, 0.0, 1.0], [0.0, 3.0, -1.0]];
    const COLORS: [[f32; 3]; 3] = [[1.0, 0.25, 0.0], [0.0, 0.5, 0.0], [0.5, 0.0, 1.0]];

    fn triangle() -> Mesh {
        let colors =
            Attribute { id: AttributeId(3), of_faces: false, values: AttributeValues::Colors(COLORS.to_vec()) };
        Mesh::new(CORNERS.to_vec(), vec![[0, 1, 2]], None, None).unwrap().with_attributes(vec![colors])
    }

    fn blend(values: &[[f32; 3]; 3], u: f32, v: f32) -> Vec3 {
        let [a, b, c] = values.map(Vec3::from);
        a * (1.0 - u - v) + b * u + c * v
    }

    /// The colour where a ray along `-z` of the object's space meets the triangle, placed by `map` through an instance.
    fn seen(mesh: Mesh, target: Vec3, time: f32, map: Option<DAffine3>) -> Vec3 {
        let mut geometry = Geometry { shapes: vec![Shape::Mesh(mesh)], ..Geometry::default() };
        let place = map.unwrap_or(DAffine3::IDENTITY);
        let (origin, toward) =
            (place.transform_point3(target.as_dvec3() + DVec3::Z), place.transform_vector3(-DVec3::Z));
        let ray = Ray { time, ..Ray::new(origin.as_vec3(), toward.as_vec3()) };
        let mut hit = Hit { t: 1.0, u: 0.0, v: 0.0, shape: ShapeId(0), prim: PrimId(0), instance: Hit::NO_INSTANCE };
        if let Some(map) = map {
            geometry.objects.push(Object { shapes: vec![ShapeId(0)] });
            geometry.instances.push(Instance::new(ObjectId(0), Transform::new(map).unwrap()));
            hit.instance = InstanceId(0);
        }
        let at = geometry.interaction(&ray, &hit).unwrap();
        let point = geometry.attributes(&at).unwrap();
        assert!((point.weights.iter().sum::<f32>() - 1.0).abs() < 1e-6);
        Vec3::from(point.value(AttributeId(3)).unwrap())
    }

    #[test]
    fn colours_stand_between_those_of_the_corners() {
        let map = DAffine3::from_scale_rotation_translation(
            DVec3::new(2.0, -0.5, 3.0),
            crate::math::DQuat::from_rotation_y(0.7),
            DVec3::new(5.0, 1.0, 2.0),
        );
        let mut rng = Rng::new(7);
        let inside = (0..200).map(|_| [rng.unit_f32(), rng.unit_f32()]).filter(|[u, v]| u + v < 1.0);
        for [u, v] in inside.chain([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.5, 0.5]]) {
            let (target, expected) = (blend(&CORNERS, u, v), blend(&COLORS, u, v));
            for map in [None, Some(map)] {
                let found = seen(triangle(), target, 0.0, map);
                assert!((found - expected).abs().max_element() < 1e-5, "{u} {v} {map:?}: {found} for {expected}");
            }
        }
    }

    #[test]
    fn colours_go_with_vertices_that_move() {
        let moved = CORNERS.map(|p| (Vec3::from(p) * 2.0 + Vec3::X).to_array());
        let mesh = triangle().deforming(vec![MeshStep { positions: moved.to_vec(), normals: None }]).unwrap();
        let halfway = [0, 1, 2].map(|i| (0.5 * (Vec3::from(CORNERS[i]) + Vec3::from(moved[i]))).to_array());
        let found = seen(mesh, blend(&halfway, 0.25, 0.5), 0.5, None);
        assert!((found - blend(&COLORS, 0.25, 0.5)).abs().max_element() < 1e-5, "{found}");
    }
}
