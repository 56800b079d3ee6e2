//! Metals: reflection with the exact Fresnel equations of a complex index of refraction, by a plane or by microfacets;
//! light that meets several GGX microfacets comes back as the lobe of [`energy`](super::energy), coloured by as many
//! reflections.

use std::f32::consts::{FRAC_1_PI, PI};

use super::energy::{Energy, multiple_color};
use super::fresnel::ComplexIndex;
use super::microfacet::{MIN_COSINE, Microfacets, reflect};
use super::rows::LaneBsdf;
use super::{BsdfEval, BsdfFlags, BsdfSample, Ggx};
use crate::color::Rgb;
use crate::math::{Vec3, vec3};
use crate::sampling::warp;

/// A metal on both sides, with microfacets distributed by `D`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conductor<D = Ggx> {
    index: [ComplexIndex; 3],
    tint: Rgb,
    facets: D,
    /// Reflectance under diffuse light without the tint.
    average: Rgb,
    /// Colour of light scattered several times, over `pi (1 - E_avg)`.
    multiple: Rgb,
    /// Mean of that colour over the mean reflectance; zero for single scattering.
    share: f32,
}

impl Conductor<Ggx> {
    /// A metal with index of refraction `eta + i k` relative to the outside; smooth where [`Ggx::new`] says so. `tint`
    /// multiplies the reflectance.
    pub fn new(eta: Rgb, k: Rgb, alpha: [f32; 2], tint: Rgb) -> Self {
        let index = [ComplexIndex::new(eta.r, k.r), ComplexIndex::new(eta.g, k.g), ComplexIndex::new(eta.b, k.b)];
        let average = Rgb::from(index.map(ComplexIndex::average));
        let metal = Self { index, tint, facets: Ggx::new(alpha), average, multiple: Rgb::BLACK, share: 0.0 };
        metal.with_multiple_scattering()
    }

    /// Without the light that microfacets scatter several times.
    #[must_use]
    pub fn single_scattering(self) -> Self {
        Self { multiple: Rgb::BLACK, share: 0.0, ..self }
    }

    fn with_multiple_scattering(self) -> Self {
        let average = self.tint * self.average;
        if self.facets.is_smooth() || average.is_black() {
            return self;
        }
        let missing_energy = Energy::new(&self.facets).average_missing_energy();
        let color = average.map(|f| multiple_color(f, 1.0 - missing_energy));
        Self { multiple: color / (PI * missing_energy), share: color.mean() / average.mean(), ..self }
    }

    /// The same metal with other roughness and tint.
    #[must_use]
    pub fn with_surface(self, alpha: [f32; 2], tint: Rgb) -> Self {
        Self { tint, facets: Ggx::new(alpha), ..self.single_scattering() }.with_multiple_scattering()
    }

    /// The same metal with another roughness.
    #[must_use]
    pub(super) fn with_alpha(&self, alpha: [f32; 2]) -> Self {
        if self.share > 0.0 { self.with_surface(alpha, self.tint) } else { self.with_single_scattering_alpha(alpha) }
    }

    /// The same metal with other microfacets and tint, and without multiple scattering.
    #[must_use]
    pub fn with_facets<D>(self, facets: D, tint: Rgb) -> Conductor<D> {
        let Self { index, average, .. } = self;
        Conductor { index, tint, facets, average, multiple: Rgb::BLACK, share: 0.0 }
    }
}

impl<D: Microfacets> Conductor<D> {
    /// With another roughness, for single scattering.
    pub(super) fn with_single_scattering_alpha(&self, alpha: [f32; 2]) -> Self {
        Self { facets: D::with_alpha(alpha), ..*self }
    }

    #[inline(always)]
    fn reflectance(&self, cos: f32) -> Rgb {
        let [r, g, b] = &self.index;
        self.tint * Rgb::new(r.reflectance(cos), g.reflectance(cos), b.reflectance(cos))
    }

    /// Probability of sampling light scattered several times, for what microfacets scatter at once.
    #[inline(always)]
    fn multiple_probability(&self, directional_albedo: f32) -> f32 {
        let multiple = self.share * (1.0 - directional_albedo);
        multiple / (directional_albedo + multiple)
    }

    /// `F D G2 / (4 |cos wo|)` and light scattered several times for directions on the same side of a rough metal, zero
    /// for a smooth one.
    #[inline]
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> BsdfEval {
        match self.scattering() {
            Scattering::Smooth => BsdfEval::default(),
            Scattering::Single => SingleScattering(self).eval(wo, wi),
            Scattering::Multiple { isotropic: true } => MultipleScattering::<D, true>(self).eval(wo, wi),
            Scattering::Multiple { isotropic: false } => MultipleScattering::<D, false>(self).eval(wo, wi),
        }
    }

    /// A reflection at a visible normal, or by the cosine for light scattered several times.
    #[inline]
    pub fn sample(&self, wo: Vec3, u_lobe: f32, u: [f32; 2]) -> Option<BsdfSample> {
        match self.scattering() {
            Scattering::Smooth if wo.z.abs() <= MIN_COSINE => None,
            Scattering::Smooth => Some(BsdfSample::mirrored(wo, self.reflectance(wo.z.abs().min(1.0)), 1.0)),
            Scattering::Single => SingleScattering(self).sample(wo, u_lobe, u),
            Scattering::Multiple { isotropic: true } => MultipleScattering::<D, true>(self).sample(wo, u_lobe, u),
            Scattering::Multiple { isotropic: false } => MultipleScattering::<D, false>(self).sample(wo, u_lobe, u),
        }
    }

    /// What happens to light at the metal.
    #[inline(always)]
    pub(super) fn scattering(&self) -> Scattering {
        let [ax, ay] = self.facets.alpha();
        if self.facets.is_smooth() {
            Scattering::Smooth
        } else if self.share == 0.0 {
            Scattering::Single
        } else {
            Scattering::Multiple { isotropic: ax == ay }
        }
    }

    /// Alpha along both tangents.
    pub fn alpha(&self) -> [f32; 2] {
        self.facets.alpha()
    }

    /// The lobes.
    #[inline]
    pub fn flags(&self) -> BsdfFlags {
        self.facets.flags() | BsdfFlags::REFLECTION
    }

    /// The reflectance of the plane.
    pub fn albedo(&self, wo: Vec3) -> Rgb {
        self.reflectance(wo.z.abs().min(1.0))
    }
}

/// How a metal scatters light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scattering {
    /// A plane mirror.
    Smooth,
    /// A reflection at one microfacet.
    Single,
    /// Reflections at one and at several microfacets.
    Multiple { isotropic: bool },
}

/// A rough metal without multiple scattering, for vector code.
#[derive(Clone, Copy)]
pub(super) struct SingleScattering<'a, D>(pub &'a Conductor<D>);

impl<D: Microfacets> LaneBsdf for SingleScattering<'_, D> {
    #[inline(always)]
    fn eval(&self, wo: Vec3, wi: Vec3) -> BsdfEval {
        let metal = self.0;
        let facet = metal.facets.reflection(upper(wo), upper(wi));
        let eval = BsdfEval { value: metal.reflectance(facet.cos) * facet.value, pdf: facet.pdf };
        if wo.z * wi.z > 0.0 { eval } else { BsdfEval::default() }
    }

    #[inline(always)]
    fn sample(&self, wo: Vec3, _u_lobe: f32, u: [f32; 2]) -> Option<BsdfSample> {
        let metal = self.0;
        let o = upper(wo);
        let m = metal.facets.sample_visible_normal(o, u);
        let cos = o.dot(m);
        let mut wi = reflect(o, m, cos);
        let is_valid = (o.z > MIN_COSINE) & (cos > 0.0) & (wi.z > 0.0);
        let weight = metal.reflectance(cos.min(1.0)) * metal.facets.g2_over_g1(o, wi);
        let pdf = metal.facets.reflection_pdf(o, m);
        wi.z = wi.z.copysign(wo.z);
        is_valid.then_some(BsdfSample { wi, weight, pdf, is_delta: false, is_transmission: false, eta: 1.0 })
    }
}

/// A rough metal with multiple scattering, for vector code if it is isotropic.
#[derive(Clone, Copy)]
pub(super) struct MultipleScattering<'a, D, const ISOTROPIC: bool>(pub &'a Conductor<D>);

impl<D: Microfacets, const ISOTROPIC: bool> MultipleScattering<'_, D, ISOTROPIC> {
    /// Directional albedo of perfectly reflecting microfacets.
    #[inline(always)]
    fn directional_albedo(&self, w: Vec3) -> f32 {
        // A closure might not be inlined into vector code.
        match self.0.facets.energy::<ISOTROPIC>() {
            Some(energy) => energy.directional_albedo(w),
            None => 1.0,
        }
    }

    /// For directions on the upper side and the albedo for `o`.
    #[inline(always)]
    fn eval_upper(&self, o: Vec3, i: Vec3, directional_albedo: f32) -> BsdfEval {
        let metal = self.0;
        let facet = metal.facets.reflection(o, i);
        let probability = metal.multiple_probability(directional_albedo);
        let missing_energy = (1.0 - directional_albedo) * (1.0 - self.directional_albedo(i));
        BsdfEval {
            value: metal.reflectance(facet.cos) * facet.value + metal.multiple * (missing_energy * i.z),
            pdf: (1.0 - probability) * facet.pdf + probability * FRAC_1_PI * i.z,
        }
    }
}

impl<D: Microfacets, const ISOTROPIC: bool> LaneBsdf for MultipleScattering<'_, D, ISOTROPIC> {
    #[inline(always)]
    fn eval(&self, wo: Vec3, wi: Vec3) -> BsdfEval {
        let o = upper(wo);
        let eval = self.eval_upper(o, upper(wi), self.directional_albedo(o));
        if wo.z * wi.z > 0.0 { eval } else { BsdfEval::default() }
    }

    #[inline(always)]
    fn sample(&self, wo: Vec3, u_lobe: f32, u: [f32; 2]) -> Option<BsdfSample> {
        let metal = self.0;
        let o = upper(wo);
        let directional_albedo = self.directional_albedo(o);
        let is_multiple = u_lobe < metal.multiple_probability(directional_albedo);
        let m = metal.facets.sample_visible_normal(o, u);
        let cos = o.dot(m);
        let reflected = reflect(o, m, cos);
        let i = if is_multiple { warp::cosine_hemisphere(u) } else { reflected };
        let is_valid = (o.z > MIN_COSINE) & (is_multiple | (cos > 0.0)) & (i.z > 0.0);
        let sample = self.eval_upper(o, i, directional_albedo).sampled(vec3(i.x, i.y, i.z.copysign(wo.z)));
        sample.filter(|_| is_valid)
    }
}

/// The same direction on the upper side.
#[inline(always)]
fn upper(w: Vec3) -> Vec3 {
    vec3(w.x, w.y, w.z.abs())
}
