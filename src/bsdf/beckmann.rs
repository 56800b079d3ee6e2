//! Beckmann's distribution of microfacet normals, slopes of which are Gaussian, with Smith's shadowing; for agreement
//! with renderers that have it.
//!
//! With the slope `a(w) = wz / |(ax wx, ay wy)|` of a direction over that of the microfacets,
//!
//! ```text
//! D(m)            = exp(-(mx² / ax² + my² / ay²) / mz²) / (pi ax ay mz⁴)
//! p(w)            = wz / G1(w) = (1 + erf a) wz / 2 + exp(-a²) |(ax wx, ay wy)| / (2 sqrt(pi))
//! G2(o, i)        = G1(o) G1(i)
//! visible normals = D(m) (o·m) / p(o)
//! ```
//!
//! (Walter et al., "Microfacet Models for Refraction through Rough Surfaces"). `p` is the area of the visible
//! microfacets as seen from `w`. Both sides are masked independently of each other, as in Mitsuba; what several
//! encounters scatter is lost.
//!
//! Directions are unit, local, on the upper side (`z > 0`).

use std::f32::consts::{FRAC_1_PI, FRAC_2_SQRT_PI};

use super::energy::Energy;
use super::microfacet::{FacetReflection, Microfacets, clamp_alpha};
use crate::math::float::ONE_MINUS_EPSILON;
use crate::math::{Vec2, Vec3, vec2, vec3};

/// A Beckmann distribution; alpha along x and y.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beckmann {
    /// As of [`Ggx`](super::Ggx).
    alpha: [f32; 2],
}

/// The visible microfacets of a direction, by where they lean.
#[derive(Clone, Copy, Debug)]
struct Visible {
    /// Towards the direction, in the plane of the surface stretched by alpha; unit.
    toward: Vec2,
    /// `a`; infinite along the normal.
    slope: f32,
    /// `erf a`.
    erf: f32,
    /// Area, times `2 sqrt(pi)`, of those that lean by less than the slope `a` either way.
    core: f32,
    /// Of the Gaussian ones beyond.
    tail: f32,
    /// Of those beyond that are visible because they lean.
    leaning: f32,
}

/// A slope beyond which there are no microfacets, to any rounding.
const STEEP: f32 = 6.0;

/// `sqrt(pi)`.
const SQRT_PI: f32 = 2.0 / FRAC_2_SQRT_PI;

impl Beckmann {
    /// The distribution for `alpha` within `[0, 1]`; smooth where [`Ggx::new`](super::Ggx::new) is.
    pub fn new(alpha: [f32; 2]) -> Self {
        Self { alpha: clamp_alpha(alpha) }
    }

    #[inline]
    fn visible(&self, w: Vec3) -> Visible {
        let along = vec2(self.alpha[0] * w.x, self.alpha[1] * w.y);
        let length = along.length();
        let slope = w.z / length;
        let gaussian = (-slope * slope).exp();
        let erfc = erfc(slope, gaussian);
        Visible {
            toward: if length > 0.0 { along / length } else { Vec2::X },
            slope,
            erf: 1.0 - erfc,
            core: 2.0 * SQRT_PI * w.z * (1.0 - erfc),
            tail: SQRT_PI * w.z * erfc,
            leaning: length * gaussian,
        }
    }

    /// Area of the microfacets visible from `w`, as seen from there, over that of the surface seen from above.
    #[inline]
    pub fn visible_area(&self, w: Vec3) -> f32 {
        let visible = self.visible(w);
        (visible.core + visible.tail + visible.leaning) / (2.0 * SQRT_PI)
    }

    /// Fraction of the microfacets facing `w` that are not masked.
    #[inline]
    pub fn g1(&self, w: Vec3) -> f32 {
        w.z / self.visible_area(w)
    }
}

impl Microfacets for Beckmann {
    fn with_alpha(alpha: [f32; 2]) -> Self {
        Self::new(alpha)
    }

    #[inline]
    fn alpha(&self) -> [f32; 2] {
        self.alpha
    }

    fn normal_density(&self, m: Vec3) -> f32 {
        let [ax, ay] = self.alpha;
        let (x, y) = (m.x / (ax * m.z), m.y / (ay * m.z));
        let exponent = x * x + y * y;
        // Beyond, the exponential underflows; and normals along the surface, or of no length, have none.
        if exponent < 80.0 {
            let (x, y) = (m.x / m.z, m.y / m.z);
            let inverse_cos2 = 1.0 + x * x + y * y;
            FRAC_1_PI * (-exponent).exp() * (inverse_cos2 * inverse_cos2) / (ax * ay)
        } else {
            0.0
        }
    }

    /// Where alpha is divided out, slopes are Gaussian, and of those that lean by `z` towards `o` the fraction `(a + z)
    /// / a` is seen that is seen of level ones. Within `a` either way that leaves a Gaussian, once `z` is paired with
    /// `-z`; beyond, `a exp(-z²)` and `z exp(-z²)` are sampled each for itself.
    fn sample_visible_normal(&self, o: Vec3, u: [f32; 2]) -> Vec3 {
        let Visible { toward, slope, erf, core, tail, leaning } = self.visible(o);
        let at = u[0] * (core + tail + leaning);
        let mut across = u[1];
        let lean = if at < core || slope > STEEP {
            let lean = erf_inv(at / core * erf).min(slope);
            let forward = 0.5 + 0.5 * lean / slope;
            if across < forward {
                across /= forward;
                lean
            } else {
                across = (across - forward) / (1.0 - forward);
                -lean
            }
        } else if at < core + tail {
            erf_inv(erf + (at - core) / tail * (1.0 - erf))
        } else {
            let left = 1.0 - ((at - core - tail) / leaning).min(ONE_MINUS_EPSILON);
            (slope * slope - left.ln()).sqrt()
        };
        let across = erf_inv(2.0 * across - 1.0);
        let slopes = toward * lean + toward.perp() * across;
        vec3(self.alpha[0] * slopes.x, self.alpha[1] * slopes.y, 1.0).normalize()
    }

    fn g2_over_g1(&self, _o: Vec3, i: Vec3) -> f32 {
        self.g1(i)
    }

    fn reflection(&self, o: Vec3, i: Vec3) -> FacetReflection {
        let half = o + i;
        let pdf = self.reflection_pdf(o, half);
        // |o + i|² = 2 (1 + o·i) = 4 (o·m)².
        FacetReflection { value: pdf * self.g1(i), pdf, cos: (0.5 * half.length()).min(1.0) }
    }

    #[inline]
    fn reflection_pdf(&self, o: Vec3, m: Vec3) -> f32 {
        0.25 * self.normal_density(m) / self.visible_area(o)
    }

    fn refraction(&self, o: Vec3, i: Vec3, x: f32) -> (f32, f32) {
        let pdf = 0.5 * x / self.visible_area(o);
        (pdf * self.g1(i), pdf)
    }

    fn energy<const ISOTROPIC: bool>(&self) -> Option<Energy> {
        None
    }
}

/// `1 - erf x` for `x` not negative, given `exp(-x²)`: within 1.5e-7 (Abramowitz and Stegun, "Handbook of Mathematical
/// Functions", 7.1.26).
#[inline]
fn erfc(x: f32, gaussian: f32) -> f32 {
    const TERMS: [f32; 5] = [0.254_829_6, -0.284_496_74, 1.421_413_7, -1.453_152, 1.061_405_4];
    let t = 1.0 / (1.0 + 0.327_591_1 * x);
    gaussian * t * TERMS.iter().rev().fold(0.0, |sum, term| sum * t + term)
}

/// The number whose `erf` is `x`, within `[-1, 1]`; finite at its ends (Giles, "Approximating the erfinv Function").
#[inline]
fn erf_inv(x: f32) -> f32 {
    const MIDDLE: [f32; 9] = [
        2.810_226_4e-8,
        3.432_739_4e-7,
        -3.523_387_7e-6,
        -4.391_506_5e-6,
        2.185_808_7e-4,
        -1.253_725e-3,
        -4.177_681_6e-3,
        0.246_640_73,
        1.501_409_4,
    ];
    const ENDS: [f32; 9] = [
        -2.002_142_6e-4,
        1.009_505_6e-4,
        1.349_343_2e-3,
        -3.673_428_4e-3,
        5.739_507_7e-3,
        -7.622_461_3e-3,
        9.438_87e-3,
        1.001_674,
        2.832_976_8,
    ];
    let x = x.clamp(-ONE_MINUS_EPSILON, ONE_MINUS_EPSILON);
    let w = -((1.0 - x) * (1.0 + x)).ln();
    let (terms, at) = if w < 5.0 { (MIDDLE, w - 2.5) } else { (ENDS, w.sqrt() - 3.0) };
    x * terms.iter().fold(0.0, |sum, term| sum * at + term)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_error_function_and_its_inverse_are_right_to_rounding() {
        for step in 0..4_000 {
            let x = step as f32 * 1e-3;
            let expected = statrs::function::erf::erf(f64::from(x));
            let found = f64::from(1.0 - erfc(x, (-x * x).exp()));
            assert!((found - expected).abs() < 5e-7, "{x}: {found} {expected}");
            // An error of the inverse counts as much as it moves the function.
            let back = erf_inv(expected as f32);
            let moved = f64::from((back - x).abs()) * (-f64::from(x * x)).exp();
            assert!(moved < 1e-6 && erf_inv(-expected as f32) == -back, "{x}: {back}");
        }
        assert!(erf_inv(1.0).is_finite() && erf_inv(-1.0).is_finite());
    }
}
