//! A checkerboard in uv.

use crate::color::Rgb;
use crate::math::Vec2;
use crate::math::float::floor;

/// Two colours in squares; the square at the origin of uv has `colors[0]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Checker {
    /// The two colours.
    pub colors: [Rgb; 2],
    /// Repetitions of a pair of squares along u and v: squares are `1 / (2 scale)` wide.
    pub scale: Vec2,
}

impl Checker {
    /// The colour at `uv`.
    #[inline(always)]
    pub fn color(&self, uv: Vec2) -> Rgb {
        let cell = uv * self.scale;
        let second_half = |x: f32| x - floor(x) >= 0.5;
        let is_second = second_half(cell.x) != second_half(cell.y);
        let [first, second] = self.colors.map(Rgb::to_array);
        let channel = |k: usize| if is_second { second[k] } else { first[k] };
        Rgb::new(channel(0), channel(1), channel(2))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_differ_and_diagonals_agree() {
        let checker = Checker { colors: [Rgb::BLACK, Rgb::WHITE], scale: Vec2::splat(2.0) };
        let at = |u: f32, v: f32| checker.color(Vec2::new(u, v));
        assert_eq!(at(0.1, 0.1), Rgb::BLACK);
        assert_eq!(at(0.3, 0.1), Rgb::WHITE);
        assert_eq!(at(0.3, 0.3), Rgb::BLACK);
        assert_eq!(at(-0.1, 0.1), Rgb::WHITE);
    }
}
