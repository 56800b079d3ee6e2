//! Points of many hits on one analytic surface, the same as of each of them alone.

use super::{Analytic, CenteredRay, LocalHit, Placed};
use crate::geometry::{Detail, Disk, Frustum, LocalSurface, Quad, Sphere};
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

/// A shape whose functions are inlined into loops that become vector code.
trait LaneShape {
    fn distance(&self, ray: &RayF64) -> f64;
    fn place(&self, ray: &RayF64, hit: &LocalHit) -> LocalSurface;
}

macro_rules! lane_shapes {
    ($($shape:ty),*) => {$(
        impl LaneShape for $shape {
            #[inline(always)]
            fn distance(&self, ray: &RayF64) -> f64 {
                <$shape>::distance(self, ray)
            }

            #[inline(always)]
            fn place(&self, ray: &RayF64, hit: &LocalHit) -> LocalSurface {
                self.surface(Detail::Place, ray, hit)
            }
        }
    )*};
}

lane_shapes!(Sphere, Quad, Disk, Frustum);

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
fn resolve_on<S: LaneShape>(
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
        let surface = shape.place(&local, &LocalHit { t: distance, profile: 0.0 });
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
