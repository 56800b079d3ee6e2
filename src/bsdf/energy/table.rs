//! The baked numbers and how they are read.

/// Nodes along a roughness, a shape of the lobe, an index of refraction and a cosine.
pub const ALPHAS: usize = 16;
pub const ASPECTS: usize = 6;
pub const IORS: usize = 16;
pub const COSINES: usize = 16;
/// Glossiness of the clear coat of "Physically Based Shading at Disney".
pub const GLOSSES: usize = 4;

/// A block of the file: so many values between `low` and `high`.
#[derive(Clone, Copy, Debug)]
pub struct Block {
    start: usize,
    pub len: usize,
    low: f32,
    scale: f32,
}

impl Block {
    const fn after(before: Option<&Self>, len: usize, low: f32, high: f32) -> Self {
        let start = match before {
            Some(block) => block.start + block.len,
            None => 0,
        };
        Self { start, len, low, scale: (high - low) / 65_535.0 }
    }

    /// The value that is nearest to `value` in the file.
    pub fn encode(&self, value: f32) -> u16 {
        let steps = (value - self.low) / self.scale;
        assert!((-0.5..=65_535.5).contains(&steps), "{value} is outside of {self:?}");
        steps.round() as u16
    }

    #[inline]
    fn at(&self, data: &[u8], index: usize) -> f32 {
        let at = 2 * (self.start + index);
        self.low + self.scale * f32::from(u16::from_le_bytes([data[at], data[at + 1]]))
    }
}
