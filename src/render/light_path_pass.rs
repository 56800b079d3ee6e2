//! Light paths: one set for each epoch of samples.

use std::ops::RangeInclusive;
use std::sync::Mutex;

use super::epoch::trace_parts;
use super::tile_renderer::TileWorkspace;
use super::{LightTracing, Settings};
use crate::integrator::{
    ClusteredVertices, ConnectionTables, EPOCH, Emitters, Integrator, LightPaths, LightVertex, PassContext,
    PhotonRange, RayCounts,
};
use crate::sampling::{PixelSeed, Sampler};
use crate::scene::Scene;

/// Light paths traced in an epoch, by pixel of the picture.
const PATHS_PER_PIXEL: f64 = 0.5;

/// The fewest and the most light paths traced in an epoch; the most take 200 MB.
const PATHS: RangeInclusive<f64> = 16_384.0..=250_000.0;

/// Shadow rays for the tables by which vertices are chosen, by pixel of the picture: for the picture, and for the pilot
/// that decides whether paths are connected.
const TABLE_RAYS_PER_PIXEL: u64 = 8;
const PILOT_TABLE_RAYS_PER_PIXEL: u64 = 1;

/// The epoch of the light paths that the tables are made from, beyond those of samples.
const TABLE_EPOCH: u32 = u32::MAX;

/// Traces light paths and keeps those of one epoch.
pub(super) struct LightPathPass {
    emitters: Emitters,
    /// Whether they are those of the pilot.
    is_pilot: bool,
    /// Light paths of an epoch.
    traced: u32,
    /// Shadow rays for the tables.
    table_rays: u64,
    /// By which vertices are chosen; made with the first epoch.
    tables: Option<ConnectionTables>,
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
        let emitters = Emitters::new(scene)?;
        let [width, height] = settings.size.map(f64::from);
        let traced = (PATHS_PER_PIXEL * width * height).clamp(*PATHS.start(), *PATHS.end()) as u32;
        let table_rays = TABLE_RAYS_PER_PIXEL * (width * height) as u64;
        Some(Self { emitters, is_pilot: false, traced, table_rays, tables: None, vertices: None })
    }

    /// As many light paths as a pilot needs.
    pub fn for_pilot(&self) -> Self {
        let (emitters, traced) = (self.emitters.clone(), self.pilot_paths());
        let table_rays = self.table_rays / TABLE_RAYS_PER_PIXEL * PILOT_TABLE_RAYS_PER_PIXEL;
        Self { emitters, is_pilot: true, traced, table_rays, tables: None, vertices: None }
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
        let tables = self.tables.as_ref()?;
        let (emitters, traced) = (&self.emitters, self.traced);
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
        let pilot_paths = self.pilot_paths();
        let trace = |epoch: u32, count: u32| {
            // Beyond all pixels, and beside the photons' seeds.
            let seed: PixelSeed = sampler.pixel(epoch, u32::MAX - 1);
            trace_parts(count, workspaces, |indices, workspace, vertices| {
                integrator.trace_light_paths(pass, &self.emitters, &PhotonRange { seed, indices }, workspace, vertices);
            })
        };
        let tables = self.tables.get_or_insert_with(|| {
            let (pilot, _) = trace(TABLE_EPOCH, pilot_paths);
            ConnectionTables::new(&pilot, pass.world.accel, self.table_rays)
        });
        let (vertices, counts) = trace(epoch, self.traced);
        let clustered = tables.clustered(&vertices);
        self.vertices = Some((epoch, vertices, clustered));
        counts
    }
}
