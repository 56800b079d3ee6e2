//! The pilot of what is traced from the lights: light paths, whose vertices paths are connected to, or photons, which
//! paths gather. It depends on the scene, the view and the seed alone.

use std::sync::Mutex;

use super::LightTracing;
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

/// Connections are chosen over photons that are worth their time too where their gain by [`COMPARISON`] is certain to
/// be this many times as high as that of photons seems.
const LEAST_ADVANTAGE: f64 = 1.5;

/// The same where light paths start at lights at infinity. Their gain is estimated too high, as above: as 4 of an
/// interior under the sun, where 16 samples have 1.4 times less error; that of photons as 1.2, where they have as much
/// less.
const LEAST_DISTANT_ADVANTAGE: f64 = 3.0;

/// For which of two methods that are is better.
const COMPARISON: GainBound = GainBound { left_out: 0.05, deviations: 2.0 };

/// Inverse variance for the time over that of unidirectional paths, by [`COMPARISON`].
#[derive(Clone, Copy)]
struct Efficiency {
    at_least: f64,
    expected: f64,
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
        let advantage = if light_paths.has_distant_emitters() { LEAST_DISTANT_ADVANTAGE } else { LEAST_ADVANTAGE };
        Some((efficiency?.at_least, advantage))
    });
    let photons = caustics.and_then(|caustics| {
        let per_pilot_photon = caustics.per_pilot_photon();
        pilot.renderer.caustics = Some(caustics.for_pilot(true));
        let efficiency = pilot.efficiency(per_pilot_photon, None);
        let caustics = &mut pilot.renderer.caustics;
        *caustics = caustics.take().map(|caustics| caustics.for_pilot(false));
        efficiency
    });
    renderer.light_paths = light_paths;
    match (connections, photons) {
        (Some((at_least, advantage)), Some(photons)) if at_least > advantage * photons.expected => {
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
        let at_least = |GainBound { left_out, deviations }: GainBound| {
            samples.gain(left_out).map(|gain| (gain.value - deviations * gain.deviation) / cost)
        };
        at_least(WORTHWHILE).filter(|&efficiency| efficiency > 1.0)?;
        if let Some(bound) = widespread {
            at_least(bound).filter(|&efficiency| efficiency > LEAST_EFFICIENCY)?;
        }
        let expected = GainBound { deviations: 0.0, ..COMPARISON };
        Some(Efficiency { at_least: at_least(COMPARISON)?, expected: at_least(expected)? })
    }
}

fn trace(renderer: &TileRenderer, samples: u32, workspaces: &[Mutex<TileWorkspace>]) -> PilotSamples {
    let render = |samples: &mut dyn Iterator<Item = _>, workspace: &mut TileWorkspace| {
        renderer.render_samples(samples, Guidance::default(), workspace);
    };
    let moments = |workspace: &TileWorkspace| workspace.integrator.pilot_moments().to_vec();
    PilotSamples::trace(renderer.whole_view(), samples, workspaces, render, moments)
}
