//! Flat disks, rings and their sectors.
//!
//! Object space: the part of the plane `z = 0` with `inner_radius <= rho <= radius` and `0 <= phi <= phi_max`, where
//! `rho = sqrt(x² + y²)` and phi turns from +x towards +y. The normal is +z.
//!
//! `uv = (phi / phi_max, (rho - inner_radius) / (radius - inner_radius))`, the convention of Moer-lite's disk.

use super::sector::{Sector, direction_from_axis};
use super::shape_error::{not_negative, positive};
use super::{Detail, LocalHit, LocalSurface, ShapeError, ShapeSample};
use crate::math::{Bounds, DVec3, RayF64, dvec3};

/// A ring sector; a full disk has no inner radius and a full sector.
#[derive(Clone, Debug, PartialEq)]
pub struct Disk {
    radius: f64,
    inner_radius: f64,
    sector: Sector,
    area: f64,
}

impl Disk {
    /// A ring sector of the angle `phi_max` in radians.
    ///
    /// # Errors
    /// Unless the radii are finite, `0 <= inner_radius < radius` and `0 < phi_max <= 2 pi`.
    pub fn new(radius: f64, inner_radius: f64, phi_max: f64) -> Result<Self, ShapeError> {
        positive("radius", radius)?;
        not_negative("inner radius", inner_radius)?;
        if inner_radius >= radius {
            return Err(ShapeError::Ring { inner: inner_radius, outer: radius });
        }
        let sector = Sector::new(phi_max)?;
        let area = 0.5 * sector.phi_max() * (radius - inner_radius) * (radius + inner_radius);
        Ok(Self { radius, inner_radius, sector, area })
    }

    /// The radius of the outer rim.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// The radius of the hole; zero where there is none.
    pub fn inner_radius(&self) -> f64 {
        self.inner_radius
    }

    /// Whether all angles are kept.
    pub fn is_full_turn(&self) -> bool {
        self.sector.is_full()
    }

    /// Distance of the hit within the ray's interval; NaN on a miss.
    #[inline(always)]
    pub fn distance(&self, ray: &RayF64) -> f64 {
        // A parallel ray gives an infinity or a NaN.
        let t = -ray.origin.z / ray.direction.z;
        let (x, y) = (ray.origin.x + ray.direction.x * t, ray.origin.y + ray.direction.y * t);
        let rho_squared = x * x + y * y;
        let in_ring =
            (self.inner_radius * self.inner_radius <= rho_squared) & (rho_squared <= self.radius * self.radius);
        let is_hit = ray.contains(t) & t.is_finite() & in_ring & self.sector.contains(x, y);
        if is_hit { t } else { f64::NAN }
    }

    /// The surface at a hit of `ray`.
    #[inline(always)]
    pub fn surface(&self, detail: Detail, ray: &RayF64, hit: &LocalHit) -> LocalSurface {
        let raw = ray.at(hit.t);
        let (x, y) = (raw.x, raw.y);
        if detail == Detail::Position {
            return LocalSurface { p: dvec3(x, y, 0.0), n: DVec3::Z, pdf_area: 1.0 / self.area, ..LocalSurface::ZERO };
        }
        let width = self.radius - self.inner_radius;
        let v = ((x * x + y * y).sqrt() - self.inner_radius) / width;
        LocalSurface {
            p: dvec3(x, y, 0.0),
            n: DVec3::Z,
            dp_du: dvec3(-y, x, 0.0) * self.sector.phi_max(),
            dp_dv: (direction_from_axis(x, y) * width).extend(0.0),
            uv: [self.sector.fraction(x, y), v.clamp(0.0, 1.0)],
            pdf_area: 1.0 / self.area,
        }
    }

    /// Exact bounds: a narrow slice gets a narrow box.
    pub fn bounds(&self) -> Bounds {
        let ring = self.sector.bounds(self.inner_radius, self.radius);
        Bounds { min: ring.min.extend(0.0), max: ring.max.extend(0.0) }
    }

    /// Surface area.
    pub fn area(&self) -> f64 {
        self.area
    }

    /// A point distributed uniformly by area.
    #[inline(always)]
    pub fn sample(&self, u: [f64; 2]) -> ShapeSample {
        if self.is_full_turn() { self.sample_turn::<true>(u) } else { self.sample_turn::<false>(u) }
    }

    /// [`sample`](Self::sample), where it is known whether all angles are kept.
    #[inline(always)]
    pub(super) fn sample_turn<const FULL: bool>(&self, u: [f64; 2]) -> ShapeSample {
        // rho² is uniform between the squared radii.
        let inner_squared = self.inner_radius * self.inner_radius;
        let rho = (inner_squared + (self.radius * self.radius - inner_squared) * u[1]).sqrt();
        ShapeSample {
            p: (self.sector.direction_of::<FULL>(u[0]) * rho).extend(0.0),
            n: DVec3::Z,
            pdf_area: 1.0 / self.area,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn down(x: f64, y: f64) -> RayF64 {
        RayF64 { origin: dvec3(x, y, 3.0), direction: -DVec3::Z, t_min: 0.0, t_max: f64::INFINITY }
    }

    #[test]
    fn a_ring_without_width_is_refused_so_that_v_is_never_0_over_0() {
        assert_eq!(Disk::new(1.0, 1.0, 1.0), Err(ShapeError::Ring { inner: 1.0, outer: 1.0 }));
        assert!(Disk::new(1.0, -0.1, 1.0).is_err() && Disk::new(f64::NAN, 0.0, 1.0).is_err());
        assert!(Disk::new(1.0, 0.5, 0.0).is_err(), "u would be 0 / 0");
    }

    #[test]
    fn v_runs_from_the_inner_to_the_outer_radius() {
        let ring = Disk::new(2.0, 0.5, 5.0).unwrap();
        for (x, v) in [(0.5, 0.0), (1.25, 0.5), (2.0, 1.0)] {
            let hit = LocalHit { t: ring.distance(&down(0.0, x)), profile: 0.0 };
            assert!((ring.surface(Detail::Full, &down(0.0, x), &hit).uv[1] - v).abs() < 1e-15, "{x}");
        }
        assert!(ring.distance(&down(0.4999, 0.0)).is_nan() && ring.distance(&down(2.0001, 0.0)).is_nan());
    }

    #[test]
    fn a_parallel_ray_misses_even_inside_the_plane() {
        let disk = Disk::new(1.0, 0.0, 6.0).unwrap();
        for z in [0.0, -0.0, 0.5] {
            for dz in [0.0, -0.0] {
                let ray = RayF64 {
                    origin: dvec3(-2.0, 0.0, z),
                    direction: dvec3(1.0, 0.0, dz),
                    t_min: 0.0,
                    t_max: f64::INFINITY,
                };
                assert!(disk.distance(&ray).is_nan());
            }
        }
    }

    #[test]
    fn a_quarter_has_a_quarter_of_the_area() {
        let full = Disk::new(2.0, 0.5, std::f64::consts::TAU).unwrap();
        let quarter = Disk::new(2.0, 0.5, std::f64::consts::FRAC_PI_2).unwrap();
        assert!((quarter.area() - full.area() / 4.0).abs() < 1e-15 * full.area());
    }
}
