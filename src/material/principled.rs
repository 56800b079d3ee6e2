//! Parameters of the principled model from textures.

use super::{ColorInput, RangedInput, ScalarInput};
use crate::bsdf::{BsdfFlags, PrincipledParameters};
use crate::id::TextureId;
use crate::texture::{Footprint, Texture};

/// What [`PrincipledParameters`] are made of.
#[derive(Clone, Debug, PartialEq)]
pub struct PrincipledInputs {
    /// What no texture changes, or a number below would replace.
    pub rest: PrincipledParameters,
    /// The base's colour.
    pub base_color: ColorInput,
    /// How much is metal.
    pub metallic: ScalarInput,
    /// Roughness.
    pub roughness: ScalarInput,
    /// Anisotropy.
    pub anisotropic: ScalarInput,
    /// Index of refraction over that of the outside.
    pub ior: RangedInput,
    /// Reflectance ahead in units of 0.08, in place of the index of refraction.
    pub specular: Option<ScalarInput>,
    /// Tint of the dielectric layer.
    pub specular_tint: ScalarInput,
    /// Strength of the sheen.
    pub sheen: ScalarInput,
    /// Tint of the sheen.
    pub sheen_tint: ScalarInput,
    /// Strength of the clear coat.
    pub clearcoat: ScalarInput,
    /// Gloss of the clear coat.
    pub clearcoat_gloss: ScalarInput,
    /// From the diffuse to the flat lobe.
    pub subsurface: ScalarInput,
    /// How much is glass.
    pub transmission: ScalarInput,
    /// How much the diffuse base of a thin sheet lets through.
    pub diffuse_transmission: ScalarInput,
}

impl PrincipledInputs {
    pub(super) fn parameters(&self, textures: &[Texture], footprint: &Footprint) -> PrincipledParameters {
        let at = |input: &ScalarInput| input.at(textures, footprint);
        PrincipledParameters {
            base_color: self.base_color.at(textures, footprint),
            metallic: at(&self.metallic),
            roughness: at(&self.roughness),
            anisotropic: at(&self.anisotropic),
            ior: match &self.specular {
                Some(specular) => PrincipledParameters::ior_of_specular(at(specular)),
                None => self.ior.at(textures, footprint),
            },
            specular_tint: at(&self.specular_tint),
            sheen: at(&self.sheen),
            sheen_tint: at(&self.sheen_tint),
            clearcoat: at(&self.clearcoat),
            clearcoat_gloss: at(&self.clearcoat_gloss),
            subsurface: at(&self.subsurface),
            transmission: at(&self.transmission),
            diffuse_transmission: at(&self.diffuse_transmission),
            ..self.rest
        }
    }

    pub(super) fn flags(&self) -> BsdfFlags {
        let mut flags = BsdfFlags::DIFFUSE | BsdfFlags::GLOSSY | BsdfFlags::REFLECTION;
        flags.set(BsdfFlags::TRANSMISSION, !self.transmission.is_zero() || !self.diffuse_transmission.is_zero());
        flags.set(BsdfFlags::ANISOTROPIC, !self.anisotropic.is_zero());
        flags
    }

    pub(super) fn textures(&self) -> Vec<TextureId> {
        let scalars = [
            &self.metallic,
            &self.roughness,
            &self.anisotropic,
            &self.specular_tint,
            &self.sheen,
            &self.sheen_tint,
            &self.clearcoat,
            &self.clearcoat_gloss,
            &self.subsurface,
            &self.transmission,
            &self.diffuse_transmission,
        ];
        let scalars = scalars.into_iter().chain(&self.specular).filter_map(ScalarInput::texture);
        self.base_color.texture().into_iter().chain(self.ior.texture()).chain(scalars).collect()
    }
}
