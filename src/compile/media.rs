//! Media: which material has which.

use super::CompileContext;
use super::materials::{Compiler, MaterialTable};
use crate::color::Rgb;
use crate::desc::{AbsorptionDesc, MaterialDesc};
use crate::error::Result;
use crate::id::{MaterialId, MediumId};
use crate::material::Material;
use crate::medium::{Medium, dispersed};

impl Compiler<'_> {
    /// What a material fills its surfaces with.
    pub(super) fn medium(&self, path: &str, desc: &MaterialDesc) -> Result<Option<Medium>> {
        let MaterialDesc::Dielectric(glass) = desc else { return Ok(None) };
        if !glass.is_medium() {
            return Ok(None);
        }
        let ior = self.glass_ior(path, &glass.ior)?;
        let ior = match glass.abbe {
            None => [ior; 3],
            Some(abbe) => {
                let path = format!("{path}.abbe");
                self.files.within(&path, f64::from(abbe), 1.0, 1000.0)?;
                let iors = dispersed(ior, abbe);
                if iors.iter().any(|n| !(0.1..=10.0).contains(n)) {
                    return Err(self
                        .files
                        .error(&path, format!("gives indices of refraction from {} to {}", iors[0], iors[2])));
                }
                iors
            }
        };
        let absorption =
            glass.absorption.map_or(Ok(Rgb::BLACK), |a| self.absorption(&format!("{path}.absorption"), &a))?;
        Ok(Some(Medium { priority: glass.priority.unwrap_or(0), ior, absorption }))
    }

    fn absorption(&self, path: &str, desc: &AbsorptionDesc) -> Result<Rgb> {
        let AbsorptionDesc { color, distance } = *desc;
        if !color.iter().all(|&c| c > 0.0 && c <= 1.0) {
            return Err(self.files.error(&format!("{path}.color"), format!("{color:?} must be above 0 and at most 1")));
        }
        let path = format!("{path}.distance");
        self.files.positive(&path, f64::from(distance))?;
        // Adding 0 turns -0 into 0.
        let coefficients = color.map(|c| (-f64::from(c).ln() / f64::from(distance)) as f32 + 0.0);
        if coefficients.iter().any(|c| !c.is_finite()) {
            return Err(self.files.error(&path, format!("is too small: {distance}")));
        }
        Ok(coefficients.into())
    }
}

impl MaterialTable {
    /// The medium within surfaces of a material.
    pub fn medium(&self, id: MaterialId) -> Option<MediumId> {
        self.medium_of.get(&id).and_then(|medium| self.media.id(medium))
    }

    /// The medium of a material that consists of others: whatever crosses its surface must end up in the same.
    pub(super) fn medium_within(
        &self,
        files: &CompileContext,
        path: &str,
        material: &Material,
    ) -> Result<Option<Medium>> {
        let Some(parts) = material.parts() else { return Ok(None) };
        let medium = |id: MaterialId| self.medium_of.get(&id).copied();
        match parts.map(|id| self.transmits(id)) {
            [true, true] if medium(parts[0]) != medium(parts[1]) => {
                let message = "both materials let light through, but not into the same medium: they differ in `ior`, \
                               `priority`, `absorption` or `abbe`";
                Err(files.error(path, message))
            }
            [true, _] => Ok(medium(parts[0])),
            [false, _] => Ok(medium(parts[1])),
        }
    }
}
