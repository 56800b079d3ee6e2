//! The principled model's own lobes, each without colour: `f |cos wi|` for unit directions of the upper side.

use std::f32::consts::{FRAC_1_PI, PI};

use super::super::energy::schlick_weight;
use super::super::microfacet::reflect;
use crate::math::{Vec3, sin_cos_turns, vec3};

/// Square of the cosine between either direction and the half vector.
#[inline(always)]
fn half_cos_squared(o: Vec3, i: Vec3) -> f32 {
    (0.5 * (1.0 + o.dot(i))).clamp(0.0, 1.0)
}

/// The diffuse lobe with its retro-reflection at grazing angles (Burley, "Physically Based Shading at Disney").
#[inline(always)]
pub fn diffuse(o: Vec3, i: Vec3, roughness: f32) -> f32 {
    let fd90 = 2.0 * roughness * half_cos_squared(o, i) - 0.5;
    FRAC_1_PI * i.z * (1.0 + fd90 * schlick_weight(o.z)) * (1.0 + fd90 * schlick_weight(i.z))
}

/// The flat lobe that approximates subsurface scattering (ibid., after Hanrahan and Krueger).
#[inline]
pub fn subsurface(o: Vec3, i: Vec3, roughness: f32) -> f32 {
    let fd90 = roughness * half_cos_squared(o, i) - 1.0;
    let facing = (1.0 + fd90 * schlick_weight(o.z)) * (1.0 + fd90 * schlick_weight(i.z));
    FRAC_1_PI * i.z * 1.25 * (facing * (1.0 / (o.z + i.z) - 0.5) + 0.5)
}

/// The sheen of cloth (ibid.).
#[inline]
pub fn sheen(o: Vec3, i: Vec3) -> f32 {
    i.z * schlick_weight(half_cos_squared(o, i).sqrt())
}

/// The clear coat: a long-tailed lobe of a fixed dielectric, a quarter as strong as a real coat at most (ibid.).
#[derive(Clone, Copy, Debug)]
pub struct ClearCoat {
    alpha_squared: f32,
}

impl ClearCoat {
    /// A coat with `gloss` within `[0, 1]`.
    #[inline]
    pub fn new(gloss: f32) -> Self {
        let alpha = 0.1 + (0.001 - 0.1) * gloss;
        Self { alpha_squared: alpha * alpha }
    }

    /// Density of the half vector's cosine: Generalized Trowbridge and Reitz with exponent 1.
    #[inline]
    fn normal_density(&self, cos_squared: f32) -> f32 {
        let a2 = self.alpha_squared;
        // 1 - (1 - a²) cos² without cancellation at the peak.
        let spread = (1.0 - cos_squared).max(0.0) + a2 * cos_squared;
        (a2 - 1.0) / (PI * a2.ln() * spread)
    }

    /// Value and density of [`ClearCoat::sample`].
    #[inline]
    pub fn eval(&self, o: Vec3, i: Vec3) -> (f32, f32) {
        let half = o + i;
        let length_squared = half.length_squared();
        // Of the half vector: cos² with the normal and cos with the directions. Its sine comes from x and y, which keep
        // their digits.
        let sin_squared = half.truncate().length_squared() / length_squared;
        let cos_half = 0.5 * length_squared.sqrt();
        let density = self.normal_density(1.0 - sin_squared);
        let fresnel = 0.04 + 0.96 * schlick_weight(cos_half.min(1.0));
        // Smith's masking of alpha 1/4, with the 1 / (4 |cos wo| |cos wi|) of the microfacet model in it.
        let mask = |cos: f32| 1.0 / (cos + (0.0625 + 0.9375 * cos * cos).sqrt());
        let value = 0.25 * density * fresnel * mask(o.z) * mask(i.z) * i.z;
        (value, density * (1.0 - sin_squared).max(0.0).sqrt() / (4.0 * cos_half))
    }

    /// A reflection of `o`; below the surface now and then.
    #[inline]
    pub fn sample(&self, o: Vec3, u: [f32; 2]) -> Vec3 {
        // 1 - cos² = (1 - (1 - (a²)^(1 - u))) ... of the inverted distribution: sin² = ((a²)^(1 - u) - a²) / (1 - a²).
        let a2 = self.alpha_squared;
        let sin_squared = ((a2.powf(1.0 - u[0]) - a2) / (1.0 - a2)).clamp(0.0, 1.0);
        let (sin, cos) = (sin_squared.sqrt(), (1.0 - sin_squared).sqrt());
        let (y, x) = sin_cos_turns(u[1]);
        let m = vec3(sin * x, sin * y, cos);
        reflect(o, m, o.dot(m))
    }
}
