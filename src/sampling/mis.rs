//! Weights that combine sampling strategies.

/// Veach's power heuristic with exponent 2: the weight of a strategy of density `pdf` against one of density `other`,
/// one sample each; with several, the densities are multiplied by their numbers. A density of infinity (a delta) takes
/// all the weight.
#[inline(always)]
pub fn power_heuristic(pdf: f32, other: f32) -> f32 {
    if pdf <= 0.0 {
        return 0.0;
    }
    // A quotient does not overflow where squares would.
    let ratio = other / pdf;
    1.0 / (1.0 + ratio * ratio)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_add_up_to_one_at_any_scale() {
        for scale in [1e-30f32, 1.0, 1e30] {
            let (a, b) = (3.0 * scale, 0.5 * scale);
            assert!((power_heuristic(a, b) + power_heuristic(b, a) - 1.0).abs() < 1e-6);
        }
        assert_eq!(power_heuristic(0.0, 1.0), 0.0);
        assert_eq!(power_heuristic(1.0, 0.0), 1.0);
    }
}
