//! Textures: colours and numbers as functions of uv, or those that vertices have.
//!
//! A lookup is a point, or stands for what a sample of a pixel covers: then it takes a smaller version of the image where the samples of the
//! pixel together would miss texels.

mod bitmap;
mod checker;
mod footprint;
mod image;
mod mapping;
mod pyramid;

pub use bitmap::{Bitmap, Filter};
pub use checker::Checker;
pub use footprint::Footprint;
pub use image::{Channel, Decoding, Image, ImageError};
pub use mapping::{UvTransform, Wrap};
pub use pyramid::Pyramid;

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
    /// The colour that the surface itself has, between those of its vertices; white where nothing but uv is known.
    VertexColor,
    /// The product of several textures.
    Product(Box<[Texture]>),
    /// 1 where the [number](Texture::scalar) of a texture reaches a threshold, else 0; never filtered.
    Step(Box<Texture>, f32),
}

impl Texture {
    /// The colour at `uv`.
    #[inline]
    pub fn color(&self, uv: Vec2) -> Rgb {
        match self {
            Self::Constant(color) => *color,
            Self::Checker(checker) => checker.color(uv),
            Self::Bitmap(bitmap) => bitmap.color(uv),
            Self::VertexColor => Rgb::WHITE,
            Self::Product(factors) => factors.iter().fold(Rgb::WHITE, |product, factor| product * factor.color(uv)),
            Self::Step(..) => Rgb::splat(self.scalar(uv)),
        }
    }

    /// One number at `uv`, for roughness, heights and the like: the luminance of a colour, or the channel that an image says.
    #[inline]
    pub fn scalar(&self, uv: Vec2) -> f32 {
        match self {
            Self::Bitmap(bitmap) => bitmap.scalar(uv),
            Self::Product(factors) => factors.iter().fold(1.0, |product, factor| product * factor.scalar(uv)),
            Self::Step(of, threshold) => f32::from(of.scalar(uv) >= *threshold),
            Self::Constant(_) | Self::Checker(_) | Self::VertexColor => self.color(uv).luminance(),
        }
    }

    /// The colour over a footprint. Of a product, each factor's own.
    #[inline]
    pub fn color_over(&self, footprint: &Footprint) -> Rgb {
        match self {
            Self::Constant(_) | Self::Checker(_) | Self::Step(..) => self.color(footprint.uv),
            Self::Bitmap(bitmap) => bitmap.color_over(footprint),
            Self::VertexColor => footprint.color,
            Self::Product(factors) => factors.iter().fold(Rgb::WHITE, |product, factor| product * factor.color_over(footprint)),
        }
    }

    /// As [`scalar`](Self::scalar), over a footprint.
    #[inline]
    pub fn scalar_over(&self, footprint: &Footprint) -> f32 {
        match self {
            Self::Bitmap(bitmap) => bitmap.scalar_over(footprint),
            Self::VertexColor => footprint.color.luminance(),
            Self::Product(factors) => factors.iter().fold(1.0, |product, factor| product * factor.scalar_over(footprint)),
            Self::Constant(_) | Self::Checker(_) | Self::Step(..) => self.scalar(footprint.uv),
        }
    }

    /// Whether a footprint has a say in it.
    pub fn is_filtered(&self) -> bool {
        match self {
            Self::Constant(_) | Self::Checker(_) | Self::VertexColor | Self::Step(..) => false,
            Self::Bitmap(bitmap) => bitmap.filter == Filter::Trilinear,
            Self::Product(factors) => factors.iter().any(Self::is_filtered),
        }
    }

    /// Whether uv have a say in it.
    pub fn uses_uv(&self) -> bool {
        match self {
            Self::Constant(_) | Self::VertexColor => false,
            Self::Checker(_) | Self::Bitmap(_) => true,
            Self::Product(factors) => factors.iter().any(Self::uses_uv),
            Self::Step(of, _) => of.uses_uv(),
        }
    }

    /// Whether the colours of vertices have a say in it.
    pub fn uses_vertex_colors(&self) -> bool {
        match self {
            Self::Constant(_) | Self::Checker(_) | Self::Bitmap(_) => false,
            Self::VertexColor => true,
            Self::Product(factors) => factors.iter().any(Self::uses_vertex_colors),
            Self::Step(of, _) => of.uses_vertex_colors(),
        }
    }

    /// The size of a texel in uv, the smallest of all images; `None` without an image.
    pub fn texel(&self) -> Option<Vec2> {
        match self {
            Self::Constant(_) | Self::Checker(_) | Self::VertexColor => None,
            Self::Bitmap(bitmap) => Some(bitmap.texel()),
            Self::Product(factors) => factors.iter().filter_map(Self::texel).reduce(Vec2::min),
            Self::Step(of, _) => of.texel(),
        }
    }

    /// Changes of the place in an image along u and along v, each per unit of uv; u and v themselves for what is no image.
    pub fn axes(&self) -> [Vec2; 2] {
        match self {
            Self::Bitmap(bitmap) => bitmap.transform.axes(),
            Self::Step(of, _) => of.axes(),
            Self::Constant(_) | Self::Checker(_) | Self::VertexColor | Self::Product(_) => [Vec2::X, Vec2::Y],
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
            // Of vertices as meshes are checked.
            Self::VertexColor | Self::Step(..) => [0.0, 1.0],
            Self::Product(factors) => factors.iter().map(Self::range).fold([1.0; 2], |a, b| {
                let products = [a[0] * b[0], a[0] * b[1], a[1] * b[0], a[1] * b[1]];
                products.into_iter().fold([f32::INFINITY, f32::NEG_INFINITY], |range, p| join(range, [p; 2]))
            }),
        }
    }
}
