//! The parts of a sample's radiance: by how light left the first surface towards the camera, and by the group of the
//! light that gave it.
//!
//! Light that is scattered by several lobes at once is shared out between diffuse and specular by what the lobes have
//! of the BSDF's value for its direction. Light that was scattered once is direct, whether light sampling found it or
//! the path met the light.

use crate::bsdf::{Bsdf, BsdfSample};
use crate::color::Rgb;
use crate::film::{LightAov, LightAovRows};
use crate::id::{LightGroupId, LightId};
use crate::math::Vec3;
use crate::scene::Scene;

/// How light leaves the first surface towards the camera.
#[derive(Clone, Copy, Debug)]
pub(super) enum LobeWeights {
    /// Reflected, with this share of diffuse reflection; the rest is specular.
    Reflected {
        /// By channel.
        diffuse: Rgb,
    },
    /// Through the surface.
    Transmitted,
    /// By a medium; the first surface is then that point.
    Volume,
}

impl LobeWeights {
    /// All by diffuse reflection.
    pub const DIFFUSE: Self = Self::Reflected { diffuse: Rgb::WHITE };

    /// Of light that does not meet a delta lobe, from `wi` to `wo`, both local.
    pub fn between(bsdf: &Bsdf, wo: Vec3, wi: Vec3) -> Self {
        if matches!(bsdf, Bsdf::Phase(_)) {
            Self::Volume
        } else if wo.z * wi.z < 0.0 {
            Self::Transmitted
        } else {
            Self::Reflected { diffuse: bsdf.diffuse_fraction(wo, wi) }
        }
    }

    /// Of light from a direction that was chosen for `wo`.
    pub fn of_sample(bsdf: &Bsdf, wo: Vec3, sample: &BsdfSample) -> Self {
        match (sample.is_delta, sample.is_transmission) {
            (true, true) => Self::Transmitted,
            (true, false) => Self::Reflected { diffuse: Rgb::BLACK },
            (false, _) => Self::between(bsdf, wo, sample.wi),
        }
    }
}

/// How light came from its source to the camera.
#[derive(Clone, Copy, Debug)]
pub(super) enum LightEvent {
    /// Straight from a surface.
    Emission,
    /// Straight from infinity.
    Environment,
    /// Scattered once.
    Direct(LobeWeights),
    /// Scattered more than once, at last so.
    Indirect(LobeWeights),
}

/// The place of a light's group among the groups.
pub(super) fn group_of(scene: &Scene, light: LightId) -> usize {
    scene.light_groups.of(light).map_or(scene.light_groups.names().len(), LightGroupId::index)
}

/// Adds light to the AOVs by scattering of a sample.
pub(super) fn add_by_scattering(light_aovs: &mut LightAovRows, sample: usize, light: Rgb, event: LightEvent) {
    if !light_aovs.request().by_scattering {
        return;
    }
    let mut add = |aov: LightAov, light: Rgb| light_aovs.add(sample, aov as usize, light);
    let (lobes, [diffuse, specular, transmission, volume]) = match event {
        LightEvent::Emission => return add(LightAov::Emission, light),
        LightEvent::Environment => return add(LightAov::Background, light),
        LightEvent::Direct(lobes) => {
            use LightAov::{DiffuseDirect, SpecularDirect, TransmissionDirect, VolumeDirect};
            (lobes, [DiffuseDirect, SpecularDirect, TransmissionDirect, VolumeDirect])
        }
        LightEvent::Indirect(lobes) => {
            use LightAov::{DiffuseIndirect, SpecularIndirect, TransmissionIndirect, VolumeIndirect};
            (lobes, [DiffuseIndirect, SpecularIndirect, TransmissionIndirect, VolumeIndirect])
        }
    };
    match lobes {
        LobeWeights::Transmitted => add(transmission, light),
        LobeWeights::Volume => add(volume, light),
        LobeWeights::Reflected { diffuse: share } => {
            let part = light * share;
            add(diffuse, part);
            add(specular, light - part);
        }
    }
}

/// Adds light to the AOV of a group of lights.
pub(super) fn add_by_group(light_aovs: &mut LightAovRows, sample: usize, light: Rgb, group: usize) {
    let request = light_aovs.request();
    if request.light_groups > 0 {
        light_aovs.add(sample, request.first_group() + group, light);
    }
}

/// Adds all light of a sample that is of no lobe and of no light.
pub(super) fn add_emission(light_aovs: &mut LightAovRows, sample: usize, light: Rgb) {
    add_by_scattering(light_aovs, sample, light, LightEvent::Emission);
    let last = light_aovs.request().light_groups.saturating_sub(1) as usize;
    add_by_group(light_aovs, sample, light, last);
}
