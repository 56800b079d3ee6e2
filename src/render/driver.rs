//! The render loop: passes over tiles until no sample is missing or something ends the render; between them,
//! checkpoints and previews.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use rayon::prelude::*;

use super::planner::{Pass, PassSize};
use super::settings::refused;
use super::tile_renderer::{TileRenderer, TileWorkspace};
use super::{Checkpoints, LightTracing, Progress, RenderState, Settings, Stats, check_resumable};
use crate::accel::Accelerator;
use crate::error::{Error, Result};
use crate::film::FilmTile;
use crate::integrator::{Cancel, RayCounts};
use crate::scene::Scene;

/// A pass aims at this time: long enough to cost nothing, short enough that an interrupt takes effect soon.
const PASS_TIME: Duration = Duration::from_millis(500);

/// Checkpoints make passes no shorter than this.
const MIN_PASS_TIME: Duration = Duration::from_millis(50);

/// Tiles of the first pass of a render with checkpoints, whose passes may be a part of a sample.
const FIRST_TILES: usize = 64;

/// What is rendered, and who observes and stops it.
#[derive(Clone, Copy)]
pub struct RenderSession<'a> {
    /// What is rendered.
    pub scene: &'a Scene,
    /// The accelerator over the scene's geometry.
    pub accel: &'a dyn Accelerator,
    /// How it is rendered.
    pub settings: &'a Settings,
    /// Is informed of every pass.
    pub progress: &'a dyn Progress,
    /// Ends the render when it becomes true.
    pub stop: &'a AtomicBool,
}

impl RenderSession<'_> {
    /// Renders what is missing of a state, whose shard determines which samples belong to it. Ends early as
    /// [`render`](super::render()) does; the state can be continued then, also from one of `checkpoints`. The picture
    /// has the same bits however often that happens.
    ///
    /// # Errors
    /// As [`render`](super::render()); [`Error::Setting`] as [`check_resumable`] has it.
    pub fn render(
        &self,
        mut state: RenderState,
        checkpoints: Option<&mut Checkpoints>,
    ) -> Result<(RenderState, Stats)> {
        check_resumable(self.settings, state.shard)?;
        let cancel = Cancel::new(self.stop, self.settings.time_limit);
        let mut renderer = TileRenderer::new(self.scene, self.accel, self.settings);
        renderer.context = renderer.context.with_cancel(&cancel);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(self.settings.threads).build();
        let pool = pool.map_err(|e| Error::Threads { count: self.settings.threads, message: e.to_string() })?;
        let workspaces = (0..pool.current_num_threads()).map(|_| Mutex::default()).collect();
        let mut driver =
            Driver { session: self, renderer, pool, workspaces, start: Instant::now(), cancel: &cancel, checkpoints };
        let stats = driver.run(&mut state);
        self.check_time(&stats, state.done)?;
        let (nan_samples, dropped) = state.dropped();
        let (rays, spp_done, render_seconds, is_uneven) = (state.rays, state.done, state.seconds, state.is_uneven);
        Ok((state, Stats { render_seconds, rays, spp_done, nan_samples, dropped, is_uneven, ..stats }))
    }

    /// An error for a render without a picture when its time is over.
    fn check_time(&self, stats: &Stats, done: u32) -> Result<()> {
        match self.settings.time_limit.filter(|_| stats.time_limited && done == 0) {
            Some(limit) => {
                let message = "twice that time was not enough for a sample of every pixel: no picture";
                Err(refused("time_limit", format!(" {}: {message}", limit.as_secs_f64())))
            }
            None => Ok(()),
        }
    }
}

/// A render under way.
struct Driver<'a> {
    session: &'a RenderSession<'a>,
    renderer: TileRenderer<'a>,
    pool: rayon::ThreadPool,
    /// By thread of the pool.
    workspaces: Vec<Mutex<TileWorkspace>>,
    start: Instant,
    cancel: &'a Cancel<'a>,
    checkpoints: Option<&'a mut Checkpoints>,
}

impl Driver<'_> {
    /// Renders all samples that are missing, until something ends the render.
    fn run(&mut self, state: &mut RenderState) -> Stats {
        let mut stats = Stats::default();
        state.start(self.session);
        // Its rays are of no sample: a resumed render and a shard trace it again.
        // Pictures that were begun without a decision go on as they are.
        let known = state.light_tracing.or((state.done > 0).then_some(LightTracing::Off));
        self.pool.install(|| self.renderer.prepare(&self.workspaces, known));
        // A pilot that was cancelled has decided nothing.
        if !self.renderer.context.is_cancelled() {
            state.set_light_tracing(self.renderer.light_tracing());
        }
        let all = state.film.tiles().len();
        let mut size =
            PassSize { samples: 1, tiles: if self.max_pass_time().is_some() { FIRST_TILES.min(all) } else { all } };
        // Of one sample of one tile, by the last pass.
        let mut tile_time = None;
        loop {
            let pilot = self.pool.install(|| state.run_guiding_pilot(&self.renderer, &self.workspaces));
            state.rays.add(&pilot);
            let Some(pass) = state.next_pass(self.session, size) else {
                state.complete = true;
                break;
            };
            if let Some(time) = tile_time {
                self.between_passes(state, pass.duration(time));
            }
            if state.can_end() && self.ends(&mut stats, state.done > 0) {
                break;
            }
            let start = Instant::now();
            let mut rays = self.pool.install(|| self.renderer.trace_from_lights(pass.samples.start, &self.workspaces));
            rays.add(&self.render_pass(state, &pass));
            state.rays.add(&rays);
            if self.cancel.is_cancelled() {
                self.ends(&mut stats, true);
                state.cancel_pass();
                break;
            }
            state.complete_pass(&pass, self.session, &rays);
            if stats.first_pass_seconds == 0.0 && state.done > 0 {
                stats.first_pass_seconds = self.start.elapsed().as_secs_f64();
                self.cancel.has_picture(self.session.settings.time_limit);
            }
            let elapsed = start.elapsed();
            tile_time = Some(pass.tile_time(elapsed));
            size = self.next_size(&pass, elapsed, all);
        }
        stats.estimated_error = state.estimated_error();
        stats.samples = state.samples();
        stats.light_tracing = state.light_tracing.unwrap_or_default();
        self.finish(state);
        stats
    }

    /// Time left, if it is limited.
    fn remaining(&self) -> Option<Duration> {
        self.session.settings.time_limit.map(|limit| limit.saturating_sub(self.start.elapsed()))
    }

    /// Whether the render is to end, with the reason in its statistics. Time runs out only where there is a picture.
    fn ends(&self, stats: &mut Stats, has_picture: bool) -> bool {
        stats.interrupted = self.session.stop.load(Ordering::Relaxed);
        stats.time_limited = !stats.interrupted && has_picture && self.remaining().is_some_and(|left| left.is_zero());
        stats.interrupted || stats.time_limited
    }

    fn render_pass(&self, state: &mut RenderState, pass: &Pass) -> RayCounts {
        let (tiles, samples) = state.work_of(pass, self.session.settings.planned_spp());
        let render_tile = |tile: &mut FilmTile| {
            let thread = rayon::current_thread_index().unwrap_or(0);
            let mut workspace = self.workspaces[thread].lock().unwrap_or_else(PoisonError::into_inner);
            let count = samples.render_tile(&self.renderer, tile, &mut workspace);
            let rays = std::mem::take(&mut workspace.integrator.counts);
            drop(workspace);
            self.session.progress.tile_done(count);
            rays
        };
        let add = |mut a: RayCounts, b: RayCounts| {
            a.add(&b);
            a
        };
        self.pool.install(|| tiles.par_iter_mut().with_max_len(1).map(render_tile).reduce(RayCounts::default, add))
    }

    /// How long a pass may be, as far as checkpoints are due. Parts of a sample keep the processors less busy than all
    /// of it.
    fn max_pass_time(&self) -> Option<Duration> {
        self.checkpoints.as_ref().map(|checkpoints| (checkpoints.every() / 4).max(MIN_PASS_TIME))
    }

    /// The size of the pass after one that took `elapsed`; there are `all` tiles.
    fn next_size(&self, pass: &Pass, elapsed: Duration, all: usize) -> PassSize {
        let (tile_time, max) = (pass.tile_time(elapsed), self.max_pass_time());
        match max.filter(|max| tile_time.mul_f64(all as f64) > *max) {
            Some(max) => {
                let fitting = (max.as_secs_f64() / tile_time.as_secs_f64().max(1e-9)) as usize;
                PassSize { samples: 1, tiles: fitting.clamp(1, all) }
            }
            None if pass.tiles.len() < all => PassSize { samples: 1, tiles: all },
            None => {
                let limit = self.remaining().into_iter().chain(max).min();
                PassSize { samples: next_count(pass.samples.len() as u32, elapsed, limit), tiles: all }
            }
        }
    }

    /// Between two passes, the next of which is expected to take `next`: checkpoints and previews.
    fn between_passes(&mut self, state: &RenderState, next: Duration) {
        let (progress, elapsed) = (self.session.progress, self.start.elapsed());
        if let Some(checkpoints) = &mut self.checkpoints {
            self.pool.install(|| checkpoints.pass_done(state, elapsed, next, progress));
        }
        if progress.needs_picture() {
            progress.picture(&state.picture(self.session.settings), state.done);
        }
    }

    /// After the last pass.
    fn finish(&mut self, state: &mut RenderState) {
        let (progress, elapsed) = (self.session.progress, self.start.elapsed());
        if let Some(checkpoints) = self.checkpoints.as_mut().filter(|_| !state.is_uneven) {
            self.pool.install(|| checkpoints.finish(state, elapsed, progress));
        }
        state.seconds += elapsed.as_secs_f64();
        progress.finish();
    }
}

/// How many samples the next pass should have, after one of `count` took `elapsed`.
fn next_count(count: u32, elapsed: Duration, limit: Option<Duration>) -> u32 {
    let target = limit.map_or(PASS_TIME, |limit| limit.min(PASS_TIME)).as_secs_f64();
    let fitting = f64::from(count) * target / elapsed.as_secs_f64().max(1e-6);
    (fitting as u32).clamp(1, count.saturating_mul(4))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passes_grow_towards_their_time_and_fit_what_remains() {
        assert_eq!(next_count(1, Duration::from_millis(1), None), 4);
        assert_eq!(next_count(8, Duration::from_secs(8), None), 1);
        assert_eq!(next_count(8, Duration::from_millis(100), Some(Duration::from_millis(50))), 4);
    }
}
