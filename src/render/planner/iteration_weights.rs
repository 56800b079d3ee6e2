//! How much the samples of each iteration of a guided render count: by the inverse of their variance.
//!
//! An iteration that met a bright path by luck has a larger variance for it; if that took weight from the path, the
//! picture would be too dark. So the weights of a tile's samples depend on the other tiles alone.

use crate::bytes::{ByteReader, ByteWriter};
use crate::film::{Film, FilmTile};
use crate::render::BLOCK_SIZE;

/// What relative variances are related to beside the square of the colour.
const FLOOR: f64 = 0.01;

/// By this factor weights may change from one iteration to the next.
const MAX_CHANGE: f64 = 32.0;

/// The part of the blocks, those with the most variance, that [`Gain::trimmed`] leaves out: few bright paths decide
/// theirs.
const TRIMMED_PART: f64 = 0.05;

/// Variance of a sample, by channel, mean over the pixels of a block.
type BlockVariances = Vec<[f64; 3]>;

/// The noise of an iteration and its cost.
#[derive(Clone, Debug)]
struct IterationStatistics {
    /// By tile.
    variances: Vec<BlockVariances>,
    /// Rays of a sample.
    rays: f64,
}

/// Variance times rays of the first iteration over that of another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Gain {
    /// Of the picture.
    pub all: f64,
    /// Without the blocks of pixels with the most variance, in each iteration apart.
    pub trimmed: f64,
}

impl Gain {
    const NONE: Self = Self { all: 1.0, trimmed: 1.0 };
}

/// The weights of the samples of the last iteration.
#[derive(Clone, Debug)]
pub(super) struct IterationWeights {
    /// By tile.
    factors: Vec<f64>,
    first: Option<IterationStatistics>,
    last: Option<IterationStatistics>,
}

/// Blocks of a tile that reach the picture, each with its pixels' indices.
fn blocks(tile: &FilmTile) -> impl Iterator<Item = Vec<usize>> + '_ {
    let area = tile.active();
    let step = BLOCK_SIZE as usize;
    let (rows, columns) = (area.y..area.y + area.height, area.x..area.x + area.width);
    rows.step_by(step).flat_map(move |y| {
        columns.clone().step_by(step).map(move |x| {
            let rows = y..(y + BLOCK_SIZE).min(area.y + area.height);
            let columns = x..(x + BLOCK_SIZE).min(area.x + area.width);
            rows.flat_map(|y| columns.clone().map(move |x| (x, y))).map(|(x, y)| tile.index(x, y)).collect()
        })
    })
}

/// Variance of a sample by block.
fn block_variances(tile: &FilmTile, samples: u32) -> BlockVariances {
    let of_block = |pixels: Vec<usize>| {
        let scale = f64::from(samples) / pixels.len() as f64;
        let mut sum = [0.0; 3];
        for (_, variance) in pixels.iter().filter_map(|&pixel| tile.group_statistics(pixel)) {
            sum = [0, 1, 2].map(|k| sum[k] + scale * variance[k]);
        }
        sum
    };
    blocks(tile).map(of_block).collect()
}

/// Mean colour by block.
fn block_means(tile: &FilmTile) -> Vec<[f64; 3]> {
    let of_block = |pixels: Vec<usize>| {
        let mut sum = [0.0; 3];
        for mean in pixels.iter().map(|&pixel| tile.mean(pixel)) {
            sum = [0, 1, 2].map(|k| sum[k] + mean[k] / pixels.len() as f64);
        }
        sum
    };
    blocks(tile).map(of_block).collect()
}

/// Mean colour by block of the samples of two tiles, of which the second has this part, so that luck in one iteration
/// does not change the ratios of variances.
fn common_means(a: &FilmTile, b: &FilmTile, part: f64) -> Vec<[f64; 3]> {
    let both = |(a, b): ([f64; 3], [f64; 3])| [0, 1, 2].map(|k| (1.0 - part) * a[k] + part * b[k]);
    block_means(a).into_iter().zip(block_means(b)).map(both).collect()
}

/// The blocks' variances over the squares of their colours.
fn relative(variances: &BlockVariances, colors: &[[f64; 3]]) -> Vec<f64> {
    let of_block = |(v, c): (&[f64; 3], &[f64; 3])| (0..3).map(|k| v[k] / (c[k] * c[k] + FLOOR)).sum();
    variances.iter().zip(colors).map(of_block).collect()
}

/// Sum of the values without the [`TRIMMED_PART`] part that is largest.
fn trimmed_sum(by_tile: &[Vec<f64>]) -> f64 {
    let mut values = by_tile.concat();
    values.sort_unstable_by(f64::total_cmp);
    let left = values.len() - (TRIMMED_PART * values.len() as f64) as usize;
    values[..left].iter().sum()
}

/// `a / b`, where both are known.
fn ratio(a: f64, b: f64) -> f64 {
    if a > 0.0 && b > 0.0 && a < f64::INFINITY && b < f64::INFINITY { a / b } else { 1.0 }
}

/// Mean of all channels of all blocks.
pub(super) fn mean(film: &Film) -> f64 {
    let of_tile = |tile: &FilmTile| {
        let means = block_means(tile);
        let count = means.len().max(1) as f64;
        means.iter().flatten().map(|v| v.max(0.0)).sum::<f64>() / (3.0 * count)
    };
    film.tiles().iter().map(of_tile).sum::<f64>() / film.tiles().len().max(1) as f64
}

impl IterationWeights {
    /// Before the first iteration, whose samples have a weight of 1.
    pub fn new(film: &Film) -> Self {
        Self { factors: vec![1.0; film.tiles().len()], first: None, last: None }
    }

    /// Adds an iteration of `samples` samples per pixel to the film of those before, `done` together, all with a weight
    /// of 1 unless `is_weighed`; the result is what the iteration gains over the first.
    pub fn add(
        &mut self,
        film: &mut Film,
        iteration: &Film,
        [samples, done]: [u32; 2],
        rays: u64,
        is_weighed: bool,
    ) -> Gain {
        let variances: Vec<_> = iteration.tiles().iter().map(|tile| block_variances(tile, samples)).collect();
        let pixels = iteration.sampled().area() as f64;
        let statistics = IterationStatistics { variances, rays: rays as f64 / (pixels * f64::from(samples)) };
        let gain = if samples >= 2 {
            self.update(film, iteration, &statistics, f64::from(samples) / f64::from(done))
        } else {
            Gain::NONE
        };
        for ((tile, other), factor) in film.tiles_mut().iter_mut().zip(iteration.tiles()).zip(&self.factors) {
            if is_weighed {
                tile.merge_inverse_variance(other, *factor);
            } else {
                tile.merge(other);
            }
        }
        if samples >= 2 {
            self.first.get_or_insert_with(|| statistics.clone());
            self.last = Some(statistics);
        }
        gain
    }

    /// Sets the weights of an iteration, which has this part of all samples, by its variance and that of the last one;
    /// the result is its gain over the first.
    fn update(&mut self, film: &Film, iteration: &Film, statistics: &IterationStatistics, part: f64) -> Gain {
        let (Some(first), Some(last)) = (&self.first, &self.last) else { return Gain::NONE };
        let colors: Vec<_> =
            film.tiles().iter().zip(iteration.tiles()).map(|(a, b)| common_means(a, b, part)).collect();
        let by_tile = |statistics: &IterationStatistics| -> Vec<Vec<f64>> {
            statistics.variances.iter().zip(&colors).map(|(variances, colors)| relative(variances, colors)).collect()
        };
        let sums = |blocks: &[Vec<f64>]| blocks.iter().map(|tile| tile.iter().sum()).collect::<Vec<f64>>();
        let [blocks_first, blocks_current] = [first, statistics].map(by_tile);
        let (current, before) = (sums(&blocks_current), sums(&by_tile(last)));
        let (all_current, all_before) = (current.iter().sum::<f64>(), before.iter().sum::<f64>());
        for (t, factor) in self.factors.iter_mut().enumerate() {
            *factor *= ratio(all_before - before[t], all_current - current[t]).clamp(1.0 / MAX_CHANGE, MAX_CHANGE);
        }
        let gain = |of_first: f64, of_current: f64| ratio(of_first * first.rays, of_current * statistics.rays);
        Gain {
            all: gain(sums(&blocks_first).iter().sum(), all_current),
            trimmed: gain(trimmed_sum(&blocks_first), trimmed_sum(&blocks_current)),
        }
    }

    /// Writes the weights and what the next ones depend on.
    pub fn write(&self, out: &mut ByteWriter) {
        out.floats(self.factors.iter().copied());
        for statistics in [&self.first, &self.last] {
            let values = statistics
                .iter()
                .flat_map(|s| [s.rays].into_iter().chain(s.variances.iter().flatten().flatten().copied()));
            out.floats(values.collect::<Vec<_>>().into_iter());
        }
    }

    /// Reads what [`write`](Self::write) gave for a film of the same tiles; `None` if it is something else.
    pub fn read(data: &mut ByteReader, film: &Film) -> Option<Self> {
        let is_weight = |factor: &f64| *factor > 0.0 && *factor < f64::INFINITY;
        let factors = data.floats().filter(|list| list.len() == film.tiles().len() && list.iter().all(is_weight))?;
        let counts: Vec<usize> = film.tiles().iter().map(|tile| blocks(tile).count()).collect();
        let mut statistics = || -> Option<Option<IterationStatistics>> {
            let list = data.floats()?;
            let Some((&rays, values)) = list.split_first() else { return Some(None) };
            let (mut values, rest) = values.as_chunks::<3>();
            if !rest.is_empty() || values.len() != counts.iter().sum::<usize>() {
                return None;
            }
            let mut next = |count: usize| values.split_off(..count).map(<[_]>::to_vec);
            let variances = counts.iter().map(|&count| next(count)).collect::<Option<_>>()?;
            Some(Some(IterationStatistics { variances, rays }))
        };
        Some(Self { factors, first: statistics()?, last: statistics()? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trimmed_sum_lacks_the_largest_values() {
        let tiles = [vec![1.0; 30], vec![1e6, 2.0], vec![1.0; 8]];
        // Of 40 blocks two are left out.
        assert_eq!(trimmed_sum(&tiles), 38.0);
        assert_eq!(trimmed_sum(&[vec![3.0, 5.0]]), 8.0);
        assert_eq!(trimmed_sum(&[]), 0.0);
    }
}
