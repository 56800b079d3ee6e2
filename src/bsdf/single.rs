//! Materials whose microfacets scatter light once, for agreement with other renderers.

use super::microfacet::Microfacets;
use super::{BsdfEval, BsdfFlags, BsdfSample, Conductor, Dielectric, Plastic};
use crate::color::Rgb;
use crate::math::Vec3;

/// A material with microfacets distributed by `D`, which lose light that they scatter several times. Apart from the
/// others, so that their code stays as it is.
#[derive(Clone, Debug, PartialEq)]
pub enum SingleScatteringBsdf<D> {
    /// Metal.
    Conductor(Conductor<D>),
    /// Glass.
    Dielectric(Dielectric<D>),
    /// A diffuse base under a rough coat.
    Plastic(Plastic<D>),
}

macro_rules! each {
    ($self:expr, $bsdf:ident => $body:expr) => {
        match $self {
            SingleScatteringBsdf::Conductor($bsdf) => $body,
            SingleScatteringBsdf::Dielectric($bsdf) => $body,
            SingleScatteringBsdf::Plastic($bsdf) => $body,
        }
    };
}

impl<D: Microfacets> SingleScatteringBsdf<D> {
    /// As [`Bsdf::eval`](super::Bsdf::eval).
    #[inline(never)]
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> BsdfEval {
        each!(self, bsdf => bsdf.eval(wo, wi))
    }

    /// As [`Bsdf::sample`](super::Bsdf::sample).
    #[inline(never)]
    pub fn sample(&self, wo: Vec3, u_lobe: f32, u: [f32; 2]) -> Option<BsdfSample> {
        each!(self, bsdf => bsdf.sample(wo, u_lobe, u))
    }

    /// Alpha along both tangents of metal and glass, which have no diffuse base; infinite for others.
    pub(super) fn specular_alpha(&self) -> [f32; 2] {
        match self {
            Self::Conductor(bsdf) => bsdf.alpha(),
            Self::Dielectric(bsdf) => bsdf.alpha(),
            Self::Plastic(_) => [f32::INFINITY; 2],
        }
    }

    /// The lobes.
    #[inline]
    pub fn flags(&self) -> BsdfFlags {
        each!(self, bsdf => bsdf.flags())
    }

    /// As [`Bsdf::diffuse_fraction`](super::Bsdf::diffuse_fraction).
    pub fn diffuse_fraction(&self, wo: Vec3, wi: Vec3) -> Rgb {
        match self {
            Self::Conductor(_) | Self::Dielectric(_) => Rgb::BLACK,
            Self::Plastic(bsdf) => bsdf.diffuse_fraction(wo, wi),
        }
    }

    /// As [`Bsdf::albedo`](super::Bsdf::albedo).
    pub fn albedo(&self, wo: Vec3) -> Rgb {
        each!(self, bsdf => bsdf.albedo(wo))
    }
}
