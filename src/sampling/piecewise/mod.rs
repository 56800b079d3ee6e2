//! Piecewise-constant densities on the unit square, sampled by inversion so that stratified numbers stay stratified.
//!
//! Cells are grouped in blocks of 4 x 4. A block is found by inverting cumulative tables, which are small enough to
//! stay in the processor's caches, a cell by the weights of its block, which are one cache line: a sample waits for
//! memory once, however large the grid is.

mod batch;
mod table;

use crate::math::Vec2;
use crate::math::float::ONE_MINUS_EPSILON;
use crate::math::rows::soa;

pub use batch::PiecewiseScratch;
use table::{Portable, Table, invert};

/// A point chosen by a [`Piecewise2d`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PiecewiseSample {
    /// The point in `[0, 1)²`.
    pub uv: [f32; 2],
    /// Density with respect to area of the unit square.
    pub pdf: f32,
}

soa! {
    /// A cell chosen by a [`Piecewise2d`].
    pub struct PiecewiseCellRows of PiecewiseCell {
        /// The column.
        x: u32,
        /// The row.
        y: u32,
        /// Where in the cell, in `[0, 1)²`.
        within: Vec2,
        /// Probability of the cell.
        pmf: f32,
    }
}

/// A density on `[0, 1)²` that is constant on each cell of a grid; rows run along u, row 0 is at v = 0.
#[derive(Clone, Debug)]
pub struct Piecewise2d {
    width: usize,
    height: usize,
    /// Of rows of blocks, and of the blocks of each row.
    rows: Table,
    columns: Table,
    /// By rows.
    blocks: Vec<Block>,
}

/// Cells of a block along each axis.
const SIDE: usize = 4;

/// Weights of a block's cells, by rows, with the largest within `[1, 2)`; 0 beyond the grid.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(64))]
struct Block([[f32; SIDE]; SIDE]);

impl Block {
    fn new(weights: &[[f32; SIDE]; SIDE]) -> Self {
        let largest = weights.iter().flatten().fold(0f32, |largest, &w| largest.max(w));
        // A power of two keeps their ratios.
        let scale = if largest > 0.0 { 2f64.powi(-f64::from(largest).log2().floor() as i32) } else { 0.0 };
        Self(weights.map(|row| row.map(|w| (f64::from(w) * scale) as f32)))
    }

    // A loop: `map` may be compiled to calls.
    #[inline(always)]
    fn rows(&self) -> [f32; SIDE] {
        let mut sums = [0.0; SIDE];
        for (sum, [a, b, c, d]) in sums.iter_mut().zip(&self.0) {
            *sum = (a + b) + (c + d);
        }
        sums
    }

    /// The probability of a cell of a block that has the probability `pmf`; positive where the weight is.
    #[inline(always)]
    fn pmf(&self, x: usize, y: usize, pmf: f64) -> f32 {
        let weight = self.0[y][x];
        if weight == 0.0 {
            return 0.0;
        }
        let [first, second, third, fourth] = &self.0;
        let mut columns = [0.0; SIDE];
        for (i, column) in columns.iter_mut().enumerate() {
            *column = (first[i] + second[i]) + (third[i] + fourth[i]);
        }
        let sum = (columns[0] + columns[1]) + (columns[2] + columns[3]);
        ((pmf * f64::from(weight / sum)) as f32).max(f32::MIN_POSITIVE)
    }

    /// The cell at a point of a block that has the probability `pmf`, `at` these columns and rows of blocks.
    #[inline(always)]
    fn cell(&self, at: [usize; 2], point: Vec2, pmf: f64) -> PiecewiseCell {
        let (y, v) = invert_four(&self.rows(), point.y);
        let (x, u) = invert_four(&self.0[y], point.x);
        PiecewiseCell {
            x: (SIDE * at[0] + x) as u32,
            y: (SIDE * at[1] + y) as u32,
            within: Vec2::new(u, v),
            pmf: self.pmf(x, y, pmf),
        }
    }
}

/// The entry of a distribution of four weights at `u` in `[0, 1)`, never one of weight 0, and where in it `u` is.
#[inline(always)]
fn invert_four(weights: &[f32; SIDE], u: f32) -> (usize, f32) {
    let [a, b, c, d] = *weights;
    let limits = [0.0, a, a + b, a + b + c];
    let x = u * (limits[3] + d);
    let index = usize::from(x >= limits[1]) + usize::from(x >= limits[2]) + usize::from(x >= limits[3]);
    (index, ((x - limits[index]) / weights[index]).min(ONE_MINUS_EPSILON))
}

impl Piecewise2d {
    /// The density in proportion to `width * height` weights, by rows; `None` if the count is wrong, one is negative or
    /// not finite, or all are zero.
    pub fn new(width: usize, height: usize, weights: &[f32]) -> Option<Self> {
        let fits = width.checked_mul(height) == Some(weights.len()) && width.max(height) < u32::MAX as usize / 2;
        if !fits || !weights.iter().all(|w| w.is_finite() && *w >= 0.0) || !weights.iter().any(|w| *w > 0.0) {
            return None;
        }
        let (across, down) = (width.div_ceil(SIDE), height.div_ceil(SIDE));
        let (mut columns, mut rows) = (Table::new(across, down), Table::new(down, 1));
        let (mut blocks, mut sums) = (Vec::with_capacity(across * down), Vec::with_capacity(down));
        let mut row_sums = vec![0.0; across];
        for y in 0..down {
            for (x, sum) in row_sums.iter_mut().enumerate() {
                let weight = |row: usize, column: usize| {
                    let (x, y) = (SIDE * x + column, SIDE * y + row);
                    if x < width && y < height { weights[y * width + x] } else { 0.0 }
                };
                let block: [[f32; SIDE]; SIDE] =
                    std::array::from_fn(|row| std::array::from_fn(|column| weight(row, column)));
                *sum = block.iter().flatten().map(|&w| f64::from(w)).sum();
                blocks.push(Block::new(&block));
            }
            sums.push(row_sums.iter().sum::<f64>());
            columns.push(row_sums.iter().copied());
        }
        rows.push(sums.into_iter());
        Some(Self { width, height, rows, columns, blocks })
    }

    /// A cell with its probability and a uniform point inside; `u` in `[0, 1)²`. The first number chooses the column,
    /// the second the row.
    #[inline]
    pub fn sample_cell(&self, u: [f32; 2]) -> PiecewiseCell {
        let (y, rows) = self.rows.find(Portable, 0, u[1]);
        let (x, columns) = self.columns.find(Portable, y, u[0]);
        let (row, column) = (invert(u[1], rows), invert(u[0], columns));
        let within = Vec2::new(column.within, row.within);
        self.blocks[self.block_at(x, y)].cell([x, y], within, row.pmf * column.pmf)
    }

    #[inline(always)]
    fn block_at(&self, x: usize, y: usize) -> usize {
        y * self.columns.len() + x
    }

    /// The probability of a cell.
    #[inline]
    pub fn pmf(&self, x: usize, y: usize) -> f32 {
        self.blocks[self.block_at(x / SIDE, y / SIDE)].pmf(x % SIDE, y % SIDE, self.block_pmf(x, y))
    }

    /// The probability of the block of a cell.
    #[inline]
    fn block_pmf(&self, x: usize, y: usize) -> f64 {
        let (across, down) = (x / SIDE, y / SIDE);
        self.rows.pmf(0, down) * self.columns.pmf(down, across)
    }

    /// A point with its density; `u` in `[0, 1)²`.
    #[inline]
    pub fn sample(&self, u: [f32; 2]) -> PiecewiseSample {
        let cell = self.sample_cell(u);
        let place = |i: u32, within: f32, n: usize| {
            let i = i as usize;
            let limit = |i: usize| (i as f64 / n as f64) as f32;
            let x = ((i as f64 + f64::from(within)) / n as f64) as f32;
            // Rounding must not carry the point into a neighbour of another density.
            x.clamp(limit(i), limit(i + 1).next_down())
        };
        let uv = [place(cell.x, cell.within.x, self.width), place(cell.y, cell.within.y, self.height)];
        PiecewiseSample { uv, pdf: self.density(cell.pmf) }
    }

    /// The density at `uv`, which is taken into `[0, 1]²`.
    #[inline]
    pub fn pdf(&self, uv: [f32; 2]) -> f32 {
        let cell = |x: f32, n: usize| {
            let i = ((x.max(0.0) * n as f32) as usize).min(n - 1);
            // The limits are those of `sample`, rounded the same way.
            let limit = |i: usize| (i as f64 / n as f64) as f32;
            if x < limit(i) {
                i.saturating_sub(1)
            } else if i + 1 < n && x >= limit(i + 1) {
                i + 1
            } else {
                i
            }
        };
        self.density(self.pmf(cell(uv[0], self.width), cell(uv[1], self.height)))
    }

    #[inline]
    fn density(&self, pmf: f32) -> f32 {
        pmf * (self.width * self.height) as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frequencies_equal_weights_and_densities_agree() {
        let (width, height) = (37, 11);
        let weights: Vec<f32> =
            (0..width * height).map(|i| ((i * i) % 23) as f32 * if i / width == 4 { 0.0 } else { 1.0 }).collect();
        let total: f32 = weights.iter().sum();
        let density = Piecewise2d::new(width, height, &weights).unwrap();
        let n = 2048;
        let mut count = vec![0u32; width * height];
        for i in 0..n * n {
            let u = [(i % n) as f32 / n as f32, (i / n) as f32 / n as f32];
            let s = density.sample(u);
            let at = [(s.uv[0] * width as f32) as usize, (s.uv[1] * height as f32) as usize];
            count[(at[1] * width + at[0]).min(width * height - 1)] += 1;
            assert!(s.pdf > 0.0 && s.uv[0] < 1.0 && s.uv[1] < 1.0);
            assert_eq!(density.pdf(s.uv), s.pdf, "{u:?} {:?}", s.uv);
        }
        for (i, &c) in count.iter().enumerate() {
            let (share, exact) = (f64::from(c) / f64::from(n as u32 * n as u32), f64::from(weights[i] / total));
            // The grid resolves each of the two inversions to one step.
            assert!((share - exact).abs() < 2.0 / f64::from(n as u32), "{i}: {share} {exact}");
            let pmf = density.pmf(i % width, i / width);
            assert!((f64::from(pmf) - exact).abs() <= 1e-6 * exact.max(1e-3), "{i}: {pmf} {exact}");
        }
    }

    #[test]
    fn the_density_integrates_to_one() {
        let weights: Vec<f32> = (0..64 * 32).map(|i| if i % 7 == 0 { 1e6 } else { 1e-6 * (i % 5) as f32 }).collect();
        let density = Piecewise2d::new(64, 32, &weights).unwrap();
        let sum: f64 = (0..64 * 32).map(|i| f64::from(density.pmf(i % 64, i / 64))).sum();
        assert!((sum - 1.0).abs() < 1e-6);
        // Weights too small for the table keep a positive density.
        for (i, w) in weights.iter().enumerate() {
            assert_eq!(density.pmf(i % 64, i / 64) > 0.0, *w > 0.0);
        }
    }

    #[test]
    fn corners_of_the_square_choose_cells_of_positive_weight() {
        let mut weights = vec![0.0; 9 * 5];
        for hot in [0, 8, 22, 36, 44] {
            weights.fill(0.0);
            weights[hot] = 3.0;
            let density = Piecewise2d::new(9, 5, &weights).unwrap();
            for u in [[0.0, 0.0], [ONE_MINUS_EPSILON; 2], [0.0, ONE_MINUS_EPSILON], [0.3, 0.6]] {
                let cell = density.sample_cell(u);
                assert_eq!((cell.y * 9 + cell.x, cell.pmf), (hot as u32, 1.0));
                let s = density.sample(u);
                assert_eq!((s.pdf, density.pdf(s.uv)), (45.0, 45.0));
            }
        }
    }

    #[test]
    fn inversion_keeps_order() {
        let weights: Vec<f32> = (0..1000).map(|i| ((i * 7919) % 101) as f32).collect();
        let density = Piecewise2d::new(1000, 1, &weights).unwrap();
        let mut last = -1.0;
        for i in 0..100_000 {
            let x = density.sample([i as f32 / 1e5, 0.5]).uv[0];
            assert!(x >= last);
            last = x;
        }
    }

    #[test]
    fn weights_that_are_no_density_are_refused() {
        assert!(Piecewise2d::new(2, 2, &[1.0; 3]).is_none());
        assert!(Piecewise2d::new(2, 2, &[0.0; 4]).is_none());
        assert!(Piecewise2d::new(2, 1, &[1.0, -1.0]).is_none());
        assert!(Piecewise2d::new(2, 1, &[1.0, f32::NAN]).is_none());
        assert!(Piecewise2d::new(0, 0, &[]).is_none());
    }
}
