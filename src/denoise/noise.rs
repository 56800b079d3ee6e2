//! Whether a feature is noisy: what a filter changes in the blocks of it that look noisiest.

use super::clean::neighbours;
use super::oidn::Triple;

/// Pixels along the sides of a block.
const SIDE: usize = 64;

/// Near the rim of a block the filter lacks context: changes there do not count.
const RIM: usize = 8;

/// Columns and rows of blocks in a mosaic.
const BLOCKS: [usize; 2] = [4, 2];

/// Pictures of fewer pixels than this many mosaics are filtered whole: a mosaic would cost nearly as much.
const LEAST_MOSAICS: usize = 4;

/// The largest mean change, in units of albedo and of normals, of a feature without noise, whose edges change too.
const LARGEST_CHANGE: f64 = 0.0025;

/// Blocks of a feature, side by side.
pub(super) struct Mosaic {
    /// Width and height.
    pub size: [usize; 2],
    /// Row by row.
    pub pixels: Vec<Triple>,
}

impl Mosaic {
    /// The blocks of a feature of `size` pixels in which pixels differ most from the median of those around them;
    /// `None` if the picture has hardly more pixels than a mosaic.
    pub fn of_noisiest(pixels: &[Triple], size: [usize; 2]) -> Option<Self> {
        let blocks = size.map(|side| side / SIDE);
        let count = BLOCKS[0] * BLOCKS[1];
        if blocks[0] * blocks[1] < LEAST_MOSAICS * count {
            return None;
        }
        let mut roughness = vec![0.0; blocks[0] * blocks[1]];
        for y in 0..blocks[1] * SIDE {
            for x in 0..blocks[0] * SIDE {
                roughness[y / SIDE * blocks[0] + x / SIDE] += distance_from_median(pixels, size[0], y * size[0] + x);
            }
        }
        let mut order: Vec<usize> = (0..roughness.len()).collect();
        order.sort_by(|&a, &b| roughness[b].total_cmp(&roughness[a]));
        let mut mosaic = Vec::with_capacity(count * SIDE * SIDE);
        for row in 0..BLOCKS[1] * SIDE {
            for block in &order[row / SIDE * BLOCKS[0]..][..BLOCKS[0]] {
                let (x, y) = (block % blocks[0] * SIDE, block / blocks[0] * SIDE + row % SIDE);
                mosaic.extend_from_slice(&pixels[y * size[0] + x..][..SIDE]);
            }
        }
        Some(Self { size: BLOCKS.map(|count| count * SIDE), pixels: mosaic })
    }

    /// Whether the mosaic, filtered, differs from itself by more than edges do.
    pub fn is_noisy(&self, filtered: &[Triple]) -> bool {
        let change = self.mean_change(filtered);
        tracing::debug!("denoising: a filter changes the noisiest blocks of a feature by {change:.5}");
        change > LARGEST_CHANGE
    }

    /// The mean over pixels of the largest difference of a channel.
    fn mean_change(&self, filtered: &[Triple]) -> f64 {
        let is_inner = |at: usize| (RIM..SIDE - RIM).contains(&(at % SIDE));
        let inner = (0..self.pixels.len()).filter(|i| is_inner(i % self.size[0]) && is_inner(i / self.size[0]));
        let (sum, count) = inner.fold((0.0, 0.0), |(sum, count), i| {
            (sum + f64::from(largest_difference(self.pixels[i], filtered[i])), count + 1.0)
        });
        sum / count
    }
}

fn largest_difference(a: Triple, b: Triple) -> f32 {
    (0..3).map(|k| (a[k] - b[k]).abs()).fold(0.0, f32::max)
}

/// How far a pixel is from the median of the pixels around it, channel by channel.
fn distance_from_median(pixels: &[Triple], width: usize, i: usize) -> f32 {
    let mut around = [[0.0; 9]; 3];
    let mut count = 0;
    for j in neighbours(i, width, pixels.len()) {
        (0..3).for_each(|k| around[k][count] = pixels[j][k]);
        count += 1;
    }
    let median = around.map(|mut values| {
        let (_, median, _) = values[..count].select_nth_unstable_by(count / 2, f32::total_cmp);
        *median
    });
    largest_difference(pixels[i], median)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rng;

    const SIZE: [usize; 2] = [512, 320];

    /// Stripes of one pixel in one block, noise in another, one value elsewhere.
    fn feature() -> Vec<Triple> {
        let mut rng = Rng::new(1);
        let pixel = |i: usize| match [i % SIZE[0] / SIDE, i / SIZE[0] / SIDE] {
            [5, 3] => [rng.unit_f32(); 3],
            [2, 1] => [(i % 2) as f32 * 0.1; 3],
            _ => [0.25; 3],
        };
        (0..SIZE[0] * SIZE[1]).map(pixel).collect()
    }

    #[test]
    fn a_mosaic_begins_with_the_noisiest_blocks() {
        let pixels = feature();
        let mosaic = Mosaic::of_noisiest(&pixels, SIZE).unwrap();
        assert_eq!((mosaic.size, mosaic.pixels.len()), ([256, 128], 256 * 128));
        for row in [0, 17, 63] {
            let of_block = |x: usize, y: usize| &pixels[(y * SIDE + row) * SIZE[0] + x * SIDE..][..SIDE];
            assert_eq!(&mosaic.pixels[row * 256..][..SIDE], of_block(5, 3));
            assert_eq!(&mosaic.pixels[row * 256 + SIDE..][..SIDE], of_block(2, 1));
        }
        assert!(Mosaic::of_noisiest(&pixels, [320, 512]).is_some());
        assert!(Mosaic::of_noisiest(&pixels[..256 * 256], [256, 256]).is_none());
    }

    #[test]
    fn what_the_filter_changes_in_the_middle_of_blocks_is_noise() {
        let pixels = feature();
        let mosaic = Mosaic::of_noisiest(&pixels, SIZE).unwrap();
        assert!(!mosaic.is_noisy(&mosaic.pixels));
        let mut smoothed = mosaic.pixels.clone();
        smoothed.iter_mut().enumerate().filter(|(i, _)| i % 256 < RIM).for_each(|(_, pixel)| *pixel = [0.9; 3]);
        assert!(!mosaic.is_noisy(&smoothed));
        // One block of eight of noise, whose mean absolute deviation is a quarter.
        (0..64 * 256).filter(|i| i % 256 < SIDE).for_each(|i| smoothed[i] = [0.5; 3]);
        assert!(mosaic.is_noisy(&smoothed));
    }
}
