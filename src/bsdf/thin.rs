//! Thin sheets: a pane of clear glass, and a diffuser.

use std::f32::consts::FRAC_1_PI;

use super::fresnel;
use super::{BsdfEval, BsdfFlags, BsdfSample};
use crate::color::Rgb;
use crate::math::{Vec3, vec3};
use crate::sampling::warp;

/// A clear plane-parallel pane: reflections between its faces are summed up, what passes is neither bent nor moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThinDielectric {
    /// Index of refraction of the pane over that of the outside, positive.
    pub ior: f32,
    /// Factor on what is reflected, each channel within `[0, 1]`.
    pub reflection_tint: Rgb,
    /// Factor on what passes, each channel within `[0, 1]`.
    pub transmission_tint: Rgb,
}

/// Reflectance of a pane that absorbs nothing: `R + T² R + T² R³ + ... = 2 R / (1 + R)`.
#[inline]
pub(super) fn pane_reflectance(cos: f32, ior: f32) -> f32 {
    let once = fresnel::dielectric(cos, ior).reflectance;
    2.0 * once / (1.0 + once)
}

impl ThinDielectric {
    /// A clear pane.
    pub fn new(ior: f32) -> Self {
        Self { ior, reflection_tint: Rgb::WHITE, transmission_tint: Rgb::WHITE }
    }

    /// Zero: both lobes are deltas.
    #[inline]
    pub fn eval(&self, _wo: Vec3, _wi: Vec3) -> BsdfEval {
        BsdfEval::default()
    }

    /// Reflection if `u_lobe` is below the reflectance, else the way straight on.
    #[inline]
    pub fn sample(&self, wo: Vec3, u_lobe: f32, _u: [f32; 2]) -> Option<BsdfSample> {
        if wo.z == 0.0 {
            return None;
        }
        let reflectance = pane_reflectance(wo.z.abs().min(1.0), self.ior);
        if u_lobe < reflectance {
            return Some(BsdfSample::mirrored(wo, self.reflection_tint, reflectance));
        }
        let pdf = 1.0 - reflectance;
        Some(BsdfSample {
            wi: -wo,
            weight: self.transmission_tint,
            pdf,
            is_delta: true,
            is_transmission: true,
            eta: 1.0,
        })
    }

    /// The lobes.
    #[inline]
    pub fn flags(&self) -> BsdfFlags {
        BsdfFlags::SPECULAR | BsdfFlags::REFLECTION | BsdfFlags::TRANSMISSION
    }

    /// What is reflected and what passes.
    pub fn albedo(&self, wo: Vec3) -> Rgb {
        let reflectance = pane_reflectance(wo.z.abs().min(1.0), self.ior);
        self.reflection_tint * reflectance + self.transmission_tint * (1.0 - reflectance)
    }
}

/// Ideal diffuse reflection and transmission: paper, leaves, lampshades.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiffuseTransmission {
    /// Fraction of light reflected.
    reflectance: Rgb,
    /// Fraction of light that leaves on the other side.
    transmittance: Rgb,
}

impl DiffuseTransmission {
    /// A sheet with these fractions; a channel whose fractions add up to more than 1 is scaled down to 1.
    pub fn new(reflectance: Rgb, transmittance: Rgb) -> Self {
        let sum = reflectance + transmittance;
        let scale = sum.map(|s| 1.0 / s.max(1.0));
        Self { reflectance: reflectance * scale, transmittance: transmittance * scale }
    }

    /// Probability of reflection.
    #[inline]
    fn reflection_probability(&self) -> f32 {
        let (r, t) = (self.reflectance.mean(), self.transmittance.mean());
        if r + t > 0.0 { r / (r + t) } else { 1.0 }
    }

    /// Reflection for directions on the same side, transmission for others.
    #[inline]
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> BsdfEval {
        if wo.z == 0.0 || wi.z == 0.0 {
            return BsdfEval::default();
        }
        let cosine_pdf = FRAC_1_PI * wi.z.abs();
        let reflection = self.reflection_probability();
        if wo.z * wi.z > 0.0 {
            BsdfEval { value: self.reflectance * cosine_pdf, pdf: reflection * cosine_pdf }
        } else {
            BsdfEval { value: self.transmittance * cosine_pdf, pdf: (1.0 - reflection) * cosine_pdf }
        }
    }

    /// A direction by the cosine, on a side chosen by what goes there.
    #[inline]
    pub fn sample(&self, wo: Vec3, u_lobe: f32, u: [f32; 2]) -> Option<BsdfSample> {
        let i = warp::cosine_hemisphere(u);
        if wo.z == 0.0 || i.z <= 0.0 {
            return None;
        }
        let reflection = self.reflection_probability();
        let is_transmission = u_lobe >= reflection;
        let (color, probability) =
            if is_transmission { (self.transmittance, 1.0 - reflection) } else { (self.reflectance, reflection) };
        let z = i.z.copysign(if is_transmission { -wo.z } else { wo.z });
        let pdf = probability * FRAC_1_PI * i.z;
        (pdf > 0.0).then(|| BsdfSample {
            wi: vec3(i.x, i.y, z),
            weight: color / probability,
            pdf,
            is_delta: false,
            is_transmission,
            eta: 1.0,
        })
    }

    /// The lobes.
    #[inline]
    pub fn flags(&self) -> BsdfFlags {
        BsdfFlags::DIFFUSE | BsdfFlags::REFLECTION | BsdfFlags::TRANSMISSION
    }

    /// What leaves on both sides.
    pub fn albedo(&self, _wo: Vec3) -> Rgb {
        self.reflectance + self.transmittance
    }
}
