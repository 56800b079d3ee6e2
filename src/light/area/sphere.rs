//! Whole spheres, sampled by the solid angle of the cone they fill.

use std::f64::consts::{PI, TAU};

use super::EmitterSample;
use crate::math::{DVec3, unit_circle};

/// A whole sphere in the world.
#[derive(Clone, Debug)]
pub(super) struct SphereEmitter {
    pub center: DVec3,
    pub radius: f64,
    /// Whether the front is the inside.
    pub inward: bool,
}

impl SphereEmitter {
    /// Whether `p` sees the front.
    #[inline(always)]
    pub fn sees_front(&self, p: DVec3) -> bool {
        self.is_outside((p - self.center).length_squared()) != self.inward
    }

    /// Whether a point at this squared distance from the centre lies outside by more than the rounding of the distance.
    #[inline(always)]
    fn is_outside(&self, distance_squared: f64) -> bool {
        distance_squared > self.radius * self.radius * (1.0 + 8.0 * f64::EPSILON)
    }

    /// The cone that the sphere fills at this squared distance from its centre, without cancellation however far that
    /// is.
    #[inline(always)]
    fn cone(&self, distance_squared: f64) -> Cone {
        let radius_squared = self.radius * self.radius;
        let sin_squared = radius_squared / distance_squared;
        let cos_squared = (distance_squared - radius_squared) / distance_squared;
        Cone { one_minus_cos: sin_squared / (1.0 + cos_squared.sqrt()), sin_squared }
    }

    /// A point of the sphere as seen from `p`: uniform by solid angle from outside, uniform by area from inside.
    #[inline]
    pub fn sample(&self, p: DVec3, u: [f32; 2]) -> Option<EmitterSample> {
        let distance_squared = (p - self.center).length_squared();
        if !self.is_outside(distance_squared) {
            return self.sample_from_inside(p, u);
        }
        let OutsideSample { q, n, wi, pdf } = self.sample_from_outside(p, u);
        Some(EmitterSample { p: q, n: n.as_vec3(), wi: wi.as_vec3(), pdf: pdf as f32 })
    }

    /// [`sample`](Self::sample) from outside, without branches, for loops over many vertices.
    #[inline(always)]
    pub fn sample_from_outside(&self, p: DVec3, u: [f32; 2]) -> OutsideSample {
        let from_center = p - self.center;
        let distance_squared = from_center.length_squared();
        let distance = distance_squared.sqrt();
        let cone = self.cone(distance_squared);

        // The direction: theta from the axis towards the centre.
        let axis = from_center * (1.0 / distance);
        let delta = f64::from(u[0]) * cone.one_minus_cos;
        let (cos, sin_squared) = (1.0 - delta, delta * (2.0 - delta));

        // The point: alpha from the axis as seen from the centre, where the ray first meets the sphere.
        let sin_max = self.radius / distance;
        let root = (1.0 - sin_squared / cone.sin_squared).max(0.0).sqrt();
        let cos_alpha = sin_squared / sin_max + cos * root;
        let sin = sin_squared.sqrt();
        let sin_alpha = sin * (cos / sin_max - root);

        let (x, y) = axis.any_orthonormal_pair();
        let around = unit_circle(u[1]);
        let across = x * around.x + y * around.y;
        let outward = axis * cos_alpha + across * sin_alpha;
        OutsideSample {
            q: self.center + outward * self.radius,
            n: outward,
            wi: across * sin - axis * cos,
            pdf: 1.0 / (TAU * cone.one_minus_cos),
        }
    }

    #[inline]
    fn sample_from_inside(&self, p: DVec3, u: [f32; 2]) -> Option<EmitterSample> {
        let z = 1.0 - 2.0 * f64::from(u[0]);
        let around = unit_circle(u[1]) * ((1.0 - z) * (1.0 + z)).sqrt();
        let outward = DVec3::new(around.x, around.y, z);
        EmitterSample::from_area(p, self.center + outward * self.radius, outward, self.pdf_area())
    }

    /// Density per solid angle with which `sample` from `p` finds the surface point `q`.
    #[inline]
    pub fn pdf(&self, p: DVec3, q: DVec3) -> f32 {
        let distance_squared = (p - self.center).length_squared();
        if self.is_outside(distance_squared) {
            return (1.0 / (TAU * self.cone(distance_squared).one_minus_cos)) as f32;
        }
        EmitterSample::pdf_from_area(p, q, (q - self.center) / self.radius, self.pdf_area())
    }

    fn pdf_area(&self) -> f64 {
        1.0 / self.area()
    }

    pub fn area(&self) -> f64 {
        4.0 * PI * self.radius * self.radius
    }
}

/// A point of a sphere as seen from a point outside of it.
pub(super) struct OutsideSample {
    /// The point.
    pub q: DVec3,
    /// Unit normal, outwards.
    pub n: DVec3,
    /// Unit direction to the point.
    pub wi: DVec3,
    /// Density per solid angle.
    pub pdf: f64,
}

/// A cone by its half-angle.
struct Cone {
    one_minus_cos: f64,
    sin_squared: f64,
}
