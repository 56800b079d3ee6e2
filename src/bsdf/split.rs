//! Which part of what is reflected is diffuse, for layers that show diffuse and specular light apart.

use super::Bsdf;
use crate::color::Rgb;
use crate::math::Vec3;

impl Bsdf {
    /// The share, by channel, of diffuse reflection in the value of [`eval`](Self::eval), for directions on the same
    /// side: within `[0, 1]`, 0 where all of it is specular. The sheen counts as diffuse, and light that microfacets
    /// scatter several times and all that was measured as specular. Delta lobes, which have no value, are specular.
    pub fn diffuse_fraction(&self, wo: Vec3, wi: Vec3) -> Rgb {
        match self {
            Self::Lambert(_) | Self::Eon(_) | Self::DiffuseTransmission(_) | Self::Phase(_) => Rgb::WHITE,
            Self::Mirror(_)
            | Self::Conductor(_)
            | Self::Dielectric(_)
            | Self::ThinDielectric(_)
            | Self::Hair(_)
            | Self::Measured(_) => Rgb::BLACK,
            Self::Glossy(bsdf) => bsdf.diffuse_fraction(wo, wi),
            Self::Phong(bsdf) => bsdf.diffuse_fraction(wo, wi),
            Self::Plastic(bsdf) => bsdf.diffuse_fraction(wo, wi),
            Self::Principled(bsdf) => bsdf.diffuse_fraction(wo, wi),
            Self::Coated(bsdf) => bsdf.diffuse_fraction(wo, wi),
            Self::Beckmann(bsdf) => bsdf.diffuse_fraction(wo, wi),
            Self::SeparableGgx(bsdf) => bsdf.diffuse_fraction(wo, wi),
        }
    }
}

/// The share of a part in the whole, by channel; 0 of nothing.
#[inline]
pub(super) fn share(part: Rgb, whole: Rgb) -> Rgb {
    let of = |part: f32, whole: f32| if whole > 0.0 { (part / whole).clamp(0.0, 1.0) } else { 0.0 };
    Rgb::new(of(part.r, whole.r), of(part.g, whole.g), of(part.b, whole.b))
}
