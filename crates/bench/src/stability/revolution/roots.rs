//! All hits of a ray with a turned profile, in arithmetic of about 106 bits: one polynomial, whose roots lie between
//! those of its derivative.

use twofloat::TwoFloat;

use crate::math::RayF64;
use crate::stability::oracle::{quotient, root, value};

/// A polynomial by powers, the constant first.
type Polynomial = Vec<TwoFloat>;

fn number(x: f64) -> TwoFloat {
    TwoFloat::from(x)
}

fn at(p: &[TwoFloat], s: TwoFloat) -> TwoFloat {
    p.iter().rev().fold(number(0.0), |sum, &c| sum * s + c)
}

fn derivative(p: &[TwoFloat]) -> Polynomial {
    p.iter().enumerate().skip(1).map(|(i, &c)| c * i as f64).collect()
}

fn product(a: &[TwoFloat], b: &[TwoFloat]) -> Polynomial {
    let mut c = vec![number(0.0); a.len() + b.len() - 1];
    for (i, &x) in a.iter().enumerate() {
        for (j, &y) in b.iter().enumerate() {
            c[i + j] += x * y;
        }
    }
    c
}

/// `sum of factor * polynomial`.
fn combined(terms: &[(TwoFloat, &[TwoFloat])]) -> Polynomial {
    let length = terms.iter().map(|(_, p)| p.len()).max().unwrap_or(0);
    (0..length)
        .map(|i| terms.iter().fold(number(0.0), |sum, (factor, p)| p.get(i).map_or(sum, |&c| sum + *factor * c)))
        .collect()
}

/// A Bezier cubic by powers.
fn cubic(c: [f64; 4]) -> Polynomial {
    let c = c.map(number);
    let [d0, d1, d2] = [c[1] - c[0], c[2] - c[1], c[3] - c[2]];
    vec![c[0], d0 * 3.0, (d1 - d0) * 3.0, d2 - d1 * 2.0 + d0]
}

/// Parameters in `[0, 1]` where the sign of a polynomial changes, ascending. Zero counts as positive, but the ends as
/// negative that are reported as such.
fn sign_changes(p: &[TwoFloat], negative_ends: [bool; 2]) -> Vec<f64> {
    if p.len() < 2 {
        return Vec::new();
    }
    let mut ends = vec![0.0];
    ends.extend(sign_changes(&derivative(p), [false; 2]));
    ends.push(1.0);
    let positive = |s: f64| match s {
        0.0 if negative_ends[0] => false,
        1.0 if negative_ends[1] => false,
        _ => at(p, number(s)).hi() >= 0.0,
    };
    let between = |pair: &[f64]| {
        let (mut lo, mut hi) = (pair[0], pair[1]);
        let positive_at_lo = positive(lo);
        if positive_at_lo == positive(hi) {
            return None;
        }
        while hi - lo > f64::EPSILON * hi {
            let middle = 0.5 * (lo + hi);
            if middle <= lo || middle >= hi {
                break;
            }
            if positive(middle) == positive_at_lo { lo = middle } else { hi = middle }
        }
        Some(0.5 * (lo + hi))
    };
    ends.windows(2).filter_map(between).collect()
}

/// The root beside `s`, with the digits that `f64` lacks.
fn refined(p: &[TwoFloat], s: f64) -> TwoFloat {
    let slope = derivative(p);
    let mut best = number(s);
    for _ in 0..3 {
        let step = quotient(at(p, best), at(&slope, best));
        if step.hi().is_nan() || step.hi().abs() > 1e-8 {
            break;
        }
        best -= step;
    }
    best
}

/// Distances of all hits from `t = 0`, ascending.
pub fn all_hits(points: &[[f64; 2]], ray: &RayF64) -> Vec<f64> {
    // About the axis z: the height is the object's y.
    let o = [ray.origin.z, ray.origin.x, ray.origin.y].map(number);
    let d = [ray.direction.z, ray.direction.x, ray.direction.y].map(number);
    let a = d[0] * d[0] + d[1] * d[1];
    let b = o[0] * d[0] + o[1] * d[1];
    let c = o[0] * o[0] + o[1] * o[1];
    let mut hits = Vec::new();
    for segment in 0..points.len() / 3 {
        let [r, z] = [0, 1].map(|k| cubic(std::array::from_fn(|i| points[3 * segment + i][k])));
        let above = combined(&[(number(1.0), &z), (-o[2], &[number(1.0)])]);
        if d[2].hi() == 0.0 {
            for s in sign_changes(&above, [false; 2]) {
                let r = at(&r, refined(&above, s));
                let half_squared = b * b - a * (c - r * r);
                if half_squared.hi() >= 0.0 {
                    let half = root(half_squared);
                    hits.extend([quotient(-b - half, a), quotient(half - b, a)].map(value));
                }
            }
            continue;
        }
        let f = combined(&[
            (d[2] * d[2], &product(&r, &r)),
            (-(d[2] * d[2] * c), &[number(1.0)]),
            (-a, &product(&above, &above)),
            (-(b * d[2] * 2.0), &above),
        ]);
        // At a pole no ray is nearer to the axis than the surface, though a ray through it is as near.
        let poles = [0, 3].map(|i| points[3 * segment + i][0] == 0.0);
        hits.extend(sign_changes(&f, poles).iter().map(|&s| value(quotient(at(&above, refined(&f, s)), d[2]))));
    }
    hits.retain(|&t| t >= 0.0);
    hits.sort_by(f64::total_cmp);
    hits
}
