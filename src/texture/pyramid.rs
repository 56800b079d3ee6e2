//! Image pyramids (Williams, "Pyramidal Parametrics"): an image, its half, its quarter and so on.
//!
//! A texel of a level is the mean of the part of the image that it covers, in linear values, for images of odd sizes
//! too: so all levels have the image's mean.

use arrayvec::ArrayVec;
use half::f16;

use super::image::{Decoding, TextureImage};
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

/// The share of each of up to three texels of a row, from `2 j` on, in texel `j` of a row of half as many.
struct Shares {
    first: usize,
    weights: ArrayVec<f64, 3>,
}

impl Shares {
    fn new(j: usize, count: usize) -> Self {
        let half = (count / 2).max(1);
        let mut weights = ArrayVec::new();
        if count == 1 {
            weights.push(1.0);
        } else if count.is_multiple_of(2) {
            weights.extend([0.5; 2]);
        } else {
            // A texel covers 2 + 1/half of the row's.
            let (j, half, count) = (j as f64, half as f64, count as f64);
            weights.extend([(half - j) / count, half / count, (j + 1.0) / count]);
        }
        Self { first: 2 * j, weights }
    }
}

fn halved(image: &TextureImage, decoding: Decoding) -> ImageData {
    let half = |count: usize| (count / 2).max(1);
    let (width, height, channels) = (half(image.width()), half(image.height()), image.channels());
    let columns: Vec<Shares> = (0..width).map(|x| Shares::new(x, image.width())).collect();
    let mut values = Vec::with_capacity(width * height * channels);
    let mut texels: [Vec<f32>; 3] = Default::default();
    for y in 0..height {
        let rows = Shares::new(y, image.height());
        for (i, texels) in texels.iter_mut().enumerate().take(rows.weights.len()) {
            texels.clear();
            image.push_row(rows.first + i, decoding, texels);
        }
        for columns in &columns {
            for channel in 0..channels {
                let mut sum = 0.0;
                for (texels, by_row) in texels.iter().zip(&rows.weights) {
                    let texels = texels[columns.first * channels + channel..].iter().step_by(channels);
                    for (&texel, by_column) in texels.zip(&columns.weights) {
                        sum += by_row * by_column * f64::from(texel);
                    }
                }
                values.push(sum as f32);
            }
        }
    }
    // Truncation of what is half a step higher: rounding itself is a library call on many processors.
    let rounded = |v: f32| (f64::from(v * 65_535.0) + 0.5) as u16;
    let samples = match image.samples() {
        Samples::U8(_) | Samples::U16(_) => Samples::U16(values.into_iter().map(rounded).collect()),
        Samples::F16(_) => Samples::F16(values.into_iter().map(f16::from_f32).collect()),
        Samples::F32(_) => Samples::F32(values),
    };
    ImageData { width, height, channels, samples }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rng;
    use crate::texture::image::Channel;

    fn mean(image: &TextureImage, channel: Channel, decoding: Decoding) -> f64 {
        let (width, height) = (image.width(), image.height());
        let sum: f64 =
            (0..width * height).map(|i| f64::from(image.value(i % width, i / width, channel, decoding))).sum();
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
                            let (expected, found) =
                                (mean(&image, channel, decoding), mean(level, channel, Decoding::Linear));
                            assert!(
                                (expected - found).abs() < tolerance,
                                "{width} x {height}, {channel:?}: {expected} {found}"
                            );
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn a_pyramid_has_a_third_of_the_image_in_texels() {
        let image =
            TextureImage::new(ImageData { width: 64, height: 64, channels: 1, samples: Samples::U16(vec![9; 4096]) })
                .unwrap();
        let pyramid = Pyramid::new(&image, Decoding::Linear);
        let bytes: usize = (1..=pyramid.last()).map(|level| pyramid.level(level).unwrap().memory_bytes()).sum();
        assert_eq!(bytes, 2 * (4096 - 1) / 3);
    }
}
