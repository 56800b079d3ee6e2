//! A diffuse base under a clear dielectric coat.
//!
//! With `T(w)` the fraction of the light from `w` that the coat lets through, `R` what it reflects back down of diffuse
//! light below it, and `r` the colour of the base,
//!
//! ```text
//! f = coat + T(wo) T(wi) / (eta² (1 - r' R)) r / pi
//! ```
//!
//! where `r'` is `r` if the base is nonlinear: its colour deepens each time that light is thrown back. Otherwise `r'`
//! is 1: the light keeps the colour of one scattering. For a smooth coat these are the formulas of Mitsuba's `plastic`.
//! A rough coat that loses nothing has `T = 1 - E`, with `E` the single-scattering albedo of its microfacets, and `eta²
//! (1 - R)` is then `1 - E_avg`, with `E_avg` the mean of `E` under diffuse light. A white base loses nothing, whatever
//! the coat (for an anisotropic one `E` between its axes is approximate: within a hundredth or two unless its alphas
//! differ more than four times), and the base is reciprocal (Kelemen and Szirmay-Kalos, "A Microfacet Based Coupled
//! Specular-Matte BRDF Model with Importance Sampling").

use std::f32::consts::FRAC_1_PI;

use super::microfacet::{MIN_COSINE, Microfacets};
use super::rows::LaneBsdf;
use super::split::share;
use super::{BsdfEval, BsdfFlags, BsdfSample, Coat, Ggx};
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
    /// A base of colour `diffuse` under a coat with index of refraction `ior` over the outside, at least 1; smooth
    /// where [`Ggx::new`](super::Ggx::new) says so. A rough coat costs some milliseconds here.
    pub fn new(diffuse: Rgb, ior: f32, alpha: [f32; 2]) -> Self {
        Self { diffuse, coat: Coat::new(ior, alpha), tint: Rgb::WHITE, nonlinear: false }
    }
}

impl<D: Microfacets> Plastic<D> {
    #[inline(always)]
    pub(super) fn layers(&self) -> PlasticLayers<'_, D> {
        PlasticLayers { diffuse: self.diffuse, tint: self.tint, nonlinear: self.nonlinear, coat: &self.coat }
    }

    /// Base and rough coat for directions on the same side.
    #[inline]
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> BsdfEval {
        match (self.coat.is_smooth(), self.coat.flags().is_anisotropic()) {
            (true, _) => SmoothPlastic(self.layers()).eval(wo, wi),
            (false, false) => IsotropicPlastic(self.layers()).eval(wo, wi),
            (false, true) => self.layers().eval_with::<false>(wo, wi, |w| self.coat.albedo(w)),
        }
    }

    /// A direction from the coat or the base, chosen by what they scatter.
    #[inline]
    pub fn sample(&self, wo: Vec3, u_lobe: f32, u: [f32; 2]) -> Option<BsdfSample> {
        match (self.coat.is_smooth(), self.coat.flags().is_anisotropic()) {
            (true, _) => SmoothPlastic(self.layers()).sample(wo, u_lobe, u),
            (false, false) => IsotropicPlastic(self.layers()).sample(wo, u_lobe, u),
            (false, true) => self.layers().sample_with::<false>(wo, u_lobe, u, |w| self.coat.albedo(w)),
        }
    }

    /// As [`Bsdf::diffuse_fraction`](super::Bsdf::diffuse_fraction).
    pub fn diffuse_fraction(&self, wo: Vec3, wi: Vec3) -> Rgb {
        let (o, i) = (upper(wo), upper(wi));
        if self.coat.is_smooth() {
            return Rgb::WHITE;
        }
        let (layers, albedo) = (self.layers(), |w| self.coat.albedo(w));
        share(layers.base([albedo(o), albedo(i)], FRAC_1_PI * i.z), layers.eval_upper::<false>(o, i, albedo).value)
    }

    /// The lobes.
    #[inline]
    pub fn flags(&self) -> BsdfFlags {
        BsdfFlags::DIFFUSE | self.coat.flags()
    }

    /// What coat and base reflect together.
    pub fn albedo(&self, wo: Vec3) -> Rgb {
        let coat = self.coat.albedo(upper(wo));
        self.tint * coat + self.diffuse * (1.0 - coat)
    }
}

/// Plastic apart from its coat, which many points of a surface share.
#[derive(Clone, Copy)]
pub(super) struct PlasticLayers<'a, D> {
    pub diffuse: Rgb,
    pub tint: Rgb,
    pub nonlinear: bool,
    pub coat: &'a Coat<D>,
}

impl<D: Microfacets> PlasticLayers<'_, D> {
    /// [`Plastic::eval`] where it is known whether the coat is smooth, with its albedo.
    #[inline(always)]
    fn eval_with<const SMOOTH: bool>(&self, wo: Vec3, wi: Vec3, albedo: impl Fn(Vec3) -> f32) -> BsdfEval {
        let eval = self.eval_upper::<SMOOTH>(upper(wo), upper(wi), albedo);
        if wo.z * wi.z > 0.0 { eval } else { BsdfEval::default() }
    }

    #[inline(always)]
    fn eval_upper<const SMOOTH: bool>(&self, o: Vec3, i: Vec3, albedo: impl Fn(Vec3) -> f32) -> BsdfEval {
        let (coat_o, coat_i) = (albedo(o), albedo(i));
        let probability = self.coat_probability(coat_o);
        let cosine_pdf = FRAC_1_PI * i.z;
        let value = self.base([coat_o, coat_i], cosine_pdf);
        let pdf = (1.0 - probability) * cosine_pdf;
        if SMOOTH {
            return BsdfEval { value, pdf };
        }
        let (reflected, density) = self.coat.eval(o, i);
        BsdfEval { value: value + self.tint * reflected, pdf: pdf + probability * density }
    }

    /// [`Plastic::sample`] where it is known whether the coat is smooth, with its albedo.
    #[inline(always)]
    fn sample_with<const SMOOTH: bool>(
        &self,
        wo: Vec3,
        u_lobe: f32,
        u: [f32; 2],
        albedo: impl Fn(Vec3) -> f32 + Copy,
    ) -> Option<BsdfSample> {
        let o = upper(wo);
        let coat_albedo = albedo(o);
        let probability = self.coat_probability(coat_albedo);
        let is_coat = u_lobe < probability;
        let from_base = warp::cosine_hemisphere(u);
        let i = if SMOOTH || !is_coat { from_base } else { self.coat.sample(o, u) };
        let eval = self.eval_upper::<SMOOTH>(o, i, albedo);
        let sample = eval.sampled(vec3(i.x, i.y, i.z.copysign(wo.z))).filter(|_| i.z > 0.0);
        let mirrored = BsdfSample::mirrored(wo, self.tint * (coat_albedo / probability), probability);
        let sample = if SMOOTH && is_coat { Some(mirrored) } else { sample };
        sample.filter(|_| wo.z.abs() > MIN_COSINE)
    }

    /// Probability of choosing the coat: by what the lobes scatter.
    #[inline(always)]
    fn coat_probability(&self, coat_albedo: f32) -> f32 {
        let base = (1.0 - coat_albedo) * self.diffuse.mean();
        let coat = coat_albedo * self.tint.mean();
        let sum = coat + base;
        if sum > 0.0 { coat / sum } else { 0.0 }
    }

    /// What the base scatters below a coat with these albedos.
    #[inline(always)]
    fn base(&self, [coat_o, coat_i]: [f32; 2], cosine_pdf: f32) -> Rgb {
        let through = (1.0 - coat_o) * (1.0 - coat_i) * cosine_pdf;
        if self.nonlinear {
            return self.diffuse.map(|r| r * (through * self.coat.interreflection(r)));
        }
        self.diffuse * (through * self.coat.interreflection(1.0))
    }
}

/// The same direction on the upper side.
#[inline(always)]
fn upper(w: Vec3) -> Vec3 {
    vec3(w.x, w.y, w.z.abs())
}

/// Plastic with a smooth coat, for vector code.
#[derive(Clone, Copy)]
pub(super) struct SmoothPlastic<'a, D>(pub PlasticLayers<'a, D>);

impl<D: Microfacets> LaneBsdf for SmoothPlastic<'_, D> {
    #[inline(always)]
    fn eval(&self, wo: Vec3, wi: Vec3) -> BsdfEval {
        self.0.eval_with::<true>(wo, wi, |w| self.0.coat.smooth_albedo(w))
    }

    #[inline(always)]
    fn sample(&self, wo: Vec3, u_lobe: f32, u: [f32; 2]) -> Option<BsdfSample> {
        self.0.sample_with::<true>(wo, u_lobe, u, |w| self.0.coat.smooth_albedo(w))
    }
}

/// Plastic with a rough isotropic coat, for vector code.
#[derive(Clone, Copy)]
pub(super) struct IsotropicPlastic<'a, D>(pub PlasticLayers<'a, D>);

impl<D: Microfacets> LaneBsdf for IsotropicPlastic<'_, D> {
    #[inline(always)]
    fn eval(&self, wo: Vec3, wi: Vec3) -> BsdfEval {
        self.0.eval_with::<false>(wo, wi, |w| self.0.coat.isotropic_albedo(w))
    }

    #[inline(always)]
    fn sample(&self, wo: Vec3, u_lobe: f32, u: [f32; 2]) -> Option<BsdfSample> {
        self.0.sample_with::<false>(wo, u_lobe, u, |w| self.0.coat.isotropic_albedo(w))
    }
}
