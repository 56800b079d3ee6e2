//! Piecewise-constant densities on the unit square, sampled by inversion so that stratified numbers stay stratified.
//!
//! Cells are grouped in blocks of 4 x 4. A block is found by inverting cumulative tables, which are small enough to
//! stay in the processor's caches, a cell by the weights of its block, which are one cache line: a sample waits for
//! memory once, however large the grid is.

use pulp::cast;
use pulp::x86::V4;

use crate::math::float::ONE_MINUS_EPSILON;
use crate::math::prefetch::prefetch;
use crate::math::vectorize::vectorize;

/// The whole of a cumulative table. Tables count in units of `1 / WHOLE`: the density is then exactly that of the
/// sampling, and a cell of positive weight never rounds to nothing.
const WHOLE: u32 = u32::MAX;

/// A point chosen by a [`Piecewise2d`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PiecewiseSample {
    /// The point in `[0, 1)²`.
    pub uv: [f32; 2],
    /// Density with respect to area of the unit square.
    pub pdf: f32,
}

/// A cell chosen by a [`Piecewise2d`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PiecewiseCell {
    /// The column.
    pub x: usize,
    /// The row.
    pub y: usize,
    /// Where in the cell, in `[0, 1)²`.
    pub within: [f32; 2],
    /// Probability of the cell.
    pub pmf: f32,
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

/// Cumulative distributions of equal length, each a search tree whose nodes have [`FANOUT`] keys: a search has no
/// branches, and all of its nodes but the last are few enough to stay in the caches.
#[derive(Clone, Debug)]
struct Table {
    len: usize,
    /// From the roots, one for each distribution, to the leaves.
    levels: Vec<TableLevel>,
}

/// Nodes of the search trees at one depth.
#[derive(Clone, Debug)]
struct TableLevel {
    /// Nodes of each tree.
    count: usize,
    /// Of leaves, the upper limits of entries, within `[0, WHOLE]`; of others, those of the last entries below each
    /// child. Unused keys are [`WHOLE`].
    nodes: Vec<Keys>,
}

/// Keys of a node: a cache line of them.
const FANOUT: usize = 16;

#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct Keys([u32; FANOUT]);

/// Counts keys.
trait CountKeys: Copy {
    /// How many keys are not above a limit.
    fn count_up_to(self, keys: &Keys, limit: u32) -> u32;
}

/// On every processor.
#[derive(Clone, Copy)]
struct Portable;

impl CountKeys for Portable {
    #[inline(always)]
    fn count_up_to(self, Keys(keys): &Keys, limit: u32) -> u32 {
        keys.iter().map(|&key| u32::from(key <= limit)).sum()
    }
}

impl CountKeys for V4 {
    // One comparison gives a bit for each key, which the compiler does not find by itself.
    #[inline(always)]
    fn count_up_to(self, Keys(keys): &Keys, limit: u32) -> u32 {
        let limits = self.avx512f._mm512_set1_epi32(limit as i32);
        self.avx512f._mm512_cmple_epu32_mask(cast(*keys), limits).count_ones()
    }
}

/// A block that was chosen.
#[derive(Clone, Copy, Default)]
struct ChosenBlock {
    x: usize,
    y: usize,
    within: [f32; 2],
    pmf: f64,
}

impl ChosenBlock {
    /// A cell of the block.
    #[inline(always)]
    fn cell_in(&self, block: &Block) -> PiecewiseCell {
        let (y, v) = invert_four(&block.rows(), self.within[1]);
        let (x, u) = invert_four(&block.0[y], self.within[0]);
        PiecewiseCell { x: SIDE * self.x + x, y: SIDE * self.y + y, within: [u, v], pmf: block.pmf(x, y, self.pmf) }
    }
}

#[derive(Clone, Copy)]
struct Inverse {
    index: usize,
    within: f32,
    pmf: f64,
}

impl Table {
    fn new(len: usize, count: usize) -> Self {
        let mut levels = Vec::new();
        let mut nodes = len;
        while nodes > 1 || levels.is_empty() {
            nodes = nodes.div_ceil(FANOUT);
            levels.push(TableLevel { count: nodes, nodes: Vec::with_capacity(nodes * count) });
        }
        levels.reverse();
        Self { len, levels }
    }

    /// Adds one distribution. Each positive weight has at least one unit; those and the rest, in proportion, fill the
    /// whole. Without any positive weight all is in the last entry.
    fn push(&mut self, weights: impl Iterator<Item = f64> + Clone) {
        let positive = weights.clone().filter(|w| *w > 0.0).count();
        let total: f64 = weights.clone().sum();
        let free = f64::from(WHOLE) - positive as f64;
        let (mut units, mut sum) = (0u64, 0.0);
        let limit = |w: f64| {
            if w > 0.0 {
                units += 1;
                sum += w;
            }
            let limit = if total > 0.0 { units + (sum / total * free).round() as u64 } else { 0 };
            limit.min(u64::from(WHOLE)) as u32
        };
        let mut keys: Vec<u32> = weights.map(limit).collect();
        if total <= 0.0 {
            keys[self.len - 1] = WHOLE;
        }
        for level in self.levels.iter_mut().rev() {
            let nodes =
                keys.chunks(FANOUT).map(|keys| Keys(std::array::from_fn(|i| keys.get(i).copied().unwrap_or(WHOLE))));
            level.nodes.extend(nodes);
            keys = keys.chunks(FANOUT).filter_map(|keys| keys.last().copied()).collect();
        }
    }

    /// The limits of an entry.
    #[inline(always)]
    fn limits(&self, which: usize, index: usize) -> [u32; 2] {
        let Some(leaves) = self.levels.last() else { return [0; 2] };
        let keys = &leaves.nodes[which * leaves.count..][..leaves.count];
        let upper = |index: usize| keys[index / FANOUT].0[index % FANOUT];
        [if index == 0 { 0 } else { upper(index - 1) }, upper(index)]
    }

    #[inline]
    fn pmf(&self, which: usize, index: usize) -> f64 {
        let [lower, upper] = self.limits(which, index);
        f64::from(upper - lower) * (1.0 / f64::from(WHOLE))
    }

    /// Inverts a distribution at `u` in `[0, 1)`: the entry with `lower <= u < upper`.
    #[inline(always)]
    fn invert(&self, by: impl CountKeys, which: usize, u: f32) -> Inverse {
        let x = f64::from(u) * f64::from(WHOLE);
        let unit = x as u32;
        let mut index = 0;
        for level in &self.levels {
            let before = by.count_up_to(&level.nodes[which * level.count + index], unit);
            index = index * FANOUT + before as usize;
        }
        let [lower, upper] = self.limits(which, index);
        let mass = f64::from(upper - lower);
        let within = ((x - f64::from(lower)) / mass) as f32;
        Inverse { index, within: within.min(ONE_MINUS_EPSILON), pmf: mass * (1.0 / f64::from(WHOLE)) }
    }
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
        let chosen = self.choose_block(Portable, u);
        chosen.cell_in(&self.blocks[self.block_at(&chosen)])
    }

    /// Cells for as many numbers as there are places for the results, as [`sample_cell`](Self::sample_cell): all wait
    /// for memory at once.
    #[inline]
    pub fn sample_cells<const N: usize>(&self, us: &[[f32; 2]], cells: &mut [PiecewiseCell; N]) {
        let mut chosen = [ChosenBlock::default(); N];
        match V4::try_new() {
            Some(simd) => simd.vectorize(
                #[inline(always)]
                || self.choose_blocks(simd, us, &mut chosen),
            ),
            None => vectorize!(self.choose_blocks(Portable, us, &mut chosen)),
        }
        // Nothing but copies, which do not wait for one another.
        let mut blocks = [Block::default(); N];
        for (block, chosen) in blocks.iter_mut().zip(&chosen).take(us.len()) {
            *block = self.blocks[self.block_at(chosen)];
        }
        for ((cell, chosen), block) in cells.iter_mut().zip(&chosen).zip(&blocks).take(us.len()) {
            *cell = chosen.cell_in(block);
        }
    }

    #[inline(always)]
    fn choose_blocks(&self, by: impl CountKeys, us: &[[f32; 2]], chosen: &mut [ChosenBlock]) {
        for (chosen, &u) in chosen.iter_mut().zip(us) {
            *chosen = self.choose_block(by, u);
            prefetch(&self.blocks, self.block_at(chosen));
        }
    }

    #[inline(always)]
    fn choose_block(&self, by: impl CountKeys, u: [f32; 2]) -> ChosenBlock {
        let row = self.rows.invert(by, 0, u[1]);
        let column = self.columns.invert(by, row.index, u[0]);
        ChosenBlock { x: column.index, y: row.index, within: [column.within, row.within], pmf: row.pmf * column.pmf }
    }

    #[inline]
    fn block_at(&self, chosen: &ChosenBlock) -> usize {
        chosen.y * self.columns.len + chosen.x
    }

    /// The probability of a cell.
    #[inline]
    pub fn pmf(&self, x: usize, y: usize) -> f32 {
        self.blocks[y / SIDE * self.columns.len + x / SIDE].pmf(x % SIDE, y % SIDE, self.block_pmf(x, y))
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
        let place = |i: usize, within: f32, n: usize| {
            let limit = |i: usize| (i as f64 / n as f64) as f32;
            let x = ((i as f64 + f64::from(within)) / n as f64) as f32;
            // Rounding must not carry the point into a neighbour of another density.
            x.clamp(limit(i), limit(i + 1).next_down())
        };
        let uv = [place(cell.x, cell.within[0], self.width), place(cell.y, cell.within[1], self.height)];
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
    use crate::math::Rng;

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
                assert_eq!((cell.y * 9 + cell.x, cell.pmf), (hot, 1.0));
                let s = density.sample(u);
                assert_eq!((s.pdf, density.pdf(s.uv)), (45.0, 45.0));
            }
        }
    }

    #[test]
    fn cells_of_a_batch_are_those_of_single_samples() {
        let mut random = Rng::new(11);
        let (width, height) = (1_300, 90);
        let weights: Vec<f32> = (0..width * height).map(|_| random.unit_f32().powi(9)).collect();
        let density = Piecewise2d::new(width, height, &weights).unwrap();
        for _ in 0..50 {
            let us: [[f32; 2]; 128] = std::array::from_fn(|_| [random.unit_f32(), random.unit_f32()]);
            let mut cells = [PiecewiseCell::default(); 128];
            density.sample_cells(&us, &mut cells);
            assert_eq!(cells, us.map(|u| density.sample_cell(u)));
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
