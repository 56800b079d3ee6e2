//! What differs within media: grids from files, values or noise.

use super::CompileContext;
use super::media::MAX_COEFFICIENT;
use crate::assets::{AssetError, VolumeData, read_raw_volume, read_vol};
use crate::color::Rgb;
use crate::desc::{BorderDesc, MediumVolumeDesc, VolumeDesc};
use crate::error::Result;
use crate::math::{DAffine3, DMat3, DVec3};
use crate::medium::{Border, ExtinctionSplit, Medium, Noise, Volume, VolumeGrids, VoxelGrid};
use crate::memory::is_available;

/// The largest temperature, in kelvin.
const MAX_TEMPERATURE: f32 = 1e5;

/// The most voxels of noise.
const MAX_NOISE: u64 = 1 << 27;

/// What differs within `medium`.
pub(super) fn volume(files: &CompileContext, path: &str, desc: &MediumVolumeDesc, medium: &Medium) -> Result<Volume> {
    let world_from_unit = placement(files, path, desc)?;
    let MediumVolumeDesc { density, albedo, absorption, scattering, emission, .. } = desc;
    let part = |key: &str, desc: &Option<VolumeDesc>, limit: f32| {
        desc.as_ref().map(|desc| Part::read(files, format!("{path}.{key}"), desc, limit)).transpose()
    };
    let colors = |key: &str, desc: &Option<VolumeDesc>, limit: f32| {
        part(key, desc, limit)?.map(|part| part.colors(files)).transpose()
    };
    let brightest = |rgb: Rgb| if rgb.is_black() { f32::MAX } else { MAX_COEFFICIENT / rgb.max_channel() };
    let limit = brightest(medium.extinction()).min(brightest(medium.emission));
    let split = match (albedo, absorption, scattering) {
        (None, None, None) => ExtinctionSplit::Even,
        (Some(_), None, None) => colors("albedo", albedo, 1.0)?.map_or(ExtinctionSplit::Even, ExtinctionSplit::Albedo),
        (Some(_), _, _) => {
            let message = "cannot be given together with `absorption` or `scattering`";
            return Err(files.error(&format!("{path}.albedo"), message));
        }
        (None, _, _) => ExtinctionSplit::Factors {
            absorption: colors("absorption", absorption, limit)?,
            scattering: colors("scattering", scattering, limit)?,
        },
    };
    let grids = VolumeGrids {
        density: part("density", density, limit)?.map(|part| part.numbers(files)).transpose()?,
        split,
        emission: colors("emission", emission, limit)?,
        temperature: temperature(files, path, desc, medium)?,
    };
    Ok(Volume::new(medium, grids, &world_from_unit))
}

/// The temperature in kelvin.
fn temperature(
    files: &CompileContext,
    path: &str,
    desc: &MediumVolumeDesc,
    medium: &Medium,
) -> Result<Option<VoxelGrid<f32>>> {
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
    let mut part = Part::read(files, path, desc, (MAX_TEMPERATURE / scale).min(f32::MAX))?;
    part.data.values.iter_mut().for_each(|value| *value *= scale);
    part.numbers(files).map(Some)
}

/// The map of the unit cube to the box.
fn placement(files: &CompileContext, path: &str, desc: &MediumVolumeDesc) -> Result<DAffine3> {
    let bounds = format!("{path}.bounds");
    let [a, b] = [files.position(&bounds, desc.bounds[0])?, files.position(&bounds, desc.bounds[1])?];
    let (min, size) = (a.min(b), (b - a).abs());
    let into_bounds = DAffine3 { matrix3: DMat3::from_diagonal(size), translation: min };
    let map = files.affine(&format!("{path}.transform"), &desc.transform)? * into_bounds;
    let determinant = map.matrix3.determinant().abs();
    let is_sound = determinant > 0.0 && determinant.is_finite() && map.inverse().is_finite();
    if !is_sound || map.transform_vector3(DVec3::ONE).length() as f32 == 0.0 {
        return Err(files.error(&bounds, "the box is flat, or its transform flattens it or is not finite"));
    }
    Ok(map)
}

/// The voxels of one key.
struct Part {
    path: String,
    data: VolumeData,
    border: Border,
}

impl Part {
    /// Values from 0 to `limit`.
    fn read(files: &CompileContext, path: String, desc: &VolumeDesc, limit: f32) -> Result<Self> {
        match desc {
            VolumeDesc::Grid { file, values, resolution, channels, border } => {
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
                let part = Self { path, data, border };
                part.check(files, file.as_deref(), limit)?;
                Ok(part)
            }
            VolumeDesc::Noise { .. } => {
                let noise = noise(files, &path, desc)?;
                let data = VolumeData { resolution: noise.resolution, channels: 1, values: noise.values() };
                Ok(Self { path, data, border: Border::Clamp })
            }
        }
    }

    fn check(&self, files: &CompileContext, file: Option<&str>, limit: f32) -> Result<()> {
        let VolumeData { resolution: [nx, ny, _], channels, values } = &self.data;
        let Some(bad) = values.iter().position(|value| !(0.0..=limit).contains(value)) else { return Ok(()) };
        let voxel = bad / *channels as usize;
        let (nx, ny) = (*nx as usize, *ny as usize);
        let at = [voxel % nx, voxel / nx % ny, voxel / nx / ny];
        let message = format!("the value of voxel {at:?} must be from 0 to {limit:e}, not {}", values[bad]);
        Err(match file {
            Some(file) => files.asset_error(&self.path, &files.source.asset(file), AssetError::Malformed(message)),
            None => files.error(&self.path, message),
        })
    }

    fn numbers(self, files: &CompileContext) -> Result<VoxelGrid<f32>> {
        let VolumeData { resolution, channels, values } = self.data;
        if channels != 1 {
            return Err(files.error(&self.path, "needs one number a voxel, not a colour"));
        }
        Ok(VoxelGrid::new(resolution, values, self.border))
    }

    fn colors(self, files: &CompileContext) -> Result<VoxelGrid<Rgb>> {
        let VolumeData { resolution, channels, values } = self.data;
        if !is_available(values.len() / channels as usize * size_of::<Rgb>()) {
            return Err(files.error(&self.path, "needs more memory than there is"));
        }
        let values = match channels {
            1 => values.into_iter().map(Rgb::splat).collect(),
            _ => values.as_chunks().0.iter().map(|&value| Rgb::from(value)).collect(),
        };
        Ok(VoxelGrid::new(resolution, values, self.border))
    }
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
    let extension = asset.extension().map(std::ffi::OsStr::to_ascii_lowercase).unwrap_or_default();
    let read = if extension == "vol" {
        read_vol(&asset)
    } else if extension == "vdb" || extension == "nvdb" {
        let message = "OpenVDB and NanoVDB files are not supported: convert the grid to a .vol file or plain floats";
        return Err(files.error(&format!("{path}.file"), message));
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
