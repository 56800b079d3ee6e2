//! Points of many hits on one analytic surface, the same as of each of them alone.

use super::{Analytic, CenteredRay, LocalHit, TransformedShape};
use crate::geometry::{Detail, Disk, Frustum, LocalSurface, Quad, ShapeSample, Sphere};
use crate::math::float::UNIT_ROUNDOFF;
use crate::math::rows::{BATCH, Element, Row, pair, soa, whole_vectors};
use crate::math::vectorize::vectorize;
use crate::math::{DVec3, Ray, RayF64, RayRows, Vec2, Vec3};

soa! {
    /// Points of a surface.
    pub struct WorldPointRows {
        /// The point, in the space the shape is placed in.
        p: DVec3,
    }
}

soa! {
    /// What else is found of them.
    pub struct WorldNormalRows {
        /// Distance in units of the ray's direction.
        t: f32,
        /// Unit normal.
        n: Vec3,
        /// Change of the point with u; as the next one, zero for other shapes than quads.
        dp_du: Vec3,
        /// Surface parameters.
        uv: Vec2,
        /// 1 where [`TransformedShape::interaction`] has to be called, else 0.
        is_unresolved: u32,
    }
}

soa! {
    /// Points as [`SurfacePoint`](super::SurfacePoint) has them.
    pub struct WorldSampleRows {
        /// The point, in the space the shape is placed in.
        p: DVec3,
        /// Unit normal.
        n: DVec3,
        /// Density per placed area.
        pdf_area: f64,
    }
}

/// Samples the first `count` points, at most [`BATCH`]. Surfaces of revolution are sampled alone.
pub(super) fn sample(placed: &TransformedShape, u: &[Row; 2], count: usize, out: &mut WorldSampleRows) {
    vectorize!(match &placed.shape {
        Analytic::Sphere(sphere) if sphere.is_full_turn() => sample_on::<_, true>(placed, sphere, u, count, out),
        Analytic::Sphere(sphere) => sample_on::<_, false>(placed, sphere, u, count, out),
        Analytic::Quad(quad) => sample_on::<_, true>(placed, quad, u, count, out),
        Analytic::Disk(disk) if disk.is_full_turn() => sample_on::<_, true>(placed, disk, u, count, out),
        Analytic::Disk(disk) => sample_on::<_, false>(placed, disk, u, count, out),
        Analytic::Frustum(frustum) if frustum.is_full_turn() => sample_on::<_, true>(placed, frustum, u, count, out),
        Analytic::Frustum(frustum) => sample_on::<_, false>(placed, frustum, u, count, out),
        Analytic::Revolution(_) => out.pdf_area = [0.0; BATCH],
    });
}

#[inline(always)]
fn sample_on<S: LaneShape, const FULL: bool>(
    placed: &TransformedShape,
    shape: &S,
    u: &[Row; 2],
    count: usize,
    out: &mut WorldSampleRows,
) {
    for i in 0..whole_vectors(count) {
        let sample = shape.sample::<FULL>(pair(u, i).map(f64::from));
        let point = placed.place(sample.p, sample.n, sample.pdf_area);
        out.p.set(i, point.p);
        out.n.set(i, point.n.as_dvec3());
        out.pdf_area[i] = point.pdf_area;
    }
}

/// Finds the points of the hits of the first `count` rays at the distances `t`, at most [`BATCH`], with parameters on
/// quads alone. Nothing is resolved on surfaces of revolution.
pub(super) fn resolve(
    placed: &TransformedShape,
    rays: &RayRows,
    t: &[f32; BATCH],
    count: usize,
    points: &mut WorldPointRows,
    normals: &mut WorldNormalRows,
) {
    vectorize!(match &placed.shape {
        Analytic::Sphere(sphere) => resolve_on(placed, sphere, rays, t, count, points, normals),
        Analytic::Quad(quad) => resolve_on(placed, quad, rays, t, count, points, normals),
        Analytic::Disk(disk) => resolve_on(placed, disk, rays, t, count, points, normals),
        Analytic::Frustum(frustum) => resolve_on(placed, frustum, rays, t, count, points, normals),
        Analytic::Revolution(_) => normals.is_unresolved = [1; BATCH],
    });
}

/// A shape whose functions are inlined into loops that become vector code.
trait LaneShape {
    fn distance(&self, ray: &RayF64) -> f64;
    fn place(&self, ray: &RayF64, hit: &LocalHit) -> LocalSurface;
    /// `FULL`: all angles are kept.
    fn sample<const FULL: bool>(&self, u: [f64; 2]) -> ShapeSample;
}

macro_rules! lane_shapes {
    ($($shape:ty: $detail:expr),*) => {$(
        impl LaneShape for $shape {
            #[inline(always)]
            fn distance(&self, ray: &RayF64) -> f64 {
                <$shape>::distance(self, ray)
            }

            #[inline(always)]
            fn place(&self, ray: &RayF64, hit: &LocalHit) -> LocalSurface {
                self.surface($detail, ray, hit)
            }

            #[inline(always)]
            fn sample<const FULL: bool>(&self, u: [f64; 2]) -> ShapeSample {
                self.sample_turn::<FULL>(u)
            }
        }
    )*};
}

lane_shapes!(Sphere: Detail::Position, Quad: Detail::Full, Disk: Detail::Position, Frustum: Detail::Position);

#[inline(always)]
fn resolve_on<S: LaneShape>(
    placed: &TransformedShape,
    shape: &S,
    rays: &RayRows,
    t: &[f32; BATCH],
    count: usize,
    points: &mut WorldPointRows,
    normals: &mut WorldNormalRows,
) {
    for i in 0..whole_vectors(count) {
        let ray = Ray { t_min: rays.t_min[i], ..Ray::new(rays.origin.get(i), rays.direction.get(i)) };
        let CenteredRay { ray: local, shift } = placed.centered_ray(&ray);
        let distance = shape.distance(&local);
        let surface = shape.place(&local, &LocalHit { t: distance, profile: 0.0 });
        let found = placed.place(surface.p, surface.n, surface.pdf_area);
        points.p.set(i, found.p);
        normals.t[i] = (distance + shift) as f32;
        normals.n.set(i, found.n);
        normals.dp_du.set(i, placed.transform.vector(surface.dp_du).as_vec3());
        normals.uv.set(i, Vec2::new(surface.uv[0] as f32, surface.uv[1] as f32));
        // The first hit is the one that was found, and ahead; false for a NaN.
        let expected = f64::from(<f32 as Element>::get(t, i));
        let is_resolved = ((expected - shift) - distance <= 8.0 * UNIT_ROUNDOFF * expected) & (distance + shift > 0.0);
        normals.is_unresolved[i] = u32::from(!is_resolved);
    }
}
