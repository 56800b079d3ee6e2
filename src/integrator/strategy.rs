//! How paths find lights.

use crate::desc::StrategyDesc;
use crate::light::FoundBy;

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
    pub(super) fn found_by(self) -> FoundBy {
        if self == Self::Mis { FoundBy::Both } else { FoundBy::Lights }
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
