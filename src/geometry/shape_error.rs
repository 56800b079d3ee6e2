//! Why the parameters of an analytic shape are rejected.

/// Why the parameters of an analytic shape are rejected.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ShapeError {
    /// A length that must be finite and above zero.
    #[error("the {what} must be finite and above 0, not {value}")]
    NotPositive {
        /// Which parameter.
        what: &'static str,
        /// What was given.
        value: f64,
    },
    /// A length that must be finite and not below zero.
    #[error("the {what} must be finite and not below 0, not {value}")]
    Negative {
        /// Which parameter.
        what: &'static str,
        /// What was given.
        value: f64,
    },
    /// Both radii of a cone vanish.
    #[error("one of the two radii must be above 0")]
    NoRadius,
    /// The hole of a ring fills it.
    #[error("the inner radius {inner} must be below the radius {outer}")]
    Ring {
        /// Inner radius.
        inner: f64,
        /// Outer radius.
        outer: f64,
    },
    /// Heights that cut nothing, or everything, off a sphere.
    #[error("z_min {z_min} and z_max {z_max} must keep -{radius} <= z_min < z_max <= {radius}")]
    Heights {
        /// Lower cut.
        z_min: f64,
        /// Upper cut.
        z_max: f64,
        /// Radius of the sphere.
        radius: f64,
    },
    /// An angle outside `(0, 360°]`.
    #[error("the largest angle must be above 0 and at most 360 degrees, not {} degrees", .0.to_degrees())]
    Angle(f64),
    /// A coordinate of a point or vector that is not a finite number.
    #[error("the {0} is not finite")]
    NotFinite(&'static str),
    /// Edges of a parallelogram that span no area.
    #[error("the edges are parallel or zero")]
    NoArea,
    /// A Bezier profile whose number of points is not 3n + 1.
    #[error("a Bezier profile needs 3n + 1 points (4, 7, 10, ...), not {0}")]
    BezierCount(usize),
    /// A B-spline profile with too few points.
    #[error("a B-spline profile needs at least 4 points, not {0}")]
    BSplineCount(usize),
    /// A profile point, counted from 0, that is not finite.
    #[error("point {0} of the profile is not finite")]
    ProfilePoint(usize),
    /// A profile segment, counted from 0, that crosses the axis.
    #[error("segment {segment} of the profile reaches x = {x}; x is a distance from the axis and must not be negative")]
    ProfileNegative {
        /// Which segment.
        segment: usize,
        /// The smallest x on it.
        x: f64,
    },
    /// A profile of no length, or one that lies on the axis.
    #[error("the profile has no length or lies on the axis")]
    ProfileEmpty,
    /// A level profile whose parameter is to be the height.
    #[error("v cannot be the height: the profile is level")]
    ProfileLevel,
}

/// `value` if it is finite and above zero.
pub(super) fn positive(what: &'static str, value: f64) -> Result<f64, ShapeError> {
    if value.is_finite() && value > 0.0 { Ok(value) } else { Err(ShapeError::NotPositive { what, value }) }
}

/// `value` if it is finite and not below zero.
pub(super) fn not_negative(what: &'static str, value: f64) -> Result<f64, ShapeError> {
    if value.is_finite() && value >= 0.0 { Ok(value) } else { Err(ShapeError::Negative { what, value }) }
}
