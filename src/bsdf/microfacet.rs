//! Distributions of microfacet normals with Smith's shadowing; GGX with height-correlated shadowing is the default.
//!
//! Of GGX, with the stretched length `s(w) = |(ax wx, ay wy, wz)|` of a direction, everything is algebra:
//!
//! ```text
//! G1(w)              = 2 wz / (wz + s(w))
//! G2(o, i)           = 2 oz iz / (s(o) iz + s(i) oz)                (height-correlated)
//! visible normals    = G1(o) D(m) (o·m) / oz = 2 D(m) (o·m) / (oz + s(o))
//! ```
//!
//! (Walter et al., "Microfacet Models for Refraction through Rough Surfaces"; Heitz, "Understanding the
//! Masking-Shadowing Function in Microfacet-Based BRDFs".) Directions are unit, local, on the upper side (`z > 0`).

use std::f32::consts::FRAC_1_PI;

use super::BsdfFlags;
use super::energy::Energy;
use crate::math::{Vec3, sin_cos_turns, vec3};

/// A distribution of microfacet normals with its shadowing.
pub trait Microfacets: Copy {
    /// The distribution for an alpha within `[0, 1]` along x and y; smooth if both are below [`SMOOTH_ALPHA`].
    fn with_alpha(alpha: [f32; 2]) -> Self;

    /// Alpha along x and y.
    fn alpha(&self) -> [f32; 2];

    /// Density of microfacet normals: microfacet area per surface area and solid angle around `m`, which need not be
    /// unit.
    fn normal_density(&self, m: Vec3) -> f32;

    /// A normal among those visible from `o`. Unit; `o·m` is positive but for rounding.
    fn sample_visible_normal(&self, o: Vec3, u: [f32; 2]) -> Vec3;

    /// `G2(o, i) / G1(o)`: what is left to weigh a sample of visible normals with.
    fn g2_over_g1(&self, o: Vec3, i: Vec3) -> f32;

    /// Reflection between two directions of the upper side.
    fn reflection(&self, o: Vec3, i: Vec3) -> FacetReflection;

    /// Density per solid angle of reflecting `o` at the unit normal `m`.
    fn reflection_pdf(&self, o: Vec3, m: Vec3) -> f32;

    /// `x G2(o, i) / (2 oz)` and `x G1(o) / (2 oz)`: value and density of refraction, but for their common factors.
    fn refraction(&self, o: Vec3, i: Vec3, x: f32) -> (f32, f32);

    /// How much of the light the microfacets scatter at once, where that is known; the caller knows whether they are
    /// isotropic.
    fn energy<const ISOTROPIC: bool>(&self) -> Option<Energy>;

    /// Specular or glossy, and whether anisotropic.
    #[inline(always)]
    fn flags(&self) -> BsdfFlags {
        let [ax, ay] = self.alpha();
        let lobe = if self.is_smooth() { BsdfFlags::SPECULAR } else { BsdfFlags::GLOSSY };
        if ax == ay { lobe } else { lobe | BsdfFlags::ANISOTROPIC }
    }

    /// Whether the surface is a plane mirror; no other method may then be called.
    #[inline(always)]
    fn is_smooth(&self) -> bool {
        self.alpha()[0] == 0.0
    }
}

/// A GGX distribution; alpha along x and y.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ggx {
    /// Width of the distribution of slopes along x and y: both zero, or both within `[SMOOTH_ALPHA, 1]`.
    pub(super) alpha: [f32; 2],
}

/// Alpha below which a surface counts as smooth. The rounding of a direction, 1e-7, turns a microfacet normal by as
/// much: of a lobe of width 1e-4 that is a thousandth, and a narrower one would have no digits left.
pub const SMOOTH_ALPHA: f32 = 1e-4;

/// A direction whose cosine is not above this lies in the surface: below, products of cosines and alpha would
/// underflow.
pub(super) const MIN_COSINE: f32 = 1e-30;

/// Reflection by a microfacet between two directions, all but the Fresnel factor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FacetReflection {
    /// `D G2 / (4 oz)`: the value with its cosine, for a reflectance of 1.
    pub value: f32,
    /// Density per solid angle of reflecting at a visible normal.
    pub pdf: f32,
    /// Cosine between either direction and the microfacet normal.
    pub cos: f32,
}

/// Alphas within `[0, 1]` as they are used: both zero, or both within `[SMOOTH_ALPHA, 1]`.
pub(super) fn clamp_alpha(alpha: [f32; 2]) -> [f32; 2] {
    let is_smooth = alpha[0].max(alpha[1]) < SMOOTH_ALPHA;
    if is_smooth { [0.0; 2] } else { alpha.map(|a| a.clamp(SMOOTH_ALPHA, 1.0)) }
}

impl Ggx {
    /// The distribution for `alpha` within `[0, 1]`; smooth if both are below [`SMOOTH_ALPHA`].
    pub fn new(alpha: [f32; 2]) -> Self {
        Self { alpha: clamp_alpha(alpha) }
    }

    /// The isotropic distribution for an alpha that is zero or within `[SMOOTH_ALPHA, 1]`.
    #[inline(always)]
    pub(super) fn isotropic(alpha: f32) -> Self {
        Self { alpha: [alpha; 2] }
    }

    /// Length of `w` stretched by alpha.
    #[inline(always)]
    pub fn stretched_length(&self, w: Vec3) -> f32 {
        vec3(self.alpha[0] * w.x, self.alpha[1] * w.y, w.z).length()
    }

    /// Fraction of the microfacets facing `w` that are not masked.
    #[inline(always)]
    pub fn g1(&self, w: Vec3) -> f32 {
        2.0 * w.z / (w.z + self.stretched_length(w))
    }

    /// Fraction of the microfacets that both directions see; both on the upper side.
    #[inline(always)]
    pub fn g2(&self, o: Vec3, i: Vec3) -> f32 {
        2.0 * o.z * i.z / (self.stretched_length(o) * i.z + self.stretched_length(i) * o.z)
    }

    /// Density per solid angle of [`Microfacets::sample_visible_normal`]; `m` unit.
    #[inline(always)]
    pub fn visible_normal_pdf(&self, o: Vec3, m: Vec3) -> f32 {
        if m.z <= 0.0 {
            return 0.0;
        }
        2.0 * self.normal_density(m) * o.dot(m).max(0.0) / (o.z + self.stretched_length(o))
    }
}

impl Microfacets for Ggx {
    fn with_alpha(alpha: [f32; 2]) -> Self {
        Self::new(alpha)
    }

    #[inline(always)]
    fn alpha(&self) -> [f32; 2] {
        self.alpha
    }

    #[inline(always)]
    fn normal_density(&self, m: Vec3) -> f32 {
        let [ax, ay] = self.alpha;
        let a = ax * ay;
        let stretched = vec3(m.x * ay, m.y * ax, m.z * a).length_squared();
        let ratio = a * m.length_squared() / stretched;
        // Zero only where the squares underflow.
        if stretched == 0.0 { 0.0 } else { FRAC_1_PI * a * ratio * ratio }
    }

    /// With density [`Ggx::visible_normal_pdf`] (Dupuy and Benyoub, "Sampling Visible GGX Normals with Spherical
    /// Caps").
    #[inline(always)]
    fn sample_visible_normal(&self, o: Vec3, u: [f32; 2]) -> Vec3 {
        let [ax, ay] = self.alpha;
        // The hemisphere's configuration: there a reflected direction is uniform on the cap z > -w.z.
        let w = vec3(ax * o.x, ay * o.y, o.z).normalize();
        // z + w.z and 1 - z², without the cancellation of z itself at grazing angles.
        let above = (1.0 - u[1]) * (1.0 + w.z);
        let radius = (u[1] * (1.0 + w.z) * (above + (1.0 - w.z))).sqrt();
        let (sin, cos) = sin_cos_turns(u[0]);
        vec3(ax * (radius * cos + w.x), ay * (radius * sin + w.y), above).normalize()
    }

    #[inline(always)]
    fn g2_over_g1(&self, o: Vec3, i: Vec3) -> f32 {
        let length = self.stretched_length(o);
        i.z * (o.z + length) / (length * i.z + self.stretched_length(i) * o.z)
    }

    #[inline(always)]
    fn reflection(&self, o: Vec3, i: Vec3) -> FacetReflection {
        let half = o + i;
        let density = self.normal_density(half);
        let (length_o, length_i) = (self.stretched_length(o), self.stretched_length(i));
        FacetReflection {
            value: 0.5 * density * i.z / (length_o * i.z + length_i * o.z),
            // The Jacobian 1 / (4 o·m) cancels the cosine of the visible normals.
            pdf: 0.5 * density / (o.z + length_o),
            // |o + i|² = 2 (1 + o·i) = 4 (o·m)².
            cos: (0.5 * half.length()).min(1.0),
        }
    }

    #[inline(always)]
    fn reflection_pdf(&self, o: Vec3, m: Vec3) -> f32 {
        0.5 * self.normal_density(m) / (o.z + self.stretched_length(o))
    }

    #[inline(always)]
    fn refraction(&self, o: Vec3, i: Vec3, x: f32) -> (f32, f32) {
        let (length_o, length_i) = (self.stretched_length(o), self.stretched_length(i));
        (x * i.z / (length_o * i.z + length_i * o.z), x / (o.z + length_o))
    }

    #[inline(always)]
    fn energy<const ISOTROPIC: bool>(&self) -> Option<Energy> {
        Some(if ISOTROPIC { Energy::isotropic(self.alpha[0]) } else { Energy::new(self) })
    }
}

/// GGX whose two sides are masked independently of each other, `G2(o, i) = G1(o) G1(i)`, for agreement with Mitsuba;
/// what several encounters scatter is lost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeparableGgx(Ggx);

impl SeparableGgx {
    /// As [`Ggx::new`].
    pub fn new(alpha: [f32; 2]) -> Self {
        Self(Ggx::new(alpha))
    }
}

impl From<Ggx> for SeparableGgx {
    fn from(ggx: Ggx) -> Self {
        Self(ggx)
    }
}

impl Microfacets for SeparableGgx {
    fn with_alpha(alpha: [f32; 2]) -> Self {
        Self::new(alpha)
    }

    #[inline(always)]
    fn alpha(&self) -> [f32; 2] {
        self.0.alpha
    }

    #[inline(always)]
    fn normal_density(&self, m: Vec3) -> f32 {
        self.0.normal_density(m)
    }

    #[inline(always)]
    fn sample_visible_normal(&self, o: Vec3, u: [f32; 2]) -> Vec3 {
        self.0.sample_visible_normal(o, u)
    }

    #[inline(always)]
    fn g2_over_g1(&self, _o: Vec3, i: Vec3) -> f32 {
        self.0.g1(i)
    }

    #[inline(always)]
    fn reflection(&self, o: Vec3, i: Vec3) -> FacetReflection {
        let facet = self.0.reflection(o, i);
        FacetReflection { value: facet.pdf * self.0.g1(i), ..facet }
    }

    #[inline(always)]
    fn reflection_pdf(&self, o: Vec3, m: Vec3) -> f32 {
        self.0.reflection_pdf(o, m)
    }

    #[inline(always)]
    fn refraction(&self, o: Vec3, i: Vec3, x: f32) -> (f32, f32) {
        let (_, pdf) = self.0.refraction(o, i, x);
        (pdf * self.0.g1(i), pdf)
    }

    #[inline(always)]
    fn energy<const ISOTROPIC: bool>(&self) -> Option<Energy> {
        None
    }
}

/// `w` reflected at the plane with unit normal `m`, where `cos = w·m`.
#[inline(always)]
pub(super) fn reflect(w: Vec3, m: Vec3, cos: f32) -> Vec3 {
    m * (2.0 * cos) - w
}
