//! The state of a render: the content of checkpoints and shards, which merging sums.
//!
//! Films hold sums that do not depend on the order of their terms, and a sample depends on nothing but its pixel and
//! its index. So a render that goes on from a state, and films of any parts of the samples put together, give the
//! picture of one run bit for bit.

mod checkpoints;
mod container;
mod file;
mod header;
mod merge;

pub use checkpoints::Checkpoints;
pub use file::StateFile;
pub(super) use header::put;
pub use header::{GuidingStage, Header, Shard};
pub(super) use merge::read_guide;
pub use merge::{Merged, merge};

use std::io::{self, Write};
use std::ops::Range;
use std::path::Path;

use rayon::prelude::*;

use super::planner::Planner;
use super::settings::refused;
use super::{LightTracing, Settings, TILE_SIZE};
use crate::error::Result;
use crate::film::{Film, FilmTile, Image};
use crate::integrator::RayCounts;
use crate::scene::Scene;
use container::{Reader, Writer};

/// Tiles that are turned into bytes side by side.
const TILES_AT_ONCE: usize = 64;

/// How far a render is.
#[derive(Clone, Debug)]
pub struct RenderState {
    /// All samples so far; of guided renders those that have a weight, and [`whole_film`](Self::whole_film) has the
    /// others, too.
    pub film: Film,
    /// Which samples belong to it.
    pub shard: Shard,
    /// How many of these every pixel has; with a target error their mean, rounded.
    pub done: u32,
    /// How many tiles, the first of the film, have one sample more.
    pub tiles_in_partial_pass: usize,
    /// Whether a pass was cancelled: some tiles have samples that others lack, which no file can represent. The picture
    /// is whole.
    pub is_uneven: bool,
    /// Whether no sample is missing.
    pub complete: bool,
    /// What is traced from the lights; `None` before that is decided.
    pub(super) light_tracing: Option<LightTracing>,
    /// What decides on the samples that are missing.
    pub(super) planner: Planner,
    /// Rays so far.
    pub rays: RayCounts,
    /// Wall-clock seconds of rendering so far.
    pub seconds: f64,
}

impl RenderState {
    /// Of a render that begins.
    ///
    /// # Errors
    /// As [`Film::new`].
    pub fn new(scene: &Scene, settings: &Settings, shard: Shard) -> Result<Self> {
        let film = Film::new(super::film_shape(scene, settings), TILE_SIZE)?;
        let planner = Planner::new(settings, &film, shard)?;
        Ok(Self::of_film(film, planner, shard))
    }

    /// Without samples.
    fn of_film(film: Film, planner: Planner, shard: Shard) -> Self {
        let rays = RayCounts::default();
        Self {
            film,
            shard,
            done: 0,
            tiles_in_partial_pass: 0,
            is_uneven: false,
            complete: false,
            light_tracing: None,
            planner,
            rays,
            seconds: 0.0,
        }
    }

    /// Continues from the state in a file.
    ///
    /// # Errors
    /// [`Error::Missing`](crate::Error::Missing) if it cannot be read, [`Error::Checkpoint`](crate::Error::Checkpoint)
    /// if it is damaged or belongs to another picture than `header`.
    pub fn read(path: &Path, header: &Header, scene: &Scene, settings: &Settings) -> Result<Self> {
        let mut reader = Reader::open(path)?;
        fits(&reader, header)?;
        let film = Film::new(super::film_shape(scene, settings), TILE_SIZE)?;
        if reader.header().film != *film.shape() {
            return Err(reader.fault("the film has other layers"));
        }
        let stage = reader.header().guiding;
        if !settings.allows_stage(stage) {
            return Err(reader.fault("whether its paths are guided does not fit its settings"));
        }
        let planner = match stage {
            GuidingStage::Off if settings.target_error.is_none() => Planner::Uniform,
            GuidingStage::Off => Planner::new(settings, &film, header.shard)?,
            stage => Planner::guided(stage, &film)?,
        };
        let mut state = Self::of_film(film, planner, header.shard);
        state.load(&mut reader)?;
        Ok(state)
    }

    /// Replaces a state of the same shape and planner by that in a file.
    fn load(&mut self, reader: &mut Reader) -> Result<()> {
        (self.done, self.complete) = (reader.header().done, reader.header().complete);
        self.light_tracing = reader.header().light_tracing;
        self.tiles_in_partial_pass = (reader.header().tiles_in_partial_pass as usize).min(self.film.tiles().len() - 1);
        self.rays = rays(reader.header().rays);
        self.seconds = reader.header().render_seconds;
        read_tiles(reader, &mut self.film)?;
        match &mut self.planner {
            Planner::Uniform => {}
            Planner::Pilot(planner) => {
                let bytes = reader.block()?;
                planner.load(&bytes).ok_or_else(|| reader.fault("the guide is not what was saved of it"))?;
            }
            Planner::Adaptive(planner) => {
                let bytes = reader.block()?;
                planner.load(&bytes).ok_or_else(|| reader.fault("the blocks of pixels are others"))?;
            }
            Planner::Guided(planner) => {
                read_tiles(reader, &mut planner.iteration)?;
                let bytes = reader.block()?;
                planner.load(&bytes, self.done).ok_or_else(|| reader.fault("the guide is not what was saved of it"))?;
            }
        }
        reader.finish()
    }

    /// Writes the state; `header` is that of the render.
    ///
    /// # Errors
    /// The system's.
    pub fn write(&self, header: &Header, out: impl Write) -> io::Result<()> {
        self.write_with(header, self.seconds, out)
    }

    /// As [`write`](Self::write), after `seconds` of rendering.
    fn write_with(&self, header: &Header, render_seconds: f64, out: impl Write) -> io::Result<()> {
        let RayCounts { camera, indirect, shadow } = self.rays;
        let header = Header {
            done: self.done,
            tiles_in_partial_pass: self.tiles_in_partial_pass as u64,
            complete: self.complete,
            light_tracing: self.light_tracing,
            guiding: self.planner.guiding(),
            film: self.film.shape().clone(),
            rays: [camera, indirect, shadow],
            render_seconds,
            ..header.clone()
        };
        let mut writer = Writer::new(out, &header)?;
        write_tiles(&mut writer, &self.film)?;
        match &self.planner {
            Planner::Uniform => {}
            Planner::Pilot(planner) => writer.block(&planner.save())?,
            Planner::Adaptive(planner) => writer.block(&planner.save())?,
            Planner::Guided(planner) => {
                write_tiles(&mut writer, &planner.iteration)?;
                writer.block(&planner.save())?;
            }
        }
        writer.finish()
    }

    /// The picture so far.
    pub fn picture(&self, settings: &Settings) -> Image {
        super::picture(&self.whole_film(), settings.layers, settings.overscan)
    }

    /// Sets what is traced from the lights; if anything is, nothing guides paths.
    pub(super) fn set_light_tracing(&mut self, light_tracing: LightTracing) {
        self.light_tracing = Some(light_tracing);
        if light_tracing != LightTracing::Off && matches!(self.planner, Planner::Pilot(_)) {
            self.planner = Planner::Uniform;
        }
    }

    /// The indices of the samples that every pixel is still to get.
    pub fn missing(&self, spp: u32) -> Range<u32> {
        let all = self.shard.samples(spp);
        all.start + self.done..all.end
    }
}

fn write_tiles<W: Write>(writer: &mut Writer<W>, film: &Film) -> io::Result<()> {
    for tiles in film.tiles().chunks(TILES_AT_ONCE) {
        let blocks: Vec<Vec<u8>> = tiles.par_iter().map(FilmTile::save).collect();
        blocks.iter().try_for_each(|block| writer.block(block))?;
    }
    Ok(())
}

fn read_tiles(reader: &mut Reader, film: &mut Film) -> Result<()> {
    for tile in film.tiles_mut() {
        let bytes = reader.block()?;
        tile.load(&bytes).map_err(|e| reader.fault(e))?;
    }
    Ok(())
}

fn rays([camera, indirect, shadow]: [u64; 3]) -> RayCounts {
    RayCounts { camera, indirect, shadow }
}

/// Whether the state in a file can be continued to what `requested` describes.
fn fits(reader: &Reader, requested: &Header) -> Result<()> {
    let there = reader.header();
    let mut differences = there.differences(requested, "in the checkpoint", "requested");
    if there.shard != requested.shard {
        differences.push(format!("shard: {} in the checkpoint, {} requested", there.shard, requested.shard));
    } else if there.shard != Shard::WHOLE && there.spp != requested.spp {
        // Other samples would belong to it.
        differences.push(format!(
            "spp: {} in the checkpoint, {} requested, and shards are parts of a fixed number",
            there.spp, requested.spp
        ));
    } else if there.done + u32::from(there.tiles_in_partial_pass > 0) > requested.spp {
        differences.push(format!("spp: pixels have {} samples already, {} requested", there.done, requested.spp));
    }
    if differences.is_empty() {
        return Ok(());
    }
    Err(reader.fault(format!("this is the state of another render; {}", differences.join("; "))))
}

/// Whether the state of a render can be kept, and the render be split.
///
/// # Errors
/// [`Error::Setting`](crate::Error::Setting) if not.
pub fn check_resumable(settings: &Settings, shard: Shard) -> Result<()> {
    if shard != Shard::WHOLE && settings.is_guided() {
        return Err(refused(
            "shard",
            ": not with guiding, for paths learn from nearly all samples before, which each part would render; \
             give `guiding` off, or `guide` with the checkpoint of a guided render",
        ));
    }
    if shard != Shard::WHOLE && settings.target_error.is_some() {
        return Err(refused(
            "shard",
            ": not with `target_error`, for each part would need the others' samples; give `spp`",
        ));
    }
    if shard.samples(settings.spp).is_empty() {
        return Err(refused(
            "shard",
            format!(" {shard}: there are only {} samples per pixel to share out", settings.spp),
        ));
    }
    Ok(())
}
