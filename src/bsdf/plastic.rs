//! A diffuse base under a clear dielectric coat.
//!
//! With `T(w)` the fraction of the light from `w` that the coat lets through, `R` what it reflects back down of diffuse light below it, and `r` the
//! colour of the base,
//!
//! ```text
//! f = coat + T(wo) T(wi) / (eta² (1 - r' R)) r / pi
//! ```
//!
//! where `r'` is `r` if the base is nonlinear: its colour deepens each time that light is thrown back. Otherwise `r'` is 1: the light keeps the colour
//! of one scattering. For a smooth coat these are the formulas of Mitsuba's `plastic`. A rough coat that loses nothing has `T = 1 - E`, with
//! `E` the single-scattering albedo of its microfacets, and `eta² (1 - R)` is then `1 - E_avg`, with `E_avg` the mean of `E` under diffuse light. A
//! white base loses nothing, whatever the coat (for an anisotropic one `E` between its axes is approximate: within a hundredth or two unless
//! its alphas differ more than four times), and the base is reciprocal (Kelemen and Szirmay-Kalos, "A Microfacet Based Coupled
//! Specular-Matte BRDF Model with Importance Sampling").

use std::f32::consts::FRAC_1_PI;

use super::microfacet::{MIN_COSINE, Microfacets};
use super::split::share;
use super::{BsdfEval, BsdfSample, Coat, Ggx};
use crate::color::Rgb;
use crate::math::{Vec3, vec3};
use crate::sampling::warp;

/// A diffuse base under a clear coat, on both sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plastic<D = Ggx> {
    /// Colour of the base, each channel within `[0, 1]`.
    pub diffuse: Rgb,
    /// The coat.
    pub coat: Coat<D>,
    /// Factor on what the coat reflects, each channel within `[0, 1]`.
    pub tint: Rgb,
    /// Whether the base's colour deepens each time that the coat throws light back.
    pub nonlinear: bool,
}

impl Plastic {
    /// A base of colour `diffuse` under a coat with index of refraction `ior` over the outside, at least 1; smooth where
    /// [`Ggx::new`](super::Ggx::new) says so. A rough coat costs some milliseconds here.
    pub fn new(diffuse: Rgb, ior: f32, alpha: [f32; 2]) -> Self {
        Self { diffuse, coat: Coat::new(ior, alpha), tint: Rgb::WHITE, nonlinear: false }
    }
}

impl<D: Microfacets> Plastic<D> {
    /// Probability of choosing the coat: by what the lobes scatter.
    #[inline]
    fn coat_probability(&self, coat_albedo: f32) -> f32 {
        let base = (1.0 - coat_albedo) * self.diffuse.mean();
        let coat = coat_albedo * self.tint.mean();
        let sum = coat + base;
        if sum > 0.0 { coat / sum } else { 0.0 }
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
        BsdfEval { value: value + self.tint * reflected, pdf: pdf + probability * density }
    }

    /// What the base scatters below a coat with these albedos.
    #[inline]
    fn base(&self, [coat_o, coat_i]: [f32; 2], cosine_pdf: f32) -> Rgb {
        let through = (1.0 - coat_o) * (1.0 - coat_i) * cosine_pdf;
        if self.nonlinear {
            return self.diffuse.map(|r| r * (through * self.coat.interreflection(r)));
        }
        self.diffuse * (through * self.coat.interreflection(1.0))
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
                return Some(BsdfSample::mirrored(wo, self.tint * (coat_albedo / probability), probability));
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
        self.tint * coat + self.diffuse * (1.0 - coat)
    }
}
