//! The pilot of what is traced from the lights: light paths, whose vertices paths are connected to, or photons, which
//! paths gather. It depends on the scene, the view and the seed alone.

use std::sync::Mutex;

use super::LightTracing;
use super::light_path_pass::LightPathPass;
use super::pilot_samples::{FIRST_SAMPLE, PilotSamples};
use super::tile_renderer::{TileRenderer, TileWorkspace};
use crate::integrator::{EPOCH, Guidance};

/// Samples of a pilot pixel with a method, of one epoch, and without; the latter give the number of rays, and show
/// where there is no noise.
const SAMPLES: u32 = EPOCH;
const UNIDIRECTIONAL_SAMPLES: u32 = 2;

/// The least variance of unidirectional paths over the square of the colour, and the least difference of their mean
/// from that with a method: one of these must be there.
const LEAST_NOISE: f64 = 1e-4;
const LEAST_DIFFERENCE: f64 = 0.05;

/// The time of a ray of a path with connections or photons over that of another, connections or gathering included.
const RAY_COST: f64 = 1.25;

/// How a lower bound of a gain is estimated.
#[derive(Clone, Copy)]
struct GainBound {
    /// The part of the pixels, those where a method gains most, that is left out: what rare bright samples seem to gain
    /// is less certain than the deviation shows.
    left_out: f64,
    /// How many standard deviations the gain may be less than it seems.
    deviations: f64,
}

/// For whether a method is worth its time: caustics often cover one pixel of a hundred.
const WORTHWHILE: GainBound = GainBound { left_out: 0.002, deviations: 1.0 };

/// For connections: light of lamps and windows is in all of a picture.
const WIDESPREAD: GainBound = GainBound { left_out: 0.05, deviations: 1.0 };

/// Connections are worth their time where they gain this many times more by [`WIDESPREAD`]: more samples of a pixel are
/// better spread, by which paths without connections gain more.
const LEAST_EFFICIENCY: f64 = 1.5;

/// For which of two methods that are is better.
const COMPARISON: GainBound = GainBound { left_out: 0.05, deviations: 2.0 };

/// Where both are worth their time, connections are chosen over photons if the lower bound of their efficiency is this
/// many times the estimate of that of photons.
const LEAST_ADVANTAGE: f64 = 1.5;

/// The same where light paths start at lights at infinity. The gain of connections is estimated too high there: as 4 of
/// an interior under the sun, where 16 samples have 1.4 times less error; that of photons as 1.2, where they have as
/// much less.
const LEAST_DISTANT_ADVANTAGE: f64 = 3.0;

/// Inverse variance for the time over that of unidirectional paths, by [`COMPARISON`].
#[derive(Clone, Copy)]
struct Efficiency {
    estimate: f64,
    lower_bound: f64,
}

/// A pilot being traced, with samples without any method.
struct Pilot<'a, 'b> {
    renderer: &'a mut TileRenderer<'b>,
    workspaces: &'a [Mutex<TileWorkspace>],
    unidirectional: PilotSamples,
}

/// What lowers the error by more than it costs, and by most, of what `renderer` has.
pub(super) fn choose(renderer: &mut TileRenderer, workspaces: &[Mutex<TileWorkspace>]) -> LightTracing {
    let (light_paths, caustics) = (renderer.light_paths.take(), renderer.caustics.take());
    if light_paths.is_none() && caustics.is_none() {
        return LightTracing::Off;
    }
    let unidirectional = trace(renderer, UNIDIRECTIONAL_SAMPLES, workspaces);
    let mut pilot = Pilot { renderer, workspaces, unidirectional };
    let connections = light_paths.as_ref().and_then(|light_paths| {
        pilot.renderer.light_paths = Some(light_paths.for_pilot());
        let efficiency = pilot.efficiency(light_paths.per_pilot_path(), Some(WIDESPREAD));
        pilot.renderer.light_paths = None;
        efficiency
    });
    let is_distant = light_paths.as_ref().is_some_and(LightPathPass::has_distant_emitters);
    let photons = caustics.and_then(|caustics| {
        let per_pilot_photon = caustics.per_pilot_photon();
        pilot.renderer.caustics = Some(caustics.for_pilot(true));
        let efficiency = pilot.efficiency(per_pilot_photon, None);
        let caustics = &mut pilot.renderer.caustics;
        *caustics = caustics.take().map(|caustics| caustics.for_pilot(false));
        efficiency
    });
    renderer.light_paths = light_paths;
    better(connections, photons, if is_distant { LEAST_DISTANT_ADVANTAGE } else { LEAST_ADVANTAGE })
}

/// The better of two methods, each if it is worth its time.
fn better(connections: Option<Efficiency>, photons: Option<Efficiency>, least_advantage: f64) -> LightTracing {
    match (connections, photons) {
        (Some(connections), Some(photons)) if connections.lower_bound > least_advantage * photons.estimate => {
            LightTracing::Bidirectional
        }
        (_, Some(_)) => LightTracing::Photons,
        (Some(_), None) => LightTracing::Bidirectional,
        (None, None) => LightTracing::Off,
    }
}

impl Pilot<'_, '_> {
    /// With what the renderer has; `None` where that is not worth its time, also by the bound of a method whose light
    /// is widespread. Of rays from lights, the picture has `light_ray_factor` times as many.
    fn efficiency(&mut self, light_ray_factor: f64, widespread: Option<GainBound>) -> Option<Efficiency> {
        let light_rays = self.renderer.trace_from_lights(FIRST_SAMPLE, self.workspaces).total() as f64;
        let samples = trace(self.renderer, SAMPLES, self.workspaces);
        // They are shared by all samples of an epoch.
        let shared_by = f64::from(EPOCH) * self.renderer.whole_view().area() as f64;
        let light_rays = light_rays * light_ray_factor / shared_by;
        let cost = RAY_COST * (samples.rays() + light_rays) / self.unidirectional.rays();
        let gains = [WORTHWHILE, COMPARISON].map(|bound| samples.gain(bound.left_out));
        tracing::info!("pilot of light tracing: {gains:?} for {cost:.2} of the time");
        // Where paths find all light and have hardly any noise, what they add from vertex to vertex cancels out.
        let have_noise = self.unidirectional.relative_variance() > LEAST_NOISE;
        let miss_light = (self.unidirectional.mean() / samples.mean() - 1.0).abs() > LEAST_DIFFERENCE;
        if !have_noise && !miss_light {
            return None;
        }
        let lower_bound = |GainBound { left_out, deviations }: GainBound| {
            samples.gain(left_out).map(|gain| (gain.value - deviations * gain.deviation) / cost)
        };
        lower_bound(WORTHWHILE).filter(|&efficiency| efficiency > 1.0)?;
        if let Some(bound) = widespread {
            lower_bound(bound).filter(|&efficiency| efficiency > LEAST_EFFICIENCY)?;
        }
        let estimate = lower_bound(GainBound { deviations: 0.0, ..COMPARISON })?;
        Some(Efficiency { estimate, lower_bound: lower_bound(COMPARISON)? })
    }
}

fn trace(renderer: &TileRenderer, samples: u32, workspaces: &[Mutex<TileWorkspace>]) -> PilotSamples {
    let render = |samples: &mut dyn Iterator<Item = _>, workspace: &mut TileWorkspace| {
        renderer.render_samples(samples, Guidance::default(), workspace);
    };
    let moments = |workspace: &TileWorkspace| workspace.integrator.pilot_moments().to_vec();
    PilotSamples::trace(renderer.whole_view(), samples, workspaces, render, moments)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn efficiency(gain: f64, deviation: f64, cost: f64) -> Option<Efficiency> {
        Some(Efficiency { estimate: gain / cost, lower_bound: (gain - 2.0 * deviation) / cost })
    }

    #[test]
    fn connections_are_chosen_over_photons_by_a_certain_advantage() {
        let (photons, bidirectional) = (LightTracing::Photons, LightTracing::Bidirectional);
        // Balls of glass, with one bright sample; a box with a block of copper; the same gains under a sun.
        let glass = efficiency(24.3, 13.2, 1.25);
        assert_eq!(better(efficiency(14.4, 9.9, 1.57), glass, LEAST_ADVANTAGE), photons);
        let (connections, copper) = (efficiency(2.67, 0.05, 1.55), efficiency(1.14, 0.02, 1.24));
        assert_eq!(better(connections, copper, LEAST_ADVANTAGE), bidirectional);
        assert_eq!(better(connections, copper, LEAST_DISTANT_ADVANTAGE), photons);
        assert_eq!(better(connections, None, LEAST_DISTANT_ADVANTAGE), bidirectional);
        assert_eq!(better(None, copper, LEAST_ADVANTAGE), photons);
        assert_eq!(better(None, None, LEAST_ADVANTAGE), LightTracing::Off);
    }
}
