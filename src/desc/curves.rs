//! What curves are made of.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How the control points of a strand make a curve.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CurveBasisDesc {
    /// Straight lines from one to the next, at least 2 points; spheres round the corners of tubes.
    Linear,
    /// Joined cubic Bezier curves: 3n + 1 points.
    Bezier,
    /// A uniform cubic B-spline: at least 4 points. It does not reach its end points unless they are tripled.
    #[default]
    BSpline,
    /// A uniform Catmull-Rom spline: at least 4 points. It passes through all of them but the first and the last.
    CatmullRom,
}

/// What the surface of curves is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CurveKindDesc {
    /// A tube.
    #[default]
    Round,
    /// A flat ribbon, twice the radius wide, that faces each ray. With the material `hair` it is as `cylinder`.
    Flat,
    /// As `flat`, with the normals of a tube: cheaper than `round`, and the same for thin hair.
    Cylinder,
}

pub(super) fn radius_scale() -> f64 {
    1.0
}
