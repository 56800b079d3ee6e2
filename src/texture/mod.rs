//! Textures: colours and numbers as functions of uv.
//!
//! Lookups are points: no mip levels, no footprints. The samples of a pixel integrate over its footprint.

mod bitmap;
mod checker;
mod image;
mod mapping;

pub use bitmap::{Bitmap, Filter};
pub use checker::Checker;
pub use image::{Channel, Decoding, Image, ImageError};
pub use mapping::{UvTransform, Wrap};

use crate::color::Rgb;
use crate::math::Vec2;

/// A texture.
#[derive(Clone, Debug)]
pub enum Texture {
    /// The same everywhere.
    Constant(Rgb),
    /// Two colours in a checkerboard.
    Checker(Checker),
    /// An image.
    Bitmap(Bitmap),
    /// The product of several textures.
    Product(Box<[Texture]>),
}

impl Texture {
    /// The colour at `uv`.
    #[inline]
    pub fn color(&self, uv: Vec2) -> Rgb {
        match self {
            Self::Constant(color) => *color,
            Self::Checker(checker) => checker.color(uv),
            Self::Bitmap(bitmap) => bitmap.color(uv),
            Self::Product(factors) => factors.iter().fold(Rgb::WHITE, |product, factor| product * factor.color(uv)),
        }
    }

    /// One number at `uv`, for roughness, heights and the like: the luminance of a colour, or the channel that an image says.
    #[inline]
    pub fn scalar(&self, uv: Vec2) -> f32 {
        match self {
            Self::Bitmap(bitmap) => bitmap.scalar(uv),
            Self::Product(factors) => factors.iter().fold(1.0, |product, factor| product * factor.scalar(uv)),
            Self::Constant(_) | Self::Checker(_) => self.color(uv).luminance(),
        }
    }

    /// The size of a texel in uv, the smallest of all images; `None` without an image.
    pub fn texel(&self) -> Option<Vec2> {
        match self {
            Self::Constant(_) | Self::Checker(_) => None,
            Self::Bitmap(bitmap) => Some(bitmap.texel()),
            Self::Product(factors) => factors.iter().filter_map(Self::texel).reduce(Vec2::min),
        }
    }

    /// Changes of the place in an image along u and along v, each per unit of uv; u and v themselves for what is no image.
    pub fn axes(&self) -> [Vec2; 2] {
        match self {
            Self::Bitmap(bitmap) => bitmap.transform.axes(),
            Self::Constant(_) | Self::Checker(_) | Self::Product(_) => [Vec2::X, Vec2::Y],
        }
    }

    /// Numbers that no channel of a colour is below or above.
    pub fn range(&self) -> [f32; 2] {
        let of = |color: Rgb| [color.r.min(color.g).min(color.b), color.max_channel()];
        let join = |a: [f32; 2], b: [f32; 2]| [a[0].min(b[0]), a[1].max(b[1])];
        match self {
            Self::Constant(color) => of(*color),
            Self::Checker(checker) => join(of(checker.colors[0]), of(checker.colors[1])),
            Self::Bitmap(bitmap) => bitmap.range(),
            Self::Product(factors) => factors.iter().map(Self::range).fold([1.0; 2], |a, b| {
                let products = [a[0] * b[0], a[0] * b[1], a[1] * b[0], a[1] * b[1]];
                products.into_iter().fold([f32::INFINITY, f32::NEG_INFINITY], |range, p| join(range, [p; 2]))
            }),
        }
    }
}
