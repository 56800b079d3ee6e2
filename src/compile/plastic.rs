//! Plastic: its coat prepared.

use super::materials::{Compiler, facets};
use crate::bsdf::{Beckmann, Coat, Ggx, SeparableGgx, diffuse_mean, mitsuba_diffuse_mean};
use crate::desc::PlasticDesc;
use crate::error::Result;
use crate::material::{CoatInput, Facets, PlasticCoat, RangedInput, ScalarInput, TexturedMaterial};

impl Compiler<'_> {
    pub(super) fn plastic(&self, path: &str, desc: &PlasticDesc) -> Result<TexturedMaterial> {
        Ok(TexturedMaterial::Plastic {
            coat: self.plastic_coat(path, desc)?,
            albedo: self.color(&format!("{path}.albedo"), &desc.albedo)?,
            tint: self.color(&format!("{path}.coat_tint"), &desc.coat_tint)?,
            nonlinear: desc.nonlinear,
        })
    }

    /// The coat of plastic, prepared where no texture changes it.
    fn plastic_coat(&self, path: &str, desc: &PlasticDesc) -> Result<PlasticCoat> {
        let ior = self.ranged(&format!("{path}.ior"), &desc.ior, |path, ior| {
            let is_sound = ior > 1.0 && ior <= 10.0;
            if is_sound {
                Ok(())
            } else {
                Err(self.files.error(path, format!("must be above 1 and at most 10, not {ior}")))
            }
        })?;
        let alpha = self.alpha(path, desc.roughness.as_ref(), desc.alpha.as_ref())?;
        let facets = facets(desc.distribution, desc.multiscatter);
        if facets == Facets::Ggx {
            return Ok(PlasticCoat::Ggx(CoatInput::new(ior, alpha)));
        }
        let (RangedInput::Constant(ior), [ScalarInput::Constant(u), ScalarInput::Constant(v)]) = (ior, alpha.axes)
        else {
            let message = "with a `distribution` or without `multiscatter`, `ior`, `roughness` and `alpha` cannot come \
                           from textures";
            return Err(self.files.error(path, message));
        };
        if u != v {
            let message =
                "with a `distribution` or without `multiscatter`, the roughness must be the same along both axes";
            return Err(self.files.error(path, message));
        }
        let alpha = [if alpha.squared { u * u } else { u }; 2];
        Ok(match facets {
            Facets::Ggx | Facets::SingleGgx => {
                PlasticCoat::Ggx(CoatInput::Constant(Coat::single_scattering(ior, Ggx::new(alpha), diffuse_mean)))
            }
            Facets::SeparableGgx => {
                PlasticCoat::SeparableGgx(Coat::single_scattering(ior, SeparableGgx::new(alpha), mitsuba_diffuse_mean))
            }
            Facets::Beckmann => {
                PlasticCoat::Beckmann(Coat::single_scattering(ior, Beckmann::new(alpha), mitsuba_diffuse_mean))
            }
        })
    }
}
