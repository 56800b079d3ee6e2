//! Media: which material has which.

use std::collections::BTreeMap;

use super::CompileContext;
use super::materials::{Compiler, MaterialTable};
use crate::bsdf::Phase;
use crate::color::Rgb;
use crate::desc::{AbsorptionDesc, CoefficientDesc, MaterialDesc, MediumDesc, PhaseDesc, SceneDesc};
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
        let priority = glass.priority.unwrap_or(0);
        if let Some(name) = &glass.medium {
            let path = format!("{path}.medium");
            if glass.absorption.is_some() {
                return Err(self.files.error(&path, "cannot be given together with `absorption`"));
            }
            return Ok(Some(Medium { priority, ior, ..self.media.get(self.files, &path, name)? }));
        }
        let absorption =
            glass.absorption.map_or(Ok(Rgb::BLACK), |a| self.absorption(&format!("{path}.absorption"), &a))?;
        Ok(Some(Medium { ior, absorption, ..Medium::clear(priority) }))
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

/// Media of the scene by name, of priority 0 and index 1.
pub(super) struct NamedMedia<'a>(BTreeMap<&'a str, Medium>);

impl<'a> NamedMedia<'a> {
    pub fn new(files: &CompileContext, desc: &'a SceneDesc) -> Result<Self> {
        let media = desc
            .media
            .iter()
            .map(|(name, medium)| Ok((name.as_str(), participating(files, &format!("media.{name}"), medium)?)));
        Ok(Self(media.collect::<Result<_>>()?))
    }

    /// The medium that `path` names.
    pub fn get(&self, files: &CompileContext, path: &str, name: &str) -> Result<Medium> {
        self.0.get(name).copied().ok_or_else(|| files.unknown(path, "medium", name, self.0.keys().copied()))
    }

    /// What is around everything.
    pub fn around(&self, files: &CompileContext, desc: &SceneDesc) -> Result<Option<Medium>> {
        let Some(name) = &desc.medium else { return Ok(None) };
        let medium = self.get(files, "medium", name)?;
        let [emission, extinction] = [medium.emission, medium.extinction()].map(Rgb::to_array);
        if emission.into_iter().zip(extinction).any(|(e, t)| e > 0.0 && t == 0.0) {
            let message = "emits light but neither absorbs nor scatters it: all around, that is infinitely much";
            return Err(files.error("medium", message));
        }
        Ok(Some(medium))
    }
}

/// The largest coefficient, per world unit.
const MAX_COEFFICIENT: f32 = 1e15;

/// The largest mean cosine of a phase function.
const MAX_G: f32 = 0.99;

fn participating(files: &CompileContext, path: &str, desc: &MediumDesc) -> Result<Medium> {
    let MediumDesc { absorption, scattering, emission, phase } = desc;
    let coefficient = |key: &str, desc: &CoefficientDesc| {
        let values = desc.to_array();
        if values.iter().all(|value| (0.0..=MAX_COEFFICIENT).contains(value)) {
            // Adding 0 turns -0 into 0.
            return Ok(Rgb::from(values.map(|value| value + 0.0)));
        }
        let message = format!("{values:?} must be from 0 to {MAX_COEFFICIENT:e}");
        Err(files.error(&format!("{path}.{key}"), message))
    };
    let phase = match *phase {
        PhaseDesc::Isotropic => Phase::ISOTROPIC,
        PhaseDesc::HenyeyGreenstein { g } => {
            files.within(&format!("{path}.phase.g"), f64::from(g), -f64::from(MAX_G), f64::from(MAX_G))?;
            Phase::HenyeyGreenstein { g: g + 0.0 }
        }
        PhaseDesc::Rayleigh => Phase::Rayleigh,
    };
    Ok(Medium {
        absorption: coefficient("absorption", absorption)?,
        scattering: coefficient("scattering", scattering)?,
        emission: coefficient("emission", emission)?,
        phase,
        ..Medium::clear(0)
    })
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
                               `priority`, `absorption`, `medium` or `abbe`";
                Err(files.error(path, message))
            }
            [true, _] => Ok(medium(parts[0])),
            [false, _] => Ok(medium(parts[1])),
        }
    }
}
