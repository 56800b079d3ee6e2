//! OpenVDB and NanoVDB files: one of their grids as the voxels of its active bounding box.

mod blosc;
mod codec;
mod cursor;
mod dense;
mod list;
mod nano;
mod nano_tree;
mod open;
mod open_tree;

use std::path::Path;

pub use list::GridChoice;

use super::{AssetError, VolumeData};
use crate::math::{DAffine3, DVec3};
use cursor::Source;
use dense::Dense;
use list::Listed;

/// What files of OpenVDB and NanoVDB begin with.
pub const VDB_MAGICS: [[u8; 8]; 4] = [open::MAGIC, nano::MAGICS[0], nano::MAGICS[1], nano::MAGICS[2]];

/// Why signed distances are not read.
const LEVEL_SET: &str = "is a level set, distances from a surface: convert it to a fog volume";

/// A grid as a box of voxels: those of its active bounding box, and around them one voxel of its background.
#[derive(Clone, Debug, PartialEq)]
pub struct VdbGrid {
    /// Its name in the file.
    pub name: String,
    /// The voxels.
    pub voxels: VolumeData,
    /// Index coordinates of the first one.
    pub origin: [i64; 3],
    /// The world by numbers of voxels: from 0 at the first face of the first voxel, whose middle is at 0.5, to the
    /// resolution.
    pub world_from_voxels: DAffine3,
}

impl VdbGrid {
    fn new(name: String, channels: usize, dense: Dense, world_from_index: &DAffine3) -> Result<Self, String> {
        // Whole index coordinates are the middles of voxels.
        let first = DVec3::from(dense.origin.map(|x| x as f64)) - 0.5;
        let voxels = VolumeData::new(dense.size.map(|edge| edge as u32), channels as u32, dense.values)?;
        Ok(Self {
            name,
            voxels,
            origin: dense.origin,
            world_from_voxels: *world_from_index * DAffine3::from_translation(first),
        })
    }
}

/// Reads a grid of an OpenVDB or NanoVDB file, whichever it is.
///
/// # Errors
/// [`AssetError`] if the file cannot be read, is damaged or of a version or type that is not supported, has no such
/// grid, or if its voxels take more memory than there is.
pub fn read_vdb(path: &Path, choice: GridChoice) -> Result<VdbGrid, AssetError> {
    read_vdb_within(path, choice, usize::MAX)
}

/// As [`read_vdb`], but voxels of more than `most_bytes` are an error.
///
/// # Errors
/// As [`read_vdb`].
pub fn read_vdb_within(path: &Path, choice: GridChoice, most_bytes: usize) -> Result<VdbGrid, AssetError> {
    let mut source = Source::open(path).map_err(|e| AssetError::missing(path, &e))?;
    read(&mut source, choice, most_bytes).map_err(AssetError::Malformed)
}

/// The names of the grids of an OpenVDB or NanoVDB file, each with the type of its values.
///
/// # Errors
/// [`AssetError`] if the file cannot be read, or is damaged or of a version that is not supported.
pub fn list_vdb(path: &Path) -> Result<Vec<(String, String)>, AssetError> {
    let mut source = Source::open(path).map_err(|e| AssetError::missing(path, &e))?;
    let listed = match format(&mut source).map_err(AssetError::Malformed)? {
        Format::Open => open::list(&mut source),
        Format::Nano => nano::list(&mut source),
    };
    let named = |Listed { unique, kind, .. }| (unique, kind);
    listed.map(|grids| grids.into_iter().map(named).collect()).map_err(AssetError::Malformed)
}

enum Format {
    Open,
    Nano,
}

fn format(source: &mut Source) -> Result<Format, String> {
    let start = source.range(0, source.length().min(8))?;
    if start == open::MAGIC {
        Ok(Format::Open)
    } else if nano::MAGICS.iter().any(|magic| start == magic) {
        Ok(Format::Nano)
    } else {
        Err("this is neither an OpenVDB nor a NanoVDB file".into())
    }
}

fn read(source: &mut Source, choice: GridChoice, most_bytes: usize) -> Result<VdbGrid, String> {
    match format(source)? {
        Format::Open => open::read(source, choice, most_bytes),
        Format::Nano => nano::read(source, choice, most_bytes),
    }
}

/// Refuses transforms that have no inverse.
fn check_transform(map: &DAffine3) -> Result<(), String> {
    let determinant = map.matrix3.determinant();
    if determinant != 0.0 && map.is_finite() && map.inverse().is_finite() {
        Ok(())
    } else {
        Err("has a transform that flattens it or is not finite".into())
    }
}
