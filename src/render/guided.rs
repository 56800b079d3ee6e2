//! Renders whose paths learn where light comes from: in passes, each with as many samples as all before it, which follow what those have
//! taught.
//!
//! Later passes are better than earlier ones, so samples count by the inverse of their pass's variance. A pass that met a bright path
//! by luck has a larger variance for it; if that took weight from the path, the picture would be too dark. So what samples of a tile
//! count depends on the other tiles alone.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use super::limits::Limits;
use super::plain::render_pass;
use super::run::next_pass;
use super::{BLOCK_SIZE, Job, Progress, RenderResult, Settings, Stats, TILE_SIZE};
use crate::error::Result;
use crate::film::{Film, FilmTile, LayerKind};
use crate::guiding::Guide;
use crate::integrator::{self, Cancel, RayCounts, Setup};

/// Samples per pixel of the first pass. One tells how bright the scene is, the other is learned from.
const FIRST_PASS: u32 = 2;

/// Passes of so many samples or more decide whether guiding goes on: their variance times rays must be so much less than without.
const PAYS: [(u32, f64); 2] = [(8, 1.2), (16, GUIDED_COST)];

/// How often the guide is refined while the samples double, at most.
const REFINEMENTS: u32 = 4;

/// What relative variances are related to beside the square of the colour.
const FLOOR: f64 = 0.01;

/// By this factor the weight of samples may change from one pass to the next.
const LARGEST_CHANGE: f64 = 32.0;

/// Time of a ray of a guided path over that of another, about, learning included: from 2.5 in a room seen through a door to 3.7 in a Cornell box.
const GUIDED_COST: f64 = 2.5;

/// Variance of a sample, by channel, mean over the pixels of a block.
type BlockVariances = Vec<[f64; 3]>;

/// What a pass was like.
struct Pass {
    /// By tile.
    variances: Vec<BlockVariances>,
    /// Rays of a sample.
    rays: f64,
}

/// The picture so far.
struct Picture {
    film: Film,
    /// What a sample of the last pass counts, by tile.
    factors: Vec<f64>,
    first: Option<Pass>,
    last: Option<Pass>,
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

/// Sum of the blocks' variances over the squares of their colours.
fn relative(variances: &BlockVariances, colors: &[[f64; 3]]) -> f64 {
    let of_block = |(v, c): (&[f64; 3], &[f64; 3])| (0..3).map(|k| v[k] / (c[k] * c[k] + FLOOR)).sum::<f64>();
    variances.iter().zip(colors).map(of_block).sum()
}

/// `a / b`, where both are known.
fn ratio(a: f64, b: f64) -> f64 {
    if a > 0.0 && b > 0.0 && a < f64::INFINITY && b < f64::INFINITY { a / b } else { 1.0 }
}

/// Mean of all channels of all blocks.
fn mean(film: &Film) -> f64 {
    let of_tile = |tile: &FilmTile| {
        let means = block_means(tile);
        let count = means.len().max(1) as f64;
        means.iter().flatten().map(|v| v.max(0.0)).sum::<f64>() / (3.0 * count)
    };
    film.tiles().iter().map(of_tile).sum::<f64>() / film.tiles().len().max(1) as f64
}

impl Picture {
    /// Adds a pass of so many samples per pixel; says by how much it is better than the first, variance times rays.
    fn add(&mut self, film: &Film, samples: u32, rays: &RayCounts) -> f64 {
        let variances: Vec<_> = film.tiles().iter().map(|tile| block_variances(tile, samples)).collect();
        let pixels = film.sampled().area() as f64;
        let pass = Pass { variances, rays: rays.total() as f64 / (pixels * f64::from(samples)) };
        let mut gain = 1.0;
        if let (Some(first), Some(last), true) = (&self.first, &self.last, samples >= 2) {
            // Colours are those of all samples, so that luck in one pass does not change the ratios.
            let colors: Vec<Vec<[f64; 3]>> = self
                .film
                .tiles()
                .iter()
                .zip(film.tiles())
                .map(|(a, b)| {
                    let both = |(a, b): ([f64; 3], [f64; 3])| [0, 1, 2].map(|k| 0.5 * (a[k] + b[k]));
                    block_means(a).into_iter().zip(block_means(b)).map(both).collect()
                })
                .collect();
            let by_tile = |pass: &Pass| -> Vec<f64> { pass.variances.iter().zip(&colors).map(|(v, c)| relative(v, c)).collect() };
            let (now, before) = (by_tile(&pass), by_tile(last));
            let total = |sums: &[f64]| sums.iter().sum::<f64>();
            let (all_now, all_before) = (total(&now), total(&before));
            for (t, factor) in self.factors.iter_mut().enumerate() {
                *factor *= ratio(all_before - before[t], all_now - now[t]).clamp(1.0 / LARGEST_CHANGE, LARGEST_CHANGE);
            }
            gain = ratio(total(&by_tile(first)) * first.rays, all_now * pass.rays);
        }
        for ((tile, other), factor) in self.film.tiles_mut().iter_mut().zip(film.tiles()).zip(&self.factors) {
            tile.merge_weighed(other, *factor);
        }
        if samples >= 2 {
            let kept = Pass { variances: pass.variances.clone(), rays: pass.rays };
            self.first.get_or_insert(kept);
            self.last = Some(pass);
        }
        gain
    }

    fn new(film: Film) -> Self {
        let factors = vec![1.0; film.tiles().len()];
        Self { film, factors, first: None, last: None }
    }
}

/// The guide and when it learns.
struct Lessons {
    guide: Option<Guide>,
    /// Samples per pixel since it was refined.
    since: u32,
}

impl Lessons {
    /// How many samples it takes to the next refinement, after `done`.
    fn interval(done: u32) -> u32 {
        (done / REFINEMENTS).max(1)
    }

    /// How many samples follow with the guide as it is.
    fn left(&self, done: u32) -> u32 {
        if self.guide.is_some() { Self::interval(done - self.since).saturating_sub(self.since).max(1) } else { u32::MAX }
    }

    /// Learns from `samples` more, after which `done` are done; `film` has them and all others.
    fn learn(&mut self, guide: Option<Arc<Guide>>, samples: u32, done: u32, brightness: impl FnOnce() -> f64) {
        self.since += samples;
        self.guide = guide.and_then(Arc::into_inner).map(|guide| {
            if self.since < Self::interval(done - self.since) {
                return guide;
            }
            self.since = 0;
            let next = guide.refined(done);
            if next.knows_brightness() { next } else { next.with_typical(brightness() as f32) }
        });
    }
}

/// Renders all samples, or those that there is time for.
pub(super) fn render(
    mut job: Job,
    pool: &rayon::ThreadPool,
    settings: &Settings,
    progress: &dyn Progress,
    (stop, cancel): (&AtomicBool, &Cancel),
) -> Result<RenderResult> {
    let mut shape = job.shape.clone();
    shape.layers.insert(LayerKind::Variance);
    let film = || Film::new(shape.clone(), TILE_SIZE);
    let mut picture = Picture::new(film()?);
    let mut stats = Stats::default();
    let pixels = settings.crop.area();
    progress.start(settings.spp, picture.film.sampled().area());
    let mut lessons = Lessons { guide: Some(Guide::new(job.world.accel.bounds(), 0.0)), since: 0 };

    let limits = Limits::new(settings, stop);
    let mut step = 1;
    while stats.spp_done < settings.spp && !stats.interrupted && !stats.time_limited {
        let count = stats.spp_done.max(FIRST_PASS).min(settings.spp - stats.spp_done);
        let mut film = film()?;
        let (mut done, mut rays) = (0, RayCounts::default());
        while done < count {
            let has_picture = stats.spp_done > 0;
            if limits.end(&mut stats, has_picture) {
                break;
            }
            let pass_start = Instant::now();
            let to_refinement = lessons.left(stats.spp_done);
            let samples = step.min(count - done).min(to_refinement);
            let is_last = to_refinement >= settings.spp - stats.spp_done;
            let guide = lessons.guide.take().map(|guide| Arc::new(if is_last { guide.finished() } else { guide }));
            job.integrator = integrator::build(&settings.integrator, Setup { guide: guide.clone(), ..job.setup.clone() });
            rays.add(&render_pass(&job, pool, film.tiles_mut(), stats.spp_done, samples, progress));
            // Drops its part of the guide.
            job.integrator = integrator::build(&settings.integrator, job.setup.clone());
            if cancel.given_up() {
                // The film has samples that the guide knows nothing of; what is in the picture stays.
                limits.end(&mut stats, true);
                stats.spp_done -= done;
                done = 0;
                break;
            }
            done += samples;
            stats.spp_done += samples;
            lessons.learn(guide, samples, stats.spp_done, || mean(&film));
            if stats.first_pass_seconds == 0.0 {
                stats.first_pass_seconds = limits.elapsed().as_secs_f64();
                cancel.has_picture(settings.time_limit);
            }
            step = next_pass(samples, pass_start.elapsed(), limits.remaining());
        }
        stats.rays.add(&rays);
        if done == 0 {
            break;
        }
        let gain = picture.add(&film, done, &rays);
        if progress.wants_picture() && stats.spp_done < settings.spp {
            progress.picture(&job.picture(&picture.film), stats.spp_done);
        }
        if let Some(guide) = &lessons.guide {
            let (leaves, nodes) = (guide.leaves(), guide.directional_nodes());
            tracing::debug!("guided: pass of {done} samples, {gain:.2} times as good as the first; {leaves} leaves, {nodes} nodes");
        }
        let pays = PAYS.iter().all(|&(samples, least)| done < samples || gain >= least);
        if stats.spp_done > done && !pays && lessons.guide.take().is_some() {
            tracing::info!("guiding does not pay and is given up after {} samples per pixel", stats.spp_done);
        }
    }
    stats.render_seconds = limits.elapsed().as_secs_f64();
    progress.finish();
    super::check_time(settings, &stats, stats.spp_done)?;

    stats.samples = pixels * u64::from(stats.spp_done);
    stats.nan_samples = picture.film.dropped_count();
    stats.dropped = picture.film.dropped();
    Ok(RenderResult { image: job.picture(&picture.film), stats })
}
