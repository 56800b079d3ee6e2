//! Scattering at a point, in the local frame: `z` is the shading normal, directions are unit and point away from the
//! surface.
//!
//! Every value carries the cosine: `f(wo, wi) |cos wi|`. Densities are per solid angle. Materials are two-sided: `wo.z
//! < 0` sees the back, which an opaque BSDF treats as its front and a dielectric as its inside.

mod beckmann;
mod coat;
mod coated;
mod conductor;
mod dielectric;
mod energy;
mod eon;
mod flags;
pub mod fresnel;
mod glossy;
mod hair;
mod lambert;
mod measured;
mod microfacet;
mod mirror;
mod phase;
mod phong;
mod plastic;
mod principled;
mod regularize;
mod rows;
mod single;
mod split;
#[cfg(test)]
mod tests;
mod thin;

pub use beckmann::Beckmann;
pub use coat::{Coat, diffuse_mean, mitsuba_diffuse_mean};
pub use coated::{Coated, PooledCoated};
pub use conductor::Conductor;
pub use dielectric::Dielectric;
pub use energy::bake as bake_energy_tables;
pub use eon::Eon;
pub use flags::BsdfFlags;
pub use glossy::Glossy;
pub use hair::{Hair, hair_absorption, hair_absorption_of_color};
pub use lambert::{DiffuseDirection, Lambert};
pub use measured::Measured;
pub use microfacet::{Ggx, Microfacets, SMOOTH_ALPHA, SeparableGgx};
pub use mirror::Mirror;
pub use phase::{MAX_PHASE_LOBES, Phase, PhaseLobe, WeightedLobe};
pub use phong::Phong;
pub use plastic::Plastic;
pub use principled::{Principled, PrincipledModel, PrincipledParameters};
pub use rows::{BsdfEvalRows, BsdfQueryRows, BsdfSampleRows};
pub use single::SingleScatteringBsdf;
pub use thin::{DiffuseTransmission, ThinDielectric};

use crate::color::Rgb;
use crate::math::Vec3;

/// The largest alpha of [near-specular](Bsdf::is_near_specular) microfacets.
const NEAR_SPECULAR_ALPHA: f32 = 0.3;

/// A scattered direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BsdfSample {
    /// The direction, unit, local.
    pub wi: Vec3,
    /// `f |cos| / pdf`, all lobes counted; for a delta lobe the factor on radiance.
    pub weight: Rgb,
    /// Density per solid angle, all non-delta lobes counted; for a delta lobe the probability of having chosen it (only
    /// to compare: it is no density).
    pub pdf: f32,
    /// Whether the direction came from a delta lobe: light sampling cannot find it.
    pub is_delta: bool,
    /// Whether the direction crosses the surface.
    pub is_transmission: bool,
    /// Index of refraction on the side of `wi` over that on the side of `wo`; 1 for reflection. Roulette undoes the
    /// radiance scaling of refraction with its square.
    pub eta: f32,
}

/// Value and density for a pair of directions; delta lobes contribute to neither.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BsdfEval {
    /// `f(wo, wi) |cos wi|`.
    pub value: Rgb,
    /// Density per solid angle with which [`Bsdf::sample`] chooses `wi`.
    pub pdf: f32,
}

impl BsdfEval {
    /// The sample of the reflected direction `wi` that this value and density belong to; `None` if the density is 0.
    #[inline(always)]
    fn sampled(self, wi: Vec3) -> Option<BsdfSample> {
        let Self { value, pdf } = self;
        (pdf > 0.0).then(|| BsdfSample {
            wi,
            weight: value / pdf,
            pdf,
            is_delta: false,
            is_transmission: false,
            eta: 1.0,
        })
    }
}

/// Scattering at one point: all parameters are numbers.
#[derive(Clone, Debug, PartialEq)]
pub enum Bsdf {
    /// Ideal diffuse reflection.
    Lambert(Lambert),
    /// Rough diffuse reflection.
    Eon(Eon),
    /// Diffuse reflection and transmission.
    DiffuseTransmission(DiffuseTransmission),
    /// Ideal specular reflection with a given reflectance.
    Mirror(Mirror),
    /// Metal, smooth or rough.
    Conductor(Conductor),
    /// Glass, smooth or rough.
    Dielectric(Dielectric),
    /// A pane of glass.
    ThinDielectric(ThinDielectric),
    /// Diffuse beside a highlight.
    Glossy(Glossy),
    /// Diffuse beside Phong's cosine lobe.
    Phong(Phong),
    /// A diffuse base under a smooth or rough dielectric coat.
    Plastic(Plastic),
    /// Disney's model.
    Principled(Principled),
    /// A clear coat over another opaque one.
    Coated(PooledCoated),
    /// One of the above with Beckmann's microfacets.
    Beckmann(SingleScatteringBsdf<Beckmann>),
    /// One of the above with GGX microfacets masked on each side independently.
    SeparableGgx(SingleScatteringBsdf<SeparableGgx>),
    /// Scattering within a medium.
    Phase(Phase),
    /// A hair.
    Hair(Hair),
    /// Measured reflection.
    Measured(Measured),
}

// Constructed at every hit: no kind may make the others slower to pass around.
const _: () = assert!(size_of::<Bsdf>() <= 112);

macro_rules! each {
    ($self:expr, $bsdf:ident => $body:expr) => {
        match $self {
            Bsdf::Lambert($bsdf) => $body,
            Bsdf::Eon($bsdf) => $body,
            Bsdf::DiffuseTransmission($bsdf) => $body,
            Bsdf::Mirror($bsdf) => $body,
            Bsdf::ThinDielectric($bsdf) => $body,
            Bsdf::Glossy($bsdf) => $body,
            Bsdf::Phong($bsdf) => $body,
            Bsdf::Conductor($bsdf) => $body,
            Bsdf::Dielectric($bsdf) => $body,
            Bsdf::Plastic($bsdf) => $body,
            Bsdf::Principled($bsdf) => $body,
            Bsdf::Coated($bsdf) => $body,
            Bsdf::Beckmann($bsdf) => $body,
            Bsdf::SeparableGgx($bsdf) => $body,
            Bsdf::Phase($bsdf) => $body,
            Bsdf::Hair($bsdf) => $body,
            Bsdf::Measured($bsdf) => $body,
        }
    };
}

impl Bsdf {
    /// Value and density for `wi`; zero for delta lobes.
    #[inline]
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> BsdfEval {
        // By far the most common and cheapest: not worth a call.
        if let Self::Lambert(bsdf) = self { bsdf.eval(wo, wi) } else { self.eval_any(wo, wi) }
    }

    #[inline(never)]
    fn eval_any(&self, wo: Vec3, wi: Vec3) -> BsdfEval {
        each!(self, bsdf => bsdf.eval(wo, wi))
    }

    /// A direction chosen with density [`BsdfEval::pdf`]; `u_lobe` chooses among lobes, `u` within one. `None` where
    /// the sample fails or carries nothing.
    #[inline]
    pub fn sample(&self, wo: Vec3, u_lobe: f32, u: [f32; 2]) -> Option<BsdfSample> {
        if let Self::Lambert(bsdf) = self { bsdf.sample(wo, u_lobe, u) } else { Some(self.sample_any(wo, u_lobe, u)?) }
    }

    #[inline(never)]
    fn sample_any(&self, wo: Vec3, u_lobe: f32, u: [f32; 2]) -> Option<BsdfSample> {
        each!(self, bsdf => bsdf.sample(wo, u_lobe, u))
    }

    /// The lobes.
    #[inline]
    pub fn flags(&self) -> BsdfFlags {
        each!(self, bsdf => bsdf.flags())
    }

    /// Whether all lobes are those of microfacets so smooth that the light they scatter is a caustic; not for deltas.
    pub fn is_near_specular(&self) -> bool {
        let alpha = match self {
            Self::Conductor(bsdf) => bsdf.alpha(),
            Self::Dielectric(bsdf) => bsdf.alpha(),
            Self::Beckmann(bsdf) => bsdf.specular_alpha(),
            Self::SeparableGgx(bsdf) => bsdf.specular_alpha(),
            _ => return false,
        };
        let largest = alpha[0].max(alpha[1]);
        largest > 0.0 && largest <= NEAR_SPECULAR_ALPHA
    }

    /// Whether [`sample`](Self::sample) chooses between one specular reflection and other lobes, of reflection too. It
    /// then chooses the specular one where `u_lobe` is 0, if its probability is not 0.
    pub fn has_mixed_specular_reflection(&self) -> bool {
        let flags = self.flags();
        let is_mixed = flags.intersects(BsdfFlags::DIFFUSE | BsdfFlags::GLOSSY) && !flags.transmits();
        // Coat and base may have a specular reflection each.
        let is_single = !matches!(self, Self::Coated(bsdf) if bsdf.has_specular_base());
        flags.contains(BsdfFlags::SPECULAR) && is_mixed && is_single
    }

    /// An estimate of the fraction of light scattered, for the albedo layer.
    pub fn albedo(&self, wo: Vec3) -> Rgb {
        each!(self, bsdf => bsdf.albedo(wo))
    }
}
