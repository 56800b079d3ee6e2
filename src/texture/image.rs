//! Images as textures keep them: the numbers of the file, decoded when they are looked up.

use std::sync::{LazyLock, OnceLock};

use half::f16;

use super::pyramid::Pyramid;
use crate::color::{Rgb, linear_from_srgb};
use crate::image_data::{ImageData, Samples};
use crate::math::prefetch::prefetch;

/// Why an image is refused.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ImageError {
    /// A number that is infinite or none.
    #[error("the pixel at column {x}, row {y} (from the top left, from 0) is not finite")]
    NotFinite {
        /// Its column.
        x: usize,
        /// Its row.
        y: usize,
    },
    /// A buffer of the wrong length.
    #[error("an image of {width} x {height} pixels with {channels} channels does not have {count} numbers")]
    Count {
        /// Width in pixels.
        width: usize,
        /// Height in pixels.
        height: usize,
        /// Numbers per pixel.
        channels: usize,
        /// Numbers there are.
        count: usize,
    },
}

/// How whole numbers become colours. Floats are linear either way, and so is alpha.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Decoding {
    /// In proportion.
    Linear,
    /// By the sRGB transfer curve.
    Srgb,
}

/// One of the numbers of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// Red, or grey.
    R,
    /// Green, or grey.
    G,
    /// Blue, or grey.
    B,
    /// Alpha; 1 where an image has none.
    A,
}

/// An image; rows run from the top, as in the file.
#[derive(Clone, Debug)]
pub struct TextureImage {
    data: ImageData,
    /// Smallest and largest number, of the colours and of alpha.
    ranges: [[f32; 2]; 2],
    /// Linear values of the codes of an 8-bit image, in proportion and by the sRGB curve.
    tables: &'static [[f32; 256]; 2],
    /// Smaller versions by [`Decoding`], made when they are first used.
    pyramids: [OnceLock<Box<Pyramid>>; 2],
}

/// Linear values of the 256 codes, in proportion and by the sRGB curve.
static TABLES_U8: LazyLock<[[f32; 256]; 2]> = LazyLock::new(|| {
    let linear = std::array::from_fn(|i| i as f32 / 255.0);
    [linear, linear.map(linear_from_srgb)]
});

/// Linear values of the 65,536 codes by the sRGB curve.
static SRGB_U16: LazyLock<Vec<f32>> =
    LazyLock::new(|| (0..65_536).map(|i| linear_from_srgb(i as f32 / 65_535.0)).collect());

impl TextureImage {
    /// An image from a file's numbers.
    ///
    /// # Errors
    /// If a number is not finite, or there are more or fewer than the size says.
    pub fn new(data: ImageData) -> Result<Self, ImageError> {
        let ImageData { width, height, channels, ref samples } = data;
        let count = samples.count();
        if count == 0 || count != width * height * channels || !(1..=4).contains(&channels) {
            return Err(ImageError::Count { width, height, channels, count });
        }
        let mut ranges = [[f32::INFINITY, f32::NEG_INFINITY]; 2];
        let colors = channels - usize::from(channels.is_multiple_of(2));
        let mut check = |i: usize, value: f32| {
            if !value.is_finite() {
                return Err(ImageError::NotFinite { x: i / channels % width, y: i / channels / width });
            }
            let range = &mut ranges[usize::from(i % channels >= colors)];
            *range = [range[0].min(value), range[1].max(value)];
            Ok(())
        };
        match samples {
            Samples::F16(s) => s.iter().enumerate().try_for_each(|(i, v)| check(i, v.to_f32()))?,
            Samples::F32(s) => s.iter().enumerate().try_for_each(|(i, v)| check(i, *v))?,
            Samples::U8(_) | Samples::U16(_) => ranges = [[0.0, 1.0]; 2],
        }
        Ok(Self { data, ranges, tables: &TABLES_U8, pyramids: [OnceLock::new(), OnceLock::new()] })
    }

    /// Width in pixels.
    #[inline]
    pub fn width(&self) -> usize {
        self.data.width
    }

    /// Height in pixels.
    #[inline]
    pub fn height(&self) -> usize {
        self.data.height
    }

    /// Numbers of a pixel: one of grey, three of colour, and one more with alpha.
    pub fn channels(&self) -> usize {
        self.data.channels
    }

    /// Whether pixels have red, green and blue rather than grey.
    #[inline]
    pub fn has_color(&self) -> bool {
        self.data.channels >= 3
    }

    /// Whether pixels have an alpha.
    pub fn has_alpha(&self) -> bool {
        self.data.channels.is_multiple_of(2)
    }

    /// Whether the numbers are floats, which are linear.
    pub fn is_float(&self) -> bool {
        self.data.is_float()
    }

    /// Smallest and largest number of alpha or of all colour channels; 0 and 1 for whole numbers and where there is no
    /// alpha.
    pub fn range(&self, alpha: bool) -> [f32; 2] {
        if alpha && !self.has_alpha() { [0.0, 1.0] } else { self.ranges[usize::from(alpha)] }
    }

    /// The smallest alpha; 1 where there is none.
    pub fn least_alpha(&self) -> f32 {
        let (channels, samples) = (self.data.channels, &self.data.samples);
        if !self.has_alpha() {
            return 1.0;
        }
        match samples {
            Samples::U8(s) => {
                s.iter().skip(channels - 1).step_by(channels).min().map_or(1.0, |&a| f32::from(a) / 255.0)
            }
            Samples::U16(s) => s.iter().skip(channels - 1).step_by(channels).min().map_or(1.0, |&a| from_u16(a)),
            Samples::F16(_) | Samples::F32(_) => self.ranges[1][0],
        }
    }

    /// Whether red, green and blue are the same in every pixel.
    pub fn is_grey(&self) -> bool {
        fn same<T: PartialEq>(s: &[T], channels: usize) -> bool {
            s.chunks_exact(channels).all(|p| p[0] == p[1] && p[1] == p[2])
        }
        let channels = self.data.channels;
        !self.has_color()
            || match &self.data.samples {
                Samples::U8(s) => same(s, channels),
                Samples::U16(s) => same(s, channels),
                Samples::F16(s) => same(s, channels),
                Samples::F32(s) => same(s, channels),
            }
    }

    /// The numbers, `width * height` times as many as channels.
    pub(super) fn samples(&self) -> &Samples {
        &self.data.samples
    }

    /// The smaller versions of the image; made at the first call.
    #[inline]
    pub fn pyramid(&self, decoding: Decoding) -> &Pyramid {
        self.pyramids[decoding as usize].get_or_init(|| Box::new(Pyramid::new(self, decoding)))
    }

    /// Bytes of the pixels.
    pub fn memory_bytes(&self) -> usize {
        self.data.samples.memory_bytes()
    }

    /// Starts to load a pixel (column, row) into the caches.
    #[inline(always)]
    pub(super) fn prefetch(&self, [x, y]: [usize; 2]) {
        let i = (y * self.data.width + x) * self.data.channels;
        match &self.data.samples {
            Samples::U8(s) => prefetch(s, i),
            Samples::U16(s) => prefetch(s, i),
            Samples::F16(s) => prefetch(s, i),
            Samples::F32(s) => prefetch(s, i),
        }
    }

    /// The sum of `weights` times the colours of four pixels (column, row).
    #[inline]
    pub fn weighted_sum(&self, pixels: [[usize; 2]; 4], weights: [f32; 4], decoding: Decoding) -> Rgb {
        let (width, channels) = (self.data.width, self.data.channels);
        let at = |k: usize| (pixels[k][1] * width + pixels[k][0]) * channels;
        macro_rules! sum {
            ($samples:expr, $decode:expr) => {{
                let pixel = |k: usize| {
                    let i = at(k);
                    if channels >= 3 {
                        let s = &$samples[i..i + 3];
                        Rgb::new($decode(s[0]), $decode(s[1]), $decode(s[2]))
                    } else {
                        Rgb::splat($decode($samples[i]))
                    }
                };
                pixel(0) * weights[0] + pixel(1) * weights[1] + pixel(2) * weights[2] + pixel(3) * weights[3]
            }};
        }
        match &self.data.samples {
            Samples::U8(s) => {
                let table = &self.tables[decoding as usize];
                sum!(s, |v: u8| table[usize::from(v)])
            }
            Samples::U16(s) => match decoding {
                Decoding::Linear => sum!(s, from_u16),
                Decoding::Srgb => sum!(s, |v: u16| SRGB_U16[usize::from(v)]),
            },
            Samples::F16(s) => sum!(s, f16::to_f32),
            Samples::F32(s) => sum!(s, std::convert::identity::<f32>),
        }
    }

    /// The colour of one pixel.
    #[inline]
    pub fn color(&self, x: usize, y: usize, decoding: Decoding) -> Rgb {
        let value = |channel| self.value(x, y, channel, decoding);
        if self.has_color() {
            Rgb::new(value(Channel::R), value(Channel::G), value(Channel::B))
        } else {
            Rgb::splat(value(Channel::R))
        }
    }

    /// One number of one pixel.
    #[inline]
    pub fn value(&self, x: usize, y: usize, channel: Channel, decoding: Decoding) -> f32 {
        let channels = self.data.channels;
        let (offset, decoding) = match channel {
            Channel::A if !self.has_alpha() => return 1.0,
            Channel::A => (channels - 1, Decoding::Linear),
            _ if channels < 3 => (0, decoding),
            _ => (channel as usize, decoding),
        };
        self.sample((y * self.data.width + x) * channels + offset, decoding)
    }

    /// Appends the numbers of a row, pixel by pixel.
    pub fn push_row(&self, y: usize, decoding: Decoding, row: &mut Vec<f32>) {
        let channels = self.data.channels;
        let colors = if self.has_alpha() { channels - 1 } else { channels };
        let start = y * self.data.width * channels;
        for pixel in (start..).step_by(channels).take(self.data.width) {
            row.extend((pixel..pixel + colors).map(|i| self.sample(i, decoding)));
            row.extend((pixel + colors..pixel + channels).map(|i| self.sample(i, Decoding::Linear)));
        }
    }

    #[inline(always)]
    fn sample(&self, i: usize, decoding: Decoding) -> f32 {
        match &self.data.samples {
            Samples::U8(s) => self.tables[decoding as usize][usize::from(s[i])],
            Samples::U16(s) if decoding == Decoding::Srgb => SRGB_U16[usize::from(s[i])],
            Samples::U16(s) => from_u16(s[i]),
            Samples::F16(s) => s[i].to_f32(),
            Samples::F32(s) => s[i],
        }
    }
}

#[inline]
fn from_u16(v: u16) -> f32 {
    f32::from(v) * (1.0 / 65_535.0)
}
