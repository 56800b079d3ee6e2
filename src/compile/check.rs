//! Checks of numbers: finite, and within the range that makes sense.

use super::Files;
use crate::error::Result;
use crate::math::DVec3;

impl Files {
    /// A point or vector, finite.
    pub(super) fn vector(&self, path: &str, value: [f64; 3]) -> Result<DVec3> {
        let vector = DVec3::from(value);
        if vector.is_finite() { Ok(vector) } else { Err(self.error(path, format!("{value:?} is not finite"))) }
    }

    /// A direction: finite and not zero; returned with unit length.
    pub(super) fn direction(&self, path: &str, value: [f64; 3]) -> Result<DVec3> {
        let vector = self.vector(path, value)?;
        vector.try_normalize().ok_or_else(|| self.error(path, "the direction is zero"))
    }

    /// A number within a closed range.
    pub(super) fn within(&self, path: &str, value: f64, low: f64, high: f64) -> Result<f64> {
        if value >= low && value <= high {
            Ok(value)
        } else {
            Err(self.error(path, format!("must be a number from {low} to {high}, not {value}")))
        }
    }

    /// A finite number above zero.
    pub(super) fn positive(&self, path: &str, value: f64) -> Result<f64> {
        if value > 0.0 && value.is_finite() { Ok(value) } else { Err(self.error(path, format!("must be finite and above 0, not {value}"))) }
    }

    /// Radiance, intensity and the like: finite and not negative.
    pub(super) fn emitted(&self, path: &str, value: [f32; 3]) -> Result<[f32; 3]> {
        if value.iter().all(|&v| v >= 0.0 && v.is_finite()) {
            Ok(value)
        } else {
            Err(self.error(path, format!("{value:?} must be finite and not negative")))
        }
    }

    /// A reflectance: each channel within `[0, 1]`.
    pub(super) fn reflectance(&self, path: &str, value: [f32; 3]) -> Result<[f32; 3]> {
        if value.iter().all(|&v| (0.0..=1.0).contains(&v)) {
            Ok(value)
        } else {
            Err(self.error(path, format!("{value:?} must be within 0 and 1: a surface cannot reflect more than it receives")))
        }
    }
}
