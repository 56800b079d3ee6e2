//! One cubic segment of a profile, with everything about it that does not depend on the ray.

use crate::math::bernstein::product_of_cubics;
use crate::math::{DVec2, dvec2, solve_quadratic};

/// A cubic on `[0, 1]`, by powers of the parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cubic([f64; 4]);

impl Cubic {
    fn from_bernstein(c: &[f64; 4]) -> Self {
        Self([c[0], 3.0 * (c[1] - c[0]), 3.0 * (c[0] - 2.0 * c[1] + c[2]), c[3] - 3.0 * c[2] + 3.0 * c[1] - c[0]])
    }

    /// The value at `s`.
    #[inline]
    pub fn value(&self, s: f64) -> f64 {
        let c = &self.0;
        ((c[3] * s + c[2]) * s + c[1]) * s + c[0]
    }

    /// The derivative at `s`.
    #[inline]
    pub fn derivative(&self, s: f64) -> f64 {
        let c = &self.0;
        (3.0 * c[3] * s + 2.0 * c[2]) * s + c[1]
    }

    /// Parameters strictly inside `(0, 1)` where the derivative vanishes.
    fn critical(&self) -> impl Iterator<Item = f64> {
        let c = &self.0;
        let roots = solve_quadratic(3.0 * c[3], c[2], c[1]).map(|r| [r.near, r.far]);
        roots.into_iter().flatten().filter(|&s| s > 0.0 && s < 1.0)
    }
}

/// A point of the profile: parameter within the segment, distance from the axis, height.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Knot {
    pub s: f64,
    pub r: f64,
    pub z: f64,
}

/// A range of values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Range {
    pub min: f64,
    pub max: f64,
}

/// A segment: distance from the axis `r(s)` and height `z(s)`.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Segment {
    pub r: Cubic,
    pub z: Cubic,
    /// Bernstein coefficients of degree 6 of `r²`, `z²` and `z`.
    pub r_squared: [f64; 7],
    pub z_squared: [f64; 7],
    pub z_raised: [f64; 7],
    /// Exact ranges.
    pub r_range: Range,
    pub z_range: Range,
    /// Between neighbouring knots both `r` and `z` are monotone. The first is at `s = 0`, the last at `s = 1`.
    pub knots: Vec<Knot>,
    control: [DVec2; 4],
}

impl Segment {
    /// From control points `(r, z)`.
    pub fn new(control: &[DVec2; 4]) -> Self {
        let (r_control, z_control) = (control.map(|p| p.x), control.map(|p| p.y));
        let (r, z) = (Cubic::from_bernstein(&r_control), Cubic::from_bernstein(&z_control));

        let mut inner: Vec<f64> = r.critical().chain(z.critical()).collect();
        inner.sort_by(f64::total_cmp);
        inner.dedup();
        let end = |s: f64, p: DVec2| Knot { s, r: p.x, z: p.y };
        let mut knots = vec![end(0.0, control[0])];
        knots.extend(inner.iter().map(|&s| Knot { s, r: r.value(s), z: z.value(s) }));
        knots.push(end(1.0, control[3]));

        let range = |value: fn(&Knot) -> f64| {
            let start = Range { min: f64::INFINITY, max: f64::NEG_INFINITY };
            knots.iter().map(value).fold(start, |range, x| Range { min: range.min.min(x), max: range.max.max(x) })
        };
        Self {
            r_squared: product_of_cubics(&r_control, &r_control),
            z_squared: product_of_cubics(&z_control, &z_control),
            z_raised: product_of_cubics(&z_control, &[1.0; 4]),
            r_range: range(|k| k.r),
            z_range: range(|k| k.z),
            r,
            z,
            knots,
            control: *control,
        }
    }

    /// Change of `(r, z)` with the parameter.
    #[inline]
    pub fn derivative(&self, s: f64) -> DVec2 {
        // By differences of control points: these vanish exactly where points coincide.
        let c = &self.control;
        let (d0, d1, d2) = (c[1] - c[0], c[2] - c[1], c[3] - c[2]);
        let q = 1.0 - s;
        (d0 * (q * q) + d1 * (2.0 * q * s) + d2 * (s * s)) * 3.0
    }

    /// Unit tangent. Where the derivative vanishes, the limit from inside the segment.
    pub fn tangent(&self, s: f64) -> DVec2 {
        let c = &self.control;
        let (d0, d1, d2) = (c[1] - c[0], c[2] - c[1], c[3] - c[2]);
        let second = (d1 - d0) * (1.0 - s) + (d2 - d1) * s;
        let third = d2 - d1 * 2.0 + d0;
        let limits = [self.derivative(s), if s < 1.0 { second } else { -second }, third];
        let found = limits.iter().find(|v| v.length_squared() > f64::MIN_POSITIVE);
        found.map_or(dvec2(0.0, 1.0), |v| *v / v.length())
    }
}
