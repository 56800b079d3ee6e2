//! A diffuse base under a clear dielectric coat.
//!
//! With `E(w)` the fraction of the light from `w` that the coat reflects (Fresnel's `F` for a smooth coat, the single-scattering albedo of
//! its microfacets for a rough one) and `E_avg` its mean under diffuse light,
//!
//! ```text
//! f = coat + (1 - E(wo)) (1 - E(wi)) / (1 - E_avg) * diffuse / pi
//! ```
//!
//! For a smooth coat `1 - E_avg = eta² (1 - F_internal)`, and this is the linear formula of Mitsuba's `plastic`: light that the coat throws
//! back inside keeps the colour of one scattering. A white base loses nothing, whatever the coat (for an anisotropic one `E` between its axes
//! is approximate: within a hundredth or two unless its alphas differ more than four times), and the base is reciprocal (Kelemen and
//! Szirmay-Kalos, "A Microfacet Based Coupled Specular-Matte BRDF Model with Importance Sampling").

use std::f32::consts::FRAC_1_PI;

use super::microfacet::MIN_COSINE;
use super::split::share;
use super::{BsdfEval, BsdfSample, Coat};
use crate::color::Rgb;
use crate::math::{Vec3, vec3};
use crate::sampling::warp;

/// A diffuse base under a clear coat, on both sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plastic {
    /// Colour of the base, each channel within `[0, 1]`.
    pub diffuse: Rgb,
    /// The coat.
    pub coat: Coat,
}

impl Plastic {
    /// A base of colour `diffuse` under a coat with index of refraction `ior` over the outside, at least 1; smooth where
    /// [`Ggx::new`](super::Ggx::new) says so. A rough coat costs some milliseconds here.
    pub fn new(diffuse: Rgb, ior: f32, alpha: [f32; 2]) -> Self {
        Self { diffuse, coat: Coat::new(ior, alpha) }
    }

    /// Probability of choosing the coat: by what the lobes scatter.
    #[inline]
    fn coat_probability(&self, coat_albedo: f32) -> f32 {
        let base = (1.0 - coat_albedo) * self.diffuse.mean();
        let sum = coat_albedo + base;
        if sum > 0.0 { coat_albedo / sum } else { 0.0 }
    }

    /// Base and rough coat for directions on the same side.
    #[inline]
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> BsdfEval {
        if wo.z * wi.z <= 0.0 {
            return BsdfEval::default();
        }
        self.eval_upper(vec3(wo.x, wo.y, wo.z.abs()), vec3(wi.x, wi.y, wi.z.abs()))
    }

    #[inline]
    fn eval_upper(&self, o: Vec3, i: Vec3) -> BsdfEval {
        let coat = &self.coat;
        let (coat_o, coat_i) = (coat.albedo(o), coat.albedo(i));
        let probability = self.coat_probability(coat_o);
        let cosine_pdf = FRAC_1_PI * i.z;
        let value = self.base([coat_o, coat_i], cosine_pdf);
        let pdf = (1.0 - probability) * cosine_pdf;
        if coat.is_smooth() {
            return BsdfEval { value, pdf };
        }
        let (reflected, density) = coat.eval(o, i);
        BsdfEval { value: value + Rgb::splat(reflected), pdf: pdf + probability * density }
    }

    /// What the base scatters below a coat with these albedos.
    #[inline]
    fn base(&self, [coat_o, coat_i]: [f32; 2], cosine_pdf: f32) -> Rgb {
        self.diffuse * ((1.0 - coat_o) * (1.0 - coat_i) * self.coat.inverse_transmittance() * cosine_pdf)
    }

    /// As [`Bsdf::diffuse_fraction`](super::Bsdf::diffuse_fraction).
    pub fn diffuse_fraction(&self, wo: Vec3, wi: Vec3) -> Rgb {
        let (o, i) = (vec3(wo.x, wo.y, wo.z.abs()), vec3(wi.x, wi.y, wi.z.abs()));
        if self.coat.is_smooth() {
            return Rgb::WHITE;
        }
        share(self.base([self.coat.albedo(o), self.coat.albedo(i)], FRAC_1_PI * i.z), self.eval_upper(o, i).value)
    }

    /// A direction from the coat or the base, chosen by what they scatter.
    #[inline]
    pub fn sample(&self, wo: Vec3, u_lobe: f32, u: [f32; 2]) -> Option<BsdfSample> {
        if wo.z.abs() <= MIN_COSINE {
            return None;
        }
        let coat = &self.coat;
        let o = vec3(wo.x, wo.y, wo.z.abs());
        let coat_albedo = coat.albedo(o);
        let probability = self.coat_probability(coat_albedo);
        let i = if u_lobe < probability {
            if coat.is_smooth() {
                return Some(Coat::mirrored(wo, coat_albedo, probability));
            }
            coat.sample(o, u)
        } else {
            warp::cosine_hemisphere(u)
        };
        if i.z <= 0.0 {
            return None;
        }
        self.eval_upper(o, i).sampled(vec3(i.x, i.y, i.z.copysign(wo.z)))
    }

    /// Whether the coat is rougher along one tangent than along the other.
    pub fn is_anisotropic(&self) -> bool {
        self.coat.is_anisotropic()
    }

    /// Never: the base is diffuse.
    #[inline]
    pub fn is_delta(&self) -> bool {
        false
    }

    /// What coat and base reflect together.
    pub fn albedo(&self, wo: Vec3) -> Rgb {
        let coat = self.coat.albedo(vec3(wo.x, wo.y, wo.z.abs()));
        Rgb::splat(coat) + self.diffuse * (1.0 - coat)
    }
}
