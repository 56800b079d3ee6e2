//! Lights that are not shapes, as written.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::TransformDesc;

/// A light that is not a shape.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum LightDesc {
    /// Radiant intensity from a point, the same in every direction.
    Point(PointLightDesc),
    /// Radiant intensity from a point within a cone.
    Spot(SpotLightDesc),
    /// Light from infinitely far away, such as the sun.
    Directional(DirectionalLightDesc),
    /// Light from every direction, constant or from an image.
    Environment(EnvironmentLightDesc),
}

/// A point light: the irradiance at distance d is `intensity / d²`.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PointLightDesc {
    /// Where it stands.
    pub position: [f64; 3],
    /// Radiant intensity (power per solid angle), linear RGB.
    pub intensity: [f32; 3],
}

/// A spot light: full intensity within `beam_angle_degrees`, none outside `cutoff_angle_degrees`, a smooth fall between.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpotLightDesc {
    /// Where it stands.
    pub position: [f64; 3],
    /// A point it shines at.
    pub look_at: [f64; 3],
    /// Radiant intensity along the axis, linear RGB.
    pub intensity: [f32; 3],
    /// Half-angle in degrees outside which there is no light, above 0 and at most 180. Default: 20.
    #[serde(default = "default_cutoff")]
    pub cutoff_angle_degrees: f64,
    /// Half-angle in degrees within which the intensity is full. Default: three quarters of the cutoff.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub beam_angle_degrees: Option<f64>,
}

fn default_cutoff() -> f64 {
    20.0
}

/// A directional light.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DirectionalLightDesc {
    /// The direction in which light travels; any length.
    pub direction: [f64; 3],
    /// Irradiance on a surface perpendicular to the direction, linear RGB.
    pub irradiance: [f32; 3],
    /// Full angle in degrees that the light subtends, from 0 (a perfectly sharp shadow) to below 180; the sun has 0.53. A light with an
    /// angle is visible to rays that leave the scene. Default: 0.
    #[serde(default)]
    pub angular_diameter_degrees: f64,
}

/// Light from every direction; give `radiance` or `file`.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EnvironmentLightDesc {
    /// Constant radiance, linear RGB.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radiance: Option<[f32; 3]>,
    /// A lat-long image (EXR or HDR), relative to the scene file. The image's top is +Y; its middle column is -Z, and +X lies at three
    /// quarters of the width.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// Factor on the radiance. Default: 1.
    #[serde(default = "one")]
    pub scale: f32,
    /// Rotation of the environment (translations are ignored; scales are an error).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub transform: Option<TransformDesc>,
}

fn one() -> f32 {
    1.0
}
