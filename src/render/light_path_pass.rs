//! Light paths: one set for each epoch of samples.

use std::ops::RangeInclusive;
use std::sync::{Arc, Mutex};

use super::epoch::trace_parts;
use super::tile_renderer::TileWorkspace;
use super::{LightTracing, Settings};
use crate::geometry::SpawnPoint;
use crate::integrator::{
    ClusteredVertices, ConnectionPilot, ConnectionTables, EPOCH, Emitters, Integrator, LightPaths, LightVertex,
    PassContext, PhotonRange, PilotRecords, RayCounts,
};
use crate::math::Aabb;
use crate::sampling::{PixelSeed, Sampler};
use crate::scene::Scene;

/// Light paths traced in an epoch, by pixel of the picture.
const PATHS_PER_PIXEL: f64 = 0.5;

/// The fewest and the most light paths traced in an epoch; the most take 200 MB.
const PATHS: RangeInclusive<f64> = 16_384.0..=250_000.0;

/// Shadow rays for the tables by which vertices are chosen, by pixel of the picture: for the pilot that decides whether
/// paths are connected, for the first epochs of the picture, and for those from [`LATER`] on.
const TABLE_RAYS_PER_PIXEL: [u64; 3] = [1, 8, 24];

/// From this epoch on there are so many samples that better tables pay.
const LATER: u32 = 2;

/// The most points of paths from the camera that tables are made for.
const MAX_POINTS: usize = 1 << 17;

/// The epoch of the light paths that the tables are made from, beyond those of samples.
const TABLE_EPOCH: u32 = u32::MAX;

/// Traces light paths and keeps those of one epoch.
pub(super) struct LightPathPass {
    /// Where they start, once that is known.
    emitters: Option<Emitters>,
    /// Points where paths from the camera were scattered, with their facing normals, and the box around most of them.
    points: Arc<[SpawnPoint]>,
    bounds: Aabb,
    /// Whether they are those of the pilot.
    is_pilot: bool,
    /// Light paths of an epoch.
    traced: u32,
    /// Pixels of the picture.
    pixels: u64,
    /// By which vertices are chosen, with the index of their number of rays.
    tables: Option<(usize, ConnectionTables)>,
    /// The epoch, and the vertices of its paths.
    vertices: Option<(u32, Vec<LightVertex>, ClusteredVertices)>,
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
        if !Emitters::may_start(scene) {
            return None;
        }
        let [width, height] = settings.size.map(f64::from);
        let traced = (PATHS_PER_PIXEL * width * height).clamp(*PATHS.start(), *PATHS.end()) as u32;
        let pixels = (width * height) as u64;
        let points = Arc::default();
        Some(Self {
            emitters: None,
            points,
            bounds: Aabb::EMPTY,
            is_pilot: false,
            traced,
            pixels,
            tables: None,
            vertices: None,
        })
    }

    /// As many light paths as a pilot needs.
    pub fn for_pilot(&self) -> Self {
        let (emitters, points) = (self.emitters.clone(), self.points.clone());
        Self { emitters, points, is_pilot: true, traced: self.pilot_paths(), tables: None, vertices: None, ..*self }
    }

    /// With what a pilot of paths from the camera has found; `None` if no light path can start.
    pub fn with_pilot(self, scene: &Scene, pilot: &PilotRecords) -> Option<Self> {
        let bounds = pilot.bounds();
        let step = pilot.continuations.len().div_ceil(MAX_POINTS).max(1);
        let points = pilot.continuations.iter().step_by(step).filter(|record| record.p.is_finite()).map(|record| {
            // The point was rounded.
            let error = f32::EPSILON * record.p.abs().max_element();
            SpawnPoint { p: record.p.as_dvec3(), n: record.n, error }
        });
        let emitters = Some(Emitters::new(scene, pilot, bounds)?);
        Some(Self { emitters, points: points.collect(), bounds, ..self })
    }

    /// Whether light paths start at lights at infinity.
    pub fn has_distant_emitters(&self) -> bool {
        self.emitters.as_ref().is_some_and(Emitters::has_distant)
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
        let (_, vertices, clustered) = self.vertices.as_ref().filter(|(_, vertices, _)| !vertices.is_empty())?;
        let (_, tables) = self.tables.as_ref()?;
        let (emitters, traced) = (self.emitters.as_ref()?, self.traced);
        Some(LightPaths { emitters, vertices, tables, clustered, traced, has_moments: self.is_pilot })
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
        if self.vertices.as_ref().is_some_and(|(known, ..)| *known == epoch) {
            return RayCounts::default();
        }
        let Some(emitters) = &self.emitters else { return RayCounts::default() };
        let pilot_paths = self.pilot_paths();
        let trace = |epoch: u32, count: u32| {
            // Beyond all pixels, and beside the photons' seeds.
            let seed: PixelSeed = sampler.pixel(epoch, u32::MAX - 1);
            trace_parts(count, workspaces, |indices, workspace, vertices| {
                integrator.trace_light_paths(pass, emitters, &PhotonRange { seed, indices }, workspace, vertices);
            })
        };
        let stage = if self.is_pilot { 0 } else { 1 + usize::from(epoch >= LATER) };
        let tables = match self.tables.take().filter(|(known, _)| *known == stage) {
            Some((_, tables)) => tables,
            None => {
                let (vertices, _) = trace(TABLE_EPOCH, pilot_paths);
                let pilot = ConnectionPilot {
                    vertices: &vertices,
                    paths: pilot_paths,
                    points: &self.points,
                    bounds: self.bounds,
                };
                let rays = TABLE_RAYS_PER_PIXEL[stage] * self.pixels;
                ConnectionTables::new(&pilot, pass.world.accel, rays)
            }
        };
        let (vertices, counts) = trace(epoch, self.traced);
        let clustered = tables.clustered(&vertices);
        (self.tables, self.vertices) = (Some((stage, tables)), Some((epoch, vertices, clustered)));
        counts
    }
}
