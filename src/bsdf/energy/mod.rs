//! Directional albedo of single-scattering microfacets, and the energy that multiple scattering carries.
//!
//! A microfacet model follows light to one microfacet; what is masked on its way out is missing, up to two thirds at
//! alpha 1. With `E(w)` the fraction that is scattered at once for the direction `w` and `E_avg` its mean under diffuse
//! light, the lobe
//!
//! ```text
//! (1 - E(wo)) (1 - E(wi)) / (pi (1 - E_avg))
//! ```
//!
//! times the colour that several reflections leave gives back exactly what is missing, and is reciprocal (Kulla and
//! Conty, "Revisiting Physically Based Shading at Imageworks"). `E` comes from tables that `cargo xtask bake_energy`
//! computes.
//!
//! Directions are unit, local, on the upper side.

mod bake;
pub(super) mod table;

pub use bake::bake;

use super::{Ggx, Microfacets};
use crate::math::Vec3;
pub(super) use table::schlick_weight;
use table::{
    ALPHAS, ASPECTS, CLEAR_COAT, COAT, COAT_AVERAGE, COAT_NODES, COSINES, DIFFUSE, GLASS, GLASS_AVERAGE, IORS,
    REFLECTION, REFLECTION_AVERAGE, SCHLICK, SHAPES, SHEEN, TableCoordinate, across, smoothed,
};

/// A smaller loss under diffuse light counts as none.
const MIN_LOST: f32 = 1e-7;

/// Directional albedo of rough microfacets with single scattering.
#[derive(Clone, Copy, Debug)]
pub struct Energy {
    ggx: Ggx,
    /// The larger alpha.
    alpha: f32,
    /// The smaller alpha over the larger.
    aspect: f32,
    at_alpha: TableCoordinate,
}

/// Where the tables are read for a direction.
#[derive(Clone, Copy, Debug)]
struct DirectionCoordinates {
    /// By the cosine with which isotropic microfacets of the larger alpha mask as much.
    cosine: TableCoordinate,
    /// See [`across`].
    across: f32,
}

impl Energy {
    #[inline]
    pub fn new(ggx: &Ggx) -> Self {
        let [ax, ay] = ggx.alpha();
        let alpha = ax.max(ay);
        Self { ggx: *ggx, alpha, aspect: ax.min(ay) / alpha, at_alpha: TableCoordinate::of_alpha(alpha) }
    }

    /// For isotropic GGX microfacets.
    #[inline(always)]
    pub fn isotropic(alpha: f32) -> Self {
        Self { ggx: Ggx::isotropic(alpha), alpha, aspect: 1.0, at_alpha: TableCoordinate::of_alpha(alpha) }
    }

    #[inline(always)]
    fn coordinates(&self, w: Vec3) -> DirectionCoordinates {
        let [ax, ay] = self.ggx.alpha();
        let cos = w.z.clamp(0.0, 1.0);
        if self.aspect == 1.0 {
            return DirectionCoordinates { cosine: TableCoordinate::of_cosine(cos, self.alpha), across: 0.0 };
        }
        // What counts is the tangent times the alpha along the direction.
        let (x, y) = (ax * w.x, ay * w.y);
        let (x2, y2) = (x * x, y * y);
        let run = (x2 + y2).sqrt() / self.alpha;
        let cos = cos / (cos * cos + run * run).sqrt();
        let (major, minor) = if ax > ay { (w.x, w.y) } else { (w.y, w.x) };
        DirectionCoordinates {
            cosine: TableCoordinate::of_cosine(cos, self.alpha),
            across: across(major * major, minor * minor, self.aspect),
        }
    }

    /// [`REFLECTION`] at a node along the aspect, above one of the axes.
    #[inline(always)]
    fn single_reflection(&self, aspect: usize, axis: usize, cosine: TableCoordinate) -> f32 {
        const AXIS: usize = ALPHAS * COSINES;
        REFLECTION.bilinear_from((2 * aspect + axis) * AXIS, COSINES, self.at_alpha, cosine)
    }

    /// The albedo of perfectly reflecting microfacets.
    #[inline(always)]
    pub fn directional_albedo(&self, w: Vec3) -> f32 {
        let coordinates = self.coordinates(w);
        if self.aspect == 1.0 {
            return self.single_reflection(ASPECTS - 1, 0, coordinates.cosine);
        }
        let at = TableCoordinate::new(self.aspect.sqrt(), ASPECTS);
        let of = |axis: usize| {
            let (before, after) = (
                self.single_reflection(at.node, axis, coordinates.cosine),
                self.single_reflection(at.node + 1, axis, coordinates.cosine),
            );
            before + (after - before) * at.part
        };
        let (along, across) = (of(0), of(1));
        along + (across - along) * coordinates.across
    }

    /// 1 minus the mean of [`Energy::directional_albedo`] under diffuse light.
    pub fn average_missing_energy(&self) -> f32 {
        let missing = REFLECTION_AVERAGE
            .bilinear_square(0, ALPHAS, TableCoordinate::new(self.aspect.sqrt(), ASPECTS), self.at_alpha)
            .max(MIN_LOST);
        // Between the axes of anisotropic microfacets the table is interpolated: rather a hundredth of the lobe too
        // dark than too bright.
        if self.aspect == 1.0 { missing } else { 1.01 * missing }
    }

    /// What mirrors of reflectance `(1 - cos)^5` would scatter: Schlick's approximation is linear in this and
    /// [`Energy::directional_albedo`]. Of anisotropic microfacets at least that, to a hundredth, and 0.02 more on
    /// average.
    #[inline(always)]
    pub fn schlick(&self, w: Vec3) -> f32 {
        let cos = w.z.clamp(0.0, 1.0);
        let weight = isotropic_schlick(cos, self.alpha, self.at_alpha);
        if self.aspect == 1.0 {
            return weight;
        }
        let alpha = self.grazed_alpha(w);
        weight.max(isotropic_schlick(cos, alpha, TableCoordinate::of_alpha(alpha)))
    }

    /// Alpha of round microfacets that grazing light from `w` meets at the angles at which it meets these, or at
    /// greater ones.
    #[inline]
    fn grazed_alpha(&self, w: Vec3) -> f32 {
        let [ax, ay] = self.ggx.alpha();
        let (x2, y2) = ((ax * w.x) * (ax * w.x), (ay * w.y) * (ay * w.y));
        let run2 = x2 + y2;
        if run2 <= 0.0 {
            return self.alpha;
        }
        // Where alpha is divided out, visible normals are distributed by their cosine with the direction. Its square
        // has the mean 1/2, those with the two axes across have 1/4 each. Round microfacets show as much of their
        // normals for alpha² = q / (1 - 3 q).
        let (ax2, ay2) = (ax * ax, ay * ay);
        let along = (ax2 * x2 + ay2 * y2) / run2;
        let across = (ax2 * y2 + ay2 * x2) / run2;
        let skew = (x2 * y2).sqrt() / run2 * (ax2 - ay2).abs();
        let q = run2 / (w.x * w.x + w.y * w.y) / (1.0 + 2.0 * along + across + skew);
        let alpha = if q < 0.25 { (q / (1.0 - 3.0 * q)).sqrt() } else { 1.0 };
        // Fitted, so that hardly any weight is too small.
        alpha * (0.78 + 0.22 * self.aspect)
    }

    /// What dielectric microfacets reflect and refract together, for the index of refraction beyond them over that on
    /// this side, within `[1/10, 10]`. Of isotropic microfacets.
    #[inline(always)]
    pub fn dielectric_albedo(&self, eta: f32, w: Vec3) -> f32 {
        const SIDE: usize = ALPHAS * IORS * COSINES;
        let start = if eta >= 1.0 { 0 } else { SIDE };
        let ior = if eta >= 1.0 { eta } else { 1.0 / eta };
        let coordinates = self.coordinates(w);
        GLASS.trilinear(start, [IORS, COSINES], [self.at_alpha, TableCoordinate::of_ior(ior), coordinates.cosine])
    }

    /// 1 minus the mean of [`Energy::dielectric_albedo`] under diffuse light.
    pub fn dielectric_average_missing_energy(&self, eta: f32) -> f32 {
        let (start, ior) = if eta >= 1.0 { (0, eta) } else { (ALPHAS * IORS, 1.0 / eta) };
        GLASS_AVERAGE.bilinear_square(start, IORS, self.at_alpha, TableCoordinate::of_ior(ior)).max(MIN_LOST)
    }
}

/// [`Energy::schlick`] of isotropic microfacets.
#[inline(always)]
fn isotropic_schlick(cos: f32, alpha: f32, at_alpha: TableCoordinate) -> f32 {
    SCHLICK.bilinear_from(0, COSINES, at_alpha, TableCoordinate::of_cosine(cos, alpha))
        + schlick_weight(smoothed(cos, alpha))
}

/// Colour of light that leaves after more than one reflection, over what perfect mirrors would leave for it, where
/// `reflectance` is the mean reflectance and `average` what perfect mirrors scatter at once under diffuse light: `sum_k
/// reflectance^k (1 - average)^(k - 2) average` from `k = 2` on.
#[inline]
pub fn multiple_color(reflectance: f32, average: f32) -> f32 {
    reflectance * reflectance * average / (1.0 - reflectance * (1.0 - average)).max(f32::MIN_POSITIVE)
}

/// Albedo of the principled model's white diffuse lobe, with `flat` of it the flat lobe.
#[inline(always)]
pub fn principled_diffuse(roughness: f32, subsurface: f32, cos: f32) -> f32 {
    let (shape, at) = (TableCoordinate::new(roughness, SHAPES), TableCoordinate::of_cosine(cos, 1.0));
    const KIND: usize = SHAPES * COSINES;
    let diffuse = DIFFUSE.bilinear_from(0, COSINES, shape, at);
    if subsurface == 0.0 {
        diffuse
    } else {
        diffuse + (DIFFUSE.bilinear_from(KIND, COSINES, shape, at) - diffuse) * subsurface
    }
}

/// Albedo of the principled model's sheen.
#[inline]
pub fn principled_sheen(cos: f32) -> f32 {
    let at = TableCoordinate::of_cosine(cos, 1.0);
    SHEEN.linear(at.node, at.part)
}

/// Albedo of the principled model's clear coat.
#[inline]
pub fn principled_clear_coat(gloss: f32, cos: f32) -> f32 {
    CLEAR_COAT.bilinear_from(0, COSINES, TableCoordinate::new(gloss, SHAPES), TableCoordinate::of_cosine(cos, 1.0))
}

/// Albedo of a clear coat of isotropic microfacets, for an index of refraction over that of the outside within `[1,
/// 10]`.
#[inline]
pub fn coat_albedo(ior: f32, alpha: f32, cos: f32) -> f32 {
    let at =
        [TableCoordinate::of_alpha(alpha), TableCoordinate::of_ior(ior), TableCoordinate::new(cos.sqrt(), COAT_NODES)];
    COAT.trilinear(0, [IORS, COAT_NODES], at)
}

/// Its mean under diffuse light.
pub fn coat_average(ior: f32, alpha: f32) -> f32 {
    COAT_AVERAGE.bilinear_from(0, IORS, TableCoordinate::of_alpha(alpha), TableCoordinate::of_ior(ior))
}
