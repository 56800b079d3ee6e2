//! The principled material: its parameters checked.

use super::materials::Compiler;
use crate::bsdf::PrincipledParameters;
use crate::desc::{PrincipledDesc, ScalarDesc};
use crate::error::Result;
use crate::material::{PrincipledInputs, ScalarInput};

impl Compiler<'_> {
    pub(super) fn principled(&self, path: &str, desc: &PrincipledDesc) -> Result<PrincipledInputs> {
        let scalar = |key: &str, desc: &ScalarDesc| self.scalar(&format!("{path}.{key}"), desc);
        let (specular, ior) = match (&desc.specular, desc.ior) {
            (Some(_), Some(_)) => return Err(self.files.error(path, "give either `specular` or `ior`")),
            (Some(specular), None) => (Some(scalar("specular", specular)?), 1.5),
            (None, ior) => (None, self.files.within(&format!("{path}.ior"), f64::from(ior.unwrap_or(1.5)), 1.0, 10.0)? as f32),
        };
        let diffuse_transmission = scalar("diffuse_transmission", &desc.diffuse_transmission)?;
        if !desc.thin && diffuse_transmission != ScalarInput::Constant(0.0) {
            return Err(self.files.error(&format!("{path}.diffuse_transmission"), "needs `thin`: a solid has no other side here"));
        }
        Ok(PrincipledInputs {
            rest: PrincipledParameters { ior, thin: desc.thin, multiscatter: desc.multiscatter, ..PrincipledParameters::default() },
            base_color: self.color(&format!("{path}.base_color"), &desc.base_color)?,
            metallic: scalar("metallic", &desc.metallic)?,
            roughness: scalar("roughness", &desc.roughness)?,
            anisotropic: scalar("anisotropic", &desc.anisotropic)?,
            specular,
            specular_tint: scalar("specular_tint", &desc.specular_tint)?,
            sheen: scalar("sheen", &desc.sheen)?,
            sheen_tint: scalar("sheen_tint", &desc.sheen_tint)?,
            clearcoat: scalar("clearcoat", &desc.clearcoat)?,
            clearcoat_gloss: scalar("clearcoat_gloss", &desc.clearcoat_gloss)?,
            subsurface: scalar("subsurface", &desc.subsurface)?,
            transmission: scalar("transmission", &desc.transmission)?,
            diffuse_transmission,
        })
    }
}
