//! A diffuse part beside a GGX highlight: what Phong's and Cook and Torrance's models of older scenes come to.
//!
//! ```text
//! f = diffuse / pi + F D G2 / (4 |cos wo| |cos wi|),    F = f0 + (f90 - f0) (1 - cos)^5
//! ```
//!
//! Both parts always count in full, so that diffuse and grazing reflectance together must not exceed 1 in any channel.

use std::f32::consts::FRAC_1_PI;

use super::energy::schlick_weight;
use super::microfacet::{MIN_COSINE, Microfacets, reflect};
use super::split::share;
use super::{BsdfEval, BsdfFlags, BsdfSample, Ggx};
use crate::color::Rgb;
use crate::math::{Vec3, vec3};
use crate::sampling::warp;

/// A diffuse part beside a highlight, on both sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Glossy {
    diffuse: Rgb,
    /// Reflectance of the highlight at normal incidence and at grazing angles.
    f0: Rgb,
    f90: Rgb,
    ggx: Ggx,
}

/// The least alpha: the highlight is no delta.
const MIN_ALPHA: f32 = 1e-3;

impl Glossy {
    /// With Schlick's Fresnel term from `f0` to `f90` and a GGX `alpha` within `[0, 1]`, of which at least 0.001
    /// counts.
    pub fn new(diffuse: Rgb, f0: Rgb, f90: Rgb, alpha: f32) -> Self {
        Self { diffuse, f0, f90, ggx: Ggx::new([alpha.max(MIN_ALPHA); 2]) }
    }

    /// Alpha along both tangents.
    pub(super) fn alpha(&self) -> [f32; 2] {
        self.ggx.alpha()
    }

    /// With another roughness.
    pub(super) fn with_alpha(&self, alpha: [f32; 2]) -> Self {
        Self { ggx: Ggx::new(alpha), ..*self }
    }

    /// Phong's model with the highlight of the same width: alpha is `sqrt(2 / (exponent + 2))` (Walter et al.,
    /// "Microfacet Models for Refraction through Rough Surfaces").
    pub fn phong(diffuse: Rgb, specular: Rgb, exponent: f32) -> Self {
        Self::new(diffuse, specular, specular, (2.0 / (exponent + 2.0)).sqrt())
    }

    #[inline]
    fn reflectance(&self, cos: f32) -> Rgb {
        self.f0 + (self.f90 - self.f0) * schlick_weight(cos.min(1.0))
    }

    /// Probability of the highlight: by what the parts reflect, about.
    #[inline]
    fn highlight_probability(&self, cos: f32) -> f32 {
        let (highlight, diffuse) = (self.reflectance(cos).mean(), self.diffuse.mean());
        if highlight + diffuse > 0.0 { highlight / (highlight + diffuse) } else { 0.0 }
    }

    /// Both parts, for directions on the same side.
    #[inline]
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> BsdfEval {
        if wo.z * wi.z <= 0.0 || wo.z.abs() <= MIN_COSINE {
            return BsdfEval::default();
        }
        let (o, i) = (vec3(wo.x, wo.y, wo.z.abs()), vec3(wi.x, wi.y, wi.z.abs()));
        let facet = self.ggx.reflection(o, i);
        let probability = self.highlight_probability(o.z);
        let cosine_pdf = FRAC_1_PI * i.z;
        BsdfEval {
            value: self.diffuse * cosine_pdf + self.reflectance(facet.cos) * facet.value,
            pdf: (1.0 - probability) * cosine_pdf + probability * facet.pdf,
        }
    }

    /// As [`Bsdf::diffuse_fraction`](super::Bsdf::diffuse_fraction).
    pub fn diffuse_fraction(&self, wo: Vec3, wi: Vec3) -> Rgb {
        share(self.diffuse * (FRAC_1_PI * wi.z.abs()), self.eval(wo, wi).value)
    }

    /// A direction from one of the parts.
    #[inline]
    pub fn sample(&self, wo: Vec3, u_lobe: f32, u: [f32; 2]) -> Option<BsdfSample> {
        if wo.z.abs() <= MIN_COSINE {
            return None;
        }
        let o = vec3(wo.x, wo.y, wo.z.abs());
        let i = if u_lobe < self.highlight_probability(o.z) {
            let m = self.ggx.sample_visible_normal(o, u);
            reflect(o, m, o.dot(m))
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

    /// Both parts; what microfacets lose is left out.
    pub fn albedo(&self, wo: Vec3) -> Rgb {
        self.diffuse + self.reflectance(wo.z.abs())
    }
}
