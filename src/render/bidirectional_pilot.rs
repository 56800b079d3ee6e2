//! The pilot of bidirectional path tracing, whose samples are connected to light paths. It depends on the scene, the
//! view and the seed alone.

use std::sync::Mutex;

use super::light_path_pass::LightPathPass;
use super::pilot_samples::{FIRST_SAMPLE, PilotSamples};
use super::tile_renderer::{TileRenderer, TileWorkspace};
use crate::integrator::{EPOCH, Guidance};

/// Samples of a pilot pixel with connections, of one epoch, and without; the latter give the number of rays, and
/// show where there is no noise.
const SAMPLES: u32 = EPOCH;
const UNCONNECTED_SAMPLES: u32 = 2;

/// The least variance of unconnected paths over the square of the colour, and the least difference of their mean from
/// that of connected ones: one of these must be there.
const LEAST_NOISE: f64 = 1e-4;
const LEAST_DIFFERENCE: f64 = 0.05;

/// The time of a ray of a connected path over that of another, connections included.
const RAY_COST: f64 = 1.25;

/// The part of the pixels, those where connections gain most, that is left out: what rare bright samples seem to gain
/// is less certain than the deviation shows.
const LEFT_OUT: f64 = 0.02;

/// How many standard deviations the gain may be less than it seems.
const CONFIDENCE: f64 = 2.0;

/// Whether connections to light paths lower the error by more than they cost. `renderer` has none yet.
pub(super) fn pays(
    renderer: &mut TileRenderer,
    light_paths: &LightPathPass,
    workspaces: &[Mutex<TileWorkspace>],
) -> bool {
    let unconnected = trace(renderer, UNCONNECTED_SAMPLES, workspaces);
    renderer.light_paths = Some(light_paths.for_pilot());
    let light_rays = renderer.trace_from_lights(FIRST_SAMPLE, workspaces).total() as f64;
    let connected = trace(renderer, SAMPLES, workspaces);
    renderer.light_paths = None;
    // Light paths are shared by all samples of an epoch.
    let samples = f64::from(EPOCH) * renderer.whole_view().area() as f64;
    let light_rays = light_rays * light_paths.per_pilot_path() / samples;
    let cost = RAY_COST * (connected.rays() + light_rays) / unconnected.rays();
    let gain = connected.gain(LEFT_OUT);
    tracing::info!("pilot of bidirectional paths: {gain:?} for {cost:.2} of the time");
    // Where paths find all light and have hardly any noise, what they add from vertex to vertex cancels out.
    let have_noise = unconnected.relative_variance() > LEAST_NOISE;
    let miss_light = (unconnected.mean() / connected.mean() - 1.0).abs() > LEAST_DIFFERENCE;
    (have_noise || miss_light) && gain.is_some_and(|gain| gain.value - CONFIDENCE * gain.deviation > cost)
}

fn trace(renderer: &TileRenderer, samples: u32, workspaces: &[Mutex<TileWorkspace>]) -> PilotSamples {
    let render = |samples: &mut dyn Iterator<Item = _>, workspace: &mut TileWorkspace| {
        renderer.render_samples(samples, Guidance::default(), workspace);
    };
    let excess = |workspace: &TileWorkspace| workspace.integrator.excess_moments().to_vec();
    PilotSamples::trace(renderer.whole_view(), samples, workspaces, render, excess)
}
