//! One render of a loaded scene.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use super::loaded::LoadedScene;
use super::rendering::{Denoised, Rendering};
use super::state::StateFiles;
use super::stop::StopHandle;
use crate::accel::Accelerator;
use crate::denoise::{Denoiser, denoise_image};
use crate::error::Result;
use crate::film::LayerSet;
use crate::import::SceneFingerprint;
use crate::output::{RenderInfo, RenderStatistics};
use crate::render::{Header, Progress, RenderProvenance, RenderSession, Replayed, Settings, render, replay};
use crate::scene::Scene;

/// Who observes a render and ends it.
#[derive(Clone, Copy)]
pub struct Watch<'a> {
    /// Is informed of the progress.
    pub progress: &'a dyn Progress,
    /// Ends the render.
    pub stop: &'a StopHandle,
    /// Becomes true when a checkpoint is requested before it is due.
    pub checkpoint: &'a Arc<AtomicBool>,
}

/// What is to be rendered, with everything checked that can be checked without the scene.
pub(super) struct Job {
    pub scene_file: PathBuf,
    pub settings: Settings,
    pub recipe: Option<RenderProvenance>,
    pub denoiser: Option<Denoiser>,
    pub state: Option<StateFiles>,
    pub fingerprint: SceneFingerprint,
    pub header: Option<Header>,
}

impl Job {
    /// Makes the header of the render's state, if it is kept.
    pub fn make_header(&mut self, scene: &Scene) {
        let Some(shard) = self.state.as_ref().map(StateFiles::shard) else { return };
        let (file, fingerprint) = (self.scene_file.to_string_lossy(), self.fingerprint.clone());
        let header = Header::new(&file, fingerprint, scene, &self.settings, shard);
        self.header = Some(Header { info: self.info(scene), ..header });
    }

    /// The metadata of files that is known before the render.
    fn info(&self, scene: &Scene) -> RenderInfo {
        RenderInfo {
            world_to_camera: Some(scene.camera.world_to_camera()),
            world_to_ndc: scene.camera.world_to_ndc(self.settings.size),
            pixel_aspect: Some(scene.camera.framing().pixel_aspect as f32),
            identities: self.settings.layers.needs_coverage().then(|| scene.identities.clone()),
            settings: self.recipe.as_ref().map(RenderProvenance::to_value),
            statistics: Some(RenderStatistics { threads: self.settings.threads, ..RenderStatistics::default() }),
            ..RenderInfo::default()
        }
    }

    /// Renders; the picture is not denoised yet.
    pub fn run(&mut self, loaded: &LoadedScene, watch: &Watch) -> Result<Rendering> {
        let (scene, accel) = (&loaded.scene, loaded.accel());
        let settings = &self.settings;
        let is_shard = self.state.as_ref().is_some_and(StateFiles::has_shard_file);
        let session = RenderSession { scene, accel, settings, progress: watch.progress, stop: watch.stop.flag() };
        let result = match (self.state.take(), &self.header) {
            (Some(state), Some(header)) => state.render(&session, header, watch.checkpoint)?,
            _ => render(scene, accel, settings, watch.progress, watch.stop.flag())?,
        };
        let (image, stats) = (result.image, result.stats);
        let info = RenderInfo {
            samples_per_pixel: stats.spp_done,
            render_seconds: stats.render_seconds,
            statistics: Some(RenderStatistics {
                threads: settings.threads,
                rays: stats.rays.total(),
                nan_samples: stats.nan_samples,
            }),
            settings: self.recipe.clone().map(|recipe| recipe.of_render(&stats).to_value()),
            ..self.info(scene)
        };
        Ok(Rendering {
            image,
            stats,
            settings: settings.clone(),
            info,
            is_shard,
            scene_file: self.scene_file.clone(),
            accelerator: accel.description(),
            accelerator_bytes: accel.memory_bytes(),
            load_seconds: loaded.load_seconds,
            build_seconds: loaded.build_seconds,
            denoised: None,
        })
    }

    /// Denoises the picture, if that was requested and there is one.
    pub fn denoise(&self, rendering: &mut Rendering) -> Result<()> {
        let Some(denoiser) = self.denoiser.as_ref().filter(|_| !rendering.is_shard) else { return Ok(()) };
        let report = denoise_image(denoiser, &mut rendering.image)?;
        rendering.add_denoised(Denoised { report, library: denoiser.library().to_owned() });
        Ok(())
    }
}

/// A scene that is ready to be rendered once: see [`Renderer::prepare`](super::Renderer::prepare).
pub struct PreparedRender {
    pub(super) job: Job,
    pub(super) loaded: LoadedScene,
}

impl PreparedRender {
    /// The compiled scene.
    #[doc(hidden)]
    pub fn scene(&self) -> &Scene {
        &self.loaded.scene
    }

    /// The accelerator.
    #[doc(hidden)]
    pub fn accel(&self) -> &dyn Accelerator {
        self.loaded.accel()
    }

    /// The settings, with the layers that denoising needs.
    pub fn settings(&self) -> &Settings {
        &self.job.settings
    }

    /// Seconds to read and compile the scene, and to build the accelerator.
    pub fn seconds(&self) -> [f64; 2] {
        [self.loaded.load_seconds, self.loaded.build_seconds]
    }

    /// The values of one sample of one pixel, before the filter's weight: exactly those that the picture has.
    ///
    /// # Errors
    /// [`Error::Setting`](crate::Error::Setting) if the pixel lies outside the picture.
    #[doc(hidden)]
    pub fn replay(&self, pixel: [u32; 2], sample: u32) -> Result<Replayed> {
        let settings = Settings { layers: LayerSet::FULL, ..self.job.settings.clone() };
        replay(&self.loaded.scene, self.loaded.accel(), &settings, pixel, sample)
    }

    /// Renders, and writes checkpoints and the shard. The picture is not [denoised](Self::denoise) yet. A second render
    /// keeps no state.
    ///
    /// # Errors
    /// As [`render`]; [`Error::Checkpoint`](crate::Error::Checkpoint) if the checkpoint is damaged or that of another
    /// render, [`Error::Output`](crate::Error::Output) if the shard cannot be written.
    pub fn render(&mut self, watch: &Watch) -> Result<Rendering> {
        self.job.run(&self.loaded, watch)
    }

    /// Denoises the picture if that was requested. On an error it is as it was.
    ///
    /// # Errors
    /// As [`denoise_image`].
    pub fn denoise(&self, rendering: &mut Rendering) -> Result<()> {
        self.job.denoise(rendering)
    }
}
