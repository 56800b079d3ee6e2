//! What differs within media: grids from files, values or noise.

use std::collections::BTreeMap;
use std::path::Path;

use super::CompileContext;
use super::media::MAX_COEFFICIENT;
use super::volume_places::Placement;
use crate::assets::{AssetError, GridChoice, VolumeData, read_raw_volume, read_vol};
use crate::color::Rgb;
use crate::desc::{BorderDesc, MediumVolumeDesc, VolumeDesc};
use crate::error::Result;
use crate::math::DAffine3;
use crate::medium::{Border, ExtinctionSplit, Medium, Noise, Volume, VolumeGrids, Voxel, VoxelGrid};
use crate::memory::is_available;

/// The largest temperature, in kelvin.
const MAX_TEMPERATURE: f32 = 1e5;

/// The most voxels of noise.
const MAX_NOISE: u64 = 1 << 27;

/// What differs within `medium`.
pub(super) fn volume(files: &CompileContext, path: &str, desc: &MediumVolumeDesc, medium: &Medium) -> Result<Volume> {
    let MediumVolumeDesc { density, albedo, absorption, scattering, emission, .. } = desc;
    if albedo.is_some() && (absorption.is_some() || scattering.is_some()) {
        let message = "cannot be given together with `absorption` or `scattering`";
        return Err(files.error(&format!("{path}.albedo"), message));
    }
    let brightest = |rgb: Rgb| if rgb.is_black() { f32::MAX } else { MAX_COEFFICIENT / rgb.max_channel() };
    let limit = brightest(medium.extinction()).min(brightest(medium.emission));
    let mut parts = BTreeMap::new();
    for (key, desc, limit) in [
        ("density", density, limit),
        ("albedo", albedo, 1.0),
        ("absorption", absorption, limit),
        ("scattering", scattering, limit),
        ("emission", emission, limit),
    ] {
        if let Some(desc) = desc {
            parts.insert(key, Part::read(files, format!("{path}.{key}"), key, desc, limit)?);
        }
    }
    parts.extend(temperature(files, path, desc, medium)?.map(|part| ("temperature", part)));
    let place = Placement::new(files, path, desc, parts.values())?;
    let mut take = |key: &str| parts.remove(key);
    let numbers = |part: Option<Part>| part.map(|part| part.numbers(files, &place)).transpose();
    let colors = |part: Option<Part>| part.map(|part| part.colors(files, &place)).transpose();
    let (density, temperature) = (numbers(take("density"))?, numbers(take("temperature"))?);
    let [albedo, absorption, scattering, emission] =
        [take("albedo"), take("absorption"), take("scattering"), take("emission")].map(colors);
    let split = match (albedo?, absorption?, scattering?) {
        (Some(albedo), ..) => ExtinctionSplit::Albedo(albedo),
        (None, None, None) => ExtinctionSplit::Even,
        (None, absorption, scattering) => ExtinctionSplit::Factors { absorption, scattering },
    };
    let grids = VolumeGrids { density, split, emission: emission?, temperature };
    Ok(Volume::new(medium, grids, &place.world_from_unit))
}

/// The temperature in kelvin.
fn temperature(files: &CompileContext, path: &str, desc: &MediumVolumeDesc, medium: &Medium) -> Result<Option<Part>> {
    let MediumVolumeDesc { temperature, temperature_scale, .. } = desc;
    let (path, scale_path) = (format!("{path}.temperature"), format!("{path}.temperature_scale"));
    let scale = temperature_scale.unwrap_or(1.0);
    files.positive(&scale_path, f64::from(scale))?;
    let Some(desc) = temperature else {
        return match temperature_scale {
            Some(_) => Err(files.error(&scale_path, "is a factor on `temperature`, which is not given")),
            None => Ok(None),
        };
    };
    if medium.emission.is_black() {
        return Err(files.error(&path, "needs `emission` of the medium: 1 for the radiance of black bodies"));
    }
    let mut part = Part::read(files, path, "temperature", desc, (MAX_TEMPERATURE / scale).min(f32::MAX))?;
    part.data.values.iter_mut().for_each(|value| *value *= scale);
    Ok(Some(part))
}

/// The voxels of one key.
pub(super) struct Part {
    pub path: String,
    pub data: VolumeData,
    pub border: Border,
    /// Where the file places them, if it does: the world by numbers of voxels, from 0 to the resolution.
    pub world_from_voxels: Option<DAffine3>,
}

impl Part {
    /// Values from 0 to `limit`.
    fn read(files: &CompileContext, path: String, key: &str, desc: &VolumeDesc, limit: f32) -> Result<Self> {
        match desc {
            VolumeDesc::Grid { file: Some(file), values: None, grid, .. } if is_vdb(files, file) => {
                Self::read_vdb(files, path, desc, file, GridChoice { name: grid.as_deref(), default: key })?.checked(
                    files,
                    Some(file),
                    limit,
                )
            }
            VolumeDesc::Grid { grid: Some(_), .. } => {
                Err(files.error(&format!("{path}.grid"), "is the name of a grid of a .vdb or .nvdb file"))
            }
            VolumeDesc::Grid { file, values, resolution, channels, border, grid: None } => {
                let border = match border {
                    BorderDesc::Clamp => Border::Clamp,
                    BorderDesc::Zero => Border::Zero,
                };
                let data = match (file, values) {
                    (Some(file), None) => read_file(files, &path, file, *resolution, *channels)?,
                    (None, Some(values)) => {
                        let resolution = required(files, &path, *resolution)?;
                        VolumeData::new(resolution, channels.unwrap_or(1), values.clone())
                            .map_err(|message| files.error(&path, message))?
                    }
                    _ => return Err(files.error(&path, "give either `file` or `values`")),
                };
                Self { path, data, border, world_from_voxels: None }.checked(files, file.as_deref(), limit)
            }
            VolumeDesc::Noise { .. } => {
                let noise = noise(files, &path, desc)?;
                let data = VolumeData { resolution: noise.resolution, channels: 1, values: noise.values() };
                Ok(Self { path, data, border: Border::Clamp, world_from_voxels: None })
            }
        }
    }

    fn checked(self, files: &CompileContext, file: Option<&str>, limit: f32) -> Result<Self> {
        let VolumeData { resolution: [nx, ny, _], channels, values } = &self.data;
        let Some(bad) = values.iter().position(|value| !(0.0..=limit).contains(value)) else { return Ok(self) };
        let voxel = bad / *channels as usize;
        let (nx, ny) = (*nx as usize, *ny as usize);
        let at = [voxel % nx, voxel / nx % ny, voxel / nx / ny];
        let message = format!("the value of voxel {at:?} must be from 0 to {limit:e}, not {}", values[bad]);
        Err(match file {
            Some(file) => files.asset_error(&self.path, &files.source.asset(file), AssetError::Malformed(message)),
            None => files.error(&self.path, message),
        })
    }

    fn numbers(mut self, files: &CompileContext, place: &Placement) -> Result<VoxelGrid<f32>> {
        if self.data.channels != 1 {
            return Err(files.error(&self.path, "needs one number a voxel, not a colour"));
        }
        let values = std::mem::take(&mut self.data.values);
        Ok(self.grid(values, place))
    }

    fn colors(mut self, files: &CompileContext, place: &Placement) -> Result<VoxelGrid<Rgb>> {
        let values = std::mem::take(&mut self.data.values);
        let channels = self.data.channels;
        if !is_available(values.len() / channels as usize * size_of::<Rgb>()) {
            return Err(files.error(&self.path, "needs more memory than there is"));
        }
        let values = match channels {
            1 => values.into_iter().map(Rgb::splat).collect(),
            _ => values.as_chunks().0.iter().map(|&value| Rgb::from(value)).collect(),
        };
        Ok(self.grid(values, place))
    }

    fn grid<T: Voxel>(&self, values: Vec<T>, place: &Placement) -> VoxelGrid<T> {
        match place.within_unit(self) {
            Some([min, max]) => VoxelGrid::placed(self.data.resolution, values, min, max),
            None => VoxelGrid::new(self.data.resolution, values, self.border),
        }
    }
}

fn has_extension(path: &Path, extensions: &[&str]) -> bool {
    path.extension().is_some_and(|found| extensions.iter().any(|extension| found.eq_ignore_ascii_case(extension)))
}

/// Whether a file, and no volume that a reader made, is one of OpenVDB or NanoVDB.
fn is_vdb(files: &CompileContext, name: &str) -> bool {
    !files.source.assets.volumes.contains_key(name) && has_extension(Path::new(name), &["vdb", "nvdb"])
}

fn required(files: &CompileContext, path: &str, resolution: Option<[u32; 3]>) -> Result<[u32; 3]> {
    resolution.ok_or_else(|| files.error(path, "`resolution` is required: voxels along x, y and z"))
}

fn read_file(
    files: &CompileContext,
    path: &str,
    name: &str,
    resolution: Option<[u32; 3]>,
    channels: Option<u32>,
) -> Result<VolumeData> {
    if let Some(volume) = files.source.assets.volumes.get(name) {
        return Ok(volume.clone());
    }
    let asset = files.source.asset(name);
    let read = if has_extension(&asset, &["vol"]) {
        read_vol(&asset)
    } else {
        read_raw_volume(&asset, required(files, path, resolution)?, channels.unwrap_or(1))
    };
    let data = read.map_err(|e| files.asset_error(&format!("{path}.file"), &asset, e))?;
    let differs = resolution.is_some_and(|n| n != data.resolution) || channels.is_some_and(|n| n != data.channels);
    if differs {
        let VolumeData { resolution, channels, .. } = data;
        let message = format!("the file has {resolution:?} voxels of {channels} numbers, the scene others");
        return Err(files.error(path, message));
    }
    Ok(data)
}

fn noise(files: &CompileContext, path: &str, desc: &VolumeDesc) -> Result<Noise> {
    let VolumeDesc::Noise { resolution, frequency, octaves, seed, base, amplitude, fade } = *desc else {
        return Err(files.error(path, "is no noise"));
    };
    let voxels = resolution.iter().map(|&n| u64::from(n)).try_fold(1u64, u64::checked_mul).unwrap_or(u64::MAX);
    if !(1..=MAX_NOISE).contains(&voxels) {
        let message = format!("{resolution:?} must be at least 1 along each axis, and at most {MAX_NOISE} voxels");
        return Err(files.error(&format!("{path}.resolution"), message));
    }
    for (axis, &cells) in frequency.iter().enumerate() {
        files.within(&format!("{path}.frequency[{axis}]"), f64::from(cells), 1e-6, 1e6)?;
    }
    files.within(&format!("{path}.octaves"), f64::from(octaves), 1.0, 16.0)?;
    for (key, value) in [("base", base), ("amplitude", amplitude), ("fade", fade)] {
        files.within(&format!("{path}.{key}"), f64::from(value), -1e6, 1e6)?;
    }
    Ok(Noise { resolution, frequency, octaves, seed, base, amplitude, fade })
}
