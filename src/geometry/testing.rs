//! For tests only: endless rays, and arithmetic of about 106 bits.

use std::ops::{Add, Div, Mul, Neg, Sub};

use crate::math::{DVec3, RayF64};

/// A ray without an end.
pub(crate) fn endless(origin: DVec3, direction: DVec3) -> RayF64 {
    RayF64 { origin, direction, t_min: 0.0, t_max: f64::INFINITY }
}

/// The unevaluated sum of two numbers, the second below half a unit in the last place of the first (Dekker; Knuth).
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub(crate) struct Double {
    hi: f64,
    lo: f64,
}

impl Double {
    pub fn value(self) -> f64 {
        self.hi + self.lo
    }

    pub fn sqrt(self) -> Self {
        if self.hi <= 0.0 {
            return Self::from(0.0);
        }
        let root = Self::from(self.hi.sqrt());
        let half = Self::from(0.5);
        let once = half * (root + self / root);
        half * (once + self / once)
    }
}

impl From<f64> for Double {
    fn from(x: f64) -> Self {
        Self { hi: x, lo: 0.0 }
    }
}

fn sum(a: f64, b: f64) -> Double {
    let hi = a + b;
    let part = hi - a;
    Double { hi, lo: (a - (hi - part)) + (b - part) }
}

impl Add for Double {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        let (high, low) = (sum(self.hi, other.hi), sum(self.lo, other.lo));
        let first = sum(high.hi, high.lo + low.hi);
        sum(first.hi, first.lo + low.lo)
    }
}

impl Neg for Double {
    type Output = Self;
    fn neg(self) -> Self {
        Self { hi: -self.hi, lo: -self.lo }
    }
}

impl Sub for Double {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Double {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let hi = self.hi * other.hi;
        let lo = self.hi.mul_add(other.hi, -hi);
        sum(hi, lo + (self.hi * other.lo + self.lo * other.hi))
    }
}

impl Div for Double {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let first = Self::from(self.hi / other.hi);
        let rest = self - first * other;
        let second = Self::from(rest.hi / other.hi);
        let last = rest - second * other;
        first + second + Self::from(last.hi / other.hi)
    }
}
