//! Textures from images.
//!
//! The image fills the unit square of uv with its bottom left corner at the origin: v grows upward, as in OBJ files.
//! Texels are squares whose colours stand at their middles.

use std::ops::{Add, Mul};
use std::sync::Arc;

use super::footprint::Footprint;
use super::image::{Channel, Decoding, TextureImage};
use super::mapping::{UvTransform, Wrap};
use crate::color::Rgb;
use crate::math::float::floor;
use crate::math::{Vec2, vec2};

/// What stands between the middles of texels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TextureFilter {
    /// The colour of the texel.
    Nearest,
    /// The colours of the four nearest texels, blended.
    Bilinear,
    /// As `Bilinear`, in the two levels of the image's [pyramid](super::Pyramid) whose texels are about as large as the
    /// footprint, blended.
    #[default]
    Trilinear,
}

/// An image with a way to look it up.
#[derive(Clone, Debug)]
pub struct Bitmap {
    /// The image; textures of one file share it.
    pub image: Arc<TextureImage>,
    /// How whole numbers become colours.
    pub decoding: Decoding,
    /// What stands between the middles of texels.
    pub filter: TextureFilter,
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
struct Texels {
    texels: [[usize; 2]; 4],
    weights: [f32; 4],
}

impl Bitmap {
    /// An image as it is: blended, repeated.
    pub fn new(image: Arc<TextureImage>, decoding: Decoding) -> Self {
        let (filter, wrap) = (TextureFilter::default(), [Wrap::default(); 2]);
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
        self.color_in(&self.image, self.decoding, uv)
    }

    /// One number at `uv`: the chosen channel, grey, or else the luminance.
    #[inline]
    pub fn scalar(&self, uv: Vec2) -> f32 {
        self.scalar_in(&self.image, self.decoding, uv)
    }

    /// The colour over a footprint.
    #[inline]
    pub fn color_over(&self, footprint: &Footprint) -> Rgb {
        match self.levels(footprint) {
            None => self.color(footprint.uv),
            Some(levels) => levels.blend(|image, decoding| self.color_in(image, decoding, footprint.uv)),
        }
    }

    /// As [`scalar`](Self::scalar), over a footprint.
    #[inline]
    pub fn scalar_over(&self, footprint: &Footprint) -> f32 {
        match self.levels(footprint) {
            None => self.scalar(footprint.uv),
            Some(levels) => levels.blend(|image, decoding| self.scalar_in(image, decoding, footprint.uv)),
        }
    }

    /// Starts to load the texels for a footprint into the caches.
    #[inline]
    pub(super) fn prefetch(&self, footprint: &Footprint) {
        let load = |image: &TextureImage| {
            self.around(image, footprint.uv).texels.into_iter().step_by(2).for_each(|texel| image.prefetch(texel));
        };
        match self.levels(footprint) {
            None => load(&self.image),
            Some(levels) => levels.images.iter().for_each(|(image, _)| load(image)),
        }
    }

    /// The levels of the pyramid for a footprint; `None` where the image itself is it.
    #[inline]
    fn levels(&self, footprint: &Footprint) -> Option<Levels<'_>> {
        let [along_u, along_v] = self.transform.axes();
        let size = vec2(self.image.width() as f32, self.image.height() as f32);
        let texels = footprint.area * (along_u * size).perp_dot(along_v * size).abs();
        // Written so that a NaN means the image too.
        if self.filter == TextureFilter::Trilinear && texels > 1.0 { Some(self.levels_of_area(texels)) } else { None }
    }

    /// The levels where a texel covers about this many of the image's.
    #[inline(never)]
    fn levels_of_area(&self, texels: f32) -> Levels<'_> {
        let pyramid = self.image.pyramid(self.decoding);
        let level = (0.5 * texels.log2()).min(pyramid.last() as f32);
        let below = level as usize;
        let image = |level: usize| match pyramid.level(level) {
            Some(image) => (image, Decoding::Linear),
            None => (&*self.image, self.decoding),
        };
        Levels { images: [image(below), image((below + 1).min(pyramid.last()))], fraction: level - below as f32 }
    }

    /// The colour at `uv` of the image or a level of it.
    #[inline]
    fn color_in(&self, image: &TextureImage, decoding: Decoding, uv: Vec2) -> Rgb {
        let color = match self.channel {
            Some(channel) => Rgb::splat(self.channel_value(image, decoding, uv, channel)),
            None => match self.filter {
                TextureFilter::Nearest => {
                    let [x, y] = self.nearest(image, uv);
                    image.color(x, y, decoding)
                }
                TextureFilter::Bilinear | TextureFilter::Trilinear => {
                    let around = self.around(image, uv);
                    image.weighted_sum(around.texels, around.weights, decoding)
                }
            },
        };
        if self.invert { Rgb::WHITE - color } else { color }
    }

    /// One number at `uv` of the image or a level of it.
    #[inline]
    fn scalar_in(&self, image: &TextureImage, decoding: Decoding, uv: Vec2) -> f32 {
        let value = match self.channel {
            Some(channel) => self.channel_value(image, decoding, uv, channel),
            None if image.has_color() => return self.color_in(image, decoding, uv).luminance(),
            None => self.channel_value(image, decoding, uv, Channel::R),
        };
        if self.invert { 1.0 - value } else { value }
    }

    fn channel_value(&self, image: &TextureImage, decoding: Decoding, uv: Vec2, channel: Channel) -> f32 {
        let value = |[x, y]: [usize; 2]| image.value(x, y, channel, decoding);
        match self.filter {
            TextureFilter::Nearest => value(self.nearest(image, uv)),
            TextureFilter::Bilinear | TextureFilter::Trilinear => {
                let Texels { texels, weights } = self.around(image, uv);
                texels.into_iter().zip(weights).map(|(texel, weight)| value(texel) * weight).sum()
            }
        }
    }

    /// How many cells there are along each axis: parts in which the same texels decide. Without blending a cell is a
    /// texel; else it is the square between the middles of four, the first of which lie beyond the edge.
    pub(super) fn cells(&self) -> [usize; 2] {
        let between = usize::from(self.filter != TextureFilter::Nearest);
        [self.image.width() + between, self.image.height() + between]
    }

    /// The smallest and the largest number of a cell.
    pub(super) fn range_in(&self, [x, y]: [usize; 2]) -> [f32; 2] {
        let (width, height) = (self.image.width() as i32, self.image.height() as i32);
        let texel = |dx: i32, dy: i32| {
            let (x, y) = (x as i32 - dx, y as i32 - dy);
            [self.wrap[0].texel(x, width), self.wrap[1].texel(y, height)]
        };
        let before: &[[i32; 2]] =
            if self.filter == TextureFilter::Nearest { &[[0, 0]] } else { &[[0, 0], [1, 0], [0, 1], [1, 1]] };
        let values = before.iter().map(|&[dx, dy]| self.scalar_of(&self.image, self.decoding, texel(dx, dy)));
        values.fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], value| [low.min(value), high.max(value)])
    }

    /// The number of a texel.
    fn scalar_of(&self, image: &TextureImage, decoding: Decoding, [x, y]: [usize; 2]) -> f32 {
        let value = match self.channel {
            Some(channel) => image.value(x, y, channel, decoding),
            None if image.has_color() => image.color(x, y, decoding).luminance(),
            None => image.value(x, y, Channel::R, decoding),
        };
        if self.invert { 1.0 - value } else { value }
    }

    /// The place in the unit square, from the top left, that `uv` means.
    #[inline]
    fn place(&self, uv: Vec2) -> Vec2 {
        let at = self.transform.apply(uv);
        vec2(self.wrap[0].fold(at.x), 1.0 - self.wrap[1].fold(at.y))
    }

    /// The texel around a place.
    #[inline]
    fn nearest(&self, image: &TextureImage, uv: Vec2) -> [usize; 2] {
        let place = self.place(uv);
        let (width, height) = (image.width(), image.height());
        [((place.x * width as f32) as usize).min(width - 1), ((place.y * height as f32) as usize).min(height - 1)]
    }

    /// The texels around a place.
    #[inline]
    fn around(&self, image: &TextureImage, uv: Vec2) -> Texels {
        let place = self.place(uv);
        let x = Between::new(place.x, image.width(), self.wrap[0]);
        let y = Between::new(place.y, image.height(), self.wrap[1]);
        let ([x0, x1], [y0, y1]) = (x.texels, y.texels);
        let (s, t) = (x.fraction, y.fraction);
        Texels {
            texels: [[x0, y0], [x1, y0], [x0, y1], [x1, y1]],
            weights: [(1.0 - s) * (1.0 - t), s * (1.0 - t), (1.0 - s) * t, s * t],
        }
    }
}

/// Two neighbouring levels of an image's pyramid.
struct Levels<'a> {
    /// The finer one first, with how whole numbers become colours.
    images: [(&'a TextureImage, Decoding); 2],
    /// How far the footprint is from the first to the second, from 0 to 1.
    fraction: f32,
}

impl Levels<'_> {
    /// A value between those of both levels.
    #[inline]
    fn blend<T: Mul<f32, Output = T> + Add<Output = T>>(&self, value: impl Fn(&TextureImage, Decoding) -> T) -> T {
        let [fine, coarse] = self.images.map(|(image, decoding)| value(image, decoding));
        fine * (1.0 - self.fraction) + coarse * self.fraction
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
        let first = floor(x);
        let (index, count) = (first as i32, count as i32);
        Self { texels: [wrap.texel(index, count), wrap.texel(index + 1, count)], fraction: x - first }
    }
}

#[cfg(test)]
mod tests;
