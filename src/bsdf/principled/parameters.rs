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
            /// Whether `subsurface` is the share of light that enters the surface in place of the flat lobe.
            pub random_walk: bool,
        }

        impl Default for PrincipledParameters {
            fn default() -> Self {
                Self { $($name: value!($kind $default),)* random_walk: false }
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
}
