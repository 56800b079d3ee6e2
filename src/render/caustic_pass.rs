//! Photons of caustics: one map for each epoch of samples.

use std::ops::RangeInclusive;
use std::sync::Mutex;

use super::epoch::trace_parts;
use super::tile_renderer::TileWorkspace;
use super::{LightTracing, Settings};
use crate::accel::Accelerator;
use crate::integrator::{
    CausticCasters, Caustics, DiscSamples, EPOCH, Integrator, PassContext, PhotonMap, PhotonRange, RayCounts,
    correct_for_coverage,
};
use crate::math::Vec2;
use crate::sampling::{PixelSeed, Sampler};
use crate::scene::Scene;

/// Photons traced in an epoch, by pixel of the picture.
const PHOTONS_PER_PIXEL: f64 = 0.25;

/// The fewest and the most photons traced in an epoch; the most take 600 MB.
const PHOTONS: RangeInclusive<f64> = 16_384.0..=4e6;

/// Photons are gathered within this many widths of a pixel at the median distance of what the camera sees, at first.
const RADIUS_IN_PIXELS: f32 = 2.0;

/// The least radius in the first epoch, as a part of the largest coordinate: photons' points are rounded to `f32`.
const LEAST_RADIUS: f32 = 1e-6;

/// Camera rays on each side of the picture that find this distance.
const PROBES: u32 = 48;

/// Traces photons and keeps those of one epoch.
pub(super) struct CausticPass {
    casters: CausticCasters,
    /// In an epoch.
    traced: u32,
    /// Whether they are those of the pilot.
    is_pilot: bool,
    /// In the first epoch.
    radius: f32,
    /// The epoch, and its photons.
    map: Option<(u32, PhotonMap)>,
}

impl CausticPass {
    /// For a scene; `None` if no photons are wanted, if nothing in it can cast caustics, or if the camera sees nothing.
    pub fn new(scene: &Scene, accel: &dyn Accelerator, settings: &Settings) -> Option<Self> {
        if !settings.may_trace(LightTracing::Photons) {
            return None;
        }
        let unsupported = [
            (scene.features.participating_media, "through media that scatter or emit light"),
            (scene.features.subsurface, "below surfaces"),
        ];
        if let Some((_, place)) = unsupported.into_iter().find(|(is_there, _)| *is_there) {
            if settings.light_tracing().is_some() {
                tracing::warn!("photons are not traced {place}");
            }
            return None;
        }
        let casters = CausticCasters::new(scene, settings.traces_delta_lights())?;
        let [width, height] = settings.size.map(f64::from);
        let traced = (PHOTONS_PER_PIXEL * width * height).clamp(*PHOTONS.start(), *PHOTONS.end()) as u32;
        let bounds = accel.bounds();
        let farthest = bounds.min.abs().max(bounds.max.abs()).max_element();
        let radius = RADIUS_IN_PIXELS * median_pixel_width(scene, accel, settings.size)?;
        let radius = radius.max(LEAST_RADIUS * farthest);
        Some(Self { casters, traced, is_pilot: false, radius, map: None })
    }

    /// For a pilot, or for the picture: fewer photons that are gathered within a larger radius, as many on average.
    #[must_use]
    pub fn for_pilot(self, is_pilot: bool) -> Self {
        Self { is_pilot, map: None, ..self }
    }

    /// Photons of an epoch of the picture over those of the pilot.
    pub fn per_pilot_photon(&self) -> f64 {
        f64::from(self.traced) / PHOTONS.start()
    }

    /// What paths read, if there are photons.
    pub fn caustics(&self) -> Option<Caustics<'_>> {
        let (_, photons) = self.map.as_ref().filter(|(_, photons)| !photons.is_empty())?;
        Some(Caustics { casters: &self.casters, photons, has_moments: self.is_pilot })
    }

    /// Traces the photons of a sample's epoch, unless they are there; the result is the rays traced.
    pub fn trace(
        &mut self,
        sample: u32,
        integrator: &dyn Integrator,
        pass: &PassContext,
        sampler: &Sampler,
        workspaces: &[Mutex<TileWorkspace>],
    ) -> RayCounts {
        let epoch = sample / EPOCH;
        if self.map.as_ref().is_some_and(|(known, _)| *known == epoch) {
            return RayCounts::default();
        }
        // Beyond all pixels.
        let seed: PixelSeed = sampler.pixel(epoch, u32::MAX);
        let traced = if self.is_pilot { *PHOTONS.start() as u32 } else { self.traced };
        let (mut photons, mut counts) = trace_parts(traced, workspaces, |indices, workspace, photons| {
            integrator.trace_photons(pass, &self.casters, &PhotonRange { seed, indices }, workspace, photons);
        });
        // Slower than the variance falls, so that both vanish (Knaus and Zwicker 2011, with alpha = 2/3).
        let factor =
            if self.is_pilot { self.per_pilot_photon().sqrt() as f32 } else { ((epoch + 1) as f32).powf(-1.0 / 6.0) };
        let radius = self.radius * factor;
        if !self.is_pilot {
            // Beyond all pixels too, and not those of the photons.
            let samples = DiscSamples { sampler, seed: sampler.pixel(epoch, u32::MAX - 3) };
            counts.indirect += correct_for_coverage(&mut photons, pass.world, radius, samples);
        }
        self.map = Some((epoch, PhotonMap::new(photons, traced, radius)));
        counts
    }
}

/// The median over the picture of the width of a pixel at what the camera sees.
fn median_pixel_width(scene: &Scene, accel: &dyn Accelerator, size: [u32; 2]) -> Option<f32> {
    let at = |i: u32, side: u32| (i as f32 + 0.5) / PROBES as f32 * side as f32;
    let mut widths: Vec<f32> = (0..PROBES * PROBES)
        .filter_map(|i| {
            let film = Vec2::new(at(i % PROBES, size[0]), at(i / PROBES, size[1]));
            let ray = scene.camera.ray(film, size, [0.5; 2], 0.0);
            let hit = accel.intersect(&ray)?;
            Some(scene.camera.pixel_cone(&ray, size).width_at(hit.t))
        })
        .filter(|width| *width > 0.0 && width.is_finite())
        .collect();
    widths.sort_unstable_by(f32::total_cmp);
    widths.get(widths.len() / 2).copied()
}
