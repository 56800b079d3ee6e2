//! Media: which material has which.

use std::collections::BTreeMap;

use super::CompileContext;
use super::faults::Faults;
use super::materials::{Compiler, MaterialTable};
use crate::bsdf::{MAX_PHASE_LOBES, Phase, PhaseLobe, WeightedLobe};
use crate::color::Rgb;
use crate::desc::{AbsorptionDesc, CoefficientDesc, MaterialDesc, MediumDesc, PhaseDesc, SceneDesc, UsedNames};
use crate::error::Result;
use crate::id::{MaterialId, MediumId, VolumeId};
use crate::material::Material;
use crate::medium::{Medium, Volume, dispersed};

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
#[derive(Default)]
pub(super) struct NamedMedia<'a> {
    media: BTreeMap<&'a str, Medium>,
    /// What differs within them, by [`VolumeId`].
    pub volumes: Vec<Volume>,
}

impl<'a> NamedMedia<'a> {
    /// All of a scene; what differs within those that are not used is not read.
    pub fn new(files: &CompileContext, desc: &'a SceneDesc, used: &UsedNames, faults: &mut Faults) -> Self {
        let mut all = Self { media: BTreeMap::new(), volumes: Vec::new() };
        for (name, desc) in &desc.media {
            let path = format!("media.{name}");
            let medium = participating(files, &path, desc).and_then(|mut medium| {
                if let Some(volume) = desc.volume.as_ref().filter(|_| used.media.contains(name)) {
                    all.volumes.push(super::volumes::volume(files, &format!("{path}.volume"), volume, &medium)?);
                    medium.volume = Some(VolumeId::new(all.volumes.len() - 1));
                }
                Ok(medium)
            });
            // What uses a faulty one has no fault of its own.
            all.media.insert(name, faults.keep(medium).unwrap_or_else(|| Medium::clear(0)));
        }
        all
    }

    /// The medium that `path` names.
    pub fn get(&self, files: &CompileContext, path: &str, name: &str) -> Result<Medium> {
        self.media.get(name).copied().ok_or_else(|| files.unknown(path, "medium", name, self.media.keys().copied()))
    }

    /// The name of a medium, whatever priority and index it has got from a material.
    pub fn name_of(&self, medium: &Medium) -> Option<&'a str> {
        let is_same = |named: &Medium| Medium { priority: medium.priority, ior: medium.ior, ..*named } == *medium;
        self.media.iter().find(|(_, named)| is_same(named)).map(|(name, _)| *name)
    }

    /// What is around everything.
    pub fn around(&self, files: &CompileContext, desc: &SceneDesc) -> Result<Option<Medium>> {
        let Some(name) = &desc.medium else { return Ok(None) };
        let medium = self.get(files, "medium", name)?;
        let [emission, extinction] = [medium.emission, medium.extinction()].map(Rgb::to_array);
        let is_endless = medium.volume.is_none();
        if is_endless && emission.into_iter().zip(extinction).any(|(e, t)| e > 0.0 && t == 0.0) {
            let message = "emits light but neither absorbs nor scatters it: all around, that is infinitely much";
            return Err(files.error("medium", message));
        }
        Ok(Some(medium))
    }
}

/// The largest coefficient, per world unit.
pub(super) const MAX_COEFFICIENT: f32 = 1e15;

/// The largest mean cosine of a phase function.
const MAX_G: f32 = 0.99;

fn participating(files: &CompileContext, path: &str, desc: &MediumDesc) -> Result<Medium> {
    let MediumDesc { absorption, scattering, emission, phase, volume: _ } = desc;
    let coefficient = |key: &str, desc: &CoefficientDesc| {
        let values = desc.to_array();
        if values.iter().all(|value| (0.0..=MAX_COEFFICIENT).contains(value)) {
            // Adding 0 turns -0 into 0.
            return Ok(Rgb::from(values.map(|value| value + 0.0)));
        }
        let message = format!("{values:?} must be from 0 to {MAX_COEFFICIENT:e}");
        Err(files.error(&format!("{path}.{key}"), message))
    };
    let mut lobes = Vec::new();
    let phase_path = format!("{path}.phase");
    add_lobes(files, &phase_path, phase, 1.0, &mut lobes)?;
    let phase = Phase::mean(&lobes).ok_or_else(|| {
        let message = format!("must have from 1 to {MAX_PHASE_LOBES} phase functions of a weight above 0");
        files.error(&phase_path, message)
    })?;
    Ok(Medium {
        absorption: coefficient("absorption", absorption)?,
        scattering: coefficient("scattering", scattering)?,
        emission: coefficient("emission", emission)?,
        phase,
        ..Medium::clear(0)
    })
}

/// Adds the lobes of a phase function, which is a part `weight` of the whole.
fn add_lobes(
    files: &CompileContext,
    path: &str,
    desc: &PhaseDesc,
    weight: f32,
    lobes: &mut Vec<WeightedLobe>,
) -> Result<()> {
    let lobe = match desc {
        PhaseDesc::Isotropic => PhaseLobe::HenyeyGreenstein { g: 0.0 },
        PhaseDesc::HenyeyGreenstein { g } => {
            files.within(&format!("{path}.g"), f64::from(*g), -f64::from(MAX_G), f64::from(MAX_G))?;
            PhaseLobe::HenyeyGreenstein { g: g + 0.0 }
        }
        PhaseDesc::Rayleigh => PhaseLobe::Rayleigh,
        PhaseDesc::Mix { phases, weights } => {
            let sum: f32 = weights.iter().sum();
            let are_sound = weights.iter().all(|weight| (0.0..=f32::MAX).contains(weight));
            if weights.len() != phases.len() || !are_sound || !(sum > 0.0 && sum.is_finite()) {
                let message = format!("{weights:?} must be one number of at least 0 for each of `phases`, one above 0");
                return Err(files.error(&format!("{path}.weights"), message));
            }
            for (i, (phase, share)) in phases.iter().zip(weights).enumerate() {
                add_lobes(files, &format!("{path}.phases[{i}]"), phase, weight * share / sum, lobes)?;
            }
            return Ok(());
        }
    };
    lobes.push(WeightedLobe { weight, lobe });
    Ok(())
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
