//! The library in a few lines: a scene is opened or built, rendered and saved. The command line is built on it.
//!
//! A change of the scene between two renders costs what it needs: the accelerator is built again only if shapes have
//! changed, and files are not read again. The picture has the same bits as that of a new renderer.

mod assignment;
mod changes;
mod exr_changes;
mod job;
mod loaded;
mod options;
mod parameters;
mod rendering;
mod state;
mod statistics;
mod stop;
#[cfg(test)]
mod tests;

pub use assignment::{Assignment, changed_settings};
pub use exr_changes::ExrChanges;
pub use job::{PreparedRender, Watch};
pub use options::layers_of;
pub use rendering::{LayerView, Rendering};
pub use state::StateOptions;
pub use stop::StopHandle;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use crate::compile::{CheckedScene, FileCache, SceneChanges};
use crate::denoise::{Denoiser, add_features};
use crate::desc::{FilterSamplesDesc, SceneDesc};
use crate::error::{Error, Result};
use crate::film::LayerSet;
use crate::import::{ImportOptions, ImportReport, Imported, SceneFingerprint, scene_fingerprint};
use crate::loading::read_scene;
use crate::output::Format;
use crate::render::{DEFAULT_EXTENSIONS, Overrides, Progress, RenderProvenance, Replayed, Settings, Silent, replay};
use job::Job;
use loaded::LoadedScene;
use state::StateFiles;

/// A scene with the settings of its render.
///
/// ```
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// use steradian::Renderer;
/// # let folder = tempfile::tempdir()?;
/// # let (scene, picture) = (folder.path().join("scene.json"), folder.path().join("picture.exr"));
/// # std::fs::write(&scene, r#"{ "camera": { "position": [0, 0, 5], "look_at": [0, 0, 0] },
/// #     "shapes": { "type": "sphere" }, "lights": { "type": "environment", "radiance": 1 } }"#)?;
/// Renderer::open(&scene)?.size(32, 24).spp(4).layers(["N", "Z"])?.render()?.save(&picture)?;
/// # assert!(picture.exists());
/// # Ok(())
/// # }
/// ```
pub struct Renderer {
    scene_file: PathBuf,
    imported: Imported,
    import: ImportOptions,
    allow_missing: bool,
    /// Whether the scene is what its file has.
    is_as_in_file: bool,
    overrides: Overrides,
    assignments: Vec<Assignment>,
    settings: Option<Settings>,
    recipe: Option<RenderProvenance>,
    denoise: Option<DenoiseOptions>,
    state: StateOptions,
    progress: Box<dyn Progress + Send + Sync>,
    stop: StopHandle,
    checkpoint_request: Arc<AtomicBool>,
    fingerprint: Option<SceneFingerprint>,
    changes: SceneChanges,
    loaded: Option<LoadedScene>,
    files: Option<Arc<FileCache>>,
    /// When loading began.
    start: Instant,
}

/// How a picture is denoised.
#[derive(Clone, Debug, Default)]
struct DenoiseOptions {
    /// The library's file or folder, if it is not searched for.
    library: Option<PathBuf>,
}

/// The files that are written if neither the scene nor the settings name one: named after the scene's file, in the
/// working folder.
pub fn default_outputs(scene_file: &Path) -> Vec<String> {
    let stem = scene_file.file_stem().map_or("picture".into(), |stem| stem.to_string_lossy().into_owned());
    DEFAULT_EXTENSIONS.iter().map(|extension| format!("{stem}.{extension}")).collect()
}

impl Renderer {
    /// Reads a scene file: `.json`, `.xml` (Mitsuba 3), `.pbrt` (pbrt-v4), `.gltf` or `.glb`.
    ///
    /// # Errors
    /// As [`read_scene`].
    pub fn open(scene_file: impl AsRef<Path>) -> Result<Self> {
        Self::open_with(scene_file, ImportOptions::default(), false)
    }

    /// Reads a scene file as [`open`](Self::open) does, with options of the import. With `allow_missing`, what refers
    /// to files that do not exist is left out; the [report](Self::report) lists it.
    ///
    /// # Errors
    /// As [`read_scene`].
    pub fn open_with(scene_file: impl AsRef<Path>, import: ImportOptions, allow_missing: bool) -> Result<Self> {
        let (scene_file, start) = (scene_file.as_ref(), Instant::now());
        let mut imported = read_scene(scene_file, &import)?;
        if allow_missing {
            imported.leave_out_missing(scene_file);
        }
        Ok(Self { import, allow_missing, start, ..Self::from_imported(imported, scene_file) })
    }

    /// A scene that is built in code. Files that it names are looked up in the working folder; errors name it `scene`.
    ///
    /// ```
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// use steradian::Renderer;
    /// use steradian::desc::{CameraDesc, LightDesc, MaterialDesc, SceneDesc, ShapeDesc};
    ///
    /// let scene = SceneDesc::default()
    ///     .with_camera(CameraDesc::at([0.0, 1.0, 6.0], [0.0, 0.0, 0.0]))
    ///     .with_material("red", MaterialDesc::diffuse([0.7, 0.1, 0.05]))
    ///     .with_shape(ShapeDesc::sphere(1.0).with_material("red"))
    ///     .with_shape(ShapeDesc::quad([-5.0, -1.0, 5.0], [10.0, 0.0, 0.0], [0.0, 0.0, -10.0]))
    ///     .with_light(LightDesc::environment([0.8, 0.9, 1.0]));
    /// let rendering = Renderer::from_desc(scene).size(32, 24).spp(4).render()?;
    /// let [r, g, b] = rendering.image().rgb(16, 12).unwrap();
    /// assert!(r > g && g > b);
    /// # Ok(())
    /// # }
    /// ```
    pub fn from_desc(scene: SceneDesc) -> Self {
        let imported = Imported {
            desc: scene,
            assets: Arc::default(),
            report: ImportReport::default(),
            files: Arc::default(),
            places: Arc::default(),
        };
        Self { is_as_in_file: false, ..Self::from_imported(imported, Path::new("scene")) }
    }

    /// A scene that was read from `scene_file`.
    #[doc(hidden)]
    pub fn from_imported(imported: Imported, scene_file: impl Into<PathBuf>) -> Self {
        let scene_file = scene_file.into();
        let overrides = Overrides { default_outputs: default_outputs(&scene_file), ..Overrides::default() };
        Self {
            scene_file,
            imported,
            import: ImportOptions::default(),
            allow_missing: false,
            is_as_in_file: true,
            overrides,
            assignments: Vec::new(),
            settings: None,
            recipe: None,
            denoise: None,
            state: StateOptions::default(),
            progress: Box::new(Silent),
            stop: StopHandle::default(),
            checkpoint_request: Arc::default(),
            fingerprint: None,
            changes: SceneChanges::default(),
            loaded: None,
            files: None,
            start: Instant::now(),
        }
    }

    /// The scene's file.
    pub fn scene_file(&self) -> &Path {
        &self.scene_file
    }

    /// The scene as it was read, with its assets.
    #[doc(hidden)]
    pub fn imported(&self) -> &Imported {
        &self.imported
    }

    /// The scene's description.
    pub fn scene(&self) -> &SceneDesc {
        &self.imported.desc
    }

    /// What became of the parameters of another renderer's scene.
    pub fn report(&self) -> &ImportReport {
        &self.imported.report
    }

    /// Checks the scene's camera, film, sampler, integrator and outputs, before anything is read that it names.
    ///
    /// # Errors
    /// As [`CheckedScene::new`].
    pub fn check(&self) -> Result<()> {
        CheckedScene::new(&self.imported.desc, self.imported.source(&self.scene_file)).map(drop)
    }

    /// The settings of the scene with all changes.
    ///
    /// # Errors
    /// [`Error::Setting`] if a setting is impossible.
    pub fn settings(&self) -> Result<Settings> {
        let settings = match &self.settings {
            Some(settings) => settings.clone(),
            None => changed_settings(&self.imported.desc, &self.assignments, &self.overrides)?,
        };
        Ok(settings.of_shard(self.state.shard))
    }

    /// How the picture is made, for files that keep it, so that it can be rendered again; `None` if no output is an EXR
    /// file or no file has the scene.
    ///
    /// # Errors
    /// [`Error::Missing`] if a file of the scene cannot be read.
    #[doc(hidden)]
    pub fn recipe(&mut self, settings: &Settings) -> Result<Option<RenderProvenance>> {
        let is_exr = |file: &str| Format::from_path(Path::new(file)).is_ok_and(|format| format == Format::Exr);
        if self.recipe.is_some() {
            return Ok(self.recipe.clone());
        }
        if !self.is_as_in_file || !settings.outputs.iter().any(|output| is_exr(&output.file)) {
            return Ok(None);
        }
        let fingerprint = self.fingerprint()?;
        Ok(Some(RenderProvenance {
            import: self.import.clone(),
            allow_missing: self.allow_missing,
            denoise: self.denoise.is_some(),
            ..RenderProvenance::new(&self.scene_file, fingerprint, settings, Vec::new())
        }))
    }

    /// Hashes of the scene and its files, which are read for it once.
    fn fingerprint(&mut self) -> Result<SceneFingerprint> {
        if let Some(known) = &self.fingerprint {
            return Ok(known.clone());
        }
        let found = scene_fingerprint(&self.imported, &self.scene_file)?;
        Ok(self.fingerprint.insert(found).clone())
    }

    /// Reads what the scene names and builds the accelerator, as far as that has not been done.
    ///
    /// # Errors
    /// As [`CheckedScene::compile`]; [`Error::Setting`] if a setting is impossible.
    pub fn load(&mut self) -> Result<&mut Self> {
        let settings = self.settings()?;
        self.update(&settings)?;
        Ok(self)
    }

    /// Renders the picture, and denoises it if that is requested. No file is written but checkpoints and shards.
    ///
    /// # Errors
    /// As [`load`](Self::load) and [`PreparedRender::render`]; if denoising fails, as
    /// [`denoise_image`](crate::denoise::denoise_image).
    pub fn render(&mut self) -> Result<Rendering> {
        let mut job = self.job()?;
        let watch = Watch { progress: &*self.progress, stop: &self.stop, checkpoint: &self.checkpoint_request };
        let loaded = self.loaded.as_ref().ok_or_else(not_loaded)?;
        let mut rendering = job.run(loaded, &watch)?;
        job.denoise(&mut rendering)?;
        Ok(rendering)
    }

    /// All that is needed to render once, without the scene's description, which may take as much memory as the scene.
    ///
    /// # Errors
    /// As [`load`](Self::load).
    pub fn prepare(mut self) -> Result<PreparedRender> {
        let job = self.job()?;
        let loaded = self.loaded.ok_or_else(not_loaded)?;
        Ok(PreparedRender { job, loaded })
    }

    /// The values of one sample of one pixel, before the filter's weight: exactly those that the picture has.
    ///
    /// # Errors
    /// As [`load`](Self::load); [`Error::Setting`] if the pixel lies outside the picture.
    #[doc(hidden)]
    pub fn replay(&mut self, pixel: [u32; 2], sample: u32) -> Result<Replayed> {
        let mut settings = self.settings()?;
        if let Some(options) = &self.denoise {
            options.adapt(&mut settings);
        }
        settings.layers = LayerSet::FULL;
        self.update(&settings)?;
        let loaded = self.loaded.as_ref().ok_or_else(not_loaded)?;
        replay(&loaded.scene, loaded.accel(), &settings, pixel, sample)
    }

    /// Checks all that can be checked before the scene is made, and makes it.
    fn job(&mut self) -> Result<Job> {
        self.check()?;
        let mut settings = self.settings()?;
        let recipe = self.recipe(&settings)?;
        let denoiser = match &self.denoise {
            None => None,
            Some(options) => Some(options.open(&mut settings)?),
        };
        let state = StateFiles::take(&self.state, &settings)?;
        self.update(&settings)?;
        let fingerprint = if state.is_some() { self.fingerprint()? } else { SceneFingerprint::default() };
        let mut job =
            Job { scene_file: self.scene_file.clone(), settings, recipe, denoiser, state, fingerprint, header: None };
        let loaded = self.loaded.as_ref().ok_or_else(not_loaded)?;
        job.make_header(&loaded.scene);
        Ok(job)
    }
}

fn not_loaded() -> Error {
    Error::Internal("the scene is not loaded".to_owned())
}

impl DenoiseOptions {
    /// Adds what the denoiser needs.
    fn adapt(&self, settings: &mut Settings) {
        add_features(&mut settings.layers);
        settings.filter.samples_mut().get_or_insert(FilterSamplesDesc::Importance);
    }

    /// Opens the denoiser, so that a missing library is an error before the render.
    fn open(&self, settings: &mut Settings) -> Result<Denoiser> {
        self.adapt(settings);
        Denoiser::open(self.library.as_deref(), settings.threads)
    }
}
