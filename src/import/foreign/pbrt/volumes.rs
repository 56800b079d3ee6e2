//! Grids of participating media.

use super::media::MediumDirective;
use crate::assets::VolumeData;
use crate::desc::{BorderDesc, MediumVolumeDesc, VolumeDesc};
use crate::error::Result;
use crate::import::foreign::Draft;

impl MediumDirective<'_> {
    /// What differs within a `uniformgrid`: its density, and the brightness of what it emits.
    pub(super) fn uniform_grid(&self, draft: &mut Draft) -> Result<MediumVolumeDesc> {
        let params = self.params;
        let density = self.grid::<1>(draft, "density")?;
        if density.is_none() {
            return Err(params.error("a uniformgrid needs \"density\""));
        }
        params.ignore("temperature", "blackbodies within media are not supported");
        params.ignore("temperaturescale", "blackbodies within media are not supported");
        params.ignore("temperatureoffset", "blackbodies within media are not supported");
        let volume = self.placed()?;
        let emission = match params.groups::<1>("Lescale")?.as_deref() {
            Some(&[[scale]]) => Some(VolumeDesc::constant(scale.max(0.0))),
            _ => self.grid::<1>(draft, "Lescale")?,
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
        Ok(MediumVolumeDesc { bounds, transform, ..MediumVolumeDesc::default() })
    }

    /// The grid of a parameter, of `N` numbers a voxel.
    fn grid<const N: usize>(&self, draft: &mut Draft, name: &str) -> Result<Option<VolumeDesc>> {
        let Some(param) = self.params.get(name) else { return Ok(None) };
        let size = |axis: &str| {
            let n = self.params.integer_or(axis, 1)?;
            u32::try_from(n).map_err(|_| self.params.error(format!("\"{axis}\" must be above 0, not {n}")))
        };
        let resolution = [size("nx")?, size("ny")?, size("nz")?];
        let values = self.params.groups::<N>(name)?.unwrap_or_default().into_flattened();
        let values = values.into_iter().map(|value| value.max(0.0)).collect();
        let data = VolumeData::new(resolution, N as u32, values).map_err(|message| param.error(message))?;
        let file = draft.keep_volume(&format!("{}_{name}", self.name), data);
        // Beyond the voxels, pbrt's grids are zero.
        Ok(Some(VolumeDesc::of_file(file, BorderDesc::Zero)))
    }
}
