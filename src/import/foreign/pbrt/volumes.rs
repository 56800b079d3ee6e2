//! Grids of participating media.

use std::collections::BTreeMap;

use super::media::MediumDirective;
use crate::assets::{AssetError, GridChoice, VdbGrid, VolumeData, list_vdb, read_vdb};
use crate::desc::{BorderDesc, MediumVolumeDesc, TransformDesc, VolumeDesc};
use crate::error::Result;
use crate::import::foreign::Draft;
use crate::math::{DAffine3, DVec3};
use crate::spectrum::Spectrum;

/// The largest temperature, in kelvin.
const MAX_TEMPERATURE: f64 = 1e5;

/// How far, in voxels, grids may lie apart that count as of the same voxels.
const MAX_SHIFT: f64 = 1e-3;

impl MediumDirective<'_> {
    /// What differs within a `uniformgrid`: its density, and the brightness of what it emits.
    pub(super) fn uniform_grid(&self, draft: &mut Draft) -> Result<MediumVolumeDesc> {
        let params = self.params;
        let density = self.grid::<1>(draft, "density")?;
        if density.is_none() {
            return Err(params.error("a uniformgrid needs \"density\""));
        }
        let volume = self.placed()?;
        let brightness = params.groups::<1>("Lescale")?;
        let emission = match (params.groups::<1>("temperature")?, brightness.as_deref()) {
            (Some(temperatures), brightness) => {
                params.approximate("temperature", "colours at the voxels, which are interpolated");
                let offset = params.number_or("temperatureoffset", 0.0)?;
                let values = self.glow(&temperatures, brightness.unwrap_or(&[[1.0]]), offset)?;
                self.stored::<3>(draft, "temperature", values)?
            }
            (None, Some(&[[scale]])) => Some(VolumeDesc::constant(scale.max(0.0))),
            (None, _) => self.grid::<1>(draft, "Lescale")?,
        };
        Ok(MediumVolumeDesc { density, emission, ..volume })
    }

    /// What differs within an `rgbgrid`: absorption and scattering.
    pub(super) fn rgb_grid(&self, draft: &mut Draft) -> Result<MediumVolumeDesc> {
        let (absorption, scattering) = (self.grid::<3>(draft, "sigma_a")?, self.grid::<3>(draft, "sigma_s")?);
        if absorption.is_none() && scattering.is_none() {
            return Err(self.params.error("an rgbgrid needs \"sigma_a\" or \"sigma_s\""));
        }
        self.params.ignore("Le", "emission of an rgbgrid is not supported");
        self.params.ignore("Lescale", "emission of an rgbgrid is not supported");
        Ok(MediumVolumeDesc { absorption, scattering, ..self.placed()? })
    }

    /// What differs within a `nanovdb` medium: the grids `density` and, if there is one, `temperature` of a file.
    pub(super) fn nano_grid(&self, draft: &mut Draft) -> Result<MediumVolumeDesc> {
        let params = self.params;
        let Some(file) = params.string("filename")? else { return Err(params.error("needs a filename")) };
        let path = self.colors.folder.join(file);
        let place = format!("{}: {}", params.place, params.element);
        let error = |error: AssetError| error.at(self.scene, &place, &path);
        let (grids, why) = match list_vdb(&path) {
            // An error when the scene is compiled, unless the medium is left out.
            Err(AssetError::Missing { .. }) => (Vec::new(), "the file is not there"),
            listed => (listed.map_err(error)?, "the file has no grid named \"temperature\""),
        };
        let emission = if grids.iter().any(|(name, _)| name == "temperature") {
            let read = |name| read_vdb(&path, GridChoice { name: Some(name), default: name }).map_err(error);
            self.blackbody_emission(draft, &read("density")?, &read("temperature")?)?
        } else {
            for name in ["Lescale", "temperaturescale", "temperatureoffset", "temperaturecutoff"] {
                params.ignore(name, why);
            }
            None
        };
        let density = VolumeDesc::of_vdb(file.to_owned(), "density");
        Ok(MediumVolumeDesc { density: Some(density), emission, transform: self.own_transform(), ..Default::default() })
    }

    /// The radiance of black bodies at the voxels of `density`.
    fn blackbody_emission(
        &self,
        draft: &mut Draft,
        density: &VdbGrid,
        temperature: &VdbGrid,
    ) -> Result<Option<VolumeDesc>> {
        let params = self.params;
        let shift = DVec3::from([0, 1, 2].map(|axis| (temperature.origin[axis] - density.origin[axis]) as f64));
        let map = density.world_from_voxels.inverse() * temperature.world_from_voxels;
        if !map.abs_diff_eq(DAffine3::from_translation(shift), MAX_SHIFT) || temperature.voxels.channels != 1 {
            let why = "the grid has no numbers at the same places as the density: nothing is emitted";
            draft.ignored(&params.place, &params.element, "temperature", why);
            return Ok(None);
        }
        // Beyond its box, a grid has the background of its outermost voxels.
        let [nx, ny, nz] = density.voxels.resolution.map(i64::from);
        let value = |i: i64| {
            let at = [i % nx, i / nx % ny, i / nx / ny];
            let inside = [0, 1, 2].map(|axis| {
                let last = i64::from(temperature.voxels.resolution[axis]) - 1;
                (at[axis] + density.origin[axis] - temperature.origin[axis]).clamp(0, last) as usize
            });
            let [width, height, _] = temperature.voxels.resolution.map(|edge| edge as usize);
            [temperature.voxels.values[(inside[2] * height + inside[1]) * width + inside[0]]]
        };
        let temperatures: Vec<[f32; 1]> = (0..nx * ny * nz).map(value).collect();
        let offset = match params.number("temperatureoffset")? {
            Some(offset) => offset,
            None => params.number_or("temperaturecutoff", 0.0)?,
        };
        let brightness = params.number_or("Lescale", 1.0)? as f32;
        draft.approximated(
            &params.place,
            &params.element,
            "temperature",
            "colours at the voxels of the density, which are interpolated",
        );
        let values = self.glow(&temperatures, &[[brightness]], offset)?;
        let data = VolumeData::new(density.voxels.resolution, 3, values).map_err(|message| params.error(message))?;
        let file = draft.keep_volume(&format!("{}_temperature", self.name), data);
        Ok(Some(VolumeDesc::of_file(file, BorderDesc::Clamp)))
    }

    /// The box.
    fn placed(&self) -> Result<MediumVolumeDesc> {
        let corner = |name: &str, default: f64| Ok(self.params.array(name)?.unwrap_or([default; 3]));
        let bounds = [corner("p0", 0.0)?, corner("p1", 1.0)?];
        Ok(MediumVolumeDesc { bounds: Some(bounds), transform: self.own_transform(), ..MediumVolumeDesc::default() })
    }

    /// The place of the medium's own space.
    fn own_transform(&self) -> TransformDesc {
        let mut transform = self.transform.clone();
        if let Some(start) = self.motion.first() {
            self.params.approximate("type", "media do not move: placed as when the shutter opens");
            transform.0.extend(start.transform.0.iter().cloned());
        }
        transform
    }

    /// The radiance of black bodies, whose largest over all wavelengths is the brightness, one number or one a voxel.
    fn glow(&self, temperatures: &[[f32; 1]], brightness: &[[f32; 1]], offset: f64) -> Result<Vec<f32>> {
        let scale = self.params.number_or("temperaturescale", 1.0)?;
        if brightness.len() != 1 && brightness.len() != temperatures.len() {
            return Err(self.params.error("\"Lescale\" must have one value, or as many as \"temperature\""));
        }
        let mut known = BTreeMap::new();
        let mut values = Vec::with_capacity(3 * temperatures.len());
        for ([temperature], [brightness]) in temperatures.iter().zip(brightness.iter().cycle()) {
            let kelvin = ((f64::from(*temperature) - offset) * scale).min(MAX_TEMPERATURE);
            let mut whole =
                |kelvin: f64| *known.entry(kelvin as u32).or_insert_with(|| Spectrum::Blackbody(kelvin).emission());
            // In pbrt, too, what is colder is dark.
            let color = if kelvin > 100.0 {
                let (a, b, f) = (whole(kelvin.floor()), whole(kelvin.floor() + 1.0), kelvin.fract() as f32);
                [0, 1, 2].map(|i| a[i] + (b[i] - a[i]) * f)
            } else {
                [0.0; 3]
            };
            values.extend(color.map(|c| (c * brightness).max(0.0)));
        }
        Ok(values)
    }

    /// The grid of a parameter, of `N` numbers a voxel.
    fn grid<const N: usize>(&self, draft: &mut Draft, name: &str) -> Result<Option<VolumeDesc>> {
        let Some(groups) = self.params.groups::<N>(name)? else { return Ok(None) };
        self.stored::<N>(draft, name, groups.into_flattened().into_iter().map(|value| value.max(0.0)).collect())
    }

    /// A grid of `N` numbers a voxel in place of a parameter.
    fn stored<const N: usize>(&self, draft: &mut Draft, name: &str, values: Vec<f32>) -> Result<Option<VolumeDesc>> {
        let Some(param) = self.params.get(name) else { return Ok(None) };
        let size = |axis: &str| {
            let n = self.params.integer_or(axis, 1)?;
            u32::try_from(n).map_err(|_| self.params.error(format!("\"{axis}\" must be above 0, not {n}")))
        };
        let resolution = [size("nx")?, size("ny")?, size("nz")?];
        let data = VolumeData::new(resolution, N as u32, values).map_err(|message| param.error(message))?;
        let file = draft.keep_volume(&format!("{}_{name}", self.name), data);
        // Beyond the voxels, pbrt's grids are zero.
        Ok(Some(VolumeDesc::of_file(file, BorderDesc::Zero)))
    }
}
