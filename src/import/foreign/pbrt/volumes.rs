//! Grids of participating media.

use std::collections::BTreeMap;

use super::media::MediumDirective;
use crate::assets::VolumeData;
use crate::desc::{BorderDesc, MediumVolumeDesc, VolumeDesc};
use crate::error::Result;
use crate::import::foreign::Draft;
use crate::spectrum::Spectrum;

/// The largest temperature, in kelvin.
const MAX_TEMPERATURE: f64 = 1e5;

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
                self.glow(draft, &temperatures, brightness.unwrap_or(&[[1.0]]))?
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

    /// The box.
    fn placed(&self) -> Result<MediumVolumeDesc> {
        let corner = |name: &str, default: f64| Ok(self.params.array(name)?.unwrap_or([default; 3]));
        let mut transform = self.transform.clone();
        if let Some(start) = self.motion.first() {
            self.params.approximate("type", "media do not move: placed as when the shutter opens");
            transform.0.extend(start.transform.0.iter().cloned());
        }
        let bounds = [corner("p0", 0.0)?, corner("p1", 1.0)?];
        Ok(MediumVolumeDesc { bounds: Some(bounds), transform, ..MediumVolumeDesc::default() })
    }

    /// The radiance of black bodies, whose largest over all wavelengths is the brightness, one number or one a voxel.
    fn glow(
        &self,
        draft: &mut Draft,
        temperatures: &[[f32; 1]],
        brightness: &[[f32; 1]],
    ) -> Result<Option<VolumeDesc>> {
        let (scale, offset) =
            (self.params.number_or("temperaturescale", 1.0)?, self.params.number_or("temperatureoffset", 0.0)?);
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
        self.stored::<3>(draft, "temperature", values)
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
