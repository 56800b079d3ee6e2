//! Colours of meshes, one for each vertex.

use super::mesh::{Mesh, MeshError};
use super::{Geometry, Shape, SurfaceInteraction};
use crate::color::Rgb;
use crate::id::PrimId;
use crate::math::DVec3;

impl Mesh {
    /// This mesh with a colour for each vertex.
    ///
    /// # Errors
    /// If there are more or fewer than vertices, or a channel is not within `[0, 1]`.
    pub fn with_colors(mut self, colors: Vec<[f32; 3]>) -> Result<Self, MeshError> {
        let vertices = self.positions().len();
        if colors.len() != vertices {
            return Err(MeshError::Count { what: "colors", count: colors.len(), vertices });
        }
        if let Some(vertex) = colors.iter().position(|color| !color.iter().all(|c| (0.0..=1.0).contains(c))) {
            return Err(MeshError::Color { vertex, color: colors[vertex] });
        }
        self.colors = Some(colors.into());
        Ok(self)
    }

    /// Whether vertices have colours.
    pub fn has_colors(&self) -> bool {
        self.colors.is_some()
    }

    /// The colour at a point of a triangle at a time from 0 to 1; `None` if vertices have none.
    fn color(&self, prim: PrimId, p: DVec3, time: f32) -> Option<Rgb> {
        let colors = self.colors.as_ref()?;
        let points = self.triangle_points_at(prim, time);
        let weights = weights([points.a, points.b, points.c].map(|corner| p - corner.as_dvec3()));
        let sum: f64 = weights.iter().sum();
        // A triangle that deforms may have no area for a moment.
        let weights = if sum > 0.0 && sum < f64::INFINITY { weights.map(|w| (w / sum) as f32) } else { [1.0 / 3.0; 3] };
        let [a, b, c] = self.triangles()[prim.index()].map(|i| Rgb::from(colors[i as usize]));
        Some(a * weights[0] + b * weights[1] + c * weights[2])
    }
}

impl Geometry {
    /// The colour of the surface at a point, between those of the vertices; white where these have none.
    #[inline(never)]
    pub fn vertex_color(&self, at: &SurfaceInteraction) -> Rgb {
        let Shape::Mesh(mesh) = self.shape(at.shape) else { return Rgb::WHITE };
        let p = if at.is_instanced() { self.instance(at.instance).transform_at(at.time).inverse_point(at.p) } else { at.p };
        mesh.color(at.prim, p, at.time).unwrap_or(Rgb::WHITE)
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
    use crate::geometry::{Hit, Instance, MeshStep, Object};
    use crate::id::{InstanceId, ObjectId, ShapeId};
    use crate::math::{DAffine3, Ray, Rng, Transform, Vec3};

    const CORNERS: [[f32; 3]; 3] = [[1.0, 0.5, 0.0], [4.0, 0.0, 1.0], [0.0, 3.0, -1.0]];
    const COLORS: [[f32; 3]; 3] = [[1.0, 0.25, 0.0], [0.0, 0.5, 0.0], [0.5, 0.0, 1.0]];

    fn triangle() -> Mesh {
        Mesh::new(CORNERS.to_vec(), vec![[0, 1, 2]], None, None).unwrap().with_colors(COLORS.to_vec()).unwrap()
    }

    fn blend(values: &[[f32; 3]; 3], u: f32, v: f32) -> Vec3 {
        let [a, b, c] = values.map(Vec3::from);
        a * (1.0 - u - v) + b * u + c * v
    }

    /// The colour where a ray along `-z` of the object's space meets the triangle, placed by `map` through an instance.
    fn seen(mesh: Mesh, target: Vec3, time: f32, map: Option<DAffine3>) -> Vec3 {
        let mut geometry = Geometry { shapes: vec![Shape::Mesh(mesh)], ..Geometry::default() };
        let place = map.unwrap_or(DAffine3::IDENTITY);
        let (origin, toward) = (place.transform_point3(target.as_dvec3() + DVec3::Z), place.transform_vector3(-DVec3::Z));
        let ray = Ray { time, ..Ray::new(origin.as_vec3(), toward.as_vec3()) };
        let mut hit = Hit { t: 1.0, u: 0.0, v: 0.0, shape: ShapeId(0), prim: PrimId(0), instance: Hit::NO_INSTANCE };
        if let Some(map) = map {
            geometry.objects.push(Object { shapes: vec![ShapeId(0)] });
            geometry.instances.push(Instance::new(ObjectId(0), Transform::new(map).unwrap()));
            hit.instance = InstanceId(0);
        }
        let at = geometry.interaction(&ray, &hit).unwrap();
        Vec3::from(geometry.vertex_color(&at).to_array())
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
            let (target, wanted) = (blend(&CORNERS, u, v), blend(&COLORS, u, v));
            for map in [None, Some(map)] {
                let found = seen(triangle(), target, 0.0, map);
                assert!((found - wanted).abs().max_element() < 1e-5, "{u} {v} {map:?}: {found} for {wanted}");
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

    #[test]
    fn colours_that_make_no_sense_are_refused() {
        let with = |colors: Vec<[f32; 3]>| triangle().with_colors(colors).map(drop);
        assert_eq!(with(vec![[0.5; 3]; 4]), Err(MeshError::Count { what: "colors", count: 4, vertices: 3 }));
        for (bad, part) in [(f32::NAN, "NaN"), (-0.1, "-0.1"), (1.5, "1.5"), (f32::INFINITY, "inf")] {
            let mut colors = COLORS.to_vec();
            colors[1][2] = bad;
            let message = with(colors).unwrap_err().to_string();
            assert!(message.contains("vertex 1") && message.contains(part), "{message}");
        }
    }

    #[test]
    fn a_surface_without_colours_is_white() {
        let plain = Mesh::new(CORNERS.to_vec(), vec![[0, 1, 2]], None, None).unwrap();
        assert_eq!(seen(plain, blend(&CORNERS, 0.25, 0.25), 0.0, None), Vec3::ONE);
    }
}
