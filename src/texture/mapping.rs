//! From the uv of a surface to a place in an image.

use crate::math::float::floor;
use crate::math::{Vec2, vec2};

/// What lies beyond the edges of an image, along one axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    /// The image again.
    #[default]
    Repeat,
    /// The colours of the edge.
    Clamp,
    /// The image's mirror image, then the image again.
    Mirror,
}

impl Wrap {
    /// The place within the image, in `[0, 1]`, that a coordinate means; 0 for what is not finite.
    #[inline]
    pub fn fold(self, x: f32) -> f32 {
        let folded = match self {
            Self::Repeat => x - floor(x),
            Self::Clamp => x.clamp(0.0, 1.0),
            Self::Mirror => {
                let x = x - 2.0 * floor(0.5 * x);
                if x > 1.0 { 2.0 - x } else { x }
            }
        };
        // False for a NaN too.
        if (0.0..=1.0).contains(&folded) { folded } else { 0.0 }
    }

    /// The texel at an index that is at most one beyond the `count` texels of a row.
    #[inline]
    pub fn texel(self, index: i32, count: i32) -> usize {
        let inside = match self {
            Self::Repeat if index < 0 => count - 1,
            Self::Repeat if index >= count => 0,
            // A mirror image begins with the texel at the edge.
            _ => index.clamp(0, count - 1),
        };
        inside as usize
    }
}

/// An affine map of uv: scaled, then turned, then moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UvTransform {
    x_axis: Vec2,
    y_axis: Vec2,
    offset: Vec2,
}

impl UvTransform {
    /// Leaves uv as it is.
    pub const IDENTITY: Self = Self { x_axis: Vec2::X, y_axis: Vec2::Y, offset: Vec2::ZERO };

    /// `offset + R (scale * uv)`, where `R` turns by `rotation` radians from u towards v.
    pub fn new(scale: Vec2, rotation: f64, offset: Vec2) -> Self {
        let (sin, cos) = rotation.sin_cos();
        let (sin, cos) = (sin as f32, cos as f32);
        Self { x_axis: vec2(cos, sin) * scale.x, y_axis: vec2(-sin, cos) * scale.y, offset }
    }

    /// The place that a uv is moved to.
    #[inline]
    pub fn apply(&self, uv: Vec2) -> Vec2 {
        self.x_axis * uv.x + self.y_axis * uv.y + self.offset
    }

    /// Changes of the place along u and along v, each per unit.
    #[inline]
    pub fn axes(&self) -> [Vec2; 2] {
        [self.x_axis, self.y_axis]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_folds_into_the_image() {
        let odd = [
            0.0,
            -0.0,
            1.0,
            -1.0,
            2.0,
            0.25,
            -1e-9,
            1e-45,
            -1e-45,
            1.0 - 1e-8,
            1e9,
            -1e9,
            f32::MAX,
            -f32::MAX,
            8_388_609.5,
        ];
        let none = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY];
        for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
            for x in odd.into_iter().chain(none) {
                assert!((0.0..=1.0).contains(&wrap.fold(x)), "{wrap:?} {x}");
            }
            for index in -1..=4 {
                assert!(wrap.texel(index, 4) < 4 && wrap.texel(index.min(1), 1) == 0);
            }
        }
        assert_eq!([Wrap::Repeat, Wrap::Clamp, Wrap::Mirror].map(|w| w.fold(1.25)), [0.25, 1.0, 0.75]);
        assert_eq!([Wrap::Repeat, Wrap::Clamp, Wrap::Mirror].map(|w| w.fold(-0.25)), [0.75, 0.0, 0.25]);
        assert_eq!(Wrap::Mirror.fold(2.25), 0.25);
    }

    #[test]
    fn uv_is_scaled_then_turned_then_moved() {
        let map = UvTransform::new(vec2(2.0, 3.0), std::f64::consts::FRAC_PI_2, vec2(0.5, 0.25));
        let moved = map.apply(vec2(1.0, 0.0));
        assert!((moved - vec2(0.5, 2.25)).length() < 1e-6, "{moved}");
        let moved = map.apply(vec2(0.0, 1.0));
        assert!((moved - vec2(-2.5, 0.25)).length() < 1e-6, "{moved}");
        assert_eq!(UvTransform::IDENTITY.apply(vec2(0.1, -7.0)), vec2(0.1, -7.0));
    }
}
