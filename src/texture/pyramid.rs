//! Image pyramids (Williams, "Pyramidal Parametrics"): an image, its half, its quarter and so on.
//!
//! A texel of a level is the mean of the part of the image that it covers, in linear values, for images of odd sizes
//! too: so all levels have the image's mean.

use half::f16;

use super::image::{Channel, Decoding, TextureImage};
use crate::image_data::{ImageData, Samples};

/// The smaller levels of an image, down to a single texel. Whole numbers are kept in 16 bits, floats as the image has
/// them; all are linear.
#[derive(Clone, Debug)]
pub struct Pyramid {
    /// From half the image's size on.
    levels: Vec<TextureImage>,
}

impl Pyramid {
    /// Over an image whose whole numbers mean colours by `decoding`.
    pub fn new(image: &TextureImage, decoding: Decoding) -> Self {
        let mut levels: Vec<TextureImage> = Vec::new();
        loop {
            let (last, decoding) = levels.last().map_or((image, decoding), |level| (level, Decoding::Linear));
            if last.width() == 1 && last.height() == 1 {
                return Self { levels };
            }
            let Ok(half) = TextureImage::new(halved(last, decoding)) else {
                // The mean of finite numbers is finite.
                return Self { levels };
            };
            levels.push(half);
        }
    }

    /// Level 1 is half the image; `None` for 0, the image itself, and beyond the last.
    #[inline]
    pub fn level(&self, level: usize) -> Option<&TextureImage> {
        self.levels.get(level.wrapping_sub(1))
    }

    /// The number of the last level.
    #[inline]
    pub fn last(&self) -> usize {
        self.levels.len()
    }
}

/// The share of each of three texels of a row, from `2 j` on, in texel `j` of a row of half as many.
struct Shares {
    /// The texels, within the row.
    texels: [usize; 3],
    weights: [f64; 3],
}

impl Shares {
    fn new(j: usize, count: usize) -> Self {
        let half = (count / 2).max(1);
        let weights = if count == 1 {
            [1.0, 0.0, 0.0]
        } else if count.is_multiple_of(2) {
            [0.5, 0.5, 0.0]
        } else {
            // A texel covers 2 + 1/half of the row's.
            let (j, half, count) = (j as f64, half as f64, count as f64);
            [(half - j) / count, half / count, (j + 1.0) / count]
        };
        Self { texels: [0, 1, 2].map(|i| (2 * j + i).min(count - 1)), weights }
    }
}

fn halved(image: &TextureImage, decoding: Decoding) -> ImageData {
    let half = |count: usize| (count / 2).max(1);
    let (width, height) = (half(image.width()), half(image.height()));
    let channels: &[Channel] = match (image.has_color(), image.has_alpha()) {
        (false, false) => &[Channel::R],
        (false, true) => &[Channel::R, Channel::A],
        (true, false) => &[Channel::R, Channel::G, Channel::B],
        (true, true) => &[Channel::R, Channel::G, Channel::B, Channel::A],
    };
    let columns: Vec<Shares> = (0..width).map(|x| Shares::new(x, image.width())).collect();
    let mut values = Vec::with_capacity(width * height * channels.len());
    for y in 0..height {
        let rows = Shares::new(y, image.height());
        for columns in &columns {
            for &channel in channels {
                let mut sum = 0.0;
                for (&row, &by_row) in rows.texels.iter().zip(&rows.weights).filter(|(_, weight)| **weight > 0.0) {
                    for (&column, &by_column) in columns.texels.iter().zip(&columns.weights).filter(|(_, weight)| **weight > 0.0) {
                        sum += by_row * by_column * f64::from(image.value(column, row, channel, decoding));
                    }
                }
                values.push(sum as f32);
            }
        }
    }
    let samples = match image.samples() {
        Samples::U8(_) | Samples::U16(_) => Samples::U16(values.iter().map(|v| (v * 65_535.0).round() as u16).collect()),
        Samples::F16(_) => Samples::F16(values.iter().map(|&v| f16::from_f32(v)).collect()),
        Samples::F32(_) => Samples::F32(values),
    };
    ImageData { width, height, channels: channels.len(), samples }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rng;

    fn mean(image: &TextureImage, channel: Channel, decoding: Decoding) -> f64 {
        let (width, height) = (image.width(), image.height());
        let sum: f64 = (0..width * height).map(|i| f64::from(image.value(i % width, i / width, channel, decoding))).sum();
        sum / (width * height) as f64
    }

    #[test]
    fn all_levels_have_the_mean_of_the_image() {
        for (width, height, channels) in [(8, 8, 3), (7, 5, 4), (1, 13, 1), (31, 2, 2), (1, 1, 3)] {
            let mut rng = Rng::new(5);
            let count = width * height * channels;
            let floats: Vec<f32> = (0..count).map(|_| 50.0 * rng.unit_f32() - 3.0).collect();
            let codes: Vec<u8> = floats.iter().map(|v| (5.0 * v) as u8).collect();
            for (samples, tolerance) in [
                (Samples::U8(codes.clone()), 1e-4),
                (Samples::U16(codes.iter().map(|&v| u16::from(v) * 251).collect()), 1e-4),
                (Samples::F16(floats.iter().map(|&v| f16::from_f32(v)).collect()), 0.1),
                (Samples::F32(floats), 1e-4),
            ] {
                let image = TextureImage::new(ImageData { width, height, channels, samples }).unwrap();
                for decoding in [Decoding::Linear, Decoding::Srgb] {
                    let pyramid = Pyramid::new(&image, decoding);
                    let last = pyramid.level(pyramid.last()).unwrap_or(&image);
                    assert_eq!([last.width(), last.height()], [1, 1]);
                    for level in 1..=pyramid.last() {
                        let level = pyramid.level(level).unwrap();
                        for channel in [Channel::R, Channel::G, Channel::B, Channel::A] {
                            let (expected, found) = (mean(&image, channel, decoding), mean(level, channel, Decoding::Linear));
                            assert!((expected - found).abs() < tolerance, "{width} x {height}, {channel:?}: {expected} {found}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn a_pyramid_has_a_third_of_the_image_in_texels() {
        let image = TextureImage::new(ImageData { width: 64, height: 64, channels: 1, samples: Samples::U16(vec![9; 4096]) }).unwrap();
        let pyramid = Pyramid::new(&image, Decoding::Linear);
        let bytes: usize = (1..=pyramid.last()).map(|level| pyramid.level(level).unwrap().memory_bytes()).sum();
        assert_eq!(bytes, 2 * (4096 - 1) / 3);
    }
}
