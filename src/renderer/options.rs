//! Settings of a render, one method each.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use serde_json::Value;

use super::{Assignment, DenoiseOptions, Renderer, StateOptions, StopHandle};
use crate::accel::AccelKind;
use crate::desc::{AutoDesc, IntegratorDesc, LayerKind, RouletteDesc};
use crate::error::{Error, Result};
use crate::film::LayerSet;
use crate::render::{Overrides, Progress, RenderProvenance, Settings, TrainedGuide, refused};
use crate::suggestion::did_you_mean;

impl Renderer {
    /// Samples per pixel, at least 1; with a target error the most that a pixel gets.
    #[must_use]
    pub fn spp(mut self, samples: u32) -> Self {
        self.overrides.spp = Some(samples);
        self
    }

    /// Width and height in pixels.
    #[must_use]
    pub fn size(mut self, width: u32, height: u32) -> Self {
        self.overrides.size = Some([width, height]);
        self
    }

    /// The part to render: x, y, width and height in pixels from the upper left corner.
    #[must_use]
    pub fn crop(mut self, crop: [u32; 4]) -> Self {
        self.overrides.crop = Some(crop);
        self
    }

    /// Seed of the noise.
    #[must_use]
    pub fn seed(mut self, seed: u64) -> Self {
        self.overrides.seed = Some(seed);
        self
    }

    /// Number of threads; 0 means all. The picture does not depend on it.
    #[must_use]
    pub fn threads(mut self, threads: usize) -> Self {
        self.overrides.threads = Some(threads);
        self
    }

    /// The algorithm.
    #[must_use]
    pub fn integrator(mut self, integrator: IntegratorDesc) -> Self {
        self.overrides.integrator = Some(integrator);
        self
    }

    /// Most segments of a path, at least 1: only directly visible light.
    #[must_use]
    pub fn max_depth(mut self, segments: u32) -> Self {
        self.overrides.max_depth = Some(segments);
        self
    }

    /// The render ends after this many seconds, with the samples so far.
    #[must_use]
    pub fn time_limit(mut self, seconds: f64) -> Self {
        self.overrides.time_limit = Some(seconds);
        self
    }

    /// Samples are taken where they are needed until the picture's relative squared error is below this.
    #[must_use]
    pub fn target_error(mut self, error: f64) -> Self {
        self.overrides.target_error = Some(error);
        self
    }

    /// The accelerator.
    #[must_use]
    pub fn accelerator(mut self, accel: AccelKind) -> Self {
        self.overrides.accel = Some(accel);
        self
    }

    /// Whether paths are guided by what earlier ones found; a `bool` is on or off.
    #[must_use]
    pub fn guiding(mut self, guiding: impl Into<AutoDesc>) -> Self {
        self.overrides.guiding = Some(guiding.into());
        self
    }

    /// Whether paths are connected to paths from the lights; a `bool` is on or off.
    #[must_use]
    pub fn bidirectional(mut self, bidirectional: impl Into<AutoDesc>) -> Self {
        self.overrides.bidirectional = Some(bidirectional.into());
        self
    }

    /// Paths are guided by what another render has learned.
    #[must_use]
    pub fn guide(mut self, guide: TrainedGuide) -> Self {
        self.overrides.guide = Some(guide);
        self
    }

    /// Russian roulette.
    #[must_use]
    pub fn roulette(mut self, roulette: RouletteDesc) -> Self {
        self.overrides.roulette = Some(roulette);
        self
    }

    /// Layers beside the picture, by name; `all` is every one.
    ///
    /// # Errors
    /// [`Error::Setting`] for an unknown name.
    pub fn layers<'a>(mut self, names: impl IntoIterator<Item = &'a str>) -> Result<Self> {
        let mut layers = Vec::new();
        for name in names {
            layers.extend(layers_of(name)?);
        }
        self.overrides.layers = layers;
        Ok(self)
    }

    /// Sets a key of the scene's film, sampler or integrator, such as `film.width` or `integrator.clamp`, to a value of
    /// the scene format.
    ///
    /// # Errors
    /// [`Error::Setting`] if the key is of another part of the scene. What the scene format does not allow is an error
    /// of the render.
    pub fn set(mut self, key: &str, value: impl Into<Value>) -> Result<Self> {
        self.assignments.push(Assignment::new(key, value.into())?);
        Ok(self)
    }

    /// Sets keys of the scene's film, sampler or integrator.
    #[must_use]
    pub fn assign(mut self, assignments: &[Assignment]) -> Self {
        self.assignments.extend_from_slice(assignments);
        self
    }

    /// Denoises the picture with Intel Open Image Denoise, whose library is searched for if it is not given.
    #[must_use]
    pub fn denoise(mut self, library: Option<PathBuf>) -> Self {
        self.denoise = Some(DenoiseOptions { library });
        self
    }

    /// Leaves the picture as noisy as it is, the default.
    #[must_use]
    pub fn without_denoise(mut self) -> Self {
        self.denoise = None;
        self
    }

    /// Forgets the keys that were set.
    #[must_use]
    pub fn without_assignments(mut self) -> Self {
        self.assignments.clear();
        self
    }

    /// Keeps the state of the render in a file, at least this often.
    #[must_use]
    pub fn checkpoint(mut self, file: impl Into<PathBuf>, every: Duration) -> Self {
        (self.state.checkpoint, self.state.every) = (Some(file.into()), every);
        self
    }

    /// Whether the render continues from the checkpoint if there is one: the picture has the same bits as without the
    /// interruption.
    #[must_use]
    pub fn resume(mut self, resume: bool) -> Self {
        self.state.resume = resume;
        self
    }

    /// Checkpoints and shards.
    #[must_use]
    pub fn state(mut self, state: StateOptions) -> Self {
        self.state = state;
        self
    }

    /// Who is informed of the progress.
    #[must_use]
    pub fn progress(mut self, progress: impl Progress + Send + 'static) -> Self {
        self.progress = Box::new(progress);
        self
    }

    /// Calls a function with the share of samples done, from 0 to 1, at most twenty times a second and from any thread.
    #[must_use]
    pub fn on_progress(self, call: impl Fn(f64) + Send + Sync + 'static) -> Self {
        self.progress(ShareDone {
            call,
            total: AtomicU64::new(0),
            done: AtomicU64::new(0),
            start: Instant::now(),
            last: AtomicU64::new(0),
        })
    }

    /// Ends renders with this handle.
    #[must_use]
    pub fn stop_with(mut self, stop: &StopHandle) -> Self {
        self.stop = stop.clone();
        self
    }

    /// A handle that ends renders.
    pub fn stop_handle(&self) -> StopHandle {
        self.stop.clone()
    }

    /// All settings that replace the scene's, to be changed.
    pub fn overrides_mut(&mut self) -> &mut Overrides {
        &mut self.overrides
    }

    /// Replaces all settings that replace the scene's.
    #[must_use]
    pub fn with_overrides(mut self, overrides: Overrides) -> Self {
        self.overrides = overrides;
        self
    }

    /// Renders with exactly these settings, whatever the scene has and was given otherwise.
    #[must_use]
    pub fn with_settings(mut self, settings: Settings) -> Self {
        self.settings = Some(settings);
        self
    }

    /// Files keep this of how the picture is made.
    #[must_use]
    #[doc(hidden)]
    pub fn with_recipe(mut self, recipe: Option<RenderProvenance>) -> Self {
        self.fingerprint = recipe.as_ref().map(|recipe| recipe.scene.clone());
        self.recipe = recipe;
        self
    }

    /// The time of loading counts from this moment.
    #[must_use]
    #[doc(hidden)]
    pub fn started_at(mut self, start: Instant) -> Self {
        self.start = start;
        self
    }

    /// A mesh that the scene names like a file, `name`, which ends with `.ply`.
    #[must_use]
    pub fn with_mesh(mut self, name: impl Into<String>, mesh: crate::assets::MeshData) -> Self {
        Arc::make_mut(&mut self.imported.assets).meshes.insert(name.into(), mesh);
        self
    }

    /// The folder in which the files lie that a scene built in code names.
    #[must_use]
    pub fn in_folder(mut self, folder: impl AsRef<Path>) -> Self {
        self.scene_file = folder.as_ref().join("scene");
        self
    }
}

/// The layers that a name means: one, or every one for `all`.
///
/// # Errors
/// [`Error::Setting`] if it means none.
pub fn layers_of(name: &str) -> Result<Vec<LayerKind>> {
    let choices = || LayerSet::FULL.iter().filter(|info| info.kind != LayerKind::Color);
    if name == "all" {
        return Ok(choices().map(|info| info.kind).collect());
    }
    let found = choices().find(|info| info.name == name);
    found
        .map(|info| vec![info.kind])
        .ok_or_else(|| unknown_layer(name, &choices().map(|info| info.name).collect::<Vec<_>>()))
}

fn unknown_layer(name: &str, known: &[&str]) -> Error {
    let hint = did_you_mean(name, known.iter().copied(), ["\"", "\""]);
    let hint = if hint.is_empty() { format!(": use all, or some of {}", known.join(", ")) } else { hint };
    refused("layers", format!(": unknown layer \"{name}\"{hint}"))
}

/// Calls between which this time passes at least.
const CALL_INTERVAL: Duration = Duration::from_millis(50);

/// Counts samples and calls a function.
struct ShareDone<F> {
    call: F,
    total: AtomicU64,
    done: AtomicU64,
    start: Instant,
    /// When the function was called, in microseconds from the start.
    last: AtomicU64,
}

impl<F: Fn(f64) + Sync> ShareDone<F> {
    fn add(&self, samples: u64) {
        let done = self.done.fetch_add(samples, Ordering::Relaxed) + samples;
        let (last, now) = (self.last.load(Ordering::Relaxed), self.start.elapsed().as_micros() as u64);
        let is_due = now.saturating_sub(last) >= CALL_INTERVAL.as_micros() as u64;
        if is_due && self.last.compare_exchange(last, now, Ordering::Relaxed, Ordering::Relaxed).is_ok() {
            self.report(done);
        }
    }

    fn report(&self, done: u64) {
        (self.call)((done as f64 / self.total.load(Ordering::Relaxed).max(1) as f64).min(1.0));
    }
}

impl<F: Fn(f64) + Sync> Progress for ShareDone<F> {
    fn start(&self, samples_per_pixel: u32, pixels: u64) {
        self.total.store(u64::from(samples_per_pixel) * pixels, Ordering::Relaxed);
        self.done.store(0, Ordering::Relaxed);
    }

    fn plan(&self, samples: u64, _error: f64, _target: f64) {
        self.total.store(samples, Ordering::Relaxed);
    }

    fn resumed(&self, samples: u64) {
        self.done.fetch_add(samples, Ordering::Relaxed);
    }

    fn tile_done(&self, samples: u64) {
        self.add(samples);
    }

    fn finish(&self) {
        self.report(self.done.load(Ordering::Relaxed));
    }
}
