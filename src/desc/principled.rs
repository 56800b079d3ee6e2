//! The principled material as written, and the table of its parameters.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{CoefficientDesc, ColorDesc, RangedDesc, ScalarDesc};

/// The parameters of the principled model in one table: `$generate!` gets the documentation, name, kind and default of
/// each. A `scalar` is within `[0, 1]`; `specular` and `ior` exclude each other.
macro_rules! principled_parameters {
    ($generate:ident) => {
        $generate! {
            /// Colour of the base, the metal and the glass. Default: 0.5.
            base_color: color = 0.5,
            /// How much of the surface is metal. Default: 0.
            metallic: scalar = 0.0,
            /// From sharp to blurred highlights; GGX alpha is its square, at least 0.001. Default: 0.5.
            roughness: scalar = 0.5,
            /// How much highlights are stretched along u. Default: 0.
            anisotropic: scalar = 0.0,
            /// Reflectance of the dielectric layer ahead, in units of 0.08. Default: 0.5, unless `ior` is given.
            #[serde(skip_serializing_if = "Option::is_none")]
            specular: specular = None,
            #[doc = " Index of refraction, from 1 to 10, in place of `specular`. Glass that is not `thin` takes at \
least 1.05, and no texture for either."]
            #[serde(skip_serializing_if = "Option::is_none")]
            ior: ior = 1.5,
            /// How much of the base's colour the dielectric layer reflects ahead. Default: 0.
            specular_tint: scalar = 0.0,
            /// Strength of a sheen at grazing angles, as of cloth. Default: 0.
            sheen: scalar = 0.0,
            /// How much the sheen has the base's colour. Default: 0.5.
            sheen_tint: scalar = 0.5,
            /// Strength of the clear coat. Default: 0.
            clearcoat: scalar = 0.0,
            /// From a satin to a glossy coat. Default: 1.
            clearcoat_gloss: scalar = 1.0,
            /// How much of what the diffuse base scatters is scattered below the surface: by `subsurface_method` a
            /// flatter lobe that resembles it, or a random walk. Default: 0.
            subsurface: scalar = 0.0,
            /// How much of what is not metal is glass, whose inside is the side against the normal. Default: 0.
            transmission: scalar = 0.0,
            /// Whether the surface is a thin sheet: nothing is bent, and both sides are the outside. Default: false.
            thin: flag = false,
            /// How much of what the diffuse base scatters leaves on the other side, for `thin` surfaces only. Default:
            /// 0.
            diffuse_transmission: scalar = 0.0,
            /// Whether light that rough microfacets scatter several times is kept. Default: true.
            multiscatter: flag = true,
            /// Whose formulas the lobes have. Default: `burley`.
            #[serde(skip_serializing_if = "PrincipledModelDesc::is_burley")]
            model: model = Burley,
        }
    };
}
pub(crate) use principled_parameters;

/// The type of a parameter as written, and its default.
macro_rules! written {
    (color) => { ColorDesc };
    (scalar) => { ScalarDesc };
    (specular) => { Option<ScalarDesc> };
    (ior) => { Option<RangedDesc> };
    (flag) => { bool };
    (model) => { PrincipledModelDesc };
    (color $default:expr) => { ColorDesc::Grey($default) };
    (scalar $default:expr) => { ScalarDesc::Constant($default) };
    (flag $default:expr) => { $default };
    (model $default:ident) => { PrincipledModelDesc::$default };
    ($excluded:ident $default:expr) => { None };
}

macro_rules! describe {
    ($($(#[doc = $doc:literal])* $(#[serde $serde:tt])? $name:ident: $kind:ident = $default:tt,)*) => {
        /// Disney's principled model ("Physically Based Shading at Disney" and its extension to transmission): a clear
        /// coat over a blend of metal, a diffuse base below a dielectric layer, and glass. Every number is within
        /// `[0, 1]` unless noted otherwise, and may come from a texture. It never scatters more than it receives.
        #[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
        #[serde(default, deny_unknown_fields)]
        pub struct PrincipledDesc {
            $($(#[doc = $doc])* $(#[serde $serde])? pub $name: written!($kind),)*
            /// What `subsurface` is. Default: `flat`.
            #[serde(skip_serializing_if = "SubsurfaceMethodDesc::is_flat")]
            pub subsurface_method: SubsurfaceMethodDesc,
            /// Of `random_walk`: the mean way, in world units, after which light below the surface has lost its
            /// direction, above 0: one number, or one for each of red, green and blue. Default: 1, 0.2, 0.1.
            #[serde(skip_serializing_if = "Option::is_none")]
            pub subsurface_radius: Option<CoefficientDesc>,
            /// Factor on `subsurface_radius`, above 0. Default: 1.
            #[serde(skip_serializing_if = "Option::is_none")]
            pub subsurface_scale: Option<f32>,
            /// Of `random_walk`: the mean cosine of a single scattering, from -0.9 to 0.9. Default: 0.
            #[serde(skip_serializing_if = "Option::is_none")]
            pub subsurface_anisotropy: Option<f32>,
        }

        impl Default for PrincipledDesc {
            fn default() -> Self {
                Self {
                    $($name: written!($kind $default),)*
                    subsurface_method: SubsurfaceMethodDesc::Flat,
                    subsurface_radius: None,
                    subsurface_scale: None,
                    subsurface_anisotropy: None,
                }
            }
        }
    };
}
principled_parameters!(describe);

/// Whose formulas the lobes of the principled model have.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PrincipledModelDesc {
    /// Burley's, with lobes limited so that nothing is gained.
    #[default]
    Burley,
    /// Those of Mitsuba 3's `principled`, for agreement with its scenes: the lobes are added whatever their sum, and
    /// light that microfacets scatter several times is lost, whatever `multiscatter` is.
    Mitsuba,
}

impl PrincipledModelDesc {
    /// Whether it is the default.
    pub fn is_burley(&self) -> bool {
        *self == Self::Burley
    }
}

/// What the subsurface scattering of the principled model is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SubsurfaceMethodDesc {
    /// A lobe that is flatter than the diffuse one: light leaves where it arrives.
    #[default]
    Flat,
    /// Light enters, is scattered within the closed surface and leaves it elsewhere, with the base's colour on flat
    /// ground. Other integrators than `path` take the flat lobe.
    RandomWalk,
}

impl SubsurfaceMethodDesc {
    /// Whether it is the default.
    pub fn is_flat(&self) -> bool {
        *self == Self::Flat
    }
}
