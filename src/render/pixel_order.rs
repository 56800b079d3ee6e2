//! The order of a tile's pixels within a batch: blocks of 4 x 4 pixels, whose rays are coherent.

use super::{BLOCK_SIZE, TILE_SIZE};
use crate::film::Crop;

/// The pixel within its tile of a batch's slot: runs of 16 slots are blocks of 4 x 4 pixels.
#[inline]
pub(super) fn pixel_of_slot(slot: u32) -> [u32; 2] {
    let (block, within) = (slot / (BLOCK_SIZE * BLOCK_SIZE), slot % (BLOCK_SIZE * BLOCK_SIZE));
    let blocks = TILE_SIZE / BLOCK_SIZE;
    [block % blocks * BLOCK_SIZE + within % BLOCK_SIZE, block / blocks * BLOCK_SIZE + within / BLOCK_SIZE]
}

/// The slots of a batch for the tile with this corner: of blocks that reach into the film's area.
pub(super) fn slots(area: Crop, origin: [u32; 2]) -> impl Iterator<Item = u32> {
    let reaches = move |k: usize, start: u32, length: u32, at: u32| {
        let block = origin[k] + at;
        block + BLOCK_SIZE > start && block < start + length
    };
    let slots_of_block = BLOCK_SIZE * BLOCK_SIZE;
    (0..TILE_SIZE * TILE_SIZE / slots_of_block)
        .filter(move |block| {
            let [dx, dy] = pixel_of_slot(block * slots_of_block);
            reaches(0, area.x, area.width, dx) && reaches(1, area.y, area.height, dy)
        })
        .flat_map(move |block| block * slots_of_block..(block + 1) * slots_of_block)
}

/// The slot of a pixel within its tile; inverts [`pixel_of_slot`].
pub(super) fn slot_of_pixel([x, y]: [u32; 2]) -> u32 {
    let blocks = TILE_SIZE / BLOCK_SIZE;
    let block = y / BLOCK_SIZE * blocks + x / BLOCK_SIZE;
    block * BLOCK_SIZE * BLOCK_SIZE + y % BLOCK_SIZE * BLOCK_SIZE + x % BLOCK_SIZE
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slots_and_pixels_are_one_to_one() {
        for slot in 0..TILE_SIZE * TILE_SIZE {
            assert_eq!(slot_of_pixel(pixel_of_slot(slot)), slot);
        }
        let first_block: Vec<_> = (0..16).map(pixel_of_slot).collect();
        assert!(first_block.iter().all(|p| p[0] < 4 && p[1] < 4));
    }

    #[test]
    fn batches_have_every_pixel_of_the_picture_and_hardly_more() {
        let count = |size, origin| slots(Crop::full(size), origin).count();
        assert_eq!(
            [count([64, 64], [32, 32]), count([50, 37], [0, 0]), count([50, 37], [32, 32])],
            [1024, 1024, 5 * 2 * 16]
        );
        assert_eq!(slots(Crop { x: 31, y: 30, width: 40, height: 40 }, [0, 0]).count(), 16);
        for size in [[1, 1], [50, 37], [33, 64]] {
            for pixel in (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| [x, y])) {
                let origin = pixel.map(|x| x / TILE_SIZE * TILE_SIZE);
                let slot = slot_of_pixel([pixel[0] - origin[0], pixel[1] - origin[1]]);
                assert!(slots(Crop::full(size), origin).any(|other| other == slot), "{size:?} {pixel:?}");
            }
        }
    }
}
