//! The state of a wave: paths under way and the vertices of one block of them, in structures of arrays.

use super::block::{Vertices, spawn};
use super::guided::GuideRecorder;
use super::light_aovs::LightAovs;
use super::terminator::TerminatorRays;
use super::{Context, dimensions};
use crate::accel::HitRows;
use crate::bsdf::{BsdfEvalRows, BsdfQueryRows, BsdfSampleRows};
use crate::color::{Rgb, RgbRows};
use crate::id::LightId;
use crate::integrator::media::MediaState;
use crate::integrator::{CameraBatch, CameraBlock, RayCounts};
use crate::light::{LightQueue, Receiver};
use crate::math::rows::{BATCH, soa};
use crate::math::{DVec3, Ray, RayCone, RayRows, Vec3};
use crate::sampling::{PixelSeed, Requests};

/// Bits of [`Path::flags`].
pub(super) mod path_flags {
    /// Light sampling could not have found the last direction: a camera ray, scattering by a delta lobe, or a passed boundary.
    pub const SPECULAR: u32 = 1;
    /// Some vertex has scattered the path by a lobe that is no delta.
    pub const ANY_NON_SPECULAR: u32 = 2;
}

soa! {
    /// Paths under way.
    pub(super) struct PathRows of Path {
        /// Product of all weights.
        throughput: Rgb,
        /// Density of the last direction, per solid angle.
        pdf: f32,
        /// Roulette multiplies the throughput by it: it undoes the radiance scaling of refraction and what a guide added to densities.
        rr_scale: f32,
        /// See [`path_flags`].
        flags: u32,
        /// Index of the sample in the wave.
        slot: u32,
        /// Seed of the pixel.
        seed: u32,
        /// Index of the sample within the pixel.
        sample: u32,
        /// The last vertex, for the density of light sampling: its point
        from_p: DVec3,
        /// and the normal that light must reach, or zero.
        from_n: Vec3,
    }
}

impl PathRows {
    /// Starts the paths of a block of camera samples, the first of which has this index in the wave.
    fn start(&mut self, requests: &Requests, first: usize) {
        self.throughput = RgbRows([[1.0; BATCH]; 3]);
        self.rr_scale = [1.0; BATCH];
        self.flags = [path_flags::SPECULAR; BATCH];
        self.sample = requests.samples;
        for (i, PixelSeed(seed)) in requests.pixels.iter().enumerate() {
            (self.slot[i], self.seed[i]) = ((first + i) as u32, *seed);
        }
    }

    #[inline(always)]
    pub fn from(&self, i: usize) -> Receiver {
        Receiver { p: self.from_p.get(i), n: self.from_n.get(i) }
    }

    #[inline(always)]
    pub fn is_specular(&self, i: usize) -> bool {
        self.flags[i] & path_flags::SPECULAR != 0
    }
}

/// Buffers for the vertices of a block that have one BSDF.
#[derive(Default)]
pub(super) struct BsdfScratch {
    pub lanes: Vec<u8>,
    pub queries: BsdfQueryRows,
    pub evals: BsdfEvalRows,
    pub samples: BsdfSampleRows,
}

/// Shadow rays of a wave.
#[derive(Default)]
pub(super) struct ShadowQueue {
    pub count: usize,
    pub rays: Vec<RayRows>,
    /// What each adds to its sample if nothing is in the way.
    pub contributions: Vec<Rgb>,
    pub slots: Vec<u32>,
}

impl ShadowQueue {
    pub fn clear(&mut self) {
        self.count = 0;
        self.contributions.clear();
        self.slots.clear();
    }

    #[inline(always)]
    fn push(&mut self, ray: &Ray, contribution: Rgb, slot: u32) {
        let (block, lane) = (self.count / BATCH, self.count % BATCH);
        if block == self.rays.len() {
            self.rays.push(RayRows::default());
        }
        self.rays[block].set(lane, ray);
        self.contributions.push(contribution);
        self.slots.push(slot);
        self.count += 1;
    }
}

/// A wave, kept by its thread.
#[derive(Default)]
pub(super) struct Wave {
    /// Paths under way.
    pub count: usize,
    /// Blocks of [`BATCH`] paths; all but the last are full.
    pub paths: Vec<PathRows>,
    pub rays: Vec<RayRows>,
    pub hits: Vec<HitRows>,
    /// By path, in scenes with media.
    pub media: Vec<MediaState>,
    /// By path, where textures are filtered.
    pub cones: Vec<RayCone>,
    pub light_aovs: LightAovs,
    pub guided: GuideRecorder,
    pub vertices: Vertices,
    pub shadows: ShadowQueue,
    pub terminator_rays: TerminatorRays,
    pub light_queue: LightQueue,
    pub bsdf_rows: BsdfScratch,
    /// Rays that stages have traced beside those of paths and shadow rays.
    pub counts: RayCounts,
}

impl Wave {
    /// Starts a path with each camera sample.
    #[inline(never)]
    pub fn start(&mut self, context: &Context, samples: &CameraBatch) {
        self.count = samples.len();
        let blocks = self.count.div_ceil(BATCH);
        if self.paths.len() < blocks {
            self.paths.resize_with(blocks, PathRows::default);
            self.rays.resize_with(blocks, RayRows::default);
            self.hits.resize_with(blocks, HitRows::default);
        }
        for (block, CameraBlock { rays, requests }) in samples.blocks().iter().enumerate() {
            self.rays[block].clone_from(rays);
            self.paths[block].start(requests, block * BATCH);
        }
        self.media.clear();
        if context.scene.features.media {
            let state = |ray: &Ray| MediaState { here: context.world.media_at_start(ray), ..MediaState::default() };
            self.media.extend(samples.iter().map(|sample| state(&sample.ray)));
        }
        self.cones.clear();
        self.cones.extend(samples.iter().map_while(|sample| context.world.camera_cone(&sample.ray)));
        self.light_aovs.start(context.config, samples.len());
        self.guided.clear();
        self.shadows.clear();
        self.light_queue.reset();
        self.counts = RayCounts::default();
    }

    pub fn blocks(&self) -> usize {
        self.count.div_ceil(BATCH)
    }

    /// Paths in a block.
    pub fn block_len(&self, block: usize) -> usize {
        (self.count - block * BATCH).min(BATCH)
    }

    /// Draws the random numbers of the vertices of a block.
    pub fn draw(&mut self, context: &Context, block: usize) {
        let Vertices { rows, requests, count, u_light, u_bsdf, .. } = &mut self.vertices;
        let paths = &self.paths[block];
        for (lane, &path) in rows.path[..*count].iter().enumerate() {
            requests.pixels[lane] = PixelSeed(paths.seed[path as usize]);
            requests.samples[lane] = paths.sample[path as usize];
        }
        let sampler = &context.config.sampler;
        if !context.scene.lights.is_empty() {
            sampler.sample_4d_batch(requests, *count, dimensions::light(context.bounce), u_light);
        }
        sampler.sample_4d_batch(requests, *count, dimensions::bsdf(context.bounce), u_bsdf);
    }

    /// Queues the shadow rays of a block's vertices and moves the paths that go on to the index `survivors` and those after it.
    #[inline(never)]
    pub fn append(&mut self, context: &Context, block: usize, survivors: &mut usize) {
        let wants_light_aovs = context.config.wants_light_aovs();
        let no_lights = context.scene.lights.is_empty();
        for lane in 0..self.vertices.count {
            let vertices = &self.vertices;
            let (direct, scatter) = (&vertices.direct, &vertices.scatter);
            let path = vertices.path(lane);
            let index = block * BATCH + path;
            let time = vertices.rows.time[lane];
            let slot = self.paths[block].slot[path];
            if direct.status[lane] == spawn::SPAWNED {
                let ray = Ray {
                    t_max: direct.shadow_end[lane],
                    time,
                    ..Ray::new(direct.shadow_origin.get(lane), direct.shadow_direction.get(lane))
                };
                self.shadows.push(&ray, context.config.clamped(direct.contribution.get(lane), context.bounce + 1), slot);
                if wants_light_aovs {
                    let event = self.light_aovs.shadow_event(context, index, || vertices.lobes(context.scene, lane, direct.wi.get(lane)));
                    self.light_aovs.shadow_sources.push((event, LightId(direct.light[lane])));
                }
            }
            if scatter.status[lane] != spawn::SPAWNED {
                continue;
            }
            let to = *survivors;
            *survivors += 1;
            let is_delta = scatter.is_delta[lane] != 0;
            let is_specular = is_delta || no_lights;
            let non_specular =
                self.paths[block].flags[path] & path_flags::ANY_NON_SPECULAR | if is_delta { 0 } else { path_flags::ANY_NON_SPECULAR };
            let next = Path {
                throughput: scatter.throughput.get(lane),
                pdf: scatter.pdf[lane],
                rr_scale: scatter.rr_scale[lane],
                flags: non_specular | if is_specular { path_flags::SPECULAR } else { 0 },
                slot,
                seed: self.paths[block].seed[path],
                sample: self.paths[block].sample[path],
                from_p: vertices.points.p.get(lane),
                from_n: vertices.receiver(lane).n,
            };
            let direction = scatter.direction.get(lane);
            if let Some(&state) = self.media.get(index) {
                self.media[to] = super::media::after(context, vertices, lane, &state);
            }
            if let Some(&cone) = self.cones.get(index) {
                let pdf = if is_specular { f32::INFINITY } else { next.pdf };
                self.cones[to] = context.world.scattered_cone(cone, vertices.rows.t[lane], pdf);
            }
            if context.wants_aovs() {
                let lobes = || vertices.sampled_lobes(context.scene, lane);
                self.light_aovs.append(context, [index, to], lobes, || vertices.feature_factor(lane));
            }
            self.paths[to / BATCH].set(to % BATCH, &next);
            self.rays[to / BATCH].set(to % BATCH, &Ray { time, ..Ray::new(scatter.origin.get(lane), direction) });
        }
    }
}
