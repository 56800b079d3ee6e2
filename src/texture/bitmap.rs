//! Textures from images.
//!
//! The image fills the unit square of uv with its bottom left corner at the origin: v grows upward, as in OBJ files. Texels are squares whose
//! colours stand at their middles.

use std::sync::Arc;

use super::image::{Channel, Decoding, Image};
use super::mapping::{UvTransform, Wrap};
use crate::color::Rgb;
use crate::math::{Vec2, vec2};

/// What stands between the middles of texels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Filter {
    /// The colour of the texel.
    Nearest,
    /// The colours of the four nearest texels, blended.
    #[default]
    Bilinear,
}

/// An image with a way to look it up.
#[derive(Clone, Debug)]
pub struct Bitmap {
    /// The image; textures of one file share it.
    pub image: Arc<Image>,
    /// How whole numbers become colours.
    pub decoding: Decoding,
    /// What stands between the middles of texels.
    pub filter: Filter,
    /// What lies beyond the edges, along u and along v.
    pub wrap: [Wrap; 2],
    /// From the uv of the surface to that of the image.
    pub transform: UvTransform,
    /// One number of each pixel in place of its colour.
    pub channel: Option<Channel>,
    /// Whether 1 minus the value is meant.
    pub invert: bool,
}

/// The four texels around a place, as columns and rows, and their weights.
struct Footprint {
    texels: [[usize; 2]; 4],
    weights: [f32; 4],
}

impl Bitmap {
    /// An image as it is: bilinear, repeated.
    pub fn new(image: Arc<Image>, decoding: Decoding) -> Self {
        let (filter, wrap) = (Filter::default(), [Wrap::default(); 2]);
        Self { image, decoding, filter, wrap, transform: UvTransform::IDENTITY, channel: None, invert: false }
    }

    /// The size of a texel in uv.
    pub fn texel(&self) -> Vec2 {
        let size = vec2(self.image.width() as f32, self.image.height() as f32);
        let [u, v] = self.transform.axes().map(|axis| 1.0 / (axis * size).length());
        // An image that does not change along an axis may be looked up at any distance.
        vec2(if u.is_finite() { u } else { 1.0 }, if v.is_finite() { v } else { 1.0 })
    }

    /// Numbers that no value is below or above.
    pub fn range(&self) -> [f32; 2] {
        let [min, max] = self.image.range(self.channel == Some(Channel::A));
        if self.invert { [1.0 - max, 1.0 - min] } else { [min, max] }
    }

    /// The colour at `uv`.
    #[inline]
    pub fn color(&self, uv: Vec2) -> Rgb {
        let color = match self.channel {
            Some(channel) => Rgb::splat(self.channel_value(uv, channel)),
            None => match self.filter {
                Filter::Nearest => {
                    let [x, y] = self.nearest(uv);
                    self.image.color(x, y, self.decoding)
                }
                Filter::Bilinear => {
                    let footprint = self.footprint(uv);
                    self.image.weigh(footprint.texels, footprint.weights, self.decoding)
                }
            },
        };
        if self.invert { Rgb::WHITE - color } else { color }
    }

    /// One number at `uv`: the chosen channel, grey, or else the luminance.
    #[inline]
    pub fn scalar(&self, uv: Vec2) -> f32 {
        let value = match self.channel {
            Some(channel) => self.channel_value(uv, channel),
            None if self.image.has_color() => return self.color(uv).luminance(),
            None => self.channel_value(uv, Channel::R),
        };
        if self.invert { 1.0 - value } else { value }
    }

    fn channel_value(&self, uv: Vec2, channel: Channel) -> f32 {
        let value = |[x, y]: [usize; 2]| self.image.value(x, y, channel, self.decoding);
        match self.filter {
            Filter::Nearest => value(self.nearest(uv)),
            Filter::Bilinear => {
                let Footprint { texels, weights } = self.footprint(uv);
                texels.into_iter().zip(weights).map(|(texel, weight)| value(texel) * weight).sum()
            }
        }
    }

    /// The texel around a place.
    #[inline]
    fn nearest(&self, uv: Vec2) -> [usize; 2] {
        let at = self.transform.apply(uv);
        let (width, height) = (self.image.width(), self.image.height());
        let (x, y) = (self.wrap[0].fold(at.x) * width as f32, (1.0 - self.wrap[1].fold(at.y)) * height as f32);
        [(x as usize).min(width - 1), (y as usize).min(height - 1)]
    }

    #[inline]
    fn footprint(&self, uv: Vec2) -> Footprint {
        let at = self.transform.apply(uv);
        let (width, height) = (self.image.width(), self.image.height());
        let x = Between::new(self.wrap[0].fold(at.x), width, self.wrap[0]);
        let y = Between::new(1.0 - self.wrap[1].fold(at.y), height, self.wrap[1]);
        let ([x0, x1], [y0, y1]) = (x.texels, y.texels);
        let (s, t) = (x.fraction, y.fraction);
        Footprint {
            texels: [[x0, y0], [x1, y0], [x0, y1], [x1, y1]],
            weights: [(1.0 - s) * (1.0 - t), s * (1.0 - t), (1.0 - s) * t, s * t],
        }
    }
}

/// A place between the middles of two texels of a row.
struct Between {
    texels: [usize; 2],
    /// How far it is from the first to the second, from 0 to 1.
    fraction: f32,
}

impl Between {
    #[inline]
    fn new(place: f32, count: usize, wrap: Wrap) -> Self {
        let x = place * count as f32 - 0.5;
        let first = x.floor();
        let (index, count) = (first as i32, count as i32);
        Self { texels: [wrap.texel(index, count), wrap.texel(index + 1, count)], fraction: x - first }
    }
}

#[cfg(test)]
mod tests;
