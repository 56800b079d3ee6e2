//! The result of a render: picture, layers, statistics, and files that hold them.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use crate::denoise::Report;
use crate::desc::OutputDesc;
use crate::error::{Error, Result};
use crate::film::{Image, Layer};
use crate::output::{self, Format, Matte, RenderInfo};
use crate::render::{Settings, Stats};

use super::layers_of;

/// A picture with its layers and all that its files hold.
#[derive(Clone, Debug)]
pub struct Rendering {
    pub(super) image: Image,
    pub(super) stats: Stats,
    pub(super) settings: Settings,
    pub(super) info: RenderInfo,
    pub(super) is_shard: bool,
    pub(super) scene_file: PathBuf,
    pub(super) accelerator: String,
    pub(super) accelerator_bytes: usize,
    pub(super) load_seconds: f64,
    pub(super) build_seconds: f64,
    pub(super) denoised: Option<Denoised>,
}

/// What the denoiser did.
#[derive(Clone, Debug)]
pub(super) struct Denoised {
    pub report: Report,
    pub library: PathBuf,
}

impl Denoised {
    /// For scripts.
    pub fn statistics(&self) -> Value {
        self.report.statistics(&self.library)
    }
}

/// A layer of a picture: the values of its channels side by side, row by row from the top.
#[derive(Clone, Debug)]
pub struct LayerView<'a> {
    /// The layer's name, such as `color`, `N` or `light_key`.
    pub name: String,
    /// The channels' full names in a file, such as `N.X`.
    pub channels: Vec<String>,
    /// `width * height * channels` values, of the picture's crop.
    pub data: &'a [f32],
}

impl<'a> LayerView<'a> {
    fn new(layer: &'a Layer) -> Self {
        Self { name: layer.name(), channels: layer.channel_names(), data: &layer.data }
    }

    /// The pixels in order, each as a slice of its channels.
    pub fn pixels(&self) -> std::slice::ChunksExact<'a, f32> {
        self.data.chunks_exact(self.channels.len().max(1))
    }
}

impl Rendering {
    /// The picture.
    pub fn image(&self) -> &Image {
        &self.image
    }

    /// Takes the picture.
    pub fn into_image(self) -> Image {
        self.image
    }

    /// What the render did.
    pub fn stats(&self) -> &Stats {
        &self.stats
    }

    /// How it was rendered.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The metadata of files.
    #[doc(hidden)]
    pub fn info(&self) -> &RenderInfo {
        &self.info
    }

    /// Name and version of the accelerator.
    pub fn accelerator(&self) -> &str {
        &self.accelerator
    }

    /// Seconds until every pixel had its first sample, from the beginning of loading.
    pub fn first_pass_seconds(&self) -> f64 {
        self.load_seconds + self.build_seconds + self.stats.first_pass_seconds
    }

    /// What denoising did, if the picture is denoised.
    #[doc(hidden)]
    pub fn denoised(&self) -> Option<&Report> {
        self.denoised.as_ref().map(|denoised| &denoised.report)
    }

    pub(super) fn add_denoised(&mut self, denoised: Denoised) {
        self.info.texts.push((Report::ATTRIBUTE.to_owned(), denoised.report.attribute()));
        self.denoised = Some(denoised);
    }

    /// All layers, the picture itself (`color`) first. Those of Cryptomatte are made when a file is written.
    pub fn layers(&self) -> impl ExactSizeIterator<Item = LayerView<'_>> {
        self.image.layers.iter().map(LayerView::new)
    }

    /// The layer of this name.
    pub fn layer(&self, name: &str) -> Option<LayerView<'_>> {
        self.layers().find(|layer| layer.name == name)
    }

    /// A layer of Cryptomatte with `depth` ranks, an even number, by its name, such as `crypto_object`.
    ///
    /// # Errors
    /// [`Error::Usage`] for another layer, one that was not rendered, or another depth.
    pub fn cryptomatte(&self, layer: &str, depth: u32) -> Result<Matte> {
        let output = OutputDesc { crypto_depth: Some(depth), ..OutputDesc::new("") };
        output::check_output(&output)?;
        let covered = self.image.coverage.as_ref().zip(self.info.identities.as_ref());
        let kinds = layers_of(layer)?;
        let requested = kinds.iter().find(|kind| self.settings.stored_layers().contains(kind));
        requested
            .zip(covered)
            .and_then(|(kind, (coverage, identities))| output::matte(*kind, coverage, identities, depth as usize))
            .ok_or_else(|| Error::Usage(format!("the picture has no Cryptomatte {layer:?} among its layers")))
    }

    /// Writes the picture to an `.exr` file with all layers and metadata, or to a `.png` file. It is written like the
    /// output of the settings with the same name, else like the first one of the same format.
    ///
    /// # Errors
    /// [`Error::Usage`] for another extension; [`Error::Output`] if the file
    /// cannot be written, in which case nothing is left behind.
    pub fn save(&self, file: impl AsRef<Path>) -> Result<()> {
        self.save_as(&self.output(file.as_ref())?)
    }

    /// How [`save`](Self::save) writes a file.
    fn output(&self, file: &Path) -> Result<OutputDesc> {
        let (format, name) = (Format::from_path(file)?, file.to_string_lossy().into_owned());
        let outputs = &self.settings.outputs;
        let like = outputs.iter().find(|output| output.file == name).or_else(|| {
            outputs.iter().find(|output| Format::from_path(Path::new(&output.file)).is_ok_and(|f| f == format))
        });
        Ok(match like {
            Some(like) => OutputDesc { file: name, ..like.clone() },
            None => OutputDesc {
                layers: self.settings.stored_layers(),
                view: Some(self.settings.integrator.view()),
                ..OutputDesc::new(name)
            },
        })
    }

    /// Writes the picture as `output` has it: layers, compression, pixel types of EXR files, exposure and view of PNG
    /// files.
    ///
    /// # Errors
    /// As [`save`](Self::save).
    pub fn save_as(&self, output: &OutputDesc) -> Result<()> {
        output::write(output, &self.image, &self.info)
    }

    /// Writes all outputs of the settings: those of the scene, unless others were given. The result has what became of
    /// each; one that cannot be written is no reason to lose the others.
    pub fn save_outputs(&self) -> Vec<(String, Result<()>)> {
        self.settings.outputs.iter().map(|output| (output.file.clone(), self.save_as(output))).collect()
    }
}

impl Report {
    /// What was done, for scripts; `library` is the denoiser's file.
    pub fn statistics(&self, library: &Path) -> Value {
        json!({
            "denoised": self.attribute(),
            "library": library.display().to_string(),
            "version": self.version,
            "seconds": self.seconds,
            "layers": self.layers,
            "cleaned_pixels": self.cleaned,
            "negative_pixels": self.negative,
        })
    }
}
