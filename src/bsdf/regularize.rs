//! Rough surfaces made rougher, for paths whose light would come through too narrow a lobe (Kaplanyan and Dachsbacher,
//! "Path Space Regularization for Holistic and Robust Light Transport").

use super::{Bsdf, Coated, Microfacets, SingleScatteringBsdf};

impl Bsdf {
    /// The same scattering with an alpha of at least `alpha`, within `[0, 1]`, along both tangents; what lies below a
    /// coat and how much the coat lets through stay. `None` if nothing is narrower: diffuse and ideally smooth
    /// surfaces, Phong's own lobe and what was measured stay as they are.
    pub fn with_min_alpha(&self, alpha: f32) -> Option<Self> {
        Some(match self {
            Self::Conductor(bsdf) => Self::Conductor(bsdf.with_alpha(widened(bsdf.alpha(), alpha)?)),
            Self::Dielectric(bsdf) => Self::Dielectric(bsdf.with_alpha(widened(bsdf.alpha(), alpha)?)),
            Self::Plastic(bsdf) => Self::Plastic(super::Plastic {
                coat: bsdf.coat.with_alpha(widened(bsdf.coat.alpha(), alpha)?),
                ..*bsdf
            }),
            Self::Principled(bsdf) => Self::Principled(bsdf.with_alpha(widened(bsdf.alpha(), alpha)?)),
            Self::Glossy(bsdf) => Self::Glossy(bsdf.with_alpha(widened(bsdf.alpha(), alpha)?)),
            Self::Coated(bsdf) => Self::Coated(Coated::with_min_alpha(bsdf, alpha)?.into()),
            Self::Beckmann(bsdf) => Self::Beckmann(bsdf.with_min_alpha(alpha)?),
            Self::SeparableGgx(bsdf) => Self::SeparableGgx(bsdf.with_min_alpha(alpha)?),
            Self::Lambert(_)
            | Self::Eon(_)
            | Self::DiffuseTransmission(_)
            | Self::Mirror(_)
            | Self::ThinDielectric(_)
            | Self::Phong(_)
            | Self::Phase(_)
            | Self::Hair(_)
            | Self::Measured(_) => return None,
        })
    }
}

impl<D: Microfacets> SingleScatteringBsdf<D> {
    fn with_min_alpha(&self, alpha: f32) -> Option<Self> {
        Some(match self {
            Self::Conductor(bsdf) => Self::Conductor(bsdf.with_single_scattering_alpha(widened(bsdf.alpha(), alpha)?)),
            Self::Dielectric(bsdf) => {
                Self::Dielectric(bsdf.with_single_scattering_alpha(widened(bsdf.alpha(), alpha)?))
            }
            Self::Plastic(bsdf) => Self::Plastic(super::Plastic {
                coat: bsdf.coat.with_alpha(widened(bsdf.coat.alpha(), alpha)?),
                ..*bsdf
            }),
        })
    }
}

/// Alphas of at least `least`, if there is one below and the surface is rough.
pub(super) fn widened(alpha: [f32; 2], least: f32) -> Option<[f32; 2]> {
    let is_narrower = alpha[0] > 0.0 && alpha[0].min(alpha[1]) < least;
    is_narrower.then(|| alpha.map(|a| a.max(least)))
}
