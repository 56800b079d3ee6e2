//! Light that enters the surface, for a random walk below it.

use super::{LobeAlbedos, Principled, PrincipledParameters, principled_diffuse};
use crate::bsdf::BsdfSample;
use crate::color::Rgb;
use crate::math::{Vec3, vec3};
use crate::sampling::warp;

impl Principled {
    /// The share of the diffuse base's light that enters the surface.
    #[inline(always)]
    pub(super) fn entering(&self) -> f32 {
        if self.p.random_walk { self.p.subsurface } else { 0.0 }
    }

    /// What a white diffuse base scatters at a cosine, light that enters included.
    #[inline(always)]
    pub(super) fn diffuse_albedo(&self, cos: f32) -> f32 {
        if !self.p.random_walk {
            return principled_diffuse(self.p.roughness, self.p.subsurface, cos);
        }
        let diffuse = principled_diffuse(self.p.roughness, 0.0, cos);
        diffuse + (1.0 - diffuse) * self.p.subsurface
    }

    /// A direction below the surface, by the cosine. The layers take from it what they reflect of light from `wo`; the
    /// base's colour is that of the walk.
    #[inline(never)]
    pub(super) fn sample_walk(&self, wo: Vec3, at: &LobeAlbedos, probability: f32, u: [f32; 2]) -> Option<BsdfSample> {
        let mut left = self.base_attenuation([self.layer_albedo(at); 2], [self.base_albedo(at); 2]);
        if self.p.clearcoat > 0.0 {
            left *= self.base_attenuation([Rgb::splat(at.clearcoat); 2], [self.uncoated_albedo(at); 2]);
        }
        let i = warp::cosine_hemisphere(u);
        let weight = left * (self.dielectric() * self.entering() / probability);
        (wo.z != 0.0 && i.z > 0.0).then(|| BsdfSample {
            wi: vec3(i.x, i.y, -i.z.copysign(wo.z)),
            weight,
            pdf: probability,
            is_delta: true,
            is_transmission: true,
            eta: 1.0,
        })
    }

    /// The colour of the base, which light has that enters the surface and leaves it again.
    pub fn base_color(&self) -> Rgb {
        self.p.base_color
    }

    /// With the flat lobe in place of light that enters.
    pub fn without_walk(&self) -> Self {
        Self { p: PrincipledParameters { random_walk: false, ..self.p }, ..*self }
    }

    /// Whether light enters the surface.
    pub fn has_walk(&self) -> bool {
        self.entering() > 0.0 && self.dielectric() > 0.0
    }
}
