//! Polynomials in Bernstein form on `[0, 1]`: products of cubics, and isolation of real roots by the
//! variation-diminishing property.
//!
//! A polynomial has at most as many roots in the interval as its coefficients have changes of sign, and the same number
//! modulo two. No change means no root; one change means one root; otherwise the interval is halved (Lane, Riesenfeld,
//! "Bounds on a polynomial").

use super::roots::Bracket;

/// How often an interval is halved before two roots in it count as one tangency. 2^-44 is a thousand times the rounding
/// of a parameter.
const MAX_DEPTH: u32 = 44;

/// The product of two cubics, of degree 6. The end coefficients are the products of the end coefficients, exactly as
/// one multiplication rounds them.
pub fn product_of_cubics(a: &[f64; 4], b: &[f64; 4]) -> [f64; 7] {
    const CHOOSE_3: [f64; 4] = [1.0, 3.0, 3.0, 1.0];
    const CHOOSE_6: [f64; 7] = [1.0, 6.0, 15.0, 20.0, 15.0, 6.0, 1.0];
    std::array::from_fn(|k| {
        let terms = k.saturating_sub(3)..=k.min(3);
        terms.map(|i| CHOOSE_3[i] * CHOOSE_3[k - i] * (a[i] * b[k - i])).sum::<f64>() / CHOOSE_6[k]
    })
}

/// Whether a value counts as positive. Zero does, so that a root between two polynomials that share an end value
/// belongs to exactly one.
#[inline]
fn is_positive(x: f64) -> bool {
    x >= 0.0
}

/// How often the sign changes along the coefficients.
#[inline]
pub fn sign_changes<const N: usize>(coefficients: &[f64; N]) -> usize {
    coefficients.windows(2).filter(|pair| is_positive(pair[0]) != is_positive(pair[1])).count()
}

/// Where the control polygon first changes its sign, in `[0, 1]`: close to the root if there is one change.
#[inline]
fn first_crossing<const N: usize>(coefficients: &[f64; N]) -> f64 {
    let at = coefficients.windows(2).position(|pair| is_positive(pair[0]) != is_positive(pair[1])).unwrap_or(0);
    let (from, to) = (coefficients[at], coefficients[at + 1]);
    (at as f64 + from / (from - to)) / (N - 1) as f64
}

/// Calls `found` with an interval around each root, in ascending order. Pairs of roots closer than 2^-44 are dropped
/// together, and so are pairs between which the polynomial stays below `noise`, the rounding of its coefficients:
/// without that, a polynomial that is all rounding would be halved for ever.
#[inline]
pub fn isolate_roots<const N: usize>(coefficients: &[f64; N], noise: f64, found: &mut impl FnMut(Bracket)) {
    isolate(coefficients, noise, Part { lo: 0.0, width: 1.0, depth: 0 }, found);
}

/// A part of `[0, 1]`.
#[derive(Clone, Copy)]
struct Part {
    lo: f64,
    width: f64,
    depth: u32,
}

fn isolate<const N: usize>(coefficients: &[f64; N], noise: f64, part: Part, found: &mut impl FnMut(Bracket)) {
    let changes = sign_changes(coefficients);
    if changes == 0 {
        return;
    }
    let (first, last) = (coefficients[0], coefficients[N - 1]);
    let is_noise = || coefficients.iter().all(|c| c.abs() <= noise);
    if changes == 1 || part.depth == MAX_DEPTH || is_noise() {
        if is_positive(first) != is_positive(last) {
            let guess = part.lo + part.width * first_crossing(coefficients);
            found(Bracket { lo: part.lo, hi: part.lo + part.width, at_lo: first, at_hi: last, guess });
        }
        return;
    }

    // De Casteljau at the middle.
    let (mut left, mut right) = (*coefficients, *coefficients);
    for (level, end) in left.iter_mut().enumerate().skip(1) {
        for i in 0..N - level {
            right[i] = 0.5 * (right[i] + right[i + 1]);
        }
        *end = right[0];
    }
    let half = Part { width: 0.5 * part.width, depth: part.depth + 1, ..part };
    isolate(&left, noise, half, found);
    isolate(&right, noise, Part { lo: part.lo + half.width, ..half }, found);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value<const N: usize>(coefficients: &[f64; N], s: f64) -> f64 {
        let mut c = *coefficients;
        for level in 1..N {
            for i in 0..N - level {
                c[i] = (1.0 - s) * c[i] + s * c[i + 1];
            }
        }
        c[0]
    }

    #[test]
    fn a_product_is_the_product_everywhere() {
        let (a, b) = ([1.0, -2.0, 0.5, 3.0], [0.25, 4.0, -1.0, 7.0]);
        let ab = product_of_cubics(&a, &b);
        assert!(ab[0] == 0.25 && ab[6] == 21.0);
        for i in 0..=20 {
            let s = f64::from(i) / 20.0;
            assert!((value(&ab, s) - value(&a, s) * value(&b, s)).abs() < 1e-14);
        }
    }

    #[test]
    fn six_roots_are_isolated() {
        // Bernstein coefficients of the product of two cubics with known roots.
        let cubic = |roots: [f64; 3]| -> [f64; 4] {
            // Blossom: the value at the multiset of 0s and 1s is the mean over permutations of products of factors.
            std::array::from_fn(|k| {
                let arguments: [f64; 3] = std::array::from_fn(|i| if i < k { 1.0 } else { 0.0 });
                let orders = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
                orders.iter().map(|o| (0..3).map(|i| arguments[i] - roots[o[i]]).product::<f64>()).sum::<f64>() / 6.0
            })
        };
        let expected = [0.1, 0.25, 0.251, 0.6, 0.9, 0.99];
        let c = product_of_cubics(&cubic([0.1, 0.251, 0.9]), &cubic([0.25, 0.6, 0.99]));
        let mut brackets = Vec::new();
        isolate_roots(&c, 0.0, &mut |b| brackets.push(b));
        assert_eq!(brackets.len(), 6);
        for (bracket, root) in brackets.iter().zip(expected) {
            assert!(bracket.lo <= root && root <= bracket.hi);
        }
    }

    #[test]
    fn a_root_at_the_end_does_not_hide_the_one_inside() {
        // (s - 0.3) (1 - s), with an end that is zero or nearly so.
        for end in [0.0, 1e-17] {
            let mut roots = Vec::new();
            isolate_roots(&[-0.3, 0.35, end], 0.0, &mut |b| {
                roots.push(crate::math::newton_in_bracket(&b, |s| ((s - 0.3) * (1.0 - s), 1.3 - 2.0 * s)));
            });
            assert!(roots.len() == 1 && (roots[0] - 0.3).abs() < 1e-15, "{roots:?}");
        }
    }

    #[test]
    fn nothing_but_rounding_ends_soon() {
        let noise: [f64; 7] = std::array::from_fn(|k| if k % 2 == 0 { 1e-16 } else { -1e-16 });
        let mut count = 0;
        isolate_roots(&noise, 1e-15, &mut |_| count += 1);
        isolate_roots(&[f64::NAN; 7], 1e-15, &mut |_| count += 1);
        assert_eq!(count, 0);
    }

    #[test]
    fn a_double_root_is_dropped_and_a_root_at_a_shared_end_is_found_once() {
        // (s - 1/2)² and a polynomial that vanishes at its end, followed by one that begins there.
        let mut count = 0;
        isolate_roots(&[0.25, -0.25, 0.25], 1e-16, &mut |_| count += 1);
        assert!(count % 2 == 0);
        for (left, right) in [([-1.0, -0.5, 0.0], [0.0, 0.5, 1.0]), ([1.0, 0.5, 0.0], [0.0, -0.5, -1.0])] {
            let mut count = 0;
            isolate_roots(&left, 0.0, &mut |_| count += 1);
            isolate_roots(&right, 0.0, &mut |_| count += 1);
            assert_eq!(count, 1);
        }
    }
}
