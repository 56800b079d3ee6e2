//! Adaptive sampling: samples go where the picture's relative squared error needs them, until that is below a target.
//!
//! Blocks of 4 x 4 pixels get samples in groups of eight, a stretch of each pixel's own sequence. The means of a
//! pixel's groups estimate their variance, which is that of well-spread samples (single ones would estimate that of
//! independent samples, which is larger). With `v` a block's variance of a group over `color² + 0.01` and `n` its
//! groups, the picture's error is the mean of `v / n`, and for a given cost it is least with `n` in proportion to
//! `sqrt(v)` (Neyman).
//!
//! A block that met a bright path by luck must not get more samples for it, for that would take weight from the path:
//! the picture would be too dark where such paths are rare. So what a block gets depends on the blocks around it alone.
//! In the first stage its samples are thus independent of their number; later ones depend on it only through how
//! precisely the variance of its neighbours is estimated.

use crate::film::{Crop, Film, FilmTile};
use crate::integrator::Guidance;
use crate::render::tile_renderer::{TileRenderer, TileWorkspace};
use crate::render::{BLOCK_SIZE, Progress, TILE_SIZE};

/// Samples of a group.
const GROUP: u32 = 8;

/// Groups of every block before the first estimate.
const PILOT: u32 = 2;

/// By this factor a block's groups may grow in one stage: estimates get better on the way.
const GROWTH: u32 = 8;

/// Blocks up to this distance enter the estimate of what a block needs. Nearer ones alone would be too noisy.
const REACH: u32 = 2;

/// How much of what a block seems to need is what blocks need on average: rare bright paths are still to be met where
/// there was none yet.
const EVEN_SHARE: f64 = 0.15;

/// By this factor one stage may lower the error.
const STEP: f64 = 4.0;

/// How many standard deviations the error must be below the target.
const CONFIDENCE: f64 = 2.0;

/// What relative errors are related to beside the square of the colour.
const FLOOR: f64 = 0.01;

/// Pixels of a block.
const BLOCK_PIXELS: u32 = BLOCK_SIZE * BLOCK_SIZE;

/// Pairs of a block and a group in a batch.
const BATCH_GROUPS: usize = (TILE_SIZE * TILE_SIZE / (BLOCK_PIXELS * GROUP)) as usize;

/// Decides how many groups of samples each block of pixels gets. Blocks are those whose samples reach the picture, on
/// the full picture's grid.
#[derive(Clone, Debug)]
pub(in crate::render) struct AdaptivePlanner {
    /// First column and row.
    first: [u32; 2],
    /// Columns and rows.
    count: [u32; 2],
    /// Groups that each block has had.
    done: Vec<u32>,
    /// Groups that each block is to have.
    planned: Vec<u32>,
    /// Of the picture's relative squared error.
    target: f64,
    /// The error by the samples so far, if it was estimated since the last pass.
    error: Option<f64>,
}

/// An estimate from the picture's samples.
struct Estimate {
    /// Each block's variance of a group, relative and mean over its pixels.
    variances: Vec<f64>,
    /// Relative squared error of the picture.
    error: f64,
    /// Standard deviation of that: of the estimate, and of the picture's actual error.
    deviation: f64,
}

impl AdaptivePlanner {
    /// Of a render that begins; `crop` are the pixels whose samples reach the picture.
    pub fn new(crop: Crop, target: f64) -> Self {
        let first = [crop.x / BLOCK_SIZE, crop.y / BLOCK_SIZE];
        let last = [(crop.x + crop.width - 1) / BLOCK_SIZE, (crop.y + crop.height - 1) / BLOCK_SIZE];
        let count = [last[0] - first[0] + 1, last[1] - first[1] + 1];
        let blocks = count[0] as usize * count[1] as usize;
        Self { first, count, done: vec![0; blocks], planned: vec![PILOT; blocks], target, error: None }
    }

    /// As bytes: what each block has and is to have, little endian.
    pub fn save(&self) -> Vec<u8> {
        self.done.iter().chain(&self.planned).flat_map(|groups| groups.to_le_bytes()).collect()
    }

    /// Takes what [`save`](Self::save) gave for a picture of the same crop; `None` if it is of another.
    pub fn load(&mut self, bytes: &[u8]) -> Option<()> {
        let (numbers, rest) = bytes.as_chunks();
        let (done, planned) = numbers.split_at_checked(self.done.len())?;
        if !rest.is_empty() || planned.len() != done.len() {
            return None;
        }
        let numbers = |bytes: &[[u8; 4]]| bytes.iter().map(|bytes| u32::from_le_bytes(*bytes)).collect();
        (self.done, self.planned) = (numbers(done), numbers(planned));
        Some(())
    }

    /// The block of this column and row of the full picture's grid.
    fn index(&self, [x, y]: [u32; 2]) -> usize {
        (y - self.first[1]) as usize * self.count[0] as usize + (x - self.first[0]) as usize
    }

    /// The column and row of a block.
    fn place(&self, index: usize) -> [u32; 2] {
        let index = index as u32;
        [self.first[0] + index % self.count[0], self.first[1] + index / self.count[0]]
    }

    /// The blocks of a tile that reach the picture.
    fn of_tile(&self, tile: &FilmTile) -> impl Iterator<Item = usize> + '_ {
        let area = tile.active();
        let range = |start: u32, length: u32| start / BLOCK_SIZE..=(start + length - 1) / BLOCK_SIZE;
        let columns = range(area.x, area.width);
        range(area.y, area.height).flat_map(move |y| columns.clone().map(move |x| self.index([x, y])))
    }

    /// The mean over the blocks around a block, as many as there are within [`REACH`].
    fn around(&self, index: usize, values: &[f64]) -> f64 {
        let place = self.place(index);
        let range = |k: usize| {
            let (first, last) = (self.first[k], self.first[k] + self.count[k] - 1);
            place[k].saturating_sub(REACH).max(first)..=(place[k] + REACH).min(last)
        };
        let (mut sum, mut count) = (0.0, 0);
        for y in range(1) {
            for x in range(0) {
                if [x, y] != place {
                    sum += values[self.index([x, y])];
                    count += 1;
                }
            }
        }
        if count == 0 { values[index] } else { sum / f64::from(count) }
    }

    fn estimate(&self, film: &Film) -> Estimate {
        let statistics = PixelStatistics::new(self, film);
        let kernel = film.variance_kernel();
        let pixels = film.grid().crop.area() as f64;
        // By the block whose samples cause it: the sum of the pixels' relative squared errors.
        let mut errors = vec![0.0; self.done.len()];
        let mut squares = 0.0;
        for (x, y) in film.grid().crop.pixels() {
            let target = statistics.of([x, y]);
            let mut whole = 0.0;
            kernel.for_each(film.sampled(), [x, y], |_, mean, _| whole += mean);
            let mut error = 0.0;
            kernel.for_each(film.sampled(), [x, y], |source, _, square| {
                let variance = statistics.of(source).variance;
                let relative: f64 = (0..3).map(|k| variance[k] * target.weight[k]).sum();
                let part = relative / 3.0 * square / (whole * whole);
                errors[self.index(source.map(|at| at / BLOCK_SIZE))] += part;
                error += part;
            });
            squares += error * error;
        }
        let count = errors.len() as f64;
        let error = errors.iter().sum::<f64>() / pixels;
        let of_blocks = errors.iter().map(|e| e * count / pixels);
        let spread = of_blocks.clone().map(|e| (e - error).powi(2)).sum::<f64>() / (count * (count - 1.0).max(1.0));
        // The square of a normal deviate has a variance of 2, and neighbours' deviates are correlated.
        let actual = 2.0 * squares * kernel.correlation / (pixels * pixels);
        let variances = of_blocks.zip(&self.done).map(|(e, n)| e * f64::from(*n)).collect();
        Estimate { variances, error, deviation: (spread + actual).sqrt() }
    }

    /// Plans groups so that the error becomes `goal`, as far as one stage may go; the most groups of a block are
    /// `most`.
    fn distribute(&mut self, variances: &[f64], goal: f64, most: u32) {
        let roots: Vec<f64> = variances.iter().map(|v| v.sqrt()).collect();
        let everywhere = (variances.iter().sum::<f64>() / variances.len() as f64).sqrt();
        let share = |i: usize| (1.0 - EVEN_SHARE) * self.around(i, &roots) + EVEN_SHARE * everywhere;
        let shares: Vec<f64> = (0..variances.len()).map(share).collect();
        let groups = |i: usize, scale: f64| -> u32 {
            let done = self.done[i];
            ((shares[i] * scale).ceil() as u32).clamp(done, (done * GROWTH).min(most).max(done))
        };
        let error = |scale: f64| {
            let sum: f64 = variances.iter().enumerate().map(|(i, v)| v / f64::from(groups(i, scale))).sum();
            sum / variances.len() as f64
        };
        // By bisection, between a scale that adds no sample and one that adds all.
        let most_share = shares.iter().copied().fold(0.0, f64::max).max(f64::MIN_POSITIVE);
        let least_share = shares.iter().copied().filter(|s| *s > 0.0).fold(most_share, f64::min);
        let (mut low, mut high) = ((1.0 / most_share).ln(), (f64::from(most) / least_share).ln());
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            if error(middle.exp()) > goal { low = middle } else { high = middle }
        }
        let planned: Vec<u32> = (0..shares.len()).map(|i| groups(i, high.exp())).collect();
        self.planned = planned;
    }

    /// Gives every block some more: where there is no better plan.
    fn add_to_all(&mut self, most: u32) {
        for (planned, done) in self.planned.iter_mut().zip(&self.done) {
            *planned = (done + done.div_ceil(8)).min(most).max(*done);
        }
    }

    /// Samples done and planned.
    fn samples(&self, film: &Film) -> [u64; 2] {
        let mut sums = [0; 2];
        for tile in film.tiles() {
            for index in self.of_tile(tile) {
                let pixels = block_area(tile, self.place(index)).area() * u64::from(GROUP);
                sums[0] += pixels * u64::from(self.done[index]);
                sums[1] += pixels * u64::from(self.planned[index]);
            }
        }
        sums
    }
}

/// The pixels of a block that reach the picture.
fn block_area(tile: &FilmTile, [x, y]: [u32; 2]) -> Crop {
    Crop { x: x * BLOCK_SIZE, y: y * BLOCK_SIZE, width: BLOCK_SIZE, height: BLOCK_SIZE }.intersection(&tile.active())
}

/// Statistics of a pixel's own samples.
#[derive(Clone, Copy, Debug, Default)]
struct PixelStatistic {
    /// Variance of their mean, by channel.
    variance: [f64; 3],
    /// `1 / (colour² + FLOOR)`, which makes a squared error of the pixel relative, by channel.
    weight: [f64; 3],
}

/// By pixel whose samples reach the picture.
struct PixelStatistics {
    area: Crop,
    pixels: Vec<PixelStatistic>,
}

impl PixelStatistics {
    fn new(blocks: &AdaptivePlanner, film: &Film) -> Self {
        let area = film.sampled();
        let mut all = Self { area, pixels: vec![PixelStatistic::default(); area.area() as usize] };
        for tile in film.tiles() {
            for index in blocks.of_tile(tile) {
                let block = block_area(tile, blocks.place(index));
                let statistics =
                    || block.pixels().map(|(x, y)| tile.group_statistics(tile.index(x, y)).unwrap_or_default());
                let totals = statistics().fold([0.0; 3], |sum, (mean, _)| [0, 1, 2].map(|k| sum[k] + mean[k]));
                let count = block.area() as f64;
                for ((x, y), (mean, variance)) in block.pixels().zip(statistics()) {
                    let weight = [0, 1, 2].map(|k| {
                        // What makes a pixel uncertain may make it bright: the mean of the others of its block is the
                        // better estimate.
                        let others = (totals[k] - mean[k]) / (count - 1.0).max(1.0);
                        let color = if count > 1.0 { mean[k].abs().min(others.abs()) } else { mean[k] };
                        1.0 / (color * color + FLOOR)
                    });
                    let at = all.index([x, y]);
                    all.pixels[at] = PixelStatistic { variance, weight };
                }
            }
        }
        all
    }

    fn index(&self, [x, y]: [u32; 2]) -> usize {
        (y - self.area.y) as usize * self.area.width as usize + (x - self.area.x) as usize
    }

    fn of(&self, pixel: [u32; 2]) -> &PixelStatistic {
        &self.pixels[self.index(pixel)]
    }
}

impl AdaptivePlanner {
    /// Reports what is planned at first, and what is there from an earlier run.
    pub fn start(&self, film: &Film, progress: &dyn Progress) {
        progress.start(PILOT * GROUP, film.sampled().area());
        let [done, planned] = self.samples(film);
        if done > 0 {
            progress.resumed(done);
            if self.has_pilot() {
                progress.plan(planned, self.estimate(film).error, self.target);
            }
        }
    }

    /// Whether every block has the groups without which nothing is known of the error.
    pub fn has_pilot(&self) -> bool {
        self.done.iter().all(|&n| n >= PILOT)
    }

    /// Plans the next stage if the last one is done; `false` if none follows: the error is below the target, or a pixel
    /// would get more samples than `spp`.
    pub fn plan(&mut self, film: &Film, spp: u32, progress: &dyn Progress) -> bool {
        let most = spp.div_ceil(GROUP).max(PILOT);
        while self.done.iter().zip(&self.planned).all(|(done, planned)| done >= planned) {
            let estimate = self.estimate(film);
            self.error = Some(estimate.error);
            let is_reached = estimate.error + CONFIDENCE * estimate.deviation <= self.target;
            if is_reached || self.done.iter().all(|&n| n >= most) {
                return false;
            }
            // The deviation by few samples is uncertain, and no reason to go far: the next estimate is better.
            let deviation = (estimate.deviation / estimate.error).min(0.1);
            let goal = (0.97 * self.target / (1.0 + CONFIDENCE * deviation)).max(estimate.error / STEP);
            self.distribute(&estimate.variances, goal, most);
            let [mut done, mut planned] = self.samples(film);
            if planned < done + done / 50 {
                self.add_to_all(most);
                [done, planned] = self.samples(film);
            }
            debug_assert!(planned >= done, "samples are never taken back");
            progress.plan(planned, estimate.error, self.target);
        }
        true
    }

    /// Blocks got `groups` more groups, as far as they lacked them; the result is the mean number of samples of a
    /// pixel.
    pub fn complete_pass(&mut self, film: &Film, groups: u32) -> u32 {
        self.error = None;
        for (done, planned) in self.done.iter_mut().zip(&self.planned) {
            *done = (*done + groups).min(*planned);
        }
        (self.samples(film)[0] as f64 / film.sampled().area() as f64).round() as u32
    }

    /// The picture's relative squared error.
    pub fn estimated_error(&self, film: &Film) -> f64 {
        self.error.unwrap_or_else(|| self.estimate(film).error)
    }

    /// Renders at most `most` more groups of every block of a tile that lacks them; the result is how many samples are
    /// in the picture.
    pub fn render_tile(
        &self,
        renderer: &TileRenderer,
        tile: &mut FilmTile,
        most: u32,
        workspace: &mut TileWorkspace,
    ) -> u64 {
        let missing = |index: usize| self.done[index]..(self.done[index] + most).min(self.planned[index]);
        let of_block = |index: usize| missing(index).map(move |group| (self.place(index), group));
        let groups: Vec<([u32; 2], u32)> = self.of_tile(tile).flat_map(of_block).collect();
        groups.chunks(BATCH_GROUPS).map(|groups| render_groups(renderer, tile, groups, workspace)).sum()
    }
}

/// Renders a group of samples of each of these blocks; the result is how many samples are in the picture.
fn render_groups(
    renderer: &TileRenderer,
    tile: &mut FilmTile,
    groups: &[([u32; 2], u32)],
    workspace: &mut TileWorkspace,
) -> u64 {
    let pixel =
        |[x, y]: [u32; 2], within: u32| [x * BLOCK_SIZE + within % BLOCK_SIZE, y * BLOCK_SIZE + within / BLOCK_SIZE];
    // The pixels of a block side by side, for their rays are alike.
    let of_group = |&(block, group): &([u32; 2], u32)| {
        let of_sample = move |sample: u32| (0..BLOCK_PIXELS).map(move |within| (pixel(block, within), sample));
        (group * GROUP..(group + 1) * GROUP).flat_map(of_sample)
    };
    renderer.render_samples(groups.iter().flat_map(of_group), Guidance::default(), workspace);
    if renderer.context.is_cancelled() {
        return 0;
    }
    let active = tile.active();
    let mut count = 0;
    for (g, &(block, group)) in groups.iter().enumerate() {
        for within in 0..BLOCK_PIXELS {
            let [x, y] = pixel(block, within);
            if !active.contains(x, y) {
                continue;
            }
            let index = tile.index(x, y);
            let (mut sum, mut kept) = ([0.0; 3], 0.0);
            for i in 0..GROUP {
                let slot = g * (BLOCK_PIXELS * GROUP) as usize + (i * BLOCK_PIXELS + within) as usize;
                if renderer.add(tile, index, group * GROUP + i, slot, workspace) {
                    let value = workspace.radiance(slot);
                    sum = [0, 1, 2].map(|k| sum[k] + value[k]);
                    kept += 1.0;
                }
            }
            if kept > 0.0 {
                tile.add_moments(index, sum.map(|s| s / kept));
            }
            count += u64::from(GROUP);
        }
        let corner = block_area(tile, block);
        tile.flush(tile.index(corner.x, corner.y), &mut workspace.splats);
    }
    count
}
