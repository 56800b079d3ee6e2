//! Pixels of images: readers of files fill them, textures own and look them up.

use half::f16;

/// An image with the numbers of its file, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct ImageData {
    /// Width in pixels, at least 1.
    pub width: usize,
    /// Height in pixels, at least 1.
    pub height: usize,
    /// Numbers per pixel: 1 is grey, 2 grey and alpha, 3 red, green and blue, 4 those and alpha.
    pub channels: usize,
    /// `width * height * channels` numbers.
    pub samples: Samples,
}

/// The numbers of an image.
#[derive(Clone, Debug, PartialEq)]
pub enum Samples {
    /// From 0 to 255.
    U8(Vec<u8>),
    /// From 0 to 65,535.
    U16(Vec<u16>),
    /// Floats that 16 bits hold without loss.
    F16(Vec<f16>),
    /// Floats.
    F32(Vec<f32>),
}

impl Samples {
    /// How many there are.
    pub fn count(&self) -> usize {
        match self {
            Self::U8(s) => s.len(),
            Self::U16(s) => s.len(),
            Self::F16(s) => s.len(),
            Self::F32(s) => s.len(),
        }
    }

    /// Bytes that they take.
    pub fn memory_bytes(&self) -> usize {
        self.count()
            * match self {
                Self::U8(_) => 1,
                Self::U16(_) | Self::F16(_) => 2,
                Self::F32(_) => 4,
            }
    }
}

impl ImageData {
    /// Whether its numbers are floats.
    pub fn is_float(&self) -> bool {
        matches!(self.samples, Samples::F16(_) | Samples::F32(_))
    }
}
