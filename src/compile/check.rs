//! Checks of numbers: finite, and within the range that makes sense.

use super::CompileContext;
use crate::error::Result;
use crate::math::{DVec3, RenderSpace};

/// The most that radiance, intensity and the like can be: sums and products of such numbers stay finite in `f32`.
pub(super) const BRIGHTEST: f32 = 1e36;

/// How far away a point can be in render space for rays to start there or end there.
const FARTHEST: f64 = (1u64 << 56) as f64;

impl CompileContext {
    /// A point or vector, finite.
    pub(super) fn vector(&self, path: &str, value: [f64; 3]) -> Result<DVec3> {
        let vector = DVec3::from(value);
        if vector.is_finite() { Ok(vector) } else { Err(self.error(path, format!("{value:?} is not finite"))) }
    }

    /// A direction: finite and not zero; returned with unit length.
    pub(super) fn direction(&self, path: &str, value: [f64; 3]) -> Result<DVec3> {
        let vector = self.vector(path, value)?;
        // Squares of components beyond 1e154 overflow.
        let unit = vector.try_normalize().or_else(|| (vector / vector.abs().max_element()).try_normalize());
        unit.ok_or_else(|| self.error(path, "the direction is zero"))
    }

    /// A point of the world: finite, and no further away than the world reaches.
    pub(super) fn position(&self, path: &str, value: [f64; 3]) -> Result<DVec3> {
        let most = RenderSpace::EXTENTS[1];
        let point = self.vector(path, value)?;
        let within = point.abs().max_element() <= most;
        if within { Ok(point) } else { Err(self.error(path, format!("{value:?}: coordinates are at most {most:e}"))) }
    }

    /// Rejects a world point that is too far away to be placed beside the scene's shapes.
    pub(super) fn reachable(&self, path: &str, world: DVec3, space: &RenderSpace) -> Result<()> {
        if space.point(world).abs().max_element() <= FARTHEST {
            return Ok(());
        }
        let most = space.world_length(FARTHEST);
        Err(self.error(path, format!("is too far from the shapes: for a scene of this size, at most {most:e} away")))
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
        if value > 0.0 && value.is_finite() {
            Ok(value)
        } else {
            Err(self.error(path, format!("must be finite and above 0, not {value}")))
        }
    }

    /// Radiance, intensity and the like: not negative, and at most [`BRIGHTEST`].
    pub(super) fn emitted(&self, path: &str, value: [f32; 3]) -> Result<[f32; 3]> {
        if value.iter().all(|&v| (0.0..=BRIGHTEST).contains(&v)) {
            Ok(value)
        } else {
            Err(self.error(path, format!("{value:?} must be finite, not negative and at most {BRIGHTEST:e}")))
        }
    }

    /// A reflectance: each channel within `[0, 1]`.
    pub(super) fn reflectance(&self, path: &str, value: [f32; 3]) -> Result<[f32; 3]> {
        if value.iter().all(|&v| (0.0..=1.0).contains(&v)) {
            Ok(value)
        } else {
            Err(self.error(
                path,
                format!("{value:?} must be within 0 and 1: a surface cannot reflect more than it receives"),
            ))
        }
    }
}
