//! Spheres, ellipsoids and cylinders.

use pulp::Simd;

use super::{RESOLUTION, RootInterval, Roots, SIDE_ERROR, none, point_at};
use crate::accel::packet::lanes::{Vector, absolute_sum, add_scaled, dot, splat, subtract, within};
use crate::geometry::{PACKET_SIZE, RayPacket};
use crate::math::float::UNIT_ROUNDOFF;
use crate::math::{DMat3, DVec3, Vec3};

/// Bound on the displacement of a hit point by the transform, in units of `sigma`.
const TRANSFORM_ERROR: f32 = (24.0 * UNIT_ROUNDOFF) as f32;

/// Nothing is decided about rays whose [`TRANSFORM_ERROR`] is larger, relative to the shape.
const MAX_ERROR: f32 = 1.0 / 512.0;

/// Squares of transformed directions outside these limits could round to nothing, or to infinity.
const SQUARED_DIRECTIONS: [f32; 2] = [1e-30, 1e30];

/// Rays that pass a curved surface with a smaller squared half chord, of a radius of 1, are not known to hit it.
const LEAST_CHORD: f32 = 1.0 / 64.0;

/// Half the chord of such a ray, with all errors up to [`MAX_ERROR`].
const FLAT_CHORD: f32 = 0.16;

/// A surface that is the unit sphere, or the unit cylinder about the z axis with heights within ±1, in a space of its
/// own.
pub(super) struct Quadric {
    center: Vec3,
    /// To its own space from differences to the centre.
    rows: [Vec3; 3],
    /// Times the distance of a ray's origin and `reach` (the size and place of the shape), a bound of the error.
    error: f32,
    reach: f32,
    /// Whether all of it is kept.
    is_whole: bool,
    /// The same in `f64`.
    exact: ExactQuadric,
}

struct ExactQuadric {
    center: DVec3,
    rows: [DVec3; 3],
    error: f64,
    reach: f64,
}

impl Quadric {
    pub fn new(center: DVec3, rows: DMat3, half_axes: [f64; 3], is_whole: bool) -> Self {
        let rows = rows.transpose();
        let rows = [rows.x_axis, rows.y_axis, rows.z_axis];
        let row = rows.iter().map(|row| row.abs().max_element()).fold(0.0, f64::max);
        let reach = half_axes.iter().sum::<f64>() + center.abs().element_sum();
        Self {
            center: center.as_vec3(),
            rows: rows.map(DVec3::as_vec3),
            error: (f64::from(TRANSFORM_ERROR) * row) as f32,
            reach: reach as f32,
            is_whole,
            exact: ExactQuadric { center, rows, error: SIDE_ERROR * row, reach },
        }
    }

    /// Where rays, whose directions have the 1-norms `length`, meet the surface.
    #[inline(always)]
    pub fn roots<S: Simd, const CYLINDER: bool>(
        &self,
        simd: S,
        origin: Vector<S>,
        direction: Vector<S>,
        length: S::f32s,
    ) -> Roots<S> {
        let s = simd;
        let zero = s.splat_f32s(0.0);
        let from_center = subtract(s, origin, splat(s, self.center));
        let (o, d) = (self.transform(s, from_center), self.transform(s, direction));
        let size = s.add_f32s(absolute_sum(s, from_center), s.splat_f32s(self.reach));
        let error = s.mul_f32s(s.splat_f32s(self.error), size);

        // As in `Sphere::distance`: the point closest to the centre, then half the chord. The distance to the middle
        // takes 8 roundings, at most 14 u sigma of an error along the ray.
        let squared = dot_across::<S, CYLINDER>(s, d, d);
        let inverse = s.div_f32s(s.splat_f32s(1.0), squared);
        let middle = s.neg_f32s(s.mul_f32s(dot_across::<S, CYLINDER>(s, o, d), inverse));
        let foot = add_scaled(s, o, d, middle);
        let half_chord_squared = s.sub_f32s(s.splat_f32s(1.0), dot_across::<S, CYLINDER>(s, foot, foot));
        let is_usual = s.and_m32s(
            within(s, squared, s.splat_f32s(SQUARED_DIRECTIONS[0]), s.splat_f32s(SQUARED_DIRECTIONS[1])),
            s.less_than_or_equal_f32s(error, s.splat_f32s(MAX_ERROR)),
        );

        // The squared radius of what the line may meet is up to (1 + error)², and the square takes 4 roundings.
        let chord_error = s.mul_f32s(s.splat_f32s(3.0), error);
        let passes = s.and_m32s(s.less_than_f32s(half_chord_squared, s.neg_f32s(chord_error)), is_usual);
        let is_deep = s.and_m32s(s.greater_than_or_equal_f32s(half_chord_squared, s.splat_f32s(LEAST_CHORD)), is_usual);
        // 9 - 8 x is at least 1 / x between 1/8 and 1: the derivative of the root. Twice the error covers the middle,
        // and what follows.
        let chord = s.select_f32s(is_deep, s.sqrt_f32s(half_chord_squared), zero);
        let slope = s.mul_add_f32s(s.splat_f32s(-8.0), chord, s.splat_f32s(9.0));
        let double_error = s.add_f32s(error, error);
        let root_error = s.mul_add_f32s(chord_error, slope, double_error);
        let unbounded = s.select_f32s(is_usual, s.splat_f32s(FLAT_CHORD), s.splat_f32s(f32::NAN));
        let root_error = s.select_f32s(is_deep, root_error, unbounded);
        let inverse_length = s.sqrt_f32s(inverse);
        let (half, spread) = (s.mul_f32s(chord, inverse_length), s.mul_f32s(root_error, inverse_length));
        let is_fine =
            s.less_than_or_equal_f32s(s.mul_f32s(spread, length), s.mul_f32s(s.splat_f32s(0.5 * RESOLUTION), size));
        let is_deep = s.and_m32s(is_deep, is_fine);
        let surface = SurfaceLine { z: o[2], slope: d[2], error, spread, is_deep, passes, is_usual };
        let middle_error = s.mul_f32s(s.select_f32s(is_usual, double_error, s.splat_f32s(f32::NAN)), inverse_length);
        Roots {
            near: self.clip::<S, CYLINDER>(s, s.sub_f32s(middle, half), &surface),
            far: self.clip::<S, CYLINDER>(s, s.add_f32s(middle, half), &surface),
            middle: [s.sub_f32s(middle, middle_error), s.add_f32s(middle, middle_error)],
        }
    }

    /// See [`PacketShape::sides`](super::PacketShape::sides).
    #[inline(always)]
    pub fn sides<const CYLINDER: bool>(
        &self,
        rays: &RayPacket,
        t: &[f32; PACKET_SIZE],
        sides: &mut [f32; PACKET_SIZE],
    ) {
        let ExactQuadric { center, rows, error, reach } = &self.exact;
        for i in 0..PACKET_SIZE {
            let p = point_at(rays, i, t[i]) - *center;
            let [x, y, z] = [rows[0].dot(p), rows[1].dot(p), if CYLINDER { 0.0 } else { rows[2].dot(p) }];
            let side = (x * x + y * y + z * z) - 1.0;
            let margin = error * (p.abs().element_sum() + reach);
            sides[i] = if side.abs() > margin { side as f32 } else { 0.0 };
        }
    }

    #[inline(always)]
    fn transform<S: Simd>(&self, simd: S, v: Vector<S>) -> Vector<S> {
        let [x, y, z] = self.rows;
        [dot(simd, v, splat(simd, x)), dot(simd, v, splat(simd, y)), dot(simd, v, splat(simd, z))]
    }

    /// The interval about a root `t`, and whether the point there is kept.
    #[inline(always)]
    fn clip<S: Simd, const CYLINDER: bool>(&self, simd: S, t: S::f32s, line: &SurfaceLine<S>) -> RootInterval<S> {
        let s = simd;
        let (mut is_hit, mut is_miss) = (line.is_deep, line.passes);
        if !self.is_whole {
            is_hit = none(s);
        }
        if CYLINDER {
            let z = s.abs_f32s(s.mul_add_f32s(line.slope, t, line.z));
            let error = s.mul_add_f32s(s.abs_f32s(line.slope), line.spread, line.error);
            let one = s.splat_f32s(1.0);
            is_hit = s.and_m32s(is_hit, s.less_than_or_equal_f32s(s.add_f32s(z, error), one));
            let is_beyond = s.and_m32s(s.greater_than_f32s(s.sub_f32s(z, error), one), line.is_usual);
            is_miss = s.or_m32s(is_miss, is_beyond);
        }
        RootInterval { low: s.sub_f32s(t, line.spread), high: s.add_f32s(t, line.spread), is_hit, is_miss }
    }
}

/// What the two roots on a quadric share.
struct SurfaceLine<S: Simd> {
    /// The height of the ray's origin, its change along the ray, and a bound of the error.
    z: S::f32s,
    slope: S::f32s,
    error: S::f32s,
    /// Half the length of the intervals.
    spread: S::f32s,
    /// Whether the line certainly meets the surface, and whether it certainly does not.
    is_deep: S::m32s,
    passes: S::m32s,
    /// Whether the bounds hold.
    is_usual: S::m32s,
}

/// The product of vectors; across the z axis on a cylinder.
#[inline(always)]
fn dot_across<S: Simd, const CYLINDER: bool>(simd: S, a: Vector<S>, b: Vector<S>) -> S::f32s {
    if CYLINDER { simd.mul_add_f32s(a[1], b[1], simd.mul_f32s(a[0], b[0])) } else { dot(simd, a, b) }
}
