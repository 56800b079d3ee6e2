//! A diffuse part beside Phong's cosine lobe: the modified Phong model (Lafortune and Willems, "Using the Modified
//! Phong Reflectance Model for Physically Based Rendering").
//!
//! ```text
//! f = diffuse / pi + specular (n + 2) / (2 pi) cos^n alpha
//! ```
//!
//! with `alpha` the angle between `wi` and the mirror direction of `wo`: reciprocal, and the lobe reflects `specular`
//! of the light from ahead and less at an angle, where a part of it is below the horizon. Diffuse and specular together
//! must not exceed 1 in any channel.

use std::f32::consts::{FRAC_1_PI, TAU};

use super::microfacet::MIN_COSINE;
use super::split::share;
use super::{BsdfEval, BsdfFlags, BsdfSample};
use crate::color::Rgb;
use crate::math::{Frame, Vec3, sin_cos_turns, vec3};
use crate::sampling::warp;

/// The largest exponent that counts, for a lobe a thousandth wide: it is no delta.
const MAX_EXPONENT: f32 = 1e6;

/// A diffuse part beside a cosine lobe, on both sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Phong {
    diffuse: Rgb,
    specular: Rgb,
    exponent: f32,
}

impl Phong {
    /// With an `exponent` of at least 0, of which 1e6 counts at most.
    pub fn new(diffuse: Rgb, specular: Rgb, exponent: f32) -> Self {
        Self { diffuse, specular, exponent: exponent.min(MAX_EXPONENT) }
    }

    /// Probability of the lobe.
    #[inline]
    fn lobe_probability(&self) -> f32 {
        let (specular, diffuse) = (self.specular.mean(), self.diffuse.mean());
        if specular + diffuse > 0.0 { specular / (specular + diffuse) } else { 0.0 }
    }

    /// `cos^n` of the angle between `i` and the mirror direction of `o`, 0 from a right angle on. The cosine is 1 less
    /// half the squared distance, which a large exponent does not blur.
    #[inline]
    fn power(&self, o: Vec3, i: Vec3) -> f32 {
        let below_one = 0.5 * (i - vec3(-o.x, -o.y, o.z)).length_squared();
        if below_one < 1.0 { (self.exponent * (-below_one).ln_1p()).exp() } else { 0.0 }
    }

    /// Both parts, for directions on the same side.
    #[inline]
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> BsdfEval {
        if wo.z * wi.z <= 0.0 || wo.z.abs() <= MIN_COSINE {
            return BsdfEval::default();
        }
        let (o, i) = (vec3(wo.x, wo.y, wo.z.abs()), vec3(wi.x, wi.y, wi.z.abs()));
        let (power, probability) = (self.power(o, i), self.lobe_probability());
        let cosine_pdf = FRAC_1_PI * i.z;
        BsdfEval {
            value: self.diffuse * cosine_pdf + self.specular * ((self.exponent + 2.0) / TAU * power * i.z),
            pdf: (1.0 - probability) * cosine_pdf + probability * (self.exponent + 1.0) / TAU * power,
        }
    }

    /// As [`Bsdf::diffuse_fraction`](super::Bsdf::diffuse_fraction).
    pub fn diffuse_fraction(&self, wo: Vec3, wi: Vec3) -> Rgb {
        share(self.diffuse * (FRAC_1_PI * wi.z.abs()), self.eval(wo, wi).value)
    }

    /// A direction from one of the parts; `None` below the horizon, into which the lobe reaches.
    #[inline]
    pub fn sample(&self, wo: Vec3, u_lobe: f32, u: [f32; 2]) -> Option<BsdfSample> {
        if wo.z.abs() <= MIN_COSINE {
            return None;
        }
        let o = vec3(wo.x, wo.y, wo.z.abs());
        let i = if u_lobe < self.lobe_probability() {
            // cos = u^(1 / (n + 1)) has the density (n + 1) cos^n; its logarithm keeps the sine of a narrow lobe exact.
            let log_cos = (1.0 - u[0]).ln() / (self.exponent + 1.0);
            let (cos, sin) = (log_cos.exp(), (-(2.0 * log_cos).exp_m1()).sqrt());
            let (y, x) = sin_cos_turns(u[1]);
            Frame::from_normal(vec3(-o.x, -o.y, o.z)).to_world(vec3(sin * x, sin * y, cos)).normalize()
        } else {
            warp::cosine_hemisphere(u)
        };
        if i.z <= 0.0 {
            return None;
        }
        let wi = vec3(i.x, i.y, i.z.copysign(wo.z));
        self.eval(wo, wi).sampled(wi)
    }

    /// The lobes.
    #[inline]
    pub fn flags(&self) -> BsdfFlags {
        BsdfFlags::DIFFUSE | BsdfFlags::GLOSSY | BsdfFlags::REFLECTION
    }

    /// Both parts; what the lobe loses at an angle is left out.
    pub fn albedo(&self, _: Vec3) -> Rgb {
        self.diffuse + self.specular
    }
}
