//! Linear RGB with Rec.709 primaries, luminance and the sRGB transfer curve (IEC 61966-2-1).

use crate::math::rows::{BATCH, Element, Row};
use std::ops::{Add, AddAssign, Div, Mul, MulAssign, Sub};

/// Linear Rec.709 red, green, blue; radiance, reflectance or throughput by the name of the variable.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct Rgb {
    /// Red.
    pub r: f32,
    /// Green.
    pub g: f32,
    /// Blue.
    pub b: f32,
}

/// A colour for each of many things, by channel.
#[derive(Clone, Debug)]
pub struct RgbRows(pub [Row; 3]);

impl RgbRows {
    /// That of one.
    #[inline(always)]
    pub fn get(&self, i: usize) -> Rgb {
        Rgb::new(self.0[0][i], self.0[1][i], self.0[2][i])
    }

    /// Sets that of one.
    #[inline(always)]
    pub fn set(&mut self, i: usize, color: Rgb) {
        (self.0[0][i], self.0[1][i], self.0[2][i]) = (color.r, color.g, color.b);
    }
}

impl Element for Rgb {
    type Rows = RgbRows;
    const ZERO: RgbRows = RgbRows([[0.0; BATCH]; 3]);

    #[inline(always)]
    fn get(rows: &RgbRows, i: usize) -> Self {
        rows.get(i)
    }

    #[inline(always)]
    fn set(rows: &mut RgbRows, i: usize, value: Self) {
        rows.set(i, value);
    }
}

impl Rgb {
    /// All zero.
    pub const BLACK: Self = Self::splat(0.0);
    /// All one.
    pub const WHITE: Self = Self::splat(1.0);

    /// From three components.
    #[inline(always)]
    pub const fn new(r: f32, g: f32, b: f32) -> Self {
        Self { r, g, b }
    }

    /// The same value in every channel.
    #[inline(always)]
    pub const fn splat(v: f32) -> Self {
        Self { r: v, g: v, b: v }
    }

    /// Relative luminance, the Y of CIE XYZ.
    #[inline(always)]
    pub fn luminance(self) -> f32 {
        0.212_671 * self.r + 0.715_160 * self.g + 0.072_169 * self.b
    }

    /// The largest channel.
    #[inline(always)]
    pub fn max_channel(self) -> f32 {
        self.r.max(self.g).max(self.b)
    }

    /// The mean of the channels.
    #[inline(always)]
    pub fn mean(self) -> f32 {
        (self.r + self.g + self.b) * (1.0 / 3.0)
    }

    /// Whether every channel is zero.
    #[inline(always)]
    pub fn is_black(self) -> bool {
        self.r == 0.0 && self.g == 0.0 && self.b == 0.0
    }

    /// Whether every channel is finite.
    #[inline(always)]
    pub fn is_finite(self) -> bool {
        self.r.is_finite() && self.g.is_finite() && self.b.is_finite()
    }

    /// Each channel through `f`.
    #[inline(always)]
    #[must_use]
    pub fn map(self, f: impl Fn(f32) -> f32) -> Self {
        Self::new(f(self.r), f(self.g), f(self.b))
    }

    /// The channels as an array.
    #[inline(always)]
    pub const fn to_array(self) -> [f32; 3] {
        [self.r, self.g, self.b]
    }
}

impl From<[f32; 3]> for Rgb {
    #[inline(always)]
    fn from([r, g, b]: [f32; 3]) -> Self {
        Self { r, g, b }
    }
}

impl Add for Rgb {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self::new(self.r + o.r, self.g + o.g, self.b + o.b)
    }
}

impl Sub for Rgb {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Self::new(self.r - o.r, self.g - o.g, self.b - o.b)
    }
}

impl Mul for Rgb {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: Self) -> Self {
        Self::new(self.r * o.r, self.g * o.g, self.b * o.b)
    }
}

impl Mul<f32> for Rgb {
    type Output = Self;
    #[inline(always)]
    fn mul(self, s: f32) -> Self {
        Self::new(self.r * s, self.g * s, self.b * s)
    }
}

impl Mul<Rgb> for f32 {
    type Output = Rgb;
    #[inline(always)]
    fn mul(self, c: Rgb) -> Rgb {
        c * self
    }
}

impl Div<f32> for Rgb {
    type Output = Self;
    #[inline(always)]
    fn div(self, s: f32) -> Self {
        self * (1.0 / s)
    }
}

impl AddAssign for Rgb {
    #[inline(always)]
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}

impl MulAssign for Rgb {
    #[inline(always)]
    fn mul_assign(&mut self, o: Self) {
        *self = *self * o;
    }
}

impl MulAssign<f32> for Rgb {
    #[inline(always)]
    fn mul_assign(&mut self, s: f32) {
        *self = *self * s;
    }
}

/// Linear to sRGB-encoded, both in `[0, 1]`.
pub fn srgb_from_linear(x: f32) -> f32 {
    if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 }
}

/// sRGB-encoded to linear, both in `[0, 1]`.
pub fn linear_from_srgb(x: f32) -> f32 {
    if x <= 0.040_45 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_srgb_curve_inverts_itself() {
        for i in 0..=255 {
            let encoded = i as f32 / 255.0;
            assert!((srgb_from_linear(linear_from_srgb(encoded)) - encoded).abs() < 1e-6);
        }
    }
}
