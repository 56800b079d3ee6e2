//! The part of the diffuse base.

use super::Principled;
use crate::bsdf::split::share;
use crate::color::Rgb;
use crate::math::{Vec3, vec3};

impl Principled {
    /// As [`Bsdf::diffuse_fraction`](crate::bsdf::Bsdf::diffuse_fraction).
    pub fn diffuse_fraction(&self, wo: Vec3, wi: Vec3) -> Rgb {
        if self.dielectric() <= 0.0 {
            return Rgb::BLACK;
        }
        let (o, i) = (vec3(wo.x, wo.y, wo.z.abs()), vec3(wi.x, wi.y, wi.z.abs()));
        let (at_o, at_i) = (self.albedos::<false>(o), self.albedos::<false>(i));
        let mut base = self.base_value(o, i, true, &at_o, &at_i) * self.dielectric();
        if self.p.clearcoat > 0.0 {
            let coats = [at_o.clearcoat, at_i.clearcoat].map(Rgb::splat);
            base *= self.base_attenuation(coats, [self.uncoated_albedo(&at_o), self.uncoated_albedo(&at_i)]);
        }
        share(base, self.eval(wo, wi).value)
    }
}
