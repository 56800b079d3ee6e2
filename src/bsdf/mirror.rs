//! Ideal specular reflection.

use super::{BsdfEval, BsdfFlags, BsdfSample};
use crate::color::Rgb;
use crate::math::{Vec3, vec3};

/// Ideal specular reflection on both sides, the same at every angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mirror {
    /// Fraction of light reflected, each channel within `[0, 1]`.
    pub reflectance: Rgb,
}

impl Mirror {
    /// Zero: a delta has no value.
    #[inline]
    pub fn eval(&self, _wo: Vec3, _wi: Vec3) -> BsdfEval {
        BsdfEval::default()
    }

    /// The mirrored direction.
    #[inline]
    pub fn sample(&self, wo: Vec3, _u_lobe: f32, _u: [f32; 2]) -> Option<BsdfSample> {
        if wo.z == 0.0 {
            return None;
        }
        Some(BsdfSample::mirrored(wo, self.reflectance, 1.0))
    }

    /// The lobes.
    #[inline]
    pub fn flags(&self) -> BsdfFlags {
        BsdfFlags::SPECULAR | BsdfFlags::REFLECTION
    }

    /// The reflectance.
    pub fn albedo(&self, _wo: Vec3) -> Rgb {
        self.reflectance
    }
}

impl BsdfSample {
    /// Delta reflection, chosen with the given probability.
    #[inline(always)]
    pub(super) fn mirrored(wo: Vec3, weight: Rgb, probability: f32) -> Self {
        Self {
            wi: vec3(-wo.x, -wo.y, wo.z),
            weight,
            pdf: probability,
            is_delta: true,
            is_transmission: false,
            eta: 1.0,
        }
    }
}
