//! Metals: reflection with the exact Fresnel equations of a complex index of refraction, by a plane or by GGX microfacets.

use super::fresnel::ComplexIndex;
use super::microfacet::{MIN_COSINE, reflect};
use super::{BsdfEval, BsdfSample, Ggx};
use crate::color::Rgb;
use crate::math::{Vec3, vec3};

/// A metal on both sides. Light that meets more than one microfacet is lost (single scattering).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conductor {
    index: [ComplexIndex; 3],
    tint: Rgb,
    ggx: Ggx,
}

impl Conductor {
    /// A metal with index of refraction `eta + i k` relative to the outside; smooth where [`Ggx::new`] says so. `tint` multiplies the
    /// reflectance.
    pub fn new(eta: Rgb, k: Rgb, alpha: [f32; 2], tint: Rgb) -> Self {
        let index = [ComplexIndex::new(eta.r, k.r), ComplexIndex::new(eta.g, k.g), ComplexIndex::new(eta.b, k.b)];
        Self { index, tint, ggx: Ggx::new(alpha) }
    }

    #[inline]
    fn reflectance(&self, cos: f32) -> Rgb {
        self.tint * Rgb::from(self.index.map(|index| index.reflectance(cos)))
    }

    /// `F D G2 / (4 |cos wo|)` for directions on the same side of a rough metal, zero for a smooth one.
    #[inline]
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> BsdfEval {
        if self.ggx.is_smooth() || wo.z * wi.z <= 0.0 {
            return BsdfEval::default();
        }
        let facet = self.ggx.reflection(vec3(wo.x, wo.y, wo.z.abs()), vec3(wi.x, wi.y, wi.z.abs()));
        BsdfEval { value: self.reflectance(facet.cos) * facet.value, pdf: facet.pdf }
    }

    /// A reflection at a visible normal.
    #[inline]
    pub fn sample(&self, wo: Vec3, _u_lobe: f32, u: [f32; 2]) -> Option<BsdfSample> {
        if wo.z.abs() <= MIN_COSINE {
            return None;
        }
        if self.ggx.is_smooth() {
            return Some(BsdfSample::mirrored(wo, self.reflectance(wo.z.abs().min(1.0)), 1.0));
        }
        let o = vec3(wo.x, wo.y, wo.z.abs());
        let m = self.ggx.sample_visible_normal(o, u);
        let cos = o.dot(m);
        let mut wi = reflect(o, m, cos);
        if !(cos > 0.0 && wi.z > 0.0) {
            return None;
        }
        let weight = self.reflectance(cos.min(1.0)) * self.ggx.sampled_shadowing(o, wi);
        let pdf = self.ggx.reflection_pdf(o, m);
        wi.z = wi.z.copysign(wo.z);
        Some(BsdfSample { wi, weight, pdf, is_delta: false, is_transmission: false, eta: 1.0 })
    }

    /// Whether the surface is rougher along one tangent than along the other.
    pub fn is_anisotropic(&self) -> bool {
        self.ggx.alpha()[0] != self.ggx.alpha()[1]
    }

    /// Whether the metal is smooth.
    #[inline]
    pub fn is_delta(&self) -> bool {
        self.ggx.is_smooth()
    }

    /// The reflectance of the plane: what microfacets lose is left out.
    pub fn albedo(&self, wo: Vec3) -> Rgb {
        self.reflectance(wo.z.abs().min(1.0))
    }
}
