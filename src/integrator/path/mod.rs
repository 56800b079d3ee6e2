//! Path tracing with next-event estimation and multiple importance sampling, a wave of paths at a time.
//!
//! A wave has a few samples of every pixel of a tile. Each round of the main loop lengthens all its paths by a segment,
//! stage by stage: trace, walks below surfaces, media, vertices, misses, materials, emission, splitting, direct light,
//! scatter, shadow rays. Stages work on blocks of `BATCH` paths, whose state is in structures of arrays. Each path
//! draws its random numbers from its own (pixel, sample, bounce), so a path is the same in any wave. "Vectorized
//! Production Path Tracing" (Lee et al. 2017) has the idea, `docs/wavefront.md` the figures.

mod adjoint;
mod block;
mod caustics;
mod connection_mis;
mod connections;
mod continuations;
mod direct;
mod emission;
mod equiangular;
mod evals;
mod guided;
mod light_aovs;
mod light_paths;
mod materials;
mod media;
mod miss;
mod moments;
mod photons;
mod radiance;
mod scatter;
mod specular_direct;
mod splitting;
mod subsurface;
mod surface_aovs;
mod terminator;
mod trace;
mod vertices;
mod wave;

use super::cancel;
use super::emitter_prims::EmitterPrims;
use super::regularization::Regularization;
use super::{
    CameraBatch, CausticCasters, Emitters, Guidance, Integrator, LightVertex, PassContext, Photon, PhotonRange,
    PilotMoments, PilotRecords, Roulette, SecondMoments, Strategy, SurfaceAovs, Workspace, World, dimensions,
};
use crate::color::Rgb;
use crate::film::{LightAovRequest, SampleBatch};
use crate::light::MisCompensation;
use crate::sampling::Sampler;
use crate::scene::Scene;
pub(super) use equiangular::SegmentVertex;
use guided::Regions;
use radiance::Output;
use wave::Wave;

/// Segments before the roulette of pilot paths.
const PILOT_RR_DEPTH: u32 = 4;

/// Lights that pilot paths sample at their first vertex, independent of each other, to find how much they differ.
const PILOT_LIGHT_SAMPLES: u32 = 2;

/// Path tracing.
#[derive(Clone, Debug)]
pub struct PathIntegrator {
    /// Largest number of segments from the camera; 1 shows only directly visible light.
    pub max_depth: u32,
    /// When Russian roulette may end a path.
    pub roulette: Roulette,
    /// How directions towards lights are found.
    pub strategy: Strategy,
    /// Largest channel that a single contribution of indirect light keeps: less noise for too little light. Infinite
    /// for no bias.
    pub clamp: f32,
    /// Path space regularization, if it is enabled.
    pub regularization: Option<Regularization>,
    /// Whether emitters and environments are invisible to the camera.
    pub hide_emitters: bool,
    /// Whether paths are split at smooth glass.
    pub splitting: bool,
    /// Where random numbers come from.
    pub sampler: Sampler,
    /// Which AOVs of surfaces are wanted.
    pub surface_aovs: SurfaceAovs,
    /// Which light AOVs are wanted.
    pub light_aovs: LightAovRequest,
}

/// What all stages of one bounce read.
#[derive(Clone, Copy)]
struct Context<'a> {
    config: &'a PathIntegrator,
    pass: &'a PassContext<'a>,
    world: &'a World<'a>,
    scene: &'a Scene,
    /// Scatterings between the camera and the rays that are traced.
    bounce: u32,
    /// Whether paths end at this vertex.
    is_last: bool,
    compensation: MisCompensation,
    /// The emitters whose specular reflections are added, if that is done at all.
    emitter_prims: Option<&'a EmitterPrims>,
}

impl<'a> Context<'a> {
    /// At the start of a wave.
    fn new(config: &'a PathIntegrator, pass: &'a PassContext<'a>) -> Self {
        let (world, compensation) = (pass.world, config.strategy.compensation());
        let emitter_prims = specular_direct::emitters(config, pass);
        Self { config, pass, world, scene: world.scene, bounce: 0, is_last: false, compensation, emitter_prims }
    }

    /// How many lights are sampled at each vertex.
    fn light_samples(&self) -> u32 {
        self.light_samples_at(self.bounce)
    }

    /// How many lights were sampled at the vertices before, which the rays that are traced come from.
    fn last_light_samples(&self) -> u32 {
        self.light_samples_at(self.bounce.wrapping_sub(1))
    }

    fn light_samples_at(&self, bounce: u32) -> u32 {
        if bounce == 0 { self.pass.light_samples } else { 1 }
    }

    /// Whether any AOV of surfaces is requested.
    fn needs_surface_aovs(&self) -> bool {
        self.config.surface_aovs != SurfaceAovs::default()
    }

    /// Whether any AOV is requested that needs state beside paths.
    fn needs_aov_state(&self) -> bool {
        self.config.light_aovs.by_scattering || self.config.surface_aovs.features
    }
}

/// The buffers of the waves of one thread.
#[derive(Default)]
pub(super) struct PathBuffers(Wave);

impl PathBuffers {
    /// As [`Workspace::second_moments`].
    pub fn second_moments(&self, out: &SampleBatch) -> Vec<SecondMoments> {
        self.0.guided.second_moments(out)
    }

    /// As [`Workspace::pilot_moments`].
    pub fn pilot_moments(&self) -> &[PilotMoments] {
        self.0.moments.samples()
    }
}

impl Integrator for PathIntegrator {
    fn render_batch(&self, pass: &PassContext, samples: &CameraBatch, workspace: &mut Workspace) {
        workspace.out.reset(samples.len(), self.surface_aovs != SurfaceAovs::default(), self.light_aovs);
        self.render_wave(pass, samples, workspace);
    }

    fn trace_photons(
        &self,
        pass: &PassContext,
        casters: &CausticCasters,
        range: &PhotonRange,
        workspace: &mut Workspace,
        photons: &mut Vec<Photon>,
    ) {
        photons::trace(self, pass, &photons::Source { casters, range }, workspace, photons);
    }

    fn trace_light_paths(
        &self,
        pass: &PassContext,
        emitters: &Emitters,
        range: &PhotonRange,
        workspace: &mut Workspace,
        vertices: &mut Vec<LightVertex>,
    ) {
        light_paths::trace(self, pass, &light_paths::Source { emitters, range }, workspace, vertices);
    }

    fn trace_pilot(
        &self,
        pass: &PassContext,
        samples: &CameraBatch,
        workspace: &mut Workspace,
        records: &mut PilotRecords,
    ) {
        let pilot = Self {
            roulette: Roulette::Throughput { from: PILOT_RR_DEPTH },
            surface_aovs: SurfaceAovs::default(),
            light_aovs: LightAovRequest::default(),
            ..self.clone()
        };
        let pass = PassContext {
            guidance: Guidance::default(),
            caustics: None,
            light_paths: None,
            continuations: None,
            light_samples: PILOT_LIGHT_SAMPLES,
            ..*pass
        };
        workspace.paths.0.continuations.enable();
        pilot.render_batch(&pass, samples, workspace);
        let Workspace { out, paths: PathBuffers(wave), .. } = workspace;
        wave.continuations.finish(&Output { batch: out }, samples.len(), records);
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

    /// For paths that start at lights: without roulette and whatever concerns the camera and AOVs.
    fn for_light_paths(&self) -> Self {
        Self {
            roulette: Roulette::Off,
            clamp: f32::INFINITY,
            hide_emitters: false,
            surface_aovs: SurfaceAovs::default(),
            light_aovs: LightAovRequest::default(),
            ..self.clone()
        }
    }

    /// Whether any light AOV is requested.
    #[inline]
    fn needs_light_aovs(&self) -> bool {
        self.light_aovs.count() > 0
    }

    /// The main loop.
    fn render_wave(&self, pass: &PassContext, samples: &CameraBatch, workspace: &mut Workspace) {
        let PassContext { render, guidance: Guidance { guide, learner, .. }, .. } = *pass;
        let Workspace { out, counts, paths: PathBuffers(wave) } = workspace;
        let (mut context, out) = (Context::new(self, pass), &mut Output { batch: out });
        wave.start(&context, samples);
        for bounce in 0..self.max_depth {
            if wave.count == 0 || (bounce % cancel::BOUNCES == 0 && render.is_cancel_due()) {
                break;
            }
            (context.bounce, context.is_last) = (bounce, bounce + 1 >= self.max_depth);
            let context = &context;
            trace::closest(context, wave, counts);
            if context.scene.features.subsurface {
                counts.indirect += subsurface::walk(context, wave);
            }
            if context.scene.features.participating_media {
                counts.indirect += media::scatter(context, wave, out);
            } else if context.scene.features.media {
                counts.indirect += media::pass_boundaries(context, wave);
            }
            let mut survivors = 0;
            for block in 0..wave.blocks() {
                vertices::find(context, wave, block);
                miss::add(context, wave, block, out);
                materials::evaluate(context, wave, block);
                subsurface::leave(wave, block);
                surface_aovs::write(context, wave, block, out);
                emission::add(context, wave, block, out);
                if context.is_last {
                    continue;
                }
                materials::replace_bsdfs(context, wave, block);
                materials::sort_by_bsdf(&mut wave.vertices);
                vertices::build_frames(context, wave);
                wave.draw(context);
                let regions = guide.map(|guide| Regions::find(guide, &wave.vertices));
                if !wave.connections.is_empty() {
                    connection_mis::arrive(wave, block);
                    connections::sample(context, wave, block);
                }
                splitting::split(context, wave, block);
                specular_direct::add(context, wave, block);
                direct::sample(context, regions.as_ref(), wave, block);
                caustics::gather(context, wave, block, out);
                scatter::sample(context, regions.as_ref(), wave, block);
                survivors = wave.append(context, block, survivors);
            }
            wave.finish_bounce(context, survivors);
            trace::shadow(context, wave, out, counts);
            wave.guided.mark_radiance(out);
            wave.continuations.mark_radiance(out);
        }
        wave.guided.commit(learner, out);
        counts.add(&wave.counts);
    }
}
