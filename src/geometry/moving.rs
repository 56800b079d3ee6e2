//! Points of surfaces by the corners of their triangles: where they are at other times, and their parameters.

use super::attributes::weights;
use super::{Geometry, Hit, Mesh, Shape, SurfaceInteraction};
use crate::id::PrimId;
use crate::math::{DVec3, Vec2};

impl Mesh {
    /// The weights of a triangle's corners at a point of it, at a time from 0 to 1.
    pub(super) fn weights_at(&self, prim: PrimId, p: DVec3, time: f32) -> [f64; 3] {
        let points = self.triangle_points_at(prim, time);
        let weights = weights([points.a, points.b, points.c].map(|corner| p - corner.as_dvec3()));
        let sum: f64 = weights.iter().sum();
        // A triangle may have no area for a moment.
        if sum > 0.0 && sum < f64::INFINITY { weights.map(|w| w / sum) } else { [1.0 / 3.0; 3] }
    }
}

impl Geometry {
    /// Surface parameters of a point of which only the [position](super::Detail::Position) is known; `hit` is what led
    /// to it.
    pub fn uv(&self, at: &SurfaceInteraction, hit: Option<&Hit>) -> Vec2 {
        let Shape::Mesh(mesh) = self.shape(at.shape) else { return at.uv };
        // By a rounding artefact, the ray meets another triangle than that of the hit.
        if let Some(hit) = hit.filter(|hit| (hit.instance, hit.shape, hit.prim) == at.ids()) {
            return mesh.uv(at.prim, hit.u, hit.v);
        }
        let local =
            if at.is_instanced() { self.instance(at.instance).transform_at(at.time).inverse_point(at.p) } else { at.p };
        let [_, u, v] = mesh.weights_at(at.prim, local, at.time);
        mesh.uv(at.prim, u as f32, v as f32)
    }

    /// Where a point of a surface is in the world when the shutter opens and when it closes.
    pub fn ends_of_motion(&self, at: &SurfaceInteraction) -> [DVec3; 2] {
        let mesh = match self.shape(at.shape) {
            Shape::Mesh(mesh) if mesh.is_deforming() => Some(mesh),
            _ => None,
        };
        let instance = at.is_instanced().then(|| self.instance(at.instance));
        let motion = instance.and_then(|instance| instance.motion.as_deref());
        if mesh.is_none() && motion.is_none() {
            return [at.p; 2];
        }
        let local = instance.map_or(at.p, |instance| instance.transform_at(at.time).inverse_point(at.p));
        let weights = mesh.map(|mesh| mesh.weights_at(at.prim, local, at.time));
        [0.0, 1.0].map(|time| {
            let local = match (mesh, weights) {
                (Some(mesh), Some([a, b, c])) => {
                    let points = mesh.triangle_points_at(at.prim, time);
                    points.a.as_dvec3() * a + points.b.as_dvec3() * b + points.c.as_dvec3() * c
                }
                _ => local,
            };
            instance.map_or(local, |instance| match &instance.motion {
                None => instance.transform.point(local),
                Some(motion) => motion.map_at(f64::from(time)).transform_point3(local),
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Analytic, Instance, MeshStep, Object, Sphere, TransformedShape};
    use crate::id::{InstanceId, ObjectId, ShapeId};
    use crate::math::{DAffine3, Motion, Ray, Transform, Vec3};

    fn seen(geometry: &Geometry, ray: &Ray, instance: InstanceId) -> SurfaceInteraction {
        let hit = Hit { t: 1.0, u: 0.0, v: 0.0, shape: ShapeId(0), prim: PrimId(0), instance };
        geometry.interaction(ray, &hit).unwrap()
    }

    fn instanced(shape: Shape, motion: Motion) -> Geometry {
        let instance = Instance::moving(ObjectId(0), motion).unwrap();
        let objects = vec![Object { shapes: vec![ShapeId(0)] }];
        Geometry { shapes: vec![shape], objects, instances: vec![instance], ..Geometry::default() }
    }

    fn triangle() -> Mesh {
        Mesh::new(vec![[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]], vec![[0, 1, 2]], None, None).unwrap()
    }

    /// From above, at a time.
    fn down(x: f32, y: f32, time: f32) -> Ray {
        Ray { time, ..Ray::new(Vec3::new(x, y, 5.0), -Vec3::Z) }
    }

    #[test]
    fn what_rests_stays() {
        let still = Geometry { shapes: vec![Shape::Mesh(triangle())], ..Geometry::default() };
        let at = seen(&still, &down(1.0, 0.5, 0.3), Hit::NO_INSTANCE);
        assert_eq!(still.ends_of_motion(&at), [at.p; 2]);
    }

    #[test]
    fn points_turn_and_shift_with_their_instance() {
        let sphere =
            Shape::Analytic(TransformedShape::new(Analytic::Sphere(Sphere::full(1.0).unwrap()), Transform::IDENTITY));
        let later = DAffine3::from_translation(DVec3::new(2.0, 0.0, 0.0)) * DAffine3::from_rotation_z(1.0);
        let geometry = instanced(sphere, Motion::keyframed(&[(0.0, DAffine3::IDENTITY), (1.0, later)]).unwrap());
        // Halfway, the sphere stands at x = 1 and has turned by 0.5.
        let at = seen(&geometry, &down(1.5, 0.25, 0.5), InstanceId(0));
        let local = DAffine3::from_rotation_z(-0.5).transform_point3(at.p - DVec3::X);
        let [open, close] = geometry.ends_of_motion(&at);
        assert!(
            (open - local).length() < 1e-6 && (close - later.transform_point3(local)).length() < 1e-6,
            "{open} {close}"
        );
    }

    #[test]
    fn points_of_a_deforming_mesh_go_with_its_corners() {
        // Corner b moves by x = 2 in the first half, and stays; c moves by z = 1 in the second.
        let step = |b: f32, c: f32| MeshStep { positions: vec![[0.0; 3], [b, 0.0, 0.0], [0.0, 4.0, c]], normals: None };
        let mesh = triangle().deforming(vec![step(6.0, 0.0), step(6.0, 1.0)]).unwrap();
        let lift =
            Motion::keyframed(&[(0.0, DAffine3::IDENTITY), (1.0, DAffine3::from_translation(DVec3::Z))]).unwrap();
        for motion in [None, Some(lift)] {
            let lifted = if motion.is_some() { 1.0 } else { 0.0 };
            let geometry = match motion {
                None => Geometry { shapes: vec![Shape::Mesh(mesh.clone())], ..Geometry::default() },
                Some(motion) => instanced(Shape::Mesh(mesh.clone()), motion),
            };
            let instance = if lifted > 0.0 { InstanceId(0) } else { Hit::NO_INSTANCE };
            // At half time: weights 1/4 of a, 1/2 of b, 1/4 of c.
            let at = seen(&geometry, &down(3.0, 1.0, 0.5), instance);
            let [open, close] = geometry.ends_of_motion(&at);
            assert!((open - DVec3::new(2.0, 1.0, 0.0)).length() < 1e-6, "{open}");
            assert!((close - DVec3::new(3.0, 1.0, 0.25 + lifted)).length() < 1e-6, "{close}");
        }
    }
}
