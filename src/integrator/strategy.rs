//! How paths find lights.

use crate::desc::StrategyDesc;
use crate::light::MisCompensation;

/// How directions towards lights are found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Strategy {
    /// Sampling lights and sampling the BSDF, combined.
    #[default]
    Mis,
    /// Sampling lights wherever possible.
    Light,
    /// Sampling the BSDF wherever possible.
    Bsdf,
}

impl Strategy {
    /// What finds the lights' directions.
    #[inline]
    pub(super) fn compensation(self) -> MisCompensation {
        if self == Self::Mis { MisCompensation::On } else { MisCompensation::Off }
    }
}

impl From<StrategyDesc> for Strategy {
    fn from(desc: StrategyDesc) -> Self {
        match desc {
            StrategyDesc::Mis => Self::Mis,
            StrategyDesc::Light => Self::Light,
            StrategyDesc::Bsdf => Self::Bsdf,
        }
    }
}
