//! Many cells at once: what waits for memory is nothing but copies, which do not wait for one another.

use pulp::x86::V4;

use super::table::{CountKeys, Portable, invert};
use super::{Block, Piecewise2d, PiecewiseCellRows};
use crate::math::Vec2;
use crate::math::prefetch::prefetch;
use crate::math::rows::{BATCH, soa, whole_vectors};
use crate::math::vectorize::vectorize;

soa! {
    /// Blocks that were chosen.
    struct ChosenRows {
        x: u32,
        y: u32,
        /// Limits of the column.
        left: u32,
        right: u32,
        /// Limits of the row.
        first: u32,
        last: u32,
        /// The point in the block.
        within: Vec2,
        /// Probability of the block.
        pmf: f64,
    }
}

/// Buffers for many cells.
pub struct PiecewiseScratch {
    chosen: ChosenRows,
    blocks: [Block; BATCH],
}

impl Default for PiecewiseScratch {
    fn default() -> Self {
        Self { chosen: ChosenRows::default(), blocks: [Block::default(); BATCH] }
    }
}

impl PiecewiseScratch {
    /// [`Piecewise2d::sample_cell`] for the first `count` pairs of numbers, at most [`BATCH`].
    #[inline]
    pub fn sample_cells(
        &mut self,
        density: &Piecewise2d,
        us: &[[f32; 2]; BATCH],
        count: usize,
        cells: &mut PiecewiseCellRows,
    ) {
        let Self { chosen, blocks } = self;
        let count = count.min(BATCH);
        match V4::try_new() {
            Some(simd) => simd.vectorize(
                #[inline(always)]
                || choose_blocks(simd, density, &us[..count], chosen),
            ),
            None => vectorize!(choose_blocks(Portable, density, &us[..count], chosen)),
        }
        vectorize!(invert_rows(us, chosen, count));
        for (i, block) in blocks.iter_mut().enumerate().take(count) {
            *block = density.blocks[density.block_at(chosen.x[i] as usize, chosen.y[i] as usize)];
        }
        for (i, block) in blocks.iter().enumerate().take(count) {
            let at = [chosen.x[i] as usize, chosen.y[i] as usize];
            cells.set(i, &block.cell(at, chosen.within.get(i), chosen.pmf[i]));
        }
    }
}

#[inline(always)]
fn choose_blocks(by: impl CountKeys, density: &Piecewise2d, us: &[[f32; 2]], chosen: &mut ChosenRows) {
    for (i, &[u, v]) in us.iter().enumerate() {
        let (y, rows) = density.rows.find(by, 0, v);
        let (x, columns) = density.columns.find(by, y, u);
        prefetch(&density.blocks, density.block_at(x, y));
        (chosen.x[i], chosen.y[i]) = (x as u32, y as u32);
        [chosen.left[i], chosen.right[i]] = columns;
        [chosen.first[i], chosen.last[i]] = rows;
    }
}

#[inline(always)]
fn invert_rows(us: &[[f32; 2]; BATCH], chosen: &mut ChosenRows, count: usize) {
    for (i, &[u, v]) in us[..whole_vectors(count)].iter().enumerate() {
        let row = invert(v, [chosen.first[i], chosen.last[i]]);
        let column = invert(u, [chosen.left[i], chosen.right[i]]);
        chosen.within.set(i, Vec2::new(column.within, row.within));
        chosen.pmf[i] = row.pmf * column.pmf;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rng;

    #[test]
    fn cells_of_a_batch_are_those_of_single_samples() {
        let mut rng = Rng::new(11);
        // A root of two nodes, one of one.
        let (width, height) = (1_300, 90);
        let weights: Vec<f32> = (0..width * height).map(|_| rng.unit_f32().powi(9)).collect();
        let density = Piecewise2d::new(width, height, &weights).unwrap();
        let mut scratch = PiecewiseScratch::default();
        for count in (0..50).map(|i| BATCH - i) {
            let us: [[f32; 2]; BATCH] = std::array::from_fn(|_| rng.pair());
            let mut cells = PiecewiseCellRows::default();
            scratch.sample_cells(&density, &us, count, &mut cells);
            for (i, &u) in us.iter().enumerate().take(count) {
                let [cell, single] = [cells.get(i), density.sample_cell(u)];
                assert_eq!((cell.x, cell.y, cell.within, cell.pmf), (single.x, single.y, single.within, single.pmf));
            }
        }
    }
}
