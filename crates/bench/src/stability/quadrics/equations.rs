//! The quadratic equation that quadrics solve.

use twofloat::TwoFloat;

use crate::math::{Quadratic, difference_of_products, solve_quadratic};
use crate::stability::geometry::Rng;
use crate::stability::oracle::{quotient, root, value};
use crate::stability::{Effort, Faults, Outcome};

/// Distance between neighbouring numbers at `x`.
fn ulp(x: f64) -> f64 {
    x.abs().next_up() - x.abs()
}

/// Roots of `a t² + 2 b t + c`.
fn exact_roots(a: f64, b: f64, c: f64) -> Option<[f64; 2]> {
    // Products of two doubles and their difference are exact to the last of 106 bits, whatever cancels.
    let discriminant = TwoFloat::new_mul(b, b) - TwoFloat::new_mul(a, c);
    if discriminant.hi() < 0.0 {
        return None;
    }
    let root = root(discriminant);
    let q = if b >= 0.0 { -root - b } else { root - b };
    let mut roots = [value(q / a), value(quotient(TwoFloat::from(c), q))];
    roots.sort_by(f64::total_cmp);
    Some(roots)
}

pub(super) fn c10_quadratic_solver(effort: Effort) -> Outcome {
    let mut rng = Rng::new(49);
    let (mut other_count, mut error, mut difference) = (Faults::NONE, 0f64, 0f64);
    for i in 0..effort.pick(100_000, 10_000_000) {
        let mut number = || rng.magnitude(-8.0, 8.0) * if rng.unit() < 0.5 { -1.0 } else { 1.0 };
        let (a, b, mut c) = (number(), number(), number());
        if i % 4 > 0 {
            let gap = rng.magnitude(-16.0, 0.0) * if rng.unit() < 0.5 { -1.0 } else { 1.0 };
            c = b * b / a * (1.0 + gap);
        }
        let exact = value(TwoFloat::new_mul(b, b) - TwoFloat::new_mul(a, c));
        difference = difference.max((difference_of_products(b, b, a, c) - exact).abs() / ulp(exact));
        match (solve_quadratic(a, b, c), exact_roots(a, b, c)) {
            (Some(found), Some([near, far])) => {
                error = error.max((found.near / near - 1.0).abs()).max((found.far / far - 1.0).abs());
            }
            (None, None) => {}
            (found, exact) => {
                other_count.require(false, || format!("{a:?}, {b:?}, {c:?} have {found:?} in place of {exact:?}"));
            }
        }
    }
    let has = |r: Option<Quadratic>, t: f64| r.is_some_and(|r| r.near == t || r.far == t);
    let right = [
        has(solve_quadratic(0.0, 1.0, -6.0), 3.0),
        has(solve_quadratic(-0.0, -1.0, 6.0), 3.0),
        solve_quadratic(0.0, 0.0, 0.0).is_none(),
        solve_quadratic(0.0, 0.0, 1.0).is_none(),
        solve_quadratic(1.0, 0.0, 1.0).is_none(),
        solve_quadratic(1.0, 0.0, -4.0) == Some(Quadratic { near: -2.0, far: 2.0 }),
        solve_quadratic(1.0, -2.0, 0.0) == Some(Quadratic { near: 0.0, far: 4.0 }),
        solve_quadratic(2.0, 0.0, 0.0) == Some(Quadratic { near: 0.0, far: 0.0 }),
        solve_quadratic(1.0, -3.0, 9.0) == Some(Quadratic { near: 3.0, far: 3.0 }),
        solve_quadratic(f64::NAN, 1.0, 1.0).is_none() && solve_quadratic(1.0, f64::NAN, 1.0).is_none(),
    ];
    Outcome::new()
        .none("other number of roots", other_count)
        .at_most("error of a difference of products in units in the last place", difference, 2.0)
        // Of the discriminant 3, half of that and 1 of its root, 1 of the sum, 1 of the quotient; and 1 of the
        // reference.
        .at_most("relative error of a root in 2^-53", error * 2f64.powi(53), 5.5)
        .none(
            "wrong for vanishing coefficients",
            Faults::of(
                &right.into_iter().enumerate().collect::<Vec<_>>(),
                |(_, right)| usize::from(!right),
                |(i, _)| format!("case {i}"),
            ),
        )
}
