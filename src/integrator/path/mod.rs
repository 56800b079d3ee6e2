//! Path tracing with next-event estimation and multiple importance sampling, a wave of paths at a time.
//!
//! A wave is one sample of every pixel of a tile. Each round of the main loop lengthens all its paths by a segment, stage by stage: trace,
//! media, vertices, misses, materials, emission, direct light, scatter, shadow rays. Stages work on blocks of `BATCH` paths, whose state is in
//! structures of arrays. Each path draws its random numbers from its own (pixel, sample, bounce), so a path is the same in any wave.
//! "Vectorized Production Path Tracing" (Lee et al. 2017) has the idea, `docs/wavefront.md` the figures.

mod block;
mod direct;
mod emission;
mod guided;
mod light_aovs;
mod materials;
mod media;
mod miss;
mod radiance;
mod scatter;
mod surface_aovs;
mod terminator;
mod trace;
mod vertices;
mod wave;

use std::cell::RefCell;
use std::sync::Arc;

use super::cancel;
use super::regularization::Regularization;
use super::{CameraBatch, Integrator, RayCounts, Strategy, SurfaceNeeds, World, dimensions};
use crate::color::Rgb;
use crate::film::{PartNeeds, SampleBatch};
use crate::guiding::Guide;
use crate::light::FoundBy;
use crate::sampling::Sampler;
use crate::scene::Scene;
use radiance::Output;
use wave::Wave;

/// Path tracing.
#[derive(Clone, Debug)]
pub struct PathIntegrator {
    /// Largest number of segments from the camera; 1 shows only directly visible light.
    pub max_depth: u32,
    /// Segments before Russian roulette may end a path.
    pub rr_depth: u32,
    /// How directions towards lights are found.
    pub strategy: Strategy,
    /// Largest channel that a single contribution of indirect light keeps: less noise for too little light. Infinite for no bias.
    pub clamp: f32,
    /// Path space regularization, if it is enabled.
    pub regularization: Option<Regularization>,
    /// Whether emitters and environments are invisible to the camera.
    pub hide_emitters: bool,
    /// Where random numbers come from.
    pub sampler: Sampler,
    /// Which AOVs of surfaces are wanted.
    pub needs: SurfaceNeeds,
    /// Which light AOVs are wanted.
    pub parts: PartNeeds,
    /// What was learned of the incident radiance, if paths are guided.
    pub guide: Option<Arc<Guide>>,
}

/// What all stages of one bounce read.
#[derive(Clone, Copy)]
struct Context<'a> {
    config: &'a PathIntegrator,
    world: &'a World<'a>,
    scene: &'a Scene,
    /// Scatterings between the camera and the rays that are traced.
    bounce: u32,
    /// Whether paths end at this vertex.
    is_last: bool,
    found_by: FoundBy,
}

impl Context<'_> {
    /// Whether any AOV of surfaces is wanted.
    fn wants_surfaces(&self) -> bool {
        self.config.needs != SurfaceNeeds::default()
    }

    /// Whether any AOV is wanted that needs state beside paths.
    fn wants_aovs(&self) -> bool {
        self.config.parts.by_scattering || self.config.needs.features
    }
}

thread_local! {
    static WAVE: RefCell<Wave> = RefCell::default();
}

impl Integrator for PathIntegrator {
    fn render_batch(&self, world: &World, samples: &CameraBatch, out: &mut SampleBatch, counts: &mut RayCounts) {
        out.reset(samples.len(), self.needs != SurfaceNeeds::default(), self.parts);
        WAVE.with_borrow_mut(|wave| self.render_wave(world, samples, &mut Output { batch: out, config: self }, counts, wave));
    }
}

impl PathIntegrator {
    /// Light that was scattered `scatterings` times between its source and the camera, clamped if it is indirect.
    #[inline]
    fn clamped(&self, light: Rgb, scatterings: u32) -> Rgb {
        if self.clamp == f32::INFINITY || scatterings <= 1 {
            return light;
        }
        let largest = light.max_channel();
        if largest > self.clamp { light * (self.clamp / largest) } else { light }
    }

    /// Whether any light AOV is wanted.
    #[inline]
    fn wants_light_aovs(&self) -> bool {
        self.parts.count() > 0
    }

    /// The main loop.
    fn render_wave(&self, world: &World, samples: &CameraBatch, out: &mut Output, counts: &mut RayCounts, wave: &mut Wave) {
        let (found_by, guide) = (self.strategy.found_by(), self.guide.as_deref());
        let mut context = Context { config: self, world, scene: world.scene, bounce: 0, is_last: false, found_by };
        wave.start(&context, samples);
        for bounce in 0..self.max_depth {
            if wave.count == 0 || (bounce % cancel::BOUNCES == 0 && world.gives_up()) {
                break;
            }
            (context.bounce, context.is_last) = (bounce, bounce + 1 >= self.max_depth);
            let context = &context;
            trace::closest(context, wave, counts);
            if context.scene.features.media {
                counts.indirect += media::pass_boundaries(context, wave);
            }
            let mut survivors = 0;
            for block in 0..wave.blocks() {
                vertices::find(context, wave, block);
                miss::add(context, wave, block, out);
                materials::evaluate(context, wave, block);
                surface_aovs::write(context, wave, block, out);
                emission::add(context, wave, block, out);
                if context.is_last {
                    continue;
                }
                materials::replace_bsdfs(context, wave, block);
                materials::sort_by_bsdf(&mut wave.vertices);
                vertices::build_frames(context, wave);
                wave.draw(context);
                let regions = guide.map(|guide| guided::find_regions(guide, &wave.vertices));
                direct::sample(context, regions.as_ref(), wave, block);
                scatter::sample(context, regions.as_ref(), wave, block);
                wave.append(context, block, &mut survivors);
            }
            wave.finish_bounce(survivors);
            trace::shadow(context, wave, out, counts);
            wave.guided.mark_radiance(out);
        }
        wave.guided.commit(guide, out);
        counts.add(&wave.counts);
    }
}
