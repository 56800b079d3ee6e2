//! The principled model: one material for most surfaces, from a dozen parameters (Burley, "Physically Based Shading at
//! Disney"; Burley, "Extending the Disney BRDF to a BSDF with Integrated Subsurface Scattering").
//!
//! From the top: a clear coat; below it, shared out by `metallic` and `transmission`, a metal, a dielectric layer over
//! a diffuse base with sheen, and rough glass. As in the papers the lobes are added, but so a white surface might
//! reflect up to twice what it receives. A layer that reflects `E(w)` of the light from `w` over what would scatter
//! `A(w)` of it alone therefore leaves
//!
//! ```text
//! min(1, (1 - max(E(wo), E(wi))) / max(A(wo), A(wi)))
//! ```
//!
//! of what is below, in each channel: 1 wherever the sum is sound, reciprocal, and the whole never scatters more than
//! it receives, whatever the parameters. Other differences from the papers:
//!
//! - GGX masks with the height-correlated G2, and light scattered among microfacets several times is added back;
//! - alpha is `roughness²` stretched by the aspect, within `[0.001, 1]`, for distribution and masking alike;
//! - tints are the base colour over its largest channel in place of its luminance, so that no channel exceeds 1;
//! - subsurface scattering is the flat lobe of 2012 for solids as well, or light that enters, for a random walk; glass
//!   has exact Fresnel terms, all else Schlick's;
//! - the specular lobe that passes a thin sheet has the width of the one that it reflects.
//!
//! [`PrincipledModel::Mitsuba`] has the lobes of Mitsuba 3's `principled` and, for thin sheets of glass,
//! `principledthin`: added without limit, with exact Fresnel terms for the untinted layer, G as a product, no
//! compensation, tints over the luminance, and a clear coat that is larger by 4 cos cos.

mod corners;
mod glass;
mod parameters;
mod rows;
pub(super) mod shapes;
mod split;
mod walk;

use std::f32::consts::{FRAC_1_PI, PI};

use super::energy::{Energy, principled_clear_coat, principled_diffuse, principled_sheen, schlick_weight};
use super::microfacet::{FacetReflection, MIN_COSINE, Microfacets, SeparableGgx, reflect};
use super::{BsdfEval, BsdfFlags, BsdfSample, Ggx};
use crate::color::Rgb;
use crate::math::{Vec3, vec3};
use crate::sampling::warp;
pub use parameters::{PrincipledModel, PrincipledParameters};
use shapes::ClearCoat;

/// The least alpha: no lobe is a delta.
const MIN_ALPHA: f32 = 1e-3;

/// The least index of refraction of glass: with less, directions have no digits left to tell refracted light from light
/// that goes on.
const MIN_GLASS_IOR: f32 = 1.05;

/// The principled model at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Principled {
    /// The parameters; `ior` is the index that glass has, also where `specular` is given, and `multiscatter` is false
    /// for Mitsuba's lobes.
    p: PrincipledParameters,
    /// Reflectance of the dielectric layer ahead.
    specular: Rgb,
    /// Colour of light scattered by microfacets more than once, over `pi (1 - E_avg)`.
    multiple: Rgb,
    /// Weight of glass; the rest of what is not metal is the diffuse base with its layer.
    glass: f32,
    ggx: Ggx,
}

/// What the layers reflect of the light from one direction, each if it alone were there.
struct LobeAlbedos {
    /// Microfacets that reflect all, and those that reflect Schlick's weight.
    facets: f32,
    schlick: f32,
    clearcoat: f32,
    sheen: f32,
    /// The white diffuse lobe.
    diffuse: f32,
}

/// Probabilities of the lobes.
struct LobePmf {
    clearcoat: f32,
    specular: f32,
    /// What is sampled by the cosine: diffuse base, sheen, and light scattered several times.
    diffuse: f32,
    diffuse_transmission: f32,
    glass: f32,
    /// Light that enters the surface: a delta lobe, for light sampling cannot find it.
    walk: f32,
}

impl Principled {
    /// The model for parameters within their ranges.
    pub fn new(p: &PrincipledParameters) -> Self {
        let aspect = (1.0 - 0.9 * p.anisotropic).sqrt();
        let squared = p.roughness * p.roughness;
        let glass = (1.0 - p.metallic) * p.transmission;
        let refracts = glass > 0.0 && !p.thin;
        let layer_ior = p.specular.map_or(p.ior, PrincipledParameters::ior_of_specular);
        let ior = if refracts { layer_ior.max(MIN_GLASS_IOR) } else { layer_ior };
        let least = if refracts { MIN_ALPHA.max(2e-4 / (ior - 1.0)) } else { MIN_ALPHA };
        let ggx = Ggx::new([squared / aspect, squared * aspect].map(|a| a.clamp(least, 1.0)));

        let f0 = (layer_ior - 1.0) / (layer_ior + 1.0);
        let specular = mix(Rgb::WHITE, tint(p.base_color, p.model), p.specular_tint) * (f0 * f0);
        let dielectric = 1.0 - p.metallic - glass;
        let mut multiple = Rgb::BLACK;
        let multiscatter = p.multiscatter && p.model == PrincipledModel::Burley;
        if multiscatter && p.metallic + dielectric > 0.0 {
            let missing = Energy::new(&ggx).average_missing_energy();
            let color = p.base_color.map(|f| schlick_multiple(f, 1.0 - missing)) * p.metallic
                + specular.map(|f| schlick_multiple(f, 1.0 - missing)) * dielectric.max(0.0);
            multiple = color / (PI * missing);
        }
        Self { p: PrincipledParameters { ior, multiscatter, ..*p }, specular, multiple, glass, ggx }
    }

    /// Whether the lobes are Mitsuba's.
    #[inline(always)]
    pub(super) fn is_mitsuba(&self) -> bool {
        self.p.model == PrincipledModel::Mitsuba
    }

    /// Weight of the diffuse base with its layer.
    #[inline(always)]
    fn dielectric(&self) -> f32 {
        (1.0 - self.p.metallic - self.glass).max(0.0)
    }

    /// Reflectance of metal and layer together, at Schlick's weight 0.
    #[inline(always)]
    fn f0(&self) -> Rgb {
        self.p.base_color * self.p.metallic + self.specular * self.dielectric()
    }

    #[inline(always)]
    fn sheen_color(&self) -> Rgb {
        mix(Rgb::WHITE, tint(self.p.base_color, self.p.model), self.p.sheen_tint) * self.p.sheen
    }

    /// Reflection by the microfacets of metal and layer, all but the Fresnel factor.
    #[inline(always)]
    fn facet(&self, o: Vec3, i: Vec3) -> FacetReflection {
        if self.is_mitsuba() { SeparableGgx::from(self.ggx).reflection(o, i) } else { self.ggx.reflection(o, i) }
    }

    /// Reflectance of the microfacets of metal and layer at a cosine.
    #[inline(always)]
    fn reflectance(&self, cos: f32) -> Rgb {
        let weight = schlick_weight(cos);
        if !self.is_mitsuba() {
            return schlick(self.f0(), self.p.metallic + self.dielectric(), weight);
        }
        schlick(self.p.base_color, 1.0, weight) * self.p.metallic + self.mitsuba_specular(cos) * self.dielectric()
    }

    /// `ISOTROPIC` where it is known that the microfacets are.
    #[inline(always)]
    fn albedos<const ISOTROPIC: bool>(&self, w: Vec3) -> LobeAlbedos {
        let cos = w.z.clamp(0.0, 1.0);
        let energy = if ISOTROPIC { Energy::isotropic(self.ggx.alpha()[0]) } else { Energy::new(&self.ggx) };
        let facets = energy.directional_albedo(w);
        LobeAlbedos {
            facets,
            schlick: energy.schlick(w).max(0.0).min(facets),
            clearcoat: if self.p.clearcoat > 0.0 {
                self.p.clearcoat * principled_clear_coat(self.p.clearcoat_gloss, cos)
            } else {
                0.0
            },
            sheen: if self.p.sheen > 0.0 { principled_sheen(cos) } else { 0.0 },
            diffuse: self.diffuse_albedo(cos),
        }
    }

    /// What the dielectric layer reflects, several times scattered light included.
    #[inline(always)]
    fn layer_albedo(&self, at: &LobeAlbedos) -> Rgb {
        self.specular.map(
            #[inline(always)]
            |f| facets_albedo(f, at),
        )
    }

    /// What diffuse base and sheen would scatter without a layer.
    #[inline(always)]
    fn base_albedo(&self, at: &LobeAlbedos) -> Rgb {
        let diffuse = at.diffuse + (1.0 - at.diffuse) * self.p.diffuse_transmission;
        let base = self.p.base_color * diffuse;
        if self.p.sheen > 0.0 { base + self.sheen_color() * at.sheen } else { base }
    }

    /// What would be scattered without a clear coat, at most.
    #[inline(always)]
    fn uncoated_albedo(&self, at: &LobeAlbedos) -> Rgb {
        let layer = self.layer_albedo(at);
        let base = rgb_min(self.base_albedo(at), Rgb::WHITE - layer);
        self.p.base_color.map(
            #[inline(always)]
            |f| facets_albedo(f, at),
        ) * self.p.metallic
            + (layer + base) * self.dielectric()
            + Rgb::splat(self.glass)
    }

    /// What the layer of a black base reflects, for a direction of the upper side: the closed form for tests.
    #[cfg(test)]
    pub(super) fn layer_albedo_at(&self, w: Vec3) -> f32 {
        self.layer_albedo(&self.albedos::<false>(w)).g
    }

    /// Probabilities for a direction: by what the lobes scatter, about.
    #[inline(always)]
    fn lobe_pmf(&self, at: &LobeAlbedos) -> LobePmf {
        let below = 1.0 - at.clearcoat;
        let f0 = self.f0().mean();
        let specular = below * (f0 * (at.facets - at.schlick) + (self.p.metallic + self.dielectric()) * at.schlick);
        let left = (1.0 - self.layer_albedo(at).mean()).min(1.0);
        let base = self.dielectric() * left.min(self.p.base_color.mean());
        let around =
            self.dielectric() * left * self.p.sheen * at.sheen + (1.0 - at.facets) * self.multiple.mean().min(1.0);
        let entering = self.entering();
        let diffuse = below * (base * (1.0 - self.p.diffuse_transmission - entering) + around);
        let diffuse_transmission = below * base * self.p.diffuse_transmission;
        let glass = below * self.glass;
        let walk = below * base * entering;
        let sum = at.clearcoat + specular + diffuse + diffuse_transmission + glass + walk;
        let scale = if sum > 0.0 { 1.0 / sum } else { 0.0 };
        LobePmf {
            clearcoat: at.clearcoat * scale,
            specular: specular * scale,
            diffuse: diffuse * scale,
            diffuse_transmission: diffuse_transmission * scale,
            glass: glass * scale,
            walk: walk * scale,
        }
    }

    /// All lobes.
    #[inline]
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> BsdfEval {
        self.eval_with::<false>(wo, wi)
    }

    #[inline(always)]
    fn eval_with<const ISOTROPIC: bool>(&self, wo: Vec3, wi: Vec3) -> BsdfEval {
        let at_o = self.albedos::<ISOTROPIC>(vec3(wo.x, wo.y, wo.z.abs()));
        let eval = self.eval_from::<ISOTROPIC>(wo, wi, &at_o, &self.lobe_pmf(&at_o));
        if wo.z.abs().min(wi.z.abs()) > MIN_COSINE { eval } else { BsdfEval::default() }
    }

    #[inline(always)]
    fn eval_from<const ISOTROPIC: bool>(&self, wo: Vec3, wi: Vec3, at_o: &LobeAlbedos, pmf: &LobePmf) -> BsdfEval {
        let (o, i) = (vec3(wo.x, wo.y, wo.z.abs()), vec3(wi.x, wi.y, wi.z.abs()));
        let at_i = self.albedos::<ISOTROPIC>(i);
        let reflects = wo.z * wi.z > 0.0;
        let mut value = Rgb::BLACK;
        let mut coat = 0.0;
        let mut pdf = 0.0;
        // Seen from inside of a solid, Mitsuba's has nothing but glass.
        let is_within = self.is_mitsuba() && self.glass > 0.0 && !self.p.thin && wo.z < 0.0;

        // Clear coat, metal and dielectric layer.
        if reflects {
            if self.p.clearcoat > 0.0 {
                let (unscaled, density) = ClearCoat::new(self.p.clearcoat_gloss).eval(o, i);
                coat = self.p.clearcoat * unscaled * if self.is_mitsuba() { 4.0 * o.z * i.z } else { 1.0 };
                pdf += pmf.clearcoat * density;
            }
            if self.p.metallic + self.dielectric() > 0.0 {
                let facet = self.facet(o, i);
                value += self.reflectance(facet.cos) * facet.value;
                value += self.multiple * ((1.0 - at_o.facets) * (1.0 - at_i.facets) * i.z);
                pdf += pmf.specular * facet.pdf;
            }
        }

        // The base.
        let cosine_pdf = FRAC_1_PI * i.z;
        if self.dielectric() > 0.0 {
            value += self.base_value(o, i, reflects, at_o, &at_i) * self.dielectric();
        }
        pdf += if reflects { pmf.diffuse } else { pmf.diffuse_transmission } * cosine_pdf;

        if is_within {
            (value, coat) = (Rgb::BLACK, 0.0);
        }

        // Glass.
        if self.glass > 0.0 {
            let glass = if self.p.thin { self.eval_thin(o, i, reflects) } else { self.eval_glass(wo, wi) };
            value += glass.value * self.glass;
            pdf += pmf.glass * glass.pdf;
        }
        if self.p.clearcoat > 0.0 {
            let clear = |at: &LobeAlbedos| Rgb::splat(at.clearcoat);
            let below = self.base_attenuation(
                [clear(at_o), clear(&at_i)],
                [self.uncoated_albedo(at_o), self.uncoated_albedo(&at_i)],
            );
            value = value * below + Rgb::splat(coat);
        }
        BsdfEval { value, pdf }
    }

    /// The diffuse base below its layer.
    #[inline(always)]
    fn base_value(&self, o: Vec3, i: Vec3, reflects: bool, at_o: &LobeAlbedos, at_i: &LobeAlbedos) -> Rgb {
        let layer = [self.layer_albedo(at_o), self.layer_albedo(at_i)];
        let below_layer = self.base_attenuation(layer, [self.base_albedo(at_o), self.base_albedo(at_i)]);
        if !reflects {
            return self.p.base_color * below_layer * (self.p.diffuse_transmission * FRAC_1_PI * i.z);
        }
        let mut shape = shapes::diffuse(o, i, self.p.roughness);
        if self.p.subsurface > 0.0 {
            let flat = if self.p.random_walk { 0.0 } else { shapes::subsurface(o, i, self.p.roughness) };
            shape += (flat - shape) * self.p.subsurface;
        }
        let mut value = self.p.base_color * ((1.0 - self.p.diffuse_transmission) * shape);
        if self.p.sheen > 0.0 {
            value += self.sheen_color() * shapes::sheen(o, i);
        }
        value * below_layer
    }

    /// A direction from one of the lobes.
    #[inline]
    pub fn sample(&self, wo: Vec3, u_lobe: f32, u: [f32; 2]) -> Option<BsdfSample> {
        self.sample_with::<false>(wo, u_lobe, u)
    }

    #[inline(always)]
    fn sample_with<const ISOTROPIC: bool>(&self, wo: Vec3, u_lobe: f32, u: [f32; 2]) -> Option<BsdfSample> {
        let o = vec3(wo.x, wo.y, wo.z.abs());
        let at_o = self.albedos::<ISOTROPIC>(o);
        let pmf = self.lobe_pmf(&at_o);
        if pmf.walk > 0.0 && u_lobe >= 1.0 - pmf.walk {
            return self.sample_walk(wo, &at_o, pmf.walk, u);
        }
        let direction = self.sample_direction(wo, o, &pmf, u_lobe, u);
        let wi = direction.unwrap_or(Vec3::ZERO);
        let BsdfEval { value, pdf } = self.eval_from::<ISOTROPIC>(wo, wi, &at_o, &pmf);
        let is_valid = (wo.z.abs() > MIN_COSINE) & (wi.z.abs() > MIN_COSINE) & (pdf > 0.0);
        let is_transmission = wo.z * wi.z < 0.0;
        let eta = match (is_transmission && !self.p.thin, wo.z > 0.0) {
            (false, _) => 1.0,
            (true, true) => self.p.ior,
            (true, false) => 1.0 / self.p.ior,
        };
        is_valid.then_some(BsdfSample { wi, weight: value / pdf, pdf, is_delta: false, is_transmission, eta })
    }

    /// A direction with the density of the chosen lobe.
    #[inline(always)]
    fn sample_direction(&self, wo: Vec3, o: Vec3, pmf: &LobePmf, u_lobe: f32, u: [f32; 2]) -> Option<Vec3> {
        let side = 1f32.copysign(wo.z);
        // A reflection keeps its side, or is lost.
        let above = |i: Vec3| (i.z > 0.0).then(|| vec3(i.x, i.y, i.z * side));
        let mut u_lobe = u_lobe;
        let mut is_chosen = |probability: f32| {
            u_lobe -= probability;
            u_lobe < 0.0
        };
        if self.p.clearcoat > 0.0 && is_chosen(pmf.clearcoat) {
            return above(ClearCoat::new(self.p.clearcoat_gloss).sample(o, u));
        }
        if is_chosen(pmf.specular) {
            let m = self.ggx.sample_visible_normal(o, u);
            return above(reflect(o, m, o.dot(m)));
        }
        if is_chosen(pmf.diffuse) {
            return above(warp::cosine_hemisphere(u));
        }
        if self.p.diffuse_transmission > 0.0 && is_chosen(pmf.diffuse_transmission) {
            return above(warp::cosine_hemisphere(u)).map(|i| vec3(i.x, i.y, -i.z));
        }
        if self.glass <= 0.0 || pmf.glass <= 0.0 {
            return None;
        }
        let u_glass = (u_lobe / pmf.glass).min(crate::math::float::ONE_MINUS_EPSILON);
        if !self.p.thin {
            return self.glass().sample(wo, u_glass, u).map(|sample| sample.wi);
        }
        let (i, reflects) = self.sample_thin(o, u_glass, u);
        above(i).map(|i| if reflects { i } else { vec3(i.x, i.y, -i.z) })
    }

    /// The share of what is below a layer that is left for a pair of directions: the layer's albedos for both, and
    /// those of what is below.
    #[inline(always)]
    fn base_attenuation(&self, layer: [Rgb; 2], below: [Rgb; 2]) -> Rgb {
        if self.is_mitsuba() {
            return Rgb::WHITE;
        }
        let ([layer_o, layer_i], [below_o, below_i]) = (layer, below);
        Rgb::new(
            remaining(layer_o.r, layer_i.r, below_o.r, below_i.r),
            remaining(layer_o.g, layer_i.g, below_o.g, below_i.g),
            remaining(layer_o.b, layer_i.b, below_o.b, below_i.b),
        )
    }

    /// Alpha along both tangents.
    pub(super) fn alpha(&self) -> [f32; 2] {
        self.ggx.alpha()
    }

    /// With another roughness of the highlight; the clear coat stays.
    pub(super) fn with_alpha(&self, alpha: [f32; 2]) -> Self {
        Self { ggx: Ggx::new(alpha), ..*self }
    }

    /// The lobes.
    #[inline]
    pub fn flags(&self) -> BsdfFlags {
        let crosses = self.glass > 0.0 || self.p.diffuse_transmission > 0.0;
        let transmission = if crosses { BsdfFlags::TRANSMISSION } else { BsdfFlags::empty() };
        BsdfFlags::DIFFUSE | BsdfFlags::REFLECTION | self.ggx.flags() | BsdfFlags::GLOSSY | transmission
    }

    /// What all lobes scatter together, about.
    pub fn albedo(&self, wo: Vec3) -> Rgb {
        let at = self.albedos::<false>(vec3(wo.x, wo.y, wo.z.abs()));
        let glass = if self.p.thin { self.p.base_color } else { self.p.base_color.map(f32::sqrt) };
        let below = self.uncoated_albedo(&at) - (Rgb::WHITE - glass) * self.glass;
        rgb_min(below + Rgb::splat(at.clearcoat), Rgb::WHITE)
    }
}

/// What microfacets with Schlick's reflectance `f` ahead scatter, at most.
#[inline(always)]
fn facets_albedo(f: f32, at: &LobeAlbedos) -> f32 {
    let average = f + (1.0 - f) / 21.0;
    f * (at.facets - at.schlick) + at.schlick + (1.0 - at.facets) * average * average
}

/// Schlick's reflectance for a weight, between those ahead and at grazing angles.
#[inline(always)]
fn schlick(f0: Rgb, f90: f32, weight: f32) -> Rgb {
    f0 * (1.0 - weight) + Rgb::splat(f90 * weight)
}

/// [`Principled::base_attenuation`] of one channel.
#[inline(always)]
fn remaining(layer_o: f32, layer_i: f32, below_o: f32, below_i: f32) -> f32 {
    let (rest, wanted) = ((1.0 - layer_o.max(layer_i)).max(0.0), below_o.max(below_i));
    if wanted > rest { rest / wanted } else { 1.0 }
}

#[inline(always)]
fn rgb_min(a: Rgb, b: Rgb) -> Rgb {
    Rgb::new(a.r.min(b.r), a.g.min(b.g), a.b.min(b.b))
}

/// A colour without its brightness: over its largest channel, so that none exceeds 1, or in Mitsuba over its luminance.
#[inline(always)]
fn tint(color: Rgb, model: PrincipledModel) -> Rgb {
    let brightness = match model {
        PrincipledModel::Burley => color.max_channel(),
        PrincipledModel::Mitsuba => color.luminance(),
    };
    if brightness > 0.0 { color / brightness } else { Rgb::WHITE }
}

#[inline(always)]
fn mix(a: Rgb, b: Rgb, amount: f32) -> Rgb {
    a * (1.0 - amount) + b * amount
}

/// Colour that several reflections leave where Schlick's reflectance is `f` ahead and one reflection releases `average`
/// of diffuse light.
fn schlick_multiple(f: f32, average: f32) -> f32 {
    super::energy::multiple_color(f + (1.0 - f) / 21.0, average)
}
