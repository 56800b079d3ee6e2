//! Samples of the pixels of a tile: camera rays, the integrator, and the film.

use std::ops::Range;
use std::sync::Mutex;

use super::caustic_pass::CausticPass;
use super::light_path_pass::LightPathPass;
use super::light_tracing_pilot;
use super::pixel_order::{pixel_of_slot, slots};
use super::roulette_pass::{CameraPilot, RouletteEstimates};
use super::{FINEST_SPP, LightTracing, Settings, TILE_SIZE, film_shape};
use crate::accel::Accelerator;
use crate::desc::{IntegratorDesc, RouletteDesc};
use crate::film::{
    Crop, FilmGrid, FilmTile, Filter, FilterSample, Filtering, LayerKind, LightAovRequest, Splats, WorldSample,
};
use crate::guiding::Guide;
use crate::integrator::{
    self, CameraBatch, CameraBlock, Guidance, Integrator, PassContext, PilotRecords, RayCounts, RenderContext, Setup,
    SurfaceAovs, Workspace, World, dimensions,
};
use crate::math::Vec2;
use crate::math::rows::{BATCH, Row, pair, whole_vectors};
use crate::math::vectorize::vectorize;
use crate::sampling::{PixelSeed, SampleIdRows, SampleRows, Sampler};
use crate::scene::Scene;

/// What renders samples of tiles; it does not change during a render.
pub(super) struct TileRenderer<'a> {
    world: World<'a>,
    pub context: RenderContext<'a>,
    integrator: Box<dyn Integrator>,
    pub sampler: Sampler,
    filter: Filter,
    /// Pixels on each side of the picture.
    overscan: u32,
    /// Width and height of what the camera shows.
    pub view: [u32; 2],
    /// Where the film's pixels are.
    pub grid: FilmGrid,
    /// What guides all samples, if it was trained before.
    guide: Option<Guide>,
    /// What traces and keeps photons, if paths gather them or may do so.
    pub caustics: Option<CausticPass>,
    /// What traces and keeps light paths, if paths are connected to them or may be.
    pub light_paths: Option<LightPathPass>,
    /// What Russian roulette goes by, if it is to and the pilot was traced.
    roulette: Option<RouletteEstimates>,
    /// Lights that are sampled at the first vertex of a path; `None` for as many as the pilot finds best.
    light_samples: Option<u32>,
    /// Whether the pilot of roulette is to be traced.
    needs_pilot: bool,
    /// Which of photons and light paths is to be kept; `None` if a pilot decides.
    light_tracing: Option<LightTracing>,
}

/// The most samples per pixel in a wave of paths: the more there are, the fuller are the blocks of late bounces.
const WAVE_SPP: u32 = 4;

/// The buffers of one thread.
pub(super) struct TileWorkspace {
    samples: CameraBatch,
    /// Of each sample, its place in the pixel and its weight.
    places: Vec<FilterSample>,
    /// Samples to be added to the film.
    placed: Vec<WorldSample>,
    /// What they add to one plane of the film.
    terms: Vec<f64>,
    pub splats: Splats,
    /// Coordinates of pixels.
    pixels: [Row<u32>; 2],
    /// Points of the film.
    film: [Row; 2],
    numbers: SampleRows,
    /// With the values of the batch's samples.
    pub integrator: Workspace,
}

impl Default for TileWorkspace {
    fn default() -> Self {
        let count = (WAVE_SPP * TILE_SIZE * TILE_SIZE) as usize;
        Self {
            samples: CameraBatch::default(),
            places: vec![FilterSample::default(); count],
            placed: Vec::with_capacity(count),
            terms: Vec::with_capacity(4 * count),
            splats: Splats::default(),
            pixels: [[0; BATCH]; 2],
            film: [[0.0; BATCH]; 2],
            numbers: SampleRows::default(),
            integrator: Workspace::default(),
        }
    }
}

/// Finds the seeds of pixels, whose coordinates become those of what the camera shows; beyond its left and upper edge
/// they wrap.
#[inline(always)]
fn seed_pixels(
    sampler: &Sampler,
    first: u32,
    [x, y]: &mut [Row<u32>; 2],
    seeds: &mut [PixelSeed; BATCH],
    count: usize,
) {
    for i in 0..whole_vectors(count) {
        (x[i], y[i]) = (x[i].wrapping_sub(first), y[i].wrapping_sub(first));
        seeds[i] = sampler.pixel(x[i], y[i]);
    }
}

/// Places samples in their pixels, and finds their points of the film.
#[inline(always)]
fn place_samples(
    filter: &Filter,
    numbers: &SampleRows,
    [x, y]: &[Row<u32>; 2],
    places: &mut [FilterSample],
    [film_x, film_y]: &mut [Row; 2],
) {
    for (i, place) in places.iter_mut().enumerate().take(BATCH) {
        let [u, v, ..] = numbers.of(i);
        *place = filter.sample([u, v]);
        film_x[i] = x[i] as i32 as f32 + 0.5 + place.offset.x;
        film_y[i] = y[i] as i32 as f32 + 0.5 + place.offset.y;
    }
}

impl TileWorkspace {
    /// Samples of the batch.
    pub fn sample_count(&self) -> usize {
        self.samples.len()
    }

    /// The radiance of a sample of the batch.
    pub fn radiance(&self, slot: usize) -> [f64; 3] {
        self.integrator.out.radiance(slot)
    }
}

impl<'a> TileRenderer<'a> {
    pub fn new(scene: &'a Scene, accel: &'a dyn Accelerator, settings: &Settings) -> Self {
        let sampler = Sampler::new(settings.sampler, settings.seed);
        let has = |kind| settings.layers.contains(kind);
        let surface_aovs = SurfaceAovs {
            // The distance decides which sample's data counts.
            geometry: settings.layers.surfaces(Filtering::Nearest).next().is_some() || settings.layers.needs_coverage(),
            uv: has(LayerKind::Uv),
            motion: has(LayerKind::Motion),
            albedo: has(LayerKind::Albedo),
            features: has(LayerKind::FeatureAlbedo) || has(LayerKind::FeatureNormal),
        };
        let (shape, filter) = (film_shape(scene, settings), Filter::new(&settings.filter));
        let light_aovs = LightAovRequest {
            by_scattering: settings.layers.needs_light_aovs(),
            light_groups: if has(LayerKind::LightGroups) { shape.light_groups.len() as u32 } else { 0 },
        };
        let (world, context) = (
            World::new(scene, accel),
            RenderContext::new(scene, settings.size, settings.planned_spp().min(FINEST_SPP)),
        );
        // Analytic shapes have their parameters only with the whole parametrisation.
        let in_full = settings.integrator == IntegratorDesc::Uv || (surface_aovs.uv && scene.features.analytic_shapes);
        Self {
            world: if in_full { world.in_full() } else { world },
            context: if settings.transparent { context.without_background() } else { context },
            integrator: integrator::build(&settings.integrator, Setup { sampler, surface_aovs, light_aovs }),
            sampler,
            grid: FilmGrid::new(&shape, &filter, TILE_SIZE),
            overscan: settings.overscan,
            filter,
            view: settings.size,
            caustics: CausticPass::new(scene, accel, settings),
            light_paths: LightPathPass::new(scene, settings),
            guide: settings.guide.as_ref().and_then(|guide| guide.of_scene(accel.bounds())),
            roulette: None,
            light_samples: match settings.integrator {
                IntegratorDesc::Path { light_samples, .. } => light_samples,
                _ => None,
            },
            needs_pilot: matches!(settings.integrator.roulette(), Some(RouletteDesc::Auto | RouletteDesc::ShadowRays)),
            light_tracing: settings.light_tracing(),
        }
    }

    fn pass<'b>(&'b self, guidance: Guidance<'b>) -> PassContext<'b> {
        let continuations = self.roulette.as_ref().map(|roulette| &roulette.continuations);
        let light_samples =
            self.light_samples.or(self.roulette.as_ref().map(|roulette| roulette.light_samples)).unwrap_or(1);
        PassContext {
            world: &self.world,
            render: self.context,
            guidance,
            caustics: None,
            light_paths: None,
            continuations,
            light_samples,
        }
    }

    /// Traces the pilots of the picture, as far as they are needed: that of roulette, and that of photons and light
    /// paths unless what it found is known.
    pub fn prepare(&mut self, workspaces: &[Mutex<TileWorkspace>], known: Option<LightTracing>) {
        let known = self.light_tracing.or(known);
        self.light_paths.take_if(|_| known.is_some_and(|known| known != LightTracing::Bidirectional));
        if self.needs_pilot || self.light_paths.is_some() {
            let pilot = CameraPilot::trace(self, workspaces);
            if self.needs_pilot {
                self.roulette = RouletteEstimates::new(&pilot, self.light_samples);
            }
            let light_paths = self.light_paths.take();
            self.light_paths = light_paths.and_then(|pass| pass.with_pilot(self.world.scene, pilot.records()));
        }
        let choice = known.unwrap_or_else(|| light_tracing_pilot::choose(self, workspaces));
        self.caustics.take_if(|_| choice != LightTracing::Photons);
        self.light_paths.take_if(|_| choice != LightTracing::Bidirectional);
    }

    /// What is traced from the lights.
    pub fn light_tracing(&self) -> LightTracing {
        if self.light_paths.is_some() {
            LightTracing::Bidirectional
        } else if self.caustics.is_some() {
            LightTracing::Photons
        } else {
            LightTracing::Off
        }
    }

    /// The pixels of all that the camera shows, on the film's grid.
    pub fn whole_view(&self) -> Crop {
        let ([width, height], first) = (self.view, self.grid.offset + self.overscan);
        Crop { x: first, y: first, width, height }
    }

    /// Traces samples of any seeds through points of the film, at most as many as a tile has pixels.
    pub fn trace_pilot(
        &self,
        ids: &mut impl Iterator<Item = (u32, PixelSeed, u32)>,
        point: impl Fn((u32, PixelSeed)) -> Vec2,
        workspace: &mut TileWorkspace,
        records: &mut PilotRecords,
    ) {
        let TileWorkspace { samples, film, numbers, integrator, .. } = workspace;
        samples.clear();
        loop {
            let block = samples.next_block();
            let mut count = 0;
            for (i, seed, sample) in ids.take(BATCH) {
                (block.requests.pixels[count], block.requests.samples[count]) = (seed, sample);
                (film[0][count], film[1][count]) = point((i, seed)).into();
                count += 1;
            }
            if count == 0 {
                break;
            }
            self.sampler.sample_4d_batch(&block.requests, count, dimensions::CAMERA, numbers);
            self.camera_rays(count, film, numbers, block);
            samples.extend(count);
        }
        self.integrator.trace_pilot(&self.pass(Guidance::default()), samples, integrator, records);
    }

    /// Traces the photons or light paths of a sample's epoch, unless they are there; the result is the rays traced.
    pub fn trace_from_lights(&mut self, sample: u32, workspaces: &[Mutex<TileWorkspace>]) -> RayCounts {
        let mut counts = RayCounts::default();
        if let Some(mut light_paths) = self.light_paths.take() {
            counts.add(&light_paths.trace(
                sample,
                self.integrator.as_ref(),
                &self.pass(Guidance::default()),
                &self.sampler,
                workspaces,
            ));
            self.light_paths = Some(light_paths);
        }
        let Some(mut caustics) = self.caustics.take() else { return counts };
        let photons = caustics.trace(
            sample,
            self.integrator.as_ref(),
            &self.pass(Guidance::default()),
            &self.sampler,
            workspaces,
        );
        self.caustics = Some(caustics);
        counts.add(&photons);
        counts
    }

    /// Renders samples of every pixel of the tile with this origin, each in the order of [`slots`].
    pub fn render_batch(
        &self,
        origin: [u32; 2],
        samples: Range<u32>,
        guidance: Guidance,
        workspace: &mut TileWorkspace,
    ) {
        let pixels = || slots(self.grid.area, origin).map(pixel_of_slot);
        let samples =
            samples.flat_map(|sample| pixels().map(move |[dx, dy]| ([origin[0] + dx, origin[1] + dy], sample)));
        self.render_samples(samples, guidance, workspace);
    }

    /// Renders samples of pixels, at most [`WAVE_SPP`] for each of a tile; the values are in their order.
    #[inline]
    pub fn render_samples(
        &self,
        samples: impl Iterator<Item = ([u32; 2], u32)>,
        guidance: Guidance,
        workspace: &mut TileWorkspace,
    ) {
        let mut samples = samples.fuse();
        workspace.samples.clear();
        loop {
            let start = workspace.samples.len();
            let TileWorkspace { samples: camera_batch, places, film, pixels, numbers, .. } = workspace;
            let block = camera_batch.next_block();
            let count = self.request(&mut samples, pixels, &mut block.requests);
            if count == 0 {
                break;
            }
            self.sampler.sample_4d_batch(&block.requests, count, dimensions::CAMERA, numbers);
            vectorize!(place_samples(&self.filter, numbers, pixels, &mut places[start..start + count], film));
            if let Some(roulette) = &self.roulette {
                roulette.set_scales(pixels, count, &mut block.rr_scale);
            }
            self.camera_rays(count, film, numbers, block);
            camera_batch.extend(count);
        }
        let caustics = self.caustics.as_ref().and_then(CausticPass::caustics);
        let guidance = Guidance { guide: guidance.guide.or(self.guide.as_ref()), ..guidance };
        let light_paths = self.light_paths.as_ref().and_then(LightPathPass::light_paths);
        let pass =
            PassContext { caustics: caustics.as_ref(), light_paths: light_paths.as_ref(), ..self.pass(guidance) };
        self.integrator.render_batch(&pass, &workspace.samples, &mut workspace.integrator);
    }

    /// Takes up the next samples of pixels; the result is how many.
    #[inline]
    fn request(
        &self,
        samples: &mut impl Iterator<Item = ([u32; 2], u32)>,
        pixels: &mut [Row<u32>; 2],
        requests: &mut SampleIdRows,
    ) -> usize {
        let mut count = 0;
        for ([x, y], sample) in samples.take(BATCH) {
            (pixels[0][count], pixels[1][count], requests.samples[count]) = (x, y, sample);
            count += 1;
        }
        let first = self.grid.offset + self.overscan;
        vectorize!(seed_pixels(&self.sampler, first, pixels, &mut requests.pixels, count));
        count
    }

    /// Sets the rays through the points of the film.
    #[inline]
    fn camera_rays(&self, count: usize, film: &[Row; 2], numbers: &SampleRows, block: &mut CameraBlock) {
        let CameraBlock { rays, requests, .. } = block;
        let (camera, moves) = (&self.world.scene.camera, self.world.scene.features.motion);
        rays.time = [0.0; BATCH];
        if moves {
            for i in 0..count {
                rays.time[i] =
                    camera.time(self.sampler.sample_4d(requests.pixels[i], requests.samples[i], dimensions::TIME)[0]);
            }
        }
        if let Some(picture) = camera.perspective(self.view) {
            camera.perspective_rays(&picture, film, numbers, rays, count);
        } else {
            for i in 0..count {
                let (u, at) = (numbers.of(i), Vec2::from(pair(film, i)));
                rays.set(i, &camera.ray(at, self.view, [u[2], u[3]], rays.time[i]));
            }
        }
        self.world.clip_to_scene(rays, count);
    }

    /// Renders these samples of every pixel of a tile; the result is how many samples that are.
    pub fn render_tile(
        &self,
        tile: &mut FilmTile,
        samples: Range<u32>,
        guidance: Guidance,
        workspace: &mut TileWorkspace,
    ) -> u64 {
        let active = tile.active();
        let origin = tile.origin().map(|x| x / TILE_SIZE * TILE_SIZE);
        let count = samples.len() as u64 * active.area();
        workspace.placed.clear();
        for (slot, [dx, dy]) in slots(self.grid.area, origin).map(pixel_of_slot).enumerate() {
            let (x, y) = (origin[0] + dx, origin[1] + dy);
            if active.contains(x, y) {
                workspace.placed.push(WorldSample { slot: slot as u32, ..tile.world_sample(tile.index(x, y)) });
            }
        }
        let slot_count = slots(self.grid.area, origin).count() as u32;
        for first in samples.clone().step_by(WAVE_SPP as usize) {
            let samples = first..samples.end.min(first + WAVE_SPP);
            self.render_batch(origin, samples.clone(), guidance, workspace);
            if self.context.is_cancelled() {
                break;
            }
            for sample in samples {
                for placed in &mut workspace.placed {
                    placed.slot = placed.slot % slot_count + (sample - first) * slot_count;
                    (placed.sample, placed.place) = (sample, workspace.places[placed.slot as usize]);
                }
                let TileWorkspace { placed, terms, splats, integrator, .. } = workspace;
                if self.filter.is_shared() {
                    tile.splat_batch(&integrator.out, placed, &self.filter, splats);
                } else {
                    tile.add_batch(&integrator.out, placed, terms);
                }
            }
        }
        count
    }

    /// Adds a sample of the batch to the film; `false` if it was dropped. Shared samples stay in the splats until these
    /// are flushed.
    #[inline]
    pub fn add(
        &self,
        tile: &mut FilmTile,
        pixel: usize,
        sample: u32,
        slot: usize,
        workspace: &mut TileWorkspace,
    ) -> bool {
        let (value, place) = (workspace.integrator.out.sample(slot), workspace.places[slot]);
        if self.filter.is_shared() {
            let at = WorldSample { sample, place, ..tile.world_sample(pixel) };
            tile.splat(&at, value, &self.filter, &mut workspace.splats)
        } else {
            tile.add(pixel, sample, value, place.weight)
        }
    }
}
