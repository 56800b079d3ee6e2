//! Parameters of the principled model.

use crate::color::Rgb;
use crate::desc::principled_parameters;

/// The type of a parameter, and its default.
macro_rules! value {
    (color) => { Rgb };
    (specular) => { Option<f32> };
    (flag) => { bool };
    (model) => { PrincipledModel };
    ($number:ident) => { f32 };
    (color $default:expr) => { Rgb::splat($default) };
    (model $default:ident) => { PrincipledModel::$default };
    ($kind:ident $default:expr) => { $default };
}

macro_rules! parameters {
    ($($(#[doc = $doc:literal])* $(#[serde $serde:tt])? $name:ident: $kind:ident = $default:tt,)*) => {
        /// Parameters of the principled model, within `[0, 1]` where nothing else is said.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct PrincipledParameters {
            $($(#[doc = $doc])* pub $name: value!($kind),)*
        }

        impl Default for PrincipledParameters {
            fn default() -> Self {
                Self { $($name: value!($kind $default),)* }
            }
        }
    };
}
principled_parameters!(parameters);

/// Whose formulas the lobes of the principled model have.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PrincipledModel {
    /// Burley's, limited so that nothing is gained.
    #[default]
    Burley,
    /// Those of Mitsuba 3's `principled`, which are not limited, and lose light scattered several times.
    Mitsuba,
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
