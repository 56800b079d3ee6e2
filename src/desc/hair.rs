//! Hair as written.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::ColorDesc;
use super::lists::{Spread, spread_option};

/// Hair and fur: light is scattered by each fibre as a whole (Chiang et al., "A Practical and Controllable Hair and Fur
/// Model for Production Path Tracing"), so it belongs on `curves`; on other shapes the fibres run along u. What fibres
/// absorb is given by one of `color`, `sigma_a`, or `eumelanin` and `pheomelanin`; default: eumelanin of 1.3, brown.
#[derive(Clone, Debug, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct HairDesc {
    /// The colour that many strands have together, each channel within `[0, 1]`; may be a texture.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub color: Option<ColorDesc>,
    /// Absorption in units of one over the radius, not below 0.
    #[serde(deserialize_with = "spread_option", skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Spread<3>>")]
    pub sigma_a: Option<[f32; 3]>,
    /// Concentration of the brown to black pigment, not below 0: 0.3 for blond, 1.3 for brown, 8 for black hair.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub eumelanin: Option<f32>,
    /// Concentration of the yellow to red pigment, not below 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pheomelanin: Option<f32>,
    /// Roughness along the fibre, within `[0, 1]`, of which at least 0.02 counts. Default: 0.3.
    pub longitudinal_roughness: HairRoughness,
    /// Roughness around the fibre, within `[0, 1]`, of which at least 0.02 counts. Default: 0.3.
    pub azimuthal_roughness: HairRoughness,
    /// Angle by which the scales of the fibre's surface are tilted towards its root. Default: 2 degrees.
    pub scale_tilt_degrees: HairTilt,
    /// Index of refraction of the fibre over that of the outside, above 1 and at most 10. Default: 1.55.
    pub ior: HairIor,
}

macro_rules! numbers {
    ($($(#[$doc:meta])* $name:ident = $default:literal;)*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
        #[serde(transparent)]
        pub struct $name(pub f32);

        impl Default for $name {
            fn default() -> Self {
                Self($default)
            }
        }
    )*};
}

numbers! {
    /// A roughness of hair.
    HairRoughness = 0.3;
    /// The tilt of its scales in degrees.
    HairTilt = 2.0;
    /// Its index of refraction.
    HairIor = 1.55;
}
