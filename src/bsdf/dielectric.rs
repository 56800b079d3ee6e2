//! Glass, water and the like: reflection and refraction with the exact Fresnel equations, by a plane or by microfacets
//! (Walter et al., "Microfacet Models for Refraction through Rough Surfaces").
//!
//! Values are for radiance carried towards `wo`: what is refracted carries `1 / eta²`, with `eta` the index of
//! refraction on the side of `wi` over that on the side of `wo`. With the unnormalised half vector `h = wo + eta wi`,
//! which points from the optically thinner side to the denser one or back, `wo·m + eta wi·m = ±|h|`, and
//!
//! ```text
//! value = (1 - F) D G2 |wo·m| |wi·m| / (|cos wo| |h|²)
//! pdf   = (1 - F) (visible normals) eta² |wi·m| / |h|²
//! ```
//!
//! What GGX microfacets lose is shared out to both sides by two lobes as in [`energy`](super::energy): with `L` what is
//! lost of diffuse light from each side and `F` the mean reflectance from the thinner one, `(1 - F) min(L, L') / L` of
//! what is lost on the thinner side crosses, and `1 / ior²` times that with `L'` on the denser one, so that nothing is
//! lost and what crosses is reciprocal. What anisotropic microfacets lose is not known closely enough, and stays lost.
//!
//! Reflection and refraction by GGX microfacets share the height-correlated G2, as in Pharr, Jakob and Humphreys,
//! "Physically Based Rendering", 4th edition.

use std::f32::consts::FRAC_1_PI;

use super::energy::Energy;
use super::fresnel;
use super::microfacet::{MIN_COSINE, Microfacets, clamp_alpha, reflect};
use super::rows::LaneBsdf;
use super::{BsdfEval, BsdfFlags, BsdfSample, Ggx};
use crate::color::Rgb;
use crate::math::float::ONE_MINUS_EPSILON;
use crate::math::{Vec3, vec3};
use crate::sampling::warp;

/// A boundary between two clear media, with microfacets distributed by `D`. The outside is where the normal points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dielectric<D = Ggx> {
    /// Index of refraction of the inside over that of the outside.
    ior: f32,
    facets: D,
    /// What microfacets lose, for light from outside and from inside; `None` if it stays lost.
    multiple: Option<[Multiple; 2]>,
    /// Factors on what is reflected and on what crosses.
    tints: [Rgb; 2],
}

/// The tints of clear glass.
const CLEAR: [Rgb; 2] = [Rgb::WHITE; 2];

/// Light from one side that is scattered several times.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Multiple {
    /// What is lost of diffuse light from this side.
    missing_energy: f32,
    /// How much of it crosses.
    crossing: f32,
}

/// What is lost and where it goes, for light from outside and from inside.
fn multiple_scattering(ior: f32, ggx: &Ggx) -> [Multiple; 2] {
    let energy = Energy::new(ggx);
    let [outside, inside] = [ior, 1.0 / ior].map(|eta| energy.dielectric_average_missing_energy(eta));
    let dense = ior.max(1.0 / ior);
    // Kulla and Conty's fit of the mean reflectance.
    let transmitted = 1.0 - (dense - 1.0) / (4.085_67 + 1.000_71 * dense);
    let common = transmitted * outside.min(inside);
    let [from_outside, from_inside] = if ior >= 1.0 { [1.0, dense * dense] } else { [dense * dense, 1.0] };
    [
        Multiple { missing_energy: outside, crossing: common / (outside * from_outside) },
        Multiple { missing_energy: inside, crossing: common / (inside * from_inside) },
    ]
}

/// Alpha as a boundary with this relative index of refraction uses it, zero for a smooth one. Since refraction turns
/// directions by about `|ior - 1|` times the slope, that also multiplies alpha before it is compared with the limit.
fn clamp_alpha_for_ior(ior: f32, alpha: [f32; 2]) -> [f32; 2] {
    let turn = (ior - 1.0).abs().min(1.0);
    let is_smooth = clamp_alpha(alpha.map(|a| a * turn))[0] == 0.0;
    if is_smooth { [0.0; 2] } else { alpha }
}

impl Dielectric<Ggx> {
    /// A boundary with the index of refraction `ior` inside over outside, positive; smooth where the rays that cross it
    /// would hardly show its roughness.
    pub fn new(ior: f32, alpha: [f32; 2]) -> Self {
        let ggx = Ggx::new(clamp_alpha_for_ior(ior, alpha));
        if ggx.is_smooth() {
            Self { ior, facets: ggx, multiple: None, tints: CLEAR }
        } else {
            Self::rough(ior, ggx, true)
        }
    }

    /// A boundary of which the caller knows that it is rough.
    #[inline]
    pub(super) fn rough(ior: f32, ggx: Ggx, multiscatter: bool) -> Self {
        let [ax, ay] = ggx.alpha();
        let is_known = multiscatter && ax == ay;
        Self { ior, facets: ggx, multiple: is_known.then(|| multiple_scattering(ior, &ggx)), tints: CLEAR }
    }

    /// The same glass with another roughness.
    pub(super) fn with_alpha(&self, alpha: [f32; 2]) -> Self {
        Self { tints: self.tints, ..Self::rough(self.ior, Ggx::new(alpha), self.multiple.is_some()) }
    }

    /// Without the light that microfacets scatter several times.
    #[must_use]
    pub fn single_scattering(self) -> Self {
        Self { multiple: None, ..self }
    }
}

impl<D: Microfacets> Dielectric<D> {
    /// As [`Dielectric::new`], with the microfacets that `facets` makes of an alpha, and without multiple scattering.
    pub fn with_facets(ior: f32, alpha: [f32; 2], facets: impl FnOnce([f32; 2]) -> D) -> Self {
        Self { ior, facets: facets(clamp_alpha_for_ior(ior, alpha)), multiple: None, tints: CLEAR }
    }

    /// With another roughness, for single scattering.
    pub(super) fn with_single_scattering_alpha(&self, alpha: [f32; 2]) -> Self {
        Self { facets: D::with_alpha(alpha), ..*self }
    }

    /// Alpha along both tangents.
    pub fn alpha(&self) -> [f32; 2] {
        self.facets.alpha()
    }

    /// With factors within `[0, 1]` on what is reflected and on what crosses.
    #[must_use]
    pub fn tinted(self, reflection: Rgb, transmission: Rgb) -> Self {
        Self { tints: [reflection, transmission], ..self }
    }

    /// The factor on what is reflected, or on what crosses.
    #[inline(always)]
    fn tint(&self, is_transmission: bool) -> Rgb {
        let [reflection, transmission] = self.tints;
        if is_transmission { transmission } else { reflection }
    }

    /// Index of refraction beyond the surface over that on the side of `wo`.
    #[inline(always)]
    fn eta(&self, wo: Vec3) -> f32 {
        if wo.z > 0.0 { self.ior } else { 1.0 / self.ior }
    }

    /// Reflection or refraction by microfacets, zero for a smooth boundary.
    #[inline]
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> BsdfEval {
        match (self.facets.is_smooth(), &self.multiple) {
            (true, _) => BsdfEval::default(),
            (false, None) => SingleScattering(self).eval(wo, wi),
            (false, Some(multiple)) => MultipleScattering { bsdf: self, multiple }.eval(wo, wi),
        }
    }

    /// Reflection if `u_lobe` is below the reflectance, else refraction.
    #[inline]
    pub fn sample(&self, wo: Vec3, u_lobe: f32, u: [f32; 2]) -> Option<BsdfSample> {
        match (self.facets.is_smooth(), &self.multiple) {
            (true, _) => Smooth(self).sample(wo, u_lobe, u),
            (false, None) => SingleScattering(self).sample(wo, u_lobe, u),
            (false, Some(multiple)) => MultipleScattering { bsdf: self, multiple }.sample(wo, u_lobe, u),
        }
    }

    /// One encounter with a microfacet, without the tints; `o` on the upper side.
    #[inline(always)]
    fn eval_once(&self, o: Vec3, i: Vec3, eta: f32) -> BsdfEval {
        let (reflection, refraction) = (self.eval_reflection(o, i, eta), self.eval_refraction(o, i, eta));
        if i.z > 0.0 { reflection } else { refraction }
    }

    /// Reflection of `i` towards `o`, both on the upper side.
    #[inline(always)]
    fn eval_reflection(&self, o: Vec3, i: Vec3, eta: f32) -> BsdfEval {
        let facet = self.facets.reflection(o, i);
        let reflectance = fresnel::dielectric(facet.cos, eta).reflectance;
        BsdfEval { value: Rgb::splat(reflectance * facet.value), pdf: reflectance * facet.pdf }
    }

    /// Refraction from `i`, on the lower side, towards `o`, on the upper one.
    #[inline(always)]
    fn eval_refraction(&self, o: Vec3, i: Vec3, eta: f32) -> BsdfEval {
        let half = o + i * eta;
        let half = if half.z < 0.0 { -half } else { half };
        let length_squared = half.length_squared();
        // The microfacet must be seen from above by `o` and from below by `i`.
        let scale = 1.0 / length_squared.sqrt();
        let (cos_o, cos_i) = (o.dot(half) * scale, -i.dot(half) * scale);
        let is_valid = (length_squared > 0.0) & (cos_o > 0.0) & (cos_i > 0.0);
        // The cosine of refraction is known: recomputing it by Snell's law would lose its digits near the critical
        // angle.
        let transmittance = 1.0 - fresnel::dielectric_reflectance(cos_o, cos_i, eta);
        let common = 2.0 * transmittance * self.facets.normal_density(half) * cos_o * cos_i / length_squared;
        let (value, pdf) = self.facets.refraction(o, vec3(i.x, i.y, -i.z), common);
        if is_valid { BsdfEval { value: Rgb::splat(value), pdf: pdf * eta * eta } } else { BsdfEval::default() }
    }

    /// One encounter with a microfacet.
    #[inline(always)]
    fn sample_once(&self, wo: Vec3, u_lobe: f32, u: [f32; 2]) -> Option<BsdfSample> {
        let eta = self.eta(wo);
        let o = vec3(wo.x, wo.y, wo.z.abs());
        let m = self.facets.sample_visible_normal(o, u);
        let cos = o.dot(m).min(1.0);
        let refraction = fresnel::dielectric(cos, eta);
        let is_transmission = u_lobe >= refraction.reflectance;
        let (reflected, refracted) = (reflect(o, m, cos), refract(o, m, cos, refraction.cos_t, eta));
        let mut wi = if is_transmission { refracted } else { reflected };
        let is_valid = (cos > 0.0) & if is_transmission { wi.z < 0.0 } else { wi.z > 0.0 };
        let shadowing = self.facets.g2_over_g1(o, vec3(wi.x, wi.y, wi.z.abs()));
        // |h| = |cos - eta cos_t|; the reflection's density has 1 / (4 cos) in it, which the Jacobian of refraction
        // replaces.
        let across = cos - eta * refraction.cos_t;
        let jacobian = eta * eta * refraction.cos_t / (across * across);
        let facet_pdf = self.facets.reflection_pdf(o, m);
        let pdf = if is_transmission {
            (1.0 - refraction.reflectance) * 4.0 * cos * facet_pdf * jacobian
        } else {
            refraction.reflectance * facet_pdf
        };
        let weight = if is_transmission { shadowing / (eta * eta) } else { shadowing };
        wi.z *= 1f32.copysign(wo.z);
        let eta = if is_transmission { eta } else { 1.0 };
        is_valid.then_some(BsdfSample { wi, weight: Rgb::splat(weight), pdf, is_delta: false, is_transmission, eta })
    }

    #[inline(always)]
    fn sample_smooth(&self, wo: Vec3, u_lobe: f32) -> BsdfSample {
        let eta = self.eta(wo);
        let refraction = fresnel::dielectric(wo.z.abs().min(1.0), eta);
        let scale = 1.0 / eta;
        let refracted = BsdfSample {
            wi: vec3(-wo.x * scale, -wo.y * scale, -refraction.cos_t.copysign(wo.z)),
            weight: Rgb::splat(scale * scale),
            pdf: 1.0 - refraction.reflectance,
            is_delta: true,
            is_transmission: true,
            eta,
        };
        // The choice is made with the reflectance itself, so that it cancels from the weight.
        let reflected = BsdfSample::mirrored(wo, Rgb::WHITE, refraction.reflectance);
        if u_lobe < refraction.reflectance { reflected } else { refracted }
    }

    /// A sample with the factor on what is reflected or crosses.
    #[inline(always)]
    fn tinted_sample(&self, sample: BsdfSample) -> BsdfSample {
        BsdfSample { weight: sample.weight * self.tint(sample.is_transmission), ..sample }
    }

    /// The light that microfacets scatter several times, where it is known.
    pub(super) fn multiple(&self) -> Option<&[Multiple; 2]> {
        self.multiple.as_ref()
    }

    /// The lobes.
    #[inline]
    pub fn flags(&self) -> BsdfFlags {
        self.facets.flags() | BsdfFlags::REFLECTION | BsdfFlags::TRANSMISSION
    }

    /// What a plane reflects and lets through.
    pub fn albedo(&self, wo: Vec3) -> Rgb {
        let reflected = fresnel::dielectric(wo.z.abs().min(1.0), self.eta(wo)).reflectance;
        self.tint(false) * reflected + self.tint(true) * (1.0 - reflected)
    }
}

/// The unit direction that `o` refracts to at the unit normal `m`, for the cosines on both sides.
#[inline(always)]
pub(super) fn refract(o: Vec3, m: Vec3, cos_o: f32, cos_t: f32, eta: f32) -> Vec3 {
    let scale = 1.0 / eta;
    m * (cos_o * scale - cos_t) - o * scale
}

/// A smooth boundary, for vector code.
#[derive(Clone, Copy)]
pub(super) struct Smooth<'a, D>(pub &'a Dielectric<D>);

impl<D: Microfacets> LaneBsdf for Smooth<'_, D> {
    #[inline(always)]
    fn eval(&self, _wo: Vec3, _wi: Vec3) -> BsdfEval {
        BsdfEval::default()
    }

    #[inline(always)]
    fn sample(&self, wo: Vec3, u_lobe: f32, _u: [f32; 2]) -> Option<BsdfSample> {
        let sample = self.0.tinted_sample(self.0.sample_smooth(wo, u_lobe));
        (wo.z.abs() > MIN_COSINE).then_some(sample)
    }
}

/// A rough boundary without multiple scattering, for vector code.
#[derive(Clone, Copy)]
pub(super) struct SingleScattering<'a, D>(pub &'a Dielectric<D>);

impl<D: Microfacets> LaneBsdf for SingleScattering<'_, D> {
    #[inline(always)]
    fn eval(&self, wo: Vec3, wi: Vec3) -> BsdfEval {
        let eta = self.0.eta(wo);
        let (o, i) = seen_from(wo, wi);
        let BsdfEval { value, pdf } = self.0.eval_once(o, i, eta);
        let eval = BsdfEval { value: value * self.0.tint(i.z < 0.0), pdf };
        if wo.z.abs().min(wi.z.abs()) > MIN_COSINE { eval } else { BsdfEval::default() }
    }

    #[inline(always)]
    fn sample(&self, wo: Vec3, u_lobe: f32, u: [f32; 2]) -> Option<BsdfSample> {
        let sample = self.0.sample_once(wo, u_lobe, u).map(|sample| self.0.tinted_sample(sample));
        sample.filter(|_| wo.z.abs() > MIN_COSINE)
    }
}

/// A rough boundary with multiple scattering, for vector code.
#[derive(Clone, Copy)]
pub(super) struct MultipleScattering<'a, D> {
    pub bsdf: &'a Dielectric<D>,
    pub multiple: &'a [Multiple; 2],
}

impl<D: Microfacets> MultipleScattering<'_, D> {
    /// Fraction of the light from the upper `w` that microfacets lose, for the index of refraction beyond them over
    /// that on its side.
    #[inline(always)]
    fn missing_energy(&self, eta: f32, w: Vec3) -> f32 {
        // A closure might not be inlined into vector code.
        match self.bsdf.facets.energy::<true>() {
            Some(energy) => (1.0 - energy.dielectric_albedo(eta, w)).clamp(0.0, 1.0),
            None => 0.0,
        }
    }

    /// Without the tints, for the energy that is missing of the light from `o`, on the upper side.
    #[inline(always)]
    fn eval_all(&self, wo: Vec3, o: Vec3, i: Vec3, eta: f32, missing_energy: f32) -> BsdfEval {
        let [outside, inside] = *self.multiple;
        let (near, far) = if wo.z > 0.0 { (outside, inside) } else { (inside, outside) };
        let once = self.bsdf.eval_once(o, i, eta);
        let cosine_pdf = FRAC_1_PI * i.z.abs();
        let is_reflection = i.z > 0.0;
        let fraction = if is_reflection { 1.0 - near.crossing } else { near.crossing };
        let missing = if is_reflection { near.missing_energy } else { far.missing_energy * eta * eta };
        let beyond = self.missing_energy(if is_reflection { eta } else { 1.0 / eta }, vec3(i.x, i.y, i.z.abs()));
        BsdfEval {
            value: once.value + Rgb::splat(fraction * missing_energy * beyond / missing * cosine_pdf),
            pdf: (1.0 - missing_energy) * once.pdf + missing_energy * fraction * cosine_pdf,
        }
    }
}

impl<D: Microfacets> LaneBsdf for MultipleScattering<'_, D> {
    #[inline(always)]
    fn eval(&self, wo: Vec3, wi: Vec3) -> BsdfEval {
        let eta = self.bsdf.eta(wo);
        let (o, i) = seen_from(wo, wi);
        let BsdfEval { value, pdf } = self.eval_all(wo, o, i, eta, self.missing_energy(eta, o));
        let eval = BsdfEval { value: value * self.bsdf.tint(i.z < 0.0), pdf };
        if wo.z.abs().min(wi.z.abs()) > MIN_COSINE { eval } else { BsdfEval::default() }
    }

    #[inline(always)]
    fn sample(&self, wo: Vec3, u_lobe: f32, u: [f32; 2]) -> Option<BsdfSample> {
        let (o, eta) = (vec3(wo.x, wo.y, wo.z.abs()), self.bsdf.eta(wo));
        let [outside, inside] = *self.multiple;
        let crossing = if wo.z > 0.0 { outside.crossing } else { inside.crossing };
        let missing_energy = self.missing_energy(eta, o);
        let side = 1f32.copysign(wo.z);
        let is_multiple = u_lobe < missing_energy;
        let i = warp::cosine_hemisphere(u);
        let diffuse = vec3(i.x, i.y, if u_lobe < missing_energy * crossing { -i.z } else { i.z } * side);
        let u_lobe = ((u_lobe - missing_energy) / (1.0 - missing_energy)).min(ONE_MINUS_EPSILON);
        let once = self.bsdf.sample_once(wo, u_lobe, u);
        let is_valid = (is_multiple | once.is_some()) & (wo.z.abs() > MIN_COSINE);
        let wi = match once {
            Some(sample) if !is_multiple => sample.wi,
            _ => diffuse,
        };
        let BsdfEval { value, pdf } = self.eval_all(wo, o, vec3(wi.x, wi.y, wi.z * side), eta, missing_energy);
        let is_transmission = wi.z * wo.z < 0.0;
        let eta = if is_transmission { eta } else { 1.0 };
        let sample = BsdfSample { wi, weight: value / pdf, pdf, is_delta: false, is_transmission, eta };
        (is_valid & (wi.z.abs() > MIN_COSINE) & (pdf > 0.0)).then_some(self.bsdf.tinted_sample(sample))
    }
}

/// Both directions, turned so that the first is on the upper side.
#[inline(always)]
fn seen_from(wo: Vec3, wi: Vec3) -> (Vec3, Vec3) {
    (vec3(wo.x, wo.y, wo.z.abs()), vec3(wi.x, wi.y, wi.z * 1f32.copysign(wo.z)))
}
