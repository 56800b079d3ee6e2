//! Transforms as written.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::lists::{OneOrMore, one_or_more};

/// A list of steps, applied in the order written: the first acts on the shape first. A single step needs no list.
#[derive(Clone, Debug, Default, Deserialize, Serialize, JsonSchema)]
#[serde(transparent)]
pub struct TransformDesc(
    #[serde(deserialize_with = "one_or_more")]
    #[schemars(with = "OneOrMore<TransformStepDesc>")]
    pub Vec<TransformStepDesc>,
);

impl TransformDesc {
    /// Whether there are no steps.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

/// A transform at one time of a motion; before the first and after the last the motion rests.
///
/// Where all keyframes have the same kinds of steps in the same order, each step is interpolated by itself: rotations
/// about the same axis by their angle (0 to 720 degrees are two turns), about different axes the short way round. A
/// `rotate` or `scale` that a keyframe lacks changes nothing there. So what is moved to the origin, rotated and moved
/// back turns in place, and what is moved and then rotated goes round the origin.
///
/// Other keyframes, such as a `matrix` and a `translate`, are interpolated as matrices: translation, rotation (the
/// short way round, evenly) and stretch each by itself, about the point which the steps before the first rotation move
/// to the origin.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct KeyframeDesc {
    /// When, in the time in which the camera's `shutter` is given: from 0 to 1 by default. Times must grow; they may
    /// lie outside of it.
    pub time: f64,
    /// The transform at that time.
    #[serde(default)]
    pub transform: TransformDesc,
}

/// One step of a transform.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum TransformStepDesc {
    /// Move by `[x, y, z]`.
    Translate([f64; 3]),
    /// Turn about an axis through the origin, counter-clockwise when looking against the axis.
    Rotate {
        /// The axis; any length.
        axis: [f64; 3],
        /// The angle in degrees.
        degrees: f64,
    },
    /// Scale by one factor, or by `[x, y, z]`.
    Scale(ScaleDesc),
    /// Move the origin to `from` and turn -Z towards `to` with +Y towards `up`.
    LookAt {
        /// Where the origin goes.
        from: [f64; 3],
        /// What -Z points at.
        to: [f64; 3],
        /// What +Y points towards. Default: +Y.
        #[serde(default = "y_axis")]
        up: [f64; 3],
    },
    /// A 4x4 matrix by rows; it multiplies column vectors, so the translation is the last column. The last row must be
    /// 0 0 0 1.
    Matrix([[f64; 4]; 4]),
}

/// One factor, or one for each axis.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(untagged, expecting = "expected one factor, or [x, y, z]")]
pub enum ScaleDesc {
    /// The same along every axis.
    Uniform(f64),
    /// Along x, y, z.
    PerAxis([f64; 3]),
}

fn y_axis() -> [f64; 3] {
    [0.0, 1.0, 0.0]
}
