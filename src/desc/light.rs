//! Lights that are not shapes, as written.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::TransformDesc;
use super::lists::{Spread, spread, spread_option};

/// A light that is not a shape.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum LightDesc {
    /// Radiant intensity from a point, the same in every direction.
    Point(PointLightDesc),
    /// Radiant intensity from a point within a cone.
    Spot(SpotLightDesc),
    /// A picture that is thrown from a point.
    Projector(ProjectorLightDesc),
    /// Radiant intensity by direction, as a luminaire was measured.
    Ies(IesLightDesc),
    /// Light from infinitely far away, such as the sun.
    Directional(DirectionalLightDesc),
    /// Light from every direction, constant or from an image.
    Environment(EnvironmentLightDesc),
}

impl LightDesc {
    /// The group that the light is in.
    pub fn group(&self) -> Option<&str> {
        match self {
            Self::Point(light) => light.group.as_deref(),
            Self::Spot(light) => light.group.as_deref(),
            Self::Projector(light) => light.group.as_deref(),
            Self::Ies(light) => light.group.as_deref(),
            Self::Directional(light) => light.group.as_deref(),
            Self::Environment(light) => light.group.as_deref(),
        }
    }
}

/// Light emitted by a shape.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EmissionDesc {
    /// Radiance, linear RGB.
    #[serde(deserialize_with = "spread")]
    #[schemars(with = "Spread<3>")]
    pub radiance: [f32; 3],
    /// A texture by name whose colour multiplies the radiance. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub texture: Option<String>,
    /// Whether both sides emit; otherwise only the front does.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub two_sided: bool,
    /// Whether the shape, with both its sides, is hidden from the camera, whose rays pass through it; mirror images of
    /// it and what is seen through glass stay. Default: false.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub hidden: bool,
    /// The light group, by name (letters, digits and underscores): the contribution of each group can be stored as an
    /// AOV. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub group: Option<String>,
}

/// A point light: the irradiance at distance d is `intensity / d²`.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PointLightDesc {
    /// Where it stands.
    pub position: [f64; 3],
    /// Radiant intensity (power per solid angle), linear RGB.
    #[serde(deserialize_with = "spread")]
    #[schemars(with = "Spread<3>")]
    pub intensity: [f32; 3],
    /// The light group, by name (letters, digits and underscores): the contribution of each group can be stored as an
    /// AOV. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub group: Option<String>,
}

/// A spot light: full intensity within `beam_angle_degrees`, none outside `cutoff_angle_degrees`, a smooth fall
/// between.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpotLightDesc {
    /// Where it stands.
    pub position: [f64; 3],
    /// A point it shines at.
    pub look_at: [f64; 3],
    /// Radiant intensity along the axis, linear RGB.
    #[serde(deserialize_with = "spread")]
    #[schemars(with = "Spread<3>")]
    pub intensity: [f32; 3],
    /// Half-angle in degrees outside which there is no light, above 0 and at most 180. Default: 20.
    #[serde(default = "default_cutoff")]
    pub cutoff_angle_degrees: f64,
    /// Half-angle in degrees within which the intensity is full. Default: three quarters of the cutoff.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub beam_angle_degrees: Option<f64>,
    /// A texture by name that multiplies the intensity, in perspective: its unit square of uv lies around the cone,
    /// whose cutoff is then below 90 degrees. u grows to the right and v upward for one who looks along the axis.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub texture: Option<String>,
    /// For the texture: a direction that is up, not that of the axis. Default: +Y (-Z if the axis lies along Y).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub up: Option<[f64; 3]>,
    /// The light group, by name (letters, digits and underscores): the contribution of each group can be stored as an
    /// AOV. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub group: Option<String>,
}

/// A light that throws a picture in perspective, as a projector does: on a plane across its axis at distance d, the
/// irradiance is that of the picture over d².
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ProjectorLightDesc {
    /// Where it stands.
    pub position: [f64; 3],
    /// A point it shines at, the middle of the picture.
    pub look_at: [f64; 3],
    /// A direction that is up in the picture, not that of the axis. Default: +Y (-Z if the axis lies along Y).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub up: Option<[f64; 3]>,
    /// The picture: a texture by name, of which the unit square of uv is shown. Default: white.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub texture: Option<String>,
    /// Factor on the picture: irradiance on the plane at distance 1, linear RGB. Default: [1, 1, 1].
    #[serde(default = "white", deserialize_with = "spread")]
    #[schemars(with = "Spread<3>")]
    pub irradiance: [f32; 3],
    /// Full angle in degrees from the picture's lower edge to its upper edge, above 0 and below 180.
    pub vertical_fov_degrees: f64,
    /// Width over height, above 0. Default: that of the image, if the texture is one; else 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub aspect: Option<f64>,
    /// The light group, by name (letters, digits and underscores): the contribution of each group can be stored as an
    /// AOV. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub group: Option<String>,
}

fn default_cutoff() -> f64 {
    20.0
}

/// A light as measured: a photometric file (IES LM-63, type C) gives the intensity by direction, bilinear between its
/// angles, nothing beyond them.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct IesLightDesc {
    /// The `.ies` file, relative to the scene file. Its multipliers and ballast factors are applied; tables for a
    /// tilted lamp are not.
    pub file: String,
    /// Where the light stands.
    pub position: [f64; 3],
    /// A point that the file's nadir (vertical angle 0) is turned to. Default: straight down, along -Y.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub look_at: Option<[f64; 3]>,
    /// Turn about the nadir in degrees, counter-clockwise seen along it (from above, if the light hangs). Without a
    /// turn, the file's horizontal angle 0 points towards +X (+Y, if the nadir lies along X). Default: 0.
    #[serde(default)]
    pub rotation_degrees: f64,
    /// Radiant intensity for each candela of the file, linear RGB. Default: [1, 1, 1].
    #[serde(default = "white", deserialize_with = "spread")]
    #[schemars(with = "Spread<3>")]
    pub intensity: [f32; 3],
    /// The light group, by name (letters, digits and underscores): the contribution of each group can be stored as an
    /// AOV. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub group: Option<String>,
}

fn white() -> [f32; 3] {
    [1.0; 3]
}

/// A directional light.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DirectionalLightDesc {
    /// The direction in which light travels; any length.
    pub direction: [f64; 3],
    /// Irradiance on a surface perpendicular to the direction, linear RGB.
    #[serde(deserialize_with = "spread")]
    #[schemars(with = "Spread<3>")]
    pub irradiance: [f32; 3],
    /// Full angle in degrees that the light subtends, from 0 (a perfectly sharp shadow) to below 180; the sun has 0.53.
    /// A light with an angle is visible to rays that leave the scene. Default: 0.
    #[serde(default)]
    pub angular_diameter_degrees: f64,
    /// The light group, by name (letters, digits and underscores): the contribution of each group can be stored as an
    /// AOV. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub group: Option<String>,
}

/// Light from every direction; give `radiance` or `file`.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EnvironmentLightDesc {
    /// Constant radiance, linear RGB.
    #[serde(default, deserialize_with = "spread_option", skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Spread<3>>")]
    pub radiance: Option<[f32; 3]>,
    /// A lat-long image (EXR or HDR), relative to the scene file. The image's top is +Y; its middle column is -Z, and
    /// +X lies at three quarters of the width.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// Factor on the radiance. Default: 1.
    #[serde(default = "one")]
    pub scale: f32,
    /// Rotation of the environment (translations are ignored; scales are an error).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub transform: Option<TransformDesc>,
    /// The light group, by name (letters, digits and underscores): the contribution of each group can be stored as an
    /// AOV. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub group: Option<String>,
}

fn one() -> f32 {
    1.0
}

/// How one light among several is chosen for a light sample.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LightSamplerDesc {
    /// In proportion to an estimate of its contribution at the shading point, by a light tree; lights at infinity by
    /// their power.
    #[default]
    Tree,
    /// In proportion to its power: faster samples, with much more noise where there are many lights.
    Power,
}

impl LightSamplerDesc {
    pub(super) fn is_default(&self) -> bool {
        *self == Self::default()
    }
}
