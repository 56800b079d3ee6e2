//! The render loop: passes over tiles, on any number of threads, with the same result for every number.
//!
//! A batch is one sample index of one tile of the full film's grid, whatever the crop, the threads or the passes; so
//! every sample can be replayed alone, and any split of the work gives the same picture bit for bit.

mod caustic_pass;
mod driver;
mod epoch;
mod exr_overrides;
mod guiding_pilot;
mod integrator_overrides;
mod light_path_pass;
mod light_tracing;
mod light_tracing_pilot;
mod outputs;
mod overrides;
mod pilot_samples;
mod pixel_order;
mod planner;
mod progress;
mod provenance;
mod roulette_pass;
mod settings;
mod state;
mod tile_renderer;
mod trained_guide;

pub use driver::RenderSession;
pub use exr_overrides::ExrOverrides;
pub use light_tracing::LightTracing;
pub use overrides::Overrides;
pub use progress::{Progress, Silent};
pub use provenance::{RenderProvenance, SequenceFrame};
pub(crate) use settings::refused;
pub use settings::{DEFAULT_EXTENSIONS, Settings, threads};
pub(crate) use state::GuidingStage;
pub use state::{Checkpoints, Header, Merged, RenderState, Shard, StateFile, check_resumable, merge};
pub use trained_guide::TrainedGuide;

use std::sync::atomic::AtomicBool;
use std::sync::{Mutex, PoisonError};

use pixel_order::{slot_of_pixel, slots};
use tile_renderer::{TileRenderer, TileWorkspace};

use crate::accel::Accelerator;
use crate::error::{Error, Result};
use crate::film::{DroppedSample, Film, FilmShape, Image, LayerKind, LayerSet, PixelSample, SurfaceSample};
use crate::integrator::{Guidance, RayCounts};
use crate::light::LightGroups;
use crate::scene::Scene;

/// Width and height of a tile in pixels: a batch has 1,024 paths. Of a Cornell box, batches of 256 paths take 3 %
/// longer.
pub const TILE_SIZE: u32 = 32;

/// Camera rays of a block of this many pixels each way are traced side by side.
const BLOCK_SIZE: u32 = 4;

/// Textures are filtered for at most this many samples per pixel.
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
    /// What was traced from the lights.
    pub light_tracing: LightTracing,
    /// Whether a stop was requested before all samples were done.
    pub interrupted: bool,
    /// Whether the time limit ended the render.
    pub time_limited: bool,
    /// Whether the last pass was cancelled: some tiles have samples that others lack.
    pub is_uneven: bool,
}

/// A picture with its statistics.
#[derive(Clone, Debug)]
pub struct RenderResult {
    /// The picture.
    pub image: Image,
    /// What it took.
    pub stats: Stats,
}

/// The film for the picture of a scene.
fn film_shape(scene: &Scene, settings: &Settings) -> FilmShape {
    let mut shape = FilmShape {
        light_groups: light_groups(scene),
        filter: settings.filter,
        overscan: settings.overscan,
        ..FilmShape::new(settings.film_size(), settings.crop, settings.layers)
    };
    if settings.target_error.is_some() || settings.is_guided() {
        shape.layers.insert(LayerKind::Variance);
    }
    shape.block_size = settings.target_error.map(|_| BLOCK_SIZE);
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

/// Names of the light groups of a scene, which can be stored as AOVs.
fn light_groups(scene: &Scene) -> Vec<String> {
    scene.light_groups.names().iter().map(String::as_str).chain([LightGroups::OF_THE_REST]).map(str::to_owned).collect()
}

/// Renders a scene. When `stop` becomes true, or the time limit passes, the pass under way is finished and what there
/// is becomes the picture. A pass that is not done a second later is cancelled; tiles then differ in their samples, and
/// of a first pass there is no picture ([`Stats::spp_done`] is 0).
///
/// # Errors
/// If the threads cannot be started or the film does not fit in memory; [`Error::Setting`] if there is no picture in
/// twice the time limit.
pub fn render(
    scene: &Scene,
    accel: &dyn Accelerator,
    settings: &Settings,
    progress: &dyn Progress,
    stop: &AtomicBool,
) -> Result<RenderResult> {
    let state = RenderState::new(scene, settings, Shard::WHOLE)?;
    let (state, stats) = RenderSession { scene, accel, settings, progress, stop }.render(state, None)?;
    Ok(RenderResult { image: state.picture(settings), stats })
}

/// The values of a replayed sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Replayed {
    /// For the picture.
    pub pixel: PixelSample,
    /// Of its first surface; zero where there is none, and where no surface AOV is requested.
    pub surface: SurfaceSample,
}

/// The values of one sample of one pixel, before the filter's weight: exactly those that the picture has, unless
/// `guiding` is `auto` and has guided it.
///
/// # Errors
/// If the pixel lies outside the film; with `guiding` `on`.
pub fn replay(
    scene: &Scene,
    accel: &dyn Accelerator,
    settings: &Settings,
    pixel: [u32; 2],
    sample: u32,
) -> Result<Replayed> {
    let [width, height] = settings.film_size();
    if pixel[0] >= width || pixel[1] >= height {
        return Err(refused("pixel", format!(" {},{}: the film has {width}x{height} pixels", pixel[0], pixel[1])));
    }
    if settings.is_guided() {
        return Err(refused(
            "pixel",
            ": with guiding, a sample depends on all that were before; replay it with `guiding` off or `guide`",
        ));
    }
    if settings.has_guiding_pilot() && sample >= planner::GUIDED_START {
        tracing::warn!(
            "with `guiding` auto, samples from {} on may be guided in the picture; this one is replayed without",
            planner::GUIDED_START
        );
    }
    let mut renderer = TileRenderer::new(scene, accel, settings);
    let workspace = [Mutex::<TileWorkspace>::default()];
    renderer.prepare(&workspace, None);
    renderer.trace_from_lights(sample, &workspace);
    let [workspace] = workspace;
    let mut workspace = workspace.into_inner().unwrap_or_else(PoisonError::into_inner);
    let pixel = pixel.map(|x| x + renderer.grid.offset);
    let origin = pixel.map(|x| x / TILE_SIZE * TILE_SIZE);
    renderer.render_batch(origin, sample..sample + 1, Guidance::default(), &mut workspace);
    let slot = slot_of_pixel([pixel[0] - origin[0], pixel[1] - origin[1]]);
    let place = slots(renderer.grid.area, origin).position(|other| other == slot);
    let out = &workspace.integrator.out;
    let replayed = |place: usize| Replayed {
        pixel: out.pixels[place],
        surface: out.surfaces.get(place).copied().unwrap_or_default(),
    };
    place.map(replayed).ok_or_else(|| Error::Internal(format!("pixel {pixel:?} has no slot")))
}
