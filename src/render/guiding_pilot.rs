//! The pilot of path guiding, with a guide that has learned from the picture's first samples.

use std::sync::Mutex;

use super::pilot_samples::{Estimate, PilotSamples};
use super::tile_renderer::{TileRenderer, TileWorkspace};
use crate::film::Crop;
use crate::guiding::Guide;
use crate::integrator::{Guidance, PilotMoments, SecondMoments};

/// Samples of a pilot pixel with and without the guide; the latter give the brightness alone.
const SAMPLES: u32 = 16;
const UNGUIDED_SAMPLES: u32 = 2;

/// The least gain of a guide that may pay, and how many standard deviations it may have missed that by.
const LEAST_GAIN: f64 = 1.15;
const CONFIDENCE: f64 = 2.0;

/// What traces the pilot.
#[derive(Clone, Copy)]
pub(super) struct GuidingPilot<'a> {
    pub renderer: &'a TileRenderer<'a>,
    pub workspaces: &'a [Mutex<TileWorkspace>],
    /// The pixels of the picture, on the film's grid.
    pub crop: Crop,
}

/// Whether a guide with this gain, the variance of a sample without it over that with it, may pay once it has learned
/// more. After so few samples it seems to gain less than it will.
pub(super) fn may_pay(gain: Estimate) -> bool {
    gain.value + CONFIDENCE * gain.deviation > LEAST_GAIN
}

impl GuidingPilot<'_> {
    /// Samples that `guide` guides.
    pub fn guided(&self, guide: &Guide) -> PilotSamples {
        self.trace(Some(guide), SAMPLES)
    }

    /// Samples without guide.
    pub fn unguided(&self) -> PilotSamples {
        self.trace(None, UNGUIDED_SAMPLES)
    }

    fn trace(&self, guide: Option<&Guide>, samples: u32) -> PilotSamples {
        let guidance = Guidance { guide, learner: None, has_moments: guide.is_some() };
        let moments = |workspace: &TileWorkspace| {
            let moments = if guide.is_some() { workspace.integrator.second_moments() } else { Vec::new() };
            let excess = |moments: &SecondMoments| [0, 1, 2].map(|k| moments.unguided[k] - moments.guided[k]);
            moments.iter().map(|of| PilotMoments { excess: excess(of), ..PilotMoments::default() }).collect()
        };
        let render = |samples: &mut dyn Iterator<Item = _>, workspace: &mut TileWorkspace| {
            self.renderer.render_samples(samples, guidance, workspace);
        };
        PilotSamples::trace(self.crop, samples, self.workspaces, render, moments)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn guides_that_may_gain_more_than_it_seems_may_pay() {
        let may_pay = |value, deviation| may_pay(Estimate { value, deviation });
        assert!(may_pay(3.0, 0.0) && !may_pay(1.0625, 0.0) && may_pay(1.125, 0.03));
    }
}
