//! Extreme parameters for tests and checks.

use super::PrincipledParameters;
use crate::color::Rgb;

impl PrincipledParameters {
    /// A corner of the unit cube of ten parameters, for a white base; from bit 10 on: a thin sheet, half diffuse
    /// transmission.
    pub fn white_corner(bits: u32) -> Self {
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
