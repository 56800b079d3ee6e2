//! The principled model in rows.

use super::{Principled, PrincipledModel, PrincipledParameters};
use crate::bsdf::rows::{BsdfQueryRows, LaneBsdf};
use crate::bsdf::{BsdfEval, BsdfSample, Ggx};
use crate::math::Vec3;

/// Isotropic metal and a dielectric layer over a diffuse base, without any other lobe, for vector code: the parameters
/// of the other lobes are constants here, so that their code is left out.
#[derive(Clone, Copy)]
pub struct BasicPrincipled<const MITSUBA: bool>(Principled);

impl Principled {
    /// Whether it is a [`BasicPrincipled`].
    pub(in crate::bsdf) fn is_basic(&self) -> bool {
        let Self { p, glass, ggx, .. } = self;
        let others = [p.sheen, p.clearcoat, p.subsurface, p.diffuse_transmission, *glass];
        let [ax, ay] = ggx.alpha;
        others == [0.0; 5] && ax == ay && !(self.is_mitsuba() && p.specular_tint != 0.0)
    }

    /// The parameters of one with no other lobes.
    #[inline(always)]
    pub(in crate::bsdf) fn basic<const MITSUBA: bool>(&self) -> BasicPrincipled<MITSUBA> {
        let PrincipledParameters { base_color, metallic, roughness, ior, .. } = self.p;
        let p = PrincipledParameters {
            base_color,
            metallic,
            roughness,
            ior,
            anisotropic: 0.0,
            specular: None,
            specular_tint: 0.0,
            sheen: 0.0,
            sheen_tint: 0.0,
            clearcoat: 0.0,
            clearcoat_gloss: 0.0,
            subsurface: 0.0,
            transmission: 0.0,
            thin: false,
            diffuse_transmission: 0.0,
            multiscatter: false,
            model: if MITSUBA { PrincipledModel::Mitsuba } else { PrincipledModel::Burley },
            random_walk: false,
        };
        BasicPrincipled(Self { p, glass: 0.0, ggx: Ggx::isotropic(self.ggx.alpha[0]), ..*self })
    }

    /// Sets the parameters of a query.
    #[inline(always)]
    pub(in crate::bsdf) fn set_parameters(&self, i: usize, queries: &mut BsdfQueryRows) {
        queries.color.set(i, self.p.base_color);
        queries.specular.set(i, self.specular);
        queries.multiple.set(i, self.multiple);
        (queries.metallic[i], queries.roughness[i], queries.ior[i]) = (self.p.metallic, self.p.roughness, self.p.ior);
        queries.alpha[i] = self.ggx.alpha[0];
    }

    /// The model with the parameters of a query.
    #[inline(always)]
    pub(in crate::bsdf) fn with_parameters(&self, i: usize, queries: &BsdfQueryRows) -> Self {
        let p = PrincipledParameters {
            base_color: queries.color.get(i),
            metallic: queries.metallic[i],
            roughness: queries.roughness[i],
            ior: queries.ior[i],
            ..self.p
        };
        let ggx = Ggx::isotropic(queries.alpha[i]);
        Self { p, specular: queries.specular.get(i), multiple: queries.multiple.get(i), ggx, ..*self }
    }
}

impl<const MITSUBA: bool> LaneBsdf for BasicPrincipled<MITSUBA> {
    #[inline(always)]
    fn eval(&self, wo: Vec3, wi: Vec3) -> BsdfEval {
        self.0.eval_with::<true>(wo, wi)
    }

    #[inline(always)]
    fn sample(&self, wo: Vec3, u_lobe: f32, u: [f32; 2]) -> Option<BsdfSample> {
        self.0.sample_with::<true>(wo, u_lobe, u)
    }
}
