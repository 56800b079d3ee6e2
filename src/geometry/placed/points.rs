//! Points of many hits on one analytic surface, the same as of each of them alone.

use super::{Analytic, CenteredRay, LocalHit, Placed};
use crate::geometry::{Detail, LocalSurface};
use crate::math::float::UNIT_ROUNDOFF;
use crate::math::rows::{BATCH, Element, soa};
use crate::math::vectorize::{Kernel, vectorize};
use crate::math::{DVec3, Ray, RayF64, RayRows, Vec3};

soa! {
    /// Points of a surface.
    pub struct PlacedPointRows {
        /// The point, in the space the shape is placed in.
        p: DVec3,
        /// Distance in units of the ray's direction.
        t: f64,
    }
}

soa! {
    /// What else is found of them.
    pub struct PlacedNormalRows {
        /// Unit normal.
        n: Vec3,
        /// 0 where [`Placed::interaction`] has to be called, else 1.
        is_resolved: u32,
    }
}

/// Finds the points of the hits of the first `count` rays at the distances `t`, at most [`BATCH`], without parameters. Nothing is resolved on surfaces of
/// revolution.
pub(super) fn resolve(
    placed: &Placed,
    rays: &RayRows,
    t: &[f32; BATCH],
    count: usize,
    points: &mut PlacedPointRows,
    normals: &mut PlacedNormalRows,
) {
    vectorize(Resolve { placed, rays, t, count, points, normals });
}

struct Resolve<'a> {
    placed: &'a Placed,
    rays: &'a RayRows,
    t: &'a [f32; BATCH],
    count: usize,
    points: &'a mut PlacedPointRows,
    normals: &'a mut PlacedNormalRows,
}

/// The distance and the surface of a shape, inlined into loops.
trait Surface {
    fn distance(&self, ray: &RayF64) -> f64;
    fn surface(&self, ray: &RayF64, hit: &LocalHit) -> LocalSurface;
}

macro_rules! surfaces {
    ($($shape:ident: |$self:ident, $ray:ident, $hit:ident| $surface:expr),*) => {$(
        impl Surface for crate::geometry::$shape {
            #[inline(always)]
            fn distance(&self, ray: &RayF64) -> f64 {
                Self::distance(self, ray)
            }

            #[inline(always)]
            fn surface(&$self, $ray: &RayF64, $hit: &LocalHit) -> LocalSurface {
                $surface
            }
        }
    )*};
}

surfaces! {
    Sphere: |self, ray, hit| Self::surface(self, Detail::Place, ray, hit),
    Quad: |self, ray, hit| Self::surface(self, ray, hit),
    Disk: |self, ray, hit| Self::surface(self, Detail::Place, ray, hit),
    Frustum: |self, ray, hit| Self::surface(self, Detail::Place, ray, hit)
}

impl Kernel for Resolve<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { placed, rays, t, count, points, normals } = self;
        match &placed.shape {
            Analytic::Sphere(sphere) => resolve_on(placed, sphere, rays, t, count, points, normals),
            Analytic::Quad(quad) => resolve_on(placed, quad, rays, t, count, points, normals),
            Analytic::Disk(disk) => resolve_on(placed, disk, rays, t, count, points, normals),
            Analytic::Frustum(frustum) => resolve_on(placed, frustum, rays, t, count, points, normals),
            Analytic::Revolution(_) => normals.is_resolved = [0; BATCH],
        }
    }
}

#[inline(always)]
fn resolve_on<S: Surface>(
    placed: &Placed,
    shape: &S,
    rays: &RayRows,
    t: &[f32; BATCH],
    count: usize,
    points: &mut PlacedPointRows,
    normals: &mut PlacedNormalRows,
) {
    for i in 0..count.next_multiple_of(16).min(BATCH) {
        let ray = Ray { t_min: rays.t_min[i], ..Ray::new(rays.origin.get(i), rays.direction.get(i)) };
        let CenteredRay { ray: local, shift } = placed.centered_ray(&ray);
        let distance = shape.distance(&local);
        let surface = shape.surface(&local, &LocalHit { t: distance, profile: 0.0 });
        let found = placed.place(surface.p, surface.n, surface.pdf_area);
        points.p.set(i, found.p);
        points.t[i] = distance + shift;
        normals.n.set(i, found.n);
        // The first hit is the one that was found, and ahead; false for a NaN.
        let expected = f64::from(<f32 as Element>::get(t, i));
        let is_resolved = ((expected - shift) - distance <= 8.0 * UNIT_ROUNDOFF * expected) & (distance + shift > 0.0);
        normals.is_resolved[i] = u32::from(is_resolved);
    }
}
