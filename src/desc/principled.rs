//! The principled material as written.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{ColorDesc, RangedDesc, ScalarDesc};

/// Disney's principled model ("Physically Based Shading at Disney" and its extension to transmission): a clear coat
/// over a blend of metal, a diffuse base below a dielectric layer, and glass. Every number is within `[0, 1]` unless it
/// says otherwise and may come from a texture. It never scatters more than it receives.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PrincipledDesc {
    /// Colour of the base, the metal and the glass. Default: 0.5.
    #[serde(default = "half_color")]
    pub base_color: ColorDesc,
    /// How much of the surface is metal. Default: 0.
    #[serde(default = "zero")]
    pub metallic: ScalarDesc,
    /// From sharp to blurred highlights; GGX alpha is its square, at least 0.001. Default: 0.5.
    #[serde(default = "half")]
    pub roughness: ScalarDesc,
    /// How much highlights are stretched along u. Default: 0.
    #[serde(default = "zero")]
    pub anisotropic: ScalarDesc,
    /// Reflectance of the dielectric layer ahead, in units of 0.08. Default: 0.5, unless `ior` is given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub specular: Option<ScalarDesc>,
    /// Index of refraction, from 1 to 10, in place of `specular`. Glass that is not `thin` takes at least 1.05, and no texture for either.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ior: Option<RangedDesc>,
    /// How much of the base's colour the dielectric layer reflects ahead. Default: 0.
    #[serde(default = "zero")]
    pub specular_tint: ScalarDesc,
    /// Strength of a sheen at grazing angles, as of cloth. Default: 0.
    #[serde(default = "zero")]
    pub sheen: ScalarDesc,
    /// How much the sheen has the base's colour. Default: 0.5.
    #[serde(default = "half")]
    pub sheen_tint: ScalarDesc,
    /// Strength of the clear coat. Default: 0.
    #[serde(default = "zero")]
    pub clearcoat: ScalarDesc,
    /// From a satin to a glossy coat. Default: 1.
    #[serde(default = "one")]
    pub clearcoat_gloss: ScalarDesc,
    /// From the diffuse lobe to a flatter one that resembles subsurface scattering. Default: 0.
    #[serde(default = "zero")]
    pub subsurface: ScalarDesc,
    /// How much of what is not metal is glass, whose inside is the side against the normal. Default: 0.
    #[serde(default = "zero")]
    pub transmission: ScalarDesc,
    /// Whether the surface is a thin sheet: nothing is bent, and both sides are the outside. Default: false.
    #[serde(default)]
    pub thin: bool,
    /// How much of what the diffuse base scatters leaves on the other side, for `thin` surfaces only. Default: 0.
    #[serde(default = "zero")]
    pub diffuse_transmission: ScalarDesc,
    /// Whether light that rough microfacets scatter several times is kept. Default: true.
    #[serde(default = "yes")]
    pub multiscatter: bool,
    /// Whose formulas the lobes have. Default: `burley`.
    #[serde(default, skip_serializing_if = "PrincipledModelDesc::is_burley")]
    pub model: PrincipledModelDesc,
}

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

fn half_color() -> ColorDesc {
    ColorDesc::Grey(0.5)
}

fn zero() -> ScalarDesc {
    ScalarDesc::Constant(0.0)
}

fn half() -> ScalarDesc {
    ScalarDesc::Constant(0.5)
}

fn one() -> ScalarDesc {
    ScalarDesc::Constant(1.0)
}

fn yes() -> bool {
    true
}
