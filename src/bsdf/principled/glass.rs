//! Glass: solid, and thin sheets of it.

use super::{Principled, PrincipledModel, mix, schlick_weight, tint};
use crate::bsdf::microfacet::{Microfacets, SeparableGgx, reflect};
use crate::bsdf::thin::pane_reflectance;
use crate::bsdf::{BsdfEval, Dielectric, fresnel};
use crate::color::Rgb;
use crate::math::Vec3;

impl Principled {
    #[inline]
    pub(super) fn eval_glass(&self, wo: Vec3, wi: Vec3) -> BsdfEval {
        let glass = match self.p.model {
            PrincipledModel::Burley => self.glass().eval(wo, wi),
            PrincipledModel::Mitsuba => {
                Dielectric::with_facets(self.p.ior, self.ggx.alpha(), SeparableGgx::new).eval(wo, wi)
            }
        };
        if wo.z * wi.z > 0.0 {
            glass
        } else {
            BsdfEval { value: glass.value * self.p.base_color.map(f32::sqrt), ..glass }
        }
    }

    #[inline]
    pub(super) fn glass(&self) -> Dielectric {
        Dielectric::rough(self.p.ior, self.ggx, self.p.multiscatter)
    }

    /// Mitsuba's specular reflectance of the dielectric layer at a cosine: exact Fresnel, mixed with Schlick's by the
    /// tint.
    #[inline(always)]
    pub(super) fn mitsuba_specular(&self, cos: f32) -> Rgb {
        let exact = fresnel::dielectric(cos, self.p.ior).reflectance;
        if self.p.specular_tint == 0.0 {
            return Rgb::splat(exact);
        }
        let (weight, f0) = (schlick_weight(cos), (self.p.ior - 1.0) / (self.p.ior + 1.0));
        let tinted = tint(self.p.base_color, self.p.model) * (f0 * f0 * (1.0 - weight)) + Rgb::splat(weight);
        mix(Rgb::splat(exact), tinted, self.p.specular_tint)
    }

    /// A thin sheet, for the direction to the viewer and that of the light mirrored to its side. All reflections within
    /// the sheet count together, and light that passes does not turn. In Mitsuba the first reflection alone counts, and
    /// what passes has a lobe of its own.
    #[inline]
    pub(super) fn eval_thin(&self, o: Vec3, i: Vec3, reflects: bool) -> BsdfEval {
        if self.is_mitsuba() {
            return self.eval_mitsuba_thin(o, i, reflects);
        }
        let facet = self.ggx.reflection(o, i);
        let reflectance = pane_reflectance(facet.cos, self.p.ior);
        let (fraction, color) =
            if reflects { (reflectance, Rgb::WHITE) } else { (1.0 - reflectance, self.p.base_color) };
        BsdfEval { value: color * (fraction * facet.value), pdf: fraction * facet.pdf }
    }

    fn eval_mitsuba_thin(&self, o: Vec3, i: Vec3, reflects: bool) -> BsdfEval {
        let reflection = fresnel::dielectric(o.z, self.p.ior).reflectance;
        if reflects {
            let facet = SeparableGgx::from(self.ggx).reflection(o, i);
            return BsdfEval { value: self.mitsuba_specular(facet.cos) * facet.value, pdf: reflection * facet.pdf };
        }
        let facet = self.transmission_facets().reflection(o, i);
        // Mitsuba tests the half vector of the mirrored direction against the direction itself, which cuts wide
        // transmission off.
        let passes = (o + i).dot(Vec3::new(i.x, i.y, -i.z)) < 0.0;
        let fraction = if passes { 1.0 - fresnel::dielectric(facet.cos, self.p.ior).reflectance } else { 0.0 };
        BsdfEval { value: self.p.base_color * (fraction * facet.value), pdf: (1.0 - reflection) * facet.pdf }
    }

    /// The microfacets of transmission through a thin sheet in Mitsuba: the roughness of refraction at both faces
    /// together (Burley, "Extending the Disney BRDF to a BSDF with Integrated Subsurface Scattering").
    fn transmission_facets(&self) -> SeparableGgx {
        let scale = (0.65 * self.p.ior - 0.35).max(0.0);
        SeparableGgx::new(self.ggx.alpha().map(|alpha| (alpha * scale * scale).clamp(super::MIN_ALPHA, 1.0)))
    }

    /// The direction of the light mirrored to the viewer's side, which may be below, and whether the light is
    /// reflected.
    #[inline]
    pub(super) fn sample_thin(&self, o: Vec3, u_side: f32, u: [f32; 2]) -> (Vec3, bool) {
        if self.is_mitsuba() {
            let reflects = u_side < fresnel::dielectric(o.z, self.p.ior).reflectance;
            let facets = if reflects { SeparableGgx::from(self.ggx) } else { self.transmission_facets() };
            let m = facets.sample_visible_normal(o, u);
            return (reflect(o, m, o.dot(m)), reflects);
        }
        let m = self.ggx.sample_visible_normal(o, u);
        let cos = o.dot(m);
        (reflect(o, m, cos), u_side < pane_reflectance(cos.clamp(0.0, 1.0), self.p.ior))
    }
}
