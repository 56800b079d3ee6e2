//! What is known of a light, or of a group of lights, from outside: where it is, where it shines, how strongly.

use std::f32::consts::{FRAC_PI_2, PI};

use crate::math::{Aabb, DVec3, Vec3};

/// Directions of emission (Conty Estevez and Kulla, "Importance Sampling of Many Lights with Adaptive Tree Splitting"):
/// surface normals lie within `spread` of the axis, and light leaves within `reach` of a normal. Radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmissionCone {
    /// Unit axis.
    pub axis: Vec3,
    /// Half-angle of the normals, from 0 to pi.
    pub spread: f32,
    /// Half-angle of emission about each normal, from 0 to pi.
    pub reach: f32,
}

impl EmissionCone {
    /// Everywhere.
    pub const SPHERE: Self = Self { axis: Vec3::Z, spread: PI, reach: FRAC_PI_2 };

    /// The cone of a flat surface with this unit normal.
    pub fn flat(normal: Vec3) -> Self {
        Self { axis: normal, spread: 0.0, reach: FRAC_PI_2 }
    }

    /// A cone that holds both.
    #[must_use]
    pub fn union(&self, other: &Self) -> Self {
        let (wide, narrow) = if self.spread >= other.spread { (self, other) } else { (other, self) };
        let reach = wide.reach.max(narrow.reach);
        let between = angle_between(wide.axis, narrow.axis);
        if (between + narrow.spread).min(PI) <= wide.spread {
            return Self { reach, ..*wide };
        }
        let spread = 0.5 * (wide.spread + between + narrow.spread);
        let across = narrow.axis - wide.axis * wide.axis.dot(narrow.axis);
        if spread >= PI || across.length_squared() < 1e-12 {
            return Self { reach, ..Self::SPHERE };
        }
        // The wide axis turned towards the narrow one.
        let (sin, cos) = (spread - wide.spread).sin_cos();
        Self { axis: (wide.axis * cos + across.normalize() * sin).normalize(), spread, reach }
    }

    /// The measure of directions by which a split of a group is judged.
    pub fn measure(&self) -> f32 {
        let (o, w) = (self.spread, (self.spread + self.reach).min(PI));
        let (sin, cos) = o.sin_cos();
        PI * (2.0 * (1.0 - cos) + 0.5 * (2.0 * w * sin - (o - 2.0 * w).cos() - 2.0 * o * sin + cos))
    }
}

/// Of unit vectors, with all digits at small angles.
fn angle_between(a: Vec3, b: Vec3) -> f32 {
    a.cross(b).length().atan2(a.dot(b))
}

/// Where a light or a group of lights is and how it shines: enough to estimate, from any point, what arrives there. The
/// bounds are conservative: no light reaches a point that they exclude.
#[derive(Clone, Copy, Debug)]
pub struct LightBounds {
    /// Around all points that emit.
    pub bounds: Aabb,
    /// Around all directions of emission.
    pub cone: EmissionCone,
    /// Whether light leaves against the cone too.
    pub two_sided: bool,
    /// Radiant intensity along the cone's axis, as luminance; above 0.
    pub intensity: f32,
}

impl LightBounds {
    /// Of a light in a point that shines everywhere.
    pub fn at_point(p: DVec3, cone: EmissionCone, intensity: f64) -> Self {
        let exact = crate::math::Bounds { min: p, max: p };
        Self { bounds: exact.padded(), cone, two_sided: false, intensity: to_positive(intensity) }
    }

    /// Of both together.
    #[must_use]
    pub fn union(&self, other: &Self) -> Self {
        // A cone that emits both ways may be turned to fit the other.
        let flipped = |c: EmissionCone| EmissionCone { axis: -c.axis, ..c };
        let cone = if self.two_sided && other.two_sided && self.cone.axis.dot(other.cone.axis) < 0.0 {
            self.cone.union(&flipped(other.cone))
        } else {
            self.cone.union(&other.cone)
        };
        Self {
            bounds: self.bounds.union(&other.bounds),
            cone,
            two_sided: self.two_sided || other.two_sided,
            intensity: (self.intensity + other.intensity).min(f32::MAX),
        }
    }
}

/// In `f32`, never 0: what shines in `f64` must not vanish here.
pub fn to_positive(intensity: f64) -> f32 {
    (intensity as f32).clamp(f32::MIN_POSITIVE, f32::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rng;

    /// A random unit direction within an angle of an axis.
    fn within(random: &mut Rng, axis: Vec3, angle: f32) -> Vec3 {
        let across = random.direction().as_vec3().cross(axis).normalize();
        let (sin, cos) = (angle * random.unit_f32()).sin_cos();
        (axis * cos + across * sin).normalize()
    }

    #[test]
    fn the_union_of_cones_holds_both() {
        let mut random = Rng::new(1);
        for _ in 0..2000 {
            let mut cone = || EmissionCone {
                axis: random.direction().as_vec3().normalize(),
                spread: 2.0 * random.unit_f32() * random.unit_f32(),
                reach: FRAC_PI_2 * random.unit_f32(),
            };
            let (a, b) = (cone(), cone());
            let union = a.union(&b);
            assert!(union.reach >= a.reach.max(b.reach) && union.spread <= PI);
            for part in [a, b] {
                for _ in 0..20 {
                    let n = within(&mut random, part.axis, part.spread);
                    assert!(angle_between(n, union.axis) <= union.spread + 1e-5, "{a:?} {b:?} {union:?}");
                }
            }
        }
        // Opposite axes, equal cones, and one inside the other.
        let up = EmissionCone::flat(Vec3::Y);
        assert_eq!(up.union(&EmissionCone::flat(-Vec3::Y)).spread, PI);
        assert_eq!(up.union(&up), up);
        assert_eq!(EmissionCone::SPHERE.union(&up).spread, PI);
    }

    #[test]
    fn the_measure_is_that_of_the_paper() {
        // A flat surface: 0 + pi / 2 (0 - cos(-pi) - 0 + 1) = pi. Everywhere: 4 pi.
        assert!((EmissionCone::flat(Vec3::Y).measure() - PI).abs() < 1e-5);
        assert!((EmissionCone::SPHERE.measure() - 4.0 * PI).abs() < 1e-4);
    }
}
