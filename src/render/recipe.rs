//! How a picture was made: all that is needed to make it again.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::Settings;
use crate::desc::{FilterDesc, IntegratorDesc, OutputDesc, SamplerKindDesc};
use crate::error::{Error, Result};
use crate::film::Crop;
use crate::import::SceneFingerprint;
use crate::sampling::SamplerKind;

/// How a picture was made. Files keep it, with how they are written, as [`settings`](crate::output::RenderInfo::settings).
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Recipe {
    /// Name and version of the program.
    pub program: String,
    /// What followed the program's name on its command line.
    pub arguments: Vec<String>,
    /// The folder that names of files refer to.
    pub folder: PathBuf,
    /// The scene's file.
    pub scene_file: PathBuf,
    /// What the scene and its files are.
    pub scene: SceneFingerprint,
    /// The frame of a sequence.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frame: Option<i64>,
    /// What the picture depends on beside the scene.
    pub settings: RecipeSettings,
    /// How the file is written.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub output: Option<OutputDesc>,
}

/// The settings that a picture depends on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecipeSettings {
    /// Width and height of the picture.
    pub size: [u32; 2],
    /// What is rendered, of the picture with its overscan: x, y, width, height.
    pub crop: [u32; 4],
    /// Pixels around the picture.
    pub overscan: u32,
    /// The pixel filter.
    pub filter: FilterDesc,
    /// How samples are chosen.
    pub sampler: SamplerKindDesc,
    /// Samples per pixel; with a target error the most.
    pub spp: u32,
    /// The relative squared error to stay below.
    pub target_error: Option<f64>,
    /// The seed.
    pub seed: u64,
    /// The algorithm.
    pub integrator: IntegratorDesc,
    /// What finds hits.
    pub accel: String,
    /// Whether the camera's lens blurs what is out of focus.
    #[serde(default = "yes", skip_serializing_if = "Clone::clone")]
    pub depth_of_field: bool,
}

fn yes() -> bool {
    true
}

impl Recipe {
    /// That of a render which is about to begin in the working folder.
    pub fn new(scene_file: &Path, scene: SceneFingerprint, settings: &Settings, arguments: Vec<String>) -> Self {
        let Crop { x, y, width, height } = settings.crop;
        Self {
            program: concat!("steradian ", env!("CARGO_PKG_VERSION")).to_owned(),
            arguments,
            folder: std::env::current_dir().unwrap_or_default(),
            scene_file: scene_file.to_owned(),
            scene,
            frame: None,
            settings: RecipeSettings {
                size: settings.size,
                crop: [x, y, width, height],
                overscan: settings.overscan,
                filter: settings.filter,
                sampler: match settings.sampler {
                    SamplerKind::Sobol => SamplerKindDesc::Sobol,
                    SamplerKind::Independent => SamplerKindDesc::Independent,
                },
                spp: settings.spp,
                target_error: settings.target_error,
                seed: settings.seed,
                integrator: settings.integrator,
                accel: settings.accel.to_string(),
                depth_of_field: settings.depth_of_field,
            },
            output: None,
        }
    }

    /// The same with the samples that the picture has got in the end.
    #[must_use]
    pub fn with_samples(mut self, spp: u32) -> Self {
        if self.settings.target_error.is_none() {
            self.settings.spp = spp;
        }
        self
    }

    /// As files keep it.
    pub fn to_value(&self) -> Value {
        serde_json::to_value(self).unwrap_or_default()
    }

    /// As a file has kept it.
    ///
    /// # Errors
    /// [`Error::Malformed`] if it is not complete.
    pub fn from_value(value: Value, file: &Path) -> Result<Self> {
        let malformed = |e: serde_json::Error| Error::Malformed { file: file.to_owned(), message: format!("its settings: {e}") };
        serde_json::from_value(value).map_err(malformed)
    }

    /// Makes settings those of this picture, with its file as the only output.
    ///
    /// # Errors
    /// [`Error::Usage`] if there is no such accelerator.
    pub fn apply(&self, settings: &mut Settings) -> Result<()> {
        let own = &self.settings;
        let [x, y, width, height] = own.crop;
        settings.size = own.size;
        settings.crop = Crop { x, y, width, height };
        settings.overscan = own.overscan;
        settings.filter = own.filter;
        settings.sampler = match own.sampler {
            SamplerKindDesc::Sobol => SamplerKind::Sobol,
            SamplerKindDesc::Independent => SamplerKind::Independent,
        };
        settings.spp = own.spp;
        settings.target_error = own.target_error;
        settings.seed = own.seed;
        settings.integrator = own.integrator;
        settings.accel = own.accel.parse().map_err(|e| Error::Usage(format!("accelerator {}: {e}", own.accel)))?;
        settings.depth_of_field = own.depth_of_field;
        settings.time_limit = None;
        if let Some(output) = &self.output {
            settings.layers = output.layers.iter().collect();
            settings.outputs = vec![output.clone()];
        }
        Ok(())
    }
}
