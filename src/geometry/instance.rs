//! Objects and their instances: one level; deeper nesting is flattened before it gets here.

use std::borrow::Cow;

use super::{Detail, Hit, Shape, SurfaceInteraction};
use crate::id::{ObjectId, ShapeId};
use crate::math::float::{EMBREE_LARGE, UNIT_ROUNDOFF};
use crate::math::{Aabb, Bounds, DMat3, DVec3, Motion, Ray, Transform, Vec3};

/// A group of shapes in a space of its own.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Object {
    /// The shapes of the group.
    pub shapes: Vec<ShapeId>,
}

/// How far the map to an instance's object space can move a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InverseReach {
    /// Largest sum of magnitudes of a row of the linear part.
    pub reach: f32,
    /// Largest magnitude of a component of the translation.
    pub offset: f32,
}

/// A point of a surface with its normals.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PointWithNormals {
    pub p: DVec3,
    /// As [`SurfaceInteraction::error`].
    pub error: f32,
    pub n_g: Vec3,
    pub n_s: Vec3,
}

/// One placement of an object in the world.
#[derive(Clone, Debug, PartialEq)]
pub struct Instance {
    /// What is placed.
    pub object: ObjectId,
    /// Where; of an instance that moves, at the opening of the shutter.
    pub transform: Transform,
    /// How it moves.
    pub motion: Option<Box<Motion>>,
}

impl Instance {
    /// An instance at rest.
    pub fn new(object: ObjectId, transform: Transform) -> Self {
        Self { object, transform, motion: None }
    }

    /// An instance that moves, or rests if the motion is constant. `None` if the motion is singular.
    pub fn moving(object: ObjectId, motion: Motion) -> Option<Self> {
        let transform = Transform::new(motion.map_at(0.0))?;
        let motion = motion.as_constant().is_none().then(|| Box::new(motion));
        Some(Self { object, transform, motion })
    }

    /// Whether the map stretches so unevenly that an inverse made in `f32` exceeds the bound of
    /// [`SurfaceInteraction::error`].
    pub fn is_uneven(&self) -> bool {
        let squared_norm =
            |m: &DMat3| m.x_axis.length_squared() + m.y_axis.length_squared() + m.z_axis.length_squared();
        // The product is 9 for a rotation with a scale; the square of the limit is that of a stretch by about 8 along
        // one axis.
        let Transform { world_from_object, object_from_world, .. } = &self.transform;
        squared_norm(&world_from_object.matrix3) * squared_norm(&object_from_world.matrix3) > 9.0 * 16.0
    }

    /// How far rays are moved by the inverse of the transform, found by cofactors in `f32` as Embree finds it; `None`
    /// if that is not finite, leaves no room for any ray, or its determinant is denormal.
    pub fn inverse_reach(&self) -> Option<InverseReach> {
        let m = &self.transform.world_from_object;
        let (x, y, z) = (m.matrix3.x_axis.as_vec3(), m.matrix3.y_axis.as_vec3(), m.matrix3.z_axis.as_vec3());
        let rows = [y.cross(z), z.cross(x), x.cross(y)];
        let determinant = x.dot(rows[0]);
        if !determinant.is_normal() {
            return None;
        }
        let rows = rows.map(|row| row / determinant);
        let translation = m.translation.as_vec3();
        let offsets = rows.map(|row| row.abs().dot(translation.abs()));
        let reach = rows.iter().map(|row| row.abs().element_sum()).fold(0.0, f32::max);
        let offset = offsets.into_iter().fold(0.0, f32::max);
        // A NaN row would be lost in the maxima, so each is checked.
        let finite = rows.iter().all(|row| row.is_finite()) && offsets.iter().all(|o| *o < 0.25 * EMBREE_LARGE);
        (finite && reach.is_normal()).then_some(InverseReach { reach, offset })
    }

    /// Where it stands at a time from 0 to 1.
    #[inline]
    pub fn transform_at(&self, time: f32) -> Cow<'_, Transform> {
        match &self.motion {
            None => Cow::Borrowed(&self.transform),
            Some(motion) => Cow::Owned(motion.at(f64::from(time))),
        }
    }

    /// World bounds of this instance of an object with the given bounds, over the whole shutter interval.
    pub fn bounds(&self, object: &Aabb) -> Aabb {
        if object.is_empty() {
            return Aabb::EMPTY;
        }
        let exact = Bounds { min: object.min.as_dvec3(), max: object.max.as_dvec3() };
        match &self.motion {
            None => exact.transformed(&self.transform.world_from_object).padded(),
            Some(motion) => motion.bounds(&exact).padded(),
        }
    }

    /// `ray` in the object's space, rounded to `f32` as accelerators trace it; `t` keeps its meaning.
    #[inline]
    pub fn object_ray(&self, ray: &Ray) -> Ray {
        let transform = self.transform_at(ray.time);
        Ray {
            origin: transform.inverse_point(ray.origin.as_dvec3()).as_vec3(),
            direction: transform.inverse_vector(ray.direction.as_dvec3()).as_vec3(),
            ..*ray
        }
    }

    /// The interaction of a hit of the world-space `ray` with a shape of the object.
    #[inline(never)]
    pub(super) fn interaction(
        &self,
        shape: &Shape,
        detail: Detail,
        ray: &Ray,
        hit: &Hit,
    ) -> Option<SurfaceInteraction> {
        let local_ray = self.object_ray(ray);
        let local = shape.interaction(detail, &local_ray, hit)?;
        let t = &*self.transform_at(ray.time);
        let point = PointWithNormals { p: local.p, error: local.error, n_g: local.n_g, n_s: local.n_s };
        let PointWithNormals { p, error, n_g, n_s } = Self::placed(t, &point);
        let dp_du = finite_or_zero(t.vector(local.dp_du.as_dvec3()).as_vec3());
        Some(SurfaceInteraction { p, error, n_g, n_s, dp_du, instance: hit.instance, ..local })
    }

    /// A point of the object where the instance stands at a time from 0 to 1.
    #[inline]
    pub(crate) fn point_at(&self, local: &PointWithNormals, time: f32) -> PointWithNormals {
        Self::placed(&self.transform_at(time), local)
    }

    #[inline(always)]
    fn placed(t: &Transform, local: &PointWithNormals) -> PointWithNormals {
        let n_local = local.n_g.as_dvec3();
        let n_world = t.normal(n_local);
        let n_g = n_world.normalize().as_vec3();
        let n_s = t.normal(local.n_s.as_dvec3()).normalize().as_vec3();
        let p = t.point(local.p);

        // The accelerator inverts the matrix and moves the ray in f32: 4 units of roundoff of each term, seen along the
        // normal.
        let inverse = &t.object_from_world;
        let m = &inverse.matrix3;
        let moved = m.x_axis.abs() * p.x.abs()
            + m.y_axis.abs() * p.y.abs()
            + m.z_axis.abs() * p.z.abs()
            + inverse.translation.abs();
        let stretch = 1.0 / n_world.length();
        let along = n_local.abs().dot(moved) * stretch;
        let error = 4.0 * UNIT_ROUNDOFF * along
            + f64::from(local.error) * stretch
            + UNIT_ROUNDOFF * n_local.abs().dot(local.p.abs()) * stretch;

        PointWithNormals { p, error: error as f32, n_g, n_s: if n_s.dot(n_g) < 0.0 { -n_s } else { n_s } }
    }
}

pub(super) fn finite_or_zero(v: Vec3) -> Vec3 {
    if v.is_finite() { v } else { Vec3::ZERO }
}
