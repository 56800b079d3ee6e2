//! Roots of quadratics without cancellation, and roots of functions within an interval at whose ends the sign differs.

/// `a * b - c * d` with one rounding error at most (Kahan; Jeannerod, Louvet, Muller, "Further analysis of Kahan's
/// algorithm").
#[inline(always)]
pub fn difference_of_products(a: f64, b: f64, c: f64, d: f64) -> f64 {
    let cd = c * d;
    let error = (-c).mul_add(d, cd);
    a.mul_add(b, -cd) + error
}

/// The real roots of a quadratic in ascending order. A root may be infinite when the leading coefficient vanishes; it
/// fails every range test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quadratic {
    /// The smaller root.
    pub near: f64,
    /// The larger root.
    pub far: f64,
}

/// The roots of `a t² + 2 half_b t + c`, or `None` if there are none. No special case for a vanishing `a`: one root is
/// then infinite or NaN, the other finite.
#[inline]
pub fn solve_quadratic(a: f64, half_b: f64, c: f64) -> Option<Quadratic> {
    let roots = quadratic_roots(a, half_b, c, difference_of_products(half_b, half_b, a, c));
    (!(roots.near.is_nan() && roots.far.is_nan())).then_some(roots)
}

/// [`solve_quadratic`] where `half_b² - a c` is known better than from the coefficients; both roots are NaN if there
/// are none. Without branches.
#[inline(always)]
pub fn quadratic_roots(a: f64, half_b: f64, c: f64, discriminant: f64) -> Quadratic {
    // The root of a negative number is NaN.
    let q = -(half_b + discriminant.sqrt().copysign(half_b));
    // half_b = 0 and a c = 0: a double root at zero, unless a = 0 too.
    let double = if a == 0.0 { f64::NAN } else { 0.0 };
    let (t0, t1) = if q == 0.0 { (double, double) } else { (q / a, c / q) };
    if t0 <= t1 { Quadratic { near: t0, far: t1 } } else { Quadratic { near: t1, far: t0 } }
}

/// An interval at whose ends a function has different signs; zero counts as positive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bracket {
    /// Lower end.
    pub lo: f64,
    /// Upper end.
    pub hi: f64,
    /// The function at the lower end.
    pub at_lo: f64,
    /// The function at the upper end.
    pub at_hi: f64,
    /// Where to look first.
    pub guess: f64,
}

impl Bracket {
    /// Whether there is a change of sign at all.
    #[inline]
    pub fn changes_sign(&self) -> bool {
        (self.at_lo >= 0.0) != (self.at_hi >= 0.0)
    }
}

/// The root in a bracket within `[0, 1]` by Newton's method from the guess, held inside by bisection. `f` returns the
/// value and the derivative. An end of the bracket may itself be (nearly) a root that does not count, so the guess must
/// be nearer to the one that does.
#[inline]
pub fn newton_in_bracket(bracket: &Bracket, f: impl Fn(f64) -> (f64, f64)) -> f64 {
    // A step this small leaves an error of its square times the curvature.
    const LAST_STEP: f64 = 1e-10;
    let positive_at_lo = bracket.at_lo >= 0.0;
    let (mut lo, mut hi) = (bracket.lo, bracket.hi);
    let mut s = bracket.guess;
    for i in 0..100 {
        let (value, slope) = f(s);
        if (value >= 0.0) == positive_at_lo {
            lo = s;
        } else {
            hi = s;
        }
        let newton = s - value / slope;
        // Newton alone may take ever smaller steps from one side; then every other step halves. Written so that a NaN
        // halves too.
        let halve = !(lo <= newton && newton <= hi) || (i >= 10 && i % 2 == 0);
        let next = if halve { 0.5 * (lo + hi) } else { newton };
        if (next - s).abs() <= if halve { f64::EPSILON } else { LAST_STEP } {
            return next;
        }
        s = next;
    }
    s
}

/// The root in a bracket within `[0, 1]` by bisection, to the last bit.
pub fn bisect(bracket: &Bracket, f: impl Fn(f64) -> f64) -> f64 {
    let positive_at_lo = bracket.at_lo >= 0.0;
    let (mut lo, mut hi) = (bracket.lo, bracket.hi);
    while hi - lo > f64::EPSILON {
        let middle = 0.5 * (lo + hi);
        if (f(middle) >= 0.0) == positive_at_lo {
            lo = middle;
        } else {
            hi = middle;
        }
    }
    0.5 * (lo + hi)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bracketed_roots_are_found_to_the_last_digits() {
        let cubic = |s: f64| ((s - 0.3) * (s - 1.4) * (s + 2.0), (s - 1.4) * (s + 2.0) + (s - 0.3) * (2.0 * s + 0.6));
        let flat = |s: f64| ((s - 0.7).powi(5), 5.0 * (s - 0.7).powi(4));
        let cusp = |s: f64| ((s - 0.2).cbrt(), f64::NAN);
        let bracket =
            |f: &dyn Fn(f64) -> (f64, f64)| Bracket { lo: 0.0, hi: 1.0, at_lo: f(0.0).0, at_hi: f(1.0).0, guess: 0.5 };
        assert!((newton_in_bracket(&bracket(&cubic), cubic) - 0.3).abs() < 1e-15);
        assert!((newton_in_bracket(&bracket(&flat), flat) - 0.7).abs() < 1e-8);
        assert!((newton_in_bracket(&bracket(&cusp), cusp) - 0.2).abs() < 1e-15);
        assert!((bisect(&bracket(&cubic), |s| cubic(s).0) - 0.3).abs() < 1e-15);
        assert!(bracket(&cubic).changes_sign());
    }
}
