//! Light transport: from camera rays to what each sample of a pixel brings.
//!
//! Integrators take a batch of camera samples (one sample of every pixel of a tile) and work through it stage by stage: trace all rays,
//! shade all hits, trace all shadow rays. Accelerators can then trace rays side by side that belong together, and each stage's code and
//! data stay in the caches. `docs/wavefront.md` has the figures behind this choice.

mod cancel;
mod cones;
mod debug;
mod guided;
mod media;
mod parts;
mod path;
mod regularization;
mod shading;
mod strategy;
mod surface;
mod vertex;
mod whitted;
mod world;

pub use cancel::Cancel;
pub use debug::{AmbientOcclusion, DebugView, View};
pub use path::PathIntegrator;
pub use regularization::Regularization;
pub(crate) use shading::{facing_normal, terminator_factor};
pub use strategy::Strategy;
pub use surface::SurfaceNeeds;
pub use whitted::Whitted;
pub use world::World;

use std::sync::Arc;

use crate::desc::IntegratorDesc;
use crate::film::{PartNeeds, SampleBatch};
use crate::guiding::Guide;
use crate::math::Ray;
use crate::sampling::{PixelSeed, Sampler};

/// Sets of four dimensions of the sampler, by purpose.
pub mod dimensions {
    /// Film position (two) and lens position (two).
    pub const CAMERA: u32 = 0;

    /// Time within the shutter interval (one), of scenes in which something moves.
    pub const TIME: u32 = u32::MAX;

    /// Choice of a colour (one), where dispersion parts them.
    pub const COLOR: u32 = u32::MAX - 1;

    /// Of path tracing: choice of a light (one, and one for its last digits) and a direction towards it (two), at the vertex with this many bounces before it.
    pub const fn light(bounce: u32) -> u32 {
        1 + 2 * bounce
    }

    /// Of path tracing: choice of a lobe (one), a direction (two) and roulette (one), at the vertex with this many bounces before it.
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

/// Computes what each camera sample brings.
pub trait Integrator: Send + Sync {
    /// Fills `out` with one entry for each of `samples`, and counts rays.
    fn render_batch(&self, world: &World, samples: &[CameraSample], out: &mut SampleBatch, counts: &mut RayCounts);
}

/// What integrators need to know beside their parameters.
#[derive(Clone)]
pub struct Setup {
    /// Where random numbers come from.
    pub sampler: Sampler,
    /// What the layers need.
    pub needs: SurfaceNeeds,
    /// Which parts of the radiance layers need.
    pub parts: PartNeeds,
    /// As in [`PathIntegrator`].
    pub side_by_side: bool,
    /// What a path tracer follows beside the surfaces.
    pub guide: Option<Arc<Guide>>,
}

/// The integrator with these parameters.
pub fn build(desc: &IntegratorDesc, setup: Setup) -> Box<dyn Integrator> {
    let Setup { sampler, needs, parts, side_by_side, guide } = setup;
    let view = |view| Box::new(DebugView { view, needs, parts }) as Box<dyn Integrator>;
    match *desc {
        IntegratorDesc::Path { max_depth, rr_depth, strategy, clamp, regularize, hide_emitters, .. } => Box::new(PathIntegrator {
            max_depth,
            rr_depth,
            strategy: strategy.into(),
            clamp: clamp.unwrap_or(f32::INFINITY),
            regularization: regularize.map(|alpha| Regularization { alpha }),
            hide_emitters,
            sampler,
            needs,
            parts,
            side_by_side,
            guide,
        }),
        IntegratorDesc::Whitted { max_depth, ambient, hide_emitters } => {
            Box::new(Whitted { max_depth, ambient: ambient.into(), hide_emitters, sampler, needs, parts })
        }
        IntegratorDesc::Normal => view(View::Normal),
        IntegratorDesc::ShadingNormal => view(View::ShadingNormal),
        IntegratorDesc::Uv => view(View::Uv),
        IntegratorDesc::Depth => view(View::Depth),
        IntegratorDesc::PrimitiveId => view(View::PrimitiveId),
        IntegratorDesc::AmbientOcclusion { distance } => {
            Box::new(AmbientOcclusion { distance: distance.unwrap_or(f32::INFINITY), sampler, needs, parts })
        }
    }
}
