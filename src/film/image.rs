//! A finished picture with its layers.

use serde::{Deserialize, Serialize};

use super::{Coverage, LayerInfo, LayerKind};

/// A rectangle of pixels; `x` and `y` count from the upper left corner of the full picture. Serialized as
/// `[x, y, width, height]`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(into = "[u32; 4]", from = "[u32; 4]")]
pub struct Crop {
    /// First column.
    pub x: u32,
    /// First row.
    pub y: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl Crop {
    /// All of a picture of `size` pixels.
    pub const fn full(size: [u32; 2]) -> Self {
        Self { x: 0, y: 0, width: size[0], height: size[1] }
    }

    /// Number of pixels.
    pub const fn area(&self) -> u64 {
        self.width as u64 * self.height as u64
    }

    /// Whether a pixel lies within.
    #[inline]
    pub const fn contains(&self, x: u32, y: u32) -> bool {
        x >= self.x && y >= self.y && x - self.x < self.width && y - self.y < self.height
    }

    /// The common part; its area is zero if there is none.
    #[must_use]
    pub fn intersection(&self, other: &Self) -> Self {
        let overlap = |a: u32, a_length: u32, b: u32, b_length: u32| {
            let start = a.max(b);
            let end = a.saturating_add(a_length).min(b.saturating_add(b_length));
            (start, end.saturating_sub(start))
        };
        let (x, width) = overlap(self.x, self.width, other.x, other.width);
        let (y, height) = overlap(self.y, self.height, other.y, other.height);
        Self { x, y, width, height }
    }

    /// The rectangle with `border` pixels more on each side, as far as they lie within another.
    #[must_use]
    pub fn grown(&self, border: u32, within: Self) -> Self {
        let (x, y) = (self.x.saturating_sub(border), self.y.saturating_sub(border));
        let grow = |start: u32, length: u32, first: u32| (start + length).saturating_add(border) - first;
        Self { x, y, width: grow(self.x, self.width, x), height: grow(self.y, self.height, y) }.intersection(&within)
    }

    /// The pixels, row by row.
    pub fn pixels(self) -> impl Iterator<Item = (u32, u32)> {
        (self.y..self.y + self.height).flat_map(move |y| (self.x..self.x + self.width).map(move |x| (x, y)))
    }

    /// Whether the rectangle is not empty and lies within a picture of `size` pixels.
    pub fn fits(&self, size: [u32; 2]) -> bool {
        self.area() > 0 && self.intersection(&Self::full(size)) == *self
    }
}

impl From<Crop> for [u32; 4] {
    fn from(Crop { x, y, width, height }: Crop) -> Self {
        [x, y, width, height]
    }
}

impl From<[u32; 4]> for Crop {
    fn from([x, y, width, height]: [u32; 4]) -> Self {
        Self { x, y, width, height }
    }
}

/// A named group of channels, row by row from the top; a pixel's channels lie side by side.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// Which layer; its name and channels are in the table.
    pub kind: LayerKind,
    /// Of layers of [groups of lights](LayerKind::LightGroups): the group's name.
    pub group: Option<String>,
    /// `width * height * channels` values.
    pub data: Vec<f32>,
}

impl Layer {
    /// A layer with this data, of no group of lights.
    pub fn new(kind: LayerKind, data: Vec<f32>) -> Self {
        Self { kind, group: None, data }
    }

    /// The channels' full names in a file.
    pub fn channel_names(&self) -> Vec<String> {
        let prefix = self.group.as_ref().map(|group| format!("light_{group}.")).unwrap_or_default();
        LayerInfo::of(self.kind).channels.iter().map(|name| format!("{prefix}{name}")).collect()
    }

    /// Channels of a pixel.
    pub fn channels(&self) -> usize {
        LayerInfo::of(self.kind).channels.len()
    }

    /// The pixels in order, each as a slice of its channels.
    pub fn pixels(&self) -> std::slice::ChunksExact<'_, f32> {
        self.data.chunks_exact(self.channels())
    }

    /// One channel, row by row from the top.
    pub fn channel(&self, channel: usize) -> impl ExactSizeIterator<Item = f32> + '_ {
        self.pixels().map(move |pixel| pixel[channel])
    }
}

/// A finished picture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Image {
    /// Width and height of the full picture, with what was rendered around it.
    pub size: [u32; 2],
    /// The part that the layers hold.
    pub crop: Crop,
    /// Pixels on each side of `size` that lie around the picture to be shown, whose upper left corner is thus this
    /// pixel.
    pub overscan: u32,
    /// The layers; the first is [`LayerKind::Color`].
    pub layers: Vec<Layer>,
    /// Which shapes each pixel shows, if layers need it.
    #[doc(hidden)]
    pub coverage: Option<Coverage>,
}

impl Image {
    /// A whole picture of one layer, the colour: red, green, blue and alpha of each pixel.
    pub fn of_color(size: [u32; 2], data: Vec<f32>) -> Self {
        Self { size, crop: Crop::full(size), layers: vec![Layer::new(LayerKind::Color, data)], ..Self::default() }
    }

    /// A layer, if the picture has it.
    pub fn layer(&self, kind: LayerKind) -> Option<&Layer> {
        self.layers.iter().find(|layer| layer.kind == kind)
    }

    /// A layer's channels at a pixel of the full picture; `None` outside the crop or without the layer.
    pub fn pixel(&self, kind: LayerKind, x: u32, y: u32) -> Option<&[f32]> {
        if !self.crop.contains(x, y) {
            return None;
        }
        let layer = self.layer(kind)?;
        let index = (y - self.crop.y) as usize * self.crop.width as usize + (x - self.crop.x) as usize;
        layer.pixels().nth(index)
    }

    /// Red, green and blue at a pixel of the full picture; `None` outside the crop.
    pub fn rgb(&self, x: u32, y: u32) -> Option<[f32; 3]> {
        self.pixel(LayerKind::Color, x, y).and_then(|p| p.first_chunk().copied())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crops_intersect() {
        let a = Crop { x: 2, y: 3, width: 10, height: 10 };
        assert_eq!(a.intersection(&Crop::full([5, 20])), Crop { x: 2, y: 3, width: 3, height: 10 });
        assert_eq!(a.intersection(&Crop::full([2, 20])).area(), 0);
        assert!(a.fits([12, 13]) && !a.fits([11, 13]) && !Crop::full([0, 4]).fits([8, 8]));
        assert!(!Crop { x: u32::MAX, ..a }.fits([12, 13]));
    }

    #[test]
    fn pixels_are_found_by_their_place_in_the_full_picture() {
        let crop = Crop { x: 4, y: 5, width: 2, height: 2 };
        let layer = Layer::new(LayerKind::Z, vec![0.0, 1.0, 2.0, 3.0]);
        let image = Image { size: [8, 8], crop, layers: vec![layer], ..Image::default() };
        assert_eq!(image.pixel(LayerKind::Z, 5, 6), Some(&[3.0][..]));
        assert_eq!(image.pixel(LayerKind::Z, 6, 6), None);
        assert_eq!(image.pixel(LayerKind::N, 5, 6), None);
    }
}
