//! The state of a wave: paths under way and the vertices of one block of them, in structures of arrays.

use super::block::{Vertices, spawn};
use super::caustics::CausticState;
use super::connection_mis::{ConnectionMis, ConnectionState};
use super::connections::LightVertexRows;
use super::continuations::ContinuationRecorder;
use super::guided::GuideRecorder;
use super::light_aovs::{LightAovs, PathMove};
use super::light_paths::LightPathState;
use super::miss::MissScratch;
use super::moments::Moments;
use super::photons::PhotonState;
use super::specular_direct::SpecularRows;
use super::splitting::Branch;
use super::terminator::TerminatorRays;
use super::{Context, dimensions};
use crate::accel::{AnyHitRays, HitRows};
use crate::bsdf::{BsdfEvalRows, BsdfQueryRows, BsdfSampleRows};
use crate::color::{Rgb, RgbRows};
use crate::id::LightId;
use crate::integrator::media::MediaState;
use crate::integrator::subsurface::Walk;
use crate::integrator::{CameraBatch, CameraBlock, RayCounts};
use crate::light::{LightQueue, LightSampleContext};
use crate::math::compact::Compaction;
use crate::math::rows::{BATCH, Row, soa};
use crate::math::{DVec3, Ray, RayCone, RayRows, Vec3};
use crate::sampling::{PixelSeed, SampleIdRows};

/// Bits of [`Path::flags`].
pub(super) mod path_flags {
    /// Light sampling could not have found the last direction: a camera ray, scattering by a delta lobe, or a passed
    /// boundary.
    pub const SPECULAR: u32 = 1;
    /// Some vertex has scattered the path by a lobe that is no delta.
    pub const ANY_NON_SPECULAR: u32 = 2;
    /// What emitters send along the last direction has been added at the last vertex.
    pub const EMISSION_ADDED: u32 = 4;
}

soa! {
    /// Paths under way.
    pub(super) struct PathRows of Path {
        /// Product of all weights.
        throughput: Rgb,
        /// Density of the last direction, per solid angle.
        pdf: f32,
        /// Roulette multiplies the throughput by it: it undoes the radiance scaling of refraction and what a guide
        /// added to densities.
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
    fn start(&mut self, requests: &SampleIdRows, rr_scale: &Row, first: usize) {
        self.throughput = RgbRows([[1.0; BATCH]; 3]);
        self.rr_scale = *rr_scale;
        self.flags = [path_flags::SPECULAR; BATCH];
        self.sample = requests.samples;
        for (i, PixelSeed(seed)) in requests.pixels.iter().enumerate() {
            (self.slot[i], self.seed[i]) = ((first + i) as u32, *seed);
        }
    }

    #[inline(always)]
    pub fn from(&self, i: usize) -> LightSampleContext {
        LightSampleContext { p: self.from_p.get(i), n: self.from_n.get(i) }
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

soa! {
    /// What shadow rays add to samples if nothing is in the way.
    pub(super) struct ShadowRows {
        contribution: Rgb,
        slot: u32,
    }
}

/// Shadow rays of a wave.
#[derive(Default)]
pub(super) struct ShadowQueue {
    pub count: usize,
    pub rays: Vec<RayRows>,
    pub rows: Vec<ShadowRows>,
    /// As [`AnyHitRays::end_shapes`], where the accelerator skips them.
    pub end_shapes: Vec<Row<u32>>,
}

/// Appends the chosen `$lanes` of rows, and of rows of vectors, to columns of a block and the next.
macro_rules! append {
    (
        $lanes:expr, $at:expr, $to:expr, $next:expr,
        { $($row:expr => $column:ident,)* },
        { $($vectors:expr => $vector_column:ident,)* }
    ) => {{
        let (to, mut next) = ($to, $next);
        $($lanes.append(&$row, &mut to.$column, next.as_mut().map(|next| &mut next.$column), $at);)*
        $(
            $lanes.append_3(
                &$vectors.0, &mut to.$vector_column.0, next.as_mut().map(|next| &mut next.$vector_column.0), $at
            );
        )*
    }};
}

/// A wave.
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
    /// By path, where it is below a surface, in scenes where light enters surfaces.
    pub walks: Vec<Option<Walk>>,
    /// By path, where textures are filtered.
    pub cones: Vec<RayCone>,
    /// By path, where photons are gathered.
    pub caustics: Vec<CausticState>,
    /// By photon, where the wave is one of photons.
    pub photons: Vec<PhotonState>,
    /// By path, where paths are connected to light paths.
    pub connections: Vec<ConnectionState>,
    pub connection_mis: ConnectionMis,
    pub connection_ends: LightVertexRows,
    pub moments: Moments,
    /// By light path, where the wave is one of light paths.
    pub light_paths: Vec<LightPathState>,
    pub light_aovs: LightAovs,
    pub guided: GuideRecorder,
    pub continuations: ContinuationRecorder,
    pub vertices: Vertices,
    pub shadows: ShadowQueue,
    pub terminator_rays: TerminatorRays,
    pub light_queue: LightQueue,
    pub miss: MissScratch,
    pub bsdf_rows: BsdfScratch,
    pub specular_rows: SpecularRows,
    /// Paths that begin at the vertices of this bounce.
    pub branches: Vec<Branch>,
    /// Rays that stages have traced beside those of paths and shadow rays.
    pub counts: RayCounts,
}

impl Wave {
    /// Starts a path with each camera sample.
    pub fn start(&mut self, context: &Context, samples: &CameraBatch) {
        self.count = samples.len();
        self.grow();
        for (block, CameraBlock { rays, requests, rr_scale }) in samples.blocks().iter().enumerate() {
            self.rays[block].clone_from(rays);
            self.paths[block].start(requests, rr_scale, block * BATCH);
        }
        self.media.clear();
        if context.scene.features.media {
            let state = |ray: &Ray| MediaState { current: context.world.media_at_start(ray), ..MediaState::default() };
            self.media.extend(samples.iter().map(|sample| state(&sample.ray)));
        }
        self.walks.clear();
        if context.scene.features.subsurface {
            self.walks.resize(samples.len(), None);
        }
        self.cones.clear();
        self.cones.extend(samples.iter().map_while(|sample| context.pass.render.camera_cone(&sample.ray)));
        self.caustics.clear();
        if context.pass.caustics.is_some() {
            self.caustics.resize(samples.len(), CausticState::default());
        }
        self.photons.clear();
        self.light_paths.clear();
        self.connections.clear();
        if context.pass.light_paths.is_some() {
            self.connections.resize(samples.len(), ConnectionState::default());
        }
        self.moments.start(context.pass, samples.len());
        self.light_aovs.start(context.config, samples.len());
        self.guided.clear();
        self.shadows.count = 0;
        self.light_queue.reset();
        self.counts = RayCounts::default();
    }

    /// Makes room for all paths.
    fn grow(&mut self) {
        let blocks = self.blocks();
        if self.paths.len() < blocks {
            self.paths.resize_with(blocks, PathRows::default);
            self.rays.resize_with(blocks, RayRows::default);
            self.hits.resize_with(blocks, HitRows::default);
        }
    }

    pub fn blocks(&self) -> usize {
        self.count.div_ceil(BATCH)
    }

    /// Paths in a block.
    pub fn block_len(&self, block: usize) -> usize {
        (self.count - block * BATCH).min(BATCH)
    }

    /// Draws the random numbers of the vertices of a block, but for those of lights.
    pub fn draw(&mut self, context: &Context) {
        let Vertices { rows, requests, count, u_bsdf, .. } = &mut self.vertices;
        requests.samples = rows.sample;
        for (pixel, seed) in requests.pixels.iter_mut().zip(rows.seed) {
            *pixel = PixelSeed(seed);
        }
        context.config.sampler.sample_4d_batch(requests, *count, dimensions::bsdf(context.bounce), u_bsdf);
    }

    /// Draws the random numbers with which each vertex of a block chooses the light `k` of `samples`. All of a pixel
    /// are one sequence, but in a pilot, where they are independent.
    pub fn draw_light(&mut self, context: &Context, k: u32, samples: u32) {
        let Vertices { rows, requests, count, u_light, .. } = &mut self.vertices;
        let is_apart = self.continuations.is_enabled();
        let set = if is_apart && k > 0 { dimensions::FURTHER_LIGHT } else { dimensions::light(context.bounce) };
        requests.samples = rows.sample;
        if samples > 1 && !is_apart {
            requests.samples.iter_mut().for_each(|sample| *sample = sample.wrapping_mul(samples).wrapping_add(k));
        }
        context.config.sampler.sample_4d_batch(requests, *count, set, u_light);
        requests.samples = rows.sample;
    }

    /// Queues the shadow rays of a block's vertices and moves the paths that go on to the index `survivors` and those
    /// after it; the result is the number of all paths that go on so far.
    pub fn append(&mut self, context: &Context, block: usize, survivors: usize) -> usize {
        self.queue_shadow_rays(context, block, 0);
        let Vertices { count, scatter, .. } = &self.vertices;
        let lanes = Compaction::equal(&scatter.status, spawn::SPAWNED, *count);
        if lanes.is_empty() {
            return survivors;
        }
        if !self.connections.is_empty() {
            super::connection_mis::leave(context, self);
        }
        if self.has_optional_columns() || context.needs_aov_state() {
            self.append_optional(context, block, survivors);
        }
        let Vertices { rows, points, scatter, .. } = &self.vertices;
        let (to, at) = (survivors / BATCH, survivors % BATCH);
        let (paths, next_paths) = pair(&mut self.paths, to);
        let (rays, next_rays) = pair(&mut self.rays, to);
        append!(lanes, at, paths, next_paths, {
            scatter.pdf => pdf,
            scatter.rr_scale => rr_scale,
            scatter.path_flags => flags,
            rows.slot => slot,
            rows.seed => seed,
            rows.sample => sample,
        }, {
            scatter.throughput => throughput,
            points.p => from_p,
            rows.light_context_n => from_n,
        });
        append!(
            lanes, at, rays, next_rays, { rows.time => time, },
            { scatter.origin => origin, scatter.direction => direction, }
        );
        survivors + lanes.len()
    }

    /// Adds the paths that begin at vertices of others to the `survivors`, and sets the intervals of all rays.
    pub fn finish_bounce(&mut self, context: &Context, survivors: usize) {
        self.count = survivors + self.branches.len();
        self.grow();
        // Waves of photons and of light paths do not split, and share this state.
        self.vertices.splits.is_split = [0; BATCH];
        for i in survivors..self.count {
            let Branch { path, ray, cone, lobes } = &self.branches[i - survivors];
            self.paths[i / BATCH].set(i % BATCH, path);
            self.rays[i / BATCH].set(i % BATCH, ray);
            if let Some(cone) = *cone {
                set_or_push(&mut self.cones, i, cone);
            }
            if context.pass.caustics.is_some() {
                set_or_push(&mut self.caustics, i, CausticState::default());
            }
            if context.pass.light_paths.is_some() {
                set_or_push(&mut self.connections, i, ConnectionState::default());
            }
            if context.scene.features.subsurface {
                set_or_push(&mut self.walks, i, None);
            }
            self.light_aovs.start_branch(context, i, *lobes);
        }
        self.branches.clear();
        let blocks = self.blocks();
        for rays in &mut self.rays[..blocks] {
            (rays.t_min, rays.t_max) = ([0.0; BATCH], [f32::INFINITY; BATCH]);
        }
    }

    /// Queues the shadow rays of a block's vertices, towards light that was scattered `scatterings` times before.
    pub fn queue_shadow_rays(&mut self, context: &Context, block: usize, scatterings: u32) {
        if context.config.clamp.is_finite() {
            self.vertices.clamp_direct(context);
        }
        let Vertices { count, rows, direct, light_samples, .. } = &self.vertices;
        let lanes = Compaction::equal(&direct.status, spawn::SPAWNED, *count);
        if context.config.needs_light_aovs() {
            for lane in (0..BATCH).filter(|&lane| lanes.contains(lane)) {
                let lobes = || self.vertices.direct_lobes(context.scene, lane);
                let path = block * BATCH + self.vertices.path(lane);
                let event = self.light_aovs.shadow_event(context, path, scatterings, lobes);
                self.light_aovs.shadow_sources.push((event, LightId(self.vertices.light_samples.light[lane])));
            }
        }
        if self.continuations.is_enabled() {
            let light = |lane| LightId(self.vertices.light_samples.light[lane]);
            self.continuations.keep_lights((0..BATCH).filter(|&lane| lanes.contains(lane)).map(light));
        }
        if self.moments.has_ratios {
            let ratio = |lane| if scatterings > 0 { self.connection_mis.densities.moment_ratio[lane] } else { 1.0 };
            self.moments.ratios.extend((0..BATCH).filter(|&lane| lanes.contains(lane)).map(ratio));
        }
        let Moments { photon_factors, shadow_factors, .. } = &mut self.moments;
        shadow_factors.extend(
            photon_factors.iter().enumerate().filter(|(lane, _)| lanes.contains(*lane)).map(|(_, factor)| *factor),
        );
        photon_factors.fill(1.0);
        let shadows = &mut self.shadows;
        let (to, at) = (shadows.count / BATCH, shadows.count % BATCH);
        while shadows.rays.len() < to + 2 {
            shadows.rays.push(RayRows::default());
            shadows.rows.push(ShadowRows::default());
        }
        if let Some(end_shapes) = &context.world.end_shapes {
            shadows.end_shapes.resize(shadows.rays.len(), [AnyHitRays::NO_SHAPE; BATCH]);
            let (column, next_column) = pair(&mut shadows.end_shapes, to);
            // Of connections, no light is sampled.
            let count = if scatterings == 0 { *count } else { 0 };
            lanes.append(
                &end_shapes.of_samples(light_samples, &direct.shadow_direction, count),
                column,
                next_column,
                at,
            );
        } else {
            shadows.end_shapes.clear();
        }
        let (rays, next_rays) = pair(&mut shadows.rays, to);
        append!(lanes, at, rays, next_rays, { direct.shadow_end => t_max, rows.time => time, }, {
            direct.shadow_origin => origin,
            direct.shadow_direction => direction,
        });
        let (queued, next_queued) = pair(&mut shadows.rows, to);
        append!(lanes, at, queued, next_queued, { rows.slot => slot, }, { direct.contribution => contribution, });
        shadows.count += lanes.len();
    }

    fn has_optional_columns(&self) -> bool {
        !(self.media.is_empty()
            && self.walks.is_empty()
            && self.cones.is_empty()
            && self.caustics.is_empty()
            && self.photons.is_empty()
            && self.connections.is_empty()
            && self.light_paths.is_empty())
    }

    /// Moves the state that only some renders have.
    fn append_optional(&mut self, context: &Context, block: usize, survivors: usize) {
        let Self {
            vertices,
            media,
            walks,
            cones,
            caustics,
            photons,
            connections,
            connection_mis,
            light_paths,
            light_aovs,
            ..
        } = self;
        let scatter = &vertices.scatter;
        let lanes = (0..vertices.count).filter(|&lane| scatter.status[lane] == spawn::SPAWNED);
        for (to, lane) in (survivors..).zip(lanes) {
            let path = block * BATCH + vertices.path(lane);
            if let Some(&state) = media.get(path) {
                media[to] = super::media::after(context, vertices, lane, &state);
            }
            if to < walks.len() {
                walks[to] = super::subsurface::after(context, vertices, lane);
            }
            if let Some(&cone) = cones.get(path) {
                let pdf = if scatter.is_delta[lane] != 0 { f32::INFINITY } else { scatter.pdf[lane] };
                cones[to] = context.pass.render.scattered_cone(cone, vertices.rows.t[lane], pdf);
            }
            if let Some(&state) = caustics.get(path) {
                caustics[to] = super::caustics::after(context, vertices, lane, state);
            }
            if let Some(&state) = photons.get(path) {
                photons[to] = state;
            }
            if to < connections.len() {
                connections[to] = connection_mis.after(lane);
            }
            if let Some(&state) = light_paths.get(path) {
                light_paths[to] = state;
            }
            if context.needs_aov_state() {
                let lobes = || vertices.sampled_lobes(context.scene, lane);
                light_aovs.append(context, PathMove { from: path, to }, lobes, || vertices.feature_factor(lane));
            }
        }
    }
}

/// Sets an element of a column, or appends it.
pub(super) fn set_or_push<T>(column: &mut Vec<T>, i: usize, value: T) {
    match column.get_mut(i) {
        Some(element) => *element = value,
        None => column.push(value),
    }
}

/// A block and the next, if there is one.
fn pair<T>(blocks: &mut [T], i: usize) -> (&mut T, Option<&mut T>) {
    let (before, after) = blocks.split_at_mut(i + 1);
    (&mut before[i], after.first_mut())
}
