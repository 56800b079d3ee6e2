//! Which samples the passes of a render have: as many of every pixel, more where the error is large, or guided by the
//! samples before.

mod adaptive;
mod guided;
mod iteration_weights;
mod pilot;
mod training_schedule;

pub(super) use adaptive::AdaptivePlanner;
pub(super) use guided::GuidedPlanner;
pub(super) use pilot::PilotPlanner;
pub(super) use training_schedule::GUIDED_START;

use std::borrow::Cow;
use std::ops::Range;
use std::sync::Mutex;
use std::time::Duration;

use super::guiding_pilot::{GuidingPilot, may_pay};
use super::tile_renderer::{TileRenderer, TileWorkspace};
use super::{GuidingStage, LightTracing, RenderSession, RenderState, Settings, Shard};
use crate::error::Result;
use crate::film::{DroppedSample, Film, FilmTile};
use crate::integrator::{EPOCH, Guidance, RayCounts};
use pilot::LEARNED;

/// A pass over tiles of the film.
#[derive(Clone, Debug)]
pub(super) struct Pass {
    /// Indices of the samples that pixels get; with a target error, the groups of samples that blocks still lack, from
    /// 0.
    pub samples: Range<u32>,
    /// All tiles, or some that get a single sample.
    pub tiles: Range<usize>,
}

impl Pass {
    /// The time of one sample of one tile, if the pass took `elapsed`.
    pub fn tile_time(&self, elapsed: Duration) -> Duration {
        elapsed.div_f64(self.samples.len() as f64 * self.tiles.len() as f64)
    }

    /// The time that the pass is expected to take.
    pub fn duration(&self, tile_time: Duration) -> Duration {
        tile_time.mul_f64(self.samples.len() as f64 * self.tiles.len() as f64)
    }
}

/// How large a pass may be: a number of samples of all tiles, or one sample of some.
#[derive(Clone, Copy, Debug)]
pub(super) struct PassSize {
    pub samples: u32,
    pub tiles: usize,
}

/// The samples of a pass.
pub(super) enum PassSamples<'a> {
    /// The same of every pixel.
    Uniform { samples: Range<u32>, guidance: Guidance<'a> },
    /// Groups of samples, of the blocks of pixels that need more; at most this number of each.
    Groups { planner: &'a AdaptivePlanner, most: u32 },
}

impl PassSamples<'_> {
    /// Renders those of a tile; the result is how many they are.
    pub fn render_tile(&self, renderer: &TileRenderer, tile: &mut FilmTile, workspace: &mut TileWorkspace) -> u64 {
        match self {
            Self::Uniform { samples, guidance } => renderer.render_tile(tile, samples.clone(), *guidance, workspace),
            Self::Groups { planner, most } => planner.render_tile(renderer, tile, *most, workspace),
        }
    }
}

/// What decides on the samples of passes, with the part of a render's state that only it needs.
#[derive(Clone, Debug)]
pub(super) enum Planner {
    /// Every pixel gets the samples of the shard.
    Uniform,
    Adaptive(AdaptivePlanner),
    Guided(Box<GuidedPlanner>),
    /// Whether paths are guided is still to be decided.
    Pilot(Box<PilotPlanner>),
}

impl Planner {
    /// Of a render that begins; the film is its own.
    pub fn new(settings: &Settings, film: &Film, shard: Shard) -> Result<Self> {
        Ok(match settings.target_error {
            Some(target) => Self::Adaptive(AdaptivePlanner::new(film.sampled(), target)),
            None if settings.is_guided() => Self::Guided(Box::new(GuidedPlanner::new(film)?)),
            None if shard == Shard::WHOLE && settings.has_guiding_pilot() => Self::Pilot(Box::new(PilotPlanner::new())),
            None => Self::Uniform,
        })
    }
}

impl Planner {
    /// Of a render that goes on where paths are guided or may be.
    pub fn guided(stage: GuidingStage, film: &Film) -> Result<Self> {
        Ok(match stage {
            GuidingStage::Off => Self::Uniform,
            GuidingStage::Pilot => Self::Pilot(Box::new(PilotPlanner::new())),
            GuidingStage::On => Self::Guided(Box::new(GuidedPlanner::new(film)?)),
        })
    }

    /// Whether paths are guided.
    pub fn guiding(&self) -> GuidingStage {
        match self {
            Self::Uniform | Self::Adaptive(_) => GuidingStage::Off,
            Self::Pilot(_) => GuidingStage::Pilot,
            Self::Guided(_) => GuidingStage::On,
        }
    }
}

impl RenderState {
    /// Before the first pass.
    pub(super) fn start(&mut self, session: &RenderSession) {
        self.complete = false;
        let RenderSession { settings, progress, .. } = *session;
        let pixels = self.film.sampled().area();
        match &mut self.planner {
            Planner::Adaptive(planner) => return planner.start(&self.film, progress),
            Planner::Guided(planner) => {
                planner.guide.iter_mut().for_each(|guide| guide.set_bounds(session.accel.bounds()));
            }
            Planner::Pilot(planner) => planner.guide.set_bounds(session.accel.bounds()),
            Planner::Uniform => {}
        }
        progress.start(self.shard.samples(settings.spp).len() as u32, pixels);
        progress.resumed(pixels * u64::from(self.done));
    }

    /// The next pass, not larger than `size`; `None` if no sample is missing.
    pub(super) fn next_pass(&mut self, session: &RenderSession, size: PassSize) -> Option<Pass> {
        let RenderSession { settings: &Settings { spp, .. }, progress, .. } = *session;
        let (missing, all) = (self.missing(spp), self.film.tiles().len());
        let most = match &mut self.planner {
            Planner::Adaptive(planner) => {
                let is_missing = planner.plan(&self.film, spp, progress);
                return is_missing.then_some(Pass { samples: 0..size.samples, tiles: 0..all });
            }
            Planner::Guided(planner) => planner.samples_with_this_guide(self.done),
            Planner::Pilot(_) => PilotPlanner::samples_with_this_guide(self.done),
            // Of one epoch of photons or light paths.
            Planner::Uniform if self.light_tracing.is_some_and(|what| what != LightTracing::Off) => {
                EPOCH - missing.start % EPOCH
            }
            Planner::Uniform => u32::MAX,
        };
        let tiles = self.tiles_in_partial_pass..(self.tiles_in_partial_pass + size.tiles).min(all);
        let count = if tiles.len() == all { size.samples.min(most).min(missing.len() as u32) } else { 1 };
        (!missing.is_empty()).then_some(Pass { samples: missing.start..missing.start + count, tiles })
    }

    /// The tiles of a pass, and what they get.
    pub(super) fn work_of(&mut self, pass: &Pass, spp: u32) -> (&mut [FilmTile], PassSamples<'_>) {
        let samples = pass.samples.clone();
        let (film, samples) = match &mut self.planner {
            Planner::Uniform => (&mut self.film, PassSamples::Uniform { samples, guidance: Guidance::default() }),
            Planner::Pilot(planner) => {
                let guidance = Guidance { learner: Some(&planner.guide), ..Guidance::default() };
                (&mut self.film, PassSamples::Uniform { samples, guidance })
            }
            Planner::Adaptive(planner) => (&mut self.film, PassSamples::Groups { planner, most: samples.end }),
            Planner::Guided(planner) => {
                let (learns, guides) = (planner.learns(samples.start, spp), planner.guides(samples.start));
                let [learner, guide] = [learns, guides].map(|is_used| planner.guide.as_ref().filter(|_| is_used));
                (
                    &mut planner.iteration,
                    PassSamples::Uniform { samples, guidance: Guidance { guide, learner, has_moments: false } },
                )
            }
        };
        (&mut film.tiles_mut()[pass.tiles.clone()], samples)
    }

    /// A pass was rendered.
    pub(super) fn complete_pass(&mut self, pass: &Pass, session: &RenderSession, rays: &RayCounts) {
        if let Planner::Adaptive(planner) = &mut self.planner {
            self.done = planner.complete_pass(&self.film, pass.samples.end);
            return;
        }
        let all = self.film.tiles().len();
        self.tiles_in_partial_pass = pass.tiles.end % all;
        self.done += if pass.tiles.end == all { pass.samples.len() as u32 } else { 0 };
        match &mut self.planner {
            Planner::Guided(planner) => {
                planner.rays = planner.rays.saturating_add(rays.total());
                if self.tiles_in_partial_pass == 0 {
                    planner.complete_samples(&mut self.film, self.done, session.settings.planned_spp());
                }
            }
            Planner::Pilot(planner) if self.tiles_in_partial_pass == 0 => planner.complete_samples(self.done),
            _ => {}
        }
        if matches!(&self.planner, Planner::Guided(planner) if planner.is_over()) {
            self.planner = Planner::Uniform;
        }
    }

    /// Traces what is due of the pilot of guiding, and decides on guiding after it; the result is the rays traced.
    pub(super) fn run_guiding_pilot(
        &mut self,
        renderer: &TileRenderer,
        workspaces: &[Mutex<TileWorkspace>],
    ) -> RayCounts {
        let pilot = GuidingPilot { renderer, workspaces, crop: self.film.grid().crop };
        let Planner::Pilot(planner) = &mut self.planner else { return RayCounts::default() };
        if !planner.has_begun() {
            let unguided = pilot.unguided();
            let counts = unguided.counts;
            if !renderer.context.is_cancelled() {
                planner.begin(&unguided);
                // Where the pilot is black there is nothing to learn.
                if !planner.has_begun() {
                    self.planner = Planner::Uniform;
                }
            }
            return counts;
        }
        if self.done < LEARNED || renderer.context.is_cancelled() {
            return RayCounts::default();
        }
        let guided = pilot.guided(&planner.guide);
        if renderer.context.is_cancelled() {
            return RayCounts::default();
        }
        let gain = guided.gain(0.0);
        tracing::info!("pilot of guiding: {gain:?}");
        let is_likely = gain.is_some_and(may_pay);
        // Without memory for the samples of an iteration the picture is not guided.
        let next = if is_likely { GuidedPlanner::trained(&self.film, planner.take_guide(), self.done) } else { None };
        self.planner = next.map_or(Planner::Uniform, |planner| Planner::Guided(Box::new(planner)));
        guided.counts
    }

    /// The pass under way was cancelled: tiles differ in their samples.
    pub(super) fn cancel_pass(&mut self) {
        self.is_uneven = true;
        if let Planner::Guided(planner) = &mut self.planner {
            // The guide has learned from only some of the samples, and their weights are unknown.
            (self.done, self.tiles_in_partial_pass) = (planner.discard_iteration(), 0);
        }
    }

    /// Whether the render may end before the next pass: every pixel has as many samples, or with a target error enough
    /// of them.
    pub(super) fn can_end(&self) -> bool {
        match &self.planner {
            Planner::Adaptive(planner) => planner.has_pilot(),
            Planner::Uniform | Planner::Guided(_) | Planner::Pilot(_) => self.tiles_in_partial_pass == 0,
        }
    }

    /// With a target error, the picture's relative squared error.
    pub(super) fn estimated_error(&self) -> Option<f64> {
        match &self.planner {
            Planner::Adaptive(planner) if !self.is_uneven => Some(planner.estimated_error(&self.film)),
            _ => None,
        }
    }

    /// Samples of the picture's pixels.
    pub(super) fn samples(&self) -> u64 {
        match &self.planner {
            Planner::Adaptive(_) => self.film.samples(),
            Planner::Uniform | Planner::Guided(_) | Planner::Pilot(_) => {
                self.film.grid().crop.area() * u64::from(self.done)
            }
        }
    }

    /// How many samples were dropped, and the first few of them.
    pub(super) fn dropped(&self) -> (u64, Vec<DroppedSample>) {
        let film = self.whole_film();
        (film.dropped_count(), film.dropped())
    }

    /// The film with all samples.
    pub fn whole_film(&self) -> Cow<'_, Film> {
        match &self.planner {
            Planner::Guided(planner) if self.done > planner.merged || self.tiles_in_partial_pass > 0 => {
                Cow::Owned(planner.whole_film(&self.film, self.done))
            }
            _ => Cow::Borrowed(&self.film),
        }
    }
}
