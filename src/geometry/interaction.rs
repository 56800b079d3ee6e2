//! A point on a surface with all that shading needs, and the rays that start there.
//!
//! Secondary rays start at the hit point moved off the surface by a bound of the rounding errors made so far: no
//! tolerance in scene units. The bound has a part for rounding the origin to `f32` (the half-ulp box) and, where an
//! accelerator computes in `f32`, a part for that.

use crate::geometry::Hit;
use crate::id::{InstanceId, PrimId, ShapeId};
use crate::math::float::UNIT_ROUNDOFF;
use crate::math::{DVec3, Ray, Vec2, Vec3};

/// A point on a surface.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceInteraction {
    /// The point, in world space.
    pub p: DVec3,
    /// Distance along the ray that found it, in units of its direction.
    pub t: f32,
    /// Bound on the error of the surface's position as an accelerator sees it, along the normal, beyond the rounding of
    /// `p` to `f32`.
    pub error: f32,
    /// Unit geometric normal, towards the front of the surface.
    pub n_g: Vec3,
    /// Unit shading normal, in the hemisphere of `n_g`.
    pub n_s: Vec3,
    /// Change of the point with `u`; any length, zero where the surface has no parametrisation.
    pub dp_du: Vec3,
    /// Surface parameters; see each shape.
    pub uv: Vec2,
    /// The shape.
    pub shape: ShapeId,
    /// The primitive of the shape.
    pub prim: PrimId,
    /// The instance, or [`Hit::NO_INSTANCE`].
    pub instance: InstanceId,
    /// Time of the ray that found it; rays from here have the same.
    pub time: f32,
}

/// How much of an interaction is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Detail {
    /// All but the parametrisation: `uv` and `dp_du` may be zero.
    Position,
    /// Everything.
    Full,
}

/// Where a ray starts or ends: a point of a surface, or in space.
#[derive(Clone, Copy, Debug)]
pub struct SpawnPoint {
    /// The point, in world space.
    pub p: DVec3,
    /// Unit geometric normal at the point; zero for a point in space.
    pub n: Vec3,
    /// As [`SurfaceInteraction::error`].
    pub error: f32,
}

impl SurfaceInteraction {
    /// The ids of this interaction as a hit would name them.
    pub fn ids(&self) -> (InstanceId, ShapeId, PrimId) {
        (self.instance, self.shape, self.prim)
    }

    /// Whether the surface was reached through an instance.
    pub fn is_instanced(&self) -> bool {
        self.instance != Hit::NO_INSTANCE
    }

    /// Where rays from here start.
    #[inline(always)]
    pub fn spawn_point(&self) -> SpawnPoint {
        SpawnPoint { p: self.p, n: self.n_g, error: self.error }
    }

    /// A ray from here in `direction` without an end.
    #[inline]
    pub fn spawn(&self, direction: Vec3) -> Ray {
        Ray { time: self.time, ..self.spawn_point().ray_along(direction) }
    }

    /// A ray from here to just before `target`: `t` runs from 0 to the largest number below 1.
    #[inline(always)]
    pub fn spawn_to(&self, target: &SpawnPoint) -> Ray {
        Ray { time: self.time, ..self.spawn_point().ray_to(target) }
    }
}

impl SpawnPoint {
    /// A ray from here in `direction` without an end.
    #[inline(always)]
    pub fn ray_along(&self, direction: Vec3) -> Ray {
        let side = direction.dot(self.n);
        Ray::new(offset_origin(self.p, self.n, self.error, side), direction)
    }

    /// A ray from here to just before `target`: `t` runs from 0 to the largest number below 1.
    #[inline(always)]
    pub fn ray_to(&self, target: &Self) -> Ray {
        let toward = (target.p - self.p).as_vec3();
        let origin = offset_origin(self.p, self.n, self.error, toward.dot(self.n));
        // The end moves off the light towards us, also by the rounding of the direction and of the accelerator's
        // arithmetic on it.
        let side = -toward.dot(target.n);
        let n = target.n.as_dvec3().abs();
        let end_error = f64::from(target.error) + 4.0 * UNIT_ROUNDOFF * n.dot(toward.as_dvec3().abs());
        let end = offset_point(target.p, target.n, end_error, side);
        let direction = (end - origin.as_dvec3()).as_vec3();
        Ray { t_max: 1f32.next_down(), ..Ray::new(origin, direction) }
    }
}

/// `p` moved along `n` to the given side by the half-ulp box plus `error`, in `f64`.
#[inline(always)]
fn offset_point(p: DVec3, n: Vec3, error: f64, side: f32) -> DVec3 {
    let n = n.as_dvec3();
    let delta = UNIT_ROUNDOFF * n.abs().dot(p.abs()) + error;
    p + n * delta.copysign(f64::from(side))
}

/// [`offset_point`] rounded to `f32`. The half-ulp box is added twice: what rounding to nearest takes back at most, and
/// what is to remain.
#[inline(always)]
fn offset_origin(p: DVec3, n: Vec3, error: f32, side: f32) -> Vec3 {
    let half_ulp_box = UNIT_ROUNDOFF * n.as_dvec3().abs().dot(p.abs());
    offset_point(p, n, f64::from(error) + half_ulp_box, side).as_vec3()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(p: DVec3, n: Vec3) -> SurfaceInteraction {
        SurfaceInteraction {
            p,
            t: 1.0,
            error: 0.0,
            n_g: n,
            n_s: n,
            dp_du: Vec3::ZERO,
            uv: Vec2::ZERO,
            shape: ShapeId(0),
            prim: PrimId(0),
            instance: Hit::NO_INSTANCE,
            time: 0.0,
        }
    }

    #[test]
    fn origins_lie_on_the_side_of_the_direction() {
        let n = Vec3::new(0.48, 0.6, 0.64);
        for scale in [1e-6, 1.0, 1e6] {
            let p = DVec3::new(0.1234, -5.678, 3.21) * scale;
            for side in [1f32, -1.0] {
                let origin = point(p, n).spawn(n * side).origin;
                assert!((origin.as_dvec3() - p).dot(n.as_dvec3()) * f64::from(side) > 0.0, "{scale} {side}");
                assert!(
                    (origin.as_dvec3() - p).length() < 6.0 * f64::from(f32::EPSILON) * p.length(),
                    "{scale} {side}"
                );
            }
        }
    }

    #[test]
    fn shadow_rays_end_before_the_light() {
        let target = SpawnPoint { p: DVec3::new(0.3, 7.0, 0.2), n: -Vec3::Y, error: 0.0 };
        let ray = point(DVec3::new(1.0, 0.1, 2.0), Vec3::Y).spawn_to(&target);
        assert!(ray.origin.y > 0.1 && f64::from(ray.at(ray.t_max).y) < 7.0);
    }
}
