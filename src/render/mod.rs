//! The render loop: passes over tiles, on any number of threads, with the same result for every number.
//!
//! A batch is one sample index of one tile of the full film's grid, whatever the crop, the threads or the passes; so every sample can be
//! replayed alone, and any split of the work gives the same picture bit for bit.

mod adaptive;
mod exr_overrides;
mod guided;
mod limits;
mod plain;
mod progress;
mod recipe;
mod run;
mod settings;
mod state;

pub use exr_overrides::ExrOverrides;
pub use progress::{Progress, Silent};
pub use recipe::{Frame, Recipe};
pub use settings::{DEFAULT_EXTENSIONS, Overrides, Settings, threads};
pub use state::{Checkpoints, Header, Merged, RenderState, Shard, StateFile, check_kept, merge};

use std::sync::atomic::AtomicBool;

use run::Run;

use crate::accel::Accelerator;
use crate::desc::IntegratorDesc;
use crate::error::{Error, Result};
use crate::film::{
    Crop, DroppedSample, Film, FilmGrid, FilmShape, FilmTile, Filter, FilterSample, Filtering, Image, LayerKind, LayerSet, PartNeeds,
    PixelSample, SampleBatch, Splats, SurfaceSample,
};
use crate::integrator::{self, CameraBatch, CameraBlock, Cancel, Integrator, RayCounts, Setup, SurfaceNeeds, World, dimensions};
use crate::light::LightGroups;
use crate::math::Vec2;
use crate::math::rows::{BATCH, Row, pair};
use crate::sampling::{Numbers, Requests, Sampler};
use crate::scene::Scene;

/// Width and height of a tile in pixels: a batch has 1,024 paths. Of a Cornell box, batches of 256 paths take 3 % longer.
pub const TILE_SIZE: u32 = 32;

/// Camera rays of a block of this many pixels each way are traced side by side.
const BLOCK_SIZE: u32 = 4;

/// Textures are as sharp as so many samples per pixel can show.
const FINEST_SPP: u32 = 1024;

/// What a render did.
#[derive(Clone, Debug, Default)]
pub struct Stats {
    /// Wall-clock seconds of the render loop.
    pub render_seconds: f64,
    /// Wall-clock time until every pixel had its first sample, in seconds.
    pub first_pass_seconds: f64,
    /// Samples in the picture: pixels times samples per pixel.
    pub samples: u64,
    /// Samples per pixel done; with a target error their mean, rounded.
    pub spp_done: u32,
    /// The picture's estimated relative squared error, of renders with a target for it.
    pub estimated_error: Option<f64>,
    /// Rays by purpose.
    pub rays: RayCounts,
    /// Samples that were NaN or infinite and were dropped.
    pub nan_samples: u64,
    /// The first few of them.
    pub dropped: Vec<DroppedSample>,
    /// Whether a stop was asked for before all samples were done.
    pub interrupted: bool,
    /// Whether the time limit ended the render.
    pub time_limited: bool,
}

/// A picture with its statistics.
#[derive(Clone, Debug)]
pub struct RenderResult {
    /// The picture.
    pub image: Image,
    /// What it took.
    pub stats: Stats,
}

/// Everything that a batch needs and that does not change during a render.
struct Job<'a> {
    world: World<'a>,
    integrator: Box<dyn Integrator>,
    setup: Setup,
    filter: Filter,
    /// The film for the picture.
    shape: FilmShape,
    /// Pixels on each side of the picture.
    overscan: u32,
    /// Width and height of what the camera shows.
    view: [u32; 2],
    /// Where the film's pixels are.
    grid: FilmGrid,
}

/// The film for the picture of a scene.
fn film_shape(scene: &Scene, settings: &Settings) -> FilmShape {
    let mut shape = FilmShape {
        light_groups: light_groups(scene),
        filter: settings.filter,
        overscan: settings.overscan,
        ..FilmShape::new(settings.film_size(), settings.crop, settings.layers)
    };
    if settings.target_error.is_some() {
        shape.layers.insert(LayerKind::Variance);
        shape.block_size = Some(BLOCK_SIZE);
    }
    shape
}

/// Bytes that the film of a picture holds for each pixel, as [`film::bytes_per_pixel`](crate::film::bytes_per_pixel).
pub fn film_bytes_per_pixel(scene: &Scene, settings: &Settings) -> usize {
    crate::film::bytes_per_pixel(&film_shape(scene, settings))
}

/// The picture of a film, in these layers.
fn picture(film: &Film, layers: LayerSet, overscan: u32) -> Image {
    let mut image = film.resolve();
    image.layers.retain(|layer| layers.contains(layer.kind));
    Image { overscan, ..image }
}

/// Names of the groups of lights that a picture of the scene may tell apart.
fn light_groups(scene: &Scene) -> Vec<String> {
    scene.light_groups.names().iter().map(String::as_str).chain([LightGroups::OF_THE_REST]).map(str::to_owned).collect()
}

impl<'a> Job<'a> {
    /// For a render that `cancel` can end within a pass.
    fn cancelled_by(self, cancel: &'a Cancel<'a>) -> Self {
        Self { world: self.world.with_cancel(cancel), ..self }
    }

    fn new(scene: &'a Scene, accel: &'a dyn Accelerator, settings: &Settings) -> Self {
        let sampler = Sampler::new(settings.sampler, settings.seed);
        let wanted = |kind| settings.layers.contains(kind);
        let needs = SurfaceNeeds {
            // The distance decides which sample's data counts.
            geometry: settings.layers.surfaces(Filtering::Nearest).next().is_some() || settings.layers.needs_coverage(),
            uv: wanted(LayerKind::Uv),
            motion: wanted(LayerKind::Motion),
            albedo: wanted(LayerKind::Albedo),
            features: wanted(LayerKind::FeatureAlbedo) || wanted(LayerKind::FeatureNormal),
        };
        let (shape, filter) = (film_shape(scene, settings), Filter::new(&settings.filter));
        let parts = PartNeeds {
            by_scattering: settings.layers.needs_parts(),
            light_groups: if wanted(LayerKind::LightGroups) { shape.light_groups.len() as u32 } else { 0 },
        };
        let setup = Setup { sampler, needs, parts, guide: None };
        let world = World::new(scene, accel).of_picture(settings.size, settings.spp.min(FINEST_SPP));
        let world = if settings.transparent { world.without_background() } else { world };
        // Parameters of analytic shapes come with their places alone.
        let in_full = settings.integrator == IntegratorDesc::Uv || (needs.uv && scene.features.analytic_shapes);
        Self {
            world: if in_full { world.in_full() } else { world },
            integrator: integrator::build(&settings.integrator, setup.clone()),
            setup,
            grid: FilmGrid::new(&shape, &filter, TILE_SIZE),
            shape,
            overscan: settings.overscan,
            filter,
            view: settings.size,
        }
    }

    /// The picture of a film, in the settings' layers.
    fn picture(&self, film: &Film) -> Image {
        picture(film, self.shape.layers, self.overscan)
    }

    /// Renders one sample of every pixel of the tile with this origin; `out` is in the order of [`slots`].
    fn render_batch(&self, origin: [u32; 2], sample: u32, batch: &mut Batch, counts: &mut RayCounts) {
        let pixels = slots(self.grid.area, origin).map(pixel_of_slot);
        self.render_samples(pixels.map(|[dx, dy]| ([origin[0] + dx, origin[1] + dy], sample)), batch, counts);
    }

    /// Renders samples of pixels, at most as many as a tile has pixels; `out` is in their order.
    #[inline]
    fn render_samples(&self, samples: impl Iterator<Item = ([u32; 2], u32)>, batch: &mut Batch, counts: &mut RayCounts) {
        let mut samples = samples.fuse();
        batch.samples.clear();
        loop {
            let start = batch.samples.len();
            let Batch { samples: camera_batch, places, film, pixels, numbers, .. } = batch;
            let block = camera_batch.next_block();
            let count = self.request(&mut samples, pixels, &mut block.requests);
            if count == 0 {
                break;
            }
            self.setup.sampler.sample_4d_batch(&block.requests, count, dimensions::CAMERA, numbers);
            for i in 0..count {
                let u = numbers.of(i);
                let filter = self.filter.sample([u[0], u[1]]);
                places[start + i] = filter;
                for (k, offset) in filter.offset.to_array().into_iter().enumerate() {
                    film[k][i] = pixels[i][k] as i32 as f32 + 0.5 + offset;
                }
            }
            self.camera_rays(count, film, numbers, block);
            camera_batch.extend(count);
        }
        self.integrator.render_batch(&self.world, &batch.samples, &mut batch.out, counts);
    }

    /// Takes up the next samples of pixels; the result is how many.
    #[inline]
    fn request(
        &self,
        samples: &mut impl Iterator<Item = ([u32; 2], u32)>,
        pixels: &mut [[u32; 2]; BATCH],
        requests: &mut Requests,
    ) -> usize {
        let mut count = 0;
        for ([x, y], sample) in samples.take(BATCH) {
            // Of what the camera shows; beyond its left and upper edge coordinates wrap.
            let [x, y] = [x, y].map(|x| x.wrapping_sub(self.grid.offset + self.overscan));
            pixels[count] = [x, y];
            requests.pixels[count] = self.setup.sampler.pixel(x, y);
            requests.samples[count] = sample;
            count += 1;
        }
        count
    }

    /// Sets the rays through the points of the film.
    #[inline]
    fn camera_rays(&self, count: usize, film: &[Row; 2], numbers: &Numbers, block: &mut CameraBlock) {
        let CameraBlock { rays, requests } = block;
        let (camera, moves) = (&self.world.scene.camera, self.world.scene.features.motion);
        rays.time = [0.0; BATCH];
        if moves {
            for i in 0..count {
                rays.time[i] = camera.time(self.setup.sampler.sample_4d(requests.pixels[i], requests.samples[i], dimensions::TIME)[0]);
            }
        }
        if camera.is_pinhole() {
            camera.pinhole_rays(self.view, film, rays, count);
        } else {
            for i in 0..count {
                let (u, at) = (numbers.of(i), Vec2::from(pair(film, i)));
                rays.set(i, &camera.ray(at, self.view, [u[2], u[3]], rays.time[i]));
            }
        }
        self.world.approach(rays, count);
    }

    /// Renders the samples `first .. first + count` of every pixel of a tile.
    fn render_tile(&self, tile: &mut FilmTile, first: u32, count: u32, batch: &mut Batch) -> RayCounts {
        let mut counts = RayCounts::default();
        let active = tile.active();
        let origin = tile.origin().map(|x| x / TILE_SIZE * TILE_SIZE);
        for sample in first..first + count {
            self.render_batch(origin, sample, batch, &mut counts);
            if self.world.has_given_up() {
                break;
            }
            for (i, slot) in slots(self.grid.area, origin).enumerate() {
                let [dx, dy] = pixel_of_slot(slot);
                let (x, y) = (origin[0] + dx, origin[1] + dy);
                if active.contains(x, y) {
                    let pixel = tile.index(x, y);
                    if self.add(tile, (pixel, sample), i, batch) && tile.wants_groups() {
                        tile.add_group(pixel, radiance(&batch.out.pixels[i]));
                    }
                }
            }
            let first = tile.index(active.x, active.y);
            tile.flush(first, &mut batch.splats);
        }
        counts
    }

    /// Adds a sample of a batch to the film; `false` if it was dropped. What is shared stays in the batch's splats.
    #[inline]
    fn add(&self, tile: &mut FilmTile, (pixel, sample): (usize, u32), slot: usize, batch: &mut Batch) -> bool {
        let (value, place) = (batch.out.sample(slot), batch.places[slot]);
        if self.filter.is_shared() {
            tile.splat((pixel, sample), value, &self.filter, place, &mut batch.splats)
        } else {
            tile.add(pixel, sample, value, place.weight)
        }
    }
}

/// A sample's radiance.
fn radiance(sample: &PixelSample) -> [f64; 3] {
    sample.radiance.to_array().map(f64::from)
}

/// Buffers of one batch.
struct Batch {
    samples: CameraBatch,
    /// Of each sample, its place in the pixel and its weight.
    places: Vec<FilterSample>,
    out: SampleBatch,
    splats: Splats,
    pixels: [[u32; 2]; BATCH],
    /// Points of the film.
    film: [Row; 2],
    numbers: Numbers,
}

impl Batch {
    fn new() -> Self {
        let count = (TILE_SIZE * TILE_SIZE) as usize;
        Self {
            samples: CameraBatch::default(),
            places: vec![FilterSample { offset: Vec2::ZERO, weight: 1.0 }; count],
            out: SampleBatch::default(),
            splats: Splats::default(),
            pixels: [[0; 2]; BATCH],
            film: [[0.0; BATCH]; 2],
            numbers: Numbers::default(),
        }
    }
}

/// The pixel within its tile of a batch's slot: runs of 16 slots are blocks of 4 x 4 pixels.
#[inline]
fn pixel_of_slot(slot: u32) -> [u32; 2] {
    let (block, within) = (slot / (BLOCK_SIZE * BLOCK_SIZE), slot % (BLOCK_SIZE * BLOCK_SIZE));
    let blocks = TILE_SIZE / BLOCK_SIZE;
    [block % blocks * BLOCK_SIZE + within % BLOCK_SIZE, block / blocks * BLOCK_SIZE + within / BLOCK_SIZE]
}

/// The slots of a batch for the tile with this corner: of blocks that reach into the film's area.
fn slots(area: Crop, origin: [u32; 2]) -> impl Iterator<Item = u32> {
    let reaches = move |k: usize, start: u32, length: u32, at: u32| {
        let block = origin[k] + at / BLOCK_SIZE * BLOCK_SIZE;
        block + BLOCK_SIZE > start && block < start + length
    };
    (0..TILE_SIZE * TILE_SIZE).filter(move |slot| {
        let [dx, dy] = pixel_of_slot(*slot);
        reaches(0, area.x, area.width, dx) && reaches(1, area.y, area.height, dy)
    })
}

/// The slot of a pixel within its tile; inverts [`pixel_of_slot`].
fn slot_of_pixel([x, y]: [u32; 2]) -> u32 {
    let blocks = TILE_SIZE / BLOCK_SIZE;
    let block = y / BLOCK_SIZE * blocks + x / BLOCK_SIZE;
    block * BLOCK_SIZE * BLOCK_SIZE + y % BLOCK_SIZE * BLOCK_SIZE + x % BLOCK_SIZE
}

/// Renders a scene. When `stop` becomes true, or the time limit passes, the pass under way is finished and what there is becomes the
/// picture. A pass that is not done a second later is given up; tiles then differ in their samples, and of a first pass there is no picture
/// ([`Stats::spp_done`] is 0).
///
/// # Errors
/// If the threads cannot be started or the film does not fit in memory; [`Error::Usage`] if there is no picture in twice the time limit.
pub fn render(
    scene: &Scene,
    accel: &dyn Accelerator,
    settings: &Settings,
    progress: &dyn Progress,
    stop: &AtomicBool,
) -> Result<RenderResult> {
    if settings.is_guided() {
        let cancel = Cancel::new(stop, settings.time_limit);
        let job = Job::new(scene, accel, settings).cancelled_by(&cancel);
        return guided::render(job, &pool(settings)?, settings, progress, (stop, &cancel));
    }
    let state = RenderState::new(scene, settings, Shard::WHOLE)?;
    let (state, stats) = render_from(scene, accel, settings, state, None, progress, stop)?;
    Ok(RenderResult { image: state.picture(settings), stats })
}

/// Renders what is missing of a state, whose shard says which samples belong to it. Ends early as [`render`] does; the state can be continued
/// then, also from one of `checkpoints`. The picture has the same bits however often that happens.
///
/// # Errors
/// As [`render`]; [`Error::Usage`] as [`check_kept`] has it.
pub fn render_from(
    scene: &Scene,
    accel: &dyn Accelerator,
    settings: &Settings,
    mut state: RenderState,
    checkpoints: Option<&mut Checkpoints>,
    progress: &dyn Progress,
    stop: &AtomicBool,
) -> Result<(RenderState, Stats)> {
    check_kept(settings, state.shard)?;
    let pool = pool(settings)?;
    let cancel = Cancel::new(stop, settings.time_limit);
    let job = Job::new(scene, accel, settings).cancelled_by(&cancel);
    let mut run = Run::new(&job, &pool, settings, progress, (stop, &cancel), checkpoints);
    let mut stats = match settings.target_error {
        Some(target) => adaptive::render(&mut run, &mut state, target),
        None => plain::render(&mut run, &mut state),
    };
    run.finish(&mut state);
    check_time(settings, &stats, state.done)?;
    stats.render_seconds = state.seconds;
    stats.rays = state.rays;
    stats.spp_done = state.done;
    stats.nan_samples = state.film.dropped_count();
    stats.dropped = state.film.dropped();
    Ok((state, stats))
}

/// Refuses a render of which there is nothing when its time is over.
fn check_time(settings: &Settings, stats: &Stats, done: u32) -> Result<()> {
    match settings.time_limit.filter(|_| stats.time_limited && done == 0) {
        Some(limit) => {
            let message = "twice that time was not enough for a sample of every pixel: there is no picture";
            Err(Error::Usage(format!("--time-limit {}: {message}", limit.as_secs_f64())))
        }
        None => Ok(()),
    }
}

fn pool(settings: &Settings) -> Result<rayon::ThreadPool> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(settings.threads).build();
    pool.map_err(|e| Error::Threads { count: settings.threads, message: e.to_string() })
}

/// What a replayed sample brings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Replayed {
    /// For the picture.
    pub pixel: PixelSample,
    /// Of its first surface; zero where there is none, and where no layer of surfaces is wanted.
    pub surface: SurfaceSample,
}

/// What one sample of one pixel brings, before the filter's weight: exactly what it brought to the picture.
///
/// # Errors
/// If the pixel lies outside the film.
pub fn replay(scene: &Scene, accel: &dyn Accelerator, settings: &Settings, pixel: [u32; 2], sample: u32) -> Result<Replayed> {
    let [width, height] = settings.film_size();
    if pixel[0] >= width || pixel[1] >= height {
        return Err(Error::Usage(format!("--pixel {},{}: the film has {width}x{height} pixels", pixel[0], pixel[1])));
    }
    if settings.is_guided() {
        return Err(Error::Usage("--pixel: with guiding, a sample depends on all that were before; replay it with --guiding off".into()));
    }
    let job = Job::new(scene, accel, settings);
    let pixel = pixel.map(|x| x + job.grid.offset);
    let origin = pixel.map(|x| x / TILE_SIZE * TILE_SIZE);
    let mut batch = Batch::new();
    job.render_batch(origin, sample, &mut batch, &mut RayCounts::default());
    let slot = slot_of_pixel([pixel[0] - origin[0], pixel[1] - origin[1]]);
    let place = slots(job.grid.area, origin).position(|other| other == slot);
    let replayed =
        |place: usize| Replayed { pixel: batch.out.pixels[place], surface: batch.out.surfaces.get(place).copied().unwrap_or_default() };
    place.map(replayed).ok_or_else(|| Error::Internal(format!("pixel {pixel:?} has no slot")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slots_and_pixels_are_one_to_one() {
        for slot in 0..TILE_SIZE * TILE_SIZE {
            assert_eq!(slot_of_pixel(pixel_of_slot(slot)), slot);
        }
        let first_block: Vec<_> = (0..16).map(pixel_of_slot).collect();
        assert!(first_block.iter().all(|p| p[0] < 4 && p[1] < 4));
    }

    #[test]
    fn batches_have_every_pixel_of_the_picture_and_hardly_more() {
        let count = |size, origin| slots(Crop::full(size), origin).count();
        assert_eq!([count([64, 64], [32, 32]), count([50, 37], [0, 0]), count([50, 37], [32, 32])], [1024, 1024, 5 * 2 * 16]);
        assert_eq!(slots(Crop { x: 31, y: 30, width: 40, height: 40 }, [0, 0]).count(), 16);
        for size in [[1, 1], [50, 37], [33, 64]] {
            for pixel in (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| [x, y])) {
                let origin = pixel.map(|x| x / TILE_SIZE * TILE_SIZE);
                let slot = slot_of_pixel([pixel[0] - origin[0], pixel[1] - origin[1]]);
                assert!(slots(Crop::full(size), origin).any(|other| other == slot), "{size:?} {pixel:?}");
            }
        }
    }
}
