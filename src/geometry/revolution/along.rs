//! The parameter v along the profile of a surface of revolution.

use super::density::{ProfileSample, integral};
use super::segment::{Range, Segment};
use crate::geometry::ShapeError;
use crate::math::DVec2;

/// Intervals of each segment whose lengths are tabulated.
const INTERVALS: usize = 16;

/// Sine of the profile's slope below which v by height counts as changing that fast: the change of the point with v
/// stays finite.
const LEAST_SLOPE: f64 = 1e-6;

/// What v of a surface of revolution grows with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ProfileParameter {
    /// The parameter of the curve, all segments alike.
    #[default]
    Curve,
    /// The height, from the lowest point of the profile to the highest.
    Height,
    /// The length of the curve.
    ArcLength,
}

/// How v is found.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Along {
    Curve,
    Height(Range),
    /// Length of the profile up to the start of each interval, and of all of it.
    ArcLength(Vec<f64>),
}

/// A value of v.
pub(super) struct Parameter {
    pub v: f64,
    /// Change of (distance from the axis, height) with v.
    pub change: DVec2,
}

impl Along {
    /// # Errors
    /// If v is the height of a level profile.
    pub fn new(segments: &[Segment], parameter: ProfileParameter) -> Result<Self, ShapeError> {
        Ok(match parameter {
            ProfileParameter::Curve => Self::Curve,
            ProfileParameter::Height => {
                let (min, max) = segments.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(min, max), segment| {
                    (min.min(segment.z_range.min), max.max(segment.z_range.max))
                });
                if min >= max {
                    return Err(ShapeError::ProfileLevel);
                }
                Self::Height(Range { min, max })
            }
            ProfileParameter::ArcLength => {
                let mut lengths = vec![0.0];
                let mut total = 0.0;
                for segment in segments {
                    for i in 0..INTERVALS {
                        total += length(segment, i as f64 / INTERVALS as f64, (i + 1) as f64 / INTERVALS as f64);
                        lengths.push(total);
                    }
                }
                Self::ArcLength(lengths)
            }
        })
    }

    /// v at a place on the profile.
    #[inline]
    pub fn at(&self, segments: &[Segment], at: ProfileSample) -> Parameter {
        let segment = &segments[at.segment];
        match self {
            Self::Curve => {
                let count = segments.len() as f64;
                Parameter {
                    v: ((at.segment as f64 + at.s) / count).clamp(0.0, 1.0),
                    change: segment.derivative(at.s) * count,
                }
            }
            Self::Height(range) => {
                let (height, tangent) = (range.max - range.min, segment.tangent(at.s));
                let slope = tangent.y.abs().max(LEAST_SLOPE).copysign(tangent.y);
                Parameter {
                    v: ((segment.z.value(at.s) - range.min) / height).clamp(0.0, 1.0),
                    change: tangent * (height / slope),
                }
            }
            Self::ArcLength(lengths) => {
                let total = lengths[lengths.len() - 1];
                let i = ((at.s * INTERVALS as f64) as usize).min(INTERVALS - 1);
                let before = lengths[at.segment * INTERVALS + i] + length(segment, i as f64 / INTERVALS as f64, at.s);
                Parameter { v: (before / total).clamp(0.0, 1.0), change: segment.tangent(at.s) * total }
            }
        }
    }
}

/// Length of a segment between two parameters.
fn length(segment: &Segment, from: f64, to: f64) -> f64 {
    integral(Range { min: from, max: to }, |s| segment.derivative(s).length())
}
