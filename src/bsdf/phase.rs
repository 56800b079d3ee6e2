//! Phase functions: scattering at a point within a medium, normalised over the sphere.

use std::f32::consts::{PI, TAU};

use super::{BsdfEval, BsdfFlags, BsdfSample};
use crate::color::Rgb;
use crate::math::{Frame, Vec3, vec3};

/// Below this, Henyey and Greenstein's function is sampled as if it were isotropic in the cosine.
const ISOTROPIC: f32 = 1e-3;

/// The most lobes of a phase function.
pub const MAX_PHASE_LOBES: usize = 4;

/// How a medium scatters light: a mean of lobes. As a [`Bsdf`](super::Bsdf) it has no cosine, and both sides of the
/// frame are alike.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Phase {
    /// Those after the first `count` have no weight.
    lobes: [WeightedLobe; MAX_PHASE_LOBES],
    count: u32,
}

/// A lobe with its share of what is scattered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WeightedLobe {
    /// From 0 to 1.
    pub weight: f32,
    /// The lobe.
    pub lobe: PhaseLobe,
}

/// One lobe of a phase function.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PhaseLobe {
    /// Henyey and Greenstein's: `g` is the mean cosine of the angle by which light is deflected, within `(-1, 1)`;
    /// positive for forward scattering.
    HenyeyGreenstein {
        /// The mean cosine.
        g: f32,
    },
    /// Rayleigh's, for particles much smaller than the wavelength.
    Rayleigh,
}

impl From<PhaseLobe> for Phase {
    fn from(lobe: PhaseLobe) -> Self {
        Self::single(lobe)
    }
}

impl Phase {
    /// The same towards all directions.
    pub const ISOTROPIC: Self = Self::single(PhaseLobe::HenyeyGreenstein { g: 0.0 });

    const fn single(lobe: PhaseLobe) -> Self {
        let none = WeightedLobe { weight: 0.0, lobe: PhaseLobe::HenyeyGreenstein { g: 0.0 } };
        Self { lobes: [WeightedLobe { weight: 1.0, lobe }, none, none, none], count: 1 }
    }

    /// The mean of lobes by their weights, which need not sum to 1; `None` without a weight above 0, and of more than
    /// [`MAX_PHASE_LOBES`] that have one.
    pub fn mean(lobes: &[WeightedLobe]) -> Option<Self> {
        let all: f32 = lobes.iter().map(|lobe| lobe.weight).sum();
        let mut mean = Self { count: 0, ..Self::ISOTROPIC };
        mean.lobes[0].weight = 0.0;
        for &WeightedLobe { weight, lobe } in lobes.iter().filter(|lobe| lobe.weight > 0.0) {
            *mean.lobes.get_mut(mean.count as usize)? = WeightedLobe { weight: weight / all, lobe };
            mean.count += 1;
        }
        (mean.count > 0).then_some(mean)
    }

    /// The lobes.
    #[inline]
    pub fn lobes(&self) -> &[WeightedLobe] {
        &self.lobes[..self.count as usize]
    }

    /// Density per solid angle of the direction `wi` for light that goes along `-wo`; also the value.
    #[inline]
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        let cos = -wo.dot(wi);
        self.lobes().iter().map(|lobe| lobe.weight * lobe.lobe.pdf(cos)).sum()
    }

    /// The lobe that `u` in `[0, 1)` chooses by the weights.
    fn choose(&self, mut u: f32) -> PhaseLobe {
        let (last, others) = self.lobes[..self.count as usize].split_last().unwrap_or((&self.lobes[0], &[]));
        for other in others {
            if u < other.weight {
                return other.lobe;
            }
            u -= other.weight;
        }
        last.lobe
    }

    /// The phase function.
    #[inline]
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> BsdfEval {
        let pdf = self.pdf(wo, wi);
        BsdfEval { value: Rgb::splat(pdf), pdf }
    }

    /// A direction with the density of the phase function.
    #[inline]
    pub fn sample(&self, wo: Vec3, u_lobe: f32, [u, v]: [f32; 2]) -> Option<BsdfSample> {
        let cos = self.choose(u_lobe).sample_cos(u).clamp(-1.0, 1.0);
        let sin = (1.0 - cos * cos).sqrt();
        let (sin_phi, cos_phi) = (TAU * v).sin_cos();
        let wi = Frame::from_normal(-wo).to_world(vec3(sin * cos_phi, sin * sin_phi, cos));
        Some(BsdfSample {
            wi,
            weight: Rgb::WHITE,
            pdf: self.pdf(wo, wi),
            is_delta: false,
            is_transmission: false,
            eta: 1.0,
        })
    }

    /// The lobes, as those of a surface.
    #[inline]
    pub fn flags(&self) -> BsdfFlags {
        BsdfFlags::GLOSSY | BsdfFlags::REFLECTION | BsdfFlags::TRANSMISSION
    }

    /// All light.
    pub fn albedo(&self, _wo: Vec3) -> Rgb {
        Rgb::WHITE
    }
}

impl PhaseLobe {
    /// Density per solid angle at the cosine of the angle of deflection.
    #[inline]
    fn pdf(&self, cos: f32) -> f32 {
        match *self {
            Self::HenyeyGreenstein { g } => {
                // 1 + g² - 2 g cos, without cancellation near the peak.
                let d = if g >= 0.0 {
                    (1.0 - g) * (1.0 - g) + 2.0 * g * (1.0 - cos)
                } else {
                    (1.0 + g) * (1.0 + g) - 2.0 * g * (1.0 + cos)
                };
                (1.0 - g * g) / (4.0 * PI * d * d.sqrt())
            }
            Self::Rayleigh => 3.0 / (16.0 * PI) * (1.0 + cos * cos),
        }
    }

    /// The cosine of the angle of deflection.
    fn sample_cos(&self, u: f32) -> f32 {
        match *self {
            Self::HenyeyGreenstein { g } if g.abs() < ISOTROPIC => 2.0 * u - 1.0 + 1.5 * g * (4.0 * u * (1.0 - u)),
            Self::HenyeyGreenstein { g } => {
                let s = (1.0 - g * g) / (1.0 - g + 2.0 * g * u);
                (1.0 + g * g - s * s) / (2.0 * g)
            }
            // The root of (cos³ + 3 cos + 4) / 8 = u.
            Self::Rayleigh => {
                let z = 2.0 * (2.0 * u - 1.0);
                let a = (z.abs() + (z * z + 1.0).sqrt()).cbrt();
                (a - a.recip()).copysign(z)
            }
        }
    }
}
