//! Rounding of `f32` and `f64`: the only home of tolerances. All are relative to the numbers at hand; none is in scene
//! units.

/// Unit roundoff of `f32`, 2^-24: the largest relative error of one rounding to nearest.
pub const UNIT_ROUNDOFF: f64 = 1.0 / 16_777_216.0;

/// Bound on the relative error of a chain of some tens of `f64` operations: transforming a ray, solving for a hit,
/// transforming back.
pub const F64_CHAIN_ERROR: f64 = 64.0 * f64::EPSILON;

/// Largest magnitude that Embree accepts in a ray or a vertex (its `FLT_LARGE`, 1.844e18).
pub const EMBREE_LARGE: f32 = 1.844e18;

/// The smallest positive normal `f32`. Below it, flush-to-zero modes would turn a raised `t_min` back into zero.
pub const SMALLEST_NORMAL: f32 = f32::MIN_POSITIVE;

/// The largest `f32` below one: random numbers and parameters stay within `[0, 1)`.
pub const ONE_MINUS_EPSILON: f32 = 1.0 - f32::EPSILON / 2.0;

/// 2^23: floats from this magnitude on are integers.
pub const WHOLE: f32 = 8_388_608.0;

/// `x.floor()` except for the sign of zero; inlined, where that is a library call without SSE4.1.
#[inline(always)]
pub fn floor(x: f32) -> f32 {
    // No conversion to integers: one that saturates is not compiled to vector code.
    let shift = WHOLE.copysign(x);
    let rounded = (x + shift) - shift;
    let floor = if rounded > x { rounded - 1.0 } else { rounded };
    if x.abs() < WHOLE { floor } else { x }
}

/// The smallest `f32` that is not below `x`.
#[inline]
pub fn round_up(x: f64) -> f32 {
    let rounded = x as f32;
    if f64::from(rounded) < x { rounded.next_up() } else { rounded }
}

/// The largest `f32` that is not above `x`.
#[inline]
pub fn round_down(x: f64) -> f32 {
    let rounded = x as f32;
    if f64::from(rounded) > x { rounded.next_down() } else { rounded }
}

/// The `t_min` that steps past a hit at `t`: the next float, but never a denormal.
#[inline]
pub fn step_past(t: f32) -> f32 {
    t.next_up().max(SMALLEST_NORMAL)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_brackets_the_exact_value() {
        for x in [0.1f64, -0.1, 1e-50, -1e-50, 3.0, 16_777_217.0, -16_777_217.0] {
            assert!(f64::from(round_down(x)) <= x && x <= f64::from(round_up(x)), "{x}");
            assert!(round_up(x) <= round_down(x).next_up(), "{x}");
        }
    }

    #[test]
    fn floors_are_those_of_the_standard_library() {
        let odd = [
            0.0,
            -0.0,
            0.5,
            -0.5,
            1.0 - 6e-8,
            -1e-45,
            8_388_607.5,
            -8_388_607.5,
            8_388_608.0,
            -8_388_609.0,
            3e9,
            -3e9,
            f32::MAX,
            f32::MIN,
        ];
        for x in odd.into_iter().chain((-2000..2000).map(|i| i as f32 * 0.37)) {
            assert_eq!(floor(x), x.floor(), "{x}");
        }
        assert!(
            floor(f32::NAN).is_nan()
                && floor(f32::INFINITY) == f32::INFINITY
                && floor(f32::NEG_INFINITY) == f32::NEG_INFINITY
        );
    }

    #[test]
    fn a_step_past_zero_is_normal() {
        assert_eq!(step_past(0.0), SMALLEST_NORMAL);
        assert_eq!(step_past(1.0), 1.0f32.next_up());
    }
}
