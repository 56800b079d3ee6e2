//! The principled BSDFs.

use super::Reader;
use super::bsdfs::BsdfBinding;
use super::element::Element;
use super::textures::UvOrigin;
use crate::desc::{MaterialDesc, PrincipledDesc, PrincipledModelDesc, RangedDesc, ScalarDesc};
use crate::error::Result;

const ZERO: ScalarDesc = ScalarDesc::Constant(0.0);

/// How often lobes are sampled, which does not change the picture.
const RATES: [&str; 7] = [
    "diffuse_reflectance_sampling_rate",
    "main_specular_sampling_rate",
    "clearcoat_sampling_rate",
    "spec_reflection_sampling_rate",
    "spec_trans_sampling_rate",
    "diff_trans_sampling_rate",
    "spec_reflect_sampling_rate",
];

impl<'a> Reader<'a> {
    /// What both kinds have; the rest is without effect.
    fn principled_base(&mut self, element: &mut Element<'a>, uv: UvOrigin) -> Result<PrincipledDesc> {
        for name in RATES {
            element.float(name)?;
        }
        let mut scalar = |name: &str, default: f32| self.scalar(element, name, default, 1.0, uv);
        let (roughness, anisotropic) = (scalar("roughness", 0.5)?, scalar("anisotropic", 0.0)?);
        let specular_tint = scalar("spec_tint", 0.0)?;
        let (sheen, sheen_tint) = (scalar("sheen", 0.0)?, scalar("sheen_tint", 0.0)?);
        let (subsurface, transmission) = (scalar("flatness", 0.0)?, scalar("spec_trans", 0.0)?);
        Ok(PrincipledDesc {
            base_color: self.color(element, "base_color", 0.5, uv)?,
            roughness,
            anisotropic,
            ior: self.ranged(element, "eta", uv)?,
            specular_tint,
            sheen,
            sheen_tint,
            clearcoat_gloss: ZERO,
            subsurface,
            transmission,
            multiscatter: false,
            model: PrincipledModelDesc::Mitsuba,
            ..PrincipledDesc::default()
        })
    }

    /// The principled BSDF, and whether its back is black.
    pub(super) fn principled(&mut self, element: &mut Element<'a>, uv: UvOrigin) -> Result<(MaterialDesc, bool)> {
        let mut desc = self.principled_base(element, uv)?;
        desc.metallic = self.scalar(element, "metallic", 0.0, 1.0, uv)?;
        desc.clearcoat = self.scalar(element, "clearcoat", 0.0, 1.0, uv)?;
        desc.clearcoat_gloss = self.scalar(element, "clearcoat_gloss", 0.0, 1.0, uv)?;
        if desc.ior.is_none() {
            desc.specular = Some(self.scalar(element, "specular", 0.5, 1.0, uv)?);
        }
        let is_opaque = matches!(desc.transmission, ScalarDesc::Constant(t) if t == 0.0);
        Ok((MaterialDesc::Principled(Box::new(desc)), is_opaque))
    }

    /// The thin one: what is not `spec_trans` has no highlights in Mitsuba, so that it is a mix of a sheet without any
    /// and a pane.
    pub(super) fn principled_thin(&mut self, element: &mut Element<'a>, uv: UvOrigin) -> Result<BsdfBinding> {
        let base = self.principled_base(element, uv)?;
        let sheet = PrincipledDesc {
            thin: true,
            transmission: ZERO,
            ior: Some(RangedDesc::Constant(1.0)),
            // Two of Mitsuba's are all of the light.
            diffuse_transmission: self.scalar(element, "diff_trans", 0.0, 0.5, uv)?,
            ..base.clone()
        };
        let amount = base.transmission.clone();
        if matches!(amount, ScalarDesc::Constant(t) if t == 0.0) {
            return Ok(self.add(element, MaterialDesc::Principled(Box::new(sheet)), false));
        }
        let pane = PrincipledDesc {
            thin: true,
            transmission: ScalarDesc::Constant(1.0),
            ior: base.ior.clone().or(Some(RangedDesc::Constant(1.5))),
            sheen: ZERO,
            ..base
        };
        let place = element.place().to_string();
        let part = |reader: &mut Self, name: &str, desc| {
            reader.draft.add_material(name, &place, MaterialDesc::Principled(Box::new(desc)))
        };
        let materials = [part(self, "thin_sheet", sheet), part(self, "thin_pane", pane)];
        Ok(self.add(element, MaterialDesc::Mix { materials, amount }, false))
    }
}
