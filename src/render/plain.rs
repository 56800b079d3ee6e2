//! The render loop where every pixel gets the same samples.

use std::time::{Duration, Instant};

use rayon::prelude::*;

use super::run::{Run, next_pass};
use super::{Batch, Job, Progress, RenderState, Stats};
use crate::film::FilmTile;
use crate::integrator::RayCounts;

/// Tiles of the first pass, where a pass may be a part of a sample.
const FIRST_TILES: usize = 64;

/// Renders all samples that are missing, until something ends the render.
pub(super) fn render(run: &mut Run, state: &mut RenderState) -> Stats {
    let mut stats = Stats::default();
    let spp = run.settings.spp;
    let pixels = state.film.grid().crop.area();
    let sampled = state.film.sampled().area();
    run.progress.start(state.shard.samples(spp).len() as u32, sampled);
    run.progress.resumed(sampled * u64::from(state.done));
    let all = state.film.tiles().len();
    let mut pass = Pass { samples: 1, tiles: if run.longest_pass().is_some() { FIRST_TILES.min(all) } else { all } };
    loop {
        let missing = state.missing(spp);
        state.complete = missing.is_empty();
        // A sample that has begun is finished: every pixel is to have as many.
        if state.complete || (state.tiles_ahead == 0 && run.limits.end(&mut stats, state.done > 0)) {
            break;
        }
        let first = state.tiles_ahead;
        let tiles = first..(first + pass.tiles).min(all);
        pass.samples = if tiles.len() == all { pass.samples.min(missing.len() as u32) } else { 1 };
        let start = Instant::now();
        let rendered = &mut state.film.tiles_mut()[tiles.clone()];
        state.rays.add(&render_pass(run.job, run.pool, rendered, missing.start, pass.samples, run.progress));
        if run.has_given_up(&mut stats) {
            state.torn = true;
            break;
        }
        state.tiles_ahead = tiles.end % all;
        state.done += if tiles.end == all { pass.samples } else { 0 };
        if stats.first_pass_seconds == 0.0 && state.done > 0 {
            stats.first_pass_seconds = run.limits.elapsed().as_secs_f64();
            run.has_picture();
        }
        let next = Pass { tiles: tiles.len(), ..pass }.next(run, all, start.elapsed());
        if !state.missing(spp).is_empty() {
            run.pass_done(state, next.expected);
        }
        pass = next.pass;
    }
    stats.samples = pixels * u64::from(state.done);
    stats
}

/// What a pass renders: so many samples of all tiles, or one sample of some.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Pass {
    samples: u32,
    tiles: usize,
}

/// A pass with the time that it is expected to take.
struct Planned {
    pass: Pass,
    expected: Duration,
}

impl Pass {
    /// The pass after one that took `elapsed`; there are `all` tiles.
    fn next(self, run: &Run, all: usize, elapsed: Duration) -> Planned {
        let of_one_tile = elapsed.div_f64(f64::from(self.samples) * self.tiles as f64);
        let of_all = of_one_tile.mul_f64(all as f64);
        let pass = match run.longest_pass().filter(|longest| of_all > *longest) {
            Some(longest) => {
                let fitting = (longest.as_secs_f64() / of_one_tile.as_secs_f64().max(1e-9)) as usize;
                Self { samples: 1, tiles: fitting.clamp(1, all) }
            }
            None if self.tiles < all => Self { samples: 1, tiles: all },
            None => {
                let limit = run.limits.remaining().into_iter().chain(run.longest_pass()).min();
                Self { samples: next_pass(self.samples, elapsed, limit), tiles: all }
            }
        };
        Planned { pass, expected: of_one_tile.mul_f64(f64::from(pass.samples) * pass.tiles as f64) }
    }
}

/// Renders `count` samples of every pixel of some tiles, from sample `first` on.
pub(super) fn render_pass(
    job: &Job,
    pool: &rayon::ThreadPool,
    tiles: &mut [FilmTile],
    first: u32,
    count: u32,
    progress: &dyn Progress,
) -> RayCounts {
    pool.install(|| {
        tiles
            .par_iter_mut()
            .with_max_len(1)
            .map_init(Batch::new, |batch, tile| {
                let counts = job.render_tile(tile, first, count, batch);
                progress.tile_done(u64::from(count) * tile.active().area());
                counts
            })
            .reduce(RayCounts::default, |mut a, b| {
                a.add(&b);
                a
            })
    })
}
