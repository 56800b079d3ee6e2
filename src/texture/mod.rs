//! Textures: colour as a function of uv.

mod checker;

pub use checker::Checker;

use crate::color::Rgb;
use crate::math::Vec2;

/// A texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Texture {
    /// Two colours in a checkerboard.
    Checker(Checker),
}

impl Texture {
    /// The colour at `uv`.
    #[inline]
    pub fn color(&self, uv: Vec2) -> Rgb {
        match self {
            Self::Checker(checker) => checker.color(uv),
        }
    }

    /// One number at `uv`, for roughness and the like: the luminance of the colour.
    #[inline]
    pub fn scalar(&self, uv: Vec2) -> f32 {
        self.color(uv).luminance()
    }
}
