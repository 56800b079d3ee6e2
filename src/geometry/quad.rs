//! Parallelograms.
//!
//! Object space: `origin + u edge_u + v edge_v` with `u` and `v` in `[0, 1]`, which are also the uv unless others are
//! given. The normal is `edge_u` x `edge_v`.

use super::{Detail, LocalHit, LocalSurface, ShapeError, ShapeSample};
use crate::math::{Bounds, DVec3, RayF64};

/// A parallelogram.
#[derive(Clone, Debug, PartialEq)]
pub struct Quad {
    origin: DVec3,
    edge_u: DVec3,
    edge_v: DVec3,
    n: DVec3,
    /// `dual_u · edge_u = 1`, `dual_u · edge_v = 0`, and the other way round.
    dual_u: DVec3,
    dual_v: DVec3,
    area: f64,
    /// uv at the origin, and their change along the edges.
    uv_origin: [f64; 2],
    uv_size: [f64; 2],
}

impl Quad {
    /// A parallelogram with one corner at `origin`.
    ///
    /// # Errors
    /// If a coordinate is not finite, or the edges are parallel or zero.
    pub fn new(origin: DVec3, edge_u: DVec3, edge_v: DVec3) -> Result<Self, ShapeError> {
        for (what, v) in [("origin", origin), ("u edge", edge_u), ("v edge", edge_v)] {
            if !v.is_finite() {
                return Err(ShapeError::NotFinite(what));
            }
        }
        let cross = edge_u.cross(edge_v);
        let area = cross.length();
        if !(area > 1e-12 * edge_u.length() * edge_v.length() && area.is_finite()) {
            return Err(ShapeError::NoArea);
        }
        let n = cross / area;
        let (dual_u, dual_v) = (edge_v.cross(n) / area, n.cross(edge_u) / area);
        if !(dual_u.is_finite() && dual_v.is_finite()) {
            return Err(ShapeError::NoArea);
        }
        Ok(Self { origin, edge_u, edge_v, n, dual_u, dual_v, area, uv_origin: [0.0; 2], uv_size: [1.0; 2] })
    }

    /// The same parallelogram with uv from `origin` to `origin + size`; no size is zero.
    #[must_use]
    pub fn with_uv(self, origin: [f64; 2], size: [f64; 2]) -> Self {
        Self { uv_origin: origin, uv_size: size, ..self }
    }

    /// The corner where u and v are zero.
    #[inline]
    pub fn origin(&self) -> DVec3 {
        self.origin
    }

    /// The edge along which u grows.
    #[inline]
    pub fn edge_u(&self) -> DVec3 {
        self.edge_u
    }

    /// The edge along which v grows.
    #[inline]
    pub fn edge_v(&self) -> DVec3 {
        self.edge_v
    }

    /// Distance of the hit within the ray's interval; NaN on a miss.
    #[inline(always)]
    pub fn distance(&self, ray: &RayF64) -> f64 {
        // A parallel ray gives an infinity or a NaN: then u and v are no finite numbers either, and fail their tests.
        let from_corner = ray.origin - self.origin;
        let t = -self.n.dot(from_corner) / self.n.dot(ray.direction);
        let q = from_corner + ray.direction * t;
        let (u, v) = (q.dot(self.dual_u), q.dot(self.dual_v));
        let is_hit = ray.contains(t) & t.is_finite() & (0.0..=1.0).contains(&u) & (0.0..=1.0).contains(&v);
        if is_hit { t } else { f64::NAN }
    }

    /// The surface at a hit of `ray`.
    #[inline(always)]
    pub fn surface(&self, detail: Detail, ray: &RayF64, hit: &LocalHit) -> LocalSurface {
        let q = ray.origin - self.origin + ray.direction * hit.t;
        let (u, v) = (q.dot(self.dual_u).clamp(0.0, 1.0), q.dot(self.dual_v).clamp(0.0, 1.0));
        let p = self.point(u, v);
        if detail == Detail::Position {
            return LocalSurface { p, n: self.n, pdf_area: 1.0 / self.area, ..LocalSurface::ZERO };
        }
        let ([u0, v0], [width, height]) = (self.uv_origin, self.uv_size);
        LocalSurface {
            p,
            n: self.n,
            dp_du: self.edge_u / width,
            dp_dv: self.edge_v / height,
            uv: [u0 + width * u, v0 + height * v],
            pdf_area: 1.0 / self.area,
        }
    }

    #[inline(always)]
    fn point(&self, u: f64, v: f64) -> DVec3 {
        self.origin + self.edge_u * u + self.edge_v * v
    }

    /// Exact bounds.
    pub fn bounds(&self) -> Bounds {
        let corners = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)];
        corners.iter().fold(Bounds::EMPTY, |b, &(u, v)| b.extended(self.point(u, v)))
    }

    /// Surface area.
    pub fn area(&self) -> f64 {
        self.area
    }

    /// A point distributed uniformly by area.
    #[inline(always)]
    pub fn sample(&self, u: [f64; 2]) -> ShapeSample {
        ShapeSample { p: self.point(u[0], u[1]), n: self.n, pdf_area: 1.0 / self.area }
    }

    /// [`sample`](Self::sample): there are no angles.
    #[inline(always)]
    pub(super) fn sample_turn<const FULL: bool>(&self, u: [f64; 2]) -> ShapeSample {
        self.sample(u)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::dvec3;

    #[test]
    fn edges_without_area_are_refused() {
        assert_eq!(Quad::new(DVec3::ZERO, DVec3::X, DVec3::X * 3.0), Err(ShapeError::NoArea));
        assert_eq!(Quad::new(DVec3::ZERO, DVec3::X, DVec3::ZERO), Err(ShapeError::NoArea));
        assert_eq!(Quad::new(DVec3::NAN, DVec3::X, DVec3::Y), Err(ShapeError::NotFinite("origin")));
        assert!(Quad::new(DVec3::ZERO, DVec3::X * 1e-9, DVec3::Y * 1e9).is_ok());
    }

    #[test]
    fn uv_are_coordinates_along_the_edges() {
        let quad = Quad::new(dvec3(1.0, 2.0, 3.0), dvec3(2.0, 0.0, 0.0), dvec3(1.0, 3.0, 0.0)).unwrap();
        let target = dvec3(1.0, 2.0, 3.0) + quad.edge_u() * 0.25 + quad.edge_v() * 0.75;
        let ray = RayF64 {
            origin: target + dvec3(1.0, -2.0, 4.0),
            direction: dvec3(-0.5, 1.0, -2.0),
            t_min: 0.0,
            t_max: f64::INFINITY,
        };
        let hit = LocalHit { t: quad.distance(&ray), profile: 0.0 };
        let s = quad.surface(Detail::Full, &ray, &hit);
        assert!((hit.t - 2.0).abs() < 1e-14 && (s.uv[0] - 0.25).abs() < 1e-14 && (s.uv[1] - 0.75).abs() < 1e-14);
        assert_eq!(s.n, DVec3::Z);
        // Within the plane, and parallel to it.
        for origin in [dvec3(-5.0, 3.0, 3.0), dvec3(-5.0, 3.0, 3.5)] {
            assert!(quad.distance(&RayF64 { origin, direction: DVec3::X, t_min: 0.0, t_max: f64::INFINITY }).is_nan());
        }
    }
}
