//! Ideal diffuse reflection.

use std::f32::consts::FRAC_1_PI;

use super::{BsdfEval, BsdfFlags, BsdfSample};
use crate::color::Rgb;
use crate::math::Vec3;
use crate::sampling::warp;

/// Ideal diffuse reflection on both sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lambert {
    /// Fraction of light reflected, each channel within `[0, 1]`.
    pub albedo: Rgb,
}

/// A direction chosen by the cosine.
#[derive(Clone, Copy, Debug)]
pub struct DiffuseDirection {
    /// The direction, unit, local.
    pub wi: Vec3,
    /// Density per solid angle.
    pub pdf: f32,
    /// Whether it can be used.
    pub is_valid: bool,
}

impl Lambert {
    /// `albedo / pi |cos|` for directions on the same side.
    #[inline(always)]
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> BsdfEval {
        if wo.z * wi.z <= 0.0 {
            return BsdfEval::default();
        }
        let pdf = FRAC_1_PI * wi.z.abs();
        BsdfEval { value: self.albedo * pdf, pdf }
    }

    /// A direction on the side of `wo`, by the cosine.
    #[inline(always)]
    pub fn sample(&self, wo: Vec3, _u_lobe: f32, u: [f32; 2]) -> Option<BsdfSample> {
        let DiffuseDirection { wi, pdf, is_valid } = self.direction(wo, u);
        is_valid.then_some(BsdfSample {
            wi,
            weight: self.albedo,
            pdf,
            is_delta: false,
            is_transmission: false,
            eta: 1.0,
        })
    }

    /// What [`sample`](Self::sample) chooses, without branches.
    #[inline(always)]
    pub fn direction(&self, wo: Vec3, u: [f32; 2]) -> DiffuseDirection {
        let mut wi = warp::cosine_hemisphere(u);
        let is_valid = (wo.z != 0.0) & (wi.z != 0.0);
        let pdf = warp::cosine_hemisphere_pdf(wi.z);
        wi.z = wi.z.copysign(wo.z);
        DiffuseDirection { wi, pdf, is_valid }
    }

    /// The lobes.
    #[inline]
    pub fn flags(&self) -> BsdfFlags {
        BsdfFlags::DIFFUSE | BsdfFlags::REFLECTION
    }

    /// The albedo.
    pub fn albedo(&self, _wo: Vec3) -> Rgb {
        self.albedo
    }
}
