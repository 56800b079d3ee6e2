//! The render loop where every pixel gets the same samples.

use std::time::Instant;

use rayon::prelude::*;

use super::run::{Run, next_pass};
use super::{Batch, Job, Progress, RenderState, Stats};
use crate::film::Film;
use crate::integrator::RayCounts;

/// Renders all samples that are missing, until something ends the render.
pub(super) fn render(run: &mut Run, state: &mut RenderState) -> Stats {
    let mut stats = Stats::default();
    let spp = run.settings.spp;
    let pixels = state.film.crop().area();
    run.progress.start(state.shard.samples(spp).len() as u32, pixels);
    run.progress.resumed(pixels * u64::from(state.done));
    let mut count = 1;
    loop {
        let missing = state.missing(spp);
        state.complete = missing.is_empty();
        if state.complete || run.limits.end(&mut stats, state.done > 0) {
            break;
        }
        count = count.min(missing.len() as u32);
        let start = Instant::now();
        state.rays.add(&render_pass(run.job, run.pool, &mut state.film, missing.start, count, run.progress));
        state.done += count;
        let elapsed = start.elapsed();
        if stats.first_pass_seconds == 0.0 {
            stats.first_pass_seconds = run.limits.elapsed().as_secs_f64();
        }
        let next = next_pass(count, elapsed, run.limits.remaining());
        if count < missing.len() as u32 {
            run.pass_done(state, elapsed.mul_f64(f64::from(next) / f64::from(count)));
        }
        count = next;
    }
    stats.samples = pixels * u64::from(state.done);
    stats
}

/// Renders `count` samples of every pixel, from sample `first` on.
pub(super) fn render_pass(
    job: &Job,
    pool: &rayon::ThreadPool,
    film: &mut Film,
    first: u32,
    count: u32,
    progress: &dyn Progress,
) -> RayCounts {
    pool.install(|| {
        film.tiles_mut()
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
