//! Rays in world space (`f32`, what accelerators take) and in a shape's own space (`f64`, what shapes solve in).

use super::float::EMBREE_LARGE;
use super::rows::{BATCH, soa};
use super::{DVec3, Vec3};

/// A ray segment: the points `origin + t * direction` with `t_min <= t <= t_max`. The direction need not be unit.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct Ray {
    /// Where `t = 0`.
    pub origin: Vec3,
    /// Smallest accepted `t`, inclusive, not negative.
    pub t_min: f32,
    /// The change of the point per unit of `t`.
    pub direction: Vec3,
    /// Largest accepted `t`, inclusive; may be infinite.
    pub t_max: f32,
    /// Time in the shutter interval, in `[0, 1]`.
    pub time: f32,
}

impl Ray {
    /// A ray from `origin` without an end, at time 0.
    #[inline]
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        Self { origin, t_min: 0.0, direction, t_max: f32::INFINITY, time: 0.0 }
    }

    /// A ray that hits nothing, for unused lanes of a batch.
    pub const INACTIVE: Self = Self { origin: Vec3::ZERO, t_min: 0.0, direction: Vec3::Z, t_max: -1.0, time: 0.0 };

    /// The point at `t`.
    #[inline]
    pub fn at(&self, t: f32) -> Vec3 {
        self.origin + self.direction * t
    }

    /// Whether this ray can be traced: finite and not huge, a direction that is not zero, `0 <= t_min <= t_max`, time
    /// within `[0, 1]`. All other rays hit nothing, by definition.
    #[inline(always)]
    pub fn is_valid(&self) -> bool {
        let limit = EMBREE_LARGE;
        let inside = |v: Vec3| v.x.abs() < limit && v.y.abs() < limit && v.z.abs() < limit;
        // Every comparison with a NaN is false.
        inside(self.origin)
            & inside(self.direction)
            & (self.direction != Vec3::ZERO)
            & (self.t_min >= 0.0)
            & (self.t_min <= self.t_max)
            & (self.t_min < f32::INFINITY)
            & (self.time >= 0.0)
            & (self.time <= 1.0)
    }
}

soa! {
    /// Rays, as [`Ray`].
    pub struct RayRows {
        /// Where `t = 0`.
        origin: Vec3,
        /// Smallest accepted `t`.
        t_min: f32,
        /// The change of the point per unit of `t`.
        direction: Vec3,
        /// Largest accepted `t`.
        t_max: f32,
        /// Time in the shutter interval.
        time: f32,
    }
}

impl RayRows {
    /// Rows of rays, of which there are at most [`BATCH`].
    pub fn of(rays: &[Ray]) -> Self {
        let mut rows = Self::default();
        rays.iter().enumerate().for_each(|(lane, ray)| rows.set(lane, ray));
        rows
    }

    /// Rays in blocks of [`BATCH`], with the number of rays of each.
    pub fn blocks(rays: &[Ray]) -> Vec<(Self, usize)> {
        rays.chunks(BATCH).map(|rays| (Self::of(rays), rays.len())).collect()
    }

    /// The ray of one lane.
    #[inline(always)]
    pub fn get(&self, lane: usize) -> Ray {
        Ray {
            origin: self.origin.get(lane),
            t_min: self.t_min[lane],
            direction: self.direction.get(lane),
            t_max: self.t_max[lane],
            time: self.time[lane],
        }
    }

    /// Sets the ray of one lane.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, ray: &Ray) {
        self.origin.set(lane, ray.origin);
        self.direction.set(lane, ray.direction);
        (self.t_min[lane], self.t_max[lane], self.time[lane]) = (ray.t_min, ray.t_max, ray.time);
    }
}

/// A ray in the space of a shape. `t` means the same as on the world ray it came from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayF64 {
    /// Where `t = 0`.
    pub origin: DVec3,
    /// The change of the point per unit of `t`; not normalised.
    pub direction: DVec3,
    /// Smallest accepted `t`, inclusive.
    pub t_min: f64,
    /// Largest accepted `t`, inclusive.
    pub t_max: f64,
}

impl RayF64 {
    /// The point at `t`, with one rounding for each coordinate where the machine has a fused multiply-add.
    #[inline(always)]
    pub fn at(&self, t: f64) -> DVec3 {
        self.origin + self.direction * t
    }

    /// Whether `t` lies in the ray's interval; false for a NaN.
    #[inline(always)]
    pub fn contains(&self, t: f64) -> bool {
        self.t_min <= t && t <= self.t_max
    }
}

impl From<&Ray> for RayF64 {
    #[inline]
    fn from(ray: &Ray) -> Self {
        Self {
            origin: ray.origin.as_dvec3(),
            direction: ray.direction.as_dvec3(),
            t_min: f64::from(ray.t_min),
            t_max: f64::from(ray.t_max),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_a_ray_is_not_valid() {
        let good = Ray::new(Vec3::ZERO, Vec3::X);
        assert!(good.is_valid());
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e19] {
            assert!(!Ray { origin: Vec3::new(bad, 0.0, 0.0), ..good }.is_valid());
            assert!(!Ray { direction: Vec3::new(0.0, bad, 1.0), ..good }.is_valid());
        }
        assert!(!Ray { direction: Vec3::ZERO, ..good }.is_valid());
        assert!(!Ray { t_min: f32::NAN, ..good }.is_valid());
        assert!(!Ray { t_min: -1.0, ..good }.is_valid());
        assert!(!Ray { t_max: f32::NAN, ..good }.is_valid());
        assert!(!Ray { t_min: 2.0, t_max: 1.0, ..good }.is_valid());
        assert!(!Ray { time: 1.000_001, ..good }.is_valid());
        assert!(!Ray { time: f32::NAN, ..good }.is_valid());
        assert!(!Ray::INACTIVE.is_valid());
    }
}
