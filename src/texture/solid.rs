//! Where an image of opacity is certainly 1 or certainly 0, so that most lookups need no texels.

use super::Texture;
use super::mapping::{UvTransform, Wrap};
use crate::math::{Vec2, vec2};

/// Blended numbers this close to a threshold may round to the other side of it.
const THRESHOLD_ROUNDING: f32 = 1e-5;

/// Whether a surface is there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Solidity {
    /// Part of it, or it depends on the place.
    Mixed = 0,
    /// All of it.
    Solid = 1,
    /// Nothing of it.
    Hole = 2,
}

/// The [`Solidity`] of each [cell](super::Bitmap) of an image.
#[derive(Debug)]
pub struct SolidTable {
    transform: UvTransform,
    /// Width and height of the image.
    size: [f32; 2],
    axes: [Axis; 2],
    /// Two bits a cell.
    words: Vec<u64>,
}

/// Cells along an axis.
#[derive(Clone, Copy, Debug)]
struct Axis {
    wrap: Wrap,
    count: i32,
    /// Period of the image in texels.
    period: i32,
}

impl Axis {
    /// The cell that a place is in.
    #[inline(always)]
    fn cell(&self, place: f32) -> usize {
        let whole = place as i32;
        let index = whole.saturating_sub(i32::from(place < whole as f32));
        let cell = match self.wrap {
            Wrap::Clamp => index.clamp(0, self.count - 1),
            // Most are in the first period; a division takes longer than the rest.
            Wrap::Repeat if (0..self.period).contains(&index) => index,
            Wrap::Repeat => index.rem_euclid(self.period),
            Wrap::Mirror => {
                let index = index.rem_euclid(2 * self.period);
                // The mirror image of a cell; of one between texels, that on the edge is its own.
                if index < self.count { index } else { self.count + self.period - 1 - index }
            }
        };
        cell as usize
    }
}

/// Cells of a word.
const PER_WORD: usize = 32;

impl SolidTable {
    /// The table of a texture; `None` if it is no image, nor a threshold of one.
    pub fn new(texture: &Texture) -> Option<Self> {
        if let Texture::Product(factors) = texture
            && let [only] = &**factors
        {
            return Self::new(only);
        }
        let (bitmap, [solid, hole]) = match texture {
            Texture::Bitmap(bitmap) => (bitmap, [1.0, 0.0]),
            Texture::Step(of, threshold) => match &**of {
                Texture::Bitmap(bitmap) => (bitmap, [threshold + THRESHOLD_ROUNDING, threshold - THRESHOLD_ROUNDING]),
                _ => return None,
            },
            _ => return None,
        };
        let [columns, rows] = bitmap.cells();
        let mut words = vec![0; (columns * rows).div_ceil(PER_WORD)];
        for cell in 0..columns * rows {
            let [low, high] = bitmap.range_in([cell % columns, cell / columns]);
            let solidity = if low >= solid {
                Solidity::Solid
            } else if high <= hole {
                Solidity::Hole
            } else {
                Solidity::Mixed
            };
            words[cell / PER_WORD] |= (solidity as u64) << (cell % PER_WORD * 2);
        }
        let (size, period) = (
            [bitmap.image.width(), bitmap.image.height()],
            [bitmap.image.width() as i32, bitmap.image.height() as i32],
        );
        let axes = [0, 1].map(|i| Axis { wrap: bitmap.wrap[i], count: [columns, rows][i] as i32, period: period[i] });
        Some(Self { transform: bitmap.transform, size: size.map(|n| n as f32), axes, words })
    }

    /// The place of `uv` in cells: an affine map.
    pub fn place(&self, uv: Vec2) -> Vec2 {
        let at = self.transform.apply(uv);
        let before = |axis: usize| 0.5 * (self.axes[axis].count - self.axes[axis].period) as f32;
        vec2(at.x * self.size[0] + before(0), (1.0 - at.y) * self.size[1] + before(1))
    }

    /// What a lookup at a [`place`](Self::place) finds.
    #[inline]
    pub fn at(&self, place: Vec2) -> Solidity {
        let cell = self.axes[1].cell(place.y) * self.axes[0].count as usize + self.axes[0].cell(place.x);
        match self.words[cell / PER_WORD] >> (cell % PER_WORD * 2) & 3 {
            1 => Solidity::Solid,
            2 => Solidity::Hole,
            _ => Solidity::Mixed,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::image_data::{ImageData, Samples};
    use crate::math::Rng;
    use crate::texture::{Bitmap, Decoding, TextureFilter, TextureImage};

    /// An image of 7 by 5 texels, most of which are 0 or 255.
    fn image(rng: &mut Rng) -> Arc<TextureImage> {
        let texel = |rng: &mut Rng| [0, 255, 255, 0, 100][(rng.unit_f32() * 5.0) as usize];
        let samples = (0..35).map(|_| texel(rng)).collect();
        Arc::new(
            TextureImage::new(ImageData { width: 7, height: 5, channels: 1, samples: Samples::U8(samples) }).unwrap(),
        )
    }

    #[test]
    fn tables_say_what_lookups_find() {
        let mut rng = Rng::new(3);
        let mut found = [0; 3];
        for filter in [TextureFilter::Nearest, TextureFilter::Bilinear] {
            for wrap in [[Wrap::Repeat, Wrap::Clamp], [Wrap::Clamp, Wrap::Mirror], [Wrap::Mirror, Wrap::Repeat]] {
                let bitmap = Bitmap {
                    filter,
                    wrap,
                    transform: UvTransform::new(vec2(1.3, -0.7), 0.4, vec2(0.1, 0.2)),
                    ..Bitmap::new(image(&mut rng), Decoding::Linear)
                };
                let alone = Texture::Bitmap(bitmap);
                let textures =
                    [Texture::Step(Box::new(alone.clone()), 0.4), Texture::Product(Box::new([alone.clone()])), alone];
                for texture in textures {
                    let table = SolidTable::new(&texture).unwrap();
                    for _ in 0..4_000 {
                        let uv = vec2(rng.unit_f32() * 8.0 - 4.0, rng.unit_f32() * 8.0 - 4.0);
                        let (value, solidity) = (texture.scalar(uv), table.at(table.place(uv)));
                        found[solidity as usize] += 1;
                        let expected = match solidity {
                            Solidity::Mixed => continue,
                            Solidity::Solid => 1.0,
                            Solidity::Hole => 0.0,
                        };
                        // Blended numbers round, and at the border of cells so does the place.
                        assert!((value - expected).abs() < 1e-4, "{texture:?} {uv} {solidity:?} {value}");
                    }
                }
            }
        }
        assert!(found.iter().all(|&n| n > 5_000), "{found:?}");
    }

    #[test]
    fn other_textures_have_none() {
        let mut rng = Rng::new(3);
        let bitmap = Texture::Bitmap(Bitmap::new(image(&mut rng), Decoding::Linear));
        assert!(SolidTable::new(&Texture::Constant(crate::color::Rgb::WHITE)).is_none());
        assert!(SolidTable::new(&Texture::Product(Box::new([bitmap.clone(), bitmap]))).is_none());
    }
}
