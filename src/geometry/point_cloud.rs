//! Points: spheres by the million as one shape.

use super::curves::check_points;
use super::sphere::roots;
use super::{CurvesError, Detail, Hit, LocalHit, Sphere, SurfaceInteraction};
use crate::id::PrimId;
use crate::math::float::F64_CHAIN_ERROR;
use crate::math::{Aabb, Bounds, DVec3, Ray, RayF64, Vec2, Vec3};

/// Spheres, validated: every number is finite, no radius below 0. Those of radius 0 are never hit.
#[derive(Clone, Debug, PartialEq)]
pub struct Points {
    /// x, y, z and the radius.
    points: Vec<[f32; 4]>,
    bounds: Aabb,
}

impl Points {
    /// Spheres from their centres and radii.
    ///
    /// # Errors
    /// If there is none, a number is not finite, or a radius below 0.
    pub fn new(points: Vec<[f32; 4]>) -> Result<Self, CurvesError> {
        if points.is_empty() {
            return Err(CurvesError::Empty);
        }
        check_points(&points)?;
        let mut points = Self { points, bounds: Aabb::EMPTY };
        points.bounds =
            (0..points.prim_count()).fold(Aabb::EMPTY, |all, i| all.union(&points.prim_bounds(PrimId::new(i))));
        Ok(points)
    }

    /// How many there are.
    pub fn prim_count(&self) -> usize {
        self.points.len()
    }

    /// Bounds of one.
    pub fn prim_bounds(&self, prim: PrimId) -> Aabb {
        let (center, radius) = self.sphere(prim);
        Bounds { min: center - radius, max: center + radius }.padded()
    }

    /// Bounds of all.
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// Bytes of the buffers.
    pub fn memory_bytes(&self) -> usize {
        size_of_val(self.points.as_slice())
    }

    fn sphere(&self, prim: PrimId) -> (DVec3, f64) {
        let [x, y, z, radius] = self.points[prim.index()].map(f64::from);
        (DVec3::new(x, y, z), radius)
    }

    /// `ray` about the centre, and the distances where it enters and leaves the sphere; NaN where it passes by.
    fn roots(&self, prim: PrimId, ray: &Ray) -> (RayF64, f64, [f64; 2]) {
        let (center, radius) = self.sphere(prim);
        let ray = RayF64 {
            origin: ray.origin.as_dvec3() - center,
            direction: ray.direction.as_dvec3(),
            t_min: f64::from(ray.t_min),
            t_max: f64::from(ray.t_max),
        };
        let found = if radius > 0.0 { roots(ray.origin, ray.direction, radius) } else { [f64::NAN; 2] };
        (ray, radius, found)
    }

    /// The distance of the first hit of a ray with one of them, within the ray's interval.
    pub fn intersect(&self, prim: PrimId, ray: &Ray) -> Option<f32> {
        let (ray, _, roots) = self.roots(prim, ray);
        roots.into_iter().find(|&t| ray.contains(t)).map(|t| t as f32)
    }

    /// The interaction for a hit of `ray`, with the change of the point with v. uv are those of a
    /// [sphere](Sphere) about +z.
    pub(super) fn interaction_and_dp_dv(
        &self,
        detail: Detail,
        ray: &Ray,
        hit: &Hit,
    ) -> Option<(SurfaceInteraction, Vec3)> {
        let (local, radius, [near, far]) = self.roots(hit.prim, ray);
        let wanted = f64::from(hit.t);
        let t = if (far - wanted).abs() < (near - wanted).abs() { far } else { near };
        // False for a NaN.
        let is_ahead = t > 0.0;
        if !is_ahead {
            return None;
        }
        let (center, _) = self.sphere(hit.prim);
        let surface = Sphere::full(radius).ok()?.surface(detail, &local, &LocalHit { t, profile: 0.0 });
        let p = center + surface.p;
        let n = surface.n.as_vec3();
        let at = SurfaceInteraction {
            p,
            t: t as f32,
            error: (F64_CHAIN_ERROR * (p.abs().max_element() + radius)) as f32,
            n_g: n,
            n_s: n,
            dp_du: surface.dp_du.as_vec3(),
            uv: Vec2::new(surface.uv[0] as f32, surface.uv[1] as f32),
            shape: hit.shape,
            prim: hit.prim,
            instance: hit.instance,
            time: ray.time,
        };
        Some((at, surface.dp_dv.as_vec3()))
    }
}
