//! The principled material: its parameters checked.

use super::materials::Compiler;
use crate::bsdf::{PrincipledModel, PrincipledParameters};
use crate::desc::{PrincipledDesc, PrincipledModelDesc, ScalarDesc};
use crate::error::Result;
use crate::material::{PrincipledInputs, RangedInput, ScalarInput};

impl Compiler<'_> {
    pub(super) fn principled(&self, path: &str, desc: &PrincipledDesc) -> Result<PrincipledInputs> {
        let scalar = |key: &str, desc: &ScalarDesc| self.scalar(&format!("{path}.{key}"), desc);
        let (specular, ior) = match (&desc.specular, &desc.ior) {
            (Some(_), Some(_)) => return Err(self.files.error(path, "give either `specular` or `ior`")),
            (Some(specular), None) => (Some(scalar("specular", specular)?), RangedInput::Constant(1.5)),
            (None, Some(ior)) => (None, self.ior(path, ior, 1.0)?),
            (None, None) => (None, RangedInput::Constant(1.5)),
        };
        let diffuse_transmission = scalar("diffuse_transmission", &desc.diffuse_transmission)?;
        if !desc.thin && diffuse_transmission != ScalarInput::Constant(0.0) {
            return Err(self.files.error(&format!("{path}.diffuse_transmission"), "needs `thin`: a solid has no other side here"));
        }
        let transmission = scalar("transmission", &desc.transmission)?;
        if !desc.thin && !transmission.is_zero() {
            let textured =
                [("specular", matches!(specular, Some(ScalarInput::Texture(_)))), ("ior", matches!(ior, RangedInput::Texture { .. }))];
            if let Some((key, _)) = textured.into_iter().find(|(_, is_textured)| *is_textured) {
                let message = "cannot come from a texture with `transmission`, unless `thin`: what is inside has one index of refraction";
                return Err(self.files.error(&format!("{path}.{key}"), message));
            }
        }
        Ok(PrincipledInputs {
            rest: PrincipledParameters {
                thin: desc.thin,
                multiscatter: desc.multiscatter,
                model: match desc.model {
                    PrincipledModelDesc::Burley => PrincipledModel::Burley,
                    PrincipledModelDesc::Mitsuba => PrincipledModel::Mitsuba,
                },
                ..PrincipledParameters::default()
            },
            base_color: self.color(&format!("{path}.base_color"), &desc.base_color)?,
            metallic: scalar("metallic", &desc.metallic)?,
            roughness: scalar("roughness", &desc.roughness)?,
            anisotropic: scalar("anisotropic", &desc.anisotropic)?,
            ior,
            specular,
            specular_tint: scalar("specular_tint", &desc.specular_tint)?,
            sheen: scalar("sheen", &desc.sheen)?,
            sheen_tint: scalar("sheen_tint", &desc.sheen_tint)?,
            clearcoat: scalar("clearcoat", &desc.clearcoat)?,
            clearcoat_gloss: scalar("clearcoat_gloss", &desc.clearcoat_gloss)?,
            subsurface: scalar("subsurface", &desc.subsurface)?,
            transmission,
            diffuse_transmission,
        })
    }
}
