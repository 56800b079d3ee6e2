//! For tests only: endless rays.

use crate::math::{DVec3, RayF64};

/// A ray without an end.
pub(crate) fn endless(origin: DVec3, direction: DVec3) -> RayF64 {
    RayF64 { origin, direction, t_min: 0.0, t_max: f64::INFINITY }
}
