//! Distances along a ray by the light that arrives there.

use std::f32::consts::{FRAC_PI_2, PI};

use super::Light;
use super::bounds::LightBounds;
use crate::geometry::Geometry;
use crate::math::{DVec3, Vec3};

/// A straight way through a medium, from a point along a unit direction.
#[derive(Clone, Copy, Debug)]
pub struct RaySegment {
    /// Where it begins.
    pub origin: DVec3,
    /// Unit direction.
    pub direction: Vec3,
    /// May be infinite.
    pub length: f32,
}

/// Distances with a density in proportion to the angle at which a light sees their neighbourhood: one over the squared
/// distance to the light's middle (Kulla and Fajardo, "Importance Sampling Techniques for Path Tracing in Participating
/// Media"). Only where the light shines.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Equiangular {
    /// The point that is nearest to the light, and how far that is from it.
    foot: f32,
    height: f32,
    near: f32,
    far: f32,
    /// As the light sees the ends, from the nearest point.
    angles: [f32; 2],
}

impl Equiangular {
    /// For a light around a point, which shines on this part of the way.
    fn new(way: &RaySegment, middle: DVec3, [near, far]: [f32; 2]) -> Option<Self> {
        let (to_middle, direction) = (middle - way.origin, way.direction.as_dvec3());
        let foot = to_middle.dot(direction);
        let height = (to_middle - direction * foot).length() as f32;
        let foot = foot as f32;
        let angles = [near, far].map(|end| ((end - foot) / height).atan());
        let found = Self { foot, height, near, far, angles };
        // On a way through the light itself the density is none.
        let is_sound = near < far && height > 1e-6 * foot.abs() && angles[1] - angles[0] > 1e-6;
        (is_sound && foot.is_finite() && height.is_finite()).then_some(found)
    }

    /// A distance, `u` in `[0, 1)`.
    #[inline]
    pub fn sample(&self, u: f32) -> f32 {
        let angle = self.angles[0] + (self.angles[1] - self.angles[0]) * u;
        (self.foot + self.height * angle.tan()).clamp(self.near, self.far)
    }

    /// Density per unit of length.
    #[inline]
    pub fn pdf(&self, distance: f32) -> f32 {
        if !(self.near..=self.far).contains(&distance) {
            return 0.0;
        }
        let (height, along) = (self.height, distance - self.foot);
        height / ((self.angles[1] - self.angles[0]) * (height * height + along * along))
    }
}

impl Light {
    /// Distances along a way by what arrives there; `None` of lights at infinity, and where nothing arrives.
    pub fn equiangular(&self, geometry: &Geometry, way: &RaySegment) -> Option<Equiangular> {
        let LightBounds { bounds, cone, two_sided, .. } = self.bounds(geometry)?;
        let middle = bounds.center().as_dvec3();
        let half_angle = cone.spread + cone.reach;
        // What is flat shines on one side of its plane; of what else has an extent, the cone begins nowhere.
        let is_flat = cone.spread == 0.0 && half_angle == FRAC_PI_2;
        let has_cone = if matches!(self, Self::Area(_)) { is_flat } else { half_angle <= FRAC_PI_2 };
        let interval =
            if has_cone && !two_sided { within_cone(way, middle, cone.axis, half_angle)? } else { [0.0, way.length] };
        Equiangular::new(way, middle, interval)
    }
}

/// The part of a way within a cone from `apex` along a unit `axis`, whose half-angle is at most a right angle.
fn within_cone(way: &RaySegment, apex: DVec3, axis: Vec3, half_angle: f32) -> Option<[f32; 2]> {
    debug_assert!(half_angle <= 0.5 * PI);
    let (o, d) = (way.origin - apex, way.direction.as_dvec3());
    let axis = axis.as_dvec3();
    let (along, rate) = (o.dot(axis), d.dot(axis));
    let cos_squared = if half_angle == FRAC_PI_2 { 0.0 } else { f64::from(half_angle).cos().powi(2) };
    // f(t) = a t² + 2 b t + c is positive within the cone and its mirror image; `along + rate t` says which.
    let (a, b, c) =
        (rate * rate - cos_squared, along * rate - cos_squared * o.dot(d), along * along - cos_squared * o.dot(o));
    let (mut near, mut far) = (0.0, f64::from(way.length));
    // On the side of the apex where the axis is.
    let plane = -along / rate;
    if rate > 0.0 {
        near = plane.max(near);
    } else if rate < 0.0 {
        far = plane.min(far);
    } else if along < 0.0 {
        return None;
    }
    let discriminant = b * b - a * c;
    if cos_squared > 0.0 && discriminant > 0.0 && a != 0.0 {
        let root = discriminant.sqrt();
        let (x, y) = ((-b - root) / a, (-b + root) / a);
        let (low, high) = (x.min(y), x.max(y));
        if a < 0.0 {
            (near, far) = (low.max(near), high.min(far));
        } else if rate > 0.0 {
            near = high.max(near);
        } else {
            far = low.min(far);
        }
    } else if cos_squared > 0.0 && a < 0.0 {
        return None;
    }
    (near < far).then_some([near as f32, far as f32])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::Rgb;
    use crate::light::{PointLight, SpotLight};
    use crate::math::{Rng, vec3};

    fn way(rng: &mut Rng) -> RaySegment {
        let length = if rng.unit() < 0.3 { f32::INFINITY } else { 8.0 * rng.unit_f32() + 0.1 };
        RaySegment { origin: rng.cube() * 3.0, direction: rng.direction().as_vec3(), length }
    }

    #[test]
    fn samples_have_their_density() {
        let mut rng = Rng::new(1);
        let light = Light::Point(PointLight { position: DVec3::new(0.5, -0.25, 1.0), intensity: Rgb::WHITE });
        for _ in 0..200 {
            let way = way(&mut rng);
            let by_angle = light.equiangular(&Geometry::default(), &way).unwrap();
            // The sum of the density between samples is the difference of their numbers.
            let n = 400;
            let at = |i: u32| by_angle.sample((i as f32 + 0.5) / n as f32);
            for i in 0..n - 1 {
                let (a, b) = (at(i), at(i + 1));
                assert!(a >= 0.0 && b <= way.length && a <= b);
                if b > 100.0 || b - a < 1e-3 * b {
                    continue;
                }
                let steps = 64;
                let step = (b - a) / steps as f32;
                let sum: f32 = (0..steps).map(|k| by_angle.pdf(a + step * (k as f32 + 0.5)) * step).sum();
                assert!((sum * n as f32 - 1.0).abs() < 0.02, "{way:?} {a} {b} {sum}");
            }
            assert_eq!((by_angle.pdf(-0.1), by_angle.pdf(way.length * 1.01)), (0.0, by_angle.pdf(way.length * 1.01)));
        }
    }

    #[test]
    fn a_spot_is_met_where_it_shines() {
        let mut rng = Rng::new(2);
        let mut seen = [0; 2];
        for i in 0..4_000 {
            let cutoff = 0.05 + 1.5 * rng.unit();
            let (p, axis) = (rng.cube(), rng.direction());
            let spot = SpotLight::new(p, axis, Rgb::WHITE, 0.0, cutoff);
            let light = Light::Spot(Box::new(spot));
            let way = way(&mut rng);
            let by_angle = light.equiangular(&Geometry::default(), &way);
            for k in 0..40 {
                let distance = 0.2 * (k as f32 + 0.5);
                if distance >= way.length {
                    break;
                }
                let toward = way.origin + way.direction.as_dvec3() * f64::from(distance) - p;
                let angle = toward.normalize().dot(axis).clamp(-1.0, 1.0).acos();
                if (angle - cutoff).abs() < 1e-3 {
                    continue;
                }
                let has_density = by_angle.is_some_and(|by_angle| by_angle.pdf(distance) > 0.0);
                assert_eq!(has_density, angle < cutoff, "{i} {way:?} {p} {axis} {cutoff} {distance} {angle}");
                seen[usize::from(has_density)] += 1;
            }
        }
        assert!(seen[0] > 10_000 && seen[1] > 5_000, "{seen:?}");
    }

    #[test]
    fn a_way_through_the_light_has_no_density() {
        let light = Light::Point(PointLight { position: DVec3::X, intensity: Rgb::WHITE });
        let way = RaySegment { origin: DVec3::ZERO, direction: vec3(1.0, 0.0, 0.0), length: 3.0 };
        assert!(light.equiangular(&Geometry::default(), &way).is_none());
    }
}
