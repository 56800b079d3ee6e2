//! The exponential function and the natural logarithm without branches, for loops over many numbers.

/// `e` to the power of `x`; 0 below -87, and not to be called above 88. Within 2e-7 of the value, relative to it, but
/// for the rounding of `x` (coefficients of Moshier's Cephes library).
#[inline(always)]
pub fn exp_of(x: f32) -> f32 {
    // Adding 1.5 * 2^23 rounds to an integer, which is then in the lowest bits.
    const TO_INTEGER: f32 = 12_582_912.0;
    let rounded = x * std::f32::consts::LOG2_E + TO_INTEGER;
    let n = rounded - TO_INTEGER;
    // The logarithm of 2 in two parts: the product with the first is exact.
    let r = x - n * 0.693_359_4 + n * 2.121_944_4e-4;
    let high = 8.333_452e-3 + r * (1.398_2e-3 + r * 1.987_569_1e-4);
    let polynomial = 0.5 + r * (0.166_666_66 + r * (4.166_579_6e-2 + r * high));
    let power = f32::from_bits(rounded.to_bits().wrapping_add(127) << 23);
    let value = (1.0 + (r + r * r * polynomial)) * power;
    if x < -87.0 { 0.0 } else { value }
}

/// The natural logarithm of an `x` above 0 and not below the smallest normal number; within 2e-7 of the value, relative
/// to it (coefficients of Moshier's Cephes library).
#[inline(always)]
pub fn ln_of(x: f32) -> f32 {
    // Bits of the root of a half: the mantissa that is left lies around 1.
    const ROOT_HALF: u32 = 0x3f35_04f3;
    let bits = x.to_bits();
    let exponent = bits.wrapping_sub(ROOT_HALF) as i32 >> 23;
    let t = f32::from_bits(bits.wrapping_sub((exponent << 23) as u32)) - 1.0;
    let high = -0.124_201_41 + t * (0.116_769_99 + t * (-0.115_146_1 + t * 7.037_683_6e-2));
    let middle = 0.200_007_15 + t * (-0.166_680_57 + t * (0.142_493_23 + t * high));
    let polynomial = 0.333_333_3 + t * (-0.249_999_94 + t * middle);
    let (n, square) = (exponent as f32, t * t);
    let small = t * square * polynomial - n * 2.121_944_4e-4 - 0.5 * square;
    (t + small) + n * 0.693_359_4
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exponentials_are_within_three_roundings() {
        for x in (0..2_000_000).map(|i| -87.0 + i as f32 * 8.7e-5) {
            let expected = f64::from(x).exp();
            let error = (f64::from(exp_of(x)) / expected - 1.0).abs();
            assert!(error < 2e-7, "{x}: {error}");
        }
        assert_eq!([0.0, -88.0, -1e30, f32::NEG_INFINITY].map(exp_of), [1.0, 0.0, 0.0, 0.0]);
        assert!(exp_of(f32::NAN).is_nan());
    }

    #[test]
    fn logarithms_are_within_three_roundings() {
        for x in (0..2_000_000u32).map(|i| f32::from_bits(0x0080_0000 + i * 1_060)) {
            let expected = f64::from(x).ln();
            let error = (f64::from(ln_of(x)) - expected).abs() / expected.abs().max(f64::MIN_POSITIVE);
            assert!(error < 2e-7, "{x}: {error}");
        }
        assert_eq!(ln_of(1.0), 0.0);
    }
}
