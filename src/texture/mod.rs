//! Textures: colours and numbers as functions of uv, or attributes of meshes.
//!
//! A lookup is a point, or has the footprint of a sample: then it takes a smaller version of the image
//! where the samples of the pixel together would miss texels.

mod bitmap;
mod checker;
mod footprint;
mod image;
mod mapping;
mod pyramid;
mod solid;

pub use bitmap::{Bitmap, TextureFilter};
pub use checker::Checker;
pub use footprint::Footprint;
pub use image::{Channel, Decoding, ImageError, TextureImage};
pub use mapping::{UvTransform, Wrap};
pub use pyramid::Pyramid;
pub use solid::{SolidTable, Solidity};

use crate::color::Rgb;
use crate::id::AttributeId;
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
    /// An attribute of the mesh times a factor; white where nothing but uv is known.
    Attribute(AttributeId, f32),
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
            Self::Attribute(..) => Rgb::WHITE,
            Self::Product(factors) => factors.iter().fold(Rgb::WHITE, |product, factor| product * factor.color(uv)),
            Self::Step(..) => Rgb::splat(self.scalar(uv)),
        }
    }

    /// One number at `uv`, for roughness, heights and the like: the luminance of a colour, or the chosen channel
    /// of an image.
    #[inline]
    pub fn scalar(&self, uv: Vec2) -> f32 {
        match self {
            Self::Bitmap(bitmap) => bitmap.scalar(uv),
            Self::Product(factors) => factors.iter().fold(1.0, |product, factor| product * factor.scalar(uv)),
            Self::Step(of, threshold) => f32::from(of.scalar(uv) >= *threshold),
            Self::Attribute(..) => 1.0,
            Self::Constant(_) | Self::Checker(_) => self.color(uv).luminance(),
        }
    }

    /// The colour over a footprint. Of a product, each factor's own.
    #[inline]
    pub fn color_over(&self, footprint: &Footprint) -> Rgb {
        match self {
            Self::Constant(_) | Self::Checker(_) => self.color(footprint.uv),
            Self::Step(..) => Rgb::splat(self.scalar_over(footprint)),
            Self::Bitmap(bitmap) => bitmap.color_over(footprint),
            Self::Attribute(id, scale) => attribute(*id, *scale, footprint),
            Self::Product(factors) => {
                factors.iter().fold(Rgb::WHITE, |product, factor| product * factor.color_over(footprint))
            }
        }
    }

    /// Starts to load what a lookup over a footprint will read.
    #[inline]
    pub fn prefetch(&self, footprint: &Footprint) {
        match self {
            Self::Bitmap(bitmap) => bitmap.prefetch(footprint),
            Self::Product(factors) => factors.iter().for_each(|factor| factor.prefetch(footprint)),
            Self::Step(of, _) => of.prefetch(footprint),
            Self::Constant(_) | Self::Checker(_) | Self::Attribute(..) => {}
        }
    }

    /// As [`scalar`](Self::scalar), over a footprint.
    #[inline]
    pub fn scalar_over(&self, footprint: &Footprint) -> f32 {
        match self {
            Self::Bitmap(bitmap) => bitmap.scalar_over(footprint),
            Self::Attribute(id, scale) => match attribute(*id, *scale, footprint) {
                // Exact for numbers.
                Rgb { r, g, b } if r == g && g == b => r,
                color => color.luminance(),
            },
            Self::Step(of, threshold) => {
                f32::from(of.scalar_over(&Footprint { area: 0.0, ..*footprint }) >= *threshold)
            }
            Self::Product(factors) => {
                factors.iter().fold(1.0, |product, factor| product * factor.scalar_over(footprint))
            }
            Self::Constant(_) | Self::Checker(_) => self.scalar(footprint.uv),
        }
    }

    /// Whether the value depends on the footprint.
    pub fn is_filtered(&self) -> bool {
        match self {
            Self::Constant(_) | Self::Checker(_) | Self::Attribute(..) | Self::Step(..) => false,
            Self::Bitmap(bitmap) => bitmap.filter == TextureFilter::Trilinear,
            Self::Product(factors) => factors.iter().any(Self::is_filtered),
        }
    }

    /// Whether an image is looked up.
    pub fn has_image(&self) -> bool {
        match self {
            Self::Constant(_) | Self::Checker(_) | Self::Attribute(..) => false,
            Self::Bitmap(_) => true,
            Self::Product(factors) => factors.iter().any(Self::has_image),
            Self::Step(of, _) => of.has_image(),
        }
    }

    /// Whether the value depends on uv.
    pub fn uses_uv(&self) -> bool {
        match self {
            Self::Constant(_) | Self::Attribute(..) => false,
            Self::Checker(_) | Self::Bitmap(_) => true,
            Self::Product(factors) => factors.iter().any(Self::uses_uv),
            Self::Step(of, _) => of.uses_uv(),
        }
    }

    /// The attributes of meshes that the value depends on, with their factors.
    pub fn attributes(&self) -> Vec<(AttributeId, f32)> {
        match self {
            Self::Constant(_) | Self::Checker(_) | Self::Bitmap(_) => Vec::new(),
            Self::Attribute(id, scale) => vec![(*id, *scale)],
            Self::Product(factors) => factors.iter().flat_map(Self::attributes).collect(),
            Self::Step(of, _) => of.attributes(),
        }
    }

    /// The size of a texel in uv, the smallest of all images; `None` without an image.
    pub fn texel(&self) -> Option<Vec2> {
        match self {
            Self::Constant(_) | Self::Checker(_) | Self::Attribute(..) => None,
            Self::Bitmap(bitmap) => Some(bitmap.texel()),
            Self::Product(factors) => factors.iter().filter_map(Self::texel).reduce(Vec2::min),
            Self::Step(of, _) => of.texel(),
        }
    }

    /// Changes of the place in an image along u and along v, each per unit of uv; u and v themselves for what is no
    /// image.
    pub fn axes(&self) -> [Vec2; 2] {
        match self {
            Self::Bitmap(bitmap) => bitmap.transform.axes(),
            Self::Step(of, _) => of.axes(),
            Self::Constant(_) | Self::Checker(_) | Self::Attribute(..) | Self::Product(_) => [Vec2::X, Vec2::Y],
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
            // Of attributes as meshes are checked: for emission above 1, too.
            Self::Attribute(..) | Self::Step(..) => [0.0, 1.0],
            Self::Product(factors) => factors.iter().map(Self::range).fold([1.0; 2], |a, b| {
                let products = [a[0] * b[0], a[0] * b[1], a[1] * b[0], a[1] * b[1]];
                products.into_iter().fold([f32::INFINITY, f32::NEG_INFINITY], |range, p| join(range, [p; 2]))
            }),
        }
    }
}

/// An attribute times a factor; white where the mesh is not known.
fn attribute(id: AttributeId, scale: f32, footprint: &Footprint) -> Rgb {
    footprint.attributes.and_then(|point| point.value(id)).map_or(Rgb::WHITE, |value| Rgb::from(value) * scale)
}
