//! The camera as written.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::TransformDesc;

/// A perspective camera with an optional thin lens. Placed either by `position`, `look_at` and `up`, or by `transform`, which maps camera
/// space (looking along -Z, +Y up) to the world.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CameraDesc {
    /// Where the camera stands, in world units.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub position: Option<[f64; 3]>,
    /// The point it looks at.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub look_at: Option<[f64; 3]>,
    /// The direction that appears upright. Default: +Y.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub up: Option<[f64; 3]>,
    /// Camera to world, in place of `position`, `look_at` and `up`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub transform: Option<TransformDesc>,
    /// Full vertical angle of view in degrees, above 0 and below 180. Default: 40.
    #[serde(default = "default_fov")]
    pub vertical_fov_degrees: f64,
    /// A thin lens; without it everything is in focus.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lens: Option<LensDesc>,
}

fn default_fov() -> f64 {
    40.0
}

/// A thin lens: an aperture (`radius`, or `f_number` with `focal_length`) and a focus (`focus_distance` or `focus_point`).
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LensDesc {
    /// Radius of the aperture, in world units.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radius: Option<f64>,
    /// Focal length over aperture diameter; needs `focal_length`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub f_number: Option<f64>,
    /// Focal length, in world units: the aperture's radius is `focal_length / (2 f_number)`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub focal_length: Option<f64>,
    /// Distance of the plane in focus along the view axis, in world units.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub focus_distance: Option<f64>,
    /// A point of the plane in focus.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub focus_point: Option<[f64; 3]>,
}
