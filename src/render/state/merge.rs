//! Shards put together: one at a time, tile by tile.

use std::path::{Path, PathBuf};

use super::container::Reader;
use super::{GuidingStage, Header, RenderState, Shard};
use crate::error::{Error, Result};
use crate::film::Film;
use crate::guiding::Guide;
use crate::integrator::RayCounts;
use crate::render::TILE_SIZE;
use crate::render::planner::Planner;

/// The picture of several shards.
#[derive(Clone, Debug)]
pub struct Merged {
    /// All samples.
    pub state: RenderState,
    /// The header of the first shard.
    pub header: Header,
    /// Which shards or samples are missing, such as `shards 1,3 of 4`; `None` if none are.
    pub partial: Option<String>,
}

/// Merges shards: the same bits as of one run with all samples. Without `partial` every shard and every sample must be
/// there. Holds one film.
///
/// # Errors
/// [`Error::Missing`] if a file cannot be read; [`Error::Checkpoint`] naming the file if one is damaged, belongs to
/// another picture, or is there twice, and naming what is missing.
pub fn merge(files: &[PathBuf], partial: bool) -> Result<Merged> {
    let first = files.first().ok_or_else(|| Error::Usage("no shards to merge".into()))?;
    let mut headers: Vec<Header> = Vec::new();
    for file in files {
        let header = Reader::peek(file)?;
        if let Some(known) = headers.first() {
            check_kinship(file, &header, first, known)?;
        }
        if let Some(place) = headers.iter().position(|other| other.shard == header.shard) {
            let message = format!("shard {} is there twice: {} has it too", header.shard, files[place].display());
            return Err(Error::Checkpoint { file: file.clone(), message });
        }
        headers.push(header);
    }
    let lack = lack(files, &headers);
    if let (Some((file, message)), false) = (&lack, partial) {
        let message = format!("{message}; --partial merges what is there");
        return Err(Error::Checkpoint { file: file.clone(), message });
    }
    let mut state = if headers[0].guiding != GuidingStage::Off {
        guided_state(first)?.0
    } else {
        let mut state = RenderState::of_film(film(&headers[0], first)?, Planner::Uniform, Shard::WHOLE);
        files.iter().try_for_each(|file| add(&mut state, file))?;
        state.light_tracing = headers[0].light_tracing;
        state
    };
    state.complete = lack.is_none();
    Ok(Merged { state, header: headers.swap_remove(0), partial: lack.map(|(_, message)| message) })
}

/// Whether two files are parts of one picture.
fn check_kinship(file: &Path, header: &Header, first: &Path, known: &Header) -> Result<()> {
    let mut differences = header.differences(known, "here", "there");
    if header.shard.count != known.shard.count {
        differences.push(format!("shards: {} here, {} there", header.shard.count, known.shard.count));
    }
    if header.spp != known.spp {
        differences.push(format!("spp: {} here, {} there", header.spp, known.spp));
    }
    if differences.is_empty() {
        return Ok(());
    }
    // What was altered is no stranger.
    Reader::open(file)?;
    Reader::open(first)?;
    let message = format!("this belongs to another picture than {}; {}", first.display(), differences.join("; "));
    Err(Error::Checkpoint { file: file.into(), message })
}

/// What is missing, with the file to be named.
fn lack(files: &[PathBuf], headers: &[Header]) -> Option<(PathBuf, String)> {
    let count = headers[0].shard.count;
    let mut there: Vec<u32> = headers.iter().map(|header| header.shard.index).collect();
    there.sort_unstable();
    let unfinished = headers.iter().zip(files).filter(|(header, _)| !header.complete);
    let samples = unfinished.clone().map(|(header, _)| {
        format!("{} of {} samples of shard {}", header.done, header.shard.samples(header.spp).len(), header.shard)
    });
    let mut parts: Vec<String> = samples.collect();
    let file = if there.len() < count as usize {
        let list = there.iter().map(u32::to_string).collect::<Vec<_>>().join(",");
        parts.insert(0, format!("shard{} {list} of {count}", if there.len() == 1 { "" } else { "s" }));
        &files[0]
    } else {
        unfinished.map(|(_, file)| file).next()?
    };
    Some((file.clone(), parts.join(", ")))
}

/// The empty film of the render of a file.
fn film(header: &Header, file: &Path) -> Result<Film> {
    Film::new(header.film.clone(), TILE_SIZE).map_err(|error| match error {
        error @ Error::OutOfMemory(_) => error,
        error => Error::Checkpoint { file: file.to_owned(), message: error.to_string() },
    })
}

/// All samples of a guided render, which is never split, and its guide.
fn guided_state(file: &Path) -> Result<(RenderState, Option<Guide>)> {
    let mut reader = Reader::open(file)?;
    let film = film(reader.header(), file)?;
    let planner = match reader.header().guiding {
        GuidingStage::Off => {
            return Err(reader.fault("it is the state of a render without guiding, and holds no guide"));
        }
        stage => Planner::guided(stage, &film)?,
    };
    let mut state = RenderState::of_film(film, planner, Shard::WHOLE);
    state.load(&mut reader)?;
    state.film = state.whole_film().into_owned();
    let guide = match std::mem::replace(&mut state.planner, Planner::Uniform) {
        Planner::Guided(planner) => planner.guide,
        _ => None,
    };
    Ok((state, guide))
}

/// The guide in the checkpoint of a guided render.
///
/// # Errors
/// [`Error::Missing`] if the file cannot be read; [`Error::Checkpoint`] if it is damaged or holds no guide.
pub(in crate::render) fn read_guide(file: &Path) -> Result<Guide> {
    guided_state(file)?.1.ok_or_else(|| Error::Checkpoint {
        file: file.to_owned(),
        message: "guiding did not pay in this render and ended: no guide; render without --guide".to_owned(),
    })
}

/// Adds the samples of a file.
fn add(state: &mut RenderState, file: &Path) -> Result<()> {
    let mut reader = Reader::open(file)?;
    if reader.header().film != *state.film.shape() {
        return Err(reader.fault("the film has other layers than that of the first file"));
    }
    for tile in state.film.tiles_mut() {
        let bytes = reader.block()?;
        let mut other = tile.empty();
        other.load(&bytes).map_err(|e| reader.fault(e))?;
        tile.merge(&other);
    }
    let [camera, indirect, shadow] = reader.header().rays;
    state.rays.add(&RayCounts { camera, indirect, shadow });
    state.done = state.done.saturating_add(reader.header().done);
    state.seconds += reader.header().render_seconds;
    Ok(())
}
