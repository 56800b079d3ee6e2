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
}
