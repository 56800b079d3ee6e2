//! Light transport: from camera rays to the radiance and AOVs of samples.
//!
//! Integrators take a batch of camera samples (one sample of every pixel of a tile) and work through it stage by stage:
//! trace all rays, shade all hits, trace all shadow rays. Accelerators can then trace rays side by side that belong
//! together, and each stage's code and data stay in the caches. `docs/wavefront.md` has the figures behind this choice.

mod bidirectional;
mod cancel;
mod caustics;
mod cones;
mod debug;
mod emitter_prims;
mod end_shapes;
mod light_events;
mod media;
mod octant_grid;
mod participating;
mod path;
mod regularization;
mod render_context;
mod roulette;
mod shading;
mod strategy;
mod subsurface;
mod surface;
mod vertex;
mod whitted;
mod world;

pub use bidirectional::{
    ClusteredVertices, ConnectionPilot, ConnectionTables, DistantRay, Emitters, LightPaths, LightVertex,
};
pub use cancel::Cancel;
pub use caustics::{
    CausticCasters, CausticPoint, Caustics, DiscSamples, EPOCH, Photon, PhotonMap, correct_for_coverage,
};
pub use debug::{AmbientOcclusion, DebugView, View};
use path::PathBuffers;
pub use path::PathIntegrator;
pub use regularization::Regularization;
pub use render_context::RenderContext;
pub use roulette::{Continuation, ContinuationGrid, PilotRecords, Roulette};
pub use shading::{adapt_shading_normal, terminator_factor};
pub use strategy::Strategy;
pub use surface::SurfaceAovs;
pub use whitted::Whitted;
pub use world::World;

use std::ops::Range;

use crate::desc::{DEFAULT_RR_DEPTH, IntegratorDesc, RouletteDesc};
use crate::film::{LightAovRequest, SampleBatch};
use crate::guiding::Guide;
use crate::math::rows::{BATCH, Row};
use crate::math::{Ray, RayRows};
use crate::sampling::{PixelSeed, SampleIdRows, Sampler};

/// Sets of four dimensions of the sampler, by purpose.
pub mod dimensions {
    /// Film position (two) and lens position (two).
    pub const CAMERA: u32 = 0;

    /// Time within the shutter interval (one), of scenes in which something moves.
    pub const TIME: u32 = u32::MAX;

    /// Choice of a colour (one), where dispersion parts them.
    pub const COLOR: u32 = u32::MAX - 1;

    /// Of path tracing: choice of a channel (one) and the distance to a scattering by media (one), a distance for a
    /// light (one) and the choice of that light (one), on the segment with this many bounces before it.
    pub const fn medium(bounce: u32) -> u32 {
        (1 << 31) + bounce
    }

    /// Of path tracing: a point of a light (two), the last digits of the light's choice (one) and what else is left to
    /// chance (one), for a distance chosen on the segment with this many bounces before it.
    pub const fn equiangular(bounce: u32) -> u32 {
        (3 << 30) + bounce
    }

    /// Of path tracing: choice of a light (one, and one for its last digits) and a direction towards it (two), at the
    /// vertex with this many bounces before it.
    pub const fn light(bounce: u32) -> u32 {
        1 + 2 * bounce
    }

    /// Of path tracing: choice of a light path's vertex (one, and one for its last digits), at the vertex with this
    /// many bounces before it.
    pub const fn connection(bounce: u32) -> u32 {
        (1 << 29) + bounce
    }

    /// As [`light`] of the first vertex, for a further choice that does not depend on the other.
    pub const FURTHER_LIGHT: u32 = 1 << 30;

    /// Of path tracing: choice of a lobe (one), a direction (two) and roulette (one), at the vertex with this many
    /// bounces before it.
    pub const fn bsdf(bounce: u32) -> u32 {
        2 + 2 * bounce
    }
}

/// One sample of one pixel on its way into the scene.
#[derive(Clone, Copy, Debug)]
pub struct CameraSample {
    /// The camera ray.
    pub ray: Ray,
    /// The pixel's seed.
    pub seed: PixelSeed,
    /// The index of the sample within the pixel.
    pub sample: u32,
}

/// Samples of pixels on their way into the scene, in blocks of [`BATCH`], all but the last of which are full.
#[derive(Debug, Default)]
pub struct CameraBatch {
    count: usize,
    blocks: Vec<CameraBlock>,
}

/// At most [`BATCH`] samples.
#[derive(Clone, Debug)]
pub struct CameraBlock {
    /// The camera rays.
    pub rays: RayRows,
    /// Pixels and indices of the samples.
    pub requests: SampleIdRows,
    /// What Russian roulette multiplies throughputs by.
    pub rr_scale: Row,
}

impl Default for CameraBlock {
    fn default() -> Self {
        Self { rays: RayRows::default(), requests: SampleIdRows::default(), rr_scale: [1.0; BATCH] }
    }
}

impl CameraBatch {
    /// Removes all samples.
    pub fn clear(&mut self) {
        self.count = 0;
    }

    /// The place for up to [`BATCH`] more samples, which [`extend`](Self::extend) adds; the batch has full blocks so
    /// far.
    pub fn next_block(&mut self) -> &mut CameraBlock {
        let block = self.count.div_ceil(BATCH);
        if block == self.blocks.len() {
            self.blocks.push(CameraBlock::default());
        }
        &mut self.blocks[block]
    }

    /// Adds the first `count` samples of the [next block](Self::next_block).
    pub fn extend(&mut self, count: usize) {
        self.count += count;
    }

    /// Adds one sample.
    pub fn push(&mut self, sample: &CameraSample) {
        let lane = self.count % BATCH;
        let block = if lane == 0 { self.next_block() } else { &mut self.blocks[self.count / BATCH] };
        block.rays.set(lane, &sample.ray);
        (block.requests.pixels[lane], block.requests.samples[lane]) = (sample.seed, sample.sample);
        self.count += 1;
    }

    /// How many samples there are.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether there are no samples.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// All blocks that have samples.
    pub fn blocks(&self) -> &[CameraBlock] {
        &self.blocks[..self.count.div_ceil(BATCH)]
    }

    /// One sample after the other.
    pub fn iter(&self) -> impl Iterator<Item = CameraSample> {
        (0..self.count).map(|i| {
            let (CameraBlock { rays, requests, .. }, lane) = (&self.blocks[i / BATCH], i % BATCH);
            CameraSample { ray: rays.get(lane), seed: requests.pixels[lane], sample: requests.samples[lane] }
        })
    }
}

/// Rays traced, by purpose.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RayCounts {
    /// From the camera.
    pub camera: u64,
    /// From a surface, looking for the closest hit.
    pub indirect: u64,
    /// Towards a light.
    pub shadow: u64,
}

impl RayCounts {
    /// All rays.
    pub fn total(&self) -> u64 {
        self.camera + self.indirect + self.shadow
    }

    /// Adds the counts of another batch.
    pub fn add(&mut self, other: &Self) {
        self.camera += other.camera;
        self.indirect += other.indirect;
        self.shadow += other.shadow;
    }
}

/// The incident radiance that has been learned, and what learns it.
#[derive(Clone, Copy, Debug, Default)]
pub struct Guidance<'a> {
    /// What guides paths, if they are guided.
    pub guide: Option<&'a Guide>,
    /// What records the light that paths find, if anything does.
    pub learner: Option<&'a Guide>,
    /// Whether [`Workspace::second_moments`] are wanted.
    pub has_moments: bool,
}

/// Second moments of a sample's radiance, by channel: sums over the contributions of its path.
#[derive(Clone, Copy, Debug, Default)]
pub struct SecondMoments {
    /// As paths are guided.
    pub guided: [f64; 3],
    /// As they would be without the guide, by the ratio of the densities.
    pub unguided: [f64; 3],
}

/// What all batches of a pass read.
#[derive(Clone, Copy)]
pub struct PassContext<'a> {
    /// The scene with its accelerator.
    pub world: &'a World<'a>,
    /// The picture and the end of the render.
    pub render: RenderContext<'a>,
    /// What guides paths, and what learns from them.
    pub guidance: Guidance<'a>,
    /// The photons that paths gather, if they do.
    pub caustics: Option<&'a Caustics<'a>>,
    /// The light paths that paths are connected to, if they are.
    pub light_paths: Option<&'a LightPaths<'a>>,
    /// What Russian roulette goes by, if it is [`Roulette::Auto`].
    pub continuations: Option<&'a ContinuationGrid>,
    /// Lights that are sampled at the first vertex of a path, at least 1.
    pub light_samples: u32,
}

impl PassContext<'_> {
    /// For paths that start at lights: they are neither guided, nor gather photons, nor are connected.
    fn for_light_paths(&self) -> Self {
        Self { guidance: Guidance::default(), caustics: None, light_paths: None, continuations: None, ..*self }
    }
}

/// The photons that a part of a pass traces.
#[derive(Clone, Debug)]
pub struct PhotonRange {
    /// Seed of the epoch.
    pub seed: PixelSeed,
    /// Indices within the epoch; at most as many as a tile has pixels.
    pub indices: Range<u32>,
}

/// What a sample with a method shows of the variance with and without it, by channel.
#[derive(Clone, Copy, Debug, Default)]
pub struct PilotMoments {
    /// Radiance that the sample would have without the method, less that which it has.
    pub without: [f64; 3],
    /// How much larger the variance without the method is than samples show it, on average.
    pub excess: [f64; 3],
    /// What samples of a pixel do not show of the variance with it, since they have it in common.
    pub shared: [f64; 3],
}

/// The buffers of one thread, reused from batch to batch.
#[derive(Default)]
pub struct Workspace {
    /// The values of the last batch's samples.
    pub out: SampleBatch,
    /// The rays of all batches.
    pub counts: RayCounts,
    paths: PathBuffers,
}

impl Workspace {
    /// The second moments of the last batch's samples, if the guidance asked for them.
    pub fn second_moments(&self) -> Vec<SecondMoments> {
        self.paths.second_moments(&self.out)
    }

    /// Those of the last batch's samples, if light paths or photons asked for them.
    pub fn pilot_moments(&self) -> &[PilotMoments] {
        self.paths.pilot_moments()
    }
}

/// Estimates the radiance of camera samples.
pub trait Integrator: Send + Sync {
    /// Sets the workspace's `out` to one entry for each of `samples`, and adds to its `counts`.
    fn render_batch(&self, pass: &PassContext, samples: &CameraBatch, workspace: &mut Workspace);

    /// Traces photons from the casters, and appends those that arrive at surfaces which are no mirrors and no glass.
    /// Integrators without photons trace none.
    fn trace_photons(
        &self,
        _pass: &PassContext,
        _casters: &CausticCasters,
        _range: &PhotonRange,
        _workspace: &mut Workspace,
        _photons: &mut Vec<Photon>,
    ) {
    }

    /// Traces light paths and appends their vertices. Integrators that are not bidirectional trace none.
    fn trace_light_paths(
        &self,
        _pass: &PassContext,
        _emitters: &Emitters,
        _range: &PhotonRange,
        _workspace: &mut Workspace,
        _vertices: &mut Vec<LightVertex>,
    ) {
    }

    /// As [`render_batch`](Self::render_batch) for the radiance alone, and appends what paths found.
    /// Integrators without paths find nothing.
    fn trace_pilot(
        &self,
        _pass: &PassContext,
        _samples: &CameraBatch,
        _workspace: &mut Workspace,
        _records: &mut PilotRecords,
    ) {
    }
}

/// What integrators need beside their parameters.
#[derive(Clone, Copy)]
pub struct Setup {
    /// Where random numbers come from.
    pub sampler: Sampler,
    /// What the layers need.
    pub surface_aovs: SurfaceAovs,
    /// Which parts of the radiance layers need.
    pub light_aovs: LightAovRequest,
}

/// The integrator with these parameters.
pub fn build(desc: &IntegratorDesc, setup: Setup) -> Box<dyn Integrator> {
    let Setup { sampler, surface_aovs, light_aovs } = setup;
    let view = |view| Box::new(DebugView { view, surface_aovs, light_aovs }) as Box<dyn Integrator>;
    match *desc {
        IntegratorDesc::Path { max_depth, rr_depth, splitting, strategy, clamp, regularize, hide_emitters, .. } => {
            Box::new(PathIntegrator {
                max_depth,
                roulette: match desc.roulette() {
                    Some(RouletteDesc::Auto) => Roulette::Auto,
                    Some(RouletteDesc::ShadowRays) => Roulette::ShadowRays,
                    Some(RouletteDesc::Throughput) => {
                        Roulette::Throughput { from: rr_depth.unwrap_or(DEFAULT_RR_DEPTH) }
                    }
                    Some(RouletteDesc::Off) | None => Roulette::Off,
                },
                strategy: strategy.into(),
                clamp: clamp.unwrap_or(f32::INFINITY),
                regularization: regularize.map(|alpha| Regularization { alpha }),
                hide_emitters,
                splitting,
                sampler,
                surface_aovs,
                light_aovs,
            })
        }
        IntegratorDesc::Whitted { max_depth, ambient, hide_emitters } => {
            Box::new(Whitted { max_depth, ambient: ambient.into(), hide_emitters, sampler, surface_aovs, light_aovs })
        }
        IntegratorDesc::Normal => view(View::Normal),
        IntegratorDesc::ShadingNormal => view(View::ShadingNormal),
        IntegratorDesc::Uv => view(View::Uv),
        IntegratorDesc::Depth => view(View::Depth),
        IntegratorDesc::PrimitiveId => view(View::PrimitiveId),
        IntegratorDesc::AmbientOcclusion { distance } => Box::new(AmbientOcclusion {
            distance: distance.unwrap_or(f32::INFINITY),
            sampler,
            surface_aovs,
            light_aovs,
        }),
    }
}
