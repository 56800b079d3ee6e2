//! Light paths: one set for each epoch of samples.

use std::ops::RangeInclusive;
use std::sync::Mutex;

use super::epoch::trace_parts;
use super::tile_renderer::TileWorkspace;
use super::{LightTracing, Settings};
use crate::integrator::{EPOCH, Emitters, Integrator, LightPaths, LightVertex, PassContext, PhotonRange, RayCounts};
use crate::sampling::{PixelSeed, Sampler};
use crate::scene::Scene;

/// Light paths traced in an epoch, by pixel of the picture.
const PATHS_PER_PIXEL: f64 = 0.5;

/// The fewest and the most light paths traced in an epoch; the most take 200 MB.
const PATHS: RangeInclusive<f64> = 16_384.0..=250_000.0;

/// Traces light paths and keeps those of one epoch.
pub(super) struct LightPathPass {
    emitters: Emitters,
    /// Whether they are those of the pilot.
    is_pilot: bool,
    /// Light paths of an epoch.
    traced: u32,
    /// The epoch, and the vertices of its paths.
    vertices: Option<(u32, Vec<LightVertex>)>,
}

impl LightPathPass {
    /// For a scene; `None` if no light path can start in it, or if none is wanted.
    pub fn new(scene: &Scene, settings: &Settings) -> Option<Self> {
        if !settings.may_trace(LightTracing::Bidirectional) {
            return None;
        }
        let features = &scene.features;
        let unsupported = [
            (features.media, "media"),
            (features.subsurface, "random walks below surfaces"),
            (features.motion, "motion while the shutter is open"),
        ];
        if let Some((_, what)) = unsupported.into_iter().find(|(is_there, _)| *is_there) {
            if settings.light_tracing().is_some() {
                tracing::warn!("bidirectional path tracing does not support {what}: paths are not connected");
            }
            return None;
        }
        let emitters = Emitters::new(scene)?;
        let [width, height] = settings.size.map(f64::from);
        let traced = (PATHS_PER_PIXEL * width * height).clamp(*PATHS.start(), *PATHS.end()) as u32;
        Some(Self { emitters, is_pilot: false, traced, vertices: None })
    }

    /// As many light paths as a pilot needs.
    pub fn for_pilot(&self) -> Self {
        let (emitters, traced) = (self.emitters.clone(), self.pilot_paths());
        Self { emitters, is_pilot: true, traced, vertices: None }
    }

    /// Light paths of an epoch over those of the pilot.
    pub fn per_pilot_path(&self) -> f64 {
        f64::from(self.traced) / f64::from(self.pilot_paths())
    }

    fn pilot_paths(&self) -> u32 {
        self.traced.min(*PATHS.start() as u32)
    }

    /// What paths are connected to, if there is anything.
    pub fn light_paths(&self) -> Option<LightPaths<'_>> {
        let (_, vertices) = self.vertices.as_ref().filter(|(_, vertices)| !vertices.is_empty())?;
        Some(LightPaths { emitters: &self.emitters, vertices, traced: self.traced, has_moments: self.is_pilot })
    }

    /// Traces the light paths of a sample's epoch, unless they are there; the result is the rays traced.
    pub fn trace(
        &mut self,
        sample: u32,
        integrator: &dyn Integrator,
        pass: &PassContext,
        sampler: &Sampler,
        workspaces: &[Mutex<TileWorkspace>],
    ) -> RayCounts {
        let epoch = sample / EPOCH;
        if self.vertices.as_ref().is_some_and(|(known, _)| *known == epoch) {
            return RayCounts::default();
        }
        // Beyond all pixels, and beside the photons' seeds.
        let seed: PixelSeed = sampler.pixel(epoch, u32::MAX - 1);
        let (vertices, counts) = trace_parts(self.traced, workspaces, |indices, workspace, vertices| {
            integrator.trace_light_paths(pass, &self.emitters, &PhotonRange { seed, indices }, workspace, vertices);
        });
        self.vertices = Some((epoch, vertices));
        counts
    }
}
