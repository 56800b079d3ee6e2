//! Parameters of the principled model.

use crate::color::Rgb;

/// Parameters of the principled model, within `[0, 1]` where nothing else is said.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrincipledParameters {
    /// Colour of the base, the metal and what is refracted.
    pub base_color: Rgb,
    /// How much of the surface is metal.
    pub metallic: f32,
    /// Square root of GGX's alpha; shape of the diffuse lobe.
    pub roughness: f32,
    /// How much the highlight is stretched along x.
    pub anisotropic: f32,
    /// Index of refraction over that of the outside, within `[1, 10]`; see [`PrincipledParameters::ior_of_specular`].
    pub ior: f32,
    /// How much the dielectric layer's reflection ahead has the base's colour.
    pub specular_tint: f32,
    /// Strength of the sheen.
    pub sheen: f32,
    /// How much the sheen has the base's colour.
    pub sheen_tint: f32,
    /// Strength of the clear coat.
    pub clearcoat: f32,
    /// Sharpness of the clear coat.
    pub clearcoat_gloss: f32,
    /// From the diffuse to the flat lobe.
    pub subsurface: f32,
    /// How much of what is not metal is glass.
    pub transmission: f32,
    /// How much of what the diffuse base of a thin sheet scatters goes to the other side.
    pub diffuse_transmission: f32,
    /// Whether the surface is a sheet with the outside on both sides.
    pub thin: bool,
    /// Whether light scattered by microfacets several times counts.
    pub multiscatter: bool,
    /// Whose formulas the lobes have.
    pub model: PrincipledModel,
}

/// Whose formulas the lobes of the principled model have.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PrincipledModel {
    /// Burley's, limited so that nothing is gained.
    #[default]
    Burley,
    /// Those of Mitsuba 3's `principled`, which are not limited, and lose light scattered several times.
    Mitsuba,
}

impl Default for PrincipledParameters {
    fn default() -> Self {
        Self {
            base_color: Rgb::splat(0.5),
            metallic: 0.0,
            roughness: 0.5,
            anisotropic: 0.0,
            ior: 1.5,
            specular_tint: 0.0,
            sheen: 0.0,
            sheen_tint: 0.5,
            clearcoat: 0.0,
            clearcoat_gloss: 1.0,
            subsurface: 0.0,
            transmission: 0.0,
            diffuse_transmission: 0.0,
            thin: false,
            multiscatter: true,
            model: PrincipledModel::Burley,
        }
    }
}

impl PrincipledParameters {
    /// The index of refraction whose reflectance ahead is `0.08 specular`.
    pub fn ior_of_specular(specular: f32) -> f32 {
        2.0 / (1.0 - (0.08 * specular).sqrt()) - 1.0
    }

    /// A corner of the unit cube of ten parameters, for a white base; from bit 10 on: a thin sheet, half diffuse transmission.
    pub(crate) fn white_corner(bits: u32) -> Self {
        let bit = |i: u32| (bits >> i & 1) as f32;
        let thin = bits >> 10 & 1 == 1;
        Self {
            base_color: Rgb::WHITE,
            metallic: bit(0),
            roughness: bit(1),
            anisotropic: bit(2),
            ior: Self::ior_of_specular(bit(3)),
            specular_tint: bit(4),
            sheen: bit(5),
            clearcoat: bit(6),
            clearcoat_gloss: bit(7),
            subsurface: bit(8),
            transmission: bit(9),
            thin,
            diffuse_transmission: if thin { 0.5 } else { 0.0 },
            ..Self::default()
        }
    }
}
