//! Spheres, and the parts of them between two heights and within a sector.
//!
//! Object space: `|p| = radius`, `z_min <= z <= z_max`, `0 <= phi <= phi_max` with phi from +x towards +y. The normal
//! points outward.
//!
//! `u = phi / phi_max`. `v = (theta_max - theta) / (theta_max - theta_min)` where theta is the angle from +z, so v is 0
//! at the bottom and 1 at the top of the part that is kept: a map of the world in latitude and longitude stands upright
//! on it.

use std::f64::consts::PI;

use super::placed::first_accepted;
use super::sector::{Sector, direction_from_axis};
use super::shape_error::positive;
use super::{Detail, LocalHit, LocalSurface, ShapeError, ShapeSample};
use crate::math::{Bounds, DVec3, RayF64, dvec3};

/// A sphere about the origin, or a part of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Sphere {
    radius: f64,
    z_min: f64,
    z_max: f64,
    cuts_z: bool,
    theta_min: f64,
    theta_max: f64,
    sector: Sector,
    area: f64,
}

impl Sphere {
    /// The whole sphere.
    ///
    /// # Errors
    /// If the radius is not finite and above zero.
    pub fn full(radius: f64) -> Result<Self, ShapeError> {
        Self::new(radius, -radius, radius, Sector::FULL.phi_max())
    }

    /// The part of a sphere between two heights, within the angle `phi_max` in radians.
    ///
    /// # Errors
    /// Unless the radius is finite and above zero, `-radius <= z_min < z_max <= radius` and `0 < phi_max <= 2 pi`.
    pub fn new(radius: f64, z_min: f64, z_max: f64, phi_max: f64) -> Result<Self, ShapeError> {
        positive("radius", radius)?;
        if !(-radius <= z_min && z_min < z_max && z_max <= radius) {
            return Err(ShapeError::Heights { z_min, z_max, radius });
        }
        let sector = Sector::new(phi_max)?;
        let theta = |z: f64| ((radius - z) * (radius + z)).sqrt().atan2(z);
        Ok(Self {
            radius,
            z_min,
            z_max,
            cuts_z: z_min > -radius || z_max < radius,
            theta_min: theta(z_max),
            theta_max: if z_min > -radius { theta(z_min) } else { PI },
            sector,
            area: sector.phi_max() * radius * (z_max - z_min),
        })
    }

    /// Whether nothing is cut off.
    #[inline]
    pub fn is_full(&self) -> bool {
        !self.cuts_z && self.sector.is_full()
    }

    /// Whether all angles are kept.
    pub fn is_full_turn(&self) -> bool {
        self.sector.is_full()
    }

    /// The radius.
    #[inline]
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// Distance of the first hit within the ray's interval; NaN on a miss.
    #[inline(always)]
    pub fn distance(&self, ray: &RayF64) -> f64 {
        let [near, far] = roots(ray.origin, ray.direction, self.radius);
        first_accepted([near, far], [self.accepts(ray, near), self.accepts(ray, far)])
    }

    #[inline(always)]
    fn accepts(&self, ray: &RayF64, t: f64) -> bool {
        ray.contains(t) & self.keeps(ray.at(t))
    }

    #[inline(always)]
    fn keeps(&self, p: DVec3) -> bool {
        (!self.cuts_z | ((self.z_min <= p.z) & (p.z <= self.z_max))) & self.sector.contains(p.x, p.y)
    }

    /// The surface at a hit of `ray`.
    #[inline(always)]
    pub fn surface(&self, detail: Detail, ray: &RayF64, hit: &LocalHit) -> LocalSurface {
        let raw = ray.at(hit.t);
        let n = raw / raw.length();
        let p = n * self.radius;
        if detail == Detail::Position {
            return LocalSurface { p, n, pdf_area: 1.0 / self.area, ..LocalSurface::ZERO };
        }
        let rho = (p.x * p.x + p.y * p.y).sqrt();
        let toward = direction_from_axis(p.x, p.y);
        let theta_range = self.theta_max - self.theta_min;
        let v = (self.theta_max - rho.atan2(p.z)) / theta_range;
        LocalSurface {
            p,
            n,
            dp_du: dvec3(-p.y, p.x, 0.0) * self.sector.phi_max(),
            dp_dv: dvec3(-p.z * toward.x, -p.z * toward.y, rho) * theta_range,
            uv: [self.sector.fraction(p.x, p.y), v.clamp(0.0, 1.0)],
            pdf_area: 1.0 / self.area,
        }
    }

    /// Exact bounds.
    pub fn bounds(&self) -> Bounds {
        let rho = |z: f64| ((self.radius - z) * (self.radius + z)).max(0.0).sqrt();
        let (low, high) = (rho(self.z_min), rho(self.z_max));
        let widest = if self.z_min <= 0.0 && self.z_max >= 0.0 { self.radius } else { low.max(high) };
        let disk = self.sector.bounds(low.min(high), widest);
        Bounds { min: disk.min.extend(self.z_min), max: disk.max.extend(self.z_max) }
    }

    /// Surface area of the part that is kept.
    pub fn area(&self) -> f64 {
        self.area
    }

    /// A point distributed uniformly by area (a sphere's area between two heights is proportional to their difference).
    #[inline(always)]
    pub fn sample(&self, u: [f64; 2]) -> ShapeSample {
        if self.is_full_turn() { self.sample_turn::<true>(u) } else { self.sample_turn::<false>(u) }
    }

    /// [`sample`](Self::sample), where it is known whether all angles are kept.
    #[inline(always)]
    pub(super) fn sample_turn<const FULL: bool>(&self, u: [f64; 2]) -> ShapeSample {
        let z = (self.z_min + (self.z_max - self.z_min) * u[1]).clamp(self.z_min, self.z_max);
        let rho = ((self.radius - z) * (self.radius + z)).sqrt();
        let p = (self.sector.direction_of::<FULL>(u[0]) * rho).extend(z);
        ShapeSample { p, n: p / self.radius, pdf_area: 1.0 / self.area }
    }
}

/// Where a ray meets the whole sphere about the origin, in ascending order; NaN where it passes by.
///
/// The point of the ray closest to the centre, then half the chord (Haines et al., "Precision Improvements for
/// Ray/Sphere Intersection"). A zero direction gives a NaN, as the root of a negative number does, which fails every
/// test.
#[inline(always)]
pub(super) fn roots(origin: DVec3, direction: DVec3, radius: f64) -> [f64; 2] {
    let inverse = 1.0 / direction.length_squared();
    let t_middle = -origin.dot(direction) * inverse;
    let foot = origin + direction * t_middle;
    let half_chord_squared = radius * radius - foot.length_squared();
    let t_half = (half_chord_squared * inverse).sqrt();
    [t_middle - t_half, t_middle + t_half]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ray(origin: DVec3, direction: DVec3) -> RayF64 {
        RayF64 { origin, direction, t_min: 0.0, t_max: f64::INFINITY }
    }

    #[test]
    fn parameters_that_make_no_sphere_are_refused() {
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(Sphere::full(bad).is_err());
        }
        assert!(Sphere::new(1.0, 0.5, 0.5, 1.0).is_err());
        assert!(Sphere::new(1.0, -1.1, 0.5, 1.0).is_err());
        assert!(Sphere::new(1.0, f64::NAN, 0.5, 1.0).is_err());
        assert!(Sphere::new(1.0, -0.5, 0.5, 0.0).is_err());
    }

    #[test]
    fn the_root_is_chosen_by_the_interval_and_the_clips() {
        let sphere = Sphere::full(2.0).unwrap();
        let t = |r: &RayF64| Some(sphere.distance(r)).filter(|t| !t.is_nan());
        assert_eq!(t(&ray(dvec3(0.0, 0.0, -5.0), DVec3::Z)), Some(3.0));
        assert_eq!(t(&ray(DVec3::ZERO, DVec3::Z * 0.5)), Some(4.0));
        assert_eq!(t(&ray(dvec3(0.0, 0.0, 5.0), DVec3::Z)), None);
        assert_eq!(t(&RayF64 { t_min: 3.5, ..ray(dvec3(0.0, 0.0, -5.0), DVec3::Z) }), Some(7.0));
        assert_eq!(t(&RayF64 { t_max: 2.9, ..ray(dvec3(0.0, 0.0, -5.0), DVec3::Z) }), None);
        assert_eq!(t(&ray(dvec3(2.0, 0.0, -5.0), DVec3::Z)), Some(5.0));
        assert_eq!(t(&ray(DVec3::ZERO, DVec3::ZERO)), None);

        let bottom = Sphere::new(2.0, -2.0, 0.0, 6.0).unwrap();
        assert!(bottom.distance(&ray(dvec3(0.5, 0.5, 5.0), -DVec3::Z)) > 5.0);
    }

    #[test]
    fn v_runs_from_the_bottom_to_the_top() {
        let sphere = Sphere::new(1.0, -0.6, 0.8, 3.0).unwrap();
        for (z, v) in [(0.8f64, 1.0), (-0.6, 0.0)] {
            let r = ray(dvec3(0.0, 3.0, z * 0.999_999_9), -DVec3::Y);
            let hit = LocalHit { t: sphere.distance(&r), profile: 0.0 };
            assert!((sphere.surface(Detail::Full, &r, &hit).uv[1] - v).abs() < 1e-6);
        }
    }
}
