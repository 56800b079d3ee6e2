//! Sine and cosine without range reduction by pi: directions are drawn as fractions of a turn.

use std::f32::consts::FRAC_PI_2;

/// Sine and cosine of `x` radians, `|x| <= pi / 4`; at most 1.2e-7 from the exact values (coefficients of Moshier's Cephes library).
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
    fn quarter_turns_are_exact() {
        assert_eq!(sin_cos_turns(0.0), (0.0, 1.0));
        assert_eq!(sin_cos_turns(0.25), (1.0, 0.0));
        assert_eq!(sin_cos_turns(0.5), (0.0, -1.0));
        assert_eq!(sin_cos_turns(0.75), (-1.0, 0.0));
    }
}
