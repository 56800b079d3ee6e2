//! Triangles, sampled by area.

use super::EmitterSample;
use crate::geometry::{SpawnPoint, TrianglePoints};
use crate::math::float::UNIT_ROUNDOFF;
use crate::math::{DVec3, Vec3};
use crate::sampling::warp;

/// A triangle of a mesh.
pub(super) struct TriangleEmitter {
    corner: DVec3,
    edge_u: DVec3,
    edge_v: DVec3,
    /// Unit normal, towards the front; zero if there is no area.
    normal: DVec3,
    area: f64,
    /// Bound on the error of the surface's position as an accelerator sees it.
    pub error: f32,
}

/// The error that [`SurfaceInteraction::error`](crate::geometry::SurfaceInteraction::error) states for a hit of a
/// triangle, for all its points: four units of roundoff of its extent. More for a sliver, since nobody confirms that a
/// shadow ray ends before it.
pub(super) fn triangle_error(points: &TrianglePoints) -> f32 {
    let error = 4.0 * UNIT_ROUNDOFF as f32 * points.bounds().size().max_element();
    if points.is_sliver() { error * 0.5 * points.flatness() as f32 } else { error }
}

/// A point of a triangle, uniform over its area, with the unit normal of its front.
pub(crate) fn triangle_point(points: &TrianglePoints, u: [f32; 2]) -> SpawnPoint {
    let [b, c] = warp::uniform_triangle(u);
    let [a, edge_u, edge_v] = [points.a, points.b - points.a, points.c - points.a].map(Vec3::as_dvec3);
    let (p, n) = (a + edge_u * b + edge_v * c, points.cross().normalize().as_vec3());
    SpawnPoint { p, n, error: triangle_error(points) }
}

impl TriangleEmitter {
    pub fn new(points: &TrianglePoints) -> Self {
        let corner = points.a.as_dvec3();
        let cross = points.cross();
        Self {
            corner,
            edge_u: points.b.as_dvec3() - corner,
            edge_v: points.c.as_dvec3() - corner,
            normal: cross.normalize_or_zero(),
            area: 0.5 * cross.length(),
            error: triangle_error(points),
        }
    }

    pub fn area(&self) -> f64 {
        self.area
    }

    /// Unit normal, towards the front.
    pub fn normal(&self) -> Vec3 {
        self.normal.as_vec3()
    }

    /// Whether `p` sees the front.
    #[inline]
    pub fn sees_front(&self, p: DVec3) -> bool {
        self.normal.dot(p - self.corner) > 0.0
    }

    /// A point as seen from `p`; `None` in the plane.
    #[inline]
    pub fn sample(&self, p: DVec3, u: [f32; 2]) -> Option<EmitterSample> {
        let [b, c] = warp::uniform_triangle(u);
        EmitterSample::from_area(p, self.corner + self.edge_u * b + self.edge_v * c, self.normal, 1.0 / self.area)
    }
}
