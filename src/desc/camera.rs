//! The camera as written.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::lists::{OneOrMore, one_or_more};
use super::{KeyframeDesc, TransformDesc};

/// A camera. Placed either by `position`, `look_at` and `up`, or by `transform`, which maps camera space (looking along
/// -Z, +Y up) to the world.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CameraDesc {
    /// How points of the picture become directions. Default: `perspective`.
    #[serde(rename = "type", default)]
    pub kind: CameraKindDesc,
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
    /// Full vertical angle of view of a perspective camera in degrees, above 0 and below 180. Default: 40.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub vertical_fov_degrees: Option<f64>,
    /// What an orthographic camera shows from the lower to the upper edge of the picture, in world units, above 0;
    /// needed there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub view_height: Option<f64>,
    /// A thin lens for a perspective camera; without it everything is in focus.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lens: Option<LensDesc>,
    /// Moves the picture to the right and up by these shares of its width and height, as a lens does that is moved
    /// against its film: verticals stay parallel. From -10 to 10; not for an environment camera. Default: [0, 0].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shift: Option<[f64; 2]>,
    /// Width of a pixel over its height, from 0.01 to 100: 2 for a picture that will be shown at twice its width. Not
    /// for an environment camera. Default: 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pixel_aspect: Option<f64>,
    /// What is nearer is not seen: depth along the view axis (distance from an environment camera) in world units, not
    /// negative. Shadows, reflections and light are not cut. Default: 0.
    #[serde(default)]
    pub near: f64,
    /// When the shutter opens and closes, in the time of the keyframes of all `motion`: finite, the second not below
    /// the first. Where both are the same, the picture shows that moment without blur. Default: [0, 1].
    #[serde(default = "default_shutter")]
    pub shutter: [f64; 2],
    /// How the camera moves: what its placement is followed by at each time, rotations and translations. Default: not
    /// at all.
    #[serde(default, deserialize_with = "one_or_more", skip_serializing_if = "Vec::is_empty")]
    #[schemars(with = "OneOrMore<KeyframeDesc>")]
    pub motion: Vec<KeyframeDesc>,
}

/// How points of the picture become directions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CameraKindDesc {
    /// All rays meet in the camera, a pinhole or the middle of a lens.
    #[default]
    Perspective,
    /// All rays are parallel.
    Orthographic,
    /// Every direction in one picture (best twice as wide as high): columns are the angle about +Y, rows that from +Y,
    /// laid out as the images of environment lights are. The middle of the picture is the direction looked at.
    Environment,
}

impl Default for CameraDesc {
    fn default() -> Self {
        Self {
            kind: CameraKindDesc::default(),
            position: None,
            look_at: None,
            up: None,
            transform: None,
            vertical_fov_degrees: None,
            view_height: None,
            lens: None,
            shift: None,
            pixel_aspect: None,
            near: 0.0,
            shutter: default_shutter(),
            motion: Vec::new(),
        }
    }
}

fn default_shutter() -> [f64; 2] {
    [0.0, 1.0]
}

/// A thin lens: an aperture and a focus.
///
/// The aperture is a `radius`, or an `f_number`, which needs the focal length. The focus is a `focus_distance` or a
/// `focus_point`; or it follows from `focal_length` and the distance of the sensor by the lens equation 1 / f = 1 / a +
/// 1 / b (f the focal length, a the distance from the lens to the sensor, b that to the plane in focus). Where the
/// focus and the sensor are given but no `focal_length`, the same equation gives it. The sensor is given by
/// `sensor_distance`, or by `sensor_height`, from which the angle of view gives its distance.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LensDesc {
    /// Radius of the aperture, in world units; with blades, that of the circle through the corners.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radius: Option<f64>,
    /// Focal length over aperture diameter: the aperture's radius is `focal_length / (2 f_number)`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub f_number: Option<f64>,
    /// Focal length, in world units.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub focal_length: Option<f64>,
    /// Distance of the plane in focus along the view axis, in world units.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub focus_distance: Option<f64>,
    /// A point of the plane in focus.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub focus_point: Option<[f64; 3]>,
    /// Distance from the lens to the sensor, in world units; above the focal length.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sensor_distance: Option<f64>,
    /// Height of the sensor, in world units: its distance is `sensor_height / (2 tan(fov / 2))`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sensor_height: Option<f64>,
    /// Blades that make the aperture a polygon; without them it is a disk.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub blades: Option<BladesDesc>,
}

/// The blades of an aperture: highlights out of focus have the shape of the regular polygon between them.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BladesDesc {
    /// How many, from 3 to 64.
    pub count: u32,
    /// Angle of the first corner in degrees, counter-clockwise from the right as the camera looks. Default: 0.
    #[serde(default)]
    pub rotation_degrees: f64,
}
