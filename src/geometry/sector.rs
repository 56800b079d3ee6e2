//! The range of angles `0 <= phi <= phi_max` about +z that a shape keeps; phi turns from +x towards +y.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::ShapeError;
use crate::math::{DVec2, dvec2, unit_circle};

/// A sector of the plane about the origin, closed on both sides; `0 < phi_max <= 2 pi`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sector {
    phi_max: f64,
    sin: f64,
    cos: f64,
    is_full: bool,
}

/// The smallest box around a ring sector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SectorBounds {
    /// The smallest coordinates.
    pub min: DVec2,
    /// The largest coordinates.
    pub max: DVec2,
}

impl Sector {
    /// All angles.
    pub const FULL: Self = Self { phi_max: TAU, sin: 0.0, cos: 1.0, is_full: true };

    /// The angles up to `phi_max` in radians.
    ///
    /// # Errors
    /// If `phi_max` is not in `(0, 2 pi]`, up to rounding.
    pub fn new(phi_max: f64) -> Result<Self, ShapeError> {
        let rounding = 4.0 * f64::EPSILON * TAU;
        if !(phi_max > 0.0 && phi_max <= TAU + rounding) {
            return Err(ShapeError::Angle(phi_max));
        }
        if phi_max >= TAU - rounding {
            return Ok(Self::FULL);
        }
        let (sin, cos) = phi_max.sin_cos();
        Ok(Self { phi_max, sin, cos, is_full: false })
    }

    /// The largest angle, in radians.
    #[inline]
    pub fn phi_max(&self) -> f64 {
        self.phi_max
    }

    /// Whether all angles are kept.
    #[inline]
    pub fn is_full(&self) -> bool {
        self.is_full
    }

    /// Whether the point is in the sector; the origin always is. Two half-planes decide, without an arctangent.
    #[inline(always)]
    pub fn contains(&self, x: f64, y: f64) -> bool {
        let (after_start, before_end) = (y >= 0.0, x * self.sin - y * self.cos >= 0.0);
        self.is_full | if self.phi_max <= PI { after_start & before_end } else { after_start | before_end }
    }

    /// The angle of a point of the sector over `phi_max`, in `[0, 1]`; zero at the origin.
    #[inline]
    pub fn fraction(&self, x: f64, y: f64) -> f64 {
        let mut phi = y.atan2(x);
        if phi < 0.0 {
            phi += TAU;
        }
        if phi > self.phi_max {
            // Outside by rounding: the nearer end.
            return if phi - self.phi_max <= TAU - phi { 1.0 } else { 0.0 };
        }
        // The arctangent is -0.0 for y = -0.0; the maximum of that and 0 may be either.
        if phi > 0.0 { phi / self.phi_max } else { 0.0 }
    }

    /// Cosine and sine of the angle `fraction * phi_max`.
    #[inline(always)]
    pub(super) fn direction(&self, fraction: f64) -> DVec2 {
        if self.is_full { self.direction_of::<true>(fraction) } else { self.direction_of::<false>(fraction) }
    }

    /// [`direction`](Self::direction), where it is known whether the sector is `FULL`: a branch in a loop over rows
    /// would compute both for all of them.
    #[inline(always)]
    pub(super) fn direction_of<const FULL: bool>(&self, fraction: f64) -> DVec2 {
        if FULL {
            // The choice of an angle may round.
            return unit_circle(fraction as f32);
        }
        let (sin, cos) = (fraction * self.phi_max).sin_cos();
        dvec2(cos, sin)
    }

    /// The smallest box around the points of the sector between two radii.
    pub(super) fn bounds(&self, inner: f64, outer: f64) -> SectorBounds {
        if self.is_full {
            return SectorBounds { min: DVec2::splat(-outer), max: DVec2::splat(outer) };
        }
        let cos_min = if self.phi_max >= PI { -1.0 } else { self.cos };
        let sin_max = if self.phi_max >= FRAC_PI_2 { 1.0 } else { self.sin };
        let sin_min = if self.phi_max >= 1.5 * PI { -1.0 } else { self.sin.min(0.0) };
        let x_min = if cos_min < 0.0 { cos_min * outer } else { cos_min * inner };
        SectorBounds { min: dvec2(x_min, sin_min * outer), max: dvec2(outer, sin_max * outer) }
    }
}

/// Direction from the axis to `(x, y)`; +x at the axis itself, and so close to it that squares vanish.
#[inline(always)]
pub(super) fn direction_from_axis(x: f64, y: f64) -> DVec2 {
    let squared = x * x + y * y;
    let is_usable = (f64::MIN_POSITIVE..f64::INFINITY).contains(&squared);
    let direction = dvec2(x, y) / squared.sqrt();
    if is_usable { direction } else { DVec2::X }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_outside_the_turn_are_refused() {
        for bad in [0.0, -1.0, 6.3, f64::NAN, f64::INFINITY] {
            assert!(Sector::new(bad).is_err(), "{bad}");
        }
        assert!(Sector::new(360f64.to_radians()).unwrap().is_full());
        assert!(!Sector::new(359.999f64.to_radians()).unwrap().is_full());
    }

    #[test]
    fn half_planes_agree_with_the_arctangent() {
        for phi_max in [0.1, 1.0, FRAC_PI_2, 2.0, PI, 3.5, 1.5 * PI, 5.0, 6.25] {
            let sector = Sector::new(phi_max).unwrap();
            let bounds = sector.bounds(0.4, 1.5);
            let mut seen = SectorBounds { min: DVec2::INFINITY, max: DVec2::NEG_INFINITY };
            for i in 0..20_000 {
                let phi = (f64::from(i) + 0.5) / 20_000.0 * TAU;
                let (sin, cos) = phi.sin_cos();
                assert_eq!(sector.contains(cos, sin), phi <= phi_max, "{phi_max} {phi}");
                if phi <= phi_max {
                    assert!((sector.fraction(cos, sin) * phi_max - phi).abs() < 1e-14);
                    for rho in [0.4, 1.5] {
                        seen.min = seen.min.min(rho * dvec2(cos, sin));
                        seen.max = seen.max.max(rho * dvec2(cos, sin));
                    }
                }
            }
            assert!(
                (bounds.min - seen.min).abs().max_element() < 1e-3
                    && (bounds.max - seen.max).abs().max_element() < 1e-3,
                "{phi_max}"
            );
            assert!(bounds.min.cmple(seen.min).all() && bounds.max.cmpge(seen.max).all(), "{phi_max}");
        }
    }

    #[test]
    fn signed_zeros_and_rounding_at_the_ends_stay_in_range() {
        let sector = Sector::new(1.0).unwrap();
        assert_eq!(sector.fraction(1.0, -0.0).to_bits(), 0);
        assert_eq!(sector.fraction(1.0, -1e-18), 0.0);
        assert_eq!(sector.fraction(1f64.cos(), 1f64.sin() + 1e-15), 1.0);
        assert!(sector.contains(0.0, 0.0) && sector.fraction(0.0, 0.0) == 0.0);
    }
}
