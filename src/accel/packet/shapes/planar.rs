//! Parallelograms and disks.

use pulp::Simd;

use super::{RESOLUTION, RootInterval, Roots, SIDE_ERROR, none, point_at};
use crate::accel::packet::lanes::{Vector, absolute, absolute_sum, add_scaled, dot, splat, subtract};
use crate::geometry::{PACKET_SIZE, RayPacket, TransformedShape};
use crate::math::float::UNIT_ROUNDOFF;
use crate::math::{DVec3, Vec3};

/// Nothing is decided about rays that meet a plane at an angle with a smaller sine (of 1-norms).
const FLAT: f32 = 1.0 / 4096.0;
/// A flat surface.
pub(super) struct Planar {
    center: Vec3,
    /// Unit.
    normal: Vec3,
    /// What rounding the centre moves the plane by, along the normal, and a bound of what else the numerator of the
    /// distance may be off by, whatever the ray.
    offset: f32,
    offset_error: f32,
    /// Coordinates within the plane, from -1 to 1 on a parallelogram; the radius of a disk is 1.
    rows: [Vec3; 2],
    /// The largest component of the rows.
    row: f32,
    /// The 1-norm of the centre.
    reach: f32,
    /// The square of a ring's inner radius; negative where there is none.
    inner_squared: f32,
    /// Whether all of it is kept.
    is_whole: bool,
    /// The same in `f64`.
    exact_center: DVec3,
    exact_normal: DVec3,
}

impl Planar {
    /// A surface about `center`, between `edges` and their opposites.
    pub fn new(placed: &TransformedShape, center: DVec3, edges: [DVec3; 2], inner: f64, is_whole: bool) -> Self {
        let [a, b] = edges;
        let normal = a.cross(b).normalize();
        let area = a.cross(b).length();
        let rows = [b.cross(normal) / area, normal.cross(a) / area];
        let rounded = center.as_vec3();
        let offset = (center - rounded.as_dvec3()).dot(normal) as f32;
        Self {
            center: rounded,
            normal: normal.as_vec3(),
            offset,
            offset_error: 0.25 * placed.error() + (2.0 * UNIT_ROUNDOFF) as f32 * offset.abs(),
            rows: rows.map(DVec3::as_vec3),
            row: rows.iter().map(|row| row.abs().max_element()).fold(0.0, f64::max) as f32,
            reach: center.abs().element_sum() as f32,
            inner_squared: if inner > 0.0 { (inner * inner) as f32 } else { -1.0 },
            is_whole,
            exact_center: center,
            exact_normal: normal,
        }
    }

    /// See [`PacketShape::sides`](super::PacketShape::sides).
    #[inline(always)]
    pub fn sides(&self, rays: &RayPacket, t: &[f32; PACKET_SIZE], sides: &mut [f32; PACKET_SIZE]) {
        let (center, normal) = (self.exact_center, self.exact_normal);
        let reach = f64::from(self.reach);
        for i in 0..PACKET_SIZE {
            let p = point_at(rays, i, t[i]) - center;
            let side = normal.dot(p);
            let margin = 0.125 * SIDE_ERROR * (p.abs().element_sum() + reach);
            let direction = rays.get(i).direction.as_dvec3();
            let cosine = normal.dot(direction);
            let is_certain = (side.abs() > margin) & (cosine.abs() > UNIT_ROUNDOFF * direction.abs().element_sum());
            let has_crossed = side * cosine > 0.0;
            let is_outside = is_certain & (has_crossed == (t[i] <= rays.t_min[i]));
            sides[i] = if is_outside { 1.0 } else { 0.0 };
        }
    }

    /// Where rays, whose directions have the 1-norms `length`, meet the surface.
    #[inline(always)]
    pub fn root<S: Simd, const DISK: bool>(
        &self,
        simd: S,
        origin: Vector<S>,
        direction: Vector<S>,
        length: S::f32s,
    ) -> Roots<S> {
        let s = simd;
        let [six, eight] = [6.0, 8.0].map(|roundings| (roundings * UNIT_ROUNDOFF) as f32);
        let (six, eight) = (s.splat_f32s(six), s.splat_f32s(eight));
        let normal = splat(s, self.normal);
        let v = subtract(s, origin, splat(s, self.center));
        // 5 roundings of each product: where a coordinate alone decides, the sign is certain at any distance.
        let numerator = s.sub_f32s(s.splat_f32s(self.offset), dot(s, v, normal));
        let numerator_error =
            s.mul_add_f32s(six, dot(s, absolute(s, v), absolute(s, normal)), s.splat_f32s(self.offset_error));
        let cosine = dot(s, direction, normal);
        let cosine_error = s.mul_f32s(eight, length);
        let is_steep = s.greater_than_f32s(s.abs_f32s(cosine), s.mul_f32s(length, s.splat_f32s(FLAT)));
        let inverse = s.div_f32s(s.splat_f32s(1.0), cosine);
        let t = s.mul_f32s(numerator, inverse);
        let error = s.mul_add_f32s(s.abs_f32s(t), cosine_error, numerator_error);
        let spread = s.mul_f32s(s.mul_f32s(error, s.abs_f32s(inverse)), s.splat_f32s(1.125));

        let p = add_scaled(s, v, direction, t);
        let [x, y] = [dot(s, p, splat(s, self.rows[0])), dot(s, p, splat(s, self.rows[1]))];
        let path = s.mul_add_f32s(s.abs_f32s(t), length, s.add_f32s(absolute_sum(s, v), s.splat_f32s(self.reach)));
        let error = s.mul_add_f32s(spread, length, s.mul_f32s(eight, path));
        let error = s.mul_f32s(error, s.splat_f32s(self.row));
        let (mut is_inside, is_outside) =
            if DISK { self.within_ring(s, [x, y], error) } else { within_square(s, [x, y], error) };
        let is_fine =
            s.less_than_or_equal_f32s(s.mul_f32s(spread, length), s.mul_f32s(s.splat_f32s(0.5 * RESOLUTION), path));
        is_inside = if self.is_whole { s.and_m32s(is_inside, is_fine) } else { none(s) };
        let nan = s.splat_f32s(f32::NAN);
        let near = RootInterval {
            low: s.select_f32s(is_steep, s.sub_f32s(t, spread), nan),
            high: s.select_f32s(is_steep, s.add_f32s(t, spread), nan),
            is_hit: s.and_m32s(is_inside, is_steep),
            is_miss: s.and_m32s(is_outside, is_steep),
        };
        let never = none(s);
        let far = RootInterval { low: nan, high: nan, is_hit: never, is_miss: s.not_m32s(never) };
        // What starts behind a plane leaves it, what ends before it comes.
        Roots { near, far, middle: [s.splat_f32s(f32::INFINITY), s.splat_f32s(f32::NEG_INFINITY)] }
    }

    /// Whether a point, of which both coordinates have an error, certainly is on the ring, and whether it certainly is
    /// not.
    #[inline(always)]
    fn within_ring<S: Simd>(&self, simd: S, [x, y]: [S::f32s; 2], error: S::f32s) -> (S::m32s, S::m32s) {
        let s = simd;
        let (one, inner) = (s.splat_f32s(1.0), s.splat_f32s(self.inner_squared));
        let squared = s.mul_add_f32s(x, x, s.mul_f32s(y, y));
        // (1 ± sqrt(2) error)², up to an error of 1/2, and 4 roundings.
        let error = s.mul_add_f32s(s.splat_f32s(4.0), error, s.splat_f32s((8.0 * UNIT_ROUNDOFF) as f32));
        let is_bounded = s.less_than_f32s(error, s.splat_f32s(2.0));
        let (high, low) = (s.add_f32s(squared, error), s.sub_f32s(squared, error));
        let is_inside = s.and_m32s(s.less_than_or_equal_f32s(high, one), s.greater_than_or_equal_f32s(low, inner));
        let is_outside = s.or_m32s(s.greater_than_f32s(low, one), s.less_than_f32s(high, inner));
        (s.and_m32s(is_inside, is_bounded), s.and_m32s(is_outside, is_bounded))
    }
}

/// As [`Planar::within_ring`], of the square between -1 and 1.
#[inline(always)]
fn within_square<S: Simd>(simd: S, [x, y]: [S::f32s; 2], error: S::f32s) -> (S::m32s, S::m32s) {
    let s = simd;
    let (one, farthest) = (s.splat_f32s(1.0), s.max_f32s(s.abs_f32s(x), s.abs_f32s(y)));
    let is_inside = s.less_than_or_equal_f32s(s.add_f32s(farthest, error), one);
    (is_inside, s.greater_than_f32s(s.sub_f32s(farthest, error), one))
}
