//! Picking one of a node's children in proportion to their importances.

use super::node::WIDTH;
use crate::math::float::ONE_MINUS_EPSILON;

/// A child found by [`pick`].
#[derive(Clone, Copy)]
pub(super) struct Picked {
    pub slot: u32,
    /// Probability of the choice; 0 if all importances are.
    pub pmf: f32,
    /// How far into the child the number falls, in `[0, 1)`.
    pub share: f64,
}

impl Picked {
    #[inline(always)]
    fn new(slot: u32, importance: f32, total: f32, within: f64) -> Self {
        let pmf = if total > 0.0 { importance / total } else { 0.0 };
        Self { slot, pmf, share: within / f64::from(importance) }
    }
}

/// Sums of children that are four apart.
#[inline(always)]
fn quarters(of: &[f32; WIDTH]) -> [f32; 4] {
    [of[0] + of[4], of[1] + of[5], of[2] + of[6], of[3] + of[7]]
}

/// The sum, added up as [`pick`] divides it.
#[inline(always)]
pub(super) fn total(of: &[f32; WIDTH]) -> f32 {
    let [a, b, c, d] = quarters(of);
    (a + c) + (b + d)
}

/// The child in which `share`, a number in `[0, 1)`, falls if all are laid end to end: by halves, without branches.
/// Never one of importance zero, if not all are.
#[inline(always)]
pub(super) fn pick(of: &[f32; WIDTH], share: f64) -> Picked {
    let [a, b, c, d] = quarters(of);
    let total = (a + c) + (b + d);
    let (is_odd, x) = halve(a + c, b + d, share * f64::from(total));
    let (left, right) = if is_odd { (b, d) } else { (a, c) };
    let (is_second, x) = halve(left, right, x);
    let (first, second) = if is_odd { ([of[1], of[5]], [of[3], of[7]]) } else { ([of[0], of[4]], [of[2], of[6]]) };
    let [left, right] = if is_second { second } else { first };
    let (is_fourth, x) = halve(left, right, x);
    let importance = if is_fourth { right } else { left };
    Picked::new(u32::from(is_odd) + 2 * u32::from(is_second) + 4 * u32::from(is_fourth), importance, total, x)
}

/// [`pick`] of a node whose children are the first two at most.
#[inline(always)]
pub(super) fn pick_of_two(of: &[f32; 2], share: f64) -> Picked {
    let total = of[0] + of[1];
    let (is_second, x) = halve(of[0], of[1], share * f64::from(total));
    Picked::new(u32::from(is_second), if is_second { of[1] } else { of[0] }, total, x)
}

/// Whether `x`, of `[0, left + right)`, falls to the right, and how far into that side.
#[inline(always)]
fn halve(left: f32, right: f32, x: f64) -> (bool, f64) {
    let beyond = x - f64::from(left);
    // Rounding of the sum may put it a little behind the end.
    let last = f64::from(right) * f64::from(ONE_MINUS_EPSILON);
    let is_right = beyond >= 0.0;
    (is_right, if is_right { if beyond < last { beyond } else { last } } else { x })
}
