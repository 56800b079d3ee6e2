//! Sine and cosine without range reduction by pi: directions are drawn as fractions of a turn.

use super::DVec2;
use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI};

/// Sine and cosine of `x` radians, `|x| <= pi / 4`; at most 1.2e-7 from the exact values (coefficients of Moshier's
/// Cephes library).
#[inline(always)]
pub fn sin_cos_eighth(x: f32) -> (f32, f32) {
    let x2 = x * x;
    let sin = x + x * x2 * (-0.166_666_55 + x2 * (8.332_161e-3 + x2 * -1.951_529_6e-4));
    let cos = 1.0 - 0.5 * x2 + x2 * x2 * (4.166_664_6e-2 + x2 * (-1.388_731_6e-3 + x2 * 2.443_315_7e-5));
    (sin, cos)
}

/// Sine and cosine of `turns` full turns, `|turns| < 1e5`; at most 1.2e-7 from the exact values.
#[inline(always)]
pub fn sin_cos_turns(turns: f32) -> (f32, f32) {
    // Adding 1.5 * 2^23 rounds to an integer, which is then in the lowest bits.
    const TO_INTEGER: f32 = 12_582_912.0;
    let quarters = 4.0 * turns;
    let rounded = quarters + TO_INTEGER;
    let quadrant = rounded.to_bits();
    let (sin, cos) = sin_cos_eighth((quarters - (rounded - TO_INTEGER)) * FRAC_PI_2);

    // An odd quadrant exchanges the two; then the signs follow from the quadrant's second bit.
    let (sin, cos) = if quadrant & 1 == 1 { (cos, sin) } else { (sin, cos) };
    let negate = |x: f32, bit: u32| f32::from_bits(x.to_bits() ^ (bit << 30));
    (negate(sin, quadrant & 2), negate(cos, quadrant.wrapping_add(1) & 2))
}

/// The point of the unit circle at `u` of a turn, of unit length in `f64`, within `f32` rounding of that angle.
#[inline(always)]
pub fn unit_circle(u: f32) -> DVec2 {
    let (sin, cos) = sin_cos_turns(u);
    let v = DVec2::new(f64::from(cos), f64::from(sin));
    // One Newton step of the inverse square root: from an error of 1e-7 to below 1e-14.
    v * (1.5 - 0.5 * v.length_squared())
}

/// The angle of the point (x, y), within `[-pi, pi]`; at most 3e-7 from the exact one, and 0 or pi at the origin
/// (coefficients of Moshier's Cephes library). Without branches, for loops over many numbers.
#[inline(always)]
pub fn angle_of(y: f32, x: f32) -> f32 {
    const TAN_EIGHTH: f32 = 0.414_213_57;
    let (width, height) = (x.abs(), y.abs());
    let is_steep = height > width;
    let (small, large) = if is_steep { (width, height) } else { (height, width) };
    // Beyond pi / 8 the rest of the angle to pi / 4 is found instead.
    let is_wide = small > TAN_EIGHTH * large;
    let (above, below) = if is_wide { (small - large, small + large) } else { (small, large) };
    let q = if below > 0.0 { above / below } else { 0.0 };
    let z = q * q;
    let polynomial = ((8.053_744_5e-2 * z - 0.138_776_85) * z + 0.199_777_1) * z - 0.333_329_5;
    let angle = q + q * z * polynomial + if is_wide { FRAC_PI_4 } else { 0.0 };
    let angle = if is_steep { FRAC_PI_2 - angle } else { angle };
    (if x.is_sign_negative() { PI - angle } else { angle }).copysign(y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn sine_and_cosine_of_turns_are_within_two_roundings() {
        let mut worst = 0.0f64;
        for i in -200_000..200_000 {
            let turns = i as f32 * 1.03e-5;
            let (sin, cos) = sin_cos_turns(turns);
            let (exact_sin, exact_cos) = (f64::from(turns) * TAU).sin_cos();
            worst = worst.max((f64::from(sin) - exact_sin).abs()).max((f64::from(cos) - exact_cos).abs());
        }
        assert!(worst < 1.2e-7, "{worst}");
    }

    #[test]
    fn angles_are_those_of_the_library() {
        let mut worst = 0.0f64;
        for i in 0..200_000 {
            let (sin, cos) = (f64::from(i) * TAU / 200_000.0 - TAU / 2.0).sin_cos();
            for scale in [1e-30, 1.0, 1e30] {
                let (x, y) = ((cos * scale) as f32, (sin * scale) as f32);
                worst = worst.max((f64::from(angle_of(y, x)) - f64::from(y).atan2(f64::from(x))).abs());
            }
        }
        assert!(worst < 3e-7, "{worst}");
        let axes = [
            (0.0, 1.0),
            (1.0, 0.0),
            (0.0, -1.0),
            (-1.0, 0.0),
            (-0.0, -1.0),
            (0.0, 0.0),
            (0.0, -0.0),
            (1.0, 1e-40),
            (1e-40, 1.0),
        ];
        for (y, x) in axes {
            assert!((angle_of(y, x) - f32::atan2(y, x)).abs() < 3e-7, "{y} {x}: {}", angle_of(y, x));
        }
    }

    #[test]
    fn quarter_turns_are_exact() {
        assert_eq!(sin_cos_turns(0.0), (0.0, 1.0));
        assert_eq!(sin_cos_turns(0.25), (1.0, 0.0));
        assert_eq!(sin_cos_turns(0.5), (0.0, -1.0));
        assert_eq!(sin_cos_turns(0.75), (-1.0, 0.0));
    }
}
