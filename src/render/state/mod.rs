//! The state of a render: what a checkpoint keeps, a shard brings, and a merge puts together.
//!
//! Films hold sums that do not depend on the order of their terms, and a sample depends on nothing but its pixel and its index. So a render that
//! goes on from a state, and films of any parts of the samples put together, give the picture of one run bit for bit.

mod checkpoints;
mod container;
mod file;
mod header;
mod merge;

pub use checkpoints::Checkpoints;
pub use file::StateFile;
pub(super) use header::put;
pub use header::{Header, Shard};
pub use merge::{Merged, merge};

use std::io::{self, Write};
use std::ops::Range;
use std::path::Path;

use rayon::prelude::*;

use super::adaptive::Blocks;
use super::{Settings, TILE_SIZE};
use crate::error::{Error, Result};
use crate::film::{Film, FilmTile, Image};
use crate::integrator::RayCounts;
use crate::scene::Scene;
use container::{Reader, Writer};

/// Tiles that are turned into bytes side by side.
const TILES_AT_ONCE: usize = 64;

/// How far a render is.
#[derive(Clone, Debug)]
pub struct RenderState {
    /// All samples so far.
    pub film: Film,
    /// Which samples belong to it.
    pub shard: Shard,
    /// How many of these every pixel has; with a target error their mean, rounded.
    pub done: u32,
    /// How many tiles, the first of the film, have one sample more.
    pub tiles_ahead: usize,
    /// Whether a pass was given up: some tiles have samples that others lack, which no file can say. The picture is whole.
    pub torn: bool,
    /// Whether no sample is missing.
    pub complete: bool,
    /// With a target error, what every block of pixels has and is to get.
    pub(super) blocks: Option<Blocks>,
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
        let blocks = settings.target_error.map(|_| Blocks::new(film.sampled()));
        Ok(Self { film, shard, done: 0, tiles_ahead: 0, torn: false, complete: false, blocks, rays: RayCounts::default(), seconds: 0.0 })
    }

    /// Continues from the state in a file.
    ///
    /// # Errors
    /// [`Error::Missing`] if it cannot be read, [`Error::Checkpoint`] if it is damaged or
    /// belongs to another picture than `header`.
    pub fn read(path: &Path, header: &Header, scene: &Scene, settings: &Settings) -> Result<Self> {
        let mut reader = Reader::open(path)?;
        fits(&reader, header)?;
        let mut state = Self::new(scene, settings, header.shard)?;
        if reader.header().film != *state.film.shape() {
            return Err(reader.fault("the film has other layers"));
        }
        (state.done, state.complete) = (reader.header().done, reader.header().complete);
        state.tiles_ahead = (reader.header().tiles_ahead as usize).min(state.film.tiles().len() - 1);
        state.rays = rays(reader.header().rays);
        state.seconds = reader.header().render_seconds;
        for tile in state.film.tiles_mut() {
            let bytes = reader.block()?;
            tile.load(&bytes).map_err(|e| reader.fault(e))?;
        }
        if let Some(blocks) = &mut state.blocks {
            let bytes = reader.block()?;
            blocks.load(&bytes).ok_or_else(|| reader.fault("the blocks of pixels are others"))?;
        }
        reader.finish()?;
        Ok(state)
    }

    /// Writes the state; `header` is that of the render.
    ///
    /// # Errors
    /// The system's.
    pub fn write(&self, header: &Header, out: impl Write) -> io::Result<()> {
        self.write_with(header, self.seconds, out)
    }

    /// As [`write`](Self::write), after so many seconds of rendering.
    fn write_with(&self, header: &Header, render_seconds: f64, out: impl Write) -> io::Result<()> {
        let RayCounts { camera, indirect, shadow } = self.rays;
        let header = Header {
            done: self.done,
            tiles_ahead: self.tiles_ahead as u64,
            complete: self.complete,
            film: self.film.shape().clone(),
            rays: [camera, indirect, shadow],
            render_seconds,
            ..header.clone()
        };
        let mut writer = Writer::new(out, &header)?;
        for tiles in self.film.tiles().chunks(TILES_AT_ONCE) {
            let blocks: Vec<Vec<u8>> = tiles.par_iter().map(FilmTile::save).collect();
            blocks.iter().try_for_each(|block| writer.block(block))?;
        }
        if let Some(blocks) = &self.blocks {
            writer.block(&blocks.save())?;
        }
        writer.finish()
    }

    /// The picture so far.
    pub fn picture(&self, settings: &Settings) -> Image {
        super::picture(&self.film, settings.layers, settings.overscan)
    }

    /// The indices of the samples that every pixel is still to get.
    pub fn missing(&self, spp: u32) -> Range<u32> {
        let all = self.shard.samples(spp);
        all.start + self.done..all.end
    }
}

fn rays([camera, indirect, shadow]: [u64; 3]) -> RayCounts {
    RayCounts { camera, indirect, shadow }
}

/// Whether the state in a file can be continued to what `wanted` describes.
fn fits(reader: &Reader, wanted: &Header) -> Result<()> {
    let there = reader.header();
    let mut differences = there.differences(wanted, "in the checkpoint", "asked for");
    if there.shard != wanted.shard {
        differences.push(format!("shard: {} in the checkpoint, {} asked for", there.shard, wanted.shard));
    } else if there.shard != Shard::WHOLE && there.spp != wanted.spp {
        // Other samples would belong to it.
        differences.push(format!("spp: {} in the checkpoint, {} asked for, and shards are parts of a fixed number", there.spp, wanted.spp));
    } else if there.done + u32::from(there.tiles_ahead > 0) > wanted.spp {
        differences.push(format!("spp: pixels have {} samples already, {} asked for", there.done, wanted.spp));
    }
    if differences.is_empty() {
        return Ok(());
    }
    Err(reader.fault(format!("this is the state of another render; {}", differences.join("; "))))
}

/// Whether the state of a render can be kept, and the render be split.
///
/// # Errors
/// [`Error::Usage`] naming the option if not.
pub fn check_kept(settings: &Settings, shard: Shard) -> Result<()> {
    let option = if shard == Shard::WHOLE { "--checkpoint" } else { "--shard" };
    if settings.is_guided() {
        let message = "not with guiding, for paths depend on all that were before; give --guiding off";
        return Err(Error::Usage(format!("{option}: {message}")));
    }
    if shard != Shard::WHOLE && settings.target_error.is_some() {
        return Err(Error::Usage(
            "--shard: not with --target-error, for each part would need to know the others' samples; give --spp".into(),
        ));
    }
    if shard.samples(settings.spp).is_empty() {
        return Err(Error::Usage(format!("--shard {shard}: there are only {} samples per pixel to share out", settings.spp)));
    }
    Ok(())
}
