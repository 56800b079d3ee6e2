//! A clear dielectric coat over any opaque base.
//!
//! With `E(w)` the fraction of the light from `w` that the coat reflects and `E_avg` its mean under diffuse light,
//!
//! ```text
//! f = coat + tint^((1 / cos_t(wo) + 1 / cos_t(wi)) / 2) g(wo, wi) base
//! g = (1 - E(wo)) (1 - E(wi)) / (1 - E_avg)     over a diffuse base, as for plastic
//! g = 1 - max(E(wo), E(wi))                    over any other
//! ```
//!
//! (Kelemen and Szirmay-Kalos, "A Microfacet Based Coupled Specular-Matte BRDF Model with Importance Sampling"),
//! with `cos_t` the cosine of the refracted direction in the coat. Both are reciprocal and scatter no more than they
//! receive; the first loses nothing over a diffuse base, the second nothing over a mirror, and up to `E_avg - E(wo)`
//! over a base that spreads light widely. The base sees directions as they are outside: what the coat bends on the way
//! in it bends back on the way out.

use std::cell::RefCell;
use std::ops::Deref;
use std::sync::Arc;

use super::fresnel;
use super::microfacet::MIN_COSINE;
use super::regularize::widened;
use super::split::share;
use super::{Bsdf, BsdfEval, BsdfFlags, BsdfSample, Coat, Eon, Lambert, Plastic};
use crate::color::Rgb;
use crate::math::float::ONE_MINUS_EPSILON;
use crate::math::{Vec3, vec3};

/// A clear coat over a base, on both sides.
#[derive(Clone, Debug, PartialEq)]
pub struct Coated {
    coat: Coat,
    /// What light keeps that crosses the coat twice along the normal; `None` for all.
    tint: Option<Rgb>,
    /// For a diffuse base the factor on `(1 - E(wo)) (1 - E(wi))`.
    diffuse: Option<f32>,
    base: Bsdf,
}

/// A [`Coated`] in memory that the thread uses again: textures and path space regularization make one for each hit.
#[derive(Clone, Debug, PartialEq)]
pub struct PooledCoated(Arc<Coated>);

thread_local! {
    /// Memory of coated BSDFs that are no more.
    static FREE: RefCell<Vec<Arc<Coated>>> = const { RefCell::new(Vec::new()) };
}

impl From<Coated> for PooledCoated {
    fn from(coated: Coated) -> Self {
        if let Some(mut free) = FREE.with_borrow_mut(Vec::pop)
            && let Some(place) = Arc::get_mut(&mut free)
        {
            *place = coated;
            return Self(free);
        }
        Self(Arc::new(coated))
    }
}

impl Drop for PooledCoated {
    fn drop(&mut self) {
        if Arc::strong_count(&self.0) == 1 {
            // When the thread ends, the pool may be gone before.
            let _ = FREE.try_with(|free| free.borrow_mut().push(Arc::clone(&self.0)));
        }
    }
}

impl Deref for PooledCoated {
    type Target = Coated;

    #[inline]
    fn deref(&self) -> &Coated {
        &self.0
    }
}

impl Bsdf {
    /// As [`Coated::new`]: a coat without tint over diffuse reflection is [`Plastic`].
    pub fn coated(coat: Coat, tint: Rgb, base: Self) -> Self {
        match base {
            Self::Lambert(Lambert { albedo: diffuse }) if tint == Rgb::WHITE => {
                Self::Plastic(Plastic { diffuse, coat, tint, nonlinear: false })
            }
            base => Self::Coated(Coated::new(coat, tint, base).into()),
        }
    }
}

/// The least share of the light below the coat that sampling assumes the base to reflect.
const MIN_BASE: f32 = 0.05;

impl Coated {
    /// A coat over an opaque base; `tint` within `[0, 1]` is what light keeps that crosses the coat twice along the
    /// normal.
    pub fn new(coat: Coat, tint: Rgb, base: Bsdf) -> Self {
        let inverse = coat.interreflection(1.0);
        let diffuse = match base {
            Bsdf::Lambert(_) => Some(inverse),
            // A little more than a mean share of it goes where the coat lets it out.
            Bsdf::Eon(Eon { roughness, .. }) => Some(inverse - 0.1 * roughness * (inverse - 1.0)),
            _ => None,
        };
        Self { coat, tint: (tint != Rgb::WHITE).then_some(tint), diffuse, base }
    }

    /// As [`Bsdf::with_min_alpha`], of coat and base.
    pub(super) fn with_min_alpha(&self, alpha: f32) -> Option<Self> {
        let (coat, base) = (widened(self.coat.alpha(), alpha), self.base.with_min_alpha(alpha));
        if coat.is_none() && base.is_none() {
            return None;
        }
        let coat = coat.map_or(self.coat, |alpha| self.coat.with_alpha(alpha));
        Some(Self { coat, base: base.unwrap_or_else(|| self.base.clone()), ..*self })
    }

    /// What is left of the light from `i` to `o`, both on the upper side, on its way through the coat to the base and
    /// back.
    #[inline]
    fn left(&self, o: Vec3, i: Vec3, coat_o: f32) -> Rgb {
        let coat_i = self.coat.albedo(i);
        let left = match self.diffuse {
            Some(factor) => (1.0 - coat_o) * (1.0 - coat_i) * factor,
            None => 1.0 - coat_o.max(coat_i),
        };
        match self.tint {
            None => Rgb::splat(left),
            Some(tint) => {
                let length = 0.5 * (self.path_length(o) + self.path_length(i));
                tint.map(|t| left * t.powf(length))
            }
        }
    }

    /// Length of the way through a coat of thickness 1; infinite at grazing angles for an index of 1.
    #[inline]
    fn path_length(&self, w: Vec3) -> f32 {
        1.0 / fresnel::dielectric(w.z.min(1.0), self.coat.ior()).cos_t
    }

    /// Probability of choosing the coat: by what the two reflect, about.
    #[inline]
    fn coat_probability(&self, wo: Vec3, coat_albedo: f32) -> f32 {
        let base = (1.0 - coat_albedo) * self.base.albedo(wo).mean().clamp(MIN_BASE, 1.0);
        coat_albedo / (coat_albedo + base)
    }

    /// Base and rough coat for directions on the same side.
    #[inline]
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> BsdfEval {
        if wo.z * wi.z <= 0.0 || wo.z.abs() <= MIN_COSINE {
            return BsdfEval::default();
        }
        let coat_o = self.coat.albedo(upper(wo));
        self.eval_from(wo, wi, coat_o, self.coat_probability(wo, coat_o))
    }

    #[inline]
    fn eval_from(&self, wo: Vec3, wi: Vec3, coat_o: f32, probability: f32) -> BsdfEval {
        let (o, i) = (upper(wo), upper(wi));
        let base = self.base.eval(wo, wi);
        let (value, pdf) = (base.value * self.left(o, i, coat_o), (1.0 - probability) * base.pdf);
        if self.coat.is_smooth() {
            return BsdfEval { value, pdf };
        }
        let (reflected, density) = self.coat.eval(o, i);
        BsdfEval { value: value + Rgb::splat(reflected), pdf: pdf + probability * density }
    }

    /// As [`Bsdf::diffuse_fraction`].
    pub fn diffuse_fraction(&self, wo: Vec3, wi: Vec3) -> Rgb {
        let of_base = self.base.diffuse_fraction(wo, wi);
        if self.coat.is_smooth() || of_base.is_black() {
            return of_base;
        }
        let base = self.base.eval(wo, wi).value * self.left(upper(wo), upper(wi), self.coat.albedo(upper(wo)));
        share(of_base * base, self.eval(wo, wi).value)
    }

    /// A direction from the coat or the base.
    #[inline]
    pub fn sample(&self, wo: Vec3, u_lobe: f32, u: [f32; 2]) -> Option<BsdfSample> {
        if wo.z.abs() <= MIN_COSINE {
            return None;
        }
        let o = upper(wo);
        let coat_o = self.coat.albedo(o);
        let probability = self.coat_probability(wo, coat_o);
        let wi = if u_lobe < probability {
            if self.coat.is_smooth() {
                return Some(BsdfSample::mirrored(wo, Rgb::splat(coat_o / probability), probability));
            }
            let i = self.coat.sample(o, u);
            vec3(i.x, i.y, i.z * 1f32.copysign(wo.z))
        } else {
            let u_base = ((u_lobe - probability) / (1.0 - probability)).min(ONE_MINUS_EPSILON);
            let sample = self.base.sample(wo, u_base, u)?;
            if sample.is_delta {
                let weight = sample.weight * self.left(o, upper(sample.wi), coat_o) / (1.0 - probability);
                return Some(BsdfSample { weight, pdf: (1.0 - probability) * sample.pdf, ..sample });
            }
            sample.wi
        };
        if wi.z * wo.z <= 0.0 {
            return None;
        }
        self.eval_from(wo, wi, coat_o, probability).sampled(wi)
    }

    /// The lobes.
    #[inline]
    pub fn flags(&self) -> BsdfFlags {
        self.coat.flags() | self.base.flags()
    }

    /// Whether what is below the coat has a delta lobe.
    pub(super) fn has_specular_base(&self) -> bool {
        self.base.flags().contains(BsdfFlags::SPECULAR)
    }

    /// What coat and base reflect together, about.
    pub fn albedo(&self, wo: Vec3) -> Rgb {
        let coat = self.coat.albedo(upper(wo));
        let tint = self.tint.map_or(Rgb::WHITE, |tint| tint.map(|t| t.powf(self.path_length(upper(wo)))));
        Rgb::splat(coat) + tint * self.base.albedo(wo) * (1.0 - coat)
    }
}

#[inline]
fn upper(w: Vec3) -> Vec3 {
    vec3(w.x, w.y, w.z.abs())
}
