//! Where a ray meets a surface of revolution about the z axis: one equation in the profile's parameter.
//!
//! A ray that climbs passes the height `z(s)` at `t(s) = (z(s) - o.z) / d.z`; there its distance from the axis must be
//! `r(s)`. That is a polynomial of degree 6 in `s`, isolated by its Bernstein coefficients. For a ray (nearly)
//! perpendicular to the axis that equation loses its meaning; there the ray passes the distance `r(s)` at
//! `t = t_closest ± sqrt((r² - h²) / a)`, where its height must be `z(s)`.

use super::Sector;
use super::segment::{Knot, Segment};
use crate::geometry::LocalHit;
use crate::math::bernstein::{isolate_roots, sign_changes};
use crate::math::{Bracket, RayF64, bisect, newton_in_bracket};

/// Below this sine of the angle between the ray and the plane perpendicular to the axis, heights are compared instead
/// of distances.
const LEVEL: f64 = 1e-3;

/// Relative slack of the tests that skip segments: far above the rounding of what they compare, far below what would
/// cost time.
const CULL_SLACK: f64 = 1e-12;

/// Rounding of the functions whose roots are isolated, relative to their terms.
const NOISE: f64 = 4.0 * f64::EPSILON;

/// How often a monotone piece is halved before two roots in it count as one tangency.
const MAX_DEPTH: u32 = 44;

/// A ray against the segments, with the nearest hit so far.
struct Search<'a> {
    ray: &'a RayF64,
    sector: &'a Sector,
    /// Coefficients of the squared distance of the ray's points from the axis, `a t² + 2 b t + c`.
    a: f64,
    b: f64,
    c: f64,
    best: Option<LocalHit>,
}

/// The first hit of `ray` (about the z axis) within its interval. `size` bounds the coordinates of the segments.
pub(super) fn intersect(segments: &[Segment], sector: &Sector, size: f64, ray: &RayF64) -> Option<LocalHit> {
    let (o, d) = (ray.origin, ray.direction);
    let a = d.x * d.x + d.y * d.y;
    let mut search = Search { ray, sector, a, b: o.x * d.x + o.y * d.y, c: o.x * o.x + o.y * o.y, best: None };
    if d.z * d.z >= LEVEL * LEVEL * (a + d.z * d.z) && d.z != 0.0 {
        let scale = size + o.z.abs();
        for (index, segment) in segments.iter().enumerate() {
            search.climb(segment, index as f64, scale);
        }
    } else if a > 0.0 {
        search.level(segments, size);
    }
    search.best
}

impl Search<'_> {
    /// Takes a candidate if it is in the interval, before the best so far, and not clipped.
    #[inline]
    fn offer(&mut self, t: f64, profile: f64) {
        let nearer = self.best.is_none_or(|best| t < best.t);
        if nearer && self.ray.contains(t) && t.is_finite() {
            let p = self.ray.at(t);
            if self.sector.contains(p.x, p.y) {
                self.best = Some(LocalHit { t, profile });
            }
        }
    }

    #[inline]
    fn t_max(&self) -> f64 {
        self.best.map_or(self.ray.t_max, |best| best.t)
    }

    /// Whether the ray can meet the box of the segment, in the plane of distance and height, within its interval.
    #[inline]
    fn may_meet(&self, segment: &Segment, scale: f64) -> bool {
        let slack = CULL_SLACK * scale;
        let (o_z, d_z) = (self.ray.origin.z, self.ray.direction.z);
        let inverse = 1.0 / d_z;
        let (t0, t1) = ((segment.z_range.min - slack - o_z) * inverse, (segment.z_range.max + slack - o_z) * inverse);
        let lo = t0.min(t1).max(self.ray.t_min);
        let hi = t0.max(t1).min(self.t_max());
        let squared = |t: f64| (self.a * t + 2.0 * self.b) * t + self.c;
        // A ray along the axis has no closest point: the NaN gives way to the lower end.
        let closest = (-self.b / self.a).max(lo).min(hi);
        let (reach, hole) = (segment.r_range.max + slack, (segment.r_range.min - slack).max(0.0));
        lo <= hi
            && squared(closest) <= reach * reach + slack * scale
            && squared(lo).max(squared(hi)) >= hole * hole - slack * scale
    }

    /// Roots of `F(s) = d.z² (r² - c) - zeta (a zeta + 2 b d.z)` with `zeta = z - o.z`: `d.z²` times the surface's
    /// squared distance from the axis less the ray's.
    #[inline]
    fn climb(&mut self, segment: &Segment, index: f64, scale: f64) {
        if !self.may_meet(segment, scale) {
            return;
        }
        let (o_z, d_z) = (self.ray.origin.z, self.ray.direction.z);
        let (a, b, c) = (self.a, self.b, self.c);
        let (d_z_squared, two_b_d_z) = (d_z * d_z, 2.0 * b * d_z);
        let linear = 2.0 * a * o_z - two_b_d_z;
        let constant = o_z * (two_b_d_z - a * o_z) - d_z_squared * c;
        let mut coefficients: [f64; 7] = std::array::from_fn(|k| {
            d_z_squared * segment.r_squared[k] - a * segment.z_squared[k] + linear * segment.z_raised[k] + constant
        });
        // On the axis no ray is nearer to it than the surface, though a ray through the pole is as near: a zero there,
        // or a rounding above it, would hide the root beside it.
        for end in [0, 6] {
            if segment.r_squared[end] == 0.0 {
                coefficients[end] = coefficients[end].min(-f64::MIN_POSITIVE);
            }
        }
        if sign_changes(&coefficients) == 0 {
            return;
        }

        let f = |s: f64| {
            let (r, zeta) = (segment.r.value(s), segment.z.value(s) - o_z);
            let value = d_z_squared * (r * r - c) - zeta * (a * zeta + two_b_d_z);
            let slope = d_z_squared * r * segment.r.derivative(s) - segment.z.derivative(s) * (a * zeta + b * d_z);
            (value, 2.0 * slope)
        };
        let terms =
            d_z_squared * (segment.r_range.max * segment.r_range.max + c) + (a * scale + two_b_d_z.abs()) * scale;
        isolate_roots(&coefficients, NOISE * terms, &mut |bracket| {
            let s = newton_in_bracket(&bracket, f);
            self.offer((segment.z.value(s) - o_z) / d_z, index + s);
        });
    }

    /// All segments, for a ray (nearly) perpendicular to the axis.
    fn level(&mut self, segments: &[Segment], size: f64) {
        let (o, d) = (self.ray.origin, self.ray.direction);
        let t_closest = -self.b / self.a;
        let cross = o.x * d.y - o.y * d.x;
        let level = Level {
            z: o.z + t_closest * d.z,
            climb: d.z / self.a.sqrt(),
            h_squared: cross * cross / self.a,
            h: cross.abs() / self.a.sqrt(),
            noise: NOISE * size,
        };
        let slack = CULL_SLACK * (size + level.z.abs());
        for (index, segment) in segments.iter().enumerate() {
            let reach = (segment.r_range.max * segment.r_range.max - level.h_squared).max(0.0).sqrt()
                * level.climb.abs()
                + slack;
            let is_outside = |low: f64, high: f64| level.z + reach < low || level.z - reach > high;
            if segment.r_range.max < level.h || is_outside(segment.z_range.min, segment.z_range.max) {
                continue;
            }
            for pair in segment.knots.windows(2) {
                if is_outside(pair[0].z.min(pair[1].z), pair[0].z.max(pair[1].z)) {
                    continue;
                }
                let Some([from, to]) = level.clip(segment, pair[0], pair[1]) else { continue };
                // The two points of the ray at one distance from the axis; one search where they are at one height.
                let sides: &[f64] = if level.climb == 0.0 { &[1.0] } else { &[-1.0, 1.0] };
                for &side in sides {
                    level.isolate(segment, side, [from, to], 0, &mut |s| {
                        let t_half = (level.chord(segment.r.value(s)).powi(2) / self.a).sqrt();
                        if level.climb == 0.0 {
                            self.offer(t_closest - t_half, index as f64 + s);
                            self.offer(t_closest + t_half, index as f64 + s);
                        } else {
                            self.offer(t_closest + side * t_half, index as f64 + s);
                        }
                    });
                }
            }
        }
    }
}

/// A ray nearly perpendicular to the axis, by its point closest to the axis.
struct Level {
    /// Height of the closest point.
    z: f64,
    /// Height gained for each unit of length perpendicular to the axis.
    climb: f64,
    /// Distance of the closest point from the axis, and its square.
    h: f64,
    h_squared: f64,
    /// Rounding of a height.
    noise: f64,
}

impl Level {
    /// Half the chord that the ray cuts from a circle of radius `r`, as seen along the axis.
    #[inline]
    fn chord(&self, r: f64) -> f64 {
        ((r - self.h) * (r + self.h)).max(0.0).sqrt()
    }

    /// Height of the surface above the ray on one side of its closest point.
    #[inline]
    fn above(&self, side: f64, knot: &Knot) -> f64 {
        knot.z - self.z - side * self.climb * self.chord(knot.r)
    }

    /// The part of a monotone piece that the ray reaches, `r >= h`.
    fn clip(&self, segment: &Segment, from: Knot, to: Knot) -> Option<[Knot; 2]> {
        let (from_inside, to_inside) = (from.r >= self.h, to.r >= self.h);
        if from_inside && to_inside {
            return Some([from, to]);
        }
        if !from_inside && !to_inside {
            return None;
        }
        let bracket = Bracket { lo: from.s, hi: to.s, at_lo: from.r - self.h, at_hi: to.r - self.h, guess: from.s };
        let s = bisect(&bracket, |s| segment.r.value(s) - self.h);
        // With r = h both sides have the same value there, so a crossing between them is found exactly once.
        let rim = Knot { s, r: self.h, z: segment.z.value(s) };
        Some(if from_inside { [from, rim] } else { [rim, to] })
    }

    /// Calls `found` with each parameter in a monotone piece where the surface is at the ray's height.
    fn isolate(&self, segment: &Segment, side: f64, piece: [Knot; 2], depth: u32, found: &mut impl FnMut(f64)) {
        let [from, to] = piece;
        let (chord_from, chord_to) = (self.chord(from.r), self.chord(to.r));
        let slope = side * self.climb;
        let (at_lo, at_hi) = (self.above(side, &from), self.above(side, &to));
        let guess = from.s + (to.s - from.s) * (at_lo / (at_lo - at_hi));
        let bracket = Bracket { lo: from.s, hi: to.s, at_lo, at_hi, guess };

        // The difference of two monotone terms: monotone itself if they run against each other.
        let (rise, sink) = (to.z - from.z, slope * (chord_to - chord_from));
        if rise * sink <= 0.0 || rise.abs() + sink.abs() <= self.noise || depth == MAX_DEPTH {
            if bracket.changes_sign() && self.climb == 0.0 {
                found(newton_in_bracket(&bracket, |s| (segment.z.value(s) - self.z, segment.z.derivative(s))));
            } else if bracket.changes_sign() {
                found(bisect(&bracket, |s| {
                    let knot = Knot { s, r: segment.r.value(s), z: segment.z.value(s) };
                    self.above(side, &knot)
                }));
            }
            return;
        }
        let (rise_from, rise_to) = (slope * chord_from, slope * chord_to);
        let lowest = from.z.min(to.z) - self.z - rise_from.max(rise_to);
        let highest = from.z.max(to.z) - self.z - rise_from.min(rise_to);
        // Written so that a NaN ends the search.
        if !(lowest <= 0.0 && highest >= 0.0) {
            return;
        }
        let s = 0.5 * (from.s + to.s);
        let middle = Knot { s, r: segment.r.value(s), z: segment.z.value(s) };
        self.isolate(segment, side, [from, middle], depth + 1, found);
        self.isolate(segment, side, [middle, to], depth + 1, found);
    }
}
